"""What is left of a take-off that was broken off in the air: the rest of the way up.

A machine that hovers below the altitude of its TakeOff has not done it, and cannot do it a second time: that needs it on the
ground. When a person says continue, the step's next goal is the machine's own action that flies it to a position, straight up
from where it hovers; its success is the step's. Asked by `engine.orders.continuing` before and by `engine.goals.goals` when it
goes on.
"""

from collections.abc import Callable
from typing import Any, Final

from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.lang.model import ActionSpec

Lookup = Callable[[str], ActionSpec]

THERE_M: Final = 1.0
"""So near below its altitude a take-off counts as done."""


def altitude_m(spec: ActionSpec, fields: dict[str, Any]) -> float | None:
    """Return how high over the base's ground an action takes a machine off; None if it is no take-off, or does not say."""
    if spec.requires != "grounded" or spec.effect != "airborne":
        return None
    altitude = fields.get(spec.height)
    return float(altitude) if isinstance(altitude, int | float) else None


def top_m(goal: GoalRecord, action: Lookup) -> float | None:
    """Return how high a goal takes its machine off, or climbs for one that was broken off; None if it does neither."""
    spec = action(goal.action)
    if not goal.rest_of:
        return altitude_m(spec, goal.fields)
    target = goal.fields.get(spec.moves_to)
    return target.up_m if isinstance(target, Position) else None


def is_up(agent: AgentRecord, top: float) -> bool:
    """Return whether a machine in the air is as high as its take-off was to bring it."""
    return agent.position is not None and agent.position.up_m >= top - THERE_M


def goes_by(agent: AgentRecord, action: Lookup) -> str:
    """Return the action that flies a machine to a position in the air, or ""."""
    for name in agent.actions:
        spec = action(name)
        field = spec.fields.get(spec.moves_to)
        if field is not None and field.type.name == "position" and not spec.lands:
            return name
    return ""


def climb(agent: AgentRecord, top: float, action: Lookup) -> tuple[str, dict[str, Any]] | None:
    """Return the action and its fields that bring a machine straight up from where it hovers; None if it has none."""
    name, here = goes_by(agent, action), agent.position
    if not name or here is None:
        return None
    return name, {action(name).moves_to: Position(here.east_m, here.north_m, top)}
