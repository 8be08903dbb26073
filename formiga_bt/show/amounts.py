"""Values of a running task in words: `60 m`, `camp`, `12 E 40 N`, `41 s`."""

from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.model import Call, For, Site, Task
from formiga_bt.lang.places import steps_around, steps_with_paths
from formiga_bt.lang.types import AGENT, AgentRef, Type
from formiga_bt.nodes.run import AROUND, THROUGH
from formiga_bt.show.why.words import span

UNITS: Final[Mapping[str, str]] = {"distance": "m", "speed": "m/s", "angle": "deg", "mass": "kg", "percent": "%"}
NEAR_M: Final = 0.5
"""So near to a place of the site it is that place."""
MOST: Final = 8
"""So many items of a list are shown."""


class Wording:
    """Says values at one site."""

    def __init__(self, site: Site) -> None:
        spots = [(name, at) for name, at in site.places.items() if isinstance(at, Place | Position)]
        spots += [(f"port {name}", port.at) for name, port in site.ports.items() if isinstance(port.at, Place)]
        self._spots = [(name, at.east_m, at.north_m) for name, at in spots]
        self._regions = {region: name for name, region in site.regions.items() if isinstance(region, Region)}

    def say(self, value: Any, kind: Type | None, now: Micros) -> str:
        """Return a value in words; `kind` is its type, if that is known."""
        match value:
            case bool():
                return "yes" if value else "no"
            case Place():
                return self.spot(value.east_m, value.north_m)
            case Position():
                return f"{self.spot(value.east_m, value.north_m)}, {value.up_m:g} m up"
            case Region():
                return self._regions.get(value) or f"a region with {len(value.corners)} corners"
            case AgentRef():
                return value.id
            case int() | float():
                return _amount(value, kind, now)
            case tuple() | list():
                item = kind.item if kind is not None else None
                words = [self.say(one, item, now) for one in value[:MOST]]
                return ", ".join(words) + (f" and {len(value) - MOST} more" if len(value) > MOST else "")
            case dict():
                fields = kind.fields if kind is not None else {}
                return ", ".join(f"{name} {self.say(one, fields.get(name), now)}" for name, one in value.items())
            case None:
                return "not set"
            case _:
                return str(value)

    def spot(self, east_m: float, north_m: float) -> str:
        """Return a place of the site by its name, another one in metres."""
        for name, east, north in self._spots:
            if abs(east - east_m) <= NEAR_M and abs(north - north_m) <= NEAR_M:
                return name
        east, north = round(east_m), round(north_m)
        return f"{abs(east)} {'W' if east < 0 else 'E'} {abs(north)} {'S' if north < 0 else 'N'}"

    def scopes(
        self, scopes: Mapping[str, Mapping[str, Any]], task: Task | None, now: Micros
    ) -> dict[str, dict[str, str]]:
        """Return scope -> name -> value in words."""
        found = {}
        for scope, values in scopes.items():
            kinds = types_in(task, scope) if task is not None else {}
            words = {
                name: self.say(value, kinds.get(name), now)
                for name, value in values.items()
                if name not in (AROUND, THROUGH) and value is not None
            }
            if words:
                found[scope] = words
        return found


def _amount(value: float, kind: Type | None, now: Micros) -> str:
    name = kind.name if kind is not None else ""
    if name == "duration":
        whole = value >= 120 and value % 60 == 0
        return f"{value / 60:g} min" if whole else f"{value:g} s"
    if name == "time":
        return f"in {span(int(value) - now)}" if value > now else f"{span(now - int(value))} ago"
    return f"{round(value, 3):g} {UNITS[name]}" if name in UNITS else f"{round(value, 3):g}"


def types_in(task: Task, scope: str) -> dict[str, Type]:
    """Return the types of the names of a scope, as far as the task's file tells them."""
    around = steps_around(task, scope) if scope else ()
    if around and isinstance(around[-1], Call):
        return {name: param.type for name, param in around[-1].subtree.params.items()}
    found = {name: param.type for name, param in task.params.items()}
    found |= {name: expr.type for name, expr in task.vars.items()}
    found |= {name: Type("list", item=AGENT) if role.is_list else AGENT for name, role in task.roles.items()}
    for _, step in steps_with_paths(task):
        if isinstance(step, For):
            found |= {name: expr.type.item for name, expr in step.lists.items() if expr.type.item is not None}
    return found


def percent(progress: float | None) -> float | None:
    """Return progress as 0..1; agents tell it so, or as percent."""
    if progress is None:
        return None
    return min(1.0, max(0.0, progress if progress <= 1 else progress / 100))
