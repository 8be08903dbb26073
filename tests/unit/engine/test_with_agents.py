"""`with_agents` in the engine: extra agents granted in mid-task, given back at the end, and never left."""

import pytest

from formiga_bt.engine.kernel.inputs import LockdownOrder, Operator
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.nodes.memory import WithMem
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task

BLOCK = "steps: [{with_agents: {more: {type: cart, wait: 30 s}}, steps: [{do: more.Rise}, {do: more.Move}, {do: more.Home}]}, "
MORE = CART + BLOCK + "{notify: done}]"
LONG = task(CART + "steps: [{wait: 60 s}]", name="Long")
SHORT = task(CART + "steps: [{wait: 5 s}]", name="Short")


def held(yard: Yard, task_id: str) -> list[str]:
    return [agent.id for agent in yard.engine.state.agents.values() if agent.task == task_id]


def step(yard: Yard, cart: int, action: str) -> None:
    assert yard.carts[cart].goal.action == action
    yard.carts[cart].succeed()
    yard.run_for(0.3)


def test_the_agents_are_granted_when_the_block_is_entered_and_free_after_it(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 5 s}, " + BLOCK.removeprefix("steps: [") + "{wait: 5 s}]", carts=2)
    mine = yard.start()
    assert held(yard, mine) == ["c1"]

    yard.run_for(5)

    assert held(yard, mine) == ["c1", "c2"]
    assert yard.task(mine).agents.roles == {"cart": ("c1",), "more": ("c2",)}
    for action in ("Rise", "Move", "Home"):
        step(yard, 1, action)
    assert held(yard, mine) == ["c1"]
    assert yard.engine.state.agents["c2"].pool == "STANDBY"
    assert yard.end(mine) == ("SUCCEEDED", "")


def test_it_waits_for_them_and_goes_on_when_one_is_free(make: Make) -> None:
    yard = make(MORE, SHORT, carts=2)
    other = yard.start("Short")
    mine = yard.start()

    assert held(yard, mine) == ["c2"]
    assert [(v.agent, v.code) for v in yard.engine.state.explanations[f"{mine}|steps/steps[0]"][:2]] == [
        ("c1", "busy"),
        ("c2", "busy"),
    ]
    yard.end(other)
    yard.run_for(0.3)

    assert held(yard, mine) == ["c1", "c2"]
    assert f"{mine}|steps/steps[0]" not in yard.engine.state.explanations


def test_the_same_agents_granted_a_second_time_wake_the_block_again(make: Make) -> None:
    block = "{with_agents: {more: {type: cart, wait: 30 s}}, steps: [{do: more.Move}]}"
    yard = make(f"{CART}steps: [{{repeat: 2, steps: [{block}]}}]", carts=2)
    mine = yard.start()

    for _ in range(2):
        yard.run_for(1)
        assert held(yard, mine) == ["c1", "c2"]
        step(yard, 1, "Move")

    assert yard.end(mine) == ("SUCCEEDED", "")


def test_nobody_in_time_is_a_failure_of_the_step_that_the_tree_may_catch(make: Make) -> None:
    block = "{with_agents: {more: {type: cart, wait: 10 s}}, steps: [{do: more.Move}]}"
    yard = make(f"{CART}steps: [{{fallback: [{block}, {{check: error.code == 'no_agent'}}]}}]", LONG, carts=2)
    other = yard.start("Long")
    mine = yard.start()

    yard.run_for(9)
    assert yard.task(mine).status == "ACTIVE"
    yard.run_for(2)

    assert yard.outcome(mine) == ("SUCCEEDED", "")
    assert not yard.engine.state.requests
    yard.abort(other)


def test_no_agent_that_could_ever_serve_is_told_at_once(make: Make, wording: Wording) -> None:
    text = CART + "steps: [{with_agents: {more: {type: cart, count: 3}}, steps: [{notify: 'got ${len(more)}'}]}]"
    yard = make(text, carts=2)

    mine = yard.start()
    yard.run_for(15)

    assert yard.outcome(mine) == ("FAILED", "no_agent")
    wording(yard.task(mine).outcome.reason)


def test_a_failure_in_the_block_brings_its_machine_home_before_the_block_ends(make: Make) -> None:
    yard = make(MORE, carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")

    yard.carts[1].fail("stuck")
    yard.run_for(0.3)

    assert yard.task(mine).section == "steps"
    assert yard.carts[1].goal.goal_id == f"{mine}/1/recover:c2#1/steps[0]"
    step(yard, 1, "Home")
    assert yard.outcome(mine) == ("FAILED", "failed:stuck")


@pytest.mark.parametrize("state", ["waits", "runs", "releases"])
def test_an_abort_leaves_no_machine_behind_and_cleanup_waits_for_it(make: Make, state: str) -> None:
    yard = make(MORE + "\non_abort: [{notify: aborted}]", SHORT, carts=2)
    other = yard.start("Short") if state == "waits" else ""
    mine = yard.start()
    if state != "waits":
        step(yard, 1, "Rise")
    if state == "releases":
        yard.carts[1].fail("stuck")
        yard.run_for(0.3)

    yard.abort(mine)
    yard.run_for(0.3)

    if state == "waits":
        assert yard.outcome(mine) == ("CANCELED", "aborted")
        assert not yard.engine.state.requests
        yard.end(other)
        return
    assert yard.task(mine).section == "steps", "what the block holds comes home first"
    step(yard, 1, "Home")
    assert yard.outcome(mine) == ("CANCELED", "aborted")
    assert held(yard, mine) == []


def test_a_timeout_around_the_block_fails_once_its_machine_is_home(make: Make) -> None:
    text = CART + BLOCK.replace("{do: more.Home}]", "{do: more.Home}], timeout: 5 s") + "{notify: never}]"
    yard = make(text, carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")
    yard.run_for(6)

    assert yard.engine.statuses(mine)["steps/steps[0]:timeout"] == "RUNNING"
    step(yard, 1, "Home")
    assert yard.outcome(mine) == ("FAILED", "timeout")


def test_the_finally_of_a_stopped_sequence_in_the_block_still_has_its_agent(make: Make) -> None:
    inside = "{sequence: [{do: more.Rise}, {do: more.Move}], finally: [{do: more.Park}]}"
    block = f"{{with_agents: {{more: {{type: cart}}}}, steps: [{inside}, {{do: more.Home}}], timeout: 5 s}}"
    yard = make(f"{CART}steps: [{block}]", carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")
    yard.run_for(6)

    assert yard.carts[1].goal.action == "Park"
    assert held(yard, mine) == ["c1", "c2"]
    step(yard, 1, "Park")

    assert yard.outcome(mine) == ("FAILED", "timeout")


def test_the_finally_around_a_stopped_block_follows_its_release(make: Make) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Rise}, {do: more.Move}, {do: more.Home}]}"
    yard = make(f"{CART}steps: [{{sequence: [{block}], finally: [{{do: cart.Park}}], timeout: 5 s}}]", carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")
    yard.run_for(6)

    assert yard.cart.requests == []
    step(yard, 1, "Home")
    assert yard.cart.goal.action == "Park"
    step(yard, 0, "Park")

    assert yard.outcome(mine) == ("FAILED", "timeout")


def test_a_machine_that_comes_home_often_has_three_tries_each_time(make: Make) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Rise}, {do: more.Move}, {do: more.Home}]}"
    fallback = f"{{fallback: [{block}, {{wait: 1 s}}]}}"
    yard = make(f"steps: [{{repeat: 5, steps: [{fallback}]}}]", carts=1)
    mine = yard.start()
    for _ in range(5):
        step(yard, 0, "Rise")
        yard.cart.fail("stuck")
        yard.run_for(0.3)
        step(yard, 0, "Home")
        yard.run_for(1)

    assert yard.outcome(mine) == ("SUCCEEDED", "")
    assert yard.record("c1").pool == "STANDBY"


def test_a_granted_machine_that_the_steps_never_saw_is_given_back(make: Make) -> None:
    guard = (
        "steps: [{guard: cart.battery > 50 %, steps: [{with_agents: {more: {type: cart}}, steps: [{do: more.Move}]}]}]"
    )
    yard = make(CART + guard, SHORT, carts=2)
    other = yard.start("Short")
    mine = yard.start()
    assert held(yard, mine) == ["c2"]

    yard.carts[1].say(battery=40.0)  # c2 is the task's own cart
    yard.run_for(1)

    assert yard.outcome(mine) == ("FAILED", "guard")
    assert not yard.engine.state.requests
    yard.end(other)


def test_while_a_person_holds_the_task_it_is_granted_nobody(make: Make) -> None:
    yard = make(MORE, LONG, carts=2)
    other = yard.start("Long")
    mine = yard.start()
    yard.ask(Operator("hold", mine, "ann"))
    yard.abort(other)
    yard.run_for(40)
    assert held(yard, mine) == ["c2"]

    yard.ask(Operator("continue", mine, "ann"))
    yard.run_for(0.3)

    assert held(yard, mine) == ["c1", "c2"], "its wait stood still, and the allocator looked again"
    yard.abort(mine)


def test_lockdown_grants_nobody(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 5 s}, " + BLOCK.removeprefix("steps: [") + "{notify: done}]", carts=2)
    mine = yard.start()
    yard.ask(LockdownOrder("hold", "ann"))
    yard.run_for(10)
    assert held(yard, mine) == ["c1"]

    yard.ask(LockdownOrder("release", "ann"))
    yard.run_for(6)

    assert held(yard, mine) == ["c1", "c2"]
    yard.abort(mine)


def test_with_another_agent_the_next_attempt_leaves_out_who_failed(make: Make) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Move}], retry: {attempts: 3, agent: another}}"
    yard = make(f"steps: [{block}]", carts=3)
    mine = yard.start()
    assert held(yard, mine) == ["c1"]

    yard.carts[0].fail("stuck")
    yard.run_for(0.3)
    assert held(yard, mine) == ["c2"]
    yard.carts[1].fail("stuck")
    yard.run_for(0.3)
    assert held(yard, mine) == ["c3"]

    step(yard, 2, "Move")

    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_another_machine_does_what_one_may_not_do_twice(make: Make) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Haul}], retry: {attempts: 2, agent: another}}"
    yard = make(f"steps: [{block}]", carts=2)
    mine = yard.start()

    yard.carts[0].fail("stuck")
    yard.run_for(0.3)
    assert held(yard, mine) == ["c2"]
    step(yard, 1, "Haul")

    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_another_machine_does_it_after_a_timeout_too_once_the_cancel_is_confirmed(make: Make) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Haul, timeout: 2 s}], retry: {attempts: 2, agent: another}}"
    yard = make(f"steps: [{block}]", carts=2)
    mine = yard.start()

    yard.run_for(2.5)
    assert held(yard, mine) == ["c2"]
    step(yard, 1, "Haul")

    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_without_it_the_same_one_tries_again(make: Make) -> None:
    block = "{with_agents: {more: {type: cart, near: '${base}'}}, steps: [{do: more.Move}], retry: {attempts: 2}}"
    yard = make(f"steps: [{block}]", carts=2)
    mine = yard.start()

    yard.carts[0].fail("stuck")
    yard.run_for(0.3)

    assert held(yard, mine) == ["c1"]
    yard.abort(mine)


def test_when_all_have_failed_there_is_nobody_left(make: Make, wording: Wording) -> None:
    block = "{with_agents: {more: {type: cart}}, steps: [{do: more.Move}], retry: {attempts: 5, agent: another}}"
    yard = make(f"steps: [{block}]", carts=2)
    mine = yard.start()
    for cart in (0, 1):
        yard.carts[cart].fail("stuck")
        yard.run_for(0.3)
    yard.run_for(15)

    assert yard.outcome(mine) == ("FAILED", "no_agent")
    wording(yard.task(mine).outcome.reason)


def test_a_high_task_preempts_for_the_agents_of_its_block(make: Make) -> None:
    urgent = task("priority: high\n" + MORE, name="Urgent")
    low = task(CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]", name="Low")
    yard = make(urgent, low, carts=2)
    other = yard.start("Low")
    step(yard, 0, "Rise")

    mine = yard.start("Urgent")

    assert yard.task(other).restart.why == "preempted"
    assert yard.engine.state.requests[f"{mine}|steps/steps[0]"].preempting == {other: 1}
    step(yard, 0, "Home")
    assert held(yard, mine) == ["c1", "c2"]
    yard.abort(mine)


def test_a_task_with_a_block_is_preempted_as_a_whole(make: Make) -> None:
    urgent = task("priority: high\n" + CART + "steps: [{wait: 5 s}]", name="Urgent")
    yard = make(MORE, urgent, carts=2)
    mine = yard.start()
    step(yard, 1, "Rise")

    sos = yard.start("Urgent")
    step(yard, 1, "Home")

    assert yard.task(mine).run == 2
    assert yard.task(sos).status == "ACTIVE"
    yard.end(sos)
    yard.run_for(1)
    assert held(yard, mine) != []


def test_a_lost_machine_of_the_block_may_begin_the_task_anew(make: Make) -> None:
    lost = MORE.replace("wait: 30 s", "if_lost: rebind")
    yard = make(lost, carts=3)
    mine = yard.start()
    assert held(yard, mine) == ["c1", "c2"]

    yard.carts[1].kill()
    yard.run_for(40)

    assert yard.task(mine).run == 2
    assert held(yard, mine) == ["c1", "c3"]
    yard.abort(mine)


@pytest.mark.parametrize("after", [0, 1, 2])
def test_a_snapshot_in_a_block_goes_on(make: Make, after: int) -> None:
    yard = make(MORE, SHORT, carts=2)
    other = yard.start("Short") if after == 0 else ""
    mine = yard.start()
    if after:
        step(yard, 1, "Rise")
    if after == 2:
        yard.carts[1].fail("stuck")
        yard.run_for(0.3)

    loaded = reloaded(yard.engine.state)

    assert snapshot(loaded) == snapshot(yard.engine.state)
    states = [mem.state for mem in loaded.memory.get(mine, {}).values() if isinstance(mem, WithMem)]
    assert ("waits", "runs", "releases")[after] in states or after == 0
    yard.abort(mine)
    if other:
        yard.end(other)
