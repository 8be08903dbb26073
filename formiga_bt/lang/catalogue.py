"""Catalogue files (`actions/*.yaml`): agent types and actions, merged from all files and checked.

A type gets what it extends merged in; its `recover`, `fetch` and `land` subtrees are read with the library's own checks.
Called by the command line, the engine's front and tests, once per start.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import micros
from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.base.machines import MACHINES
from formiga_bt.base.packaged import folder
from formiga_bt.base.units import parse_quantity
from formiga_bt.lang.actions import read_action, read_optional_mapping, read_results
from formiga_bt.lang.expr.scope import AGENT_FIELDS
from formiga_bt.lang.files import Shelf, read_file
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import ENVELOPE, Option
from formiga_bt.lang.mobility import EVERY_REST, check_mobility
from formiga_bt.lang.model import ActionSpec, AgentType, Catalogue, Subtree
from formiga_bt.lang.own_records import read_records
from formiga_bt.lang.site.envelope import read_envelope, read_on_breach
from formiga_bt.lang.subtrees import Subtrees
from formiga_bt.lang.text.document import Entry, Node, Scalar, parse_file
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    plain,
    quoted_list,
    read_flag,
    read_mapping,
    read_name,
    read_number,
    read_quantity,
    read_text,
    read_word,
    read_words,
    why_unreadable,
)
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import Type
from formiga_bt.lang.world import World

FILE: Final = (
    Option("types", "map", "Agent types by name."),
    Option("actions", "map", "Actions by name."),
    Option("records", "map", "Records by name: types of fields and results, in tasks too."),
)

TYPE: Final = (
    Option("extends", "name", "The type whose keys it takes over."),
    Option("label", "text", "What people call it."),
    Option("actions", "words", "What it can do, besides what it takes over."),
    Option("mobility", "word", "How it moves; needed of what is no person.", values=MACHINES),
    Option("rest", "word", "Where it belongs when idle.", values=EVERY_REST),
    Option("recover", "name", "FILE#Subtree that brings it home; one param, an agent."),
    Option("fetch", "name", "FILE#Subtree that brings it home from the ground elsewhere; one param, an agent."),
    Option("land", "name", "FILE#Subtree that lands it at a place; two params, an agent and a place."),
    Option("human", "flag", "A person; shared unless said otherwise."),
    Option("shared", "flag", "Several tasks may address it."),
    Option("limits", "map", "Numbers that simulators and estimates use."),
    Option("envelope", "options", "Limits that no flight may break.", keys=ENVELOPE),
    Option("on_breach", "map", "What follows a breach of a limit: return or hold."),
    Option("events", "map", "What it reports of itself, apart from any goal: event -> {field: type}."),
    Option("fields", "map", "What its statuses say besides: name -> type, read as role.name."),
    Option("suspect_after", "value", "Silence after which it is not allocated.", type="duration"),
    Option("lost_after", "value", "Silence after which it is lost.", type="duration"),
)

_SUFFIX: Final[Mapping[str, str]] = {
    "speed": "m_s",
    "distance": "m",
    "percent": "pct",
    "mass": "kg",
    "duration": "s",
    "angle": "deg",
}


RESERVED_FIELDS: Final = frozenset({"landed", "pool", "task", "action", "liveness", "layer_m", "payload_kg", "member"})
"""What the engine itself notes of each agent: no field of a type's own is called so."""

_WAYS: Final[Mapping[str, tuple[str, ...]]] = {
    "recover": ("agent",),
    "fetch": ("agent",),
    "land": ("agent", "place"),
}
"""Keys of a type that name a subtree, and the types of its params."""

_SUCH_AS: Final[Mapping[str, str]] = {
    "recover": "lib/flying.yaml#ReturnHome",
    "fetch": "lib/flying.yaml#FetchHome",
    "land": "lib/flying.yaml#LandNear",
}


def load_catalogue(
    files: Sequence[Path],
    library: Sequence[Path] | None = None,
    *,
    read: Callable[[Path], str] = read_file,
    libraries: Sequence[Path] = (),
) -> tuple[Catalogue, list[Diagnostic], dict[str, str]]:
    """Read catalogue files.

    Args:
        files: in order; a name may be defined again only with the same words.
        library: the folders where the types' subtrees are looked up; None = the packaged trees.
        read: gives the text of a file.
        libraries: the folders of the site's own libraries.

    Returns:
        The catalogue (of what could be read), all problems in file order, and the text of each file read.
    """
    reader = _CatalogueReader((folder("trees"),) if library is None else library, read, libraries)
    for path in files:
        reader.read_file(path)
    catalogue = reader.finish()
    return catalogue, in_order(reader.problems.found), dict(reader.shelf.sources)


class _CatalogueReader:
    """Gathers the entries of all files, then resolves `extends` and the subtrees that types name."""

    def __init__(self, library: Sequence[Path], read: Callable[[Path], str], libraries: Sequence[Path]) -> None:
        self.problems = Problems()
        self.shelf = Shelf(library, self.problems, read, libraries)
        self._read = read
        self._texts: list[str] = []
        self._types: dict[str, Entry] = {}
        self._actions: dict[str, Entry] = {}
        self._records: dict[str, Type] = {}
        self._given: dict[str, Keys] = {}

    def read_file(self, path: Path) -> None:
        """Parse one file and note its entries."""
        file = str(path)
        try:
            text = self._read(path)
        except (OSError, UnicodeDecodeError) as error:
            self.problems.add("E008", Mark(file, 1, 1), f"the file cannot be read: {why_unreadable(error)}")
            return
        self.shelf.sources[file] = text
        self._texts.append(text)
        node, found = parse_file(text, file)
        self.problems.extend(found)
        root = read_mapping(node, self.problems, "file") if node is not None else None
        if root is None:
            return
        keys = read_keys(root, FILE, self.problems, "a catalogue")
        if "records" in keys:
            self._records.update(read_records(keys["records"].value, self.problems, self._records))
        for key, into in (("types", self._types), ("actions", self._actions)):
            mapping = read_mapping(keys[key].value, self.problems, key) if key in keys else None
            for entry in mapping.entries if mapping is not None else ():
                self._note(entry, into)

    def _note(self, entry: Entry, into: dict[str, Entry]) -> None:
        name = entry.key.text
        if read_name(entry.key, self.problems, "name") is None:
            return
        first = into.setdefault(name, entry)
        if first is not entry and plain(first.value) != plain(entry.value):
            what = f"'{name}' is defined at {first.key.mark} already, and differs here"
            help_ = "keep one of them, give one another name, or use one of the two catalogues"
            self.problems.add("E018", entry.key.mark, what, help_)

    def finish(self) -> Catalogue:
        """Build the catalogue."""
        actions = {
            name: action
            for name, entry in self._actions.items()
            if (action := read_action(entry, self.problems, self._records)) is not None
        }
        for name, entry in self._types.items():
            mapping = read_optional_mapping(entry.value, self.problems, name)
            if mapping is not None:
                self._given[name] = read_keys(mapping, TYPE, self.problems, f"type '{name}'")
        types = {name: self._type(name, actions) for name in self._given}
        catalogue = Catalogue(types, actions, self._digest(""), records=self._records)
        ways = self._ways(catalogue)
        types = {
            name: replace(
                one,
                recover=ways.get(("recover", one.recover_ref)),
                fetch=ways.get(("fetch", one.fetch_ref)),
                land=ways.get(("land", one.land_ref)),
            )
            for name, one in types.items()
        }
        digest = self._digest("".join(self.shelf.sources[file] for file in self.shelf.units))
        return Catalogue(types, actions, digest, self.shelf.own, self._records)

    def _digest(self, more: str) -> str:
        digest = hashlib.sha256()
        for text in (*self._texts, more):
            data = text.encode("utf-8", "surrogatepass")
            digest.update(str(len(data)).encode() + b":" + data)
        return digest.hexdigest()

    # --- types -------------------------------------------------------------------------------------------------

    def _ancestors(self, name: str) -> list[str]:
        """Return what a type extends, nearest first; report unknown names and circles."""
        found: list[str] = []
        at = self._extended(name)
        while at is not None:
            if at.text not in self._given:
                known = [other for other in self._given if other != name]
                what = f"no agent type is called '{at.text}'{did_you_mean(at.text, known)}"
                self.problems.add(
                    "E020", at.mark, what, f"types: {quoted_list(known)}", fix_word(at, surely(at.text, known))
                )
                break
            if at.text == name or at.text in found:
                self.problems.add("E051", at.mark, f"'{name}' extends itself", "break the circle")
                break
            found.append(at.text)
            at = self._extended(at.text)
        return found

    def _extended(self, name: str) -> Scalar | None:
        entry = self._given[name].get("extends")
        return entry.value if entry is not None and isinstance(entry.value, Scalar) else None

    def _type(self, name: str, actions: Mapping[str, ActionSpec]) -> AgentType:
        ancestors = self._ancestors(name)
        merged = AgentType(name, self._types[name].key.mark)
        for one in reversed(ancestors):
            merged = self._with_keys(merged, self._given[one], actions, report=False)
        said = merged.mobility if any({"mobility", "human"} & set(self._given[one]) for one in ancestors) else ""
        merged = replace(merged, label="")
        own = self._given[name]
        merged = self._with_keys(merged, own, actions, report=True)
        check_mobility(merged, own, said, actions, self._types[name], self.problems)
        return replace(merged, extends=tuple(ancestors), label=merged.label or name)

    def _with_keys(self, base: AgentType, keys: Keys, actions: Mapping[str, ActionSpec], *, report: bool) -> AgentType:
        """Return `base` with the keys of one mapping laid over it; an ancestor's problems are its own."""
        problems = self.problems if report else Problems()
        new: dict[str, Any] = {}
        if "label" in keys:
            at = read_text(keys["label"].value, problems, "label")
            new["label"] = at.text if at is not None else ""
        if "actions" in keys:
            own = self._known_actions(keys["actions"].value, actions, problems)
            new["actions"] = tuple(dict.fromkeys((*base.actions, *own)))
        if "events" in keys:
            new["events"] = {**base.events, **_events(keys["events"].value, problems, self._records)}
        if "fields" in keys:
            new["fields"] = {**base.fields, **_fields(keys["fields"].value, problems)}
        if "rest" in keys:
            new["rest"] = read_word(keys["rest"].value, problems, "rest", EVERY_REST)
        if "mobility" in keys:
            word = read_word(keys["mobility"].value, problems, "mobility", MACHINES)
            new["mobility"] = next((one for one in MACHINES if one == word), base.mobility)
        for key in _WAYS:
            at = read_text(keys[key].value, problems, key) if key in keys else None
            if key in keys:
                new[f"{key}_ref"] = at.text if at is not None else ""
        if "human" in keys and read_flag(keys["human"].value, problems, "human"):
            new["mobility"], new["shared"] = "people", True
        if "shared" in keys:
            new["shared"] = read_flag(keys["shared"].value, problems, "shared")
        for key in ("suspect_after", "lost_after"):
            seconds = read_quantity(keys[key].value, problems, key, "duration") if key in keys else None
            if seconds is not None:
                new[key + "_us"] = micros(seconds)
        if "on_breach" in keys:
            new["on_breach"] = {**base.on_breach, **read_on_breach(keys["on_breach"].value, problems)}
        new["limits"] = {**base.limits, **_limits(keys, problems), **_envelope(keys, problems)}
        return replace(base, **new)

    def _known_actions(self, node: Node, actions: Mapping[str, ActionSpec], problems: Problems) -> list[str]:
        found = []
        for at in read_words(node, problems, "actions"):
            if at.text in actions:
                found.append(at.text)
                continue
            meant = surely(at.text, actions)
            what = f"no action is called '{at.text}'{did_you_mean(at.text, actions)}"
            problems.add("E021", at.mark, what, f"actions: {quoted_list(actions)}", fix_word(at, meant))
        return found

    def _ways(self, catalogue: Catalogue) -> dict[tuple[str, str], Subtree]:
        """Read each subtree that a type names under `recover`, `fetch` or `land`, once."""
        found: dict[tuple[str, str], Subtree] = {}
        subtrees = Subtrees(World(catalogue, None), self.problems)
        for keys in self._given.values():
            for key in _WAYS:
                at = keys[key].value if key in keys else None
                if not isinstance(at, Scalar) or (key, at.text) in found:
                    continue
                subtree = self._way(key, at, subtrees)
                if subtree is not None:
                    found[key, at.text] = subtree
        return found

    def _way(self, key: str, at: Scalar, subtrees: Subtrees) -> Subtree | None:
        file, _, name = at.text.partition("#")
        path = self.shelf.locate(file, Path(at.mark.file).parent) if name else None
        if path is None:
            help_ = f"such as: {_SUCH_AS[key]}"
            what = f"no file '{file}' for {key}" if name else f"'{key}' must be FILE#Subtree"
            self.problems.add("E050", at.mark, what, help_)
            return None
        label = self.shelf.label(path)
        unit = self.shelf.units.get(label)
        if unit is None:
            unit = self.shelf.open_text(self._read(path), label, path.parent, library=True)
        callee = subtrees.read_one(unit, name)
        if name not in unit.own:
            what = f"{file} has no subtree '{name}'{did_you_mean(name, unit.own)}"
            self.problems.add("E050", at.mark, what, f"subtrees: {quoted_list(unit.own)}")
            return None
        if callee is None:
            return None
        has = sorted(param.type.name for param in callee.subtree.params.values())
        if has != sorted(_WAYS[key]):
            need = "one param, an agent" if len(_WAYS[key]) == 1 else "two params, an agent and a place"
            self.problems.add("E050", at.mark, f"a {key} subtree has {need}; {name} has others")
            return None
        return callee.subtree


def _envelope(keys: dict[str, Entry], problems: Problems) -> dict[str, float]:
    """Return the numbers of an envelope by their names among the limits."""
    limits = read_envelope(keys["envelope"].value, problems) if "envelope" in keys else {}
    return {limit.key: limit.value for limit in limits.values()}


def _limits(keys: dict[str, Entry], problems: Problems) -> dict[str, float]:
    """Return numbers by name with the SI unit in it: `speed: 8 m/s` is `speed_m_s`; bare numbers keep theirs."""
    mapping = read_mapping(keys["limits"].value, problems, "limits") if "limits" in keys else None
    found: dict[str, float] = {}
    for entry in mapping.entries if mapping is not None else ():
        name, node = entry.key.text, entry.value
        quantity = parse_quantity(node.text) if isinstance(node, Scalar) else None
        if quantity is not None:
            found[f"{name}_{_SUFFIX[quantity[0]]}"] = float(quantity[1])
            continue
        number = read_number(node, problems, name)
        if number is not None:
            found[name] = number
    return found


def _fields(node: Node, problems: Problems) -> dict[str, Type]:
    """Return the types of what the statuses of a type say besides."""
    found = read_results(node, problems, "fields")
    mapping = read_mapping(node, Problems(), "fields")
    for entry in mapping.entries if mapping is not None else ():
        name = entry.key.text
        if name in AGENT_FIELDS or name in RESERVED_FIELDS:
            problems.add("E018", entry.key.mark, f"'{name}' is a field of every agent", "choose another name")
            found.pop(name, None)
    return found


def _events(node: Node, problems: Problems, records: Mapping[str, Type]) -> dict[str, Mapping[str, Type]]:
    """Return what a type tells of itself: events and the types of their fields."""
    mapping = read_mapping(node, problems, "events")
    found: dict[str, Mapping[str, Type]] = {}
    for entry in mapping.entries if mapping is not None else ():
        name = read_name(entry.key, problems, "events")
        if name is not None:
            found[name.text] = read_results(entry.value, problems, name.text, records)
            if "at" in found[name.text]:
                problems.add("E018", entry.value.mark, "'at' is when an event came; call the field something else")
    return found
