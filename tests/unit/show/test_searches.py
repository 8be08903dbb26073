"""What a search gives is on maps: the region with the share that was seen, and what was found; in history beside the action."""

from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from agents_sim.kinds import Outcome
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from formiga_bt.show.facts import Chart
from formiga_bt.show.history.charting import chart
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.map.files import made

SITE, CATALOGUE = packaged_world()
TASK = packaged_task("explore_region")
Search = Callable[..., tuple[Ledger, Chart]]


@pytest.fixture(scope="module")
def search() -> Search:
    def run(give: dict[str, Any] | None = None, fail: str = "") -> tuple[Ledger, Chart]:
        outcomes = (Outcome(action="Explore", give=give or {}, fail=fail),)
        specs = [replace(s, outcomes=outcomes) for s in fleet_of(SITE, CATALOGUE) if s.id in ("lwd_1", "picker_1")]
        rehearsal = Rehearsal(SITE, CATALOGUE, [TASK], specs)
        rehearsal.run_for(1)
        task = rehearsal.submit("ExploreRegion", {"region": SITE.regions["lake"], "altitude": 10.0})
        assert rehearsal.run_until_ended(task)
        rehearsal.close()
        ledger = Ledger(ALL)
        for step in rehearsal.steps:
            ledger.feed(step)
        return ledger, chart(ledger, SITE, rehearsal.now, [task])

    return run


def test_a_region_that_was_searched_is_a_shape_with_its_share(search: Search) -> None:
    ledger, drawn = search()

    shapes = [shape for shape in drawn.shapes if shape.kind == "searched"]
    assert [shape.name for shape in shapes] == ["52 % seen by lwd_1"]
    lake = next(shape for shape in drawn.shapes if shape.name == "lake")
    assert shapes[0].corners == lake.corners
    row = next(r for r in ledger.story("ExploreRegion-1").rows if r.action == "Explore")
    assert row.detail == "52 % seen"
    assert [mark for mark in drawn.marks if mark.kind == "find"] == []
    assert "52 % seen by lwd_1" in made(drawn, "txt").decode()


def test_finds_are_marks(search: Search) -> None:
    at = {"east_m": 200.0, "north_m": -200.0}
    ledger, drawn = search({"finds": [at, {"east_m": 250.0, "north_m": -235.0}]})

    marks = [mark for mark in drawn.marks if mark.kind == "find"]
    assert [(m.name, m.at.east_m, m.at.north_m) for m in marks] == [
        ("find 1", 200.0, -200.0),
        ("find 2", 250.0, -235.0),
    ]
    row = next(r for r in ledger.story("ExploreRegion-1").rows if r.action == "Explore")
    assert row.detail == "52 % seen, 2 finds"
    text = made(drawn, "txt").decode()
    assert "find 1" in text
    for form in ("svg", "png"):
        assert made(drawn, form)


def test_a_search_that_failed_gave_nothing(search: Search) -> None:
    _, drawn = search(fail="no_camera")
    assert [shape for shape in drawn.shapes if shape.kind == "searched"] == []


def test_the_map_of_another_task_has_none_of_it(search: Search) -> None:
    ledger, _ = search({"finds": [{"east_m": 200.0, "north_m": -200.0}]})
    other = chart(ledger, SITE, ledger.state.now, ["MoveTask-1"])
    assert [s for s in other.shapes if s.kind == "searched"] + [m for m in other.marks if m.kind == "find"] == []


def test_finds_have_the_type_of_the_catalogue() -> None:
    assert {name: str(kind) for name, kind in CATALOGUE.actions["Explore"].result.items()} == {
        "coverage": "percent", "cells": "int", "seen": "int", "finds": "list of place",
    }  # fmt: skip
