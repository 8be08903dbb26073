"""Parameters from outside (command line, HTTP, a scenario) to typed values.

The texts are read as the language reads literals: `60 m`, `camp` (a place of the site), `66.501,25.703` (lat,lng),
`{east: 10 m, north: 20 m}`, an agent's id. Aliases of a parameter are accepted. All problems are reported at once.
"""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any, Final

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.geo import Frame, Place
from formiga_bt.lang.expr.scope import OUTSIDE
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.model import EvalError, Expr, Param, Site, Task, UnknownState, Unset
from formiga_bt.lang.request.aliases import by_alias, degrees_of
from formiga_bt.lang.request.value_files import ValueFile, entries_of
from formiga_bt.lang.site.fence import leaves
from formiga_bt.lang.site.ground import ground_up_m
from formiga_bt.lang.text.document import Listing, Node, Scalar, parse
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import DURATION, PERCENT, AgentRef, Type, Value

_LAT_LNG: Final = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*")


BASE: Final = Place(0.0, 0.0)
MOST_PROBLEMS: Final = 20
"""Told of one request."""


class SiteEnv:
    """What a value given from outside may read: `base`, `site`, and the site's frame; for `06:30`, which day it is."""

    def __init__(self, site: Site, now: Micros | None = None) -> None:
        self._site = site
        self._now = now
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)

    def name(self, name: str) -> Value:
        """Return `base` or `site`; there is no task that has other names."""
        match name:
            case "base":
                return BASE
            case "site":
                return names_of(self._site)
            case "now" if self._now is not None:
                return self._now
        raise Unset(f"'{name}' has no value here")

    def is_set(self, name: str) -> bool:
        """Return whether it is one of the two names."""
        return name in OUTSIDE

    def agent_field(self, agent: AgentRef, name: str) -> Value:  # noqa: ARG002
        """Refuse."""
        raise Unset(name)

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Refuse."""
        raise Unset(agent_type)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return degrees."""
        return self._frame.lat_lng(point)

    def place(self, lat: float, lng: float) -> Place:
        """Return a place."""
        return self._frame.place(lat, lng)

    def ground_up_m(self, place: Any) -> float:
        """Return the height of the ground over the base's."""
        return ground_up_m(self._site, place)


def names_of(site: Site) -> dict[str, Value]:
    """Return the value of `site`."""
    ports = {port.name: port.at for port in site.ports.values()}
    names = {"ports": ports, "places": dict(site.places), "regions": dict(site.regions)}
    return {"name": site.name, "timezone": site.timezone, **names}


def run_outside(
    expr: Expr, site: Site, mark: Mark, what: str, now: Micros | None = None
) -> tuple[Any, list[Diagnostic]]:
    """Return an expression's value where there is no task, or None and the reason why it has none."""
    try:
        return expr.run(SiteEnv(site, now)), []
    except (Unset, UnknownState, EvalError, ArithmeticError, LookupError) as error:
        why = getattr(error, "reason", "") or str(error).strip("'\"") or type(error).__name__
        return None, [Diagnostic("E062", mark, f"'{what}' has no value: {why}", "write a value that can be computed")]


def bind_params(
    task: Task, raw: Mapping[str, str], site: Site, now: Micros | None = None, files: Iterable[ValueFile] = ()
) -> tuple[dict[str, Any], list[Diagnostic], dict[str, str]]:
    """Return the values by parameter name, the problems, and the texts as sources for `diagnostics.render`.

    Args:
        task: the checked task.
        raw: texts by parameter name or alias; a place may also be given as `lat` and `lng` (see `aliases`).
        site: names places, and turns degrees into metres.
        now: engine time, for times of today; without it a time needs its date.
        files: in which further values stand.
    """
    binding = _Binding(task, site, now)
    by_name = binding.by_name
    apart = list(degrees_of(task.params, raw))
    whole = {name: text for name, text in raw.items() if not any(name in one.names for one in apart)}
    for one in apart:
        lat, lng = one.names
        if not lng:
            binding.sources[f"parameter {lat}"] = raw[lat]
            binding.problems.append(half_a_place(lat, one.param))
            binding.given.setdefault(one.param.name, lat)
        else:
            by_name[f"{lat} and {lng}"] = one.param
            whole[f"{lat} and {lng}"] = f"{{lat: {raw[lat].strip()}, lng: {raw[lng].strip()}}}"
    for name, text in whole.items():
        file = f"parameter {name}"
        binding.sources[file] = text
        binding.take(name, Mark(file, 1, 1), text)
    read, files = Problems(), tuple(files)
    binding.sources |= {one.file: one.text for one in files}
    for entry in entries_of(files, by_name, read):
        binding.take(entry.key.text, entry.key.mark, entry.value)
    binding.problems += read.found
    if not read.has_errors():  # else nobody knows what is missing
        binding.finish()
    return binding.values, _few(binding.problems), binding.sources


def _few(problems: list[Diagnostic]) -> list[Diagnostic]:
    """Return the first problems, with how many more there are: a table that is wrong in one row is mostly so in each."""
    first, more = problems[:MOST_PROBLEMS], problems[MOST_PROBLEMS:]
    if not more:
        return first
    return [
        *first,
        Diagnostic(more[0].code, more[0].mark, f"{len(more)} more are wrong from here on", "mend the first ones"),
    ]


class _Binding:
    """The parameters of one request while they are read.

    Args:
        task: the checked task.
        site: names places, and turns degrees into metres.
        now: engine time, for times of today.
    """

    def __init__(self, task: Task, site: Site, now: Micros | None) -> None:
        self.by_name = by_alias(task.params)
        self.values: dict[str, Any] = {}
        self.given: dict[str, str] = {}
        """Parameter -> the name under which it was given."""
        self.problems: list[Diagnostic] = []
        self.sources: dict[str, str] = {}
        self._task, self._site, self._now = task, site, now

    def take(self, name: str, mark: Mark, said: str | Node) -> None:
        """Read one parameter, as a text or as a file has it; `mark` is where its name stands."""
        param = self.by_name.get(name)
        if param is None:
            self.problems.append(_unknown(self._task, name, mark, list(self.by_name)))
            return
        before = self.given.setdefault(param.name, name)
        if param.name in self.values or before != name:
            what = f"'{name}' is given twice" if before == name else f"'{name}' and '{before}' are the same parameter"
            self.problems.append(Diagnostic("E018", mark, what, "give one of them"))
            return
        if isinstance(said, str):
            value, found = _read(param, said, mark.file, self._site, self._now)
        else:
            value, found = _of_node(param, said, self._site, self._now)
        self.problems += found
        if not found:
            self.values[param.name] = value

    def finish(self) -> None:
        """Report what is missing, and defaults that lie outside."""
        for param in self._task.params.values():
            if param.name in self.given:
                continue
            if param.default is not None:
                self.problems += _default_outside(param, param.default, self._site, self._now)
            elif not param.optional:
                text = f"{self._task.name} needs the parameter '{param.name}' ({param.type})"
                mark = Mark(self._task.mark.file, param.mark.line, param.mark.col)
                self.problems.append(Diagnostic("E051", mark, text))


def bind_fields(
    what: str, types: Mapping[str, Type], raw: Mapping[str, str], site: Site, now: Micros | None = None
) -> tuple[dict[str, Any], list[Diagnostic], dict[str, str]]:
    """Return the values of fields that are all due, the problems, and the texts as sources, as `bind_params` does.

    Args:
        what: whose fields they are, for messages.
        types: of the fields, by name.
        raw: texts by name.
        site: names places, and turns degrees into metres.
        now: engine time, for times of today.
    """
    values: dict[str, Any] = {}
    problems: list[Diagnostic] = []
    sources: dict[str, str] = {}
    known = f"fields: {', '.join(types) or 'none'}"
    for name, text in raw.items():
        file = f"field {name}"
        sources[file] = text
        if name not in types:
            close = get_close_matches(name, types, n=1)
            hint = f"; did you mean '{close[0]}'?" if close else ""
            problems.append(Diagnostic("E022", Mark(file, 1, 1), f"{what} has no field '{name}'{hint}", known))
            continue
        values[name], found = _read(Param(name, types[name], Mark(file, 1, 1)), text, file, site, now)
        problems += found
    missing = [name for name in types if name not in raw]
    if missing and not problems:
        name = missing[0]
        sources[f"field {name}"] = ""
        problems.append(
            Diagnostic("E022", Mark(f"field {name}", 1, 1), f"{what} needs '{name}' ({types[name]})", known)
        )
    return values, problems, sources


def _default_outside(param: Param, default: Expr, site: Site, now: Micros | None) -> list[Diagnostic]:
    """Return E063 for a default that lies outside; one that cannot be computed here is left to the engine."""
    value, problems = run_outside(default, site, default.mark, param.name, now)
    return [] if problems else outside(param, value, site, Scalar(default.source, default.mark))


def half_a_place(name: str, param: Param) -> Diagnostic:
    """Return E051 for a latitude without a longitude, or the reverse."""
    other = name.replace("lat", "lng", 1) if name.startswith("lat") else "lat" + name[3:]
    text = f"'{name}' is half a place: '{other}' is missing"
    return Diagnostic("E051", Mark(f"parameter {name}", 1, 1), text, f"both are '{param.name}'; or give that alone")


def _unknown(task: Task, name: str, mark: Mark, names: list[str]) -> Diagnostic:
    close = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    known = ", ".join(task.params) or "none"
    return Diagnostic("E010", mark, f"{task.name} has no parameter '{name}'{hint}", f"parameters: {known}")


def _read(param: Param, text: str, file: str, site: Site, now: Micros | None) -> tuple[Any, list[Diagnostic]]:
    if param.type.name == "text":
        return text, _out_of_range(param, text, site, Mark(file, 1, 1), now)  # as it is: what a person types is no YAML
    degrees = _LAT_LNG.fullmatch(text) if param.type.name == "place" else None
    yaml = f"{{lat: {degrees[1]}, lng: {degrees[2]}}}" if degrees else text
    node, problems = parse(yaml, file)
    if node is None and not problems:
        problems = [Diagnostic("E008", Mark(file, 1, 1), f"'{param.name}' is empty, it needs a value ({param.type})")]
    if node is None or problems:
        return None, problems
    return _of_node(param, node, site, now)


def _of_node(param: Param, node: Node, site: Site, now: Micros | None) -> tuple[Any, list[Diagnostic]]:
    expr, problems = compile_value(node, Scope({}, site=site, built_ins=OUTSIDE), param.type)
    if problems:
        return None, problems
    value, problems = run_outside(expr, site, node.mark, param.name, now)
    if problems:
        return None, problems
    if param.type.name == "agent" and isinstance(value, str):
        value = AgentRef(value)
    return value, [*_out_of_range(param, value, site, node.mark, now), *outside(param, value, site, node)]


def impossible(param: Param, value: Any) -> str:
    """Return why no value of its type is so, or ""; the `min` and `max` of a param may say that it can be."""
    if not isinstance(value, int | float):
        return ""
    return never(param.type, value, least=param.min is None, most=param.max is None)


def never(of: Type, value: float, *, least: bool = True, most: bool = True) -> str:
    """Return what a duration or a percent is, if a value cannot be one: below zero, or (`most`) above 100 %."""
    if of == DURATION and least and value < 0:
        return "is a duration, it cannot be below 0 s"
    if of == PERCENT and ((least and value < 0) or (most and value > 100)):
        return "is a percent, it lies between 0 % and 100 %"
    return ""


def outside(param: Param, value: Any, site: Site, node: Node) -> list[Diagnostic]:
    """Return E063 for a value with a point outside the site's fence, at the items of a list that have one."""
    if leaves(value, site):
        if isinstance(node, Listing) and isinstance(value, tuple):
            return [one for item, at in zip(value, node.items, strict=True) for one in outside(param, item, site, at)]
        said = f"'{param.name}' lies outside the fence of site {site.name}"
        known = [name for name, place in site.places.items() if not leaves(place, site)]
        return [Diagnostic("E063", node.mark, said, f"places inside: {', '.join(known[:8])}" if known else "")]
    return []


def _out_of_range(param: Param, value: Any, site: Site, mark: Mark, now: Micros | None) -> list[Diagnostic]:
    wrong = impossible(param, value)
    if wrong:
        text = f"'{param.name}' {wrong}"
        return [Diagnostic("E062", mark, text)]
    for bound, word, beyond in ((param.min, "least", -1), (param.max, "most", 1)):
        if bound is None or not isinstance(value, int | float):
            continue
        limit, problems = run_outside(bound, site, bound.mark, f"the limit of {param.name}", now)
        if problems:
            return problems
        if (value - limit) * beyond > 0:
            text = f"'{param.name}' must be at {word} {bound.source}"
            return [Diagnostic("E062", mark, text)]
    if param.choices and str(value) not in param.choices:
        text = f"'{param.name}' must be one of {', '.join(param.choices)}"
        return [Diagnostic("E014", mark, text)]
    return []
