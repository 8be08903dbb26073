"""What the steps of a task mean when they run (language: steps; execution: goals, stopping). Carts obey the test."""

from itertools import pairwise

import msgspec
import pytest

from formiga_bt.engine.kernel.inputs import CancelGoal, GoalEventInput, NotifyPeople, PublishState, SendGoal
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.nodes.ends import GoalEnd
from formiga_bt.rehearsal.testing import effects
from formiga_bt.transport.messages import GoalEvent
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard
from tests.unit.engine.yard import task as task_text

NONE = "vars: {n: '${0}'}\n"


def run(make: Make, steps: str, *ends: str) -> tuple[Yard, str]:
    yard = make(CART + NONE + steps)
    yard.cart.auto = dict.fromkeys(("Move", "Haul", "Home", "Park"), 1.0)
    yard.cart.ends = list(ends)
    return yard, yard.start()


def notes(yard: Yard) -> list[str]:
    return [notice.text for notice in effects(yard, NotifyPeople)]


def test_a_sequence_runs_its_steps_in_order(make: Make) -> None:
    yard, task = run(make, "steps: [{do: cart.Move}, {notify: between}, {do: cart.Home}]")

    assert yard.end(task) == ("SUCCEEDED", "")
    assert yard.cart.done == ["Move", "Home"]
    assert notes(yard) == ["between"]


def test_the_goal_ids_are_the_instance_paths(make: Make) -> None:
    yard, task = run(make, "steps: [{sequence: [{do: cart.Move, retry: {attempts: 2}}]}, {do: cart.Home}]", "broken")

    yard.end(task)

    assert [g.goal_id for g in yard.cart.requests] == [
        "Try-1/1/steps/steps[0].sequence[0]@1",
        "Try-1/1/steps/steps[0].sequence[0]@2",
        "Try-1/1/steps/steps[1]",
    ]


def test_a_step_that_fails_ends_the_task_with_its_code_and_path(make: Make) -> None:
    yard, task = run(make, "steps: [{notify: first}, {do: cart.Move}]", "blocked")

    assert yard.end(task) == ("FAILED", "failed:blocked")
    failure = yard.task(task).outcome.failure
    assert failure is not None
    assert (failure.step, failure.agent) == ("steps/steps[1]", "c1")


def test_a_rejected_goal_fails_its_step(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.cart.rejects = ["not_today"]

    assert yard.end(yard.start()) == ("FAILED", "rejected")


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ("{fallback: [{notify: a, when: n > 0}, {notify: b}]}", ["b"]),
        ("{fallback: [{check: n > 0}, {notify: b}]}", ["b"]),
        ("{fallback: [{sequence: [{notify: a, when: n > 0}]}, {notify: b}]}", ["b"]),
        ("{sequence: [{notify: a, when: n > 0}, {notify: b}]}", ["b"]),
        ("{if: n < 1, then: [{notify: a}], else: [{notify: b}]}", ["a"]),
        ("{if: n > 0, then: [{notify: a}], else: [{notify: b}]}", ["b"]),
        ("{fallback: [{if: n > 0, then: [{notify: a}]}, {notify: b}]}", ["b"]),
        ("{check: n > 0, ignore_failure: true}", []),
    ],
)
def test_skipped_is_neither_success_nor_failure(make: Make, steps: str, said: list[str]) -> None:
    yard, task = run(make, f"steps: [{steps}]")

    assert yard.outcome(task) == ("SUCCEEDED", "")
    assert notes(yard) == said


@pytest.mark.parametrize(
    ("steps", "code"),
    [
        ("{fallback: [{notify: a, when: n > 0}, {notify: b, when: n > 0}]}", "nothing_applied"),
        ("{fallback: [{check: n > 0}, {notify: b, when: n > 0}]}", "check"),
        ("{fail: enough}", "failed"),
        ("{fail: enough, code: too_far}", "failed:too_far"),
        ("{check: n > 0, message: no}", "check"),
    ],
)
def test_codes_of_steps_that_fail_at_once(make: Make, steps: str, code: str) -> None:
    yard, task = run(make, f"steps: [{steps}]")

    assert yard.outcome(task) == ("FAILED", code)


def test_error_names_the_failure_in_later_children_of_a_fallback_and_in_on_failure(
    make: Make, wording: Wording
) -> None:
    yard, task = run(
        make,
        """
steps:
  - fallback:
      - fail: one
        code: first
      - notify: "in fallback ${error.code}"
  - fail: two
    code: second
on_failure:
  - notify: "in on_failure ${error.code} ${error.step}"
""",
    )

    assert yard.outcome(task) == ("FAILED", "failed:second")
    wording(notes(yard))


def test_expect_sees_the_result_and_a_false_one_fails(make: Make) -> None:
    yard = make(
        CART
        + "steps: [{do: cart.Move, save_as: got, expect: result.n > 3}]\n"
        + "on_failure: [{notify: 'n ${got.n}', when: is_set(got)}]"
    )
    task = yard.start()
    yard.cart.succeed({"n": 2}, landed="grounded")

    assert yard.end(task) == ("FAILED", "expect")
    assert notes(yard) == ["n 2"]


@pytest.mark.parametrize(
    ("since", "stands"),
    [({}, "grounded"), ({"last_goal": "Else-9/1/steps/steps[0]"}, "unknown"), ({"action_name": "Move"}, "unknown")],
    ids=["nothing", "another goal has ended", "another goal runs"],
)
def test_a_result_that_is_told_again_changes_nothing_of_a_machine_that_did_more_since(
    make: Make, since: dict[str, str], stands: str
) -> None:
    yard = make(CART + "steps: [{do: cart.Home}, {wait: 1 s}]")
    yard.start()
    yard.run_for(0.2)
    goal = yard.cart.goal.goal_id
    told = {"seq": 900, "stamp": yard.now, "landed": "unknown", "last_goal": goal, "action_name": "", **since}
    status = msgspec.structs.replace(yard.cart.side.status, **told)

    yard.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c1", state="succeeded", n=9, status=status)))

    assert yard.record("c1").landed == stands


def test_a_result_that_cannot_be_read_fails_the_step_and_is_counted(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home}, {do: cart.Move}]")
    task = yard.start()
    yard.cart.auto = {"Home": 1}
    yard.cart.succeed()
    yard.run_for(0.2)
    yard.cart.succeed({"n": "many"})
    yard.run_for(0.02)

    assert yard.record("c1").bad == 1
    assert yard.end(task) == ("FAILED", "failed:bad_result")


def test_set_reads_all_values_before_it_assigns(make: Make) -> None:
    text = "vars: {a: '${1}', b: '${2}'}\nsteps: [{set: {a: '${b}', b: '${a}'}}, {notify: '${a} ${b}'}]"
    yard = make(CART + text)

    yard.start()

    assert notes(yard) == ["2 1"]


def test_a_call_has_a_scope_of_its_own_and_returns(make: Make) -> None:
    text = """
vars: {n: "${7}"}
steps:
  - call: Twice
    with: {x: "${n}"}
    save_as: got
  - notify: "${n} ${got}"
subtrees:
  Twice:
    params: {x: int}
    steps:
      - wait: 1 s
    returns: ${x * 2}
"""
    yard = make(CART + text)

    assert yard.end(yard.start()) == ("SUCCEEDED", "")
    assert notes(yard) == ["7 14"]


def test_wait_waits_exactly(make: Make) -> None:
    yard, task = run(make, "steps: [{wait: 15 s}]")

    yard.end(task)

    record = yard.task(task)
    assert record.times.ended_at is not None
    assert record.times.active_at is not None
    assert record.times.ended_at - record.times.active_at == 15_000_000


# -- retry ---------------------------------------------------------------------------------------------------------------


def test_retry_waits_with_backoff_between_its_attempts(make: Make) -> None:
    yard, task = run(make, "steps: [{do: cart.Move, retry: {attempts: 3, delay: 10 s, backoff: 2}}]", "a", "b", "c")

    assert yard.end(task) == ("FAILED", "failed:c")
    sent = [step.at for step in yard.steps for e in step.effects if isinstance(e, SendGoal) and e.action == "Move"]
    gaps = [round((b - a) / 1e6) for a, b in pairwise(sent)]
    assert gaps == [11, 21]


def test_retry_stops_at_the_first_success(make: Make) -> None:
    yard, task = run(make, "steps: [{do: cart.Home, retry: {attempts: 5}}]", "a")

    assert yard.end(task) == ("SUCCEEDED", "")
    assert len(yard.cart.requests) == 2


def test_attempt_timeout_stops_one_attempt_and_the_next_is_made(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home, retry: {attempts: 2, attempt_timeout: 5 s}}]")
    task = yard.start()

    yard.run_for(6)
    assert len(yard.cart.cancels) == 1
    assert len(yard.cart.requests) == 2
    yard.cart.succeed()

    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_goal_in_doubt_is_not_tried_again(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move, retry: {attempts: 5}}]")
    task = yard.start()

    yard.cart.boot()

    assert yard.end(task) == ("FAILED", "in_doubt")


# -- timeout, drain ------------------------------------------------------------------------------------------------------


def test_a_timeout_cancels_waits_for_the_end_and_fails(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home, timeout: 5 s}]")
    task = yard.start()
    yard.cart.confirms_cancel = False

    yard.run_for(6)
    assert yard.cart.cancels == ["Try-1/1/steps/steps[0]"]
    assert yard.task(task).status == "ACTIVE"
    yard.cart.side.finish(yard.cart.cancels[0], "canceled")

    assert yard.end(task) == ("FAILED", "timeout")


def test_a_goal_that_succeeds_while_it_drains_under_its_own_timeout_counts(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move, timeout: 5 s, save_as: got}, {notify: 'n ${got.n}'}, {do: cart.Home}]")
    yard.cart.auto = {"Home": 1}
    task = yard.start()
    yard.cart.takes_cancel = False
    yard.run_for(6)

    yard.cart.succeed({"n": 9})

    assert yard.end(task) == ("SUCCEEDED", "")
    assert notes(yard) == ["n 9"]


def test_around_more_than_a_do_the_timeout_keeps_its_decision(make: Make) -> None:
    yard = make(CART + "steps: [{sequence: [{do: cart.Home}], timeout: 5 s}]")
    task = yard.start()
    yard.cart.takes_cancel = False
    yard.run_for(6)

    yard.cart.succeed()

    assert yard.end(task) == ("FAILED", "timeout")


def test_a_goal_that_ends_at_the_deadline_beats_it(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home, timeout: 5 s}]")
    task = yard.start()
    deadline = next(iter(d.at for due, d in yard.engine.state.deadlines.items() if isinstance(due, NodeDue)))
    yard.scheduler.call_at(deadline - 20_000, yard.cart.succeed)

    assert yard.end(task) == ("SUCCEEDED", "")
    assert yard.task(task).times.ended_at == deadline
    assert effects(yard, CancelGoal) == []


def test_an_abort_while_a_timeout_drains_moves_the_goals_to_the_task(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home, timeout: 5 s}]")
    task = yard.start()
    yard.cart.confirms_cancel = False
    yard.run_for(6)

    yard.abort(task)
    assert yard.task(task).ending.drain == (GoalEnd("Try-1/1/steps/steps[0]"),)
    yard.run_for(0.5)
    yard.cart.side.finish(yard.cart.cancels[0], "canceled")

    assert yard.end(task) == ("CANCELED", "aborted")


def test_a_second_goal_waits_while_the_first_drains_and_its_timeout_counts(make: Make) -> None:
    text = "steps: [{do: cart.Home, timeout: 5 s}]\non_failure: [{do: cart.Park, timeout: 40 s}]"
    yard = make(CART + text)
    yard.cart.auto = {"Park": 1}
    task = yard.start()
    yard.cart.confirms_cancel = False
    yard.run_for(6)
    assert yard.cart.done == ["Home"]

    yard.cart.side.finish(yard.cart.cancels[0], "canceled")

    assert yard.end(task) == ("FAILED", "timeout")
    assert yard.cart.done == ["Home", "Park"]


# -- exceptions, runaway ---------------------------------------------------------------------------------------------------


def test_a_value_that_cannot_be_computed_fails_its_own_task_with_path_mark_and_cause_and_no_other(
    make: Make, wording: Wording
) -> None:
    bad = (
        NONE
        + "steps: [{do: cart.Rise}, {check: 1 // n > 0, ignore_failure: true, retry: {attempts: 3}}, {do: cart.Park}]"
    )
    bad += "\non_failure: [{notify: 'oh ${error.code}'}]\nfinally: [{notify: last}]"
    other = task_text("agents: {cart: {type: cart}}\nsteps: [{do: cart.Home}]", name="Other")
    yard = make(CART + bad, other, carts=2)
    for cart in yard.carts:
        cart.auto = {"Rise": 1, "Home": 1}

    first, second = yard.start(), yard.start("Other")

    assert yard.end(first) == ("FAILED", "cannot_compute")
    reason = yard.task(first).outcome.reason
    wording(reason)
    assert "steps/steps[1]" in reason
    assert "try.yaml:" in reason
    assert "division by zero" in reason
    assert notes(yard) == ["oh cannot_compute", "last"]
    assert yard.cart.done == ["Rise", "Home"]  # recover ran
    assert yard.end(second) == ("SUCCEEDED", "")


@pytest.mark.parametrize(
    ("step", "expression", "why"),
    [
        ("{check: '1 // n > 0'}", "1 // n > 0", "division by zero"),
        ("{check: '[1, 2][n + 2] > 0'}", "[1, 2][n + 2] > 0", "the list has 2 items"),
        ("{check: '(n + 94906266) * 94906267 > 0'}", "(n + 94906266) * 94906267 > 0", "the number is too large"),
        ("{check: 'len(range(n - 1)) > 0'}", "len(range(n - 1)) > 0", "range takes 0 to 1000"),
        ("{notify: 'it is ${1 // n} of them'}", "1 // n", "division by zero"),
        ("{wait_until: 1 // n > 0, timeout: 1 s}", "1 // n > 0", "division by zero"),
        ("{check: 'x > 3'}", "x > 3", "a value has the wrong type here"),
        ("{check: 'x.y > 3'}", "x.y > 3", "there is no field 'y'"),
        ("{check: x}", "x", "true or false is due here, not 'abc'"),
        ("{wait: '${x}'}", "x", "a duration is due here, not 'abc'"),
        ("{repeat: '${x}', steps: [{notify: a}]}", "x", "an int is due here, not 'abc'"),
        ("{for: {i: '${x}'}, steps: [{notify: a}]}", "x", "is due here, not 'abc'"),
        ("{notify: a, retry: {attempts: '${x}'}}", "x", "an int is due here, not 'abc'"),
        ("{notify: a, timeout: '${x}'}", "x", "a duration is due here, not 'abc'"),
        ("{do: cart.Move, expect: 1 // n > 0}", "1 // n > 0", "division by zero"),
        ("{with_agents: {it: {type: person, battery_min: '${1 % / n}'}}, steps: [{notify: a}]}", "1 % / n", "division"),
    ],
)
def test_every_expression_without_a_value_has_one_code_and_is_named_with_its_place(
    make: Make, step: str, expression: str, why: str
) -> None:
    yard = make(CART + f"params: {{x: any}}\nvars: {{n: '${{0}}'}}\nsteps: [{step}]")
    yard.cart.auto = {"Move": 1.0}

    task = yard.start(x="abc")

    assert yard.end(task) == ("FAILED", "cannot_compute")
    reason = yard.task(task).outcome.reason
    assert f"'{expression}' at try.yaml:6:" in reason
    assert why in reason


def test_an_exception_in_a_cleanup_part_is_recorded_and_the_next_part_runs(make: Make) -> None:
    text = "vars: {n: '${0}'}\nsteps: [{fail: x}]\non_failure: [{check: 1 // n > 0}]\nfinally: [{notify: last}]"
    yard = make(CART + text)

    task = yard.start()

    assert yard.outcome(task) == ("FAILED", "failed")
    assert notes(yard) == ["last"]
    assert "division by zero" in yard.task(task).outcome.notes[0]


def test_a_runaway_ends_its_task_and_still_comes_home(make: Make) -> None:
    text = (
        NONE
        + "steps: [{do: cart.Rise}, {check: n > 0, retry: {attempts: 100000}}, {do: cart.Park}]\non_failure: [{notify: caught}]"
    )
    yard = make(CART + text)
    yard.cart.auto = {"Rise": 1, "Home": 1}

    assert yard.end(yard.start()) == ("FAILED", "runaway")
    assert notes(yard) == ["caught"]
    assert yard.cart.done == ["Rise", "Home"]
    assert yard.record("c1").pool == "STANDBY"


@pytest.mark.parametrize(
    "step",
    [
        "{check: cart.transit_height > 1 m, when: 'cart.airborne'}",
        "{if: cart.airborne, then: [{notify: a}]}",
        "{check: cart.airborne}",
        "{wait: 5 s, timeout: '${5 s if cart.airborne else 6 s}'}",
    ],
)
def test_an_unknown_state_read_at_entry_fails_the_step(make: Make, step: str) -> None:
    yard = make(f"agents: {{cart: {{type: cart, away: true}}}}\nsteps: [{step}, {{do: cart.Home}}]")
    yard.cart.auto = {"Home": 1}
    yard.cart.say(landed="unknown")
    yard.run_for(0.1)

    assert yard.end(yard.start()) == ("FAILED", "unknown_state")


def test_a_goal_sent_and_stopped_in_one_step_never_leaves(make: Make) -> None:
    # The stop of on_failure's first goal comes in the step that enters it: cleanup_timeout is zero at that instant.
    yard = make(CART + "steps: [{fail: x}]\non_failure: [{do: cart.Park}]\ncleanup_timeout: 1 ms")
    task = yard.start()

    yard.run_for(1)

    assert yard.outcome(task) == ("FAILED", "failed")
    assert effects(yard, PublishState)[-1].status == "FAILED"
