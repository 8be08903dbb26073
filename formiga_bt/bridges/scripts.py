"""Expressions to BehaviorTree.CPP's script language, and back.

BT.CPP scripts know numbers, texts, truth values and blackboard entries: no fields, calls, lists or units. Quantities
become SI numbers; a field of a saved result is the entry `name_field`, and so is a field of a role of the task, which the
host must keep up to date. What does not fit is None, and the caller keeps the text.
"""

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.lang.expr.tokens import ExprSyntax, Parsed, Token, parse_expression

_BINARY: Final[Mapping[type, str]] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_COMPARE: Final[Mapping[type, str]] = {
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip
BUILT_IN: Final = frozenset({"base", "task", "now", "site", "error", "abort"})
"""Names that no blackboard entry stands for."""


@dataclass(slots=True)
class ScriptNames:
    """What names stand for on the blackboard of one tree."""

    records: frozenset[str] = frozenset()
    """Saved results and answers: their fields are entries."""
    agents: frozenset[str] = frozenset()
    """Roles (one agent each) whose fields the host keeps as entries."""
    taken: frozenset[str] = frozenset()
    """All names of the scope: no entry of a field may be called like one of them."""
    any_field: bool = False
    """Take every field for an entry (to see whether a script still is what it was made from)."""
    read: set[tuple[str, str]] = field(default_factory=set)
    """Fields of agents that were read so far."""


def to_script(source: str, names: ScriptNames, renamed: Mapping[str, str] | None = None) -> str | None:
    """Return an expression as a script, or None if scripts cannot say it.

    Args:
        source: the bare expression.
        names: of the tree that it stands in; fields of agents that it reads are added.
        renamed: names to replace (`result` of an `expect`).
    """
    try:
        parsed = parse_expression(source)
        writer = _Writer(parsed, names, renamed or {})
        text = writer.text(parsed.root)
    except (ExprSyntax, _Beyond):
        return None
    names.read |= writer.read
    return text


class _Beyond(Exception):  # noqa: N818 - never leaves this module
    """Scripts cannot say this."""


class _Writer:
    def __init__(self, parsed: Parsed, names: ScriptNames, renamed: Mapping[str, str]) -> None:
        self.parsed, self.names, self.renamed = parsed, names, renamed
        self.read: set[tuple[str, str]] = set()

    def text(self, node: ast.expr) -> str:
        match node:
            case ast.Name():
                return self.leaf(self.parsed.token(node.id))
            case ast.Attribute(value=ast.Name()):
                return self.entry(node)
            case ast.BoolOp():
                word = " && " if isinstance(node.op, ast.And) else " || "
                return word.join(self.inner(value) for value in node.values)
            case ast.UnaryOp(op=ast.Not()):
                return f"!{self.inner(node.operand)}"
            case ast.UnaryOp(op=ast.USub()):
                return f"-{self.inner(node.operand)}"
            case ast.BinOp() if type(node.op) in _BINARY:
                return f"{self.inner(node.left)} {_BINARY[type(node.op)]} {self.inner(node.right)}"
            case ast.Compare():
                return self.compare(node)
            case ast.IfExp():
                return f"{self.inner(node.test)} ? {self.inner(node.body)} : {self.inner(node.orelse)}"
        raise _Beyond

    def inner(self, node: ast.expr) -> str:
        text = self.text(node)
        return text if isinstance(node, ast.Name | ast.Attribute) else f"({text})"

    def compare(self, node: ast.Compare) -> str:
        sides = [node.left, *node.comparators]
        parts = [self.pair(a, op, b) for a, op, b in zip(sides, node.ops, sides[1:], strict=False)]
        return parts[0] if len(parts) == 1 else " && ".join(f"({part})" for part in parts)

    def pair(self, left: ast.expr, op: ast.cmpop, right: ast.expr) -> str:
        if isinstance(op, ast.In) and isinstance(right, ast.List) and right.elts:
            return " || ".join(f"({self.inner(left)} == {self.inner(item)})" for item in right.elts)
        if type(op) not in _COMPARE:
            raise _Beyond
        return f"{self.inner(left)} {_COMPARE[type(op)]} {self.inner(right)}"

    def leaf(self, token: Token) -> str:
        match token.kind:
            case "name":
                name = self.renamed.get(token.text, token.text)
                if name in BUILT_IN or name in self.names.records:
                    raise _Beyond
                return name
            case "number" | "quantity":
                return number(float(token.value))
            case "bool":
                return "true" if token.value else "false"
            case "text" if "'" not in str(token.value):
                return f"'{token.value}'"
        raise _Beyond

    def entry(self, node: ast.Attribute) -> str:
        assert isinstance(node.value, ast.Name)
        written = self.parsed.token(node.value.id).text
        name, one = self.renamed.get(written, written), self.parsed.token(node.attr).text
        if f"{name}_{one}" in self.names.taken:
            raise _Beyond
        if name in self.names.agents:
            self.read.add((name, one))
        elif name not in self.names.records and written not in self.renamed and not self.names.any_field:
            raise _Beyond
        return f"{name}_{one}"


def number(value: float) -> str:
    """Return a number as scripts and ports take it."""
    return str(int(value)) if value == int(value) else repr(value)


_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|(?P<text>'[^']*')|(?P<name>@?[A-Za-z_][\w]*)"
    r"|(?P<op>:=|&&|\|\||==|!=|<=|>=|\+=|-=|\*=|/=|\.\.|[-+*/<>()!?:;=])|(?P<other>\S))",
    re.ASCII,
)
_LEVELS: Final = (("||",), ("&&",), ("==", "!=", "<", ">", "<=", ">="), ("+", "-"), ("*", "/"))
_OURS: Final[Mapping[str, str]] = {"||": "or", "&&": "and"}


_ASSIGNED: Final = re.compile(r"@?([A-Za-z_]\w*)\s*(?::=|[-+*/]=|=(?!=))", re.ASCII)


def assigned_names(code: str) -> list[str]:
    """Return the names that a script assigns, whether or not it can be read."""
    return _ASSIGNED.findall(re.sub(r"'[^']*'|[=!<>]=", " ", code.replace("+=", ":=").replace("-=", ":=")))


class NoScript(Exception):  # noqa: N818 - a signal to the importer
    """A script says something that expressions cannot say; the text tells what."""


@dataclass(frozen=True, slots=True)
class Assigned:
    """One statement of a script: `name := value`, or a bare value (then `name` is empty)."""

    name: str
    value: str


def from_script(code: str, spell: Callable[[str], str] = str) -> list[Assigned]:
    """Return the statements of a script with their values as expressions of ours.

    Args:
        code: the script.
        spell: turns the name of a blackboard entry into an expression.

    Raises:
        NoScript: it uses something that we have not, or is none.
    """
    try:
        return _Statements(code, spell).all()
    except RecursionError:
        raise NoScript("it is nested too deep") from None


class _Statements:
    def __init__(self, code: str, spell: Callable[[str], str]) -> None:
        self.tokens = [(m.lastgroup or "", m[m.lastgroup or 0]) for m in _TOKEN.finditer(code)]
        if len(self.tokens) > 500:
            raise NoScript("it is too long")
        self.at, self.spell = 0, spell

    def peek(self, ahead: int = 0) -> str:
        index = self.at + ahead
        return self.tokens[index][1] if index < len(self.tokens) else ""

    def all(self) -> list[Assigned]:
        found: list[Assigned] = []
        while self.at < len(self.tokens):
            if self.peek() == ";":
                self.at += 1
                continue
            found.append(self.statement())
            if self.at < len(self.tokens) and self.peek() != ";":
                raise NoScript(f"'{self.peek()}' is not understood")
        if not found:
            raise NoScript("it is empty")
        return found

    def statement(self) -> Assigned:
        op = self.peek(1)
        if self.tokens[self.at][0] == "name" and op in (":=", "=", "+=", "-=", "*=", "/="):
            name = self.peek().lstrip("@")
            self.at += 2
            value = self.ternary()
            simple = value if re.fullmatch(r"[\w.]+", value) else f"({value})"
            return Assigned(name, value if op in (":=", "=") else f"{self.spell(name)} {op[0]} {simple}")
        return Assigned("", self.ternary())

    def ternary(self) -> str:
        test = self.level(0)
        if self.peek() != "?":
            return test
        self.at += 1
        body = self.ternary()
        if self.peek() != ":":
            raise NoScript("a '?' has no ':'")
        self.at += 1
        return f"({body}) if {test} else ({self.ternary()})"

    def level(self, depth: int) -> str:
        if depth == len(_LEVELS):
            return self.unary()
        text = self.level(depth + 1)
        while self.peek() in _LEVELS[depth] and self.tokens[self.at][0] == "op":
            op = self.peek()
            self.at += 1
            text = f"{text} {_OURS.get(op, op)} {self.level(depth + 1)}"
        return text

    def unary(self) -> str:
        word = self.peek()
        if word in ("!", "-") and self.tokens[self.at][0] == "op":
            self.at += 1
            text = ("not " if word == "!" else "-") + self.unary()
            binds = word == "!" and any(self.peek() in ops for ops in _LEVELS[2:])
            return f"({text})" if binds else text  # `!a == b` compares the negation, `not a == b` would not
        return self.primary()

    def primary(self) -> str:
        if self.at >= len(self.tokens):
            raise NoScript("it ends too soon")
        kind, word = self.tokens[self.at]
        self.at += 1
        if kind in ("number", "text"):
            return word
        if kind == "name":
            return word if word in ("true", "false") else self.spell(word.lstrip("@"))
        if word == "(":
            inside = self.ternary()
            if self.peek() != ")":
                raise NoScript("a bracket is never closed")
            self.at += 1
            return inside if re.fullmatch(r"[\w.]+|'[^']*'", inside) else f"({inside})"
        raise NoScript(f"'{word}' has no counterpart")
