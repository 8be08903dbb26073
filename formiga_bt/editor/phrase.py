"""What is being written inside an expression: the word at the position, and the value before its dot.

Types come from the checker itself: a piece of an expression is compiled in the scope of its step.
"""

from dataclasses import dataclass
from typing import Literal

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.tokens import Token, rough_tokens
from formiga_bt.lang.expressions import compile_expr
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import ANY, Type


@dataclass(frozen=True, slots=True)
class Phrase:
    """What is due at a position of an expression."""

    what: Literal["name", "field", "unit", "text"]
    word: str
    """The part of the word before the position."""
    start: int
    """Where the word begins in the expression."""
    owner: str = ""
    """field: the source of the value before the dot; text: of what it is compared with."""


def hole_around(text: str, offset: int) -> tuple[int, int] | None:
    """Return the span of the expression in the `${...}` around an offset, closed or not; None outside of any."""
    start = text.rfind("${", 0, offset + 1)
    if start < 0 or start + 2 > offset:
        return None
    end = text.find("}", start)
    if end >= 0 and end < offset:
        return None
    return start + 2, end if end >= 0 else len(text)


def phrase(text: str, offset: int) -> Phrase:
    """Return what is due at an offset of an expression."""
    before = text[:offset]
    quote = _open_quote(before)
    if quote is not None:
        return Phrase("text", before[quote + 1 :], quote + 1, _compared(rough_tokens(before[:quote])))
    tokens = rough_tokens(before)
    last = tokens[-1] if tokens else None
    if last is None:
        return Phrase("name", "", offset)
    touches = last.end == offset
    if last.kind == "quantity" and touches:
        number = len(last.text.rstrip("abcdefghijklmnopqrstuvwxyz/%").rstrip())
        unit = last.text[number:].lstrip()
        return Phrase("unit", unit, last.end - len(unit), last.text[:number])
    if last.kind == "number":
        return Phrase("unit", "", offset, last.text)
    if last.text == ".":
        return Phrase("field", "", offset, _chain(before, tokens[:-1]))
    if last.kind in ("name", "word", "bool") and touches:
        prior = tokens[-2] if len(tokens) > 1 else None
        if prior is not None and prior.text == ".":
            return Phrase("field", last.text, last.start, _chain(before, tokens[:-2]))
        if prior is not None and prior.kind == "number":
            return Phrase("unit", last.text, last.start, prior.text)
        return Phrase("name", last.text, last.start)
    return Phrase("name", "", offset)


def _open_quote(text: str) -> int | None:
    """Return where the text that is open at the end of an expression begins."""
    at = -1
    for index, char in enumerate(text):
        if at >= 0:
            at = -1 if char == text[at] else at
        elif char in "'\"":
            at = index
    return at if at >= 0 else None


def _chain(text: str, tokens: list[Token]) -> str:
    """Return the source of the value that ends with the last token: `drone`, `first(drones)`, `spots[0].x`."""
    start = _chain_start(tokens)
    return text[tokens[start].start : tokens[-1].end] if tokens and start is not None else ""


def _chain_start(tokens: list[Token]) -> int | None:
    at = len(tokens) - 1
    while at >= 0:
        if tokens[at].text in (")", "]"):
            depth = 0
            while at >= 0:
                depth += (tokens[at].text in (")", "]")) - (tokens[at].text in ("(", "["))
                if depth == 0:
                    break
                at -= 1
            if at < 0:
                return None
            if at > 0 and tokens[at - 1].kind == "name":
                at -= 1
            elif at > 0 and tokens[at - 1].text in (")", "]"):
                at -= 1
                continue
        elif tokens[at].kind != "name":
            return None
        if at > 0 and tokens[at - 1].text == ".":
            at -= 2
            continue
        return at
    return None


def _compared(tokens: list[Token]) -> str:
    """Return the source of what the text that comes next is compared with, or ""."""
    while tokens and tokens[-1].text not in ("==", "!=", "in"):
        if tokens[-1].kind != "text" and tokens[-1].text not in ("[", ","):
            return ""
        tokens = tokens[:-1]
    if not tokens:
        return ""
    before = tokens[:-1]
    if before and before[-1].text == "not":
        before = before[:-1]
    start = _chain_start(before)
    if start is None:
        return ""
    return "".join(token.text for token in before[start:])


def word_at(text: str, offset: int) -> tuple[str, int, int, str] | None:
    """Return the name or helper at an offset with its columns and, of a field, the value before its dot; None elsewhere."""
    tokens = rough_tokens(text)
    for index, token in enumerate(tokens):
        if token.kind == "name" and token.start <= offset <= token.end:
            owner = _chain(text, tokens[: index - 1]) if index and tokens[index - 1].text == "." else ""
            return token.text, token.start, token.end, owner
    return None


def type_of(source: str, scope: Scope) -> Type:
    """Return the type of an expression; `any` where it has none."""
    if not source:
        return ANY
    whole = scope.narrowed(frozenset(scope.maybe_unset))
    return compile_expr(source, Scalar(source, Mark("", 1, 1)), 0, whole, None)[0].type


def open_call(text: str, offset: int) -> tuple[str, int] | None:
    """Return the helper in whose brackets an offset is, and which of its arguments; None outside of any."""
    tokens = rough_tokens(text[:offset])
    depth = commas = 0
    for index in range(len(tokens) - 1, -1, -1):
        word = tokens[index].text
        if word in (")", "]"):
            depth += 1
        elif word in ("(", "["):
            if depth == 0:
                before = tokens[index - 1] if index else None
                is_call = word == "(" and before is not None and before.kind == "name"
                return (before.text, commas) if is_call and before is not None else None
            depth -= 1
        elif word == "," and depth == 0:
            commas += 1
    return None
