"""The verbs that a model may use, from the live catalogue: actions of the agent types, and subtrees of the libraries.

Both are one kind of step for a model: `{"do": VERB, "agent": ROLE, ...}`. Which of them is an action and which a call of a
library's subtree is our business (`short`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.packaged import folder
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.text.document import Mapping_, Scalar, parse
from formiga_bt.llm.world import RequestWorld

LIBRARIES: Final = ("lib/flying.yaml", "lib/ways.yaml")
"""Of those that ship: what is offered."""
HELP: Final[Mapping[str, str]] = {
    "FlyTo": "fly to a place, hover over it",
    "FlyAlong": "fly along a list of places: round a place, in a zigzag, along a line",
    "FlyAndLand": "fly to a place, land there",
    "ReturnHome": "fly to its own port and land",
}
"""The subtrees of the shipped libraries that are offered; the others are for the engine, or say the same."""
COVERED: Final[Mapping[str, tuple[str, ...]]] = {
    "TakeOff": ("FlyTo", "FlyAndLand", "ReturnHome"),
    "GoTo": ("FlyTo",),
    "LandIn": ("FlyAndLand",),
}
"""Action -> the subtrees that leave it nothing to do in the short form."""
PLAIN: Final = ("number", "int", "text", "bool", "percent", "distance", "duration", "speed", "angle", "mass", "time")


@dataclass(frozen=True, slots=True)
class AgentVerb:
    """Something that one agent can do."""

    name: str
    fields: Mapping[str, str]
    """Name -> type, as people write it; without the agent."""
    required: tuple[str, ...]
    help: str
    types: tuple[str, ...] = ()
    """Agent types that can do it; () = every machine."""
    library: str = ""
    """The file that must be imported; "" = it is an action."""
    role: str = ""
    """Of a subtree: the name of its agent param."""


def verbs_of(world: RequestWorld) -> dict[str, AgentVerb]:
    """Return the verbs by name: subtrees first, for they do more."""
    found: dict[str, AgentVerb] = {}
    for library in LIBRARIES:
        for folder_ in world.library or (folder("trees"),):
            if (folder_ / library).is_file():
                found |= {v.name: v for v in _subtrees(folder_ / library, library) if v.name in HELP}
                break
    libraries = [(own, path) for own in world.library for path in sorted(own.glob("lib/*.yaml"))]
    libraries += [(own, path) for own in world.catalogue.libraries for path in sorted(own.rglob("*.yaml"))]
    for own, path in libraries:
        name = path.relative_to(own).as_posix()
        if name not in LIBRARIES:
            found |= {v.name: v for v in _subtrees(path, name)}
    return found | _actions(world.catalogue)


def offered(verbs: Mapping[str, AgentVerb]) -> dict[str, AgentVerb]:
    """Return the verbs without the bare actions that a subtree does better: `TakeOff`, if `FlyTo` takes off by itself."""
    covered = {name for name, better in COVERED.items() if set(better) <= set(verbs)}
    return {name: verb for name, verb in verbs.items() if name not in covered}


def _actions(catalogue: Catalogue) -> dict[str, AgentVerb]:
    found = {}
    for name, spec in catalogue.actions.items():
        types = tuple(t.name for t in catalogue.types.values() if name in t.actions)
        if spec.cuts or name == CONFIRM or not types:
            continue
        must = tuple(n for n, f in spec.fields.items() if not f.optional and f.default is None)
        fields = {n: str(f.type) for n, f in spec.fields.items()}
        machines = {t.name for t in catalogue.types.values() if not t.human}
        every = machines <= set(types)
        said = spec.help[:1].lower() + spec.help[1:].rstrip(".")
        found[name] = AgentVerb(name, fields, must, said, () if every else types)
    return found


def _subtrees(path: Path, library: str) -> list[AgentVerb]:
    """Return the subtrees of a library that have an agent for their first param; the others are no verbs of an agent."""
    node, _ = parse(path.read_text(encoding="utf-8"), str(path))
    entry = node.get("subtrees") if isinstance(node, Mapping_) else None
    bodies = entry.value.entries if entry is not None and isinstance(entry.value, Mapping_) else ()
    found = []
    for one in bodies:
        params = one.value.get("params") if isinstance(one.value, Mapping_) else None
        if params is None or not isinstance(params.value, Mapping_):
            continue
        fields, optional, role = {}, set(), ""
        for param in params.value.entries:
            type_ = _type_text(param.value)
            if type_ == "agent" and not role:
                role = param.key.text
                continue
            fields[param.key.text] = type_
            if isinstance(param.value, Mapping_) and (param.value.get("default") or param.value.get("optional")):
                optional.add(param.key.text)
        if role:
            must = tuple(name for name in fields if name not in optional)
            name = one.key.text
            found.append(AgentVerb(name, fields, must, HELP.get(name, ""), (), library, role))
    return found


def _type_text(node: object) -> str:
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, Mapping_):
        listed = node.get("list")
        if listed is not None and isinstance(listed.value, Scalar):
            return f"list of {listed.value.text}"
        inner = node.get("type")
        if inner is not None:
            return _type_text(inner.value)
    return "any"
