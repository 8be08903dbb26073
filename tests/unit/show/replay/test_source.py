"""A journal at its end shows what a ledger shows that saw every step; before that, what it showed then."""

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import JournalError, TaskError
from formiga_bt.show.facts import TaskPicture, Timeline
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.replay.machine import TimeMachine
from formiga_bt.show.replay.source import JournalSource
from tests.golden import Wording
from tests.unit.show.replay.flown import SITE, Flown


@pytest.fixture
def machine(good: Flown) -> Iterator[TimeMachine]:
    with good.machine() as machine:
        yield machine


def rough(picture: TaskPicture) -> TaskPicture:
    """Return a picture without what telemetry alone changes."""
    agents = [replace(agent, battery=None, at=None) for agent in picture.agents]
    return replace(picture, at=0, agents=tuple(agents))


@pytest.mark.parametrize("task", ["PickUp-1", "PickUp-2"])
def test_a_task_at_the_end_is_what_was_seen_live(task: str, good: Flown, machine: TimeMachine) -> None:
    """Steps, values, lines, goals and words are the same, for all but the newest positions."""
    source, live = JournalSource(machine), good.live(machine)

    assert rough(live.task(task)) == rough(source.task(task))
    assert live.why(task) == source.why(task)


def test_pictures_of_time_and_space_are_those_that_were_seen_live(good: Flown, machine: TimeMachine) -> None:
    """Gantt, map and stats of a task, and of all."""
    source, live = JournalSource(machine), good.live(machine)

    def rows(found: Timeline) -> list[object]:
        return [*found.actions, *found.waits]

    assert rows(live.timeline(["PickUp-1"])) == rows(source.timeline(["PickUp-1"]))
    assert rows(live.timeline()) == rows(source.timeline())
    assert live.stats().tasks == source.stats().tasks
    ways = [track for track in source.chart(["PickUp-2"]).tracks if not track.human]
    seen = [track for track in live.chart(["PickUp-2"]).tracks if not track.human]
    assert [(way.agent, way.task) for way in ways] == [(way.agent, way.task) for way in seen]
    assert ways[0].points[-1].east_m == pytest.approx(seen[0].points[-1].east_m, abs=1.0)


def test_a_moment_is_what_was_seen_then(good: Flown, machine: TimeMachine) -> None:
    """At each fifth step the tasks, questions and agents are those of a ledger that was fed until there."""
    ledger, checked = Ledger(ALL, machine.journal.snapshot_at(machine.first)), 0
    kept = list(machine.events())
    for n, one in enumerate(kept):
        ledger.feed(one.step)
        if n % 5 == 0 and (n + 1 == len(kept) or kept[n + 1].at > one.at):
            then = FoldedSource(ledger, machine.files.site, {}, clock=lambda at=one.at: at).now(over=True)
            now = JournalSource(machine, one.at).now(over=True)
            assert then.tasks == now.tasks
            assert [q.number for q in then.questions] == [q.number for q in now.questions]
            assert [(a.id, a.task, a.action, a.landed) for a in then.agents] == [
                (a.id, a.task, a.action, a.landed) for a in now.agents
            ]
            assert now.engine == "past"
            checked += 1
    assert checked > 5


def test_a_task_that_the_engine_forgot_is_found(good: Flown, machine: TimeMachine) -> None:
    """It is not in the state any more, but its steps are kept."""
    at = machine.last
    moment = machine.moment

    def forgotten(at: int, since: int | None = None, *, ways: bool = False) -> Ledger:
        ledger = moment(at, since, ways=ways)
        ledger.state.tasks.pop("PickUp-1")
        return ledger

    machine.moment = forgotten  # type: ignore[method-assign]
    picture = JournalSource(machine, at).task("PickUp-1")

    assert picture.task.status == "SUCCEEDED"
    assert len(picture.lines) > 5


def test_after_a_gap_what_is_left_is_shown(good: Flown, tmp_path: Path, wording: Wording) -> None:
    """Steps between two snapshots are lost: no moment in there, and after it nothing is folded over it."""
    where = tmp_path / "journal.db"
    shutil.copy(good.where, where)
    with good.machine() as whole:
        low, high = whole.journal.snapshots()[2:4]
        end = JournalSource(whole).now(over=True)
    with closing(sqlite3.connect(where)) as raw:
        raw.execute("DELETE FROM formiga_steps WHERE seq > ? AND seq <= ?", (low[0], high[0]))
        raw.execute(
            "INSERT INTO formiga_gaps VALUES (1, ?, ?, ?, ?, 'the disk was full')",
            (low[0] + 1, high[0], low[1] + 1, high[1]),
        )
        raw.commit()
    with TimeMachine(where, SITE) as machine:
        source = JournalSource(machine)
        assert end.tasks == source.now(over=True).tasks
        assert "SUCCEEDED" == source.task("PickUp-1").task.status == source.task("PickUp-2").task.status
        assert {"PickUp-1", "PickUp-2"} == {task.id for task in source.timeline(["PickUp-1", "PickUp-2"]).tasks}
        with pytest.raises(JournalError) as refused:
            JournalSource(machine, (low[1] + high[1]) // 2).now()
        wording(refused.value)


def test_what_never_was_is_refused(machine: TimeMachine) -> None:
    with pytest.raises(TaskError, match="PickUp-7"):
        JournalSource(machine).task("PickUp-7")
    with pytest.raises(JournalError, match="earliest moment"):
        JournalSource(machine, machine.first - SECOND).now()
