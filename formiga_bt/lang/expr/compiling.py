"""The compiler of one expression: its text in, a typed and compiled `Expr` with its diagnostics out.

Below `values` and `literals`, which need it for what stands in `${}`; `expressions` is the door for everybody else.
"""

from typing import Any

from formiga_bt.base.diagnostics import Diagnostic, UnknownName
from formiga_bt.lang.expr.at_run import guarded, is_open, named, of_type
from formiga_bt.lang.expr.checker import ExpressionChecker
from formiga_bt.lang.expr.instants import deadlines
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.tokens import ExprSyntax, parse_expression
from formiga_bt.lang.expr.typed import ExpressionProblems, Mismatch, Run, Typed, mismatch, never
from formiga_bt.lang.expr.typing_rules import fits, in_words, widen
from formiga_bt.lang.model import Expr
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.types import ANY, BOOL, Type


def poison(node: Node, source: str = "", reads: Any = ()) -> Expr:
    """Return the Expr that stands for a refused one: of type ANY, so that nothing else complains."""
    return Expr(source, ANY, node.mark, never, tuple(reads))


def compile_expr(
    source: str,
    at: Scalar,
    offset: int,
    scope: Scope,
    expected: Type | None,
    *,
    what: str = "",
    optional: bool = False,
    live: frozenset[str] | None = None,
) -> tuple[Expr, list[Diagnostic]]:
    """Compile an expression.

    Args:
        source: its text, found at `at.text[offset:]`.
        at: the scalar that holds it.
        offset: where it begins in the scalar's text.
        scope: the names visible there.
        expected: the type that is due, if any.
        what: the key or field it is for, named in messages.
        optional: the whole value may be absent, so a bare name that may be unset is fine.
        live: for a condition that is watched, the names that may be written meanwhile; None = it is read once.

    Returns:
        The expression and the problems; with problems its type is ANY and it must not be run.
    """
    problems = ExpressionProblems(at, offset)
    mark = at.mark_at(offset, offset + len(source))
    try:
        parsed = parse_expression(source)
    except ExprSyntax as bad:
        about = UnknownName(bad.name) if bad.name else None
        problems.report(bad.code, bad.start, bad.end, bad.message, bad.mend, mended=bad.mended, about=about)
        return Expr(source, ANY, mark, never), problems.found
    checker = ExpressionChecker(parsed, scope, problems, may_be_absent=optional)
    part = checker.check()
    if not problems.found and expected is not None and not fits(part.type, expected, scope.agent_types):
        why = _mismatch(part, expected, scope, what)
        checker.wrong(part, why)
    instants = deadlines(checker, part.reads, live) if live is not None and not problems.found else ()
    if problems.found:
        return Expr(source, ANY, mark, never, part.reads), problems.found
    type_ = _settled(part.type, expected)
    if part.is_const:
        return Expr(source, type_, mark, part.run, part.reads, instants, part.const), []
    run: Run = guarded(part.run) if checker.loose else part.run
    if expected is not None and is_open(part.type):
        run = of_type(run, expected)
    run = named(run, source, mark)
    return Expr(source, type_, mark, run, part.reads, instants, part.const), []


def _mismatch(part: Typed, expected: Type, scope: Scope, what: str) -> Mismatch:
    if expected == BOOL:
        such = {"percent": "30 %", "distance": "10 m", "duration": "5 s", "int": "3", "number": "3"}.get(part.type.name)
        mend = f"such as: {part.source} > {such}" if such else "compare it with something"
        return Mismatch("E015", f"a condition must be true or false, this is {in_words(part.type)}", mend)
    return mismatch(part, expected, scope, what)


def _settled(have: Type, expected: Type | None) -> Type:
    """Return the type to show outside: texts written in an expression become what was expected, or text.

    Where anything may stand, as in the `returns` of a subtree, they stay what they are, so that a caller may expect an enum.
    """
    if expected == ANY:
        return have
    if have.name == "literal" and expected is not None and expected.name == "enum":
        return expected
    if have.name == "list" and have.item == ANY and expected is not None and expected.name == "list":
        return expected
    return widen(have)
