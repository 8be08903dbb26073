"""The engine is a function (execution 1): time, deadlines, steps as data, equal inputs, folding, going on from a state."""

import msgspec
import pytest

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, GoalEventInput, SendGoal, Started, Submit, TimerDue
from formiga_bt.engine.kernel.replies import Done, Refusal
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.engine.kernel.timers import AllocationDue, TaskDue, Timer, TurnDue
from formiga_bt.rehearsal.testing import effects, folded
from formiga_bt.transport.messages import GoalEvent
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, task, yard

WAIT = CART + "steps: [{wait: 10 s}]"


def engine(text: str = WAIT, state: EngineState | None = None) -> Engine:
    site, catalogue = yard()
    return Engine(site, catalogue, {"Try": task(text)}, state=state)


def test_time_that_goes_back_is_refused() -> None:
    one = engine()
    one.handle(10, Started(1))

    with pytest.raises(AssertionError, match="goes back"):
        one.handle(9, Started(1))


def test_a_deadline_that_was_passed_over_is_refused() -> None:
    one = engine()
    one.handle(10, Submit("Try"))
    due = one.next_deadline()
    assert due is not None

    with pytest.raises(AssertionError, match="passed over"):
        one.handle(due[0] + 1, Started(1))


@pytest.mark.parametrize("timer", [TurnDue(), TaskDue("Try-1", "wait")])
def test_a_timer_that_is_not_the_next_is_refused(timer: Timer) -> None:
    one = engine()
    one.handle(10, Submit("Try"))

    with pytest.raises(AssertionError, match="next deadline"):
        one.handle(10, TimerDue(timer))


def test_a_timer_before_its_time_is_refused() -> None:
    one = engine()
    one.handle(10, Submit("Try"))
    one.handle(10, TimerDue(AllocationDue()))
    due = one.next_deadline()
    assert due is not None

    with pytest.raises(AssertionError, match="not due"):
        one.handle(due[0] - 1, TimerDue(due[1]))


def test_an_input_at_the_very_deadline_goes_before_the_timer() -> None:
    one = engine()
    one.handle(10, Submit("Try"))

    assert one.handle(10, Abort("Try-1")).reply == Done()


def test_a_refused_submit_changes_nothing_and_says_why() -> None:
    step = engine().handle(10, Submit("Nope"))

    assert isinstance(step.reply, Refusal)
    assert step.reply.code == "unknown_task"
    assert (step.changes, step.effects) == ((), ())


def test_steps_are_data_that_survive_a_journal(make: Make) -> None:
    bench = make(CART + "steps: [{do: cart.Move, save_as: got}, {check: got.n > 1}]")
    one = bench.start()
    bench.cart.succeed({"n": 2})
    bench.end(one)

    kept = [msgspec.json.decode(msgspec.json.encode(step), type=EngineStep) for step in bench.steps]

    assert snapshot(folded(kept)) == snapshot(bench.engine.state)


def test_news_of_goals_that_nobody_knows_changes_nothing(make: Make) -> None:
    bench = make(WAIT)

    step = bench.driver.feed(GoalEventInput(GoalEvent(goal_id="x/1/steps/y", agent="c1", state="failed", n=3)))

    assert (step.changes, step.effects) == ((), ())


def test_old_news_of_a_goal_is_ignored(make: Make) -> None:
    bench = make(CART + "steps: [{do: cart.Home}]")
    one = bench.start()
    bench.cart.side.feedback(bench.cart.goal.goal_id, progress=0.5)
    bench.run_for(0.2)
    goal = bench.cart.goal.goal_id
    assert bench.engine.state.goals[goal].state == "running"

    bench.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c1", state="accepted", n=1)))
    bench.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c2", state="failed", n=9)))

    assert bench.engine.state.goals[goal].state == "running"
    bench.abort(one)


def test_the_epoch_goes_along_with_every_goal(make: Make) -> None:
    bench = make(CART + "steps: [{do: cart.Home}]")
    bench.driver.feed(Started(7))
    one = bench.start()

    assert [goal.epoch for goal in effects(bench, SendGoal)] == [7]
    bench.abort(one)


def test_no_goal_id_is_sent_twice(make: Make) -> None:
    bench = make(CART + "steps: [{do: cart.Home, retry: {attempts: 4}}]")
    bench.cart.auto = {"Home": 1}
    bench.cart.ends = ["a", "b", "c"]
    bench.end(bench.start())

    ids = [goal.goal_id for goal in effects(bench, SendGoal)]
    assert len(ids) == len(set(ids)) == 4


def test_an_engine_goes_on_from_a_snapshot_where_another_stood(make: Make) -> None:
    text = CART + "steps: [{do: cart.Home, timeout: 50 s}, {wait: 10 s}]"
    bench = make(text)
    one = bench.start()

    other = engine(text, reloaded(bench.engine.state))

    assert snapshot(other.state) == snapshot(bench.engine.state)
    assert other.statuses(one) == bench.engine.statuses(one)
    assert other.next_deadline() == bench.engine.next_deadline()
    event = GoalEvent(goal_id=bench.cart.goal.goal_id, agent="c1", state="succeeded", n=2)
    now = bench.now
    ours, theirs = (e.handle(now, GoalEventInput(event)) for e in (bench.engine, other))
    assert msgspec.json.encode(ours) == msgspec.json.encode(theirs)
    bench.steps.append(ours)
    bench.abort(one)
