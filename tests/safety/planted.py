"""Planted bugs: each takes one safeguard out of the product. The monitor must see each of them.

    python -m tests.safety.planted [name ...] [--seeds 0-300]        find the seeds that show a bug

`test_planted_bugs` pins a seed for each, which is clean without the bug.
"""

import argparse
import dataclasses
import sys
from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.allocation import Allocation
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.gateview import GateView
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.timers import AcceptDue, GoalTimer
from formiga_bt.engine.orders.breaches import Breaches
from formiga_bt.engine.orders.lockdown import Lockdowns
from formiga_bt.engine.orders.orders import StandingOrders
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.engine.tasks.recovery import Recovery
from formiga_bt.safety import gate
from tests.safety.monitor import Violation
from tests.safety.runs import run
from tests.safety.scenes import scene
from tests.safety.states import play

Patch = pytest.MonkeyPatch


def _ask_with(patch: Patch, **fields: Any) -> None:
    """Let the gate see each goal of a machine with these fields."""
    ask = GateView.ask
    patch.setattr(GateView, "ask", lambda self, goal: _unless_human(ask(self, goal), fields))


def _unless_human(ask: gate.GateInput, fields: dict[str, Any]) -> gate.GateInput:
    return ask if ask.mobility == "people" else replace(ask, **fields)


def gate_ignores_control(patch: Patch) -> None:
    """Goals go to a machine whoever has it."""
    _ask_with(patch, control="engine", taken=False, held=False)


def taken_is_forgotten(patch: Patch) -> None:
    """When the pilot lets go, the machine counts as the engine's again; nobody needs to hand it back."""
    put = Core.put_agent

    def put_agent(self: Core, agent_id: str, **fields: Any) -> Any:
        return put(
            self, agent_id, **{name: value for name, value in fields.items() if (name, value) != ("taken", True)}
        )

    patch.setattr(Core, "put_agent", put_agent)


def lockdown_stops_nothing(patch: Patch) -> None:
    """Lockdown admits and grants nothing, but what is under way goes on."""
    _ask_with(patch, locked="", held=False)
    patch.setattr(Lockdowns, "_press", lambda self, *args, **more: None)


def lockdown_grants(patch: Patch) -> None:
    """The allocator does not know of lockdown."""
    patch.setattr(Authority, "blocked", lambda self, request: None)


def lockdown_admits(patch: Patch) -> None:
    """Requests are taken in lockdown."""
    patch.setattr(Authority, "admit", lambda self, *args, **more: None)


def lockdown_leaves_machines_alone(patch: Patch) -> None:
    """Lockdown orders nothing of what flies."""
    patch.setattr(Lockdowns, "_press", lambda self, *args, **more: None)


def gate_ignores_clearance(patch: Patch) -> None:
    """Nobody is asked whether people stand clear."""
    patch.setattr(gate, "_clear", lambda ask, now: None)


def clearance_never_expires(patch: Patch) -> None:
    """A word counts for ever."""
    given = GateView.ask

    def ask(self: GateView, goal: Any) -> gate.GateInput:
        found = given(self, goal)
        word = found.clearance
        return found if word is None else replace(found, clearance=replace_at(word, self._core.now))

    patch.setattr(GateView, "ask", ask)
    _keep_words(patch)


def _keep_words(patch: Patch) -> None:
    """A word that was given stays, however old it gets."""
    on_deadline = Clearances.on_deadline

    def keeps(self: Clearances, due: Any) -> None:
        record = self._core.state.clearances.get(due.agent)
        if record is not None and record.state != "given":
            on_deadline(self, due)

    patch.setattr(Clearances, "on_deadline", keeps)


def replace_at(word: Any, now: int) -> Any:
    return replace(word, at=now)


def clearance_counts_everywhere(patch: Patch) -> None:
    """A word for one spot counts for all, and is not used up."""
    take = Clearances.take

    def keeps(self: Clearances, goal: Any) -> Any:
        record = self._core.state.clearances.get(goal.agent)
        word = take(self, goal)
        if record is not None and word is not None:
            self._core.emit(ch.ClearancePut(goal.agent, record))
        return word

    patch.setattr(Clearances, "take", keeps)
    _keep_words(patch)
    patch.setattr(Clearances, "review", lambda self, agent_id: None)
    patch.setattr(gate, "CLEARED_M", 1e9)
    patch.setattr(gate, "CLEARANCE_LIFE_US", 10**6 * SECOND)


def a_new_process_is_not_noticed(patch: Patch) -> None:
    """What waits for a machine is sent to its new process, though it stands and nobody has looked at it."""
    put = Core.put_agent

    def put_agent(self: Core, agent_id: str, **fields: Any) -> Any:
        return put(self, agent_id, **{**fields, **({"rebooted": False} if "rebooted" in fields else {})})

    patch.setattr(Core, "put_agent", put_agent)


def recover_is_skipped(patch: Patch) -> None:
    """Tasks end without bringing their machines home."""
    patch.setattr(Recovery, "_to_bring", lambda self, task: [])


def gate_checks_no_limit(patch: Patch) -> None:
    """The gate lets every goal go, whatever limit it breaks."""
    patch.setattr(GateView, "breach", lambda self, goal, ask: None)
    patch.setattr(Breaches, "look", lambda self, *args: None)


def gate_checks_ends_only(patch: Patch) -> None:
    """The gate looks at where a leg ends, not at the way there."""
    from formiga_bt.engine.goals import gateview

    ways_of = gateview.ways_of

    def ends(*args: Any, **more: Any) -> Any:
        return tuple((way[1], way[1]) for way in ways_of(*args, **more)[-1:])

    patch.setattr(gateview, "ways_of", ends)
    patch.setattr(Breaches, "look", lambda self, *args: None)


def breach_only_alarms(patch: Patch) -> None:
    """A breach in flight is told, and nothing is done."""

    def look(self: Breaches, agent_id: str, *more: object) -> None:
        return None

    patch.setattr(Breaches, "look", look)


def no_separation(patch: Patch) -> None:
    """Legs are granted whatever else flies there."""
    patch.setattr(gate, "first_in_the_way", lambda *args, **more: "")


def no_spots(patch: Patch) -> None:
    """Several machines may land on one spot."""
    patch.setattr(gate, "_spot", lambda *args, **more: None)
    patch.setattr(gate, "first_in_the_way", lambda *args, **more: "")


def orders_hold_nothing_back(patch: Patch) -> None:
    """Goals of its task go to a machine on which an order stands."""
    _ask_with(patch, stopped="", held=False)


def held_tasks_go_on(patch: Patch) -> None:
    """HELD holds no goal back."""
    _ask_with(patch, held=False)


def orders_are_not_carried_out(patch: Patch) -> None:
    """Orders stand, and nobody does what they say."""
    patch.setattr(StandingOrders, "_start", lambda self, agent, order: None)


def orders_are_forgotten(patch: Patch) -> None:
    """What was ordered of a machine that nobody has is forgotten: it hovers."""
    put = StandingOrders.put

    def forgets(self: StandingOrders, order: Any) -> None:
        put(self, order)
        if not self._core.state.agents[order.agent].task:
            self._core.emit(ch.OrderPut(order.agent, None))

    patch.setattr(StandingOrders, "put", forgets)
    patch.setattr(StandingOrders, "advance", lambda self, agent_id: None)


def goals_are_sent_again_blindly(patch: Patch) -> None:
    """A goal that was not acknowledged in time is sent again, without a question."""
    on_wall = Goals.on_wall

    def resends(self: Goals, timer: GoalTimer) -> None:
        goal = self._core.state.goals.get(timer.goal)
        if isinstance(timer, AcceptDue) and goal is not None and goal.state == "sent":
            self._gate.resend(goal)
        on_wall(self, timer)

    patch.setattr(Goals, "on_wall", resends)


def returned_machines_are_left(patch: Patch) -> None:
    """A machine that comes back from quarantine in the air is put into the pool as it is, and not seen there."""
    strays_are_not_seen(patch)
    patch.setattr(Fleet, "_returned", lambda self, agent_id: self._rest(agent_id))


def strays_are_not_seen(patch: Patch) -> None:
    """A machine that flies for nobody is left there."""
    patch.setattr(Fleet, "_look_for_stray", lambda self, agent_id: None)


def strays_that_are_unsure_are_not_seen(patch: Patch) -> None:
    """A machine that flies for nobody is left there while it does not know that it flies."""
    is_stray = Fleet._is_stray
    patch.setattr(Fleet, "_is_stray", lambda self, agent: agent.landed == "airborne" and is_stray(self, agent))


def machines_are_granted_twice(patch: Patch) -> None:
    """The allocator does not look whether a machine works for a task."""
    candidates = Allocation._candidates
    patch.setattr(Allocation, "_candidates", lambda self, *args: [_as_if_free(one) for one in candidates(self, *args)])


def _as_if_free(agent: Any) -> Any:
    free = {"task": "", "goal": "", "word": "STANDBY", "pool": "STANDBY", "landed": "grounded", "at_port": True}
    return dataclasses.replace(agent, **free) if dataclasses.is_dataclass(agent) else replace(agent, **free)


def state_changes_behind_the_journal(patch: Patch) -> None:
    """The state is written without a change."""
    look = Allocation.look

    def writes(self: Allocation) -> None:
        self._core.state.counters["looks"] = self._core.state.counters.get("looks", 0) + 1
        look(self)

    patch.setattr(Allocation, "look", writes)


def drained_goals_wake_nobody(patch: Patch) -> None:
    """Whoever waits for the end of a canceled goal is not told of it."""
    end = Goals.end

    def silent(self: Goals, goal_id: str, state: str, *args: Any, **more: Any) -> None:
        wake = self._core.wake
        if state == "canceled":
            self._core.wake = lambda task, key: None  # type: ignore[method-assign]
        try:
            end(self, goal_id, state, *args, **more)
        finally:
            self._core.wake = wake  # type: ignore[method-assign]

    patch.setattr(Goals, "end", silent)


NEEDS: dict[str, tuple[str, ...]] = {
    "gate_ignores_control": ("pilot",),
    "taken_is_forgotten": ("pilot",),
    "lockdown_stops_nothing": ("lockdown",),
    "lockdown_grants": ("lockdown",),
    "lockdown_admits": ("lockdown",),
    "lockdown_leaves_machines_alone": ("lockdown",),
    "orders_hold_nothing_back": ("order", "lockdown"),
    "held_tasks_go_on": ("order", "pilot"),
    "orders_are_not_carried_out": ("order", "lockdown", "battery"),
    "goals_are_sent_again_blindly": ("slow", "wire", "freeze"),
    "returned_machines_are_left": ("freeze", "kill", "nan", "mute", "abort"),
    "breach_only_alarms": ("battery", "wind"),
}
"""What must happen in a scene for a bug to show: others are not tried when seeds are looked for."""

PLANTS: dict[str, tuple[Callable[[Patch], None], frozenset[str]]] = {
    plant.__name__: (plant, frozenset(rules))
    for plant, rules in (
        (gate_ignores_control, {"control"}),
        (taken_is_forgotten, {"control", "rest", "hang", "left"}),
        (lockdown_stops_nothing, {"lockdown"}),
        (lockdown_grants, {"lockdown"}),
        (lockdown_admits, {"lockdown"}),
        (lockdown_leaves_machines_alone, {"lockdown_order"}),
        (gate_ignores_clearance, {"clearance"}),
        (clearance_never_expires, {"clearance"}),
        (clearance_counts_everywhere, {"clearance"}),
        (a_new_process_is_not_noticed, {"reboot"}),
        (recover_is_skipped, {"release", "left", "order"}),
        (gate_checks_no_limit, {"reserve", "keep_in", "keep_out", "max_height"}),
        (gate_checks_ends_only, {"keep_out", "keep_in"}),
        (breach_only_alarms, {"breach"}),
        (no_separation, {"separation", "crash"}),
        (no_spots, {"separation", "crash"}),
        (orders_hold_nothing_back, {"ordered"}),
        (held_tasks_go_on, {"held"}),
        (orders_are_not_carried_out, {"order"}),
        (orders_are_forgotten, {"left", "order", "release"}),
        (goals_are_sent_again_blindly, {"twice"}),
        (returned_machines_are_left, {"left"}),
        (strays_are_not_seen, {"left"}),
        (strays_that_are_unsure_are_not_seen, {"left"}),
        (machines_are_granted_twice, {"two_tasks"}),
        (state_changes_behind_the_journal, {"fold"}),
        (drained_goals_wake_nobody, {"hang", "rest"}),
    )
}
"""Bug -> how to plant it, and the rules of which at least one must be found broken."""


Where = int | tuple[str, str]
"""A seed, or a state and an order (`states`)."""


def violations_at(where: Where) -> tuple[Violation, ...]:
    """Play a seed or a case; return what the monitor found."""
    return run(where).violations if isinstance(where, int) else tuple(play(*where)[1].monitor.violations)


def violations_with(name: str, where: Where) -> tuple[Violation, ...]:
    """Play a seed or a case with a bug; return what the monitor found."""
    plant, _ = PLANTS[name]
    with pytest.MonkeyPatch.context() as patch:
        plant(patch)
        return violations_at(where)


def is_caught(name: str, found: tuple[Violation, ...]) -> bool:
    """Return whether the monitor found what the bug must lead to."""
    return bool(PLANTS[name][1] & {violation.rule for violation in found})


def main() -> int:
    """Find seeds."""
    parser = argparse.ArgumentParser(description="Find seeds that show planted bugs.")
    parser.add_argument("names", nargs="*", default=list(PLANTS))
    parser.add_argument("--seeds", default="0-300")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    clean: dict[int, bool] = {}
    missed = []
    for name in options.names or list(PLANTS):
        for seed in range(int(first), int(last)):
            needs = NEEDS.get(name)
            if clean.get(seed) is False or (needs and not any(deed.what in needs for deed in scene(seed).deeds)):
                continue
            found = violations_with(name, seed)
            if is_caught(name, found):
                clean[seed] = clean[seed] if seed in clean else not run(seed).violations
                if clean[seed]:
                    print(f'    "{name}": {seed},  # {found[0]}', flush=True)
                    break
        else:
            missed.append(name)
            print(f"    {name}: no seed", flush=True)
    return len(missed)


if __name__ == "__main__":
    sys.exit(main())
