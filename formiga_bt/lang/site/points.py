"""The points of a site file: places and regions, by name or where they stand, in metres east and north of the base."""

from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.diagnostics import Mark
from formiga_bt.geo import Frame, Place, Position, Region, mm
from formiga_bt.lang.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.far import warn_degrees, warn_metres
from formiga_bt.lang.fence import crossing
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_keys,
    read_listing,
    read_mapping,
    read_name,
    read_number,
    read_quantity,
    shorten,
    what_is,
)
from formiga_bt.lang.site.keys import BASE
from formiga_bt.lang.site.whole import Written
from formiga_bt.lang.synonyms import surely

_DEGREES: Final = (Option("lat", "value", "", required=True), Option("lng", "value", "", required=True))
_METRES: Final = (Option("east", "value", "", required=True), Option("north", "value", "", required=True))
_HEIGHT: Final = (Option("height", "value", "", required=True),)

_MOST_CORNERS: Final = 1000


class Points:
    """The places and regions of one site file, resolved as they are asked for, so that their order is free."""

    def __init__(self, problems: Problems, keys: dict[str, Entry], catalogue: Catalogue | None, file: str) -> None:
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

    def entries(self, key: str) -> tuple[Entry, ...]:
        """Return the entries of a mapping of names; bad names are reported and left out."""
        mapping = read_mapping(self.keys[key].value, self.problems, key) if key in self.keys else None
        entries = mapping.entries if mapping is not None else ()
        return tuple(e for e in entries if read_name(e.key, self.problems, key) is not None)

    def _base(self) -> tuple[float, float, float]:
        mapping = read_mapping(self.keys["base"].value, self.problems, "base") if "base" in self.keys else None
        keys = read_keys(mapping, BASE, self.problems, "base") if mapping is not None else {}
        msl = (
            read_quantity(keys["ground_msl"].value, self.problems, "ground_msl", "distance")
            if "ground_msl" in keys
            else 0.0
        )
        self.written.base = self.keys["base"].value.mark if "base" in self.keys else None
        lat, lng = self._degrees(keys, "lat", 90.0), self._degrees(keys, "lng", 180.0)
        return lat or 0.0, lng or 0.0, msl or 0.0

    def _degrees(self, keys: Mapping[str, Entry], key: str, most: float) -> float | None:
        value = read_number(keys[key].value, self.problems, key) if key in keys else None
        if value is not None and abs(value) > most:
            self.problems.add("E062", keys[key].value.mark, f"'{key}' must lie between -{most:g} and {most:g}")
            return None
        return value

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
        options = (*(_DEGREES if in_degrees else _METRES), *(_HEIGHT if height else ()))
        keys = read_keys(node, options, self.problems, f"'{what}'")
        if any(option.name not in keys for option in options):
            return None
        place = self._from_degrees(keys, node.mark) if in_degrees else self._from_metres(keys, node.mark)
        if place is None or not height:
            return place
        up = read_quantity(keys["height"].value, self.problems, "height", "distance")
        return Position(place.east_m, place.north_m, up) if up is not None else None

    def _not_a_point(self, node: Node, what: str, *, height: bool) -> None:
        more = ", height: 45 m" if height else ""
        help_ = f"such as: {{east: 10 m, north: -4 m{more}}}"
        self.problems.add("E008", node.mark, f"'{what}' must be a point, this is {what_is(node)}", help_)

    def _from_degrees(self, keys: Mapping[str, Entry], mark: Mark) -> Place | None:
        lat, lng = self._degrees(keys, "lat", 90.0), self._degrees(keys, "lng", 180.0)
        if lat is not None and lng is not None and not self.problems.has_errors():  # else the base may be wrong
            warn_degrees(lat, lng, (self.lat, self.lng), mark, self.problems)
        return self.frame.place(lat, lng) if lat is not None and lng is not None else None

    def _from_metres(self, keys: Mapping[str, Entry], mark: Mark) -> Place | None:
        east = read_quantity(keys["east"].value, self.problems, "east", "distance")
        north = read_quantity(keys["north"].value, self.problems, "north", "distance")
        if east is None or north is None:
            return None
        place = Place(mm(east), mm(north))
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
            regions = {e.key.text: e.value for e in self.entries("regions")}
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
        node = self.keys["fence"].value
        self.written.fence = node.mark
        return self.region(node)

    def _no_fly(self) -> tuple[Any, ...]:
        items = read_listing(self.keys["no_fly"].value, self.problems, "no_fly") if "no_fly" in self.keys else ()
        found = [(region, item.mark) for item in items or () if (region := self.region(item)) is not None]
        self.written.no_fly = found
        return tuple(region for region, _ in found)
