"""Cut an expression into tokens and hand Python's `ast` a form that it accepts, keeping the columns.

Every name and literal becomes a placeholder (`n3` = token 3), so unit literals (`60 m`), `true`, dunders and odd
characters never reach Python's parser, and every ast node leads back to source columns. Habits of other languages
(`&&`, `!`, `? :`, `=` for `==`) are recognised here and mended (E009). Called by `expressions`.
"""

import ast
import bisect
import difflib
import re
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from types import MappingProxyType
from typing import Final, Literal, cast

from msgspec import Struct

from formiga_bt.base.units import LARGEST, NUMBER, UNIT, UNITS, to_si

MAX_CHARS: Final = 500
MAX_NODES: Final = 200

WORDS: Final = frozenset({"and", "or", "not", "in", "if", "else"})
_SLIPS: Final[Mapping[str, str]] = MappingProxyType(
    {"AND": "and", "OR": "or", "NOT": "not", "And": "and", "Or": "or", "Not": "not", "is": "=="}
)
_NO_NULL = "there is no empty value; test with is_set(x)"
_REFUSED: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(("None", "null", "nil", "undefined"), _NO_NULL),
        "lambda": "there are no functions here; use vars: or a helper",
        "for": "there is no comprehension; use the step for:",
        **dict.fromkeys(
            ("await", "async", "yield", "import", "def", "class", "return", "del", "global", "while", "with"), ""
        ),
        **dict.fromkeys(("as", "assert", "break", "continue", "elif", "except", "finally", "from", "nonlocal"), ""),
        **dict.fromkeys(("pass", "raise", "try"), ""),
    }
)
_UNIT_WORDS: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(("sec", "secs", "second", "seconds", "S"), "s"),
        **dict.fromkeys(("mins", "minute", "minutes"), "min"),
        **dict.fromkeys(("hr", "hrs", "hour", "hours", "H"), "h"),
        **dict.fromkeys(("day", "days"), "d"),
        **dict.fromkeys(("meter", "meters", "metre", "metres", "mtr", "M"), "m"),
        **dict.fromkeys(("percent", "pct"), "%"),
        **dict.fromkeys(("degree", "degrees"), "deg"),
        **dict.fromkeys(("mps", "ms1"), "m/s"),
        **dict.fromkeys(("kmh", "kph"), "km/h"),
        **dict.fromkeys(("millis", "msec"), "ms"),
    }
)
_TOKEN = re.compile(
    rf"(?P<quantity>(?P<amount>{NUMBER})\s*(?P<unit>(?:{UNIT[:-2]})(?![A-Za-z0-9_])|%))"
    rf"|(?P<number>{NUMBER})"
    r"|(?P<text>[A-Za-z]?'[^']*'|[A-Za-z]?\"[^\"]*\")"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<op>===|!==|&&|\|\||\*\*|==|!=|<=|>=|<>|//|:=|->|\$\{|[-+*/<>()\[\],.=])"
    r"|(?P<other>.)",
    re.ASCII | re.DOTALL,
)
_SPACE = re.compile(r"\s+")
_OPERANDS = frozenset({"name", "number", "quantity", "text", "bool"})


_BOOLS = frozenset({"true", "True", "false", "False"})
_TokenKind = Literal["name", "word", "number", "quantity", "text", "bool", "op"]


class ExprSyntax(Exception):  # noqa: N818 - never leaves the compiler, it becomes a diagnostic
    """The text is no expression. Columns are 0-based in the expression; `mended` replaces that span, if given."""

    def __init__(
        self,
        start: int,
        end: int,
        message: str,
        mend: str = "",
        *,
        code: str = "E009",
        mended: str | None = None,
        name: str = "",
    ) -> None:
        super().__init__(message)
        self.start, self.end, self.message, self.mend, self.code, self.mended = start, end, message, mend, code, mended
        self.name = name
        """The name that was meant, if the word can be none."""


class Token(Struct, frozen=True):
    """A word of an expression; columns are 0-based in the expression."""

    kind: _TokenKind
    text: str
    start: int
    end: int
    value: bool | int | float | str = ""
    unit_type: str = ""
    """Type name of a quantity."""


class Parsed(Struct, frozen=True):
    """An expression as a Python ast over placeholders, with the way back to tokens and columns."""

    source: str
    tokens: tuple[Token, ...]
    starts: tuple[int, ...]
    """Of each token in the text that ast saw."""
    root: ast.expr

    def token(self, placeholder: str) -> Token:
        """Return the token that a placeholder stands for."""
        return self.tokens[int(placeholder[1:])]

    def span(self, node: ast.AST) -> tuple[int, int]:
        """Return the columns of a node in the source; brackets around it are left out."""
        first = bisect.bisect_right(self.starts, getattr(node, "col_offset", 0)) - 1
        last = bisect.bisect_right(self.starts, max(0, (getattr(node, "end_col_offset", 0) or 1) - 1)) - 1
        return self.tokens[max(0, first)].start, self.tokens[max(0, last)].end

    def text(self, node: ast.AST) -> str:
        """Return the source of a node."""
        start, end = self.span(node)
        return self.source[start:end]


@lru_cache(maxsize=1024)
def parse_expression(source: str) -> Parsed:
    """Parse an expression; the newest thousand are kept, for many a name stands in a file again and again.

    Raises:
        ExprSyntax: it is not one, or it is too large.
    """
    if len(source) > MAX_CHARS:
        raise ExprSyntax(0, len(source), f"an expression may have {MAX_CHARS} characters", "split it with vars:")
    tokens = _tokens(source)
    if not tokens:
        raise ExprSyntax(0, max(1, len(source)), "an expression is missing here", "")
    _check_neighbours(tokens)
    _check_brackets(tokens)
    pieces: list[str] = []
    starts: list[int] = []
    length = 0
    for index, token in enumerate(tokens):
        piece = token.text if token.kind in ("op", "word") else f"n{index}"
        starts.append(length)
        pieces.append(piece)
        length += len(piece) + 1
    try:
        root = ast.parse(" ".join(pieces), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError, OverflowError) as error:
        raise _explain(error, tokens, tuple(starts)) from None
    # each part has a sign or word of its own, so a text with few of them need not be counted
    if len(tokens) > MAX_NODES and sum(isinstance(node, ast.expr) for node in ast.walk(root)) > MAX_NODES:
        raise ExprSyntax(0, len(source), f"an expression may have {MAX_NODES} parts", "split it with vars:")
    return Parsed(source, tuple(tokens), tuple(starts), root)


def rough_tokens(text: str) -> list[Token]:
    """Return the tokens of a text that may be no expression (yet); what is strange is an "op". For editors."""
    found: list[Token] = []
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup or ""
        if kind == "other" and match[0].isspace():
            continue
        if kind == "quantity" or match["unit"] is not None:
            kind = "quantity"
        elif kind == "name":
            after_dot = bool(found) and found[-1].text == "."
            kind = "word" if match[0] in WORDS and not after_dot else "bool" if match[0] in _BOOLS else "name"
        elif kind not in ("number", "text"):
            kind = "op"
        found.append(Token(cast(_TokenKind, kind), match[0], match.start(), match.end()))
    return found


def _explain(error: BaseException, tokens: list[Token], starts: tuple[int, ...]) -> ExprSyntax:
    if not isinstance(error, SyntaxError) or error.offset is None or "nested" in error.msg:
        return ExprSyntax(tokens[0].start, tokens[-1].end, "this expression is nested too deep", "split it with vars:")
    last = tokens[-1]
    if error.offset - 1 > starts[-1] or (last.kind in ("word", "op") and last.text not in (")", "]")):
        return ExprSyntax(last.start, last.end, f"the expression ends too soon after '{last.text}'", "")
    index = max(0, bisect.bisect_right(starts, error.offset - 1) - 1)
    token = tokens[index]
    if any(t.text == "if" for t in tokens) and not any(t.text == "else" for t in tokens):
        at = next(t for t in tokens if t.text == "if")
        return ExprSyntax(at.start, at.end, "'if' needs an 'else' here", "write: a if condition else b")
    return ExprSyntax(token.start, token.end, f"'{token.text}' is not understood here", "")


def _tokens(source: str) -> list[Token]:
    tokens: list[Token] = []
    at = 0
    while at < len(source):
        space = _SPACE.match(source, at)
        if space is not None:
            at = space.end()
            continue
        found = _TOKEN.match(source, at)
        assert found is not None, "the last alternative takes any character"
        tokens.append(_token(source, found, tokens))
        at = found.end()
    return tokens


def _token(source: str, found: re.Match[str], before: list[Token]) -> Token:
    start, end, text = found.start(), found.end(), found[0]
    match found.lastgroup:
        case "quantity" | "unit":
            return _quantity(source, found)
        case "number":
            return _number(text, start, end)
        case "text":
            return _text(text, start, end)
        case "name":
            return _name(text, start, end, before)
        case "op":
            _check_op(source, text, start, end)
            return Token("op", text, start, end)
        case _:
            raise _strange(source, text, start, end)


def _quantity(source: str, found: re.Match[str]) -> Token:
    type_name, factor = UNITS[found["unit"]]
    value = to_si(float(found["amount"]), factor)
    if found["unit"] == "%" and re.match(r"\s*[A-Za-z0-9_(]", source[found.end() :]):
        word = re.match(r"\s*([A-Za-z]+)\b", source[found.end() :])
        if word is None or word[1] not in WORDS:
            at = found.end() - 1
            raise ExprSyntax(at, at + 1, "'%' is percent here, not the remainder", "for the remainder write mod(a, b)")
    if abs(value) > LARGEST:
        raise ExprSyntax(found.start(), found.end(), "this number is too large", "at most 2**53 in SI units")
    return Token("quantity", found[0], found.start(), found.end(), value, type_name)


def _number(text: str, start: int, end: int) -> Token:
    value: int | float = int(text) if text.isdigit() else float(text)
    if abs(value) > LARGEST:
        raise ExprSyntax(start, end, "this number is too large", "at most 2**53")
    return Token("number", text, start, end, value)


def _text(text: str, start: int, end: int) -> Token:
    if text[0] not in "'\"":
        raise ExprSyntax(start, end, f"a text has no prefix '{text[0]}'", f"write: {text[1:]}", mended=text[1:])
    if "\\" in text:
        raise ExprSyntax(start, end, "a text in an expression has no '\\'", "leave it away")
    return Token("text", text, start, end, text[1:-1])


def _name(text: str, start: int, end: int, before: list[Token]) -> Token:
    field = bool(before) and before[-1].text == "."
    if text in _BOOLS:
        return Token("bool", text, start, end, text in ("true", "True"))
    if text in WORDS:
        return Token("word", text, start, end)
    if field:
        return Token("name", text, start, end)
    if text in _SLIPS:
        raise ExprSyntax(
            start, end, f"'{text}' is written '{_SLIPS[text]}'", f"write {_SLIPS[text]}", mended=_SLIPS[text]
        )
    if text in _REFUSED:
        if _REFUSED[text]:
            raise ExprSyntax(start, end, f"'{text}' is not part of the language", _REFUSED[text])
        what = f"'{text}' can be no name in an expression"
        raise ExprSyntax(start, end, what, f"Python keeps the word for itself: call it {text}_", name=text)
    return Token("name", text, start, end)


def is_readable(name: str, *, field: bool = False) -> bool:
    """Return whether an expression can read what is called so; `field`: after a dot, where more words are free."""
    return name not in WORDS and name not in _BOOLS and (field or (name not in _SLIPS and name not in _REFUSED))


_OP_MENDS: Final[Mapping[str, str]] = MappingProxyType({"&&": "and", "||": "or", "===": "==", "!==": "!=", "<>": "!="})


def _check_op(source: str, text: str, start: int, end: int) -> None:
    if text in _OP_MENDS:
        mend = _OP_MENDS[text]
        spaced = mend if source[start - 1 : start].isspace() and source[end : end + 1].isspace() else f" {mend} "
        raise ExprSyntax(
            start, end, f"'{text}' is written '{mend}'", f"write: {_replaced(source, text, mend)}", mended=spaced
        )
    if text == "**":
        raise ExprSyntax(start, end, "there is no power '**'", "multiply: a * a")
    if text == ":=":
        raise ExprSyntax(start, end, "an expression assigns nothing", "use the step set:")
    if text == "->":
        raise ExprSyntax(start, end, "'->' is not part of the language", "fields are read with a dot: drone.battery")
    if text == "${":
        raise ExprSyntax(start, end, "'${' does not belong inside an expression", "write the bare name")


def _replaced(source: str, old: str, new: str) -> str:
    return " ".join(source.replace(old, f" {new} ").split())


def _colon_help(source: str, colon: int) -> str:
    """Return what was meant by a colon: one item of a list, or, between digits, a time."""
    if "[" in source:
        return "a list is read one item at a time: write list[0]"
    if not (source[:colon][-2:].isdecimal() and source[colon + 1 : colon + 3].isdecimal()):
        return ""
    if source[:colon][-3:-2] == "T":
        return "give a date as a parameter of type time, or write today('06:30')"
    return f"a time of today is written today('{source[colon - 2 : colon + 3]}')"


def _strange(source: str, text: str, start: int, end: int) -> ExprSyntax:
    if text == "!":
        mended = " ".join(re.sub(r"!(?!=)\s*", "not ", source).split())
        return ExprSyntax(start, end, "'!' is written 'not'", f"write: {mended}", mended="not ")
    if text == "?":
        return _question(source, start, end)
    if text == "%":
        return ExprSyntax(start, end, "'%' is percent here, not the remainder", "for the remainder write mod(a, b)")
    if text in "'\"":
        return ExprSyntax(start, len(source), "this quote is never closed", f"close it with {text}")
    if text in "&|~^":
        return ExprSyntax(start, end, f"'{text}' is not part of the language", "use and, or, not")
    if text == ":":
        return ExprSyntax(start, end, "':' is not part of an expression", _colon_help(source, start))
    if text in "{}":
        return ExprSyntax(start, end, f"'{text}' is not part of an expression", "lists stand in [ ]")
    return ExprSyntax(start, end, f"the character '{text}' is not part of an expression", "")


def _question(source: str, start: int, end: int) -> ExprSyntax:
    cond, _, rest = source.partition("?")
    yes, colon, no = rest.partition(":")
    if not colon or "?" in rest:
        return ExprSyntax(start, end, "'a ? b : c' is not part of the language", "write: b if a else c")
    mended = f"{yes.strip()} if {cond.strip()} else {no.strip()}"
    what = "'a ? b : c' is not part of the language"
    return ExprSyntax(0, len(source), what, f"write: {mended}", mended=mended)


def _check_neighbours(tokens: list[Token]) -> None:
    for left, right in pairwise(tokens):
        if right.kind not in _OPERANDS or not (left.kind in _OPERANDS or left.text in (")", "]")):
            continue
        if left.kind == "number" and right.kind == "name":
            raise _unknown_unit(left, right)
        what = f"an operator is missing between '{left.text}' and '{right.text}'"
        raise ExprSyntax(left.start, right.end, what, "")


def _unknown_unit(left: Token, right: Token) -> ExprSyntax:
    near = _UNIT_WORDS.get(right.text) or next(iter(difflib.get_close_matches(right.text, list(UNITS), 1)), "")
    mended = f"{left.text} {near}" if near else None
    mend = f"write {mended}" if mended else "units: " + " ".join(UNITS)
    mended = mended if right.text in _UNIT_WORDS else None
    return ExprSyntax(left.start, right.end, f"'{right.text}' is not a unit", mend, code="E017", mended=mended)


def _check_brackets(tokens: list[Token]) -> None:
    opened: list[Token] = []
    pairs = {")": "(", "]": "["}
    for token in tokens:
        if token.kind != "op":
            continue
        if token.text in "([":
            opened.append(token)
        elif token.text in ")]":
            if not opened or opened.pop().text != pairs[token.text]:
                raise ExprSyntax(token.start, token.end, f"'{token.text}' closes nothing", "remove it")
        elif token.text == "=" and not opened:
            raise ExprSyntax(token.start, token.end, "'=' does not compare", "write ==", mended="==")
    if opened:
        raise ExprSyntax(opened[-1].start, opened[-1].end, f"'{opened[-1].text}' is never closed", "close it")
