"""`with_resource` in the engine: granted in order, all at once, kept as long as it must be, never so that two wait for ever."""

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel.inputs import LockdownOrder, Operator
from formiga_bt.lang.model import Catalogue, Resource, Site, Task
from tests.reloading import reloaded
from tests.unit.engine import yard as yards
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task

RESOURCES = {"lift": Resource("lift", 1), "bridge": Resource("bridge", 1), "bay": Resource("bay", 3)}


def block(what: str, steps: str, wait: str = "60 s") -> str:
    return f"{{with_resource: {what}, wait: {wait}, steps: [{steps}]}}"


def tried(what: str, steps: str, name: str = "Try", wait: str = "60 s", head: str = "", tail: str = "") -> Task:
    return task(f"{head}{CART}steps: [{block(what, steps, wait)}{tail}]", name=name)


@pytest.fixture(autouse=True)
def hall(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give the yard a lift, a bridge and three bays."""
    real = yards.yard

    def with_resources(mode: str = "simulation") -> tuple[Site, Catalogue]:
        site, catalogue = real(mode)
        return replace(site, resources=RESOURCES), catalogue

    monkeypatch.setattr(yards, "yard", with_resources)


def units(yard: Yard, task_id: str) -> dict[str, int]:
    return yard.task(task_id).resources.units


def codes(yard: Yard, task_id: str) -> list[str]:
    found = yard.engine.state.explanations
    return [v.code for key, verdicts in found.items() if key.startswith(f"{task_id}|") for v in verdicts]


def test_it_is_held_for_the_block_and_given_back_after_it(make: Make) -> None:
    yard = make(tried("lift", "{wait: 5 s}", tail=", {wait: 5 s}"))
    mine = yard.start()

    assert units(yard, mine) == {"lift": 1}
    yard.run_for(5.5)
    assert yard.task(mine).status == "ACTIVE"
    assert units(yard, mine) == {}
    assert yard.end(mine) == ("SUCCEEDED", "")


def test_the_second_waits_and_is_granted_when_the_first_is_done(make: Make) -> None:
    yard = make(tried("lift", "{wait: 5 s}"), tried("lift", "{wait: 5 s}", "Other"), carts=2)
    first, second = yard.start(), yard.start("Other")

    assert (units(yard, first), units(yard, second)) == ({"lift": 1}, {})
    assert codes(yard, second) == ["resource_busy"]
    yard.end(first)
    yard.run_for(0.2)
    assert units(yard, second) == {"lift": 1}
    assert yard.end(second) == ("SUCCEEDED", "")


def test_all_are_taken_at_once_or_none_and_nobody_passes_who_waits_for_the_same(make: Make) -> None:
    yard = make(
        tried("[bay: 2]", "{wait: 5 s}"), tried("[lift, bay: 2]", "{wait: 5 s}", "Both"), tried("bay", "{wait: 1 s}", "Late"),
        carts=3,
    )  # fmt: skip
    first, both, late = yard.start(), yard.start("Both"), yard.start("Late")

    assert units(yard, both) == {}
    assert units(yard, late) == {}, "one bay is free, but an older block waits for bays"
    assert codes(yard, late) == ["resource_queue"]
    yard.end(first)
    yard.run_for(0.2)
    assert units(yard, both) == {"lift": 1, "bay": 2}
    assert units(yard, late) == {"bay": 1}
    assert yard.end(both) == yard.end(late) == ("SUCCEEDED", "")


def test_the_more_urgent_goes_first(make: Make) -> None:
    yard = make(
        tried("lift", "{wait: 5 s}"), tried("lift", "{wait: 5 s}", "Low"),
        tried("lift", "{wait: 5 s}", "Urgent", head="priority: high\n"), carts=3,
    )  # fmt: skip
    first, low, urgent = yard.start(), yard.start("Low"), yard.start("Urgent")

    yard.end(first)
    yard.run_for(0.2)

    assert (units(yard, low), units(yard, urgent)) == ({}, {"lift": 1})
    yard.end(urgent)
    yard.end(low)


def test_not_in_time_is_a_failure_that_the_tree_may_catch(make: Make) -> None:
    text = f"{CART}steps: [{{fallback: [{block('lift', '{wait: 1 s}', '3 s')}, {{check: error.code == 'resource_timeout'}}]}}]"
    yard = make(tried("lift", "{wait: 30 s}", "Long"), task(text), carts=2)
    long, mine = yard.start("Long"), yard.start()

    assert yard.end(mine) == ("SUCCEEDED", "")
    assert not yard.engine.state.requests
    yard.end(long)


def test_a_resource_that_the_site_lost_fails_at_once(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setitem(RESOURCES, "crane", Resource("crane", 1))
        made = tried("crane", "{wait: 1 s}")
    site, catalogue = yards.yard()
    less = replace(site, resources={name: one for name, one in RESOURCES.items() if name != "crane"})
    monkeypatch.setattr(yards, "yard", lambda _mode="simulation": (less, catalogue))
    yard = make(made)
    mine = yard.start()
    yard.run_for(0.5)

    assert yard.outcome(mine) == ("FAILED", "no_resource")


@pytest.mark.parametrize("how", ["fails", "aborted", "preempted"])
def test_a_task_that_ends_with_its_block_keeps_it_until_its_machine_is_home(make: Make, how: str) -> None:
    yard = make(
        tried("lift", "{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}", head="priority: low\n"),
        tried("lift", "{wait: 1 s}", "Other"),
        task("priority: high\nagents: {cart: {type: cart, id: c1}}\nsteps: [{wait: 1 s}]", name="Urgent"),
        carts=2,
    )
    mine = yard.start()
    yard.carts[0].succeed()
    yard.run_for(0.2)
    other = yard.start("Other")
    yard.carts[0].confirms_cancel = False

    urgent = yard.start("Urgent") if how == "preempted" else ""
    if how == "fails":
        yard.carts[0].fail("stuck")
    elif how == "aborted":
        yard.abort(mine)
    yard.run_for(0.5)
    if how != "fails":
        assert (units(yard, mine), units(yard, other)) == ({"lift": 1}, {}), "its goal has not ended yet"
        yard.carts[0].side.finish(yard.carts[0].goal.goal_id, "canceled")
        yard.run_for(0.5)
    assert yard.carts[0].goal.action == "Home"
    assert (units(yard, mine), units(yard, other)) == ({"lift": 1}, {}), "its machine is not home yet"
    yard.carts[0].succeed()
    yard.run_for(0.5)
    assert units(yard, other) == {"lift": 1}
    assert yard.end(other) == ("SUCCEEDED", "")
    if urgent:
        assert yard.end(urgent) == ("SUCCEEDED", "")
        yard.abort(mine)


def test_a_block_that_fails_while_its_task_goes_on_gives_it_back(make: Make) -> None:
    text = f"{CART}steps: [{{fallback: [{block('lift', '{do: cart.Move}')}, {{wait: 5 s}}]}}]"
    yard = make(task(text))
    mine = yard.start()
    yard.cart.fail("stuck")
    yard.run_for(0.3)

    assert yard.task(mine).status == "ACTIVE"
    assert units(yard, mine) == {}
    assert yard.end(mine) == ("SUCCEEDED", "")


def test_a_timeout_around_the_block_gives_it_back_when_the_goal_has_ended(make: Make) -> None:
    inside = block("lift", "{do: cart.Move}")
    text = f"{CART}steps: [{{sequence: [{inside}], timeout: 2 s, ignore_failure: true}}, {{wait: 5 s}}]"
    yard = make(task(text))
    mine = yard.start()
    yard.cart.confirms_cancel = False
    yard.run_for(3)

    assert units(yard, mine) == {"lift": 1}
    yard.cart.side.finish(yard.cart.goal.goal_id, "canceled")
    yard.run_for(0.3)
    assert units(yard, mine) == {}
    assert yard.end(mine) == ("SUCCEEDED", "")


def test_held_keeps_what_is_held_and_is_granted_nothing(make: Make) -> None:
    yard = make(
        tried("lift", "{wait: 2 s}"), tried("bay", "{wait: 30 s}", "Other", tail=", " + block("lift", "{wait: 1 s}"))
    )
    mine = yard.start()
    yard.ask(Operator("hold", mine, "ann"))

    yard.run_for(10)

    assert units(yard, mine) == {"lift": 1}
    yard.ask(Operator("continue", mine, "ann"))
    assert yard.end(mine) == ("SUCCEEDED", "")


def test_lockdown_grants_nothing(make: Make) -> None:
    yard = make(tried("lift", "{wait: 2 s}"), tried("lift", "{wait: 1 s}", "Other"), carts=2)
    first, second = yard.start(), yard.start("Other")
    yard.ask(LockdownOrder("hold", "ann"))
    yard.run_for(5)
    assert (units(yard, first), units(yard, second)) == ({"lift": 1}, {})

    yard.ask(LockdownOrder("release", "ann"))
    yard.run_for(1)
    for one in (first, second):
        if yard.task(one).hold.causes:
            yard.ask(Operator("continue", one, "ann"))
    assert yard.end(first) == yard.end(second) == ("SUCCEEDED", "")


def test_a_snapshot_keeps_claims_and_requests(make: Make) -> None:
    yard = make(tried("[lift, bay: 2]", "{wait: 5 s}"), tried("lift", "{wait: 1 s}", "Other"), carts=2)
    mine, other = yard.start(), yard.start("Other")
    state = reloaded(yard.engine.state)

    assert state.tasks[mine].resources == yard.task(mine).resources
    assert [request.units for request in state.requests.values()] == [{"lift": 1}]
    yard.end(mine)
    yard.end(other)


def test_two_that_take_two_in_opposite_orders_never_wait_for_each_other(make: Make) -> None:
    one = tried("lift", "{wait: 2 s}, " + block("bridge", "{wait: 2 s}"), "One")
    two = tried("bridge", "{wait: 2 s}, " + block("lift", "{wait: 2 s}"), "Two")
    yard = make(one, two, carts=2)
    first, second = yard.start("One"), yard.start("Two")

    assert (units(yard, first), units(yard, second)) == ({"lift": 1}, {})
    assert codes(yard, second) == ["safe_order"]
    assert yard.end(first, limit_s=30) == yard.end(second, limit_s=30) == ("SUCCEEDED", "")


def test_who_holds_one_already_is_not_held_up_by_an_older_one_in_the_queue(make: Make) -> None:
    older = tried("[lift, bridge]", "{wait: 1 s}", "Older", head="priority: high\n")
    holder = tried("bridge", "{wait: 2 s}, " + block("lift", "{wait: 2 s}"), "Holder")
    yard = make(older, holder, carts=2)
    second = yard.start("Holder")
    first = yard.start("Older")

    assert yard.end(second, limit_s=30) == ("SUCCEEDED", "")
    assert yard.end(first, limit_s=30) == ("SUCCEEDED", "")


def test_tasks_that_hold_machines_and_want_more_are_not_begun_all_at_once(make: Make) -> None:
    text = (
        CART
        + "steps: [{wait: 1 s}, {with_agents: {more: {type: cart, wait: 30 s}}, steps: [{check: more.battery > 1 %}]}]"
    )
    yard = make(task(text), task(text, name="Other"), carts=2)
    first, second = yard.start(), yard.start("Other")

    assert yard.task(second).status == "PENDING"
    assert "safe_order" in [v.code for v in yard.engine.state.explanations[second]]
    assert yard.end(first, limit_s=20) == ("SUCCEEDED", "")
    assert yard.end(second, limit_s=20) == ("SUCCEEDED", "")
