"""The place of a position in a flow collection, `{type: hwd, near: ${target}}` or `[yes, no]`, finished or not."""

import re
from dataclasses import dataclass, field
from typing import Final, Literal

_TOKEN: Final = re.compile(
    r"(?P<space>\s+(?:#[^\n]*)?)"
    r"|(?P<quoted>\"(?:[^\"\\\n]|\\.)*\"?|'(?:[^'\n]|'')*'?)"
    r"|(?P<mark>[{}\[\],]|:(?=[\s,{}\[\]]|$))"
    r"|(?P<plain>(?:\$\{[^}\n]*\}?|[^\s{}\[\],:\"']|:(?![\s,{}\[\]]|$)|(?<=\S)[\"'])"
    r"(?:\$\{[^}\n]*\}?|[ \t]+(?!#)(?=[^\s{}\[\],:])|[^\s{}\[\],:]|:(?![\s,{}\[\]]|$))*)"
    r"|(?P<other>.)"
)


@dataclass(slots=True)
class FlowLevel:
    """A collection around the position."""

    kind: Literal["map", "list"]
    keys: dict[str, str] = field(default_factory=dict)
    under: str = ""
    """The key at hand when the position was reached."""
    key: str = ""
    """Of a map: the key at hand; of a list: its last scalar, which is the key of a map of one pair if a colon follows."""
    after_colon: bool = False
    pair: bool = False
    """A map without braces: `[dock_bay: 2]`."""


@dataclass(frozen=True, slots=True)
class FlowPosition:
    """What is at a position of a flow collection."""

    levels: tuple[FlowLevel, ...]
    slot: Literal["key", "value"]
    text: str
    start: int
    """Where `text` begins."""
    colon: bool
    quoted: bool
    closed: bool
    """The collection has ended before the position."""


def read_flow(text: str, offset: int) -> FlowPosition | None:
    """Return what is at `offset` of a text that begins with '{' or '['; None where that is no place for anything."""
    stack: list[FlowLevel] = []
    found: FlowPosition | None = None
    pending = False
    for match in _TOKEN.finditer(text):
        kind, word = match.lastgroup, match[0]
        if kind == "space":
            continue
        if pending:
            found = _with_colon(found, word)
            pending = False
        if found is None and (match.start() >= offset or (kind in ("quoted", "plain") and match.end() >= offset)):
            within = kind in ("quoted", "plain") and match.start() <= offset
            found = _found(stack, match, offset, within=within)
            pending = within
        _take(stack, kind or "", word)
        if not stack:
            if found is None and match.end() <= offset:
                return FlowPosition((), "value", "", offset, False, False, True)
            break
    if found is None:
        found = _found(stack, None, offset, within=False)
    return found


def _with_colon(found: FlowPosition | None, word: str) -> FlowPosition | None:
    if found is None:
        return None
    levels, slot = found.levels, found.slot
    if word == ":" and slot == "value" and levels and levels[-1].kind == "list":
        levels, slot = (*levels, FlowLevel("map", {found.text: ""}, found.text, found.text, pair=True)), "key"
    return FlowPosition(levels, slot, found.text, found.start, word == ":", found.quoted, found.closed)


def _found(stack: list[FlowLevel], match: re.Match[str] | None, offset: int, *, within: bool) -> FlowPosition:
    word, start, quoted = "", offset, False
    if within and match is not None:
        word, start, quoted = match[0], match.start(), match.lastgroup == "quoted"
        if quoted:
            word = word[1:-1] if len(word) > 1 and word[-1] == word[0] else word[1:]
            start += 1
    inner = stack[-1] if stack else FlowLevel("list")
    is_key = inner.kind == "map" and not inner.after_colon
    for level in stack:
        level.under = level.key
    if is_key:
        inner.under = word
    levels = tuple(stack)
    return FlowPosition(levels, "key" if is_key else "value", word, start, False, quoted, not stack)


def _take(stack: list[FlowLevel], kind: str, word: str) -> None:
    inner = stack[-1] if stack else None
    if kind == "mark":
        if word in "{[":
            stack.append(FlowLevel("map" if word == "{" else "list"))
        elif word in "}]":
            if inner is not None and inner.pair:
                stack.pop()
            if stack:
                stack.pop()
        elif word == ":" and inner is not None and inner.kind == "list":
            stack.append(FlowLevel("map", {inner.key: ""}, "", inner.key, after_colon=True, pair=True))
        elif word == "," and inner is not None and inner.pair:
            stack.pop()
        elif inner is not None and inner.kind == "map":
            if word == ":":
                inner.after_colon = True
            else:
                inner.key, inner.after_colon = "", False
        return
    if inner is None:
        return
    plain = word.strip("'\"") if kind == "quoted" else word
    if inner.kind == "list":
        inner.key = plain
    elif inner.after_colon:
        inner.keys[inner.key] = plain
    else:
        inner.key = plain
        inner.keys.setdefault(plain, "")
