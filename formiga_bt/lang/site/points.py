"""The points of a site file: places and regions, by name or where they stand, in metres east and north of the base."""

from typing import Any, Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Frame, Place, Position, Region, mm
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.site.far import warn_degrees, warn_metres
from formiga_bt.lang.site.fence import crossing
from formiga_bt.lang.site.keys import BASE, LAT, LNG
from formiga_bt.lang.site.whole import Written
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_listing,
    read_name,
    shorten,
    what_is,
)
from formiga_bt.lang.text.synonyms import surely

_METRES: Final = tuple(Option(key, "value", "", type="distance", required=True) for key in ("east", "north"))
_HEIGHT: Final = (Option("height", "value", "", type="distance", required=True),)

_MOST_CORNERS: Final = 1000


class Points:
    """The places and regions of one site file, resolved as they are asked for, so that their order is free."""

    def __init__(self, problems: Problems, keys: Keys, catalogue: Catalogue | None, file: str) -> None:
        self.problems = problems
        self.file = file
        self.written = Written()
        self._regions: dict[Mark, Region | None] = {}
        self.catalogue = catalogue
        self.keys = keys
        self.lat, self.lng, self.msl = self._base()
        self.frame = Frame(self.lat, self.lng, self.msl)
        self._places: dict[str, Any] = {}
        self._open: list[str] = []
        self.named = {e.key.text: e for e in self.entries("places")}
        self.outlines = {e.key.text: e.value for e in self.entries("regions")}

    def entries(self, key: str) -> tuple[Entry, ...]:
        """Return the entries of a mapping of names; bad names are reported and left out."""
        return tuple(e for e in self.keys.entries(key) if read_name(e.key, self.problems, key) is not None)

    def _base(self) -> tuple[float, float, float]:
        keys = self.keys.inside("base", BASE, "base")
        self.written.base = self.keys.mark("base") if "base" in self.keys else None
        return keys.number("lat"), keys.number("lng"), keys.number("ground_msl")

    def point(self, node: Node, what: str, *, height: bool = False) -> Place | Position | None:
        """Return the point written as {lat, lng}, {east, north} or the name of a place; with a height a position."""
        if isinstance(node, Scalar):
            if not height:
                return self._point_named(node)
            self._not_a_point(node, what, height=height)
            return None
        if not isinstance(node, Mapping_):
            self._not_a_point(node, what, height=height)
            return None
        in_degrees = node.get("lat") is not None or node.get("lng") is not None
        options = (*((LAT, LNG) if in_degrees else _METRES), *(_HEIGHT if height else ()))
        before = len(self.problems.found)
        keys = read_keys(node, options, self.problems, f"'{what}'")
        place = self._from_degrees(keys, node.mark) if in_degrees else self._from_metres(keys, node.mark)
        up = keys.number("height") if height else 0.0
        if self.problems.has_errors(before):
            return None
        return Position(place.east_m, place.north_m, up) if height else place

    def _not_a_point(self, node: Node, what: str, *, height: bool) -> None:
        more = ", height: 45 m" if height else ""
        help_ = f"such as: {{east: 10 m, north: -4 m{more}}}"
        self.problems.add("E008", node.mark, f"'{what}' must be a point, this is {what_is(node)}", help_)

    def _from_degrees(self, keys: Keys, mark: Mark) -> Place:
        lat, lng = keys.number("lat"), keys.number("lng")
        if not self.problems.has_errors():  # else the base may be wrong
            warn_degrees(lat, lng, (self.lat, self.lng), mark, self.problems)
        return self.frame.place(lat, lng)

    def _from_metres(self, keys: Keys, mark: Mark) -> Place:
        place = Place(mm(keys.number("east")), mm(keys.number("north")))
        warn_metres(place, mark, self.problems)
        return place

    def _point_named(self, at: Scalar) -> Place | None:
        if at.text == "base":
            return Place(0.0, 0.0)
        entry = self.named.get(at.text)
        if entry is None:
            known = list(self.named)
            what = f"no place is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
            self.problems.add(
                "E010", at.mark, what, f"places: {quoted_list(known)}", fix_word(at, surely(at.text, known))
            )
            return None
        if at.text in self._open:
            self.problems.add(
                "E051", at.mark, f"the place '{at.text}' is defined by itself", "give it metres or degrees"
            )
            return None
        found = self.place_named(at.text, entry)
        return found if isinstance(found, Place) else None

    def place_named(self, name: str, entry: Entry) -> Any:
        """Return the place of an entry of `places`, read once; None if it cannot be read."""
        if name not in self._places:
            self._open.append(name)
            self._places[name] = self.point(entry.value, name)
            self._open.pop()
        return self._places[name]

    def region(self, node: Node) -> Region | None:
        """Return a region written as a list of corners or by its name; each is read, and reported, once."""
        if node.mark not in self._regions:
            self._regions[node.mark] = self._read_region(node)
        return self._regions[node.mark]

    def _read_region(self, node: Node) -> Region | None:
        if isinstance(node, Scalar):
            regions = self.outlines
            target = regions.get(node.text)
            if target is not None and not isinstance(target, Scalar):
                return self.region(target)
            what = f"no region is called '{shorten(node.text)}'{did_you_mean(node.text, regions)}"
            self.problems.add("E010", node.mark, what, f"regions: {quoted_list(regions)}")
            return None
        corners = [self.point(item, "corner") for item in read_listing(node, self.problems, "region") or ()]
        places = tuple(c for c in corners if isinstance(c, Place))
        if len(places) == len(corners) and len(places) < 3:
            self.problems.add("E008", node.mark, f"a region has at least 3 corners, this has {len(places)}")
        if len(places) > _MOST_CORNERS:
            self.problems.add(
                "E008", node.mark, f"a region has at most {_MOST_CORNERS} corners, this has {len(places)}"
            )
            return None
        region = Region(places) if len(places) >= 3 else None
        edges = crossing(region) if region is not None else None
        if edges is not None:
            what = f"this region crosses itself: the edges from corner {edges[0]} and from corner {edges[1]} meet"
            self.problems.add("E085", node.mark, what, "list the corners in order around it")
        return region

    def _fence(self) -> Region | None:
        if "fence" not in self.keys:
            return None
        self.written.fence = self.keys.mark("fence")
        return self.region(self.keys["fence"].value)

    def _shut(self, key: str) -> list[tuple[Region, Mark]]:
        """Return the regions of `no_fly` or `no_go`, and where they stand."""
        return [(region, item.mark) for item in self.keys.listed(key) if (region := self.region(item)) is not None]
