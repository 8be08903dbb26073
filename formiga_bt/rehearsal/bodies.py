"""Simulated agents from the catalogue: what each type's body is made of. Nothing here knows a type by its name.

Called wherever agents are simulated: dry runs, test cases, scenarios, `formiga sim`, drafts, assistants.
"""

from typing import Any, assert_never

from agents_sim.bodies import registered
from agents_sim.kinds import Kind, Outcome, SimAction
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.model import ActionSpec, Catalogue
from formiga_bt.lang.scenario import ScenarioResult
from formiga_bt.lang.types import AgentRef, Type, Value


def kind_of(catalogue: Catalogue, name: str) -> Kind:
    """Return what a body of a type of the catalogue is made of.

    Raises:
        KeyError: the catalogue has no such type.
    """
    of = catalogue.types[name]
    actions = {one: action_of(catalogue.actions[one]) for one in of.actions if one in catalogue.actions}
    return Kind(mobility=of.mobility, actions=actions, limits=dict(of.limits), body=registered((of.name, *of.extends)))


def action_of(spec: ActionSpec) -> SimAction:
    """Return an action as a body carries it out."""
    return SimAction(
        moves_to=spec.moves_to,
        height=spec.height,
        speed=spec.speed,
        requires=spec.requires,
        effect=spec.effect,
        cuts=spec.cuts,
        typical_us=spec.typical_us,
        result={name: first_legal(kind, spec.result_min.get(name)) for name, kind in spec.result.items()},
    )


def outcome_of(wanted: ScenarioResult) -> Outcome:
    """Return what a scenario or a test case wants of goals, as a body takes it."""
    give = {name: on_wire(value) for name, value in wanted.give.items()}
    return Outcome(action=wanted.action, nth=wanted.nth, give=give, fail=wanted.fail, delay_s=wanted.delay_s)


def first_legal(kind: Type, least: float | None = None) -> Any:
    """Return the first value that a type allows, as it passes the wire: 0 or the least, the first word, an empty list."""
    match kind.name:
        case "enum":
            return kind.values[0] if kind.values else ""
        case "text" | "agent":
            return ""
        case "bool":
            return False
        case "int" | "time":
            return int(least or 0)
        case "list":
            return []
        case "record":
            return {name: first_legal(one) for name, one in kind.fields.items()}
        case "place":
            return on_wire(Place(0.0, 0.0))
        case "position":
            return on_wire(Position(0.0, 0.0, 0.0))
        case "region":
            return on_wire(Region((Place(0.0, 0.0), Place(1.0, 0.0), Place(0.0, 1.0))))
        case "any":
            return {}
        case _:
            return float(least or 0.0)


def on_wire(value: Value) -> Any:
    """Return a runtime value as it passes the wire: places and positions as mappings of metres."""
    match value:
        case Position():
            return {"east_m": value.east_m, "north_m": value.north_m, "up_m": value.up_m}
        case Place():
            return {"east_m": value.east_m, "north_m": value.north_m}
        case Region():
            return [on_wire(corner) for corner in value.corners]
        case AgentRef():
            return value.id
        case tuple():
            return [on_wire(item) for item in value]
        case None | bool() | int() | float() | str() | dict():
            return value
        case never:
            assert_never(never)
