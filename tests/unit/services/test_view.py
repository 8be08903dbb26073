"""The read-only copy: bounded, and never in the way; the feed: numbered, bounded; the words: complete."""

import re
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel.changes import LockdownPut, TaskPut
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, Operator, TimerDue
from formiga_bt.engine.kernel.records import Lockdown, TaskRecord, TaskRequest, TaskRestart, TaskTimes
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.timers import TurnDue
from formiga_bt.nodes.run import TaskOutcome
from formiga_bt.rehearsal.testing import packaged_task
from formiga_bt.services.feed import Feed
from formiga_bt.services.view import EngineView
from formiga_bt.show.history.records import task_fact
from formiga_bt.show.history.urgency import UrgencyIndex
from formiga_bt.show.why import words
from formiga_bt.show.why.places import StepPlaces, running_leaves
from formiga_bt.show.why.words import span
from tests.golden import Wording
from tests.unit.services.fakes import NOW

ROOT = Path(__file__).parents[3]


def step(seq: int, *changes: object, effects: tuple[object, ...] = ()) -> EngineStep:
    return EngineStep(seq, seq * 1000, TimerDue(TurnDue()), tuple(changes), effects)  # type: ignore[arg-type]


def ended(number: int) -> TaskPut:
    return TaskPut(
        TaskRecord(
            id=f"T-{number}",
            name="T",
            order=number,
            request=TaskRequest(bundle=""),
            status="SUCCEEDED",
            section="done",
            times=TaskTimes(ended_at=1),
        )
    )


def test_ended_tasks_are_kept_up_to_a_number() -> None:
    view = EngineView(1, ended_kept=3)
    view.start()
    for number in range(10):
        view.feed_step(step(number + 1, ended(number), effects=(Alarm("x", "y", f"T-{number}"),)))
    view.catch_up()

    with view.reading() as state:
        assert list(state.tasks) == ["T-7", "T-8", "T-9"]
        assert list(view.ledger.stories) == ["T-7", "T-8", "T-9"]
    assert [n for n in range(10) if view.notices(f"T-{n}")] == [7, 8, 9]
    view.stop()
    assert view.feed.closed


def test_a_step_that_cannot_be_folded_does_not_end_the_view(caplog: object) -> None:
    view = EngineView(1)
    view.start()
    view.feed_step(step(1, TaskPut(None)))  # type: ignore[arg-type]
    view.feed_step(step(2, ended(1)))
    view.catch_up()
    with view.reading() as state:
        assert list(state.tasks) == ["T-1"]
    view.stop()


def test_what_cannot_be_told_is_folded_all_the_same(caplog: pytest.LogCaptureFixture, wording: Wording) -> None:
    view = EngineView(1)
    view.feed.add = None  # type: ignore[assignment,method-assign]
    view.start()
    view.feed_step(step(1, ended(1), ended(2)))
    view.catch_up()
    with view.reading() as state:
        assert list(state.tasks) == ["T-1", "T-2"]
    wording(record.message for record in caplog.records)
    view.stop()


def test_lockdown_is_folded_and_told(wording: Wording) -> None:
    view = EngineView(1)
    view.start()
    view.feed_step(step(1, LockdownPut(Lockdown("return", "eve", 0))))
    view.feed_step(step(2, LockdownPut(None)))
    view.catch_up()

    assert [event.data["on"] for event in view.feed.after(0)[0]] == [True, False]
    wording([event.text for event in view.feed.after(0)[0]])
    view.stop()


def test_the_feed_forgets_the_oldest_and_says_so() -> None:
    feed = Feed(epoch=3, kept=4)
    for number in range(1, 8):
        feed.add("task", number, f"e{number}")

    assert ([e.text for e in feed.after(5)[0]], feed.after(5)[1]) == (["e6", "e7"], False)
    assert ([e.text for e in feed.after(0)[0]], feed.after(0)[1]) == (["e4", "e5", "e6", "e7"], True)
    assert feed.after(7) == ([], False)
    assert [feed.read_id(text) for text in ("3.5", "2.5", "3.99", "3.x", "", "5")] == [5, None, None, None, None, None]


def test_listeners_are_told_until_they_end() -> None:
    feed = Feed(epoch=1)
    told: list[int] = []
    end = feed.listen(lambda: told.append(1))
    feed.announce()
    end()
    feed.announce()
    assert told == [1]


def test_every_documented_code_of_waits_and_refusals_has_words() -> None:
    text = (ROOT / "docs" / "reasons.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))

    def codes(title: str) -> set[str]:
        cells = re.findall(r"^\| (`[^|]+) \|", sections[title], re.MULTILINE)
        return {code for cell in cells for code in re.findall(r"`([a-z_]+)`", cell)}

    assert codes("What a waiting goal waits for") <= set(words.GATE)
    assert codes("Why the allocator passed an agent over") <= set(words.VERDICTS)
    assert codes("Why a task ended") <= set(words.REASONS)
    assert codes("Why a step failed") <= set(words.REASONS)


def test_running_steps_are_found_in_the_file() -> None:
    places = StepPlaces(packaged_task("pick_up"))
    memory = dict.fromkeys(
        ["steps", "steps/steps[0]", "steps/steps[0].call.steps[0]:when", "steps/steps[0].call.steps[0]"]
    )
    (leaf,) = running_leaves(memory)  # type: ignore[arg-type]
    found = places.of(leaf + "@2")
    assert found is not None
    assert (found.kind, Path(found.mark.file).name) == ("do", "flying.yaml")
    assert places.of("steps/steps[99]") is None


def test_spans() -> None:
    assert [span(s * 1_000_000) for s in (-1, 5, 600, 7200)] == ["0 s", "5 s", "10 min", "2.0 h"]


def test_a_section_that_a_step_only_passes_through_is_not_told() -> None:
    """In `finally` nothing was done; the ways home of `recover` are told."""
    view = EngineView(1)
    view.start()
    task = TaskRecord(id="T-1", name="T", order=1, request=TaskRequest(bundle=""), status="ENDING", section="steps")
    view.feed_step(step(1, TaskPut(task)))
    view.feed_step(step(2, *(TaskPut(replace(task, section=one)) for one in ("finally", "recover"))))  # type: ignore[arg-type]
    view.catch_up()
    told = [event.text for event in view.feed.after(0)[0]]
    view.stop()
    assert told == ["T-1 ENDING", "T-1: recover"]


def test_refused_orders_and_restarts_are_told_as_what_they_are(wording: Wording) -> None:
    view = EngineView(1)
    view.start()
    given = Operator("continue", "hwd_1", "eve")
    view.feed_step(EngineStep(1, 1000, given, (), (), Refusal("not_held", "hwd_1 is not held")))
    anew = TaskRecord(
        id="T-1",
        name="T",
        order=1,
        request=TaskRequest(bundle=""),
        status="ENDING",
        outcome=TaskOutcome(status="CANCELED", code="restarted", reason="by eve"),
        restart=TaskRestart(why="restart"),
    )
    view.feed_step(step(2, TaskPut(anew)))
    view.catch_up()

    wording([event.text for event in view.feed.after(0)[0]])
    with view.reading():
        shown = task_fact(UrgencyIndex(view.ledger, NOW), anew)
    assert (shown.status, shown.code, shown.reason) == ("ENDING", "restarted", "by eve")
    view.stop()
