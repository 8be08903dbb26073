"""What the demo shows: plain lines in order of time, the live display, the closing table."""

import io

import pytest
from msgspec.structs import replace
from rich.console import Console

from agents_sim.referee import Crash, Pass, Verdict
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import LockdownHold, OperatorHold
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, PublishState, Started
from formiga_bt.engine.kernel.records import (
    AgentRecord,
    GoalRecord,
    Lockdown,
    StandingOrder,
    TaskAgents,
    TaskHold,
    TaskRecord,
    TaskRequest,
    TaskTimes,
)
from formiga_bt.nodes.run import TaskOutcome
from formiga_bt.show.history.runlog import RunLog
from formiga_bt.show.live import LivePrinter, LiveView, PlainView
from tests.golden import Wording

CLEAN = Verdict((), (), (), Pass("hwd_1", "hwd_2", 0, 30.2))


def console(width: int = 100) -> Console:
    return Console(file=io.StringIO(), width=width, highlight=False)


def said(view: LivePrinter) -> str:
    assert isinstance(view.console.file, io.StringIO)
    return view.console.file.getvalue()


def goal(state: str, **more: object) -> ch.GoalPut:
    return ch.GoalPut(GoalRecord(id="g", agent="hwd_1", action="GoTo", task="T-1", state=state, **more))  # type: ignore[arg-type]


def task(status: str, **more: object) -> ch.TaskPut:
    given = {"request": TaskRequest(bundle=""), "times": TaskTimes(submitted_at=SECOND), **more}
    return ch.TaskPut(TaskRecord(id="T-1", name="T", order=1, status=status, **given))  # type: ignore[arg-type]


@pytest.fixture
def log() -> RunLog:
    log = RunLog()
    agent = AgentRecord(id="hwd_1", type="hwd", battery=80.0, position=Position(0.0, 0.0, 60.0), pool="ASSIGNED")
    log.feed(
        EngineStep(
            1,
            SECOND,
            Started(1),
            (ch.AgentPut(agent), task("ACTIVE", section="steps")),
            (PublishState("T-1", "ACTIVE"),),
        )
    )
    log.feed(EngineStep(2, 3 * SECOND, Started(1), (goal("sent"), goal("running")), ()))
    return log


def end(log: RunLog, status: str = "SUCCEEDED", state: str = "succeeded", code: str = "") -> None:
    done = task(
        status,
        section="done",
        outcome=TaskOutcome(code=code),
        agents=TaskAgents(granted=("hwd_1",)),
        times=TaskTimes(submitted_at=SECOND, ended_at=9 * SECOND),
    )
    log.feed(
        EngineStep(3, 9 * SECOND, Started(1), (goal(state, code=code), done), (PublishState("T-1", status, code),))
    )


def test_plain_lines_come_in_order_of_time_and_once(log: RunLog, wording: Wording) -> None:
    view = PlainView()
    view.console = console()
    view.show(log, 3 * SECOND)
    view.show(log, 4 * SECOND)
    wording(said(view).splitlines())


def test_an_action_that_does_not_succeed_is_told(log: RunLog, wording: Wording) -> None:
    view = PlainView()
    view.console = console()
    view.show(log, 3 * SECOND)
    end(log, "FAILED", "failed", "no_progress")
    view.show(log, 9 * SECOND)
    wording(said(view).splitlines()[-2:])


def test_the_closing_table_and_what_comes_next(log: RunLog, wording: Wording) -> None:
    end(log)
    view = PlainView()
    view.console = console()
    view.close_with(log, CLEAN)
    text = said(view)
    row = next(line for line in text.splitlines() if line.startswith("│ T-1"))
    assert [cell.strip() for cell in row.split("│")[1:-1]] == ["T-1", "hwd_1", "1", "8 s", "SUCCEEDED"]
    wording(text, text.splitlines()[-1])


def test_no_praise_after_a_crash_or_a_failure(log: RunLog) -> None:
    end(log)
    crashed = Verdict((Crash("hwd_1", "hwd_2", 0, 0.5),), (), (), None)
    view = PlainView()
    view.console = console()
    view.close_with(log, crashed)
    assert "crashes: 1" in said(view)
    assert "All tasks succeeded" not in said(view)


def test_a_run_without_tasks_closes_without_a_table(wording: Wording) -> None:
    view = PlainView()
    view.console = console()
    view.close_with(RunLog(), Verdict((), (), (), None))
    wording(said(view))


def test_long_lines_are_not_wrapped(log: RunLog) -> None:
    log.feed(EngineStep(3, 4 * SECOND, Started(1), (), (Alarm("lost", "a text that is longer than the width " * 3),)))
    view = PlainView()
    view.console = console(width=40)
    view.show(log, 4 * SECOND)
    assert sum("longer" in line for line in said(view).splitlines()) == 1


def test_the_live_display_tells_who_is_missing_and_what_goes_on(log: RunLog) -> None:
    view = LiveView()
    view.console = screen = Console(file=io.StringIO(), width=120, force_terminal=True, highlight=False)
    view._live.console = screen
    with view:
        view.waiting(["hwd_2", "picker_1"])
        view.show(log, 5 * SECOND)
        view._live.refresh()
        first = said(view)
        log.feed(EngineStep(3, 6 * SECOND, Started(1), (goal("gated", code="layer", text="hwd_2 is there"),), ()))
        view.waiting([])
        view.show(log, 6 * SECOND)
        view._live.refresh()
    assert "waiting for hwd_2, picker_1" in first
    assert "engine time 4 s" in first
    for word in ("T-1", "ACTIVE", "hwd_1.GoTo", "80 %", "60 m", "ASSIGNED"):
        assert word in first
    later = said(view)[len(first) :]
    assert "waits: layer hwd_2 is there" in later
    assert "waiting for" not in later


def test_the_live_display_shows_held_tasks_as_held(log: RunLog) -> None:
    log.feed(
        EngineStep(
            3,
            6 * SECOND,
            Started(1),
            (task("ACTIVE", section="steps", hold=TaskHold(causes=(OperatorHold(),))), ch.GoalDrop("g")),
            (),
        )
    )
    view = LiveView()
    view.console = screen = Console(file=io.StringIO(), width=120, force_terminal=True, highlight=False)
    view._live.console = screen
    with view:
        view.show(log, 6 * SECOND)
        view._live.refresh()
    assert "HELD" in said(view)
    assert "operator" in said(view)


def test_the_live_display_shows_lockdown_on_top_and_the_order_on_each_machine(log: RunLog) -> None:
    agent = log.state.agents["hwd_1"]
    order = StandingOrder(agent="hwd_1", stop="return", by="eve", scope="lockdown", at=0)
    changes = (
        ch.LockdownPut(Lockdown("return", "eve", 0)),
        ch.OrderPut("hwd_1", order),
        ch.AgentPut(replace(agent, taken=True, control="pilot", breach="!reserve")),
        task("ACTIVE", section="steps", hold=TaskHold(causes=(LockdownHold(),))),
        goal("interrupted", code="stopped"),
    )
    log.feed(EngineStep(3, 6 * SECOND, Started(1), changes, ()))
    view = LiveView()
    view.console = screen = Console(file=io.StringIO(), width=140, force_terminal=True, highlight=False)
    view._live.console = screen
    with view:
        view.show(log, 6 * SECOND)
        view._live.refresh()
    for words in (
        "LOCKDOWN (return) by eve: formiga lockdown release",
        "lockdown; hwd_1.GoTo interrupted",
        "return, pilot, reserve",
    ):
        assert words in said(view)
