"""Who gets which agents (execution: allocation; safety: ports): all or nothing, nearest, prefer, by priority, and why not."""

from typing import Any, Literal

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.changes import Explained, Reexplained
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, effects
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task
from tests.unit.engine.yard import yard as a_yard

HOLD = "steps: [{wait: 10 s}]"


def roles(yard: Yard, task_id: str) -> dict[str, tuple[str, ...]]:
    return yard.task(task_id).agents.roles


def codes(yard: Yard, task_id: str, role: str = "cart") -> dict[str, str]:
    return {v.agent: v.code for v in yard.engine.state.explanations[task_id] if v.role == role}


def test_the_nearest_is_chosen_and_the_others_fit(make: Make) -> None:
    yard = make("agents: {cart: {type: cart, near: far}}\n" + HOLD, carts=3)

    task_id = yard.start()

    assert roles(yard, task_id) == {"cart": ("c3",)}
    assert codes(yard, task_id) == {"c1": "fits", "c2": "fits", "c3": "chosen", "ann": "wrong_type"}


def test_the_preferred_one_is_chosen_if_it_fits(make: Make) -> None:
    text = "params: {r: {type: agent, of: [cart], optional: true}}\nagents: {cart: {type: cart, near: far, prefer: '${r}'}}\n"
    yard = make(text + HOLD, carts=3)

    assert roles(yard, yard.start(r=AgentRef("c1")))["cart"] == ("c1",)
    assert roles(yard, yard.start(r=AgentRef("c1")))["cart"] == ("c3",)


def test_id_asks_for_this_very_agent_and_waits_for_it(make: Make) -> None:
    text = "params: {r: {type: agent, of: [cart]}}\nagents: {cart: {type: cart, id: '${r}'}}\n"
    yard = make(text + HOLD, carts=2)
    first = yard.start(r=AgentRef("c2"))

    second = yard.start(r=AgentRef("c2"))

    assert yard.task(second).status == "PENDING"
    assert codes(yard, second) == {"c1": "not_this_one", "c2": "busy", "ann": "wrong_type"}
    yard.end(first)
    yard.run_for(0.2)
    assert yard.task(second).status == "ACTIVE"


def test_all_roles_are_granted_together_or_none(make: Make) -> None:
    yard = make("agents: {one: {type: cart}, two: {type: cart}}\n" + HOLD, carts=1)

    task_id = yard.start()

    assert yard.task(task_id).status == "PENDING"
    assert yard.record("c1").task == ""
    yard.agent("c2", "cart")
    yard.run_for(0.2)
    assert roles(yard, task_id) == {"one": ("c1",), "two": ("c2",)}


def test_a_team_is_matched_to_its_places_at_least_total_cost(make: Make) -> None:
    places = "{east: 90 m, north: 0 m}, {east: 10 m, north: 0 m}"
    yard = make(
        f"vars: {{spots: [{places}]}}\nagents: {{carts: {{type: cart, count: 2, near: '${{spots}}'}}}}\n" + HOLD,
        carts=3,
    )

    assert roles(yard, yard.start())["carts"] == ("c3", "c1")


def test_higher_priority_is_served_first_then_who_came_first(make: Make) -> None:
    yard = make(CART + "preemptible: false\n" + HOLD)
    running = yard.start()
    low = yard.submit("Try", {}, priority="low")
    first, second = yard.submit("Try"), yard.submit("Try")
    high = yard.submit("Try", {}, priority="high")

    yard.run_until_ended()

    ended = sorted((running, low, first, second, high), key=lambda t: yard.task(t).times.ended_at or 0)
    assert ended == [running, high, first, second, low]


def test_two_tasks_at_one_instant_never_get_one_machine(make: Make) -> None:
    yard = make(CART + HOLD, carts=2)
    tasks = [yard.submit("Try") for _ in range(3)]

    yard.run_for(0.5)

    assert sorted(roles(yard, t).get("cart", ()) for t in tasks) == [(), ("c1",), ("c2",)]


@pytest.mark.parametrize(("policy", "first", "second"), [("closest", "c2", "c1"), ("optimal", "c1", "c2")])
def test_the_site_says_how_agents_are_chosen(policy: Literal["closest", "optimal"], first: str, second: str) -> None:
    """Both tasks want c2, the first by two metres; together their ways are shortest if it leaves it to the second."""
    site, catalogue = a_yard()
    text = "params: {at: place}\nagents: {cart: {type: cart, near: '${at}'}}\n" + HOLD
    bench = Bench(replace(site, policy=policy), catalogue, [task(text)])
    for name in ("c1", "c2"):
        bench.agent(name, "cart")

    tasks = [bench.submit("Try", {"at": Place(east_m, 0.0)}) for east_m in (21.0, 100.0)]
    bench.run_for(0.5)

    assert [bench.task(one).agents.roles["cart"] for one in tasks] == [(first,), (second,)]
    assert bench.task(tasks[0]).status == "ACTIVE"
    bench.check()
    bench.close()


def test_battery_min_filters_with_the_numbers(make: Make, wording: Wording) -> None:
    yard = make("agents: {cart: {type: cart, battery_min: 60 %}}\n" + HOLD)
    yard.cart.say(battery=40.0)
    yard.run_for(0.1)

    task_id = yard.start()

    verdict = next(v for v in yard.engine.state.explanations[task_id] if v.agent == "c1")
    assert verdict.code == "battery"
    wording(verdict.detail)
    yard.cart.say(battery=80.0)
    yard.run_for(0.2)
    assert yard.task(task_id).status == "ACTIVE"


@pytest.mark.parametrize(
    ("status", "code"),
    [
        ({"position": Position(5.0, 0.0, 0.0)}, "parked_away"),
        ({"landed": "airborne"}, "airborne"),
        ({"landed": "unknown"}, "airborne"),
        ({"position": None}, "no_position"),
    ],
)
def test_only_a_machine_at_rest_is_granted(make: Make, status: dict[str, Any], code: str) -> None:
    yard = make(CART + HOLD)
    yard.cart.say(**status)
    yard.run_for(0.1)

    task_id = yard.start()

    assert codes(yard, task_id)["c1"] == code
    yard.cart.say(landed="grounded")
    yard.run_for(0.1)


def test_a_role_with_away_takes_one_that_stands_elsewhere(make: Make) -> None:
    yard = make("agents: {cart: {type: cart, away: true}}\nsteps: [{do: cart.Park}]")
    yard.cart.say(position=Position(15.0, 0.0, 0.0))
    yard.run_for(0.1)
    assert yard.record("c1").pool == "PARKED_AWAY"
    task_id = yard.start()

    assert roles(yard, task_id)["cart"] == ("c1",)
    yard.cart.succeed()
    yard.run_for(0.2)
    assert yard.record("c1").pool == "PARKED_AWAY"


def test_a_machine_that_says_it_is_busy_is_not_granted(make: Make) -> None:
    yard = make(CART + HOLD)
    yard.cart.silent = True
    yard.cart.tell(status="CHARGING")
    yard.run_for(0.1)

    assert codes(yard, yard.start())["c1"] == "not_idle"


def test_one_that_is_silent_is_not_granted(make: Make) -> None:
    yard = make(CART + HOLD)
    yard.cart.silent = True
    yard.run_for(5)

    assert codes(yard, yard.start())["c1"] == "not_alive"


def test_a_person_who_cannot_be_reached_does_not_hold_up_a_task(make: Make) -> None:
    text = "agents: {cart: {type: cart}, who: {type: person}}\n"
    yard = make(text + HOLD)
    yard.ann.kill()
    yard.run_for(1)

    task_id = yard.start()

    assert roles(yard, task_id) == {"cart": ("c1",), "who": ("ann",)}


def test_people_who_can_be_reached_come_first(make: Make) -> None:
    yard = make("agents: {who: {type: person}}\n" + HOLD, people=2)
    yard.ann.kill()
    yard.run_for(1)

    assert roles(yard, yard.start())["who"] == ("bob",)


def test_people_are_shared(make: Make) -> None:
    yard = make("agents: {who: {type: person}}\n" + HOLD)

    tasks = [yard.submit("Try"), yard.submit("Try")]
    yard.run_for(0.2)

    assert [roles(yard, t)["who"] for t in tasks] == [("ann",), ("ann",)]


BUSY = "agents: {cart: {type: cart}}\nsteps: [{wait: 100 s}]"


def test_no_agent_after_the_roles_wait_and_the_explanation_stays(make: Make) -> None:
    yard = make("agents: {cart: {type: cart, wait: 30 s}}\n" + HOLD, task(BUSY, name="Busy"))
    yard.start("Busy")

    task_id = yard.start()
    yard.run_for(29)
    assert yard.task(task_id).status == "PENDING"
    yard.run_for(2)

    assert yard.outcome(task_id) == ("FAILED", "no_agent")
    assert codes(yard, task_id) == {"c1": "busy", "ann": "wrong_type"}
    assert yard.engine.state.requests == {}


LONG = "agents: {cart: {type: cart}}\nsteps: [{wait: 40 min}]"


def test_a_request_that_could_be_served_waits_as_long_as_it_takes(make: Make) -> None:
    yard = make(CART + HOLD, task(LONG, name="Busy"))
    yard.start("Busy")
    queue = [yard.submit("Try") for _ in range(3)]
    again = yard.submit("Busy")

    yard.run_for(39 * 60)
    assert {yard.task(t).status for t in (*queue, again)} == {"PENDING"}
    yard.run_until_ended()

    assert [yard.outcome(t) for t in (*queue, again)] == [("SUCCEEDED", "")] * 4


@pytest.mark.parametrize(
    ("given", "code"), [({"wait": 60 * SECOND}, "no_agent"), ({"expires": 60 * SECOND}, "task_expired")]
)
@pytest.mark.parametrize("own", ["", ", wait: 10 s"])
def test_what_the_request_says_of_its_wait_counts_instead_of_the_file(
    make: Make, given: dict[str, Any], code: str, own: str
) -> None:
    if own and "expires" in given:
        own = ""  # the role's wait is another limit
    yard = make(f"expires: 30 min\nagents: {{cart: {{type: cart{own}}}}}\n" + HOLD, task(LONG, name="Busy"))
    yard.start("Busy")

    task_id = yard.submit("Try", {}, **given)
    yard.run_for(59)
    assert yard.task(task_id).status == "PENDING"
    yard.run_for(2)

    assert yard.outcome(task_id) == ("FAILED", code)


def test_what_the_request_says_of_its_wait_holds_when_it_begins_anew(make: Make) -> None:
    text = "agents: {cart: {type: cart}}\nsteps: [{do: cart.Move}]"
    yard = make(text, task(LONG, name="Busy"))
    mine = yard.submit("Try", {}, wait=60 * SECOND)
    yard.run_for(1)

    urgent = yard.submit("Busy", {}, priority="high")
    yard.run_for(10)
    assert (yard.task(urgent).status, yard.task(mine).run) == ("ACTIVE", 2)
    yard.run_for(70)

    assert yard.outcome(mine) == ("FAILED", "no_agent")


def test_a_request_that_nobody_could_ever_serve_is_not_kept(make: Make) -> None:
    yard = make("agents: {carts: {type: cart, count: 3}}\n" + HOLD, carts=2)

    task_id = yard.start()
    yard.run_for(11)

    assert yard.outcome(task_id) == ("FAILED", "no_agent")


def test_a_task_that_waits_longer_than_it_keeps_is_expired(make: Make) -> None:
    yard = make("expires: 20 s\n" + CART + HOLD, task(BUSY, name="Busy"))
    yard.start("Busy")

    assert yard.end(yard.start()) == ("FAILED", "task_expired")


def test_an_explanation_is_written_only_when_it_differs(make: Make) -> None:
    yard = make(CART + HOLD, task(BUSY, name="Busy"))
    yard.start("Busy")
    waiting = yard.start()
    yard.run_for(60)

    changes = [c for step in yard.steps for c in step.changes if isinstance(c, Explained)]
    assert len([c for c in changes if c.task == waiting]) == 1


def test_where_little_is_new_only_that_is_written(make: Make) -> None:
    yard = make(CART + HOLD, task(BUSY, name="Busy"))
    busy = yard.start("Busy")
    waiting = yard.start()
    yard.abort(busy)
    yard.run_for(60)

    changes = [c for step in yard.steps for c in step.changes if isinstance(c, Explained | Reexplained)]
    first, then = [c for c in changes if c.task == waiting]
    assert [(v.agent, v.code) for v in first.verdicts] == [("c1", "busy"), ("ann", "wrong_type")]
    ((place, verdict),) = then.changed
    assert (place, verdict.agent, verdict.code) == (0, "c1", "chosen")
    assert codes(yard, waiting) == {"c1": "chosen", "ann": "wrong_type"}


# -- ports ---------------------------------------------------------------------------------------------------------------


def test_an_unlisted_machine_gets_the_first_free_port_in_simulation(make: Make) -> None:
    yard = make(CART + HOLD)

    yard.agent("c9", "cart", at=Place(120.0, 0.0))
    yard.agent("c10", "cart")

    assert yard.record("c9").home == "d"
    assert yard.record("c10").refused == "no_port"
    assert [alarm.code for alarm in effects(yard, Alarm)] == ["not_admitted"]
    yard.run_for(2)
    assert codes(yard, yard.start())["c10"] == "not_admitted"


def test_an_unlisted_machine_is_refused_where_flights_are_real(make: Make) -> None:
    yard = make(CART + HOLD, mode="real")

    yard.agent("c9", "cart")

    assert yard.record("c9").refused == "unlisted"


def test_an_agent_of_an_unknown_type_is_refused(make: Make) -> None:
    yard = make(CART + HOLD)
    ScriptedAgent(yard.hub, "x1", "tank")
    yard.run_for(5)

    assert yard.record("x1").refused == "unknown_type"


def test_each_machine_gets_a_layer_of_its_own_while_there_are_enough(make: Make) -> None:
    other = task(CART + "steps: [{do: cart.Move}]", name="Other")
    yard = make(CART + HOLD, other, carts=3)
    for _ in range(3):
        yard.submit("Try")
    yard.run_for(0.2)

    layers = [yard.record(f"c{i}").layer_m for i in (1, 2, 3)]

    assert len(set(layers)) == len(yard.site.layers_m[:3])


def test_a_count_of_all_takes_every_one_that_fits_and_is_free_at_the_look_that_grants(make: Make) -> None:
    yard = make("agents: {carts: {type: cart, count: all, near: far}}\n" + HOLD, carts=3)
    other = yard.start()
    yard.end(other)
    first = yard.start()

    assert set(roles(yard, first)["carts"]) == {"c1", "c2", "c3"}
    assert set(codes(yard, first, "carts").values()) == {"chosen", "wrong_type"}

    second = yard.start()  # nobody is left: at least one is needed

    assert yard.task(second).status == "PENDING"


def test_a_count_between_bounds_takes_as_many_as_are_free_up_to_its_max(make: Make) -> None:
    yard = make("agents: {carts: {type: cart, near: far, count: {min: 1, max: 2}}}\n" + HOLD, carts=3)

    first, second, third = yard.start(), yard.start(), yard.start()

    assert set(roles(yard, first)["carts"]) == {"c2", "c3"}
    assert roles(yard, second)["carts"] == ("c1",)
    assert yard.task(third).status == "PENDING"


def test_fewer_than_its_min_are_not_enough(make: Make) -> None:
    yard = make("agents: {carts: {type: cart, count: {min: 3}}}\n" + HOLD, carts=2)

    task_id = yard.start()
    yard.run_for(20)

    assert yard.task(task_id).outcome.code == "no_agent"
    assert "needs 3 agents" in yard.task(task_id).outcome.reason


def test_a_role_that_takes_what_is_left_leaves_the_others_what_they_need(make: Make) -> None:
    yard = make("agents: {rest: {type: cart, count: all, near: far}, one: {type: cart, near: far}}\n" + HOLD, carts=3)

    task_id = yard.start()

    assert {role: len(agents) for role, agents in roles(yard, task_id).items()} == {"rest": 2, "one": 1}


def test_each_of_an_unknown_number_gets_the_place_of_its_number(make: Make) -> None:
    spots = "near: '${[site.places.far, base, site.places.far]}'"
    yard = make(f"agents: {{carts: {{type: cart, count: {{min: 1, max: 3}}, {spots}}}}}\n" + HOLD, carts=2)

    assert roles(yard, yard.start())["carts"] == ("c2", "c1")
