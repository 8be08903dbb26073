"""YAML text to nodes with marks. Scalars stay text: the type that is expected reads them later (`no`, `on`, `12:30`).

The only module that imports `yaml`. Text is refused (E003) before a node is built if it holds anchors, aliases, tags or
documents, or is too deep, long or large, so that no bomb is ever composed. Syntax errors (E001) are explained
by `colons` and `traps`. Called by the loader for tasks, libraries, catalogues, sites and tests.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, Final

import yaml
from msgspec import Struct

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.lang.text.colons import colon_in_key, missing_colon
from formiga_bt.lang.text.traps import explain, explain_tag, forbidden_characters, hidden_text, lines_of

MAX_BYTES: Final = 1_000_000
MAX_NODES: Final = 20_000
MAX_DEPTH: Final = 64
_MOST_KEPT_CHARS: Final = 50_000
"""Longer texts are read anew each time."""


class Scalar(Struct, frozen=True):
    """A scalar as written. `mark` spans the token with its quotes; `block` means `|` or `>` style."""

    text: str
    mark: Mark
    quoted: bool = False
    block: bool = False
    exact: bool = True
    """Whether `text` is the source between the quotes, character by character (no escapes, folds or blocks)."""

    def mark_at(self, start: int, end: int) -> Mark:
        """Return the source span of `text[start:end]`; the whole scalar where the text is folded or escaped."""
        if not self.exact:
            return self.mark
        first = self.mark.col + (1 if self.quoted else 0)
        line, label = self.mark.line, self.mark.label
        return Mark(self.mark.file, line, first + start, line, first + max(end, start + 1), label)


class Entry(Struct, frozen=True):
    """One key of a mapping with its value."""

    key: Scalar
    value: "Node"


class Mapping_(Struct, frozen=True):  # noqa: N801 - `Mapping` is the standard library's word
    """A mapping; keys are unique, in file order."""

    entries: tuple[Entry, ...]
    mark: Mark

    def get(self, key: str) -> Entry | None:
        """Return the entry of a key, or None."""
        return next((entry for entry in self.entries if entry.key.text == key), None)


class Listing(Struct, frozen=True):
    """A YAML list."""

    items: tuple["Node", ...]
    mark: Mark


Node = Scalar | Mapping_ | Listing
"""A node of a document. Where nothing stands (`key:`), it is a `Scalar` with empty text."""


def parse(text: str, file: str, labels: Mapping[int, str] | None = None) -> tuple[Node | None, list[Diagnostic]]:
    """Read one YAML document.

    Args:
        text: of the file.
        file: its name in marks.
        labels: how messages call its lines, if not by number.

    Returns:
        The root node and the problems. The node is None if the text is empty, or cannot be read at all; with duplicate
        keys (E002) the first of them stays.
    """
    if len(text) > MAX_BYTES or len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        return None, [_refuse(Mark(file, 1, 1), "the file is larger than 1 MB", "split it into a library and tasks")]
    bad = forbidden_characters(text, file)
    if bad is not None:
        return None, [bad]
    source = text.removeprefix("\ufeff")
    try:
        events: list[Any] = []
        problem = _first_refusal(source, _kept(_events(source), events), file)
        if problem is not None:
            return None, [problem]
        return _Builder(source, file, events, labels or {}).build()
    except yaml.YAMLError as error:
        line, col, said = _place_of(error)
        if (
            "nesting depth" in said
        ):  # the library's own limit: it reads ahead, and may meet it before `MAX_DEPTH` is counted
            return None, [_refuse_depth(Mark(file, line, col))]
        colon = missing_colon(lines_of(source), file, line, said, _reads)
        return None, [colon or explain(source, file, line, col, said)]
    except _Slip as slip:
        return None, [slip.found]


def parse_file(text: str, file: str, labels: Mapping[int, str] | None = None) -> tuple[Node | None, list[Diagnostic]]:
    """Read one YAML document as `parse` does, or return what was read of the same text before: nodes never change.

    For texts of whole files, which the editor, drafts and the engine read again and again.
    """
    if labels or len(text) > _MOST_KEPT_CHARS:
        return parse(text, file, labels)
    node, found = _parsed(text, file)
    return node, list(found)


@lru_cache(maxsize=128)
def _parsed(text: str, file: str) -> tuple[Node | None, tuple[Diagnostic, ...]]:
    node, found = parse(text, file)
    return node, tuple(found)


class _Slip(Exception):  # noqa: N818 - it names what is wrong
    """What stands there can be read, but not as it was meant: nothing more is told of the text."""

    def __init__(self, found: Diagnostic) -> None:
        super().__init__(found.message)
        self.found = found


def _reads(source: str) -> int:
    """Return the line at which reading a text ends."""
    try:
        for _ in _events(source):
            pass
    except yaml.YAMLError as error:
        return _place_of(error)[0]
    return len(lines_of(source)) + 1


def _events(source: str) -> Iterator[Any]:
    return iter(yaml.parse(source, Loader=yaml.CSafeLoader))


def _kept(events: Iterator[Any], into: list[Any]) -> Iterator[Any]:
    """Iterate over events and keep them: reading a text twice takes twice as long."""
    for event in events:
        into.append(event)
        yield event


def _place_of(error: yaml.YAMLError) -> tuple[int, int, str]:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    said = str(getattr(error, "problem", None) or getattr(error, "reason", None) or "this is not YAML")
    return (mark.line + 1, mark.column + 1, said) if mark is not None else (1, 1, said)


def _refuse(mark: Mark, message: str, mend: str) -> Diagnostic:
    return Diagnostic("E003", mark, message, mend)


def _refuse_depth(mark: Mark) -> Diagnostic:
    return _refuse(mark, "nested more than 64 levels deep", "move inner steps into a subtree")


def _first_refusal(source: str, events: Iterator[Any], file: str) -> Diagnostic | None:
    """Walk the events without building anything; return the first construct that the language does not have."""
    depth = nodes = documents = 0
    for event in events:
        if type(event) is yaml.ScalarEvent and event.anchor is None and event.tag is None and nodes < MAX_NODES:
            nodes += 1  # nearly all of them
            continue
        if isinstance(event, yaml.AliasEvent):
            return _refuse(
                _mark(event, file), "anchors and aliases are not part of the language", "use vars: or a subtree"
            )
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                return _refuse(_mark(event, file), "a file holds one document", "remove the '---' or make two files")
            if event.tags:
                return _refuse_tag(
                    source, _mark(event, file), "tags are not part of the language", "remove the %TAG line"
                )
        if isinstance(event, yaml.NodeEvent):
            nodes += 1
            problem = _refuse_node(source, event, file)
            if problem is not None:
                return problem
            if nodes > MAX_NODES:
                return _refuse(
                    _mark(event, file), "more than 20,000 values in one file", "split it into a library and tasks"
                )
        if isinstance(event, (yaml.CollectionStartEvent, yaml.CollectionEndEvent)):
            depth += 1 if isinstance(event, yaml.CollectionStartEvent) else -1
            if depth > MAX_DEPTH:
                return _refuse_depth(_mark(event, file))
    return None


def _refuse_node(source: str, event: Any, file: str) -> Diagnostic | None:
    if event.anchor is not None:
        return _refuse(_mark(event, file), "anchors and aliases are not part of the language", "use vars: or a subtree")
    tag = getattr(event, "tag", None)
    if tag is None:
        return None
    if tag == "!" and isinstance(event, yaml.ScalarEvent):
        mend = "a YAML tag begins with '!'; for 'not' write: not ..."
    else:
        mend = f"remove {str(tag)!r}; in a condition write 'not' for '!'"
    said = "tags (words that begin with '!') are not part of the language"
    return _refuse_tag(source, _mark(event, file), said, mend)


def _refuse_tag(source: str, mark: Mark, message: str, mend: str) -> Diagnostic:
    """Refuse a tag, or the `!` that was meant as "not" in its line."""
    return explain_tag(source, mark.file, mark.line) or _refuse(mark, message, mend)


def _mark(event: Any, file: str) -> Mark:
    start, end = event.start_mark, event.end_mark
    return Mark(file, start.line + 1, start.column + 1, end.line + 1, end.column + 1)


class _Builder:
    """Turns the events of one document, known to be harmless, into nodes. Iteration depth is at most 64."""

    def __init__(self, source: str, file: str, events: list[Any], labels: Mapping[int, str]) -> None:
        self._file = file
        self._labels = labels
        self._lines = lines_of(source)
        self._found: list[Diagnostic] = []
        self._events = iter(events)

    def build(self) -> tuple[Node | None, list[Diagnostic]]:
        for event in self._events:
            if isinstance(event, yaml.NodeEvent):
                root = self._node(event)
                return root, self._found
        return None, self._found

    def _mark(self, start: Any, end: Any) -> Mark:
        label = self._labels.get(start.line + 1, "")
        return Mark(self._file, start.line + 1, start.column + 1, end.line + 1, end.column + 1, label)

    def _line(self, mark: Mark) -> str:
        """Return the line of a mark; the parser puts an empty value at the end beyond the last line."""
        return self._lines[mark.line - 1] if mark.line <= len(self._lines) else ""

    def _node(self, event: Any) -> Node:
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._listing(event)
        return self._mapping(event)

    def _scalar(self, event: Any) -> Scalar:
        mark = self._mark(event.start_mark, event.end_mark)
        quoted = event.style in ("'", '"')
        block = event.style in ("|", ">")
        text = str(event.value)
        exact = False
        if mark.line == mark.end_line and not block:
            shift = 1 if quoted else 0
            written = self._line(mark)[mark.col - 1 + shift : mark.end_col - 1 - shift]
            exact = written == text
            if not quoted:
                hidden = hidden_text(self._line(mark), mark.end_col - 1, self._file, mark.line)
                self._found += [hidden] if hidden is not None else []
        return Scalar(text, mark, quoted, block, exact)

    def _listing(self, start: Any) -> Listing:
        items: list[Node] = []
        for event in self._events:
            if isinstance(event, yaml.SequenceEndEvent):
                return Listing(tuple(items), self._span(start, event))
            items.append(self._node(event))
        raise AssertionError("a list without an end")

    def _mapping(self, start: Any) -> Mapping_:
        entries: dict[str, Entry] = {}
        for event in self._events:
            if isinstance(event, yaml.MappingEndEvent):
                return Mapping_(tuple(entries.values()), self._span(start, event))
            key = self._node(event)
            value = self._node(next(self._events))
            if not isinstance(key, Scalar):
                self._found.append(Diagnostic("E001", key.mark, "a key must be a word", self._key_help(key.mark)))
            elif not key.quoted and (slip := colon_in_key(key.text, self._line(key.mark), key.mark)) is not None:
                raise _Slip(slip)
            elif key.text in entries:
                first = entries[key.text].key.mark.said
                what = f"key '{key.text}' appears twice in this mapping; first at {first}"
                self._found.append(Diagnostic("E002", key.mark, what, "keep one of them"))
            else:
                entries[key.text] = Entry(key, value)
        raise AssertionError("a mapping without an end")

    def _key_help(self, mark: Mark) -> str:
        before = self._line(mark)[: mark.col - 1].rstrip()
        return 'inside { } write "${...}" in quotes' if before.endswith("$") else "write key: value"

    def _span(self, start: Any, end: Any) -> Mark:
        """Span a collection: flow style to its bracket; block style to the end of its last line with content."""
        first = start.start_mark
        if start.flow_style:
            return self._mark(first, end.end_mark)
        line = min(end.end_mark.line, len(self._lines) - 1)
        if end.end_mark.column == 0 or not self._lines[line][: end.end_mark.column].strip():
            line -= 1
        while line > first.line and self._lines[line].lstrip()[:1] in ("", "#"):
            line -= 1
        line = max(line, first.line)
        label = self._labels.get(first.line + 1, "")
        return Mark(self._file, first.line + 1, first.column + 1, line + 1, len(self._lines[line].rstrip()) + 1, label)
