"""`request`: a task starts another one, waits for it, and takes it along when it ends."""

from typing import Any

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import Abort, Approve, Duty, LockdownOrder, Operator, Serve
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.nodes.memory import RequestMem
from formiga_bt.safety.approval import approval_digest
from formiga_bt.safety.drafted import drafted
from formiga_bt.transport.messages import PreflightCheck
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine import yard as yards
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard

LOOK = "params: {n: {type: int, default: 1}}\n" + CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]\n"
ASKS = "steps: [{request: Look, save_as: look}, {notify: '${look.task_id} ${look.status}'}]"


def tasks(**texts: str) -> list[Task]:
    """Return checked tasks that may request one another."""
    whole = {name: f"formiga: 1\ntask: {name}\n{text}" for name, text in texts.items()}
    found = []
    site, catalogue = yards.yard()
    for name, text in whole.items():
        loaded = load_task_text(text, f"{name}.yaml", catalogue=catalogue, site=site, library=[], others=whole)
        assert loaded.task is not None, loaded.diagnostics
        found.append(loaded.task)
    return found


def child(yard: Yard, parent: str, index: int = 0) -> TaskRecord:
    return yard.task(yard.task(parent).family.children[index])


def step(yard: Yard, action: str, cart: int = 0) -> None:
    assert yard.carts[cart].goal.action == action
    yard.carts[cart].succeed()
    yard.run_for(0.3)


def started(make: Make, text: str = ASKS, look: str = LOOK, **options: Any) -> tuple[Yard, str]:
    yard = make(*tasks(Try=text, Look=look), **options)
    return yard, yard.start()


def test_the_step_ends_well_with_its_task(make: Make) -> None:
    yard, mine = started(make)
    look = child(yard, mine)
    assert (look.name, look.family.parent, look.family.depth, look.status) == ("Look", mine, 1, "ACTIVE")

    for action in ("Rise", "Move", "Home"):
        step(yard, action)

    assert child(yard, mine).status == "SUCCEEDED"
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_its_failure_is_a_failure_of_the_step_that_the_tree_may_catch(make: Make) -> None:
    code = "{check: error.code == 'request:failed:stuck'}"
    yard, mine = started(make, f"steps: [{{fallback: [{{request: Look}}, {code}]}}]")

    yard.cart.fail("stuck")
    yard.run_for(0.5)

    assert child(yard, mine).outcome.code == "failed:stuck"
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_params_and_priority_are_handed_on(make: Make) -> None:
    yard, mine = started(make, "steps: [{request: Look, with: {n: '${2 + 3}'}, priority: high}]")

    look = child(yard, mine)

    assert (look.request.params, look.request.priority) == ({"n": 5}, "high")
    yard.abort(mine)


def test_an_abort_of_the_parent_aborts_the_child_and_waits_for_its_way_home(make: Make) -> None:
    yard, mine = started(make, ASKS + "\non_abort: [{notify: aborted}]")
    step(yard, "Rise")

    yard.abort(mine)
    yard.run_for(0.3)

    assert (yard.task(mine).section, child(yard, mine).section) == ("steps", "recover")
    step(yard, "Home")
    assert child(yard, mine).status == "CANCELED"
    assert child(yard, mine).outcome.reason == f"by {mine}"
    assert yard.outcome(mine) == ("CANCELED", "aborted")


def test_a_timeout_fails_once_the_child_has_ended(make: Make) -> None:
    yard, mine = started(make, "steps: [{request: Look, timeout: 5 s}]")
    step(yard, "Rise")
    yard.run_for(6)

    assert yard.task(mine).status == "ACTIVE"
    step(yard, "Home")

    assert yard.outcome(mine) == ("FAILED", "timeout")


def test_one_that_waits_for_agents_ends_at_once(make: Make) -> None:
    yard, mine = started(make, f"{CART}steps: [{{request: Look, timeout: 5 s}}]")
    assert child(yard, mine).status == "PENDING"

    yard.run_for(6)

    assert child(yard, mine).status == "CANCELED"
    assert yard.outcome(mine) == ("FAILED", "timeout")


def test_one_that_nobody_waits_for_ends_with_its_parent(make: Make) -> None:
    yard, mine = started(
        make, "steps: [{request: Look, wait: false, save_as: look}, {check: look.status == 'PENDING'}, {wait: 5 s}]"
    )
    step(yard, "Rise")
    yard.run_for(5)

    assert (yard.task(mine).outcome.status, yard.task(mine).status) == ("SUCCEEDED", "ACTIVE")
    step(yard, "Home")

    assert child(yard, mine).status == "CANCELED"
    assert yard.outcome(mine) == ("SUCCEEDED", "")


@pytest.mark.parametrize("wait", ["true", "false"])
def test_a_detached_one_outlives_its_parent(make: Make, wait: str) -> None:
    yard, mine = started(make, f"steps: [{{request: Look, wait: {wait}, detached: true}}]")
    if wait == "true":
        yard.abort(mine)
    yard.run_for(1)

    assert yard.task(mine).section == "done"
    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert child(yard, mine).status == "SUCCEEDED"


def test_more_than_twenty_open_children_are_refused(make: Make) -> None:
    body = "{repeat: 21, steps: [{request: Look, wait: false}]}"
    yard, mine = started(make, f"steps: [{body}]")

    assert len(yard.task(mine).family.children) == 20
    yard.end(mine)

    assert yard.outcome(mine) == ("FAILED", "request:too_many")


def test_four_deep_is_too_deep(make: Make) -> None:
    chain = {"Try": "A", "A": "B", "B": "C", "C": "Look"}
    texts = {name: f"steps: [{{request: {other}}}]" for name, other in chain.items()}
    yard = make(*tasks(**texts, Look=LOOK))

    mine = yard.start()

    assert yard.outcome(mine)[0] == "FAILED"
    assert yard.task(mine).outcome.code == "request:request:request:request:too_deep"


def test_a_task_that_the_engine_does_not_serve_fails_the_step(make: Make) -> None:
    yard = make(tasks(Try=ASKS, Look=LOOK)[0])

    mine = yard.start()

    assert yard.outcome(mine) == ("FAILED", "request:unknown_task")


def test_lockdown_admits_no_child(make: Make) -> None:
    yard, mine = started(make, "steps: [{wait: 5 s}, {request: Look}]")
    yard.ask(LockdownOrder("hold", "ann"))
    yard.run_for(20)
    assert yard.task(mine).family.children == ()

    yard.ask(LockdownOrder("release", "ann"))
    yard.run_for(6)

    assert child(yard, mine).status == "ACTIVE"
    yard.abort(mine)


def test_while_its_parent_is_held_a_child_gets_no_agents(make: Make) -> None:
    yard = make(*tasks(Try="steps: [{request: Look}]", Look=LOOK, Long=CART + "steps: [{wait: 60 s}]"))
    other, mine = yard.start("Long"), yard.start()
    yard.ask(Operator("hold", mine, "ann"))
    yard.abort(other)
    yard.run_for(1)
    assert child(yard, mine).status == "PENDING"

    yard.ask(Operator("continue", mine, "ann"))
    yard.run_for(0.3)

    assert child(yard, mine).status == "ACTIVE"
    yard.abort(mine)


@pytest.mark.parametrize("stop", ["hold", "return", "land"])
def test_a_stop_of_the_parent_stops_its_child_and_continue_goes_on_with_both(make: Make, stop: str) -> None:
    yard, mine = started(make)
    look = child(yard, mine).id
    yard.ask(Operator(stop, mine, "ann"))  # type: ignore[arg-type]

    assert (yard.task(mine).hold.words, yard.task(look).hold.words) == (("operator",), ("operator",))
    assert yard.engine.state.orders["c1"].scope == "task"
    yard.run_for(300)
    assert child(yard, mine).status == "ACTIVE"

    yard.ask(Operator("continue", mine, "ann"))
    yard.run_for(0.3)

    assert (yard.task(mine).hold.words, yard.task(look).hold.words, yard.engine.state.orders) == ((), (), {})
    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_a_stop_reaches_the_tasks_that_a_child_requested(make: Make) -> None:
    yard = make(*tasks(Try="steps: [{request: Mid}]", Mid="steps: [{request: Look}]", Look=LOOK))
    mine = yard.start()
    look = child(yard, child(yard, mine).id)
    yard.ask(Operator("hold", mine, "ann"))
    assert yard.task(look.id).hold.words == ("operator",)

    yard.ask(Operator("continue", child(yard, mine).id, "ann"))

    assert (yard.task(mine).hold.words, child(yard, mine).hold.words, yard.task(look.id).hold.words) == (
        ("operator",),
        (),
        (),
    )
    yard.abort(mine)


def test_a_stop_leaves_a_detached_child_alone(make: Make) -> None:
    yard, mine = started(make, "steps: [{request: Look, detached: true}]")

    yard.ask(Operator("hold", mine, "ann"))

    assert (yard.task(mine).hold.words, child(yard, mine).hold.words, yard.engine.state.orders) == (
        ("operator",),
        (),
        {},
    )
    yard.abort(mine)
    yard.abort(child(yard, mine).id)


def test_the_wait_of_a_child_stands_still_while_its_parent_is_stopped(make: Make) -> None:
    look = LOOK.replace("type: cart", "type: cart, wait: 10 s")
    yard = make(*tasks(Try="steps: [{request: Look}]", Look=look, Long=CART + "steps: [{wait: 400 s}]"))
    other, mine = yard.start("Long"), yard.start()
    yard.ask(Operator("hold", mine, "ann"))
    yard.run_for(300)
    assert child(yard, mine).status == "PENDING"

    yard.ask(Operator("continue", mine, "ann"))
    yard.run_for(11)

    assert yard.outcome(mine) == ("FAILED", "request:no_agent")
    yard.abort(other)


def test_what_cannot_go_on_keeps_the_whole_family_held(make: Make, wording: Wording) -> None:
    yard, mine = started(make, look=CART + "steps: [{do: cart.Haul}]")
    yard.ask(Operator("hold", mine, "ann"))
    yard.run_for(1)

    with pytest.raises(TaskError) as refused:
        yard.ask(Operator("continue", mine, "ann"))

    assert refused.value.code == "cannot_continue"
    wording(str(refused.value))
    assert (yard.task(mine).hold.words, child(yard, mine).hold.words) == (("operator",), ("operator",))
    yard.abort(mine)
    yard.run_for(1)
    assert yard.outcome(mine) == ("CANCELED", "aborted")


def test_a_parent_that_is_held_may_be_aborted_and_its_child_comes_home(make: Make) -> None:
    yard, mine = started(make)
    step(yard, "Rise")
    yard.ask(Operator("hold", mine, "ann"))
    yard.run_for(1)

    yard.abort(mine)
    yard.run_for(0.5)
    step(yard, "Home")

    assert child(yard, mine).status == "CANCELED"
    assert yard.outcome(mine) == ("CANCELED", "aborted")
    assert yard.engine.state.orders == {}


def test_a_person_who_aborts_a_child_fails_the_step_of_its_parent(make: Make, wording: Wording) -> None:
    yard, mine = started(make)

    yard.abort(child(yard, mine).id)
    yard.run_for(0.5)

    assert yard.outcome(mine) == ("FAILED", "request:aborted")
    wording(yard.task(mine).outcome.reason)


def test_abort_now_skips_the_cleanup_of_the_children_too(make: Make) -> None:
    yard, mine = started(make, look=LOOK + "on_abort: [{wait: 60 s}]")
    step(yard, "Rise")
    yard.abort(mine)
    yard.run_for(1)
    assert child(yard, mine).section == "on_abort"

    yard.ask(Abort(mine, "now", "ann"))
    yard.run_for(0.5)

    assert child(yard, mine).section == "recover"
    step(yard, "Home")
    assert yard.outcome(mine) == ("CANCELED", "aborted")


@pytest.mark.parametrize("how", ["return", "hold", "land"])
def test_after_a_lockdown_a_child_that_it_stopped_goes_on_with_its_parent(make: Make, how: str) -> None:
    yard, mine = started(make)
    step(yard, "Rise")
    yard.ask(LockdownOrder(how, "ann"))  # type: ignore[arg-type]
    assert (yard.task(mine).hold.words, child(yard, mine).hold.words) == (("lockdown",), ("lockdown",))
    yard.run_for(1)

    yard.ask(LockdownOrder("release", "ann"))
    assert "operator" in child(yard, mine).hold.words

    yard.abort(mine)
    yard.run_for(0.5)
    assert child(yard, mine).outcome.code == "aborted"


def test_a_child_stopped_by_a_lockdown_waits_for_the_word_to_its_parent(make: Make) -> None:
    yard, mine = started(make)
    yard.ask(LockdownOrder("hold", "ann"))
    yard.run_for(1)
    yard.ask(LockdownOrder("release", "ann"))
    yard.run_for(30)
    assert (yard.task(mine).hold.words, child(yard, mine).hold.words) == ((), ("operator",))

    yard.ask(Operator("continue", mine, "ann"))
    yard.run_for(0.3)

    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert yard.outcome(mine) == ("SUCCEEDED", "")


# -- mode: real --------------------------------------------------------------------------------------------------------
def real(make: Make, *approved: str, on: bool = True, wrote: str = "") -> tuple[Yard, str]:
    """Return a yard of `mode: real`, some of whose tasks are approved; Try is requested by rita."""
    mine = tasks(Try=ASKS, Look=LOOK)
    yard = make(*mine, mode="real")
    yard.cart.say(checks=(PreflightCheck("brakes", True),))
    for one in mine:
        if one.name in approved:
            yard.ask(Approve(approval_digest(one, yard.site), one.name, "ann"))
    if wrote:
        yard.ask(Serve("Look", mine[1].bundle, "", drafted([wrote])))
    if on:
        yard.ask(Duty("pia", True))
    found = yard.submit("Try", {}, by="rita")
    yard.run_for(0.5)
    return yard, found


def test_on_a_real_site_a_child_needs_an_approval_of_its_own(make: Make, wording: Wording) -> None:
    yard, mine = real(make, "Try")

    assert yard.outcome(mine) == ("FAILED", "request:not_approved")
    wording(yard.task(mine).outcome.reason)


def test_a_child_that_a_model_wrote_needs_the_word_of_another_than_who_requested_its_parent(
    make: Make, wording: Wording
) -> None:
    yard, mine = real(make, "Try", "Look", wrote="rita")
    assert yard.outcome(mine)[0] == "ACTIVE"

    yard, mine = real(make, "Try", "Look", wrote="ann")
    assert yard.outcome(mine) == ("FAILED", "request:not_approved")
    wording(yard.task(mine).outcome.reason)


def test_an_approved_child_flies_for_who_requested_its_parent_with_a_pilot_of_its_own(make: Make) -> None:
    yard, mine = real(make, "Try", "Look")

    look = child(yard, mine)
    assert (look.status, look.request.by, look.agents.pilot) == ("ACTIVE", "rita", "pia")
    assert yard.task(mine).agents.pilot == ""  # it flies nothing itself
    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_a_child_waits_for_a_pilot(make: Make) -> None:
    yard, mine = real(make, "Try", "Look", on=False)
    look = child(yard, mine)
    assert look.status == "PENDING"
    assert [v.code for v in yard.engine.state.explanations[look.id] if not v.role] == ["no_pilot"]

    yard.ask(Duty("pia", True))
    yard.run_for(0.3)

    assert child(yard, mine).status == "ACTIVE"
    yard.abort(mine)


def test_a_snapshot_with_a_child_under_way_is_whole(make: Make) -> None:
    yard, mine = started(make)

    loaded = reloaded(yard.engine.state)

    assert snapshot(loaded) == snapshot(yard.engine.state)
    assert any(isinstance(mem, RequestMem) for mem in loaded.memory[mine].values())
    yard.abort(mine)


@pytest.mark.parametrize(("detached", "status"), [(False, "FAILED"), (True, "PENDING")])
def test_who_holds_agents_does_not_wait_for_a_child_without_end(make: Make, detached: bool, status: str) -> None:
    step = f"{{request: Look, detached: {str(detached).lower()}, wait: {str(not detached).lower()}}}"
    yard = make(*tasks(Try=f"steps: [{step}]", Look=LOOK, Long=CART + "steps: [{wait: 1 h}]"))
    yard.start("Long")
    mine = yard.start()
    one = child(yard, mine).id

    yard.run_for(15 * 60 + 2)

    assert yard.task(one).status == status
    assert detached or yard.outcome(mine) == ("FAILED", "request:no_agent")
    if detached:
        yard.abort(one)
