"""Resources at the gate: seeds are clean, and each safeguard that is taken out shows (`tests.safety.strait`)."""

from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.engine import resources
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.allocator.holders import Holders
from formiga_bt.engine.goals import passages
from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.engine.tasks import claims
from formiga_bt.safety.gate import Hold
from formiga_bt.safety.resources import Passage, ResourceUse
from tests.reloading import reloaded
from tests.safety.strait import FIELDS, Strait, run
from tests.shares import in_ci

Patch = pytest.MonkeyPatch


@pytest.fixture
def strait() -> Strait:
    made = Strait(0)
    made.world.run_for(1)
    return made


def until_inside(strait: Strait) -> str:
    assert strait.world.run_until(lambda: bool(strait.inside(5.0)), 200)
    return strait.inside()[0]


# -- scenes ------------------------------------------------------------------------------------------------------------
def one_is_aborted(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    until_inside(strait)
    strait.abort(0)
    strait.world.run_for(5)
    strait.submit("Look", FIELDS[1])
    strait.world.run_for(400)


def two_of_one_task(strait: Strait) -> None:
    strait.submit("Pair", FIELDS[0])
    strait.world.run_for(150)


def one_without_a_claim(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    strait.submit("Bare", FIELDS[1])
    strait.world.run_for(200)
    strait.abort(0)
    strait.abort(0)
    strait.world.run_for(300)


def the_door_while_one_is_inside(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    until_inside(strait)
    strait.submit("Shut", FIELDS[0])
    strait.world.run_for(200)


def one_comes_while_the_door_shuts(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    strait.world.run_for(12)
    strait.submit("Shut", FIELDS[0])
    strait.world.run_for(200)


def one_is_lost_inside(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    agent = until_inside(strait)
    strait.world.ask(Operator("hold", agent, "watcher_1"))  # else it flies on to where it was sent
    strait.world.run_for(8)
    strait.world.sim.freeze(agent)
    strait.world.run_for(60)
    strait.submit("Look", FIELDS[2])
    strait.world.run_for(150)
    strait.world.sim.thaw(agent)
    strait.world.run_for(400)


def two_at_once(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    strait.submit("Look", FIELDS[1])
    strait.world.run_for(60)


def opposite_orders(strait: Strait) -> None:
    strait.submit("Right", FIELDS[0])
    strait.submit("Left", FIELDS[1])
    if not strait.world.run_until_ended(limit_s=900):
        strait.tell("hang", "Left and Right wait for each other")


# -- bugs --------------------------------------------------------------------------------------------------------------
def let_go_early(patch: Patch) -> None:
    patch.setattr(claims, "leave", lambda core, task, node, after: claims.give_back(core, task, node))


def gate_counts_nobody_of_its_own_task(patch: Patch) -> None:
    may_pass = passages.may_pass

    def blind(use: ResourceUse, agent: str, task: str, passage: Passage, **more: Any) -> Hold | None:
        inside = {one: of for one, of in use.inside.items() if of != task}
        return may_pass(replace(use, inside=inside), agent, task, passage, **more)

    patch.setattr(passages, "may_pass", blind)


def gate_asks_for_no_resource(patch: Patch) -> None:
    patch.setattr(passages.Passages, "verdict", lambda self, goal, ask: None)


def door_closes_on_a_machine(patch: Patch) -> None:
    patch.setattr(passages, "may_shut", lambda use, agent: None)


def nobody_sees_the_door_shut(patch: Patch) -> None:
    patch.setattr(passages.Passages, "_shutting", lambda self, name, but: "")


def occupied_is_forgotten_after_lost(patch: Patch) -> None:
    quarantine = Fleet.quarantine

    def forgets(self: Fleet, agent_id: str, *args: Any) -> None:
        quarantine(self, agent_id, *args)
        self._core.put_agent(agent_id, inside=())

    patch.setattr(Fleet, "quarantine", forgets)


def capacity_is_not_counted(patch: Patch) -> None:
    patch.setattr(resources.Resources, "_why_not", lambda self, request, first: ("", ""))


def no_safe_order(patch: Patch) -> None:
    patch.setattr(Holders, "held_up_by_units", lambda self, request: "")


PLANTS: dict[str, tuple[Callable[[Patch], None], Callable[[Strait], None], frozenset[str]]] = {
    plant.__name__: (plant, scene, frozenset(rules))
    for plant, scene, rules in (
        (let_go_early, one_is_aborted, {"let_go"}),
        (gate_counts_nobody_of_its_own_task, two_of_one_task, {"two"}),
        (gate_asks_for_no_resource, one_without_a_claim, {"claim", "two"}),
        (door_closes_on_a_machine, the_door_while_one_is_inside, {"shut"}),
        (nobody_sees_the_door_shut, one_comes_while_the_door_shuts, {"shut"}),
        (occupied_is_forgotten_after_lost, one_is_lost_inside, {"two"}),
        (capacity_is_not_counted, two_at_once, {"claims"}),
        (no_safe_order, opposite_orders, {"hang"}),
    )
}


@pytest.mark.parametrize("bug", PLANTS)
def test_a_planted_bug_is_caught_and_without_it_the_scene_is_clean(bug: str, strait: Strait) -> None:
    plant, scene, rules = PLANTS[bug]
    with pytest.MonkeyPatch.context() as patch:
        plant(patch)
        scene(strait)
    assert rules & set(strait.broken), strait.broken
    strait.world.close()

    clean = Strait(0)
    clean.world.run_for(1)
    scene(clean)
    clean.world.close()
    assert clean.broken == {}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, *in_ci(range(2, 40))])
def test_no_promise_is_broken_whatever_goes_wrong(seed: int) -> None:
    assert run(seed) == {}


def test_a_restart_of_the_engine_changes_nothing_of_claims_and_machines_inside(strait: Strait) -> None:
    strait.submit("Look", FIELDS[0])
    agent = until_inside(strait)
    before = strait.world.engine.state
    after = reloaded(before)

    assert after.agents[agent].inside == ("strait",)
    assert [task.resources for task in after.tasks.values()] == [task.resources for task in before.tasks.values()]
    strait.world.close()
