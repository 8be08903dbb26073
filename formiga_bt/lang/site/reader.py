"""The keys of a site file read into a `Site`: its points by `points`, all else here."""

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

from msgspec.structs import replace

from formiga_bt.base.geo import Place
from formiga_bt.base.heights import HeightGrid
from formiga_bt.lang.covered import covered_by_site
from formiga_bt.lang.keyed import Keys, check_version, read_inside
from formiga_bt.lang.model import AgentType, Catalogue, Port, Resource, Site, SiteAgent, Station
from formiga_bt.lang.model.world import MOST_RESUME_HOLD_AFTER_US
from formiga_bt.lang.rules.keys import FOLDER as RULES
from formiga_bt.lang.shipped import types_help
from formiga_bt.lang.site.catalogues import check_named
from formiga_bt.lang.site.envelope import check_site, read_envelope, read_on_breach
from formiga_bt.lang.site.ground import load_heights
from formiga_bt.lang.site.keys import AGENT, ALLOCATOR, APPROVERS, PILOT, PORT, RESOURCE, STATION, TERRAIN
from formiga_bt.lang.site.libraries import check_libraries
from formiga_bt.lang.site.news import read_news
from formiga_bt.lang.site.points import Points
from formiga_bt.lang.site.routes import read_routes
from formiga_bt.lang.site.whole import check_whole, machines
from formiga_bt.lang.site.wires import read_transports
from formiga_bt.lang.site.zone import read_timezone
from formiga_bt.lang.text.document import Entry, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_mapping,
    read_quantity,
    read_text,
    read_word,
    read_words,
    shorten,
)
from formiga_bt.lang.text.synonyms import surely


class SiteReader(Points):
    """Reads the keys of one site file."""

    def __init__(
        self,
        problems: Problems,
        keys: Keys,
        catalogue: Catalogue | None,
        file: str,
        read: Callable[[Path], str],
        *,
        on_disk: bool = True,
    ) -> None:
        super().__init__(problems, keys, catalogue, file)
        self._on_disk = on_disk
        self._read = read
        self.sources: dict[str, str] = {}
        """Texts of the files of its rules, by name, once it is read."""

    def read(self, text: str) -> Site:
        """Build the site; where something is wrong it has been reported and is left out."""
        check_version(self.keys, "formiga_site", "this site needs")
        for key, check in (("actions", check_named), ("libraries", check_libraries)):
            if key in self.keys:
                words = read_words(self.keys[key].value, self.problems, key)
                check(words, self.file, self.problems, on_disk=self._on_disk)
        ports = {e.key.text: port for e in self.entries("ports") if (port := self._port(e)) is not None}
        stations = {e.key.text: one for e in self.entries("stations") if (one := self._station(e)) is not None}
        resources = {e.key.text: self._resource(e) for e in self.entries("resources")}
        agents = self._agents(resources)
        pilots = self._pilots()
        heights, relief = self._terrain()
        self.written.no_fly, self.written.no_go = self._shut("no_fly"), self._shut("no_go")
        mode: Literal["simulation", "real"] = "real" if self._mode(pilots) == "real" else "simulation"
        transports, accept_missing = read_transports(self.keys, self.problems, mode)
        site = Site(
            self.keys.word("name"),
            self.lat,
            self.lng,
            self.msl,
            timezone=read_timezone(self.keys),
            ports=ports,
            places={
                one: place for one, entry in self.named.items() if (place := self.place_named(one, entry)) is not None
            },
            regions={one: region for one, node in self.outlines.items() if (region := self.region(node)) is not None},
            resources=resources,
            fence=self._fence(),
            no_fly=tuple(region for region, _ in self.written.no_fly),
            no_go=tuple(region for region, _ in self.written.no_go),
            stations=stations,
            routes=read_routes(self, stations),
            relief_m=relief,
            heights=heights,
            layers_m=self._layers(),
            separation_m=self.keys.number("separation"),
            min_spacing_m=self.keys.number("min_spacing"),
            resume_hold_after_us=self._resume_hold_after(),
            envelope=self._envelope(),
            on_breach=read_on_breach(self.keys["on_breach"].value, self.problems) if "on_breach" in self.keys else {},
            policy=self._policy(),
            preflight=self.keys.word("preflight") == "required",
            pilots=pilots,
            people=self._people(agents),
            agents=agents,
            news=read_news(self.keys, self.problems),
            transports=transports,
            accept_missing=accept_missing,
            mode=mode,
            file=self.file,
            digest=_digest(text, heights.digest if heights is not None else ""),
        )
        if not self.problems.has_errors():
            self._check(site)
            site = self._with_rules(site)
        return replace(site, covered=covered_by_site(site))

    def _with_rules(self, site: Site) -> Site:
        """Return the site with its standing rules; without a catalogue nothing can be said of them."""
        beside = Path(self.file).parent / RULES
        if self.catalogue is None or not ("rules" in self.keys or beside.is_dir()):
            return site
        from formiga_bt.lang.rules.reading import Rules  # it reads tasks, which know what a site is

        rules = Rules(site, self.catalogue, self.problems, self._read)
        found, digest = rules.all(self.entries("rules"))
        self.sources.update(rules.sources)
        return replace(site, rules=found, rules_digest=digest)

    def _check(self, site: Site) -> None:
        types = machines(site, self.catalogue.types) if self.catalogue is not None else []
        check_site(self.written.limits, types, self.problems)
        check_whole(site, self.written, types, self.problems)

    def _mode(self, pilots: Mapping[str, int]) -> str:
        mode = self.keys.word("mode")
        if mode == "real" and not pilots and "pilots" not in self.keys:
            what = "mode real needs pilots: each machine flies under the eyes of one"
            self.keys.wrong("mode", "E008", what, "such as: pilots: [{id: anna, max_airborne: 3}]")
        return mode

    def _policy(self) -> Literal["closest", "optimal"]:
        keys = self.keys.inside("allocator", ALLOCATOR, "the allocator")
        return "optimal" if keys.word("policy") == "optimal" else "closest"

    def _envelope(self) -> dict[str, float]:
        if "envelope" in self.keys:
            self.written.limits = read_envelope(self.keys["envelope"].value, self.problems)
        return {limit.key: limit.value for limit in self.written.limits.values()}

    def _pilots(self) -> dict[str, int]:
        found: dict[str, int] = {}
        for item in self.keys.listed("pilots", such_as="such as: [{id: anna, max_airborne: 3}]"):
            keys = read_inside(item, PILOT, self.problems, "pilots", "a pilot")
            at, most = keys.name("id"), keys.whole("max_airborne")
            if at is not None and at.text in found:
                self.problems.add("E018", at.mark, f"the pilot '{at.text}' is listed twice", "keep one of them")
            elif at is not None:
                found[at.text] = most
        return found

    def _port(self, entry: Entry) -> Port | None:
        name = entry.key.text
        keys = read_inside(entry.value, PORT, self.problems, name, f"port '{name}'")
        at = self.point(keys["at"].value, "at") if "at" in keys else None
        waiting = self.point(keys["waiting"].value, "waiting", height=True) if "waiting" in keys else None
        if at is None:
            return None
        self.written.ports[name] = keys.mark("at")
        if waiting is not None:
            self.written.waiting[name] = keys.mark("waiting")
        return Port(name, at, waiting)

    def _station(self, entry: Entry) -> Station | None:
        name = entry.key.text
        keys = read_inside(entry.value, STATION, self.problems, name, f"station '{name}'")
        at = self.point(keys["at"].value, "at") if "at" in keys else None
        heading = keys.number("heading") if "heading" in keys else None
        kinds = read_words(keys["kinds"].value, self.problems, "kinds") if "kinds" in keys else ()
        for kind in kinds:
            known = self._type(kind)
            if known is not None and known.mobility != "ground":
                what = f"'{known.name}' does not drive: its mobility is {known.mobility}"
                self.problems.add("E103", kind.mark, what, "stations are of ground machines; take it out")
        if not isinstance(at, Place):
            return None
        self.written.stations[name] = keys.mark("at")
        return Station(name, at, heading, keys.flag("charges"), tuple(kind.text for kind in kinds))

    def _terrain(self) -> tuple[HeightGrid | None, float]:
        """Return the heights of the ground (None = flat) and how far the ground may be off, metres."""
        keys = self.keys.inside("terrain", TERRAIN, "terrain")
        relief, at = keys.number("relief"), keys.text("file")
        if "flat" in keys and "file" in keys:
            self.problems.add("E008", keys["flat"].key.mark, "terrain is flat or in a file, not both", "remove one")
        elif "flat" in keys:
            read_word(keys["flat"].value, self.problems, "flat", ("true",))
        elif at is not None:
            self.written.terrain = keys.mark("file")
            return load_heights(at, Path(self.file).parent, self.msl, self.problems), relief
        return None, relief

    def _layers(self) -> tuple[float, ...]:
        if "layers" not in self.keys:
            return (60.0, 75.0, 90.0)
        items = self.keys.listed("layers", such_as="such as: [60 m, 75 m]")
        found = [read_quantity(item, self.problems, "layers", "distance") for item in items]
        for item, layer in zip(items, found, strict=True):
            if layer is not None and (layer <= 0 or found.count(layer) > 1):
                self.problems.add("E008", item.mark, "layers are different heights above 0 m")
        known = [(layer, item.mark) for item, layer in zip(items, found, strict=True) if layer is not None]
        self.written.layers = known
        return tuple(layer for layer, _ in known)

    def _resume_hold_after(self) -> int:
        key = "resume_hold_after"
        after = round(self.keys.number(key) * 1_000_000)
        if not 0 <= after <= MOST_RESUME_HOLD_AFTER_US:
            what = f"'{key}' must be 0 s to {MOST_RESUME_HOLD_AFTER_US // 60_000_000} min"
            help_ = "machines that nobody watched for longer must not go on by themselves; 30 s if nothing is said"
            self.keys.wrong(key, "E062", what, help_)
        return after

    def _resource(self, entry: Entry) -> Resource:
        name = entry.key.text
        if isinstance(entry.value, Scalar) and not entry.value.text:
            return Resource(name)  # `lift_1:` alone is one unit
        keys = read_inside(entry.value, RESOURCE, self.problems, name, f"resource '{name}'")
        region = self.region(keys["region"].value) if "region" in keys else None
        return Resource(name, keys.whole("capacity"), region)

    def _guards(self, entry: Entry, of: str, resources: Mapping[str, Resource]) -> dict[str, str]:
        """Read which actions of an agent begin only while a resource with a region is empty."""
        mapping = read_mapping(entry.value, self.problems, "guards")
        known = self.catalogue.types.get(of) if self.catalogue is not None else None
        found: dict[str, str] = {}
        for one in mapping.entries if mapping is not None else ():
            action, at = one.key, read_text(one.value, self.problems, one.key.text)
            if known is not None and action.text not in known.actions:
                meant = surely(action.text, known.actions)
                what = f"{of} has no action '{shorten(action.text)}'{did_you_mean(action.text, known.actions)}"
                help_ = f"actions: {quoted_list(known.actions)}"
                self.problems.add("E021", action.mark, what, help_, fix_word(action, meant))
            if at is None:
                continue
            resource = resources.get(at.text)
            if resource is None:
                meant = surely(at.text, resources)
                what = f"no resource is called '{shorten(at.text)}'{did_you_mean(at.text, resources)}"
                self.problems.add("E110", at.mark, what, f"resources: {quoted_list(resources)}", fix_word(at, meant))
            elif resource.region is None:
                what = f"'{at.text}' has no region: nobody can see whether a machine is in it"
                self.problems.add("E008", at.mark, what, f"give it one under resources: {at.text}: {{region: [..]}}")
            else:
                found[action.text] = at.text
        return found

    def _agents(self, resources: Mapping[str, Resource]) -> dict[str, SiteAgent]:
        found: dict[str, SiteAgent] = {}
        homes: dict[str, str] = {}
        for entry in self.entries("agents"):
            name = entry.key.text
            keys = read_inside(entry.value, AGENT, self.problems, name, f"agent '{name}'")
            of, home = keys.text("type"), keys.text("home")
            kind = self._type(of) if of is not None else None
            if home is not None:
                self._check_home(home, kind, homes)
                homes.setdefault(home.text, name)
            at = self.point(keys["at"].value, "at") if "at" in keys else None
            if at is not None:
                self.written.stands[name] = keys.mark("at")
            if of is not None and kind is not None:
                self._check_where(of, kind, keys)
            if of is not None:
                stands = at if isinstance(at, Place) else None
                guards = self._guards(keys["guards"], of.text, resources) if "guards" in keys else {}
                found[name] = SiteAgent(name, of.text, home.text if home is not None else "", stands, guards)
        return found

    def _type(self, of: Scalar) -> AgentType | None:
        """Return a type of the catalogue; None, and a report, if there is none."""
        if self.catalogue is None:
            return None
        types = self.catalogue.types
        if of.text not in types:
            meant = surely(of.text, types)
            what = f"no agent type is called '{shorten(of.text)}'{did_you_mean(of.text, types)}"
            self.problems.add("E020", of.mark, what, types_help(of, types), fix_word(of, meant))
        return types.get(of.text)

    def _check_where(self, of: Scalar, kind: AgentType, keys: Keys) -> None:
        """Report a machine whose place the site must say, and a place of one that has none."""
        if kind.flies and "home" not in keys:
            what = f"an agent of type {of.text} needs a home of its own"
            self.problems.add("E008", of.mark, what, "add home: with one of ports:")
        if kind.mobility == "fixed" and "at" not in keys:
            what = f"an agent of type {of.text} never moves: the site says where it stands"
            self.problems.add("E008", of.mark, what, "add at: with its place")
        if kind.mobility == "none" and "at" in keys:
            what = f"an agent of type {of.text} has no place: its mobility is none"
            self.problems.add("E103", keys["at"].key.mark, what, "take it out")

    def _check_home(self, at: Scalar, kind: AgentType | None, homes: Mapping[str, str]) -> None:
        ports, stations = ([e.key.text for e in self.entries(key)] for key in ("ports", "stations"))
        spots, called = (stations, "station") if kind is not None and kind.mobility == "ground" else (ports, "port")
        if kind is not None and kind.mobility in ("fixed", "none", "people"):
            what = f"an agent of type {kind.name} has no home: its mobility is {kind.mobility}"
            self.problems.add("E103", at.mark, what, "take it out")
        elif at.text not in spots:
            meant = surely(at.text, spots)
            what = f"no {called} is called '{shorten(at.text)}'{did_you_mean(at.text, spots)}"
            self.problems.add("E010", at.mark, what, f"{called}s: {quoted_list(spots)}", fix_word(at, meant))
        elif at.text in homes:
            what = f"{called} '{at.text}' is the home of {homes[at.text]} already"
            self.problems.add("E018", at.mark, what, f"a {called} holds one machine; give each its own")

    def _people(self, agents: Mapping[str, SiteAgent]) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for entry in self.entries("people"):
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
