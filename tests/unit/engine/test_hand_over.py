"""A block of extra agents that goes on after the loss of a machine, or before its charge is used up."""

import pytest

from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.nodes.memory import WithMem
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.test_with_agents import held, step
from tests.unit.engine.yard import CART, Yard

FLIGHT = "[{do: more.Rise}, {do: more.Move}, {wait: 60 s}, {do: more.Home}]"
LOST = "{with_agents: {more: {type: cart, if_lost: fail_block}}, steps: " + FLIGHT + "}"
RELAY = "{with_agents: {more: {type: cart, battery_min: 60 %, hand_over_at: 35 %}}, steps: " + FLIGHT + "}"


def charge(yard: Yard, cart: int, percent: float) -> None:
    yard.carts[cart].say(battery=percent)
    yard.run_for(0.3)


def test_the_loss_of_a_machine_fails_the_block_at_once_and_a_fallback_goes_on(make: Make) -> None:
    yard = make(
        CART + f"steps: [{{fallback: [{LOST}, {{check: error.code == 'agent_lost'}}]}}, {{wait: 15 s}}]", carts=2
    )
    mine = yard.start()
    step(yard, 1, "Rise")
    step(yard, 1, "Move")

    yard.carts[1].kill()
    yard.run_for(35)

    assert yard.engine.state.agents["c2"].pool == "QUARANTINED"
    assert held(yard, mine) == ["c1"]
    yard.run_for(16)
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_without_the_word_the_steps_of_the_block_go_on(make: Make) -> None:
    block = LOST.replace(", if_lost: fail_block", "")
    yard = make(
        CART + f"steps: [{{fallback: [{block}, {{check: error.code == 'agent_lost'}}]}}, {{wait: 5 s}}]", carts=2
    )
    mine = yard.start()
    step(yard, 1, "Rise")
    step(yard, 1, "Move")

    yard.carts[1].kill()
    yard.run_for(42)

    assert yard.engine.state.agents["c2"].pool == "QUARANTINED"
    assert yard.task(mine).status == "ACTIVE"
    yard.abort(mine)


def test_another_machine_takes_over_after_a_loss(make: Make, wording: Wording) -> None:
    block = LOST.removesuffix("}") + ", retry: {attempts: 2, on: [agent_lost], agent: another}}"
    yard = make(CART + f"steps: [{block}]", carts=3)
    mine = yard.start()
    step(yard, 1, "Rise")

    yard.carts[1].kill()
    yard.run_for(35)

    assert held(yard, mine) == ["c1", "c3"]
    assert yard.task(mine).run == 1
    yard.carts[2].kill()
    yard.run_for(35)
    assert yard.outcome(mine) == ("FAILED", "agent_lost")
    wording(yard.task(mine).outcome.reason)


def test_a_machine_that_comes_to_its_charge_goes_home_and_another_one_begins_anew(make: Make) -> None:
    yard = make(CART + f"steps: [{RELAY}]", carts=3)
    mine = yard.start()
    step(yard, 1, "Rise")
    step(yard, 1, "Move")

    charge(yard, 1, 36)
    assert held(yard, mine) == ["c1", "c2"]
    charge(yard, 1, 35)

    assert yard.carts[1].goal.goal_id == f"{mine}/1/recover:c2#1/steps[0]"
    assert held(yard, mine) == ["c1", "c2"]
    step(yard, 1, "Home")
    assert held(yard, mine) == ["c1", "c3"]
    for action in ("Rise", "Move"):
        step(yard, 2, action)
    yard.run_for(61)
    step(yard, 2, "Home")
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_who_comes_back_for_another_turn_does_its_steps_again(make: Make) -> None:
    """A goal of a later turn has another id: an agent would answer the old one with its old result."""
    yard = make(CART + f"steps: [{RELAY}]", carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")
    charge(yard, 1, 35)
    step(yard, 1, "Home")

    charge(yard, 1, 100)

    assert held(yard, mine) == ["c1", "c2"]
    assert yard.carts[1].goal.goal_id == f"{mine}/1/steps/steps[0].turn#1.steps[0]"
    step(yard, 1, "Rise")
    assert yard.carts[1].goal.action == "Move"
    yard.abort(mine)


def test_one_that_stands_on_the_ground_is_in_no_hurry(make: Make) -> None:
    yard = make(CART + f"steps: [{RELAY}]", carts=3)
    mine = yard.start()

    charge(yard, 1, 35)

    assert held(yard, mine) == ["c1", "c2"]
    assert yard.carts[1].goal.action == "Rise"
    step(yard, 1, "Rise")
    assert yard.carts[1].goal.action == "Home"
    yard.abort(mine)


def test_with_nobody_to_take_over_the_block_fails_as_if_nobody_had_come(make: Make) -> None:
    yard = make(CART + f"steps: [{RELAY.replace('battery_min', 'wait: 20 s, battery_min')}]", carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")
    charge(yard, 1, 30)
    step(yard, 1, "Home")

    yard.run_for(25)

    assert yard.outcome(mine) == ("FAILED", "no_agent")


@pytest.mark.parametrize("block", [LOST, RELAY])
def test_a_snapshot_while_the_block_gives_back_goes_on(make: Make, block: str) -> None:
    yard = make(CART + f"steps: [{block}]", carts=3)
    mine = yard.start()
    step(yard, 1, "Rise")
    if block is RELAY:
        charge(yard, 1, 35)
    else:
        yard.carts[1].kill()
        yard.run_for(24)

    loaded = reloaded(yard.engine.state)

    assert snapshot(loaded) == snapshot(yard.engine.state)
    mems = [mem for mem in loaded.memory.get(mine, {}).values() if isinstance(mem, WithMem)]
    assert [mem.anew for mem in mems] == [block is RELAY]
    yard.abort(mine)
