"""Site files (`formiga_site: 1`): base station, ports, places, regions, layers, people and agents.

Places become metres east and north of the base; latitudes and longitudes go through `geo.Frame`. Called by the command
line, the engine's front and tests.
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

from formiga_bt.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.geo import Frame, Place, Position, Region, mm
from formiga_bt.heights import HeightGrid
from formiga_bt.lang.document import Entry, Listing, Mapping_, Node, Scalar, parse
from formiga_bt.lang.envelope import check_site, read_envelope, read_on_breach
from formiga_bt.lang.far import warn_degrees, warn_metres
from formiga_bt.lang.fence import crossing
from formiga_bt.lang.ground import load_heights
from formiga_bt.lang.kinds import ENVELOPE, Option
from formiga_bt.lang.model import Catalogue, Port, Site, SiteAgent
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
    read_text,
    read_word,
    read_words,
    shorten,
    what_is,
)
from formiga_bt.lang.site_checks import Written, check_whole, machines
from formiga_bt.lang.synonyms import nearest, surely

SITE: Final = (
    Option("formiga_site", "value", "Version of the site format.", type="int", required=True),
    Option("name", "name", "The site's name.", required=True),
    Option("base", "options", "The base station: lat, lng, ground_msl.", required=True),
    Option("timezone", "word", "Its IANA time zone, such as Europe/Helsinki (UTC)."),
    Option("ports", "map", "Landing ports: {at, waiting}."),
    Option("places", "map", "Named places."),
    Option("regions", "map", "Named regions: lists of places."),
    Option("fence", "value", "The region that no flight leaves."),
    Option("no_fly", "value", "Regions that no flight enters."),
    Option("terrain", "options", "The ground: {flat: true, relief: 5 m} or {file: heights.asc, relief: 2 m}."),
    Option("layers", "value", "Heights at which drones cross, over the base's ground."),
    Option("separation", "value", "Least distance between drones of different tasks.", type="distance"),
    Option("min_spacing", "value", "Least distance between spots that machines use.", type="distance"),
    Option("envelope", "options", "What the site tightens of the envelope of every machine.", keys=ENVELOPE),
    Option("on_breach", "map", "What follows a breach of a limit; it ranks above the type's word."),
    Option(
        "preflight", "word", "Whether a grant needs preflight checks that are all ok.", values=("required", "shown")
    ),
    Option("pilots", "value", "The pilots: {id, max_airborne}; required in mode real."),
    Option("people", "map", "Site roles and the people who have them."),
    Option("agents", "map", "The agents: {type, home}."),
    Option("transports", "map", "How agents are reached."),
    Option("mode", "word", "Whether unlisted agents are admitted.", values=("simulation", "real")),
)

BASE: Final = (
    Option("lat", "value", "Latitude, degrees.", required=True),
    Option("lng", "value", "Longitude, degrees.", required=True),
    Option("ground_msl", "value", "Height of its ground over the sea.", type="distance"),
)
PORT: Final = (
    Option("at", "value", "Its place.", required=True),
    Option("waiting", "value", "Where to wait when it is taken."),
)
TERRAIN: Final = (
    Option("flat", "flag", "Whether the ground is flat."),
    Option("file", "text", "An ESRI ASCII grid of heights over the sea, in metres east and north of the base."),
    Option("relief", "value", "How much it may rise or fall, or the file be wrong by.", type="distance"),
)
PILOT: Final = (
    Option("id", "name", "The pilot.", required=True),
    Option("max_airborne", "value", "Machines in the air at once (1).", type="int"),
)
AGENT: Final = (
    Option("type", "name", "Its type.", required=True),
    Option("home", "name", "Its own port."),
)
_DEGREES: Final = (Option("lat", "value", "", required=True), Option("lng", "value", "", required=True))
_METRES: Final = (Option("east", "value", "", required=True), Option("north", "value", "", required=True))
_HEIGHT: Final = (Option("height", "value", "", required=True),)

APPROVERS: Final = "approvers"
"""The site role of those who approve bundles in mode real; they need be no agents."""

_MOST_CORNERS: Final = 1000


def load_site(path: Path, catalogue: Catalogue | None = None) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read a site file.

    Args:
        path: of the file.
        catalogue: the agent types that its agents may have; without one, any type is accepted.

    Returns:
        The site (None if there is any error), all problems in file order, and the file's text by its name.
    """
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return None, [Diagnostic("E008", Mark(file, 1, 1), f"the file cannot be read: {error}")], {}
    return load_site_text(text, file, catalogue)


def load_site_text(
    text: str, file: str, catalogue: Catalogue | None = None
) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read the text of a site file; `file` is its name in marks, and `catalogue` has the types of its agents."""
    problems = Problems()
    node, found = parse(text, file)
    problems.extend(found)
    if node is None and not found:
        problems.add("E008", Mark(file, 1, 1), "the file is empty", "begin with: formiga_site: 1")
    root = read_mapping(node, problems, "site") if node is not None else None
    site = None
    if root is not None:
        keys = read_keys(root, SITE, problems, "a site")
        site = _SiteReader(problems, keys, catalogue, file).read(text)
    return (None if problems.has_errors() else site), in_order(problems.found), {file: text}


class _SiteReader:
    """Reads the keys of one site file; places are resolved as they are asked for, so that their order is free."""

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
        self._named = {e.key.text: e for e in self._entries("places")}

    def read(self, text: str) -> Site:
        """Build the site; where something is wrong it has been reported and is left out."""
        self._version()
        name = self.keys["name"].value if "name" in self.keys else None
        at = read_name(name, self.problems, "name") if name is not None else None
        ports = {e.key.text: port for e in self._entries("ports") if (port := self._port(e)) is not None}
        agents = self._agents()
        pilots = self._pilots()
        heights, relief = self._terrain()
        site = Site(
            at.text if at is not None else "",
            self.lat,
            self.lng,
            self.msl,
            timezone=self._timezone(),
            ports=ports,
            places={
                one: place for one, entry in self._named.items() if (place := self._place_named(one, entry)) is not None
            },
            regions={
                e.key.text: region for e in self._entries("regions") if (region := self._region(e.value)) is not None
            },
            fence=self._fence(),
            no_fly=self._no_fly(),
            relief_m=relief,
            heights=heights,
            layers_m=self._layers(),
            separation_m=self._distance("separation", 15.0),
            min_spacing_m=self._distance("min_spacing", 3.0),
            envelope=self._envelope(),
            on_breach=read_on_breach(self.keys["on_breach"].value, self.problems) if "on_breach" in self.keys else {},
            preflight=self._word("preflight", ("required", "shown")) == "required",
            pilots=pilots,
            people=self._people(agents),
            agents=agents,
            transports={e.key.text: plain(e.value) for e in self._entries("transports")},
            mode="real" if self._mode(pilots) == "real" else "simulation",
            file=self.file,
            digest=_digest(text, heights.digest if heights is not None else ""),
        )
        if not self.problems.has_errors():
            self._check(site)
        return site

    def _check(self, site: Site) -> None:
        types = machines(site, self.catalogue.types) if self.catalogue is not None else []
        check_site(self.written.limits, types, self.problems)
        check_whole(site, self.written, types, self.problems)

    def _word(self, key: str, words: tuple[str, ...]) -> str:
        return read_word(self.keys[key].value, self.problems, key, words) if key in self.keys else ""

    def _timezone(self) -> str:
        at = read_text(self.keys["timezone"].value, self.problems, "timezone") if "timezone" in self.keys else None
        if at is None:
            return "UTC"
        try:
            return ZoneInfo(at.text).key
        except (ZoneInfoNotFoundError, ValueError, OSError):
            known = sorted(available_timezones())
            meant = nearest(at.text, known)
            what = f"there is no time zone '{shorten(at.text)}'{did_you_mean(at.text, known)}"
            self.problems.add("E008", at.mark, what, "an IANA name, such as Europe/Helsinki", fix_word(at, meant))
            return "UTC"

    def _mode(self, pilots: Mapping[str, int]) -> str:
        mode = self._word("mode", ("simulation", "real"))
        if mode == "real" and not pilots and "pilots" not in self.keys:
            what = "mode real needs pilots: each machine flies under the eyes of one"
            self.problems.add(
                "E008", self.keys["mode"].value.mark, what, "such as: pilots: [{id: anna, max_airborne: 3}]"
            )
        return mode

    def _envelope(self) -> dict[str, float]:
        if "envelope" in self.keys:
            self.written.limits = read_envelope(self.keys["envelope"].value, self.problems)
        return {limit.key: limit.value for limit in self.written.limits.values()}

    def _pilots(self) -> dict[str, int]:
        found: dict[str, int] = {}
        node = self.keys["pilots"].value if "pilots" in self.keys else None
        items = read_listing(node, self.problems, "pilots") if node is not None else ()
        if node is not None and items is not None and not items:
            self.problems.add("E044", node.mark, "'pilots' is an empty list", "such as: [{id: anna, max_airborne: 3}]")
        for item in items or ():
            mapping = read_mapping(item, self.problems, "pilots")
            keys = read_keys(mapping, PILOT, self.problems, "a pilot") if mapping is not None else {}
            at = read_name(keys["id"].value, self.problems, "id") if "id" in keys else None
            most = (
                read_number(keys["max_airborne"].value, self.problems, "max_airborne") if "max_airborne" in keys else 1
            )
            if most is not None and (most < 1 or most != int(most)):
                mark = keys["max_airborne"].value.mark
                self.problems.add("E062", mark, "'max_airborne' must be a whole number from 1 on")
            elif at is not None and at.text in found:
                self.problems.add("E018", at.mark, f"the pilot '{at.text}' is listed twice", "keep one of them")
            elif at is not None and most is not None:
                found[at.text] = int(most)
        return found

    def _entries(self, key: str) -> tuple[Entry, ...]:
        mapping = read_mapping(self.keys[key].value, self.problems, key) if key in self.keys else None
        entries = mapping.entries if mapping is not None else ()
        return tuple(e for e in entries if read_name(e.key, self.problems, key) is not None)

    def _version(self) -> None:
        entry = self.keys.get("formiga_site")
        at = read_text(entry.value, self.problems, "formiga_site") if entry is not None else None
        if at is not None and at.text != "1":
            self.problems.add("E007", at.mark, f"this site needs version {shorten(at.text)}, this program knows 1")

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

    # --- points ------------------------------------------------------------------------------------------------

    def _point(self, node: Node, what: str, *, height: bool = False) -> Place | Position | None:
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
        entry = self._named.get(at.text)
        if entry is None:
            known = list(self._named)
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
        found = self._place_named(at.text, entry)
        return found if isinstance(found, Place) else None

    def _place_named(self, name: str, entry: Entry) -> Any:
        if name not in self._places:
            self._open.append(name)
            self._places[name] = self._point(entry.value, name)
            self._open.pop()
        return self._places[name]

    def _region(self, node: Node) -> Region | None:
        """Return a region written as a list of corners or by its name; each is read, and reported, once."""
        if node.mark not in self._regions:
            self._regions[node.mark] = self._read_region(node)
        return self._regions[node.mark]

    def _read_region(self, node: Node) -> Region | None:
        if isinstance(node, Scalar):
            regions = {e.key.text: e.value for e in self._entries("regions")}
            target = regions.get(node.text)
            if target is not None and not isinstance(target, Scalar):
                return self._region(target)
            what = f"no region is called '{shorten(node.text)}'{did_you_mean(node.text, regions)}"
            self.problems.add("E010", node.mark, what, f"regions: {quoted_list(regions)}")
            return None
        corners = [self._point(item, "corner") for item in read_listing(node, self.problems, "region") or ()]
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
        return self._region(node)

    def _no_fly(self) -> tuple[Any, ...]:
        items = read_listing(self.keys["no_fly"].value, self.problems, "no_fly") if "no_fly" in self.keys else ()
        found = [(region, item.mark) for item in items or () if (region := self._region(item)) is not None]
        self.written.no_fly = found
        return tuple(region for region, _ in found)

    # --- the rest ----------------------------------------------------------------------------------------------

    def _port(self, entry: Entry) -> Port | None:
        name = entry.key.text
        mapping = read_mapping(entry.value, self.problems, name)
        keys = read_keys(mapping, PORT, self.problems, f"port '{name}'") if mapping is not None else {}
        at = self._point(keys["at"].value, "at") if "at" in keys else None
        waiting = self._point(keys["waiting"].value, "waiting", height=True) if "waiting" in keys else None
        if at is None:
            return None
        self.written.ports[name] = keys["at"].value.mark
        if waiting is not None:
            self.written.waiting[name] = keys["waiting"].value.mark
        return Port(name, at, waiting)

    def _terrain(self) -> tuple[HeightGrid | None, float]:
        """Return the heights of the ground (None = flat) and how far the ground may be off, metres."""
        mapping = read_mapping(self.keys["terrain"].value, self.problems, "terrain") if "terrain" in self.keys else None
        keys = read_keys(mapping, TERRAIN, self.problems, "terrain") if mapping is not None else {}
        relief = read_quantity(keys["relief"].value, self.problems, "relief", "distance") if "relief" in keys else 0.0
        if relief is not None and relief < 0:
            self.problems.add("E062", keys["relief"].value.mark, "'relief' must be at least 0 m")
        if "file" not in keys:
            if "flat" in keys:
                read_word(keys["flat"].value, self.problems, "flat", ("true",))
            return None, relief or 0.0
        if "flat" in keys:
            self.problems.add("E008", keys["flat"].key.mark, "terrain is flat or in a file, not both", "remove one")
            return None, relief or 0.0
        self.written.terrain = keys["file"].value.mark
        at = read_text(keys["file"].value, self.problems, "file")
        return (
            load_heights(at, Path(self.file).parent, self.msl, self.problems) if at is not None else None
        ), relief or 0.0

    def _layers(self) -> tuple[float, ...]:
        if "layers" not in self.keys:
            return (60.0, 75.0, 90.0)
        node = self.keys["layers"].value
        items = read_listing(node, self.problems, "layers")
        found = [read_quantity(item, self.problems, "layers", "distance") for item in items or ()]
        if items is not None and not items:
            self.problems.add("E044", node.mark, "'layers' is an empty list", "such as: [60 m, 75 m]")
        for item, layer in zip(items or (), found, strict=True):
            if layer is not None and (layer <= 0 or found.count(layer) > 1):
                self.problems.add("E008", item.mark, "layers are different heights above 0 m")
        known = [(layer, item.mark) for item, layer in zip(items or (), found, strict=True) if layer is not None]
        self.written.layers = known
        return tuple(layer for layer, _ in known)

    def _distance(self, key: str, default: float) -> float:
        value = read_quantity(self.keys[key].value, self.problems, key, "distance") if key in self.keys else None
        if value is not None and value <= 0:
            self.problems.add("E062", self.keys[key].value.mark, f"'{key}' must be above 0 m")
        return default if value is None else value

    def _agents(self) -> dict[str, SiteAgent]:
        found: dict[str, SiteAgent] = {}
        ports = [e.key.text for e in self._entries("ports")]
        homes: dict[str, str] = {}
        for entry in self._entries("agents"):
            name = entry.key.text
            mapping = read_mapping(entry.value, self.problems, name)
            keys = read_keys(mapping, AGENT, self.problems, f"agent '{name}'") if mapping is not None else {}
            of = read_text(keys["type"].value, self.problems, "type") if "type" in keys else None
            home = read_text(keys["home"].value, self.problems, "home") if "home" in keys else None
            if home is not None:
                self._check_home(home, ports, homes)
                homes.setdefault(home.text, name)
            if of is not None:
                self._check_type(of, home)
                found[name] = SiteAgent(name, of.text, home.text if home is not None else "")
        return found

    def _check_type(self, of: Scalar, home: Scalar | None) -> None:
        """Report a type that the catalogue does not have, and a home of one that needs none."""
        types = self.catalogue.types if self.catalogue is not None else {of.text: None}
        if of.text not in types:
            meant = surely(of.text, types)
            what = f"no agent type is called '{shorten(of.text)}'{did_you_mean(of.text, types)}"
            self.problems.add("E020", of.mark, what, f"types: {quoted_list(types)}", fix_word(of, meant))
            return
        known = types[of.text]
        if known is not None and known.rest == "grounded_at_port" and home is None:
            what = f"an agent of type {of.text} needs a home of its own"
            self.problems.add("E008", of.mark, what, "add home: with one of ports:")

    def _check_home(self, at: Scalar, ports: Sequence[str], homes: Mapping[str, str]) -> None:
        if at.text not in ports:
            meant = surely(at.text, ports)
            what = f"no port is called '{shorten(at.text)}'{did_you_mean(at.text, ports)}"
            self.problems.add("E010", at.mark, what, f"ports: {quoted_list(ports)}", fix_word(at, meant))
        elif at.text in homes:
            what = f"port '{at.text}' is the home of {homes[at.text]} already"
            self.problems.add("E018", at.mark, what, "a port holds one drone; give each its own")

    def _people(self, agents: Mapping[str, SiteAgent]) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for entry in self._entries("people"):
            people = read_words(entry.value, self.problems, entry.key.text)
            for at in people:
                if agents and at.text not in agents and entry.key.text != APPROVERS:
                    what = f"no agent is called '{shorten(at.text)}'{did_you_mean(at.text, agents)}"
                    meant = surely(at.text, agents)
                    self.problems.add("E010", at.mark, what, f"agents: {quoted_list(agents)}", fix_word(at, meant))
            found[entry.key.text] = tuple(at.text for at in people)
        return found


def _digest(text: str, more: str) -> str:
    """Return what a site is told apart by: its file's text and, if it names one, its height file."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass") + more.encode()).hexdigest()


def plain(node: Node) -> Any:
    """Return a node as dicts, lists and texts: settings that another layer reads."""
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, Listing):
        return [plain(item) for item in node.items]
    return {entry.key.text: plain(entry.value) for entry in node.entries}
