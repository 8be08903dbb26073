"""The end of a task (execution: the end of a task): its parts in order, aborts in each, what bounds them and what does not."""

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import NotifyPeople, Operator, PublishState
from formiga_bt.rehearsal.testing import alarms, effects
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard

ALL = """
steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Park}]
on_failure: [{notify: on_failure}, {do: cart.Move}]
on_abort: [{notify: "on_abort ${abort.reason}"}, {do: cart.Move}]
finally: [{notify: finally}, {do: cart.Move}]
cleanup_timeout: 60 s
"""


def begin(make: Make, text: str = ALL) -> tuple[Yard, str]:
    """Fly until the first Move runs."""
    yard = make(CART + text)
    task = yard.start()
    yard.cart.succeed()
    yard.run_for(0.2)
    assert yard.cart.goal.action == "Move"
    return yard, task


def settle(yard: Yard, action: str, how: str = "succeed") -> None:
    """End the running goal, which must be this one."""
    assert yard.cart.goal.action == action
    getattr(yard.cart, how)()
    yard.run_for(0.2)


def notes(yard: Yard) -> list[str]:
    return [notice.text for notice in effects(yard, NotifyPeople)]


def test_success_goes_through_finally_and_needs_no_recover_on_the_ground(make: Make) -> None:
    yard, task = begin(make)

    settle(yard, "Move")
    settle(yard, "Park")
    assert yard.task(task).status == "ENDING"
    settle(yard, "Move")

    assert yard.outcome(task) == ("SUCCEEDED", "")
    assert notes(yard) == ["finally"]


def test_failure_goes_through_on_failure_finally_and_recover(make: Make) -> None:
    yard, task = begin(make)

    settle(yard, "Move", "fail")
    settle(yard, "Move")
    settle(yard, "Move")
    assert yard.task(task).section == "recover"
    settle(yard, "Home")

    assert yard.outcome(task) == ("FAILED", "failed:broken")
    assert notes(yard) == ["on_failure", "finally"]
    sections = [request.goal_id.split("/")[2] for request in yard.cart.requests]
    assert sections == ["steps", "steps", "on_failure", "finally", "recover:c1#1"]


def test_abort_goes_through_on_abort_with_its_reason(make: Make) -> None:
    yard, task = begin(make)

    yard.abort(task, reason="rain")
    yard.run_for(0.2)
    assert len(yard.cart.cancels) == 1
    settle(yard, "Move")
    settle(yard, "Move")
    settle(yard, "Home")

    assert yard.outcome(task) == ("CANCELED", "aborted")
    assert notes(yard) == ["on_abort rain", "finally"]


def test_a_restart_is_no_abort_of_the_task_and_an_abort_meanwhile_is(make: Make) -> None:
    yard, task = begin(make)

    yard.ask(Operator("restart", task, "eve"))
    yard.run_for(0.2)

    ending = yard.task(task)
    assert (ending.status, ending.restart.why, ending.outcome.code, ending.outcome.reason) == (
        "ENDING",
        "restart",
        "restarted",
        "by eve",
    )
    yard.abort(task)
    assert yard.task(task).outcome.code == "aborted"
    for action in ("Move", "Move", "Home"):
        settle(yard, action)
    assert yard.outcome(task) == ("CANCELED", "aborted")


def test_the_next_part_waits_for_the_goals_of_the_former(make: Make) -> None:
    yard, task = begin(make)
    yard.cart.confirms_cancel = False

    yard.abort(task)
    yard.run_for(5)
    assert notes(yard) == []
    yard.cart.side.finish(yard.cart.cancels[0], "canceled")
    yard.run_for(0.2)

    assert notes(yard) == ["on_abort operator"]
    yard.cart.confirms_cancel = True
    yard.abort(task, how="now")
    yard.run_for(0.2)
    settle(yard, "Home")


def test_an_abort_in_on_failure_goes_on_to_finally_and_the_outcome_stays(make: Make) -> None:
    yard, task = begin(make)
    settle(yard, "Move", "fail")

    yard.abort(task)
    yard.run_for(0.2)

    assert notes(yard) == ["on_failure", "finally"]
    settle(yard, "Move")
    settle(yard, "Home")
    assert yard.outcome(task) == ("FAILED", "failed:broken")


@pytest.mark.parametrize("part", ["on_abort", "finally", "recover"])
def test_an_abort_in_a_later_part_is_already_ending(make: Make, part: str) -> None:
    yard, task = begin(make)
    yard.abort(task)
    yard.run_for(0.2)
    while yard.task(task).section != part:
        settle(yard, "Move")

    with pytest.raises(TaskError) as caught:
        yard.abort(task)

    assert caught.value.code == "already_ending"
    if part != "recover":
        yard.abort(task, how="now")
        yard.run_for(0.2)
    settle(yard, "Home")
    assert yard.outcome(task) == ("CANCELED", "aborted")


@pytest.mark.parametrize("failed", [False, True])
def test_abort_now_skips_to_recover(make: Make, failed: bool) -> None:
    yard, task = begin(make)
    if failed:
        settle(yard, "Move", "fail")

    yard.abort(task, how="now")
    yard.run_for(0.2)

    assert yard.task(task).section == "recover"
    settle(yard, "Home")
    assert yard.outcome(task)[0] == ("FAILED" if failed else "CANCELED")
    assert "finally" not in notes(yard)


def test_the_tasks_timeout_is_a_failure_that_no_step_catches(make: Make) -> None:
    text = """
timeout: 30 s
steps:
  - fallback: [{do: cart.Move, retry: {attempts: 9}, ignore_failure: true}]
on_failure: [{notify: "${error.code}"}]
"""
    yard = make(CART + text)
    task = yard.start()

    assert yard.end(task) == ("FAILED", "timeout")
    record = yard.task(task)
    assert record.times.ended_at is not None
    assert record.times.active_at is not None
    assert 30.0 <= (record.times.ended_at - record.times.active_at) / 1e6 < 30.1
    assert notes(yard) == ["timeout"]


def test_cleanup_timeout_bounds_the_parts_together_and_never_recover(make: Make) -> None:
    yard, task = begin(make)
    settle(yard, "Move", "fail")
    yard.run_for(30)
    settle(yard, "Move")
    assert yard.task(task).section == "finally"

    yard.run_for(31)

    assert yard.task(task).section == "recover"
    assert "cleanup_timeout" in yard.task(task).outcome.notes[0]
    yard.run_for(900)
    assert yard.task(task).status == "ENDING"
    settle(yard, "Home")
    assert yard.outcome(task) == ("FAILED", "failed:broken")


def test_a_slow_recover_raises_an_alarm_each_minute_beyond_its_estimate(make: Make) -> None:
    yard, task = begin(make)
    yard.abort(task, how="now")
    yard.run_for(299)
    assert alarms(yard).count("recover_slow") == 0

    yard.run_for(182)

    assert alarms(yard).count("recover_slow") == 4
    settle(yard, "Home")
    assert yard.outcome(task)[0] == "CANCELED"


def test_a_failure_in_a_part_is_recorded_and_the_next_part_runs(make: Make) -> None:
    yard, task = begin(make)
    settle(yard, "Move", "fail")

    settle(yard, "Move", "fail")
    settle(yard, "Move", "fail")
    settle(yard, "Home")

    assert yard.outcome(task) == ("FAILED", "failed:broken")
    assert [note.split(":")[0] for note in yard.task(task).outcome.notes] == ["on_failure", "finally"]


def test_a_recover_that_fails_three_times_leaves_the_machine_quarantined(make: Make) -> None:
    yard, task = begin(make)
    yard.abort(task, how="now")
    yard.run_for(0.2)

    for pause_s in (2, 5, 0):
        settle(yard, "Home", "fail")
        yard.run_for(pause_s)

    assert yard.outcome(task) == ("CANCELED", "aborted")
    assert yard.record("c1").pool == "QUARANTINED"
    assert alarms(yard) == ["agent_needs_help", "quarantined_airborne"]


def test_after_a_value_that_cannot_be_computed_the_machine_comes_home_through_recover(make: Make) -> None:
    text = "vars: {n: '${0}'}\nsteps: [{do: cart.Rise}, {wait: '${1 s / n}'}, {do: cart.Park}]"
    yard = make(CART + text)
    task = yard.start()

    settle(yard, "Rise")
    settle(yard, "Home")

    assert yard.outcome(task) == ("FAILED", "cannot_compute")


def test_every_status_is_told_once(make: Make) -> None:
    yard, task = begin(make)
    settle(yard, "Move")
    settle(yard, "Park")
    settle(yard, "Move")

    told = [state.status for state in effects(yard, PublishState) if state.task == task]
    assert told == ["PENDING", "ASSIGNED", "ACTIVE", "ENDING", "SUCCEEDED"]


def test_a_timeout_that_cannot_be_computed_ends_its_task_only(make: Make) -> None:
    yard = make(CART + "params: {n: int}\ntimeout: '${10 s / n}'\nsteps: [{wait: 1 min}]\nfinally: [{notify: last}]")

    task = yard.start(n=0)

    assert yard.outcome(task) == ("FAILED", "cannot_compute")
    assert notes(yard) == ["last"]


@pytest.mark.parametrize(
    ("params", "code"),
    [({}, "missing_param"), ({"n": 0}, "bad_var"), ({"n": 1, "m": 2}, "unknown_param")],
)
def test_a_submit_that_cannot_be_is_refused_and_changes_nothing(make: Make, params: dict[str, int], code: str) -> None:
    yard = make(CART + "params: {n: int}\nvars: {half: '${1 // n}'}\nsteps: [{notify: 'x ${half}', when: half > 0}]")

    with pytest.raises(TaskError) as caught:
        yard.submit("Try", params)

    assert caught.value.code == code
    assert yard.engine.state.tasks == {}


def test_unknown_tasks_are_refused(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 1 s}]")

    for call in (lambda: yard.submit("Nope"), lambda: yard.abort("Try-9")):
        with pytest.raises(TaskError) as caught:
            call()
        assert caught.value.code == "unknown_task"
