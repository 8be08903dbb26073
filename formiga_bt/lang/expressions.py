"""Expressions of the task language: text in, a typed and compiled `Expr` with its diagnostics out.

The loader's door to the expression compiler. The parts, in the order in which a text passes them: `tokens` (columns,
units, habits of other languages), `checker` on `operands` on `parts` (names, types, code), with `typing_rules`,
`calls`, `helpers` and `scope` beside them; `compiling` joins them. `values` reads YAML values of an expected type.
"""

import re

from formiga_bt.base.diagnostics import Diagnostic, Fix
from formiga_bt.lang.expr.compiling import compile_expr, poison
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.parts import facts
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.tokens import ExprSyntax, parse_expression
from formiga_bt.lang.expr.typing_rules import fits
from formiga_bt.lang.expr.values import read_value, read_words
from formiga_bt.lang.model import Expr
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.types import BOOL, Type

__all__ = [
    "Scope",
    "compile_bare",
    "compile_cond",
    "compile_expr",
    "compile_value",
    "compile_words",
    "fits",
    "narrows",
    "narrows_when_false",
    "poison",
]


def compile_cond(at: Scalar, scope: Scope, live: frozenset[str] | None = None) -> tuple[Expr, list[Diagnostic]]:
    """Compile a condition key: one bare expression of type bool; a `${}` round the whole of it is dropped.

    With `live` it is watched: `now` needs exact deadlines, and `live` are the names that may be written meanwhile.
    """
    return _bare(at, scope, BOOL, "a condition is one bare expression; leave ${ } away", live=live)


def compile_bare(at: Scalar, scope: Scope, what: str) -> tuple[Expr, list[Diagnostic]]:
    """Compile a key that holds one bare expression of any type; a `${}` round the whole of it is dropped."""
    return _bare(at, scope, None, f"'{what}' is one bare expression; leave ${{ }} away")


def _bare(
    at: Scalar, scope: Scope, expected: Type | None, said: str, live: frozenset[str] | None = None
) -> tuple[Expr, list[Diagnostic]]:
    text = at.text
    offset = len(text) - len(text.lstrip())
    source = text.strip()
    spans = holes(source)
    if spans == [(0, len(source))]:
        return compile_expr(source[2:-1], at, offset + 2, scope, expected, live=live)
    if "${" in source:
        bare = re.sub(r"\$\{([^{}]*)\}", r"\1", source)
        start = offset + source.index("${")
        mark = at.mark_at(start, start + 2)
        fix = Fix(at.mark_at(offset, offset + len(source)), bare) if at.exact else None
        return poison(at, source), [Diagnostic("E015", mark, said, f"write: {bare}", fix=fix)]
    return compile_expr(source, at, offset, scope, expected, live=live)


def narrows(expr: Expr) -> frozenset[str]:
    """Return the names that are certainly set when the condition is true: `is_set(x)`, and-chains of it."""
    return _facts(expr)[0]


def narrows_when_false(expr: Expr) -> frozenset[str]:
    """Return the names that are certainly set when the condition is false: `not is_set(x)`, or-chains of it."""
    return _facts(expr)[1]


def _facts(expr: Expr) -> tuple[frozenset[str], frozenset[str]]:
    try:
        parsed = parse_expression(expr.source)
    except ExprSyntax:
        return frozenset(), frozenset()
    return facts(parsed.root, parsed)


def compile_value(
    node: Node, scope: Scope, expected: Type, *, what: str = "", optional: bool = False
) -> tuple[Expr, list[Diagnostic]]:
    """Compile a value of an expected type.

    Args:
        node: literal text read by the type, a YAML list or mapping where the type has such a form, or `${...}`.
        scope: the names visible there.
        expected: the type that is due; ANY takes the type from the literal.
        what: the key or field it is for, named in messages.
        optional: the whole value may be absent, so `${robot}` of an optional param is fine (`run` raises Unset).
    """
    return read_value(node, scope, expected, what=what, optional=optional)


def compile_words(node: Node, scope: Scope, what: str) -> tuple[Expr, list[Diagnostic]]:
    """Compile a text that people read: a value in it, or that is all of it, is shown as people read values."""
    return read_words(node, scope, what)
