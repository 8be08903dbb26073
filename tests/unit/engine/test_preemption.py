"""A HIGH request preempts a lower task (execution: preemption): who steps aside, who may not be asked, what both sides see."""

import pytest

from formiga_bt.base.geo import Position
from formiga_bt.engine.allocator import preemption
from formiga_bt.engine.kernel.inputs import LockdownOrder, NotifyPeople, Operator, PublishState
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.rehearsal.testing import effects
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task

FLIGHT = "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]\n"
SOS = task("priority: high\nagents: {cart: {type: cart, wait: 60 s}}\nsteps: [{do: cart.Move}]", name="Sos")
PAIR = task("priority: high\nagents: {carts: {type: cart, count: 2}}\nsteps: [{wait: 10 s}]", name="Pair")
SHORT = task("agents: {cart: {type: cart}}\nsteps: [{wait: 1 s}]", name="Short")


def aloft(make: Make, text: str = FLIGHT, **options: object) -> tuple[Yard, str]:
    """Start Try with the only cart and let it move in the air; Sos is known, and nobody asks for it yet."""
    yard = make(task(CART + text), SOS, PAIR, SHORT, **options)
    mine = yard.start()
    yard.cart.succeed()
    yard.run_for(0.2)
    return yard, mine


def verdicts(yard: Yard, task_id: str) -> dict[str, tuple[str, ...]]:
    found = [v for v in yard.engine.state.explanations[task_id] if v.agent.startswith("c")]
    return {v.agent: (v.code, v.detail, v.why) if v.why else (v.code, v.detail) for v in found}


def step(yard: Yard, action: str, cart: int = 0) -> None:
    """Let a cart succeed with what it does, which must be this."""
    assert yard.carts[cart].goal.action == action
    yard.carts[cart].succeed()
    yard.run_for(0.3)


class TestATaskStepsAside:
    def test_its_machine_comes_home_serves_the_urgent_task_and_the_former_begins_anew(self, make: Make) -> None:
        yard, mine = aloft(make)

        urgent = yard.start("Sos")

        assert yard.cart.cancels == [f"{mine}/1/steps/steps[1]"]
        assert yard.cart.goal.goal_id == f"{mine}/1/recover:c1#1/steps[0]"
        assert (yard.task(mine).status, yard.task(urgent).status) == ("ENDING", "PENDING")
        step(yard, "Home")
        assert (yard.task(mine).status, yard.task(mine).run) == ("PENDING", 2)
        assert yard.task(urgent).agents.roles == {"cart": ("c1",)}
        step(yard, "Move")
        assert yard.outcome(urgent) == ("SUCCEEDED", "")
        for action in ("Rise", "Move", "Home"):
            assert yard.cart.goal.goal_id.startswith(f"{mine}/2/steps/")
            step(yard, action)
        assert yard.outcome(mine) == ("SUCCEEDED", "")

    def test_no_goal_id_is_used_twice(self, make: Make) -> None:
        yard, mine = aloft(make)
        yard.start("Sos")
        for action in ("Home", "Move", "Rise", "Move", "Home"):
            step(yard, action)

        ids = [request.goal_id for request in yard.cart.requests]
        assert len(ids) == len(set(ids)) == 7
        assert yard.task(mine).status == "SUCCEEDED"

    def test_on_abort_sees_preempted_and_finally_runs_before_the_way_home(self, make: Make) -> None:
        cleanup = 'on_abort: [{notify: "on_abort ${abort.reason}"}]\nfinally: [{notify: tidy}, {do: cart.Move}]\n'
        yard, mine = aloft(make, FLIGHT + cleanup)

        yard.start("Sos")

        assert [notice.text for notice in effects(yard, NotifyPeople)] == ["on_abort preempted", "tidy"]
        assert yard.cart.goal.goal_id == f"{mine}/1/finally/finally[1]"
        step(yard, "Move")
        step(yard, "Home")
        assert yard.task(mine).status == "PENDING"
        step(yard, "Move")

    def test_both_sides_are_told(self, make: Make, wording: Wording) -> None:
        yard, mine = aloft(make)

        urgent = yard.start("Sos")

        assert verdicts(yard, urgent)["c1"] == ("preempting", mine)
        assert yard.engine.state.requests[urgent].preempting == {mine: 1}
        assert reloaded(yard.engine.state).requests == yard.engine.state.requests
        assert (yard.task(mine).restart.why, yard.task(mine).outcome.reason) == ("preempted", f"for {urgent}")
        step(yard, "Home")
        wording(yard.task(mine).restart.past)
        words = [e.status for e in effects(yard, PublishState) if e.task == mine]
        assert words == ["PENDING", "ASSIGNED", "ACTIVE", "ENDING", "PENDING"]
        step(yard, "Move")

    def test_it_ends_preempted_if_it_says_so(self, make: Make) -> None:
        yard, mine = aloft(make, "if_preempted: fail\n" + FLIGHT)

        yard.start("Sos")
        step(yard, "Home")

        assert yard.outcome(mine) == ("CANCELED", "preempted")
        step(yard, "Move")

    def test_aborted_while_it_steps_aside_it_just_ends(self, make: Make) -> None:
        yard, mine = aloft(make)
        urgent = yard.start("Sos")

        yard.abort(mine, by="ann")
        step(yard, "Home")

        assert yard.outcome(mine) == ("CANCELED", "aborted")
        assert yard.task(urgent).status == "ACTIVE"
        step(yard, "Move")

    def test_abandoned_while_it_steps_aside_it_does_not_begin_anew(self, make: Make) -> None:
        yard, mine = aloft(make)
        urgent = yard.start("Sos")

        yard.abort(mine, how="abandon", by="ann")
        yard.run_for(1)

        assert yard.outcome(mine) == ("CANCELED", "aborted")
        assert (yard.record("c1").quarantine, yard.task(urgent).status) == ("abandoned", "PENDING")
        yard.abort(urgent)

    def test_who_asked_may_be_aborted_and_the_task_begins_anew_all_the_same(self, make: Make) -> None:
        yard, mine = aloft(make)
        urgent = yard.start("Sos")

        yard.abort(urgent)
        step(yard, "Home")

        assert (yard.task(mine).status, yard.task(mine).run) == ("ACTIVE", 2)


class TestWhoMayNotBeAsked:
    @pytest.mark.parametrize(
        ("text", "code"),
        [
            ("preemptible: false\n" + FLIGHT, "not_preemptible"),
            ("steps: [{do: cart.Rise}, {do: cart.Move, critical: true}, {do: cart.Home}]", "critical"),
            ("steps: [{do: cart.Rise}, {sequence: [{do: cart.Move}], critical: true}, {do: cart.Home}]", "critical"),
            ("steps: [{do: cart.Haul}, {do: cart.Move}]", "spent"),
        ],
    )
    def test_by_its_file(self, make: Make, text: str, code: str) -> None:
        yard, mine = aloft(make, text)

        urgent = yard.start("Sos")

        assert verdicts(yard, urgent)["c1"] == ("kept", mine, code)
        assert (yard.cart.cancels, yard.task(mine).status) == ([], "ACTIVE")

    def test_while_a_machine_of_it_is_loaded(self, make: Make) -> None:
        yard, mine = aloft(make)
        yard.cart.say(payload_kg=1.5)
        yard.run_for(0.1)

        urgent = yard.start("Sos")

        assert verdicts(yard, urgent)["c1"] == ("kept", mine, "loaded")
        yard.cart.say(payload_kg=0.0)
        yard.run_for(0.3)
        assert yard.task(mine).restart.why == "preempted"

    def test_once_the_critical_step_is_over_it_is_asked(self, make: Make) -> None:
        text = "steps: [{do: cart.Rise}, {do: cart.Move, critical: true}, {do: cart.Move}, {do: cart.Home}]"
        yard, mine = aloft(make, text)
        yard.start("Sos")
        assert yard.task(mine).restart.why == ""

        step(yard, "Move")
        yard.run_for(1.5)

        assert yard.task(mine).restart.why == "preempted"

    def test_while_a_person_holds_it(self, make: Make) -> None:
        yard, mine = aloft(make)
        yard.ask(Operator("hold", mine, "ann"))
        yard.run_for(0.3)

        urgent = yard.start("Sos")

        assert yard.task(mine).hold.words == ("operator",)
        assert (yard.task(mine).restart.why, yard.task(urgent).status) == ("", "PENDING")
        yard.abort(urgent)
        yard.abort(mine)

    @pytest.mark.parametrize(("mine", "theirs"), [("high", "high"), ("medium", "medium"), ("low", "medium")])
    def test_by_a_task_of_its_class_or_one_that_is_not_high(self, make: Make, mine: str, theirs: str) -> None:
        yard = make(task(CART + "preemptible: true\n" + FLIGHT), SOS)
        running = yard.submit("Try", {}, priority=mine)
        yard.run_for(0.2)

        waiting = yard.submit("Sos", {}, priority=theirs)
        yard.run_for(5)

        assert (yard.task(running).restart.why, yard.task(waiting).status) == ("", "PENDING")
        assert verdicts(yard, waiting)["c1"] == ("busy", running)

    def test_who_would_not_fit_when_it_is_home(self, make: Make) -> None:
        weak = task("priority: high\nagents: {cart: {type: cart, battery_min: 50 %}}\nsteps: [{wait: 1 s}]", name="Far")
        yard = make(task(CART + FLIGHT), weak)
        mine = yard.start()
        yard.cart.say(battery=40.0)
        yard.run_for(0.2)

        urgent = yard.start("Far")

        assert (yard.task(mine).restart.why, verdicts(yard, urgent)["c1"]) == ("", ("busy", mine))

    def test_nobody_in_lockdown(self, make: Make) -> None:
        yard, mine = aloft(make)
        blocker = yard.submit("Sos")  # waits already when lockdown is pressed in the same instant

        yard.ask(LockdownOrder("hold", "ann"))
        yard.run_for(5)

        assert (yard.task(mine).restart.why, yard.task(blocker).status) == ("", "PENDING")
        yard.ask(LockdownOrder("release", "ann"))
        yard.abort(blocker)
        yard.abort(mine)

    def test_nobody_while_another_machine_is_free(self, make: Make) -> None:
        yard, mine = aloft(make, carts=2)

        urgent = yard.start("Sos")

        assert yard.task(urgent).agents.roles == {"cart": ("c2",)}
        assert yard.task(mine).restart.why == ""
        step(yard, "Move", 1)


class TestWhomItAsks:
    def test_the_lowest_then_the_youngest(self, make: Make) -> None:
        yard = make(task(CART + "steps: [{wait: 100 s}]"), SOS, carts=3)
        low, older, younger = (yard.submit("Try", {}, priority=p) for p in ("low", "medium", "medium"))
        yard.run_for(0.3)

        asked = []
        for _ in range(3):
            yard.start("Sos")
            asked += [t for t in (older, younger, low) if yard.task(t).run == 2 and t not in asked]

        assert asked == [low, younger, older]

    def test_as_few_as_can_be(self, make: Make) -> None:
        two = task("agents: {carts: {type: cart, count: 2}}\nsteps: [{wait: 100 s}]", name="Two")
        yard = make(task(CART + "steps: [{wait: 100 s}]"), two, PAIR, carts=4)
        both = yard.submit("Two")
        singles = [yard.submit("Try", {}, priority="low") for _ in range(2)]
        yard.run_for(0.3)

        urgent = yard.start("Pair")

        assert [yard.task(t).run for t in (both, *singles)] == [2, 1, 1]
        assert set(yard.task(urgent).agents.roles["carts"]) == {"c1", "c2"}

    def test_where_too_many_sets_would_be_compared_none_is_asked_in_vain(
        self, make: Make, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(preemption, "MOST_SETS", 1)
        yard = make(task(CART + "steps: [{wait: 100 s}]"), PAIR, carts=3)
        tasks = [yard.submit("Try") for _ in range(3)]
        yard.run_for(0.3)

        urgent = yard.start("Pair")

        assert [yard.task(t).run for t in tasks] == [1, 2, 2]
        assert set(yard.task(urgent).agents.roles["carts"]) == {"c2", "c3"}

    def test_nobody_whose_machine_stands_away_from_its_port(self, make: Make) -> None:
        yard, mine = aloft(make)
        yard.cart.say(landed="grounded", position=Position(15.0, 0.0, 0.0))
        yard.run_for(0.1)

        urgent = yard.start("Sos")

        assert (yard.task(mine).restart.why, verdicts(yard, urgent)["c1"]) == ("", ("busy", mine))
        yard.abort(mine)

    def test_one_of_two_waiting_has_the_machine_and_nobody_is_asked_twice(self, make: Make) -> None:
        yard, mine = aloft(make)
        first, second = yard.start("Sos"), yard.start("Sos")

        requests = yard.engine.state.requests
        assert (requests[first].preempting, requests[second].preempting) == ({mine: 1}, {})
        step(yard, "Home")
        assert [yard.task(t).status for t in (first, second)] == ["ACTIVE", "PENDING"]
        step(yard, "Move")
        assert yard.task(second).status == "ACTIVE"
        step(yard, "Move")

    def test_a_machine_that_is_lost_on_its_way_home_is_replaced(self, make: Make) -> None:
        yard = make(task(CART + FLIGHT), SOS, carts=2)
        tasks = [yard.submit("Try") for _ in range(2)]
        yard.run_for(0.2)
        for cart in yard.carts:
            cart.succeed()
        yard.run_for(0.2)
        urgent = yard.start("Sos")
        assert [yard.task(t).restart.why for t in tasks] == ["", "preempted"]
        (flying,) = yard.task(tasks[1]).agents.granted

        next(c for c in yard.carts if c.id == flying).kill()
        yard.run_for(40)

        assert yard.task(tasks[1]).status == "PENDING"
        assert yard.engine.state.requests[urgent].preempting == {tasks[0]: 1}
        yard.carts[0].succeed()
        yard.run_for(0.3)
        assert yard.task(urgent).status == "ACTIVE"


DRILL = (
    "priority: high\nsteps:\n  - with_agents:\n      all: {type: cart, count: COUNT, preempt: true}\n    steps:\n"
    "      - for: {one: '${all}'}\n        mode: parallel\n        steps: [{do: one.Park}]\n"
)
"""A fire drill: as many carts as can be had."""


class TestASeizure:
    def drill(self, make: Make, count: str = "all", *, others: int = 2, low: str = FLIGHT, carts: int = 3) -> Yard:
        """Start tasks with a cart each, let them rise, and have a drill that is not begun yet."""
        yard = make(task(CART + low), task(DRILL.replace("COUNT", count), name="Drill"), SHORT, carts=carts)
        self.busy = [yard.start() for _ in range(others)]
        for cart in yard.carts[:others]:
            cart.succeed()
        yard.run_for(0.2)
        return yard

    def all_of(self, yard: Yard, urgent: str) -> tuple[str, ...]:
        return tuple(sorted(set(yard.task(urgent).agents.granted)))

    def test_it_waits_for_all_that_others_can_give_and_keeps_what_is_free(self, make: Make) -> None:
        yard = self.drill(make)

        urgent = yard.start("Drill")
        short = yard.start("Short")

        assert self.all_of(yard, urgent) == ()
        assert [yard.task(t).restart.why for t in self.busy] == ["preempted"] * 2
        (asked,) = [r.task for r in yard.engine.state.requests.values() if r.holder == urgent]
        assert verdicts(yard, asked)["c1"] == ("preempting", self.busy[0])
        step(yard, "Home", 0)
        assert (self.all_of(yard, urgent), yard.task(short).status) == ((), "PENDING")
        step(yard, "Home", 1)
        assert self.all_of(yard, urgent) == ("c1", "c2", "c3")
        for n in range(3):
            step(yard, "Park", n)
        assert yard.outcome(urgent) == ("SUCCEEDED", "")
        assert [yard.task(t).run for t in self.busy] == [2, 2]

    def test_who_may_not_be_asked_is_not_waited_for(self, make: Make) -> None:
        yard = self.drill(make, low="preemptible: false\n" + FLIGHT)

        urgent = yard.start("Drill")

        assert self.all_of(yard, urgent) == ("c3",)
        assert [yard.task(t).run for t in self.busy] == [1, 1]

    def test_no_more_than_the_greatest_number(self, make: Make) -> None:
        yard = self.drill(make, count="{min: 1, max: 2}")

        urgent = yard.start("Drill")

        assert [yard.task(t).restart.why for t in self.busy] == ["", "preempted"]
        step(yard, "Home", 1)
        assert self.all_of(yard, urgent) == ("c2", "c3")

    def test_one_that_is_lost_on_its_way_home_is_not_waited_for(self, make: Make) -> None:
        yard = self.drill(make)
        urgent = yard.start("Drill")
        yard.carts[0].kill()
        step(yard, "Home", 1)

        yard.run_for(40)

        assert self.all_of(yard, urgent) == ("c2", "c3")

    def test_one_without_preempt_takes_only_those_that_are_free(self, make: Make) -> None:
        yard = make(
            task(CART + FLIGHT), task(DRILL.replace("COUNT, preempt: true", "all"), name="Drill"), SHORT, carts=2
        )
        mine = yard.start()

        urgent = yard.start("Drill")

        assert (self.all_of(yard, urgent), yard.task(mine).run) == (("c2",), 1)

    def test_a_high_task_that_says_no_takes_nothing_from_anybody(self, make: Make) -> None:
        kind = "priority: high\nagents: {cart: {type: cart, preempt: false}}\nsteps: [{do: cart.Move}]"
        yard = make(task(CART + FLIGHT), task(kind, name="Kind"))
        mine = yard.start()

        urgent = yard.start("Kind")

        assert (yard.task(mine).restart.why, yard.task(urgent).status) == ("", "PENDING")
        assert verdicts(yard, urgent)["c1"] == ("busy", mine)
        yard.abort(mine)

    def test_its_plan_survives_the_journal(self, make: Make) -> None:
        yard = self.drill(make)
        urgent = yard.start("Drill")

        (request,) = [r for r in yard.engine.state.requests.values() if r.holder == urgent]

        assert request.preempting == dict.fromkeys(self.busy, 1)
        assert reloaded(yard.engine.state).requests == yard.engine.state.requests


class TestTheWaitingRequest:
    def test_its_wait_stands_still_and_runs_on_when_it_was_in_vain(self, make: Make) -> None:
        agents = "agents: {cart: {type: cart, battery_min: 50 %, wait: 60 s}}\n"
        yard = make(task(CART + FLIGHT), task(f"priority: high\n{agents}steps: [{{wait: 1 s}}]", name="Strong"))
        mine = yard.start()
        step(yard, "Rise")
        urgent = yard.start("Strong")
        yard.run_for(300)
        request = yard.engine.state.requests[urgent]
        assert (request.preempting, yard.task(urgent).status) == ({mine: 1}, "PENDING")

        yard.cart.succeed(battery=40.0)
        yard.run_for(50)

        assert yard.task(mine).run == 2
        assert (yard.engine.state.requests[urgent].preempting, yard.task(urgent).status) == ({}, "PENDING")
        yard.run_for(15)
        assert yard.outcome(urgent) == ("FAILED", "no_agent")
        yard.abort(mine)

    def test_the_freed_machine_goes_to_nobody_else(self, make: Make) -> None:
        yard, _ = aloft(make)
        others = [yard.submit("Short") for _ in range(2)]
        urgent = yard.start("Sos")

        step(yard, "Home")

        assert yard.task(urgent).agents.roles == {"cart": ("c1",)}
        assert [yard.task(t).status for t in others] == ["PENDING", "PENDING"]
        step(yard, "Move")

    def test_a_team_keeps_what_is_free_while_the_rest_is_freed(self, make: Make) -> None:
        yard, mine = aloft(make, carts=2)
        urgent = yard.submit("Pair")  # c2 is free: without being kept it would go to the next in line
        other = yard.start("Short")

        assert (yard.task(urgent).status, yard.task(other).status) == ("PENDING", "PENDING")
        yard.run_for(10)
        assert yard.task(other).status == "PENDING"
        step(yard, "Home")

        assert set(yard.task(urgent).agents.roles["carts"]) == {"c1", "c2"}
        assert yard.task(mine).run == 2

    def test_a_machine_that_frees_itself_meanwhile_is_taken(self, make: Make) -> None:
        yard, mine = aloft(make, carts=2)
        busy = yard.submit("Try", {}, priority="high")
        yard.run_for(0.2)
        urgent = yard.start("Sos")
        assert yard.task(mine).restart.why == "preempted"

        for action in ("Rise", "Move", "Home"):
            step(yard, action, 1)

        assert (yard.task(busy).status, yard.task(urgent).agents.roles) == ("SUCCEEDED", {"cart": ("c2",)})
        step(yard, "Home")
        assert (yard.task(mine).status, yard.task(mine).run) == ("ACTIVE", 2)
        step(yard, "Move", 1)


REBIND = "agents: {cart: {type: cart, if_lost: rebind}}\n"


class TestRebinding:
    def lose(self, make: Make, text: str = FLIGHT, head: str = REBIND, **say: object) -> tuple[Yard, str, AgentRecord]:
        yard = make(task(head + text), carts=2)
        mine = yard.start()
        yard.cart.succeed()
        yard.cart.say(**say)
        yard.run_for(0.2)
        yard.cart.kill()
        yard.run_for(40)
        return yard, mine, yard.record("c1")

    def test_a_lost_machine_is_replaced_and_the_task_begins_anew(self, make: Make, wording: Wording) -> None:
        yard, mine, lost = self.lose(make)

        assert (lost.pool, lost.task) == ("QUARANTINED", "")
        assert (yard.task(mine).run, yard.task(mine).agents.roles) == (2, {"cart": ("c2",)})
        wording(yard.task(mine).restart.past)
        for action in ("Rise", "Move", "Home"):
            step(yard, action, 1)
        assert yard.outcome(mine) == ("SUCCEEDED", "")

    def test_also_if_the_task_is_never_to_end_by_a_preemption_but_fails(self, make: Make) -> None:
        yard, mine, _ = self.lose(make, "if_preempted: fail\n" + FLIGHT)

        assert yard.task(mine).run == 2
        yard.abort(mine)

    @pytest.mark.parametrize(
        ("head", "text"),
        [
            (CART, FLIGHT),
            (REBIND, "preemptible: false\n" + FLIGHT),
            (REBIND, "steps: [{do: cart.Rise}, {do: cart.Move, critical: true}, {do: cart.Home}]"),
            (REBIND, "steps: [{do: cart.Haul}, {do: cart.Move}]"),
        ],
    )
    def test_else_its_step_fails(self, make: Make, head: str, text: str) -> None:
        yard, mine, _ = self.lose(make, text, head)

        assert yard.outcome(mine) == ("FAILED", "agent_lost")

    def test_a_load_that_is_lost_is_not_begun_anew(self, make: Make) -> None:
        yard, mine, _ = self.lose(make, payload_kg=2.0)

        assert yard.outcome(mine) == ("FAILED", "agent_lost")

    def test_the_others_of_the_team_come_home_first(self, make: Make) -> None:
        team = "agents: {one: {type: cart, if_lost: rebind}, two: {type: cart}}\n"
        up, down = "{do: one.Rise}, {do: two.Rise}", "{do: one.Home}, {do: two.Home}"
        steps = f"steps: [{up}, {{parallel: [{{do: one.Move}}, {{do: two.Move}}]}}, {down}]"
        yard = make(task(team + steps), carts=3)
        mine = yard.start()
        step(yard, "Rise", 0)
        step(yard, "Rise", 1)

        yard.carts[0].kill()
        yard.run_for(40)

        assert yard.carts[1].goal.goal_id == f"{mine}/1/recover:c2#1/steps[0]"
        step(yard, "Home", 1)
        assert yard.task(mine).agents.roles == {"one": ("c2",), "two": ("c3",)}
        yard.abort(mine)
