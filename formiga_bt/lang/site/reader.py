"""The keys of a site file read into a `Site`: its points by `points`, all else here."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

from formiga_bt.endpoints import open_to_others
from formiga_bt.heights import HeightGrid
from formiga_bt.lang.document import Entry, Scalar
from formiga_bt.lang.envelope import check_site, read_envelope, read_on_breach
from formiga_bt.lang.ground import load_heights
from formiga_bt.lang.model import Port, Site, SiteAgent
from formiga_bt.lang.model.world import MOST_RESUME_HOLD_AFTER_US, RESUME_HOLD_AFTER_US
from formiga_bt.lang.reading import (
    did_you_mean,
    fix_word,
    plain,
    quoted_list,
    read_flag,
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
)
from formiga_bt.lang.site.keys import AGENT, APPROVERS, PILOT, PORT, TERRAIN, ZENOH
from formiga_bt.lang.site.points import Points
from formiga_bt.lang.site.whole import check_whole, machines
from formiga_bt.lang.synonyms import nearest, surely


class SiteReader(Points):
    """Reads the keys of one site file."""

    def read(self, text: str) -> Site:
        """Build the site; where something is wrong it has been reported and is left out."""
        self._version()
        name = self.keys["name"].value if "name" in self.keys else None
        at = read_name(name, self.problems, "name") if name is not None else None
        ports = {e.key.text: port for e in self.entries("ports") if (port := self._port(e)) is not None}
        agents = self._agents()
        pilots = self._pilots()
        heights, relief = self._terrain()
        mode: Literal["simulation", "real"] = "real" if self._mode(pilots) == "real" else "simulation"
        site = Site(
            at.text if at is not None else "",
            self.lat,
            self.lng,
            self.msl,
            timezone=self._timezone(),
            ports=ports,
            places={
                one: place for one, entry in self.named.items() if (place := self.place_named(one, entry)) is not None
            },
            regions={
                e.key.text: region for e in self.entries("regions") if (region := self.region(e.value)) is not None
            },
            fence=self._fence(),
            no_fly=self._no_fly(),
            relief_m=relief,
            heights=heights,
            layers_m=self._layers(),
            separation_m=self._distance("separation", 15.0),
            min_spacing_m=self._distance("min_spacing", 3.0),
            resume_hold_after_us=self._resume_hold_after(),
            envelope=self._envelope(),
            on_breach=read_on_breach(self.keys["on_breach"].value, self.problems) if "on_breach" in self.keys else {},
            preflight=self._word("preflight", ("required", "shown")) == "required",
            pilots=pilots,
            people=self._people(agents),
            agents=agents,
            transports=self._transports(mode),
            mode=mode,
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

    def _transports(self, mode: str) -> dict[str, Any]:
        entries = self.entries("transports")
        for entry in entries:
            if entry.key.text == "zenoh":
                self._check_zenoh(entry, mode)
        return {entry.key.text: plain(entry.value) for entry in entries}

    def _check_zenoh(self, entry: Entry, mode: str) -> None:
        mapping = read_mapping(entry.value, self.problems, "zenoh")
        keys = read_keys(mapping, ZENOH, self.problems, "zenoh") if mapping is not None else {}
        insecure = "insecure" in keys and read_flag(keys["insecure"].value, self.problems, "insecure")
        if insecure and mode == "real":
            what = "'insecure' is for simulations: whoever reaches the wire can command every machine"
            self.problems.add("E008", keys["insecure"].key.mark, what, "remove it, and listen at tcp/127.0.0.1:PORT")
        at = read_text(keys["listen"].value, self.problems, "listen") if "listen" in keys else None
        why, help_ = open_to_others(at.text, mode, insecure=insecure) if at is not None else ("", "")
        if at is not None and why:
            self.problems.add("E008", at.mark, why, help_)

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

    def _version(self) -> None:
        entry = self.keys.get("formiga_site")
        at = read_text(entry.value, self.problems, "formiga_site") if entry is not None else None
        if at is not None and at.text != "1":
            self.problems.add("E007", at.mark, f"this site needs version {shorten(at.text)}, this program knows 1")

    def _port(self, entry: Entry) -> Port | None:
        name = entry.key.text
        mapping = read_mapping(entry.value, self.problems, name)
        keys = read_keys(mapping, PORT, self.problems, f"port '{name}'") if mapping is not None else {}
        at = self.point(keys["at"].value, "at") if "at" in keys else None
        waiting = self.point(keys["waiting"].value, "waiting", height=True) if "waiting" in keys else None
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

    def _resume_hold_after(self) -> int:
        key = "resume_hold_after"
        seconds = read_quantity(self.keys[key].value, self.problems, key, "duration") if key in self.keys else None
        if seconds is None:
            return RESUME_HOLD_AFTER_US
        after = round(seconds * 1_000_000)
        if not 0 <= after <= MOST_RESUME_HOLD_AFTER_US:
            what = f"'{key}' must be 0 s to {MOST_RESUME_HOLD_AFTER_US // 60_000_000} min"
            help_ = "machines that nobody watched for longer must not go on by themselves; 30 s if nothing is said"
            self.problems.add("E062", self.keys[key].value.mark, what, help_)
            return RESUME_HOLD_AFTER_US
        return after

    def _agents(self) -> dict[str, SiteAgent]:
        found: dict[str, SiteAgent] = {}
        ports = [e.key.text for e in self.entries("ports")]
        homes: dict[str, str] = {}
        for entry in self.entries("agents"):
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
