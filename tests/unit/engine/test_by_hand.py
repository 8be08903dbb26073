"""A person gives agents to tasks, takes them back, and says which goes first: through the filters, kept, undone, refused."""

from typing import Any

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import (
    Assign,
    InService,
    LockdownOrder,
    NotifyPeople,
    Operator,
    Prioritize,
    Unassign,
)
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import effects
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task

HOLD = "steps: [{wait: 10 s}]\n"
ONE = task(
    "params: {r: {type: agent, of: [cart], optional: true}}\nagents: {cart: {type: cart, id: '${r}'}}\n" + HOLD,
    name="One",
)
TEAM = task("agents: {carts: {type: cart, count: 2, near: far}}\n" + HOLD, name="Team")
PAIR = task("agents: {lead: {type: cart}, back: {type: cart}}\n" + HOLD, name="Pair")
SOS = task("priority: high\n" + CART + HOLD, name="Sos")
NEAR = task("agents: {cart: {type: cart, near: far}}\n" + HOLD, name="Near")
LOW = task("agents: {cart: {type: cart, battery_min: 90 %}}\n" + HOLD, name="Low")
FLIGHT = task(CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]\n", name="Flight")
HAUL = task(CART + "steps: [{do: cart.Haul}, {do: cart.Move}]\n", name="Haul")
CRITICAL = task(CART + "steps: [{do: cart.Move, critical: true}]\n", name="Critical")
BLOCK = task(
    "agents: {one: {type: cart}}\nsteps: [{with_agents: {more: {type: cart, near: far}}, steps: [{wait: 10 s}]}]\n",
    name="Block",
)
ALL = (ONE, TEAM, PAIR, SOS, NEAR, LOW, FLIGHT, HAUL, CRITICAL, BLOCK)


def standing(make: Make, carts: int = 3) -> Yard:
    """Return a yard in which an order stands on every cart, so that tasks wait."""
    yard = make(*ALL, carts=carts)
    yard.ask(Operator("hold", "", "ann"))
    yard.run_for(0.2)
    return yard


def free(yard: Yard, *carts: str) -> None:
    """Let carts work again; the allocator has not looked yet."""
    for cart in carts:
        yard.ask(Operator("continue", cart, "ann"))


def refused(yard: Yard, given: Any) -> str:
    with pytest.raises(TaskError) as raised:
        yard.ask(given)
    return raised.value.code


def roles(yard: Yard, task_id: str) -> dict[str, tuple[str, ...]]:
    return yard.task(task_id).agents.roles


def code(yard: Yard, task_id: str, cart: str) -> str:
    return next(v.code for v in yard.engine.state.explanations[task_id] if v.agent == cart)


class TestAssign:
    def test_it_is_granted_in_the_same_step_though_another_is_nearer(self, make: Make) -> None:
        yard = standing(make)
        mine = yard.start("Near")
        free(yard, "c1", "c3")

        yard.ask(Assign(mine, "c1", by="eve"))

        assert roles(yard, mine) == {"cart": ("c1",)}
        assert (yard.task(mine).status, code(yard, mine, "c1")) == ("ACTIVE", "chosen")
        yard.ask(Assign(mine, "c1"))  # said twice
        assert refused(yard, Assign(mine, "c3")) == "needs_nobody"

    @pytest.mark.parametrize(
        ("cart", "why"), [("c1", "ordered"), ("c2", "battery"), ("ann", "wrong_type"), ("c9", "unknown_agent")]
    )
    def test_every_filter_holds(self, make: Make, cart: str, why: str) -> None:
        yard = make(*ALL, carts=2)
        yard.ask(Operator("hold", "c1", "ann"))
        yard.carts[1].say(battery=50.0)
        yard.run_for(0.2)
        mine = yard.start("Low")
        before = yard.engine.state.requests[mine]

        assert refused(yard, Assign(mine, cart)) == why
        assert yard.engine.state.requests[mine] == before

    def test_a_busy_one_and_another_than_the_request_names_are_refused(self, make: Make) -> None:
        yard = make(*ALL, carts=2)
        first = yard.start("One", r=AgentRef("c1"))
        second = yard.start("One", r=AgentRef("c1"))

        assert refused(yard, Assign(second, "c1")) == "busy"
        assert refused(yard, Assign(second, "c2")) == "not_this_one"
        yard.end(first)
        assert refused(yard, Assign(first, "c1")) == "already_ended"
        assert refused(yard, Assign("No-1", "c1")) == "unknown_task"

    def test_one_of_a_team_is_kept_for_it_from_all_but_more_urgent_ones(self, make: Make) -> None:
        yard = standing(make)
        team = yard.start("Team")
        free(yard, "c1")
        yard.ask(Assign(team, "c1", by="eve"))
        other = yard.start("Near")
        yard.run_for(1.0)
        assert (yard.task(team).status, yard.task(other).status) == ("PENDING", "PENDING")
        assert code(yard, other, "c1") == "busy"
        assert refused(yard, Assign(other, "c1")) == "busy"

        state = reloaded(yard.engine.state)
        assert state.requests[team].roles[0].by_hand == ("c1",), "also after a kill"

        urgent = yard.start("Sos")
        assert roles(yard, urgent) == {"cart": ("c1",)}
        yard.end(urgent)
        free(yard, "c2", "c3")
        yard.run_for(0.2)
        assert set(roles(yard, team)["carts"]) >= {"c1"}, "c2 and c3 are nearer"

    def test_which_role_is_said_where_several_would_do(self, make: Make) -> None:
        yard = standing(make)
        pair = yard.start("Pair")
        free(yard, "c1", "c2")
        yard.ask(Operator("hold", "c2", "ann"))

        assert refused(yard, Assign(pair, "c1")) == "which_role"
        assert refused(yard, Assign(pair, "c1", "third")) == "unknown_role"
        yard.ask(Assign(pair, "c1", "back"))
        assert refused(yard, Assign(pair, "c3", "back")) == "by_hand"
        free(yard, "c2")
        yard.run_for(0.2)
        assert roles(yard, pair) == {"lead": ("c2",), "back": ("c1",)}

    def test_a_block_of_a_task_that_runs_takes_one_too(self, make: Make) -> None:
        yard = make(*ALL, carts=3)
        yard.ask(Operator("hold", "c2", "ann"))
        yard.ask(Operator("hold", "c3", "ann"))
        mine = yard.start("Block")
        free(yard, "c2", "c3")

        yard.ask(Assign(mine, "c2"))

        assert roles(yard, mine) == {"one": ("c1",), "more": ("c2",)}

    def test_who_is_quarantined_is_kept_no_more(self, make: Make) -> None:
        yard = standing(make)
        team = yard.start("Team")
        free(yard, "c1")
        yard.ask(Assign(team, "c1"))

        yard.cart.kill()
        yard.run_for(60.0)

        assert yard.record("c1").pool == "QUARANTINED"
        assert yard.engine.state.requests[team].roles[0].by_hand == ()
        assert [n.task for n in effects(yard, NotifyPeople) if "by hand" in n.text] == [team]
        free(yard, "c2", "c3")
        yard.run_for(0.2)
        assert set(roles(yard, team)["carts"]) == {"c2", "c3"}

    def test_what_holds_all_requests_holds_this_one(self, make: Make) -> None:
        yard = standing(make)
        mine = yard.start("Near")
        free(yard, "c1")
        yard.ask(LockdownOrder("hold", "ann"))
        assert refused(yard, Assign(mine, "c1")) == "lockdown"


class TestUnassign:
    def test_one_that_flies_comes_home_and_the_task_waits_for_another_word(self, make: Make) -> None:
        yard = make(*ALL)
        mine = yard.start("Flight")
        yard.cart.succeed()
        yard.run_for(0.2)

        yard.ask(Unassign("c1", "eve"))

        yard.run_for(0.2)
        assert (yard.task(mine).status, yard.record("c1").task) == ("ENDING", mine)
        assert yard.cart.goal.action == "Home"
        yard.cart.succeed()
        yard.run_for(20.0)
        assert (yard.task(mine).status, yard.task(mine).run, yard.record("c1").pool) == ("PENDING", 2, "STANDBY")
        assert code(yard, mine, "c1") == "taken_back"
        assert "eve" in yard.task(mine).restart.past[0]
        yard.ask(Assign(mine, "c1"))
        assert roles(yard, mine) == {"cart": ("c1",)}

    def test_another_is_chosen_by_itself(self, make: Make) -> None:
        yard = make(*ALL, carts=2)
        mine = yard.start("Near")
        assert roles(yard, mine)["cart"] == ("c2",)
        yard.ask(Unassign("c2"))
        yard.run_for(0.2)
        assert roles(yard, mine)["cart"] == ("c1",)

    def test_one_that_is_only_kept_is_free_at_once(self, make: Make) -> None:
        yard = standing(make)
        team = yard.start("Team")
        free(yard, "c1")
        yard.ask(Assign(team, "c1"))

        yard.ask(Unassign("c1"))

        assert roles(yard, yard.start("Near")) == {"cart": ("c1",)}
        assert refused(yard, Unassign("c2")) == "not_assigned"

    @pytest.mark.parametrize(("name", "done"), [("Haul", 1), ("Critical", 0)])
    def test_what_would_be_lost_by_it_is_refused(self, make: Make, name: str, done: int) -> None:
        yard = make(*ALL)
        mine = yard.start(name)
        for _ in range(done):
            yard.cart.succeed()
            yard.run_for(0.2)

        assert refused(yard, Unassign("c1")) == "cannot_begin_anew"
        assert yard.task(mine).status == "ACTIVE"

    def test_lockdown_a_pilot_and_an_ending_task_refuse_it(self, make: Make) -> None:
        yard = make(*ALL)
        mine = yard.start("Flight")
        yard.cart.succeed()
        yard.run_for(0.2)
        yard.cart.side.take_control("pilot")
        yard.run_for(0.2)
        assert refused(yard, Unassign("c1")) == "not_in_command"
        yard.ask(LockdownOrder("hold", "ann"))
        assert refused(yard, Unassign("c1")) == "lockdown"
        assert yard.task(mine).run == 1


class TestPrioritize:
    def test_a_task_that_waits_goes_before_those_of_lower_priority(self, make: Make) -> None:
        yard = standing(make)
        first, second = yard.start("Near"), yard.start("Near")
        free(yard, "c1")

        yard.ask(Prioritize(second, "high", by="eve"))
        yard.run_for(0.2)

        assert (yard.task(first).status, yard.task(second).status) == ("PENDING", "ACTIVE")
        assert yard.task(second).request.priority == "high"
        assert refused(yard, Prioritize(second, "low")) == "already_started"

    def test_or_first_of_its_own(self, make: Make) -> None:
        yard = standing(make)
        names = [yard.start("Near") for _ in range(3)]
        yard.ask(Prioritize(names[2], "medium", first=True))
        yard.ask(Prioritize(names[1], "medium", first=True))
        free(yard, "c1", "c2")
        yard.run_for(0.2)
        assert [yard.task(one).status for one in names] == ["PENDING", "ACTIVE", "ACTIVE"]

    def test_one_that_is_high_now_has_others_step_aside(self, make: Make) -> None:
        yard = make(*ALL)
        mine = yard.start("Flight")
        other = yard.start("Near")
        yard.ask(Prioritize(other, "high"))
        yard.run_for(0.2)
        assert yard.task(mine).restart.why == "preempted" or yard.task(mine).run == 2


class TestOutOfService:
    def test_it_ends_what_it_does_and_gets_no_more(self, make: Make) -> None:
        yard = make(*ALL)
        first, second = yard.start("Flight"), yard.start("Near")

        yard.ask(InService("c1", "rotor", "eve"))

        for _ in range(3):
            yard.cart.succeed()
            yard.run_for(0.2)
        assert yard.outcome(first) == ("SUCCEEDED", "")
        yard.run_for(5.0)
        assert (yard.task(second).status, code(yard, second, "c1")) == ("PENDING", "out")
        assert refused(yard, Assign(second, "c1")) == "out"
        assert reloaded(yard.engine.state).agents["c1"].out == "rotor", "also after a kill"
        yard.cart.kill()
        yard.cart.boot()
        yard.run_for(60.0)
        assert yard.record("c1").out == "rotor", "also when its own process was started anew"
        yard.ask(InService("c1"))
        yard.run_for(0.2)
        assert yard.task(second).status == "ACTIVE"
        assert refused(yard, InService("c1")) == "not_out"

    def test_who_waits_for_it_is_told(self, make: Make) -> None:
        yard = standing(make)
        mine, team = yard.start("One", r=AgentRef("c1")), yard.start("Team")
        free(yard, "c2")
        yard.ask(Assign(team, "c2"))

        yard.ask(InService("c1", "rotor"))
        yard.ask(InService("c1", "rotor and battery"))
        yard.ask(InService("c2", "rotor"))

        assert [n.task for n in effects(yard, NotifyPeople)] == [mine, team]
        assert yard.engine.state.requests[team].roles[0].by_hand == ()
        assert yard.record("c1").out == "rotor and battery"
        assert yard.task(mine).status == "PENDING"

    def test_a_high_task_takes_it_from_nobody(self, make: Make) -> None:
        yard = make(*ALL)
        mine = yard.start("Flight")
        yard.ask(InService("c1", "rotor"))
        yard.start("Sos")
        yard.run_for(1.0)
        assert (yard.task(mine).run, yard.task(mine).restart.why) == (1, "")

    def test_orders_and_its_way_home_reach_it_and_people_are_not_machines(self, make: Make) -> None:
        yard = make(*ALL)
        yard.start("Flight")
        yard.cart.succeed()
        yard.run_for(0.2)
        yard.ask(InService("c1", "rotor"))
        yard.ask(Unassign("c1"))
        yard.run_for(0.2)
        assert yard.cart.goal.action == "Home"
        assert refused(yard, InService("ann", "ill")) == "human"
        assert refused(yard, InService("c9", "rotor")) == "unknown_agent"
