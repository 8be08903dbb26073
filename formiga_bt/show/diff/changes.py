"""What changed between two tasks: the door of this room. Formatting, comments and the order of keys are no change.

A step that stands where it stood, with something put around it, has not moved: only what it is inside of is added. Of several
steps that changed their order, the fewest are said to have moved.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.lang.model import Task
from formiga_bt.show.diff.matching import Matching, rising
from formiga_bt.show.diff.outline import OutlineNode, outline
from formiga_bt.show.diff.renames import Rename, find_renames, with_names
from formiga_bt.show.facts import FileSpot

What = Literal["added", "removed", "moved", "changed", "renamed"]
ORDER: tuple[What, ...] = ("changed", "renamed", "moved", "added", "removed")


class FieldChange(Struct, frozen=True):
    """A field that is not what it was; "" = it was not there, or is no more."""

    field: str
    before: str
    after: str

    def in_words(self, arrow: str = "->") -> str:
        """Return `height: 60 m -> 80 m`, `timeout added: 15 min` or `timeout removed: 15 min`."""
        if not self.before:
            return f"{self.field} added: {self.after}" if self.after not in ("", "true") else f"{self.field} added"
        if not self.after:
            return f"{self.field} removed: {self.before}" if self.before != "true" else f"{self.field} removed"
        return f"{self.field}: {self.before} {arrow} {self.after}"


class Change(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that changed."""

    what: What
    kind: str
    """A step kind, or `task`, `param`, `var`, `role`, `subtree`, `branch`; of a renamed name also `saved`, `loop`."""
    title: str
    path: str = ""
    """In the new task; of what was removed, in the old one."""
    from_path: str = ""
    """Where it was, of what moved."""
    from_title: str = ""
    """What it was in."""
    to_title: str = ""
    """What it is in."""
    steps: int = 0
    """So many steps came or went with it, itself included."""
    fields: tuple[FieldChange, ...] = ()
    before: FileSpot | None = None
    after: FileSpot | None = None


@dataclass(frozen=True, slots=True)
class Difference:
    """Two tasks compared: what changed, and both trees with who is who."""

    changes: tuple[Change, ...]
    old: OutlineNode
    new: OutlineNode
    matching: Matching
    of: Mapping[OutlineNode, tuple[Change, ...]]
    """Node of the new tree, or a removed one of the old -> its changes."""

    @property
    def counts(self) -> dict[str, int]:
        """Return how many changes there are of each sort."""
        found = Counter(change.what for change in self.changes)
        return {what: found[what] for what in ORDER if found[what]}

    def in_words(self) -> str:
        """Return `3 changed, 1 moved, 2 added`."""
        return ", ".join(f"{n} {what}" for what, n in self.counts.items()) or "no change"


def compare(old: Task, new: Task, old_texts: Mapping[str, str], new_texts: Mapping[str, str]) -> Difference:
    """Compare two checked tasks.

    Args:
        old: the task as it was.
        new: as it is.
        old_texts: of the files of the old task.
        new_texts: of the new one.
    """
    before, after = outline(old, old_texts), outline(new, new_texts)
    renames, names = find_renames(before, after)
    with_names(before, names)
    return _Reader(before, after, renames).read()


class _Reader:
    def __init__(self, old: OutlineNode, new: OutlineNode, renames: list[Rename]) -> None:
        self.old, self.new, self.renames = old, new, renames
        self.matching = Matching(old, new)
        self.moved = self._moved()
        self.found: list[Change] = []
        self.of: dict[OutlineNode, tuple[Change, ...]] = {}

    def read(self) -> Difference:
        for node in self.new.below():
            self._of_new(node)
        for node in self.old.below():
            parent = self.matching.parent[node]
            if node in self.matching.to_new or (parent is not None and parent not in self.matching.to_new):
                continue
            if not self._is_of_library(node, self.old):
                self._say(node, self._came_or_went("removed", node))
        self._say_renames()
        return Difference(tuple(self.found), self.old, self.new, self.matching, self.of)

    def _is_of_library(self, node: OutlineNode, root: OutlineNode) -> bool:
        """Return whether it is an imported subtree: it came or went with the call of it, which is told."""
        return node.kind == "subtree" and node.mark.file != root.mark.file

    def _say(self, node: OutlineNode, change: Change) -> None:
        self.found.append(change)
        self.of[node] = (*self.of.get(node, ()), change)

    def _of_new(self, node: OutlineNode) -> None:
        was = self.matching.to_old.get(node)
        if was is None:
            parent = self.matching.parent[node]
            if (parent is None or parent in self.matching.to_old) and not self._is_of_library(node, self.new):
                self._say(node, self._came_or_went("added", node))
            return
        plain = Change(
            what="moved", kind=node.kind, title=title(node), path=node.path, before=_spot(was), after=_spot(node)
        )
        if node in self.moved:
            inside, outside = self._around(was, self.old), self._around(node, self.new)
            self._say(node, replace(plain, from_path=was.path, from_title=inside, to_title=outside))
        fields = _fields(was, node)
        if fields:
            self._say(node, replace(plain, what="changed", fields=fields))

    def _came_or_went(self, what: Literal["added", "removed"], node: OutlineNode) -> Change:
        pairs = self.matching.to_old if what == "added" else self.matching.to_new
        steps = sum(1 for one in node.below() if one.is_step and one not in pairs)
        change = Change(what=what, kind=node.kind, title=title(node), path=node.path, steps=steps)
        return replace(change, after=_spot(node)) if what == "added" else replace(change, before=_spot(node))

    def _say_renames(self) -> None:
        defined = {
            (node.scope if node.kind != "subtree" else "", node.kind, node.sub): node for node in self.new.below()
        }
        for one in self.renames:
            node = defined.get((one.scope, one.kind, one.new)) or self._first_naming(one)
            was = self.matching.to_old.get(node) if node is not None else None
            change = Change(
                what="renamed",
                kind=one.kind,
                title=one.new,
                path=node.path if node is not None else "",
                fields=(FieldChange("name", one.old, one.new),),
                before=_spot(was) if was is not None else None,
                after=_spot(node) if node is not None else None,
            )
            if node is None:
                self.found.append(change)
            else:
                self._say(node, change)

    def _first_naming(self, rename: Rename) -> OutlineNode | None:
        atom = ("name", rename.new)
        for node in self.new.below():
            if node.scope == rename.scope and node.is_step and any(atom in v.atoms for v in node.fields.values()):
                return node
        return None

    # -- what moved ----------------------------------------------------------------------------------------------------
    def _moved(self) -> set[OutlineNode]:
        """Return the nodes of the new tree that are not where they were."""
        found: set[OutlineNode] = set()
        to_new = self.matching.to_new
        for node in self.old.below():
            there = to_new.get(node)
            if there is None:
                continue
            inside = self._kept_inside(there, self.matching.to_old)
            place = {child: at for at, child in enumerate(inside)}
            both = [to_new[child] for child in self._kept_inside(node, to_new) if to_new[child] in place]
            still = {both[at] for at in rising([place[one] for one in both], [self.matching.size[one] for one in both])}
            found |= {child for child in inside if child not in still}
        return found

    def _kept_inside(self, node: OutlineNode, pairs: Mapping[OutlineNode, OutlineNode]) -> list[OutlineNode]:
        """Return the steps inside a node that the other tree has too, through what it has not."""
        kept = []
        for child in node.children:
            if child in pairs:
                kept += [child] if child.is_step else []
            else:
                kept += self._kept_inside(child, pairs)
        return kept

    def _around(self, node: OutlineNode, root: OutlineNode) -> str:
        parent = self.matching.parent[node]
        if parent is None or parent is root:
            return ""
        if parent.kind == "branch":
            around = self.matching.parent[parent]
            return f"{parent.sub} of {title(around)}" if around is not None else parent.sub
        if parent.kind == "group" and parent.scope:
            return f"subtree {parent.scope}"
        return title(parent)


def title(node: OutlineNode) -> str:
    """Return a few words for a node: `drone.TakeOff`, `wait 5 s`, `role escort`."""
    named = node.fields.get("name")
    if node.is_step and named is not None:
        return named.words
    if node.kind in ("do", "wait_for"):
        return f"{node.fields['agent'].words}.{node.sub}" if node.kind == "do" else f"wait for {node.sub}"
    if node.is_step:
        first = next(iter(node.fields.items()), None)
        if first is None or first[0].split()[0] != node.kind:
            return node.kind
        return f"{first[0]} {'in ' if node.kind == 'for' else '= ' if node.kind == 'set' else ''}{first[1].words}"
    return node.sub if node.kind in ("group", "task") else f"{node.kind} {node.sub}"


def _spot(node: OutlineNode) -> FileSpot:
    return FileSpot(node.mark.file, node.mark.line, node.mark.col)


def _fields(was: OutlineNode, node: OutlineNode) -> tuple[FieldChange, ...]:
    found = []
    for key in [*node.fields, *(key for key in was.fields if key not in node.fields)]:
        before, after = was.fields.get(key), node.fields.get(key)
        if before is None or after is None or before.atoms != after.atoms:
            if key == "order" and (before is None or after is None or sorted(before.atoms) != sorted(after.atoms)):
                continue
            found.append(FieldChange(key, before.words if before else "", after.words if after else ""))
    return tuple(found)
