"""How the steps of real runs stand: while they run, after failures and aborts, in loops, in parallel, when begun anew."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from formiga_bt.show.history.progress import instance_of
from tests.golden import Wording
from tests.unit.engine.yard import CART, Yard, task
from tests.unit.show.scene import source_of, step_of, told

NUMBER = "params: {n: {type: number, default: 1}}\n"


@pytest.mark.parametrize(
    ("key", "instance"),
    [
        ("steps", "steps"),
        ("steps/steps[1]", "steps/steps[1]"),
        ("steps/steps[1]@2", "steps/steps[1]"),
        ("steps/steps[1]@2:attempt_timeout", "steps/steps[1]"),
        ("steps/steps[1]:items", "steps/steps[1]"),
        ("steps/steps[1].for#3", ""),
        ("steps/steps[1]@1.for#3", ""),
        ("steps/steps[1].for#3.steps[0]:timeout", "steps/steps[1].for#3.steps[0]"),
        ("recover:hwd_1#1", "recover:hwd_1#1"),
    ],
)
def test_the_keys_of_a_step_and_its_modifiers_are_one_instance(key: str, instance: str) -> None:
    assert instance_of(key) == instance


def test_a_pick_up_is_followed_from_its_start_to_its_end(wording: Wording) -> None:
    site, catalogue = packaged_world()
    run = Rehearsal(site, catalogue, [packaged_task("pick_up")], fleet_of(site, catalogue))
    source = source_of(run)
    run.run_for(1)
    assert source.now().tasks == ()
    one = run.submit("PickUp", {"target": Place(120.0, 60.0), "user": AgentRef("picker_1")})
    run.run_for(5)
    assert told(source, one) == {
        "steps/": "running",
        "steps/steps[0]": "running",
        "steps/steps[0].steps[0]": "running hwd_2 climbing",
    }
    began = step_of(source, one, "steps/steps[0].steps[0]").began_at

    run.run_until(lambda: any(q.kind == "clearance" for q in run.engine.state.questions.values()))
    run.run_for(1)
    assert told(source, one) == {
        "steps/": "running",
        "steps/steps[0]": "success",
        "steps/steps[0].steps[0]": "success",
        "steps/steps[0].steps[1]": "success",
        "steps/steps[0].steps[2]": "success",
        "steps/steps[0].steps[3]": "success",
        "steps/steps[1]": "running hwd_2 waits for a person to say that people stand 15 m clear",
    }
    up = step_of(source, one, "steps/steps[0].steps[0]")
    assert up.began_at == began
    assert up.ended_at is not None
    assert began is not None
    assert 15 * SECOND < up.ended_at - began < 25 * SECOND

    run.run_until(lambda: any(q.kind == "ask" for q in run.engine.state.questions.values()))
    run.run_for(2)
    wording(told(source, one)["steps/steps[2]"])
    assert source.task(one).values[""]["height"] == "60 m"

    assert run.run_until_ended(one)
    steps = source.task(one).steps
    assert {fact.status for fact in steps} == {"success"}
    assert [fact.path for fact in steps][:4] == [
        "steps/",
        "steps/steps[0]",
        "steps/steps[0].steps[0]",
        "steps/steps[0].steps[1]",
    ]
    assert len(steps) == 13
    picture = source.task(one)
    assert picture.task.ended_at is not None
    assert picture.goals == ()
    assert [box.path for box in picture.drawing.sections[0].children][:2] == ["steps/steps[0]", "steps/steps[1]"]


def test_a_failed_task_says_where_and_why_once(wording: Wording) -> None:
    bench = Yard(CART + "steps: [{sequence: [{do: cart.Move}]}, {wait: 5 s}]\nfinally: [{do: cart.Home}]")
    source, one = source_of(bench), bench.start()
    bench.cart.fail("stuck")
    bench.run_for(1)

    inner, outer = step_of(source, one, "steps/steps[0].sequence[0]"), step_of(source, one, "steps/steps[0]")
    assert (inner.status, inner.code) == ("failure", "failed:stuck")
    wording(inner.reason)
    assert (outer.status, outer.code, outer.reason) == ("failure", "failed:stuck", "")
    assert told(source, one)["finally/finally[0]"] == "running c1"
    assert "steps/steps[1]" not in told(source, one)


def test_a_failure_tells_its_own_reason() -> None:
    bench = Yard(CART + NUMBER + "steps: [{check: n > 2, message: too few}]")
    source, one = source_of(bench), bench.start()
    bench.run_for(5)

    step = step_of(source, one, "steps/steps[0]")
    assert (step.status, step.code, step.reason) == ("failure", "check", "too few")


def test_a_step_that_cannot_be_computed_failed_and_was_not_just_stopped() -> None:
    bench = Yard(CART + NUMBER + "steps: [{set: {m: '${1 / (n - 1)}'}}]\nvars: {m: 0.0}")
    source, one = source_of(bench), bench.start()
    bench.run_for(5)

    step = step_of(source, one, "steps/steps[0]")
    assert (step.status, step.failed, step.stopped, step.code) == ("failure", 1, 0, "cannot_compute")
    assert "by zero" in step.reason


def test_an_aborted_task_has_stopped_steps_and_none_that_run() -> None:
    bench = Yard(CART + "steps: [{sequence: [{do: cart.Move}]}, {wait: 5 s}]\non_abort: [{do: cart.Home}]")
    source, one = source_of(bench), bench.start()
    bench.abort(one)
    bench.run_for(1)
    assert told(source, one) == {
        "steps/": "stopped",
        "steps/steps[0]": "stopped",
        "steps/steps[0].sequence[0]": "stopped",
        "on_abort/": "running",
        "on_abort/on_abort[0]": "running c1",
    }
    bench.cart.succeed()
    bench.run_for(5)
    assert told(source, one)["on_abort/on_abort[0]"] == "success"
    assert source.task(one).task.status == "CANCELED"


def test_a_timeout_is_a_failure_and_an_attempt_counts(wording: Wording) -> None:
    bench = Yard(
        CART
        + "steps: [{do: cart.Move, timeout: 2 s, ignore_failure: true}, {do: cart.Home, retry: {attempts: 3, delay: 4 s}}]"
    )
    source, one = source_of(bench), bench.start()
    bench.run_for(3)
    late = step_of(source, one, "steps/steps[0]")
    assert (late.status, late.failed, late.stopped, late.code) == ("failure", 1, 0, "timeout")
    wording(late.reason)
    bench.cart.fail()
    bench.run_for(1)
    wording(told(source, one)["steps/steps[1]"])
    bench.run_for(4)
    wording(told(source, one)["steps/steps[1]"])
    bench.cart.succeed()
    bench.run_for(1)
    again = step_of(source, one, "steps/steps[1]")
    assert (again.status, again.succeeded, again.failed, again.code) == ("success", 1, 1, "failed:broken")


def test_rounds_are_counted_and_the_newest_is_shown(wording: Wording) -> None:
    bench = Yard(CART + "steps: [{repeat: 4, every: 10 s, steps: [{do: cart.Move}, {wait: 3 s}]}]")
    source, one = source_of(bench), bench.start()
    for _ in range(2):
        bench.cart.succeed()
        bench.run_for(1)
        wording(told(source, one)["steps/steps[0].steps[1]"])
        bench.run_for(10)
    wording(told(source, one)["steps/steps[0]"])
    move = step_of(source, one, "steps/steps[0].steps[0]")
    assert (move.status, move.running, move.succeeded) == ("running", 1, 2)
    assert move.ended_at is None
    bench.cart.succeed()
    bench.run_for(5)
    wording(told(source, one)["steps/steps[0]"])


def test_the_items_of_a_parallel_for_are_one_step(wording: Wording) -> None:
    bench = Yard(CART + "steps: [{for: {m: [2 s, 4 s, 9 s]}, mode: parallel, steps: [{wait: '${m}'}]}]")
    source, one = source_of(bench), bench.start()
    bench.run_for(1)
    wait = step_of(source, one, "steps/steps[0].steps[0]")
    assert wait.running == 3
    wording(wait.note)
    bench.run_for(4)
    wording(told(source, one)["steps/steps[0]"])
    wait = step_of(source, one, "steps/steps[0].steps[0]")
    assert (wait.status, wait.running, wait.succeeded) == ("running", 1, 2)
    bench.run_for(5)
    assert told(source, one)["steps/steps[0]"] == "success"


def test_a_sequence_with_finally_runs_until_that_is_over() -> None:
    bench = Yard(CART + "steps: [{sequence: [{do: cart.Move}], finally: [{do: cart.Home}]}]")
    source, one = source_of(bench), bench.start()
    bench.abort(one)
    bench.run_for(1)
    assert told(source, one)["steps/steps[0].finally[0]"] == "running c1"
    bench.cart.succeed()
    bench.run_for(1)
    assert told(source, one)["steps/steps[0].finally[0]"] == "success"
    assert told(source, one)["steps/steps[0]"] == "stopped"


def test_a_task_that_steps_aside_begins_anew_and_keeps_its_earlier_actions(wording: Wording) -> None:
    calm = task(CART + "steps: [{do: cart.Move}, {wait: 5 s}]", "Calm")
    urgent = task("priority: high\n" + CART + "steps: [{do: cart.Move}]", "Urgent")
    bench = Yard(calm, urgent)
    source, one = source_of(bench), bench.start("Calm")
    two = bench.start("Urgent")
    bench.run_for(3)
    assert source.task(one).task.status == "PENDING"
    assert told(source, one) == {}
    assert told(source, two)["steps/steps[0]"] == "running c1"
    assert [(a.action, a.state) for a in source.timeline([one]).actions] == [("Move", "canceled")]

    bench.cart.succeed()
    bench.run_for(1)
    assert told(source, one)["steps/steps[0]"] == "running c1"
    bench.cart.succeed()
    bench.run_for(1)
    wording(told(source, one)["steps/steps[1]"])
    assert [(a.action, a.state) for a in source.timeline([one]).actions] == [
        ("Move", "canceled"),
        ("Move", "succeeded"),
    ]
    waits = [(wait.kind, wait.text) for wait in source.timeline([one]).waits]
    assert waits == [("pending", "waits for agents")]


def test_other_notes_of_steps_that_wait() -> None:
    helper = task(CART + "steps: [{do: cart.Move}]", "Helper")
    bench = Yard(
        task(
            """
steps:
  - parallel:
      - with_agents: {extra: {type: cart}}
        steps: [{do: extra.Move}]
      - wait: 90 s
      - repeat: forever
        max: 3
        every: 1 min
        steps: [{wait: 1 s}]
""",
            "Main",
        ),
        helper,
    )
    source = source_of(bench)
    bench.start("Helper")
    one = bench.start("Main")
    bench.run_for(2)
    assert told(source, one) == {
        "steps/": "running",
        "steps/steps[0]": "running 0 of 3 done",
        "steps/steps[0].parallel[0]": "running waits for its agents",
        "steps/steps[0].parallel[1]": "running 88 s left",
        "steps/steps[0].parallel[2]": "running round 2 of 3 in 58 s",
        "steps/steps[0].parallel[2].steps[0]": "success",
    }
