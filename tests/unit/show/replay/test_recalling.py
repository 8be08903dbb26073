"""A view that begins in the midst of tasks shows them, once they are recalled, as one that saw their beginnings."""

import logging

import pytest

from formiga_bt.base.errors import JournalError
from formiga_bt.engine.restart.journal_backpressure import JOURNAL, LEVELS
from formiga_bt.engine.restart.resume import copy_of
from formiga_bt.journal.records import KeptStep
from formiga_bt.services.kept.recalling import Recall
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import TaskPicture
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.replay.machine import TimeMachine
from formiga_bt.show.replay.source import KeptTasks
from tests.golden import Wording
from tests.unit.show.replay.flown import Flown

TASKS = ("PickUp-1", "PickUp-2")


def whole_and_view(machine: TimeMachine, begins: int, asked: int) -> tuple[Ledger, EngineView, list[KeptStep]]:
    """Return a ledger of all steps until `asked`, a view of those from `begins` until then, and the others."""
    whole = Ledger(ALL, machine.journal.snapshot_at(machine.first))
    kept = list(machine.events())
    for one in kept[:begins]:
        whole.feed(one.step)
    view = EngineView(2, state=copy_of(whole.state))
    for one in kept[begins:asked]:
        whole.feed(one.step)
        view.ledger.feed(one.step)
    return whole, view, kept[asked:]


def seen(ledger: Ledger, machine: TimeMachine, recall: Recall | None = None) -> FoldedSource:
    tasks, files = KeptTasks(machine.files), machine.files
    return FoldedSource(ledger, files.site, tasks, files.catalogue, recall=recall or (lambda _ids: None))


def told(picture: TaskPicture) -> tuple[object, ...]:
    return picture.task, picture.steps, picture.lines, picture.values, picture.goals


@pytest.mark.parametrize(("begins", "asked"), [(20, 60), (60, 61), (75, 75), (80, 95)])
def test_what_was_before_is_shown_and_goes_on(begins: int, asked: int, good: Flown) -> None:
    with good.machine() as machine:
        whole, view, rest = whole_and_view(machine, begins, asked)
        recall = Recall(view, good.machine)
        here, there = seen(view.ledger, machine, recall), seen(whole, machine)
        for one in [None, *rest]:
            if one is not None:
                whole.feed(one.step)
                view.ledger.feed(one.step)
            if one in (None, rest[len(rest) // 2], rest[-1]):
                for task in [task for task in TASKS if task in whole.state.tasks]:
                    assert told(here.task(task)) == told(there.task(task))
                    assert here.why(task) == there.why(task)
                    assert here.timeline([task]) == there.timeline([task])
        recall.close()


def test_without_it_the_beginning_is_missing(good: Flown) -> None:
    """So the test above can fail."""
    with good.machine() as machine:
        whole, view, _ = whole_and_view(machine, 75, 75)
        assert told(seen(view.ledger, machine).task("PickUp-1")) != told(seen(whole, machine).task("PickUp-1"))


def test_ways_and_all_tasks_are_recalled_too(good: Flown) -> None:
    with good.machine() as machine:
        kept = len(list(machine.events()))
        whole, view, _ = whole_and_view(machine, kept, kept)
        recall = Recall(view, good.machine)
        here, there = seen(view.ledger, machine, recall), seen(whole, machine)
        assert here.timeline() == there.timeline() != seen(EngineView(1).ledger, machine).timeline()
        ways = [
            [(one.agent, one.task) for one in by.chart(["PickUp-2"]).tracks if not one.human] for by in (here, there)
        ]
        assert ways[0] == ways[1] != []
        recall.close()


def test_of_all_tasks_only_the_newest_are_recalled(good: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    """However often all are looked at."""
    monkeypatch.setattr("formiga_bt.services.kept.recalling.MANY", 1)
    with good.machine() as machine:
        kept = len(list(machine.events()))
        _, view, _ = whole_and_view(machine, kept, kept)
        recall = Recall(view, good.machine)
        here = seen(view.ledger, machine, recall)
        assert [{row.task for row in here.timeline().actions} for _ in range(2)] == [{"PickUp-2"}, {"PickUp-2"}]
        recall.close()


def test_it_waits_while_the_journal_lacks_steps_and_survives_one_that_cannot_be_read(
    good: Flown, caplog: pytest.LogCaptureFixture, wording: Wording
) -> None:
    with good.machine() as machine:
        whole, view, _ = whole_and_view(machine, 75, 75)
        recall = Recall(view, good.machine)
        here, there = seen(view.ledger, machine, recall), seen(whole, machine)
        view.state.counters[JOURNAL] = LEVELS["full"]
        assert told(here.task("PickUp-1")) != told(there.task("PickUp-1"))
        view.state.counters[JOURNAL] = LEVELS["ok"]
        assert told(here.task("PickUp-1")) == told(there.task("PickUp-1"))
        recall.close()

        def broken() -> TimeMachine:
            raise JournalError("it is away")

        _, view, _ = whole_and_view(machine, 75, 75)
        here = seen(view.ledger, machine, Recall(view, broken))
        with caplog.at_level(logging.WARNING):
            assert here.task("PickUp-1").task.id == "PickUp-1"
        wording(caplog.text)
