"""The ground of the expression checker: making typed parts, folding constants, reporting at columns.

`Parts` holds what one check works with; `operands` and `checker` build on it. A part that was refused is poison (its
code is `never`), so that one mistake is one diagnostic.
"""

import ast
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.diagnostics import About
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.tokens import Parsed
from formiga_bt.lang.expr.typed import ExpressionProblems, Mismatch, Run, Typed, constant, never
from formiga_bt.lang.model import Dependency, EvalError
from formiga_bt.lang.types import ANY, Type

Names = frozenset[str]
NO_NAMES: Final[Names] = frozenset()
NOW: Final = Dependency("now")


def dotted_name(node: ast.AST, parsed: Parsed) -> str:
    """Return `error.data.spot` of a field of a field of a name, a plain name as it is, and "" of anything else."""
    if isinstance(node, ast.Name):
        token = parsed.token(node.id)
        return token.text if token.kind == "name" else ""
    owner = dotted_name(node.value, parsed) if isinstance(node, ast.Attribute) else ""
    return f"{owner}.{parsed.token(node.attr).text}" if isinstance(node, ast.Attribute) and owner else ""


def facts(node: ast.AST, parsed: Parsed) -> tuple[Names, Names]:
    """Return the names that are set for certain when a condition is true, and when it is false."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        when_true, when_false = facts(node.operand, parsed)
        return when_false, when_true
    if isinstance(node, ast.BoolOp):
        parts = [facts(value, parsed) for value in node.values]
        trues, falses = [part[0] for part in parts], [part[1] for part in parts]
        if isinstance(node.op, ast.And):
            return NO_NAMES.union(*trues), falses[0].intersection(*falses)
        return trues[0].intersection(*trues), NO_NAMES.union(*falses)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
        name = dotted_name(node.args[0], parsed)
        if parsed.token(node.func.id).text == "is_set" and name:
            return frozenset({name}), NO_NAMES
    return NO_NAMES, NO_NAMES


def poisoned(*parts: Typed) -> bool:
    """Return whether one of the parts was refused."""
    return any(part.run is never for part in parts)


def reads_of(parts: Iterable[Typed]) -> tuple[Dependency, ...]:
    """Return what the parts read, each once, in order."""
    return tuple(dict.fromkeys(read for part in parts for read in part.reads))


class Compared(Struct, frozen=True):
    """A comparison that reads `now`, for the deadlines of live conditions."""

    op: str
    nodes: tuple[ast.expr, ast.expr]
    left: Typed
    right: Typed
    run: Run
    of_items: bool = False
    """It is read for each item of a list."""


class Parts(ABC):
    """What one check works with, and how it makes parts; problems go to `problems`."""

    def __init__(self, parsed: Parsed, scope: Scope, problems: ExpressionProblems) -> None:
        self.parsed = parsed
        self.scope = scope
        self.problems = problems
        self.known_set: Names = NO_NAMES
        """Names that are set for certain where the visit stands."""
        self.loose = False
        """Whether a value of type `any` took part, so that types are only known at run time."""
        self.of_items = False
        """Whether the visit is in what is read for each item of a list."""
        self.compared: list[Compared] = []
        """Every comparison that reads `now`."""

    @abstractmethod
    def visit(self, node: ast.expr) -> Typed:
        """Check a node and return its part."""

    def bad(
        self,
        node: ast.AST,
        code: str,
        message: str,
        mend: str = "",
        *,
        mended: str | None = None,
        reads: tuple[Dependency, ...] = (),
        about: About | None = None,
    ) -> Typed:
        """Report a problem at a node and return poison."""
        start, end = self.parsed.span(node)
        self.problems.report(code, start, end, message, mend, mended=mended, about=about)
        return self.poison(node, reads)

    def poison(self, node: ast.AST, reads: tuple[Dependency, ...] = ()) -> Typed:
        """Return a part that was refused."""
        return self.part(node, ANY, never, reads)

    def part(self, node: ast.AST, type_: Type, run: Run, reads: tuple[Dependency, ...] = (), **more: Any) -> Typed:
        """Make a part of a node."""
        self.loose = self.loose or (type_.name == "any" and run is not never)
        start, end = self.parsed.span(node)
        return Typed(type_, run, start, end, self.parsed.source[start:end], reads, **more)

    def made(self, node: ast.AST, type_: Type, run: Run, parts: list[Typed], *, pure: bool = True) -> Typed:
        """Make a part from others; fold it where all of them are constant."""
        reads = reads_of(parts)
        if poisoned(*parts):
            return self.poison(node, reads)
        if not (pure and all(part.is_const for part in parts)):
            return self.part(node, type_, run, reads)
        try:
            value = run(_NO_ENV)
        except EvalError as error:
            return self.bad(node, "E013", f"this never has a value: {error.reason}", reads=reads)
        return self.part(node, type_, constant(value), reads, const=value)

    def wrong(self, part: Typed, why: Mismatch) -> None:
        """Report why a part does not stand where it does."""
        self.problems.report(why.code, part.start, part.end, why.message, why.mend, mended=why.mended, about=why.about)


_NO_ENV: Final[Any] = None
"""Stands for the environment while constants are folded; nothing constant reads it."""
