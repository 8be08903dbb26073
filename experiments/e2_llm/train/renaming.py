"""Other names for agent types, actions, their fields and subtrees: one to one, the same wherever they stand."""

import random
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from formiga_bt.llm.vocabulary import AgentVerb

VERBS: Final[Mapping[str, tuple[str, ...]]] = {
    "FlyTo": ("GoOver", "MoveAbove", "HoverAt", "Reach"),
    "FlyAlong": ("Follow", "TraceWay", "VisitAll", "GoAlong"),
    "FlyAndLand": ("LandAt", "TouchDown", "GoAndLand", "Deliver"),
    "ReturnHome": ("GoHome", "BackToPort", "ComeBack", "Recall"),
    "TakeOff": ("Launch", "Rise", "LiftOff"),
    "GoTo": ("StraightTo", "Leg", "MoveTo"),
    "LandIn": ("Descend", "SetDown", "DropDown"),
    "Explore": ("Survey", "Scan", "Search"),
    "MiniFinder": ("Tracker", "Locate", "Beacon"),
}
FIELDS: Final[Mapping[str, tuple[str, ...]]] = {
    "to": ("target", "goal", "spot", "where"),
    "height": ("up", "level", "h"),
    "way": ("route", "path", "points"),
    "at": ("place", "pad", "where_to"),
    "altitude": ("alt", "ceiling", "elevation"),
    "speed": ("velocity", "pace"),
    "region": ("area", "zone"),
    "base": ("origin", "start"),
}
OF_ALL: Final = 0.35
"""This share of the practices keeps the shipped names."""
_CAMEL: Final = re.compile(r"\b[A-Z][a-z]+(?:[A-Z][a-z]+)*\b")
_HOLE: Final = re.compile(r"\$\{([^}]*)\}")
_NAME: Final = re.compile(r"(?<![\w.])[a-z_]\w*(?!\w|\()")


@dataclass(frozen=True, slots=True)
class Renaming:
    """Old name -> new name. `kinds`: type -> (name, label)."""

    kinds: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    verbs: Mapping[str, str] = field(default_factory=dict)
    fields: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def drawn(cls, rng: random.Random, kinds: Mapping[str, tuple[str, str]]) -> "Renaming":
        """Return a renaming of some of the verbs and fields, or of none."""
        if rng.random() < OF_ALL:
            return cls(kinds)
        verbs = {old: rng.choice(new) for old, new in VERBS.items() if rng.random() < 0.75}
        fields = {old: rng.choice(new) for old, new in FIELDS.items() if rng.random() < 0.6}
        return cls(kinds, verbs, fields)

    def types_only(self) -> "Renaming":
        """Return the renaming of agent types alone."""
        return Renaming(self.kinds)

    def inverse(self) -> "Renaming":
        """Return what takes it back, but for agent types."""
        return Renaming({}, {v: k for k, v in self.verbs.items()}, {v: k for k, v in self.fields.items()})

    def text(self, text: str) -> str:
        """Return a text with the new names of verbs."""
        return _CAMEL.sub(lambda m: self.verbs.get(m[0], m[0]), text)

    def tree(self, data: Any) -> Any:
        """Return a tree in the short form with the new names of verbs and fields; what stands in values stays."""
        if isinstance(data, list):
            return [self.tree(one) for one in data]
        if not isinstance(data, Mapping):
            return data
        if "do" not in data:
            return {key: self.tree(value) for key, value in data.items()}
        own = ("do", "agent", "save_as")
        found = {key if key in own else self.fields.get(key, key): value for key, value in data.items()}
        return found | {"do": self.verbs.get(data["do"], data["do"])}


def catalogue_of(renaming: Renaming, base: Mapping[str, Any]) -> dict[str, Any]:
    """Return the shipped catalogue with other names."""
    names = {key: one[0] for key, one in renaming.kinds.items()}
    types = {}
    for name, one in base["types"].items():
        new = dict(one)
        if name in renaming.kinds:
            new["label"] = renaming.kinds[name][1]
        for key in ("recover", "fetch", "land"):
            if key in new:
                file, _, subtree = new[key].partition("#")
                new[key] = f"{file}#{renaming.verbs.get(subtree, subtree)}"
        if "actions" in new:
            new["actions"] = [renaming.verbs.get(action, action) for action in new["actions"]]
        types[names.get(name, name)] = new
    actions = {}
    for name, one in base["actions"].items():
        new = dict(one)
        if "fields" in new and name != "Confirm":
            new["fields"] = {renaming.fields.get(key, key): value for key, value in new["fields"].items()}
        if "moves_to" in new:
            new["moves_to"] = renaming.fields.get(new["moves_to"], new["moves_to"])
        actions[renaming.verbs.get(name, name)] = new
    return {**base, "types": types, "actions": actions}


def library_of(renaming: Renaming, library: Mapping[str, Any]) -> dict[str, Any]:
    """Return a library with other names of subtrees, of their params, and of the actions in it."""
    subtrees = {}
    for name, one in library["subtrees"].items():
        own = {key: renaming.fields[key] for key in one.get("params", {}) if key in renaming.fields}
        new = {key: _within(value, renaming, own) for key, value in one.items()}
        if "params" in one:
            new["params"] = {own.get(key, key): value for key, value in one["params"].items()}
        subtrees[renaming.verbs.get(name, name)] = new
    return {**library, "subtrees": subtrees}


def _within(data: Any, renaming: Renaming, own: Mapping[str, str]) -> Any:
    if isinstance(data, str):
        return _HOLE.sub(lambda m: "${" + _NAME.sub(lambda n: own.get(n[0], n[0]), m[1]) + "}", data)
    if isinstance(data, list):
        return [_within(one, renaming, own) for one in data]
    if not isinstance(data, Mapping):
        return data
    found = {}
    for key, value in data.items():
        if key == "do" and isinstance(value, str):
            agent, _, action = value.partition(".")
            found[key] = f"{agent}.{renaming.verbs.get(action, action)}"
        elif key == "call":
            found[key] = renaming.verbs.get(value, value)
        elif key == "with" and isinstance(value, Mapping):
            found[key] = {renaming.fields.get(k, k): _within(v, renaming, own) for k, v in value.items()}
        elif key in ("when", "check", "if", "guard", "expect", "until", "break_if") and isinstance(value, str):
            found[key] = _NAME.sub(lambda n: own.get(n[0], n[0]), value)
        else:
            found[key] = _within(value, renaming, own)
    return found


def verbs_renamed(verbs: Mapping[str, AgentVerb], renaming: Renaming) -> dict[str, AgentVerb]:
    """Return a vocabulary with other names."""
    return {
        renaming.verbs.get(name, name): replace(
            verb,
            name=renaming.verbs.get(name, name),
            fields={renaming.fields.get(key, key): type_ for key, type_ in verb.fields.items()},
            required=tuple(renaming.fields.get(key, key) for key in verb.required),
        )
        for name, verb in verbs.items()
    }
