"""Planted bugs of machines on the ground and of resources, shown by seeds of the yard. `planted` plays them with the others."""

from collections.abc import Callable
from typing import Any, Final

import pytest
from msgspec.structs import replace

from formiga_bt.engine.agents import fleet
from formiga_bt.engine.goals import gateview, passages, routing
from formiga_bt.engine.goals.gatekeeper import Gatekeeper
from formiga_bt.engine.goals.passages import Passages
from formiga_bt.engine.goals.routing import Routing
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.orders.breaches import Breaches
from formiga_bt.engine.resources import Resources
from formiga_bt.engine.restart.reconcile import Reconcile
from formiga_bt.engine.tasks import recovery
from formiga_bt.safety.airspace import Airspace

Patch = pytest.MonkeyPatch


def two_are_let_on_one_edge(patch: Patch) -> None:
    """Nobody looks whether another machine has the node or the edge ahead."""
    patch.setattr(Routing, "_others", lambda *_: ())


def an_edge_is_driven_that_is_not_taken(patch: Patch) -> None:
    """A machine that is sent on takes up neither the edge nor the node."""
    patch.setattr(Routing, "taken", lambda self, agent, goal: agent.on_route)


def an_edge_is_given_back_on_the_way(patch: Patch) -> None:
    """A machine on its way keeps only what it is on, not the node that it was sent to, and only nodes."""
    seen = Routing.seen

    def sees(self: Routing, agent: Any, position: Any, *, stands: bool) -> tuple[str, ...]:
        return tuple(part for part in seen(self, agent, position, stands=stands) if "-" not in part)

    patch.setattr(Routing, "seen", sees)


def a_no_go_region_is_crossed(patch: Patch) -> None:
    """The gate does not look at no-go regions."""
    init = Airspace.__init__

    def begins(self: Airspace, site: Any) -> None:
        init(self, site)
        self.ground_zones = ()

    patch.setattr(Airspace, "__init__", begins)


def a_resource_is_granted_twice(patch: Patch) -> None:
    """A block gets its resources whoever has them."""
    patch.setattr(Resources, "_why_not", lambda *_: ("", ""))


def a_resource_is_let_go_early(patch: Patch) -> None:
    """A machine gives a resource back with its goal, wherever it stands then."""
    patch.setattr(Passages, "seen", lambda *_: ())


def a_door_closes_on_a_robot(patch: Patch) -> None:
    """An action that guards a resource begins although somebody is in it."""
    patch.setattr(passages, "may_shut", lambda *_: None)


def a_lift_is_called_away_with_a_robot_inside(patch: Patch) -> None:
    """The lift guards its cabin while its door closes, and not when it is called."""
    guards = Core.__init__

    def begins(self: Core, *args: Any, **more: Any) -> None:
        guards(self, *args, **more)
        self.guards = {
            name: {action: of for action, of in its.items() if action != "CallTo"} for name, its in self.guards.items()
        }

    patch.setattr(Core, "__init__", begins)


def a_robot_drives_into_a_lift_that_moves(patch: Patch) -> None:
    """Nobody who drives in looks whether the door closes, or the lift moves."""
    patch.setattr(Passages, "_shutting", lambda *_: "")


def a_machine_parks_where_it_stops(patch: Patch) -> None:
    """A machine whose task ends on a lane stays there."""
    for module in (fleet, recovery):
        patch.setattr(module, "is_in_its_place", lambda *_: True)


def max_speed_is_not_looked_at(patch: Patch) -> None:
    """The gate lets goals pass that are faster than the machine may drive."""
    at_gate = gateview.at_gate_driving

    def judges(drive: Any, ground: Any, rules: Any) -> Any:
        return at_gate(drive, ground, replace(rules, max_speed_m_s=99.0))

    patch.setattr(gateview, "at_gate_driving", judges)


def the_speed_of_an_edge_is_not_kept(patch: Patch) -> None:
    """A goal over an edge does not carry the edge's own limit."""
    patch.setattr(routing, "_slowed", lambda fields, spec, most: fields)


def a_low_charge_is_let_pass(patch: Patch) -> None:
    """A machine that drives with less than its reserve goes on."""
    patch.setattr(Breaches, "_driving", lambda *_: ())


def a_refusal_after_a_wait_wakes_nobody(patch: Patch) -> None:
    """The step of a goal that waited for others on the routes, and may never go, is not told."""
    patch.setattr(Gatekeeper, "_wake", lambda *_: None)


def machines_step_aside_into_a_resource(patch: Patch) -> None:
    """Who makes room for others drives anywhere, also where its task may not go."""
    patch.setattr(routing, "_resources_on", lambda _: {})


def a_return_on_the_ground_is_held_for_ever(patch: Patch) -> None:
    """After a long outage an order of the engine is HELD on a machine that drives, and no person can continue it."""

    def fetched(self: Reconcile, task: Any) -> bool:
        return task.system.stop == "return"

    patch.setattr(Reconcile, "_is_fetched", fetched)


GROUND_PLANTS: Final[tuple[tuple[Callable[[Patch], None], int, str], ...]] = (
    (two_are_let_on_one_edge, 60_006, "edge"),
    (an_edge_is_driven_that_is_not_taken, 60_000, "lane"),
    (an_edge_is_given_back_on_the_way, 60_000, "lane"),
    (a_no_go_region_is_crossed, 60_002, "no_go"),
    (a_resource_is_granted_twice, 60_000, "claims"),
    (a_resource_is_let_go_early, 60_000, "early"),
    (a_door_closes_on_a_robot, 60_001, "shut"),
    (a_lift_is_called_away_with_a_robot_inside, 60_000, "called"),
    (a_robot_drives_into_a_lift_that_moves, 60_000, "called"),
    (a_machine_parks_where_it_stops, 60_000, "park"),
    (max_speed_is_not_looked_at, 60_005, "speed"),
    (the_speed_of_an_edge_is_not_kept, 60_000, "speed"),
    (a_low_charge_is_let_pass, 60_027, "charge"),
    (a_refusal_after_a_wait_wakes_nobody, 60_000, "wait"),
    (machines_step_aside_into_a_resource, 60_167, "rest"),
    (a_return_on_the_ground_is_held_for_ever, 60_136, "rest"),
)
"""How each is planted, a seed that shows it, and the rule that is found broken then."""
