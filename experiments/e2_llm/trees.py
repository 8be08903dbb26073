"""The JSON form of a task as the trees and tokens that measures compare.

All of it reads the form of `formiga_bt.lang.json_form.words`, in which every key belongs to the language and names of the
author are values. `null` means "not given" and is passed over.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.lang.kinds import KINDS, MODIFIERS, PARAM, ROLE, SUBTREE, TASK

KEYWORDS: Final = frozenset(
    {"action", "agent", "name", "value", "expr", "lit", "text", "list"}
    | set(KINDS)
    | {option.name for options in (TASK, PARAM, ROLE, SUBTREE, MODIFIERS) for option in options}
    | {option.name for kind in KINDS.values() for option in kind.options}
)
"""Keys of the language: what CodeBLEU calls keywords."""
PROSE: Final = frozenset({"description", "help", "label", "formiga", "task", "version", "aliases", "plan"})
"""Keys whose values say nothing of what a task does; measures pass over them."""
_TOKEN: Final = re.compile(r"[A-Za-z_]\w*|\d+(?:\.\d+)?|'[^']*'|[<>=!]=|\S")


def bare(data: Any) -> Any:
    """Return a task without prose and without what is not given."""
    if isinstance(data, Mapping):
        return {key: bare(value) for key, value in data.items() if value is not None and key not in PROSE}
    if isinstance(data, list):
        return [bare(one) for one in data]
    return data


def tokens(data: Any) -> list[str]:
    """Return a task's tokens in order: keys, brackets of lists, and the words of values."""
    return list(_tokens(bare(data)))


def _tokens(data: Any) -> Iterator[str]:
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield key
            yield from _tokens(value)
    elif isinstance(data, list):
        yield "["
        for one in data:
            yield from _tokens(one)
        yield "]"
    else:
        yield from _TOKEN.findall(data if isinstance(data, str) else str(data).lower())


def shapes(data: Any) -> list[str]:
    """Return every sub-tree of a task as text: its keys and lists, without the leaves (values, names)."""
    found: list[str] = []
    _shape(bare(data), found)
    return found


def _shape(data: Any, found: list[str]) -> str:
    if isinstance(data, Mapping):
        text = "{" + " ".join(f"{key}:{_shape(value, found)}" for key, value in sorted(data.items())) + "}"
    elif isinstance(data, list):
        text = "[" + " ".join(_shape(one, found) for one in data) + "]"
    else:
        return "_"
    found.append(text)
    return text


def flows(data: Any) -> list[tuple[str, str, str]]:
    """Return where each name of the author is used: (`step.key`, "uses", name) and (name, "from", name).

    Names are `v0`, `v1`, ... in the order in which they are first defined or used.
    """
    walk = _Flows(set(_defined(data)))
    walk.of(bare(data), "task", "")
    return walk.found


_DEFINING: Final = frozenset({"params", "vars", "agents", "with_agents", "for", "set", "subtrees"})


def _defined(data: Any, under: str = "") -> Iterator[str]:
    if isinstance(data, Mapping):
        if under in _DEFINING and isinstance(data.get("name"), str):
            yield data["name"]
        if isinstance(data.get("save_as"), str):
            yield data["save_as"]
        for key, value in data.items():
            yield from _defined(value, key)
    elif isinstance(data, list):
        for one in data:
            yield from _defined(one, under)


class _Flows:
    def __init__(self, names: set[str]) -> None:
        self.names = names
        self.found: list[tuple[str, str, str]] = []
        self._numbers: dict[str, str] = {}

    def of(self, data: Any, slot: str, target: str) -> None:
        """Take a part of a task: `slot` says where it stands, `target` which name gets its value."""
        if isinstance(data, Mapping):
            kind = str(data.get("action") or next((key for key in data if key in KINDS), slot.rpartition(".")[2]))
            if slot in _DEFINING and isinstance(data.get("name"), str):
                target, kind = data["name"], slot
                self._number(target)
            if isinstance(data.get("save_as"), str):
                self.found.append((self._number(data["save_as"]), "from", kind))
            for key, value in data.items():
                if key not in ("name", "save_as", "action"):
                    inner = (
                        key
                        if key in _DEFINING
                        else f"{kind}.{key}"
                        if key not in ("expr", "lit", "text", "list")
                        else slot
                    )
                    self.of(value, inner, target)
        elif isinstance(data, list):
            for one in data:
                self.of(one, slot, target)
        elif isinstance(data, str):
            for word in re.findall(r"[A-Za-z_]\w*", data):
                if word in self.names and word != target:
                    source = self._number(word)
                    self.found.append((self._number(target), "from", source) if target else (slot, "uses", source))

    def _number(self, name: str) -> str:
        return self._numbers.setdefault(name, f"v{len(self._numbers)}")


class Branch:
    """A step with the steps in it, for distances between trees."""

    def __init__(self, label: str, children: "list[Branch]") -> None:
        self.label, self.children = label, children

    @property
    def size(self) -> int:
        """Return how many steps it is."""
        return 1 + sum(one.size for one in self.children)


def steps_of(data: Any) -> Branch:
    """Return a task's steps as a tree of kinds and actions; a `call` has the name of what it calls."""
    return Branch("task", _steps(bare(data)))


def _steps(data: Any) -> list[Branch]:
    if isinstance(data, list):
        return [one for item in data for one in _steps(item)]
    if not isinstance(data, Mapping):
        return []
    inner = [one for key, value in data.items() if key not in ("params", "agents", "vars") for one in _steps(value)]
    if "action" in data:
        return [Branch(str(data["action"]), inner)]
    kind = next((key for key in data if key in KINDS), None)
    if kind is None:
        return inner
    return [Branch(f"call {data[kind]}" if kind == "call" else kind, inner)]
