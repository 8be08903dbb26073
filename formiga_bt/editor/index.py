"""Where each name of a file is defined and used, also inside expressions, and the outline of its steps.

Built from the nodes of a well-formed document, once per version of its text. References, rename, definitions and the outline
read it. Lines and columns are 0-based, as editors count them.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, Literal

from formiga_bt.base.diagnostics import Mark
from formiga_bt.editor.grammar import (
    FileKind,
    FreeMapping,
    GrammarWalk,
    OptionValue,
    Slot,
    Steps,
    kind_of,
    scalar_behind,
)
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.tokens import Token, rough_tokens
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar

SUBTREES: Final = "#subtrees"
"""The space of the names of subtrees; any other space is a body: "" = the task, else the subtree of that name."""

_ORIGINS: Final[Mapping[str, str]] = {"params": "param", "vars": "var", "agents": "role", "for": "loop name"}
_SAVES: Final = ("save_as", "collect", "first")
_NAMED_AGENTS: Final = (("release", "release"), ("clears", "role"))
_ROLE: Final = re.compile(r"\s*([A-Za-z]\w*)")


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A name at a place: where it is defined (`origin` says as what), or used (`origin` is empty)."""

    space: str
    name: str
    line: int
    start: int
    end: int
    origin: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """Return what all occurrences of one name share."""
        return self.space, self.name


@dataclass(frozen=True, slots=True)
class Symbol:
    """An entry of the outline: a section, a step, a name that is defined."""

    name: str
    detail: str
    what: Literal["section", "step", "param", "role", "var", "subtree", "entry"]
    mark: Mark
    """Of the whole."""
    at: Mark
    """Of the name."""
    children: tuple["Symbol", ...] = ()


@dataclass(slots=True)
class FileIndex:
    """The names of one version of a file, and its outline."""

    occurrences: list[Occurrence] = field(default_factory=list)
    root: Node | None = None
    kind: FileKind = "task"

    def at(self, line: int, col: int) -> Occurrence | None:
        """Return the name at a position; its end counts."""
        return next((o for o in self.occurrences if o.line == line and o.start <= col <= o.end), None)

    def all_of(self, key: tuple[str, str]) -> list[Occurrence]:
        """Return each place of a name."""
        return [one for one in self.occurrences if one.key == key]

    def definition(self, key: tuple[str, str]) -> Occurrence | None:
        """Return the first place that defines a name."""
        return next((one for one in self.occurrences if one.key == key and one.origin), None)

    def symbols(self) -> tuple[Symbol, ...]:
        """Return the outline."""
        return _Outline(self.kind).root(self.root)

    def subtrees(self) -> dict[str, Entry]:
        """Return the subtrees that the file defines."""
        entry = self.root.get("subtrees") if isinstance(self.root, Mapping_) else None
        return {e.key.text: e for e in entry.value.entries} if entry and isinstance(entry.value, Mapping_) else {}


def build(root: Node | None, lines: Sequence[str], kind: FileKind) -> FileIndex:
    """Return the index of a document.

    Args:
        root: its nodes.
        lines: of the very text that the nodes were read from.
        kind: what the file is.
    """
    index = FileIndex([], root, kind)
    if root is not None:
        _Reader(index, lines).node(root, GrammarWalk(kind), at_root=True)
    return index


@lru_cache(4096)
def named_tokens(text: str) -> tuple[Token, ...]:
    """Return the names of an expression that stand for values: no fields, helpers, keywords of calls, units or words."""
    tokens = rough_tokens(text)
    found = []
    for before, token, after in zip([None, *tokens], tokens, [*tokens[1:], None], strict=False):
        if token.kind != "name" or (before is not None and before.text == "."):
            continue
        if after is None or after.text not in ("(", "="):
            found.append(token)
    return tuple(found)


class _Reader:
    """Walks a document and notes its names."""

    def __init__(self, index: FileIndex, lines: Sequence[str]) -> None:
        self.index = index
        self.lines = lines

    def node(self, node: Node, walk: GrammarWalk, *, at_root: bool = False) -> None:
        if isinstance(node, Listing):
            walk.into_list()
            for item in node.items:
                self.node(item, walk.fork())
        elif isinstance(node, Mapping_):
            walk.into_map({e.key.text: e.value.text if isinstance(e.value, Scalar) else "" for e in node.entries})
            for entry in node.entries:
                self.key(entry, walk)
                inner = walk.fork()
                inner.behind(entry.key.text, at_root=at_root)
                self.node(entry.value, inner)
        else:
            self.scalar(node, walk.slot)

    # --- keys ---------------------------------------------------------------------------------------------------

    def key(self, entry: Entry, walk: GrammarWalk) -> None:
        schema, slot = walk.slot.schema, walk.slot
        if walk.is_step or not isinstance(schema, FreeMapping):
            return
        if schema.what in _ORIGINS:
            self.note(slot.body, entry.key, _ORIGINS[schema.what])
        elif schema.what == "subtrees":
            self.note(SUBTREES, entry.key, "subtree")
        elif schema.what == "set":
            self.note(slot.body, entry.key)
        elif schema.what == "with" and "call" in slot.step:
            self.note(slot.step["call"], entry.key)

    def note(self, space: str, at: Scalar, origin: str = "") -> None:
        """Note a scalar that is a name."""
        mark = at.mark
        if mark.line == mark.end_line:
            start = mark.col - 1 + at.quoted
            found = Occurrence(space, at.text, mark.line - 1, start, start + len(at.text), origin)
            self.index.occurrences.append(found)

    # --- values -------------------------------------------------------------------------------------------------

    def scalar(self, at: Scalar, slot: Slot) -> None:
        schema = scalar_behind(slot.schema)
        option = schema.option if isinstance(schema, OptionValue) else None
        if option is None:
            self.texts(at, slot, whole=False)
            return
        match option.form:
            case "cond" | "expr":
                self.texts(at, slot, whole=True)
            case "action":
                self.role(at, slot)
            case "roles":
                self.note(slot.body, at)
            case "name" | "word" | "words" | "flag":
                self.name(at, slot, option)
            case _:
                self.texts(at, slot, whole=False)

    def name(self, at: Scalar, slot: Slot, option: Option) -> None:
        if option.name in _SAVES:
            self.note(slot.body, at, "saved")
        elif option.name == "call" and "call" in slot.step:
            self.note(SUBTREES, at)
        elif option.name == "wait_for":
            self.role(at, slot)
        elif any(owner in slot.step and option.name == key for owner, key in _NAMED_AGENTS):
            self.note(slot.body, at)

    def role(self, at: Scalar, slot: Slot) -> None:
        """Note the role before the dot of `role.Action`."""
        found = _ROLE.match(at.text)
        if found is not None and at.exact:
            self._add(slot.body, found[1], at, self.raw(at), found.start(1) + at.quoted)

    def texts(self, at: Scalar, slot: Slot, *, whole: bool) -> None:
        """Note the names in an expression, or in each `${...}` of a text."""
        if not whole and "${" not in at.text:
            return
        raw = self.raw(at)
        spans = [(0, len(raw))]
        if not whole:
            found = holes(raw)
            spans = [(start + 2, end - 1) for start, end in found] if not isinstance(found, int) else []
        first = 1 if whole and at.quoted else 0
        for start, end in spans:
            for token in named_tokens(raw[start + first : end - first]):
                self._add(slot.body, token.text, at, raw, start + first + token.start)

    def raw(self, at: Scalar) -> str:
        """Return the source of a scalar, its quotes included."""
        mark = at.mark
        if mark.line == mark.end_line:
            return self.lines[mark.line - 1][mark.col - 1 : mark.end_col - 1]
        rows = list(self.lines[mark.line - 1 : mark.end_line])
        if len(rows) == mark.end_line - mark.line + 1:
            rows[-1] = rows[-1][: mark.end_col - 1]
        rows[0] = rows[0][mark.col - 1 :]
        return "\n".join(rows)

    def _add(self, space: str, name: str, at: Scalar, raw: str, offset: int) -> None:
        before = raw[:offset]
        rows = before.count("\n")
        col = offset - (before.rfind("\n") + 1) + (at.mark.col - 1 if rows == 0 else 0)
        self.index.occurrences.append(Occurrence(space, name, at.mark.line - 1 + rows, col, col + len(name)))


class _Outline:
    """Makes the outline of a document."""

    def __init__(self, kind: FileKind) -> None:
        self.kind = kind

    def root(self, node: Node | None) -> tuple[Symbol, ...]:
        if not isinstance(node, Mapping_):
            return ()
        found = []
        for entry in node.entries:
            walk = GrammarWalk(self.kind)
            walk.into_map({})
            walk.behind(entry.key.text, at_root=True)
            text = entry.value.text if isinstance(entry.value, Scalar) else ""
            found.append(self._entry(entry, "section", text, self._inside(entry.value, walk)))
        return tuple(found)

    def _entry(
        self, entry: Entry, what: Literal["section", "subtree", "param", "role", "var", "entry"], detail: str,
        children: tuple[Symbol, ...]
    ) -> Symbol:  # fmt: skip
        key, value = entry.key.mark, entry.value.mark
        last = max((key.end_line, key.end_col), (value.end_line, value.end_col))
        return Symbol(entry.key.text, detail, what, Mark(key.file, key.line, key.col, *last), key, children)

    def _inside(self, node: Node, walk: GrammarWalk) -> tuple[Symbol, ...]:
        schema = walk.slot.schema
        if isinstance(schema, Steps) and isinstance(node, Listing):
            return tuple(self._step(item) for item in node.items if isinstance(item, Mapping_) and item.entries)
        if isinstance(schema, FreeMapping) and isinstance(node, Mapping_):
            return tuple(self._named(entry, schema, walk) for entry in node.entries)
        return ()

    def _named(self, entry: Entry, schema: FreeMapping, walk: GrammarWalk) -> Symbol:
        inner = walk.fork()
        inner.into_map({})
        inner.behind(entry.key.text)
        value = entry.value
        detail = value.text if isinstance(value, Scalar) else ""
        children: tuple[Symbol, ...] = ()
        if isinstance(value, Mapping_):
            of = value.get("type")
            detail = of.value.text if of is not None and isinstance(of.value, Scalar) else ""
            for one in value.entries:
                deeper = inner.fork()
                deeper.into_map({})
                deeper.behind(one.key.text)
                children += self._inside(one.value, deeper)
        elif isinstance(inner.slot.schema, Steps):
            children = self._inside(value, inner)
        what: Literal["subtree", "param", "role", "var", "entry"] = "entry"
        if schema.what in ("subtrees", "params", "agents", "vars"):
            what = {"subtrees": "subtree", "params": "param", "agents": "role", "vars": "var"}[schema.what]  # type: ignore[assignment]
        return self._entry(entry, what, detail, children)

    def _step(self, node: Mapping_) -> Symbol:
        keys = {e.key.text: e.value.text if isinstance(e.value, Scalar) else "" for e in node.entries}
        kind = kind_of(keys)
        word = kind.name if kind is not None else node.entries[0].key.text
        at = next(entry for entry in node.entries if entry.key.text == word)
        value = " ".join(keys[word].split())
        title = keys.get("name") or (f"{word}: {value}" if value else word)
        children: tuple[Symbol, ...] = ()
        for entry in node.entries:
            if isinstance(entry.value, Scalar):
                continue
            walk = GrammarWalk(self.kind)
            walk.slot = Slot(Steps())
            walk.into_list()
            walk.into_map(keys)
            walk.behind(entry.key.text)
            inside = self._inside(entry.value, walk) if entry.key.text not in ("with", "set", "for") else ()
            if inside and entry.key.text in ("else", "finally", "default"):
                inside = (self._entry(entry, "entry", "", inside),)
            children += inside
        return Symbol(
            title[:80], f"{word}: {value}"[:80] if keys.get("name") else "", "step", node.mark, at.key.mark, children
        )
