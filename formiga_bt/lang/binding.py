"""Parameters from outside (command line, HTTP, a scenario) to typed values.

The texts are read as the language reads literals: `60 m`, `camp` (a place of the site), `66.50,25.73` (lat,lng),
`{east: 10 m, north: 20 m}`, an agent's id. Aliases of a parameter are accepted. All problems are reported at once.
"""

import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, Final

from formiga_bt.diagnostics import Diagnostic, Mark
from formiga_bt.geo import Frame, Place
from formiga_bt.lang.document import parse
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.model import Param, Site, Task, Unset
from formiga_bt.lang.types import AgentRef, Value

_LAT_LNG: Final = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*")


class SiteEnv:
    """What a literal may need: the site's frame. It has no names."""

    def __init__(self, site: Site) -> None:
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)

    def name(self, name: str) -> Value:
        """Refuse: a literal reads no names."""
        raise Unset(name)

    def is_set(self, name: str) -> bool:  # noqa: ARG002
        """Return False."""
        return False

    def agent_field(self, agent: AgentRef, name: str) -> Value:  # noqa: ARG002
        """Refuse."""
        raise Unset(name)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return degrees."""
        return self._frame.lat_lng(point)

    def place(self, lat: float, lng: float) -> Place:
        """Return a place."""
        return self._frame.place(lat, lng)

    def ground_up_m(self, place: Any) -> float:  # noqa: ARG002
        """Return 0: flat."""
        return 0.0


def bind_params(
    task: Task, raw: Mapping[str, str], site: Site
) -> tuple[dict[str, Any], list[Diagnostic], dict[str, str]]:
    """Return the values by parameter name, the problems, and the texts as sources for `diagnostics.render`.

    Args:
        task: the checked task.
        raw: texts by parameter name or alias.
        site: names places, and turns degrees into metres.
    """
    by_name = {alias: p for p in task.params.values() for alias in (p.name, *p.aliases)}
    values: dict[str, Any] = {}
    given: dict[str, str] = {}
    problems: list[Diagnostic] = []
    sources: dict[str, str] = {}
    for name, text in raw.items():
        param = by_name.get(name)
        file = f"parameter {name}"
        sources[file] = text
        if param is None:
            problems.append(_unknown(task, name, file, list(by_name)))
        elif param.name in given:
            text = f"'{name}' and '{given[param.name]}' are the same parameter"
            problems.append(Diagnostic("E018", Mark(file, 1, 1), text))
        else:
            given[param.name] = name
            value, found = _read(param, text, file, site)
            problems += found
            if not found:
                values[param.name] = value
    for param in task.params.values():
        if param.name not in given and param.default is None and not param.optional:
            text = f"{task.name} needs the parameter '{param.name}' ({param.type})"
            problems.append(Diagnostic("E051", Mark(task.mark.file, param.mark.line, param.mark.col), text))
    return values, problems, sources


def _unknown(task: Task, name: str, file: str, names: list[str]) -> Diagnostic:
    close = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    known = ", ".join(task.params) or "none"
    return Diagnostic("E010", Mark(file, 1, 1), f"{task.name} has no parameter '{name}'{hint}", f"parameters: {known}")


def _read(param: Param, text: str, file: str, site: Site) -> tuple[Any, list[Diagnostic]]:
    if param.type.name == "text":
        return text, []  # as it is: what a person types is no YAML
    degrees = _LAT_LNG.fullmatch(text) if param.type.name == "place" else None
    yaml = f"{{lat: {degrees[1]}, lng: {degrees[2]}}}" if degrees else text
    node, problems = parse(yaml, file)
    if node is None and not problems:
        problems = [Diagnostic("E008", Mark(file, 1, 1), f"'{param.name}' is empty, it needs a value ({param.type})")]
    if node is None or problems:
        return None, problems
    expr, problems = compile_value(node, Scope({}, site=site), param.type)
    if problems:
        return None, problems
    env = SiteEnv(site)
    value = expr.run(env)
    if param.type.name == "agent" and isinstance(value, str):
        value = AgentRef(value)
    return value, _out_of_range(param, value, env, file, text)


def _out_of_range(param: Param, value: Any, env: SiteEnv, file: str, raw: str) -> list[Diagnostic]:
    for bound, word, beyond in ((param.min, "least", -1), (param.max, "most", 1)):
        if bound is None or not isinstance(value, int | float):
            continue
        limit = bound.run(env)
        if (value - limit) * beyond > 0:
            text = f"'{param.name}' must be at {word} {bound.source}"
            return [Diagnostic("E062", Mark(file, 1, 1, 1, len(raw) + 1), text)]
    if param.choices and str(value) not in param.choices:
        text = f"'{param.name}' must be one of {', '.join(param.choices)}"
        return [Diagnostic("E014", Mark(file, 1, 1, 1, len(raw) + 1), text)]
    return []
