"""Missions in virtual time, over the shipped world with simulated agents."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.lang.model import Task
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import check_rehearsal, packaged_task, packaged_world

Fly = Callable[..., Rehearsal]


@pytest.fixture
def fly() -> Iterator[Fly]:
    """Start a rehearsal; after the test, what must hold always is checked."""
    flown: list[Rehearsal] = []

    def start(
        *tasks: Task,
        scripts: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
        change: Mapping[str, Mapping[str, Any]] | None = None,
        without: Sequence[str] = (),
        more: Sequence[AgentSpec] = (),
    ) -> Rehearsal:
        site, catalogue = packaged_world()
        specs = [s for s in fleet_of(site, catalogue, scripts=scripts) if s.id not in without]
        specs = [replace(s, **(change or {}).get(s.id, {})) for s in specs]
        shipped = [packaged_task("move_task"), packaged_task("pick_up")]
        rehearsal = Rehearsal(site, catalogue, [*shipped, *tasks], [*specs, *more])
        rehearsal.run_for(1)
        flown.append(rehearsal)
        return rehearsal

    yield start
    for rehearsal in flown:
        check_rehearsal(rehearsal)
        rehearsal.close()
