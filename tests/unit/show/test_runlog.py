"""The fold of a run: actions with start and end, lines for people, least battery."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ClearanceHold, OperatorHold
from formiga_bt.engine.kernel.inputs import Alarm, Effect, EngineStep, NotifyPeople, PublishState, Started
from formiga_bt.engine.kernel.records import (
    AgentRecord,
    GoalRecord,
    Question,
    TaskHold,
    TaskRecord,
    TaskRequest,
)
from formiga_bt.nodes.run import TaskOutcome
from formiga_bt.show.history.runlog import LogLine, RunLog
from tests.golden import Wording


class Feeder:
    """Feeds steps of changes and effects, a second apart."""

    def __init__(self) -> None:
        self.log = RunLog()
        self.seq = 0

    def __call__(self, *changes: ch.Change, effects: tuple[Effect, ...] = ()) -> None:
        self.seq += 1
        self.log.feed(EngineStep(self.seq, self.seq * SECOND, Started(1), changes, effects))


@pytest.fixture
def feed() -> Feeder:
    return Feeder()


def goal(state: str, code: str = "", goal_id: str = "T-1/1/steps/a") -> ch.GoalPut:
    return ch.GoalPut(GoalRecord(id=goal_id, agent="hwd_1", action="GoTo", task="T-1", state=state, code=code))  # type: ignore[arg-type]


def task(status: str, order: int = 1, **more: object) -> ch.TaskPut:
    return ch.TaskPut(
        TaskRecord(id=f"T-{order}", name="T", order=order, request=TaskRequest(bundle=""), status=status, **more)
    )  # type: ignore[arg-type]


def test_an_action_lasts_from_its_sending_to_its_end(feed: Feeder) -> None:
    feed(goal("gated"))
    assert feed.log.actions == []  # nothing has left yet
    feed(goal("sent"))
    feed(goal("accepted"), goal("running"))
    (row,) = feed.log.actions
    assert (row.start, row.end, row.outcome) == (2 * SECOND, None, "running")
    feed(goal("succeeded"))
    feed(ch.GoalDrop("T-1/1/steps/a"))
    assert (row.end, row.outcome) == (4 * SECOND, "succeeded")
    assert len(feed.log.actions) == 1


def test_an_end_has_its_code_but_not_twice(feed: Feeder) -> None:
    feed(goal("sent"), goal("failed", "low_battery"), goal("sent", goal_id="b"), goal("in_doubt", "in_doubt", "b"))
    assert [row.outcome for row in feed.log.actions] == ["failed low_battery", "in_doubt"]


def test_a_question_taken_back_is_withdrawn(feed: Feeder) -> None:
    feed(goal("sent"))
    feed(ch.GoalDrop("T-1/1/steps/a"))
    assert [(row.end, row.state) for row in feed.log.actions] == [(2 * SECOND, "withdrawn")]


def test_a_task_gives_a_line_when_its_status_or_hold_changes(feed: Feeder, wording: Wording) -> None:
    feed(task("PENDING"), effects=(PublishState("T-1", "PENDING"),))
    feed(task("ACTIVE"), effects=(PublishState("T-1", "ACTIVE"),))
    feed(task("ACTIVE", outcome=TaskOutcome(reason="of no interest")))
    feed(
        task("ACTIVE", hold=TaskHold(causes=(ClearanceHold("hwd_1"), OperatorHold()))),
        effects=(PublishState("T-1", "HELD"),),
    )
    feed(task("ACTIVE"), effects=(PublishState("T-1", "ACTIVE"),))
    last = (NotifyPeople("home", ("a",), "info"), PublishState("T-1", "FAILED", "timeout", "too slow"))
    feed(task("FAILED", outcome=TaskOutcome(code="timeout", reason="too slow")), effects=last)
    wording([line.text for line in feed.log.lines])
    assert feed.log.since_start(feed.log.lines[-1].at) == 5.0


def test_a_question_is_told_with_its_options_and_then_its_answer(feed: Feeder, wording: Wording) -> None:
    open_ = Question(
        id="q", number="Q1", task="T-1", priority="medium", kind="ask", text="Ready?", options=("yes", "no"),
        tiers=(("ann", "bob"),),
    )  # fmt: skip
    feed(ch.QuestionPut(open_))
    feed(ch.QuestionPut(replace(open_, reply={"answer": "no", "by": "bob", "at": 1})))
    feed(ch.QuestionDrop("q"))

    wording([line.text for line in feed.log.lines])


def test_notices_and_alarms_are_lines(feed: Feeder) -> None:
    feed(
        effects=(
            NotifyPeople("look", ("a", "b"), "warning"),
            NotifyPeople("x", (), "info"),
            Alarm("lost", "hwd_1 is lost", "T-1"),
        )
    )
    assert feed.log.lines == [
        LogLine(SECOND, "to a, b: look", "warning"),
        LogLine(SECOND, "to nobody: x", "info"),
        LogLine(SECOND, "hwd_1 is lost (lost, T-1)", "alarm"),
    ]


def test_the_least_battery_is_of_machines(feed: Feeder) -> None:
    for percent in (90.0, 40.0, 60.0):
        feed(ch.AgentPut(AgentRecord(id="hwd_1", type="hwd", battery=percent)))
    feed(ch.AgentPut(AgentRecord(id="picker_1", type="picker", mobility="people", battery=5.0)))
    assert feed.log.least_battery == {"hwd_1": 40.0}


def test_all_succeeded_means_all_and_at_least_one(feed: Feeder) -> None:
    assert not feed.log.all_succeeded()
    feed(task("SUCCEEDED"))
    assert feed.log.all_succeeded()
    feed(task("CANCELED", order=2))
    assert not feed.log.all_succeeded()


def test_rows_of_tasks_keep_their_order(feed: Feeder) -> None:
    feed(goal("sent"), ch.GoalPut(GoalRecord(id="x", agent="a", action="Y", task="T-2", state="sent")))
    assert [row.goal for row in feed.log.rows_of(["T-2"])] == ["x"]
    assert len(feed.log.rows_of(["T-1", "T-2"])) == 2


def test_its_state_is_the_engines(tmp_path: Path) -> None:
    from formiga_bt.base.packaged import folder
    from formiga_bt.cli.inputs import read_task, read_world
    from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of

    world = read_world((), folder("trees") / "demo-site.yaml")
    move = read_task(folder("trees") / "move_task.yaml", world).task
    assert world.site is not None
    assert move is not None
    rehearsal = Rehearsal(world.site, world.catalogue, [move], fleet_of(world.site, world.catalogue))
    rehearsal.run_for(1.0)
    task_id = rehearsal.submit("MoveTask")
    assert rehearsal.run_until_ended(task_id)
    log = RunLog()
    for step in rehearsal.steps:
        log.feed(step)
    rehearsal.close()
    assert log.state == rehearsal.engine.state
    assert log.all_succeeded()
