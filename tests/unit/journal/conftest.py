"""Journals in temporary places, and steps of missions to put into them."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState, fold, snapshot
from formiga_bt.journal import schema
from formiga_bt.journal.past import without_ended
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from formiga_bt.nodes.blackboard import Blackboard
from tests.replay.missions import MISSIONS, rehearsal
from tests.unit.journal.postgres import server

WALL = 1_700_000_000_000_000


@cache
def steps_of(name: str) -> tuple[EngineStep, ...]:
    """Return all steps of a mission, from the engine's first."""
    flight = rehearsal()
    MISSIONS[name](flight)
    flight.close()
    return tuple(flight.steps)


class Recording:
    """Feeds a writer with steps as an engine would: the state is that after the last step given."""

    def __init__(self, journal: Journal, state: EngineState | None = None, **options: Any) -> None:
        self.state = state or EngineState()
        self.board = Blackboard()
        self.clock = 0.0
        self.writer = Writer(journal, lambda: self.state, wall=lambda: WALL, clock=lambda: self.clock, **options)
        self.writer.begin()

    def feed(self, steps: Sequence[EngineStep], batch: int = 1) -> None:
        for first in range(0, len(steps), batch):
            part = steps[first : first + batch]
            for step in part:
                fold(self.state, self.board, step)
            assert self.writer.keep(part).durable


def folded(steps: Sequence[EngineStep]) -> EngineState:
    """Return the state after steps that begin with the engine's first."""
    state, board = EngineState(), Blackboard()
    for step in steps:
        fold(state, board, step)
    return state


def as_told(state: EngineState) -> bytes:
    """Return a state as a journal tells it."""
    return snapshot(without_ended(state))


Opener = Callable[..., Journal]


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """Return the URL of a database."""
    with server() as url:
        yield url


@pytest.fixture
def database(postgres: str) -> str:
    """Return the URL of an empty PostgreSQL database."""
    engine = sa.create_engine(postgres.replace("postgresql:", "postgresql+psycopg:"))
    with engine.begin() as connection:
        schema.tables.drop_all(connection)
    engine.dispose()
    return postgres


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=[pytest.mark.external, pytest.mark.network])])
def where(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Return where an empty journal may be: in each kind of database."""
    if request.param == "sqlite":
        return str(tmp_path / "journal.db")
    url: str = request.getfixturevalue("database")
    return url


@pytest.fixture
def opened(where: str) -> Iterator[Opener]:
    """Open journals; they are closed at the end."""
    journals: list[Journal] = []

    def open_(other: str | Path = "", site: str = "demo", **options: Any) -> Journal:
        journal = Journal(other or where, site, **{"durability": "normal", **options})
        journals.append(journal)
        return journal

    yield open_
    for journal in journals:
        journal.close()


@pytest.fixture
def taken(opened: Opener) -> Journal:
    """Return a journal that is taken."""
    journal = opened()
    journal.take()
    return journal
