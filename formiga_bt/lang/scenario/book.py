"""What all readers of a scenario share: the problems found, the site, who is there, and the small values of an entry."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.scope import OUTSIDE
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Catalogue, Param, Site
from formiga_bt.lang.request.binding import SiteEnv, impossible, outside, run_outside
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_mapping,
    read_quantity,
    read_text,
    shorten,
)
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import PLACE, AgentRef, Type

_LAT_LNG: Final = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*")


class Book:
    """One scenario while it is read.

    Args:
        problems: where to report.
        sources: text of each file read, by name.
        keys: of the scenario.
        catalogue: agent types and actions.
        site: where it plays.
        folders: where tasks are looked up.
        now: engine time of the request, for times of today; without it a time needs its date.
    """

    def __init__(
        self,
        problems: Problems,
        sources: dict[str, str],
        keys: Keys,
        catalogue: Catalogue,
        site: Site,
        folders: Sequence[Path],
        now: Micros | None = None,
    ) -> None:
        self.now = now
        self.problems = problems
        self.sources = sources
        self.keys = keys
        self.catalogue = catalogue
        self.site = site
        self.folders = folders
        self.types: dict[str, str] = {}
        """Agent id -> type, of this scenario."""

    def is_human(self, agent: str) -> bool:
        """Return whether an agent of this scenario is a person."""
        return self.catalogue.types[self.types[agent]].human

    def nobody(self, at: Scalar, known: Sequence[str], who: str = "agent") -> None:
        """Report that the scenario has nobody of that name."""
        what = f"no {who} of this scenario is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        whom = " or ".join(f"{word}s" for word in who.split(" or "))
        help_ = f"{whom}: {quoted_list(known) or 'none'}"
        self.problems.add("E010", at.mark, what, help_, fix_word(at, surely(at.text, known)))

    def way(self, keys: Keys, key: str) -> tuple[Place, ...]:
        """Return the places of a way on the ground."""
        points = [self.point(item) for item in keys.listed(key)]
        return tuple(point if isinstance(point, Place) else point.ground for point in points if point is not None)

    def point(self, node: Node) -> Place | Position | None:
        """Read a port's name, a place's name, `lat,lng`, or a mapping with or without a height."""
        if isinstance(node, Scalar):
            if node.text in self.site.ports:
                at: Place = self.site.ports[node.text].at
                return at
            degrees = _LAT_LNG.fullmatch(node.text)
            if degrees is None and node.text not in self.site.places and node.text != "base":
                known = ["base", *self.site.ports, *self.site.places]
                what = f"no port or place is called '{shorten(node.text)}'{did_you_mean(node.text, known)}"
                meant = surely(node.text, known)
                self.problems.add("E010", node.mark, what, f"known: {quoted_list(known)}", fix_word(node, meant))
                return None
            if node.text == "base":
                return Place(0.0, 0.0)
        height = node.get("height") if isinstance(node, Mapping_) else None
        if isinstance(node, Mapping_) and height is not None:
            node = Mapping_(tuple(entry for entry in node.entries if entry is not height), node.mark)
        place = self.value(node, Param("at", PLACE, node.mark))
        if not isinstance(place, Place) or height is None:
            return place if isinstance(place, Place) else None
        up_m = read_quantity(height.value, self.problems, "height", "distance")
        return Position(place.east_m, place.north_m, up_m) if up_m is not None else None

    def value(self, node: Node, param: Param) -> Any:
        """Return a literal as a runtime value, or None if it was reported."""
        if param.type.name == "agent":
            return self._agent_value(node, param)
        degrees = _LAT_LNG.fullmatch(node.text) if param.type.name == "place" and isinstance(node, Scalar) else None
        if degrees is not None:
            place = SiteEnv(self.site).place(float(degrees[1]), float(degrees[2]))
            self.problems.extend(outside(param, place, self.site, node))
            return place
        expr, found = compile_value(node, Scope({}, site=self.site, built_ins=OUTSIDE), param.type)
        if not found:
            value, found = run_outside(expr, self.site, node.mark, param.name, self.now)
            found = found or outside(param, value, self.site, node)
        self.problems.extend(found)
        if any(problem.severity == "error" for problem in found):
            return None
        self._check_bounds(param, value, node.mark)
        return value

    def fields(self, entry: Entry, types: Mapping[str, Type], who: str, does: str) -> dict[str, Any]:
        """Return a mapping of fields as runtime values; what no field fits is reported (E022).

        Args:
            entry: the key with the mapping.
            types: of the fields, by name.
            who: whose they are, at the begin of a message: `Inspect`.
            does: the verb after it: `returns`.
        """
        mapping = read_mapping(entry.value, self.problems, entry.key.text)
        found: dict[str, Any] = {}
        for one in mapping.entries if mapping is not None else ():
            name = one.key.text
            if name not in types:
                text = f"{who} {does} no '{shorten(name)}'{did_you_mean(name, types)}"
                self.problems.add("E022", one.key.mark, text, f"it {does}: {quoted_list(types) or 'nothing'}")
                continue
            found[name] = self.value(one.value, Param(name, types[name], one.value.mark))
        return found

    def _check_bounds(self, param: Param, value: Any, mark: Mark) -> None:
        wrong = impossible(param, value)
        if wrong:
            self.problems.add("E062", mark, f"'{param.name}' {wrong}")
        for bound, word, beyond in ((param.min, "least", -1), (param.max, "most", 1)):
            if bound is None or not isinstance(value, int | float):
                continue
            limit, found = run_outside(bound, self.site, bound.mark, f"the limit of {param.name}", self.now)
            self.problems.extend(found)
            if not found and (value - limit) * beyond > 0:
                self.problems.add("E062", mark, f"'{param.name}' must be at {word} {bound.source}")
        if param.choices and str(value) not in param.choices:
            what = f"'{param.name}' must be one of {quoted_list(param.choices)}"
            self.problems.add("E014", mark, what + did_you_mean(str(value), param.choices))

    def _agent_value(self, node: Node, param: Param) -> AgentRef | None:
        at = read_text(node, self.problems, param.name)
        if at is None:
            return None
        of = self.types.get(at.text)
        fitting = [id_ for id_, type_ in self.types.items() if self._is_a(type_, param.type.of)]
        if of is None:
            self.nobody(at, fitting)
            return None
        if not self._is_a(of, param.type.of):
            what = f"'{param.name}' is a {' or '.join(param.type.of)}, '{at.text}' is a {of}"
            self.problems.add("E013", at.mark, what, f"agents: {quoted_list(fitting)}")
            return None
        return AgentRef(at.text)

    def _is_a(self, type_: str, of: Sequence[str]) -> bool:
        return not of or type_ in of or any(parent in of for parent in self.catalogue.types[type_].extends)
