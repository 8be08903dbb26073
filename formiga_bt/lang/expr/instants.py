"""Deadlines of live conditions: the instants at which a comparison with `now` changes its value.

A live condition is watched, never polled: what it reads wakes it, and for `now` it must be known beforehand when that will
be. So `now` may only stand in a comparison in which it counts once, and the rest must not change while the condition is
watched (`now > t`, `now - t0 > 5 min`); all else is E068. The instant is found with the comparison's own code, so that it
is exact to the microsecond however the numbers are rounded. What depends on the day is looked at at each midnight. Called by
`expressions` for conditions compiled as live.
"""

import ast
from collections.abc import Callable, Iterable, Iterator
from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.lang.expr.around import EnvWith
from formiga_bt.lang.expr.daytime import TODAY, next_midnight
from formiga_bt.lang.expr.members import type_read
from formiga_bt.lang.expr.parts import NOW, Compared, Parts
from formiga_bt.lang.expr.tokens import Parsed
from formiga_bt.lang.expr.typed import Run
from formiga_bt.lang.model import Dependency, Env, EvalError, UnknownState, Unset

_CONSTANT_FIELDS: Final = frozenset({"", "id", "type"})
_WIDEST: Final = 2**40
_SUCH_AS: Final = "such as: now > t, or now - t > 5 min, with a t that stays the same"

Instant = Callable[[Env], Micros]


def deadlines(checker: Parts, reads: Iterable[Dependency], volatile: frozenset[str]) -> tuple[Instant, ...]:
    """Return the instants of a checked condition, having reported E068 for what has none.

    Args:
        checker: after its check, without problems so far.
        reads: what the condition reads.
        volatile: names that may be written while the condition is watched.
    """
    reads = tuple(reads)
    parsed, report = checker.parsed, checker.problems.report
    for node in _strays(parsed.root, parsed):
        start, end = parsed.span(node)
        report("E068", start, end, "'now' has no exact deadline here", _SUCH_AS)
    for node in _ages(parsed.root, parsed) if any(read.field == "age" for read in reads) else ():
        start, end = parsed.span(node)
        what = "an agent's age grows without any news, so nothing wakes this condition"
        report("E068", start, end, what, "read it once, with check: or when:, or each round, with until:")
    if checker.problems.found:
        return ()
    found = []
    for compared in checker.compared:
        why = _refused(compared, parsed, volatile)
        if why:
            report("E068", compared.left.start, compared.right.end, why, _SUCH_AS)
        else:
            found.append(_instant(compared, _slope(compared, parsed) or 1))
    return (*found, _midnight) if TODAY in reads else tuple(found)


def _midnight(env: Env) -> Micros:
    """Return when `today(..)`, `sunrise(..)` and `sunset(..)` are those of another day."""
    try:
        return next_midnight(env)
    except EvalError:
        return 0


def _refused(compared: Compared, parsed: Parsed, volatile: frozenset[str]) -> str:
    if compared.of_items:
        return "the deadline of 'now' differs from item to item"
    types = {compared.left.type.name, compared.right.type.name}
    if not types & {"time", "duration"} or _slope(compared, parsed) not in (1, -1):
        return "'now' has no exact deadline here"
    if compared.op not in ("<", "<=", ">", ">="):
        return f"'now' is compared with '{compared.op}', which holds for no length of time; use < or >="
    for read in compared.left.reads + compared.right.reads:
        if read != NOW and (read.field not in _CONSTANT_FIELDS or read.name in volatile or type_read(read)):
            what = read.name if type_read(read) else f"'{read.name}.{read.field}'" if read.field else f"'{read.name}'"
            return f"the deadline of 'now' depends on {what}, which may change while this is watched"
    return ""


def _is_now(node: ast.AST, parsed: Parsed) -> bool:
    return isinstance(node, ast.Name) and parsed.token(node.id).text == "now" and parsed.token(node.id).kind == "name"


def _strays(node: ast.AST, parsed: Parsed) -> Iterator[ast.AST]:
    """Iterate over each `now` that stands in no comparison."""
    if _is_now(node, parsed):
        yield node
    if not isinstance(node, ast.Compare):
        for child in ast.iter_child_nodes(node):
            yield from _strays(child, parsed)


def _ages(root: ast.AST, parsed: Parsed) -> list[ast.Attribute]:
    found = [node for node in ast.walk(root) if isinstance(node, ast.Attribute)]
    return [node for node in found if parsed.token(node.attr).text == "age"]


def _slope(compared: Compared, parsed: Parsed) -> int | None:
    """Return how often `now` counts in `left - right`; None if not linearly."""
    left, right = (_coefficient(node, parsed) for node in compared.nodes)
    return None if left is None or right is None else left - right


def _coefficient(node: ast.AST, parsed: Parsed) -> int | None:
    if _is_now(node, parsed):
        return 1
    match node:
        case ast.Compare():
            return 0
        case ast.BinOp(left=a, right=b, op=op):
            x, y = _coefficient(a, parsed), _coefficient(b, parsed)
            if x is None or y is None:
                return None
            if isinstance(op, ast.Add):
                return x + y
            if isinstance(op, ast.Sub):
                return x - y
            return 0 if x == y == 0 else None
        case ast.UnaryOp(op=ast.USub(), operand=a):
            x = _coefficient(a, parsed)
            return None if x is None else -x
        case ast.UnaryOp(operand=a):
            return _coefficient(a, parsed)
        case _:
            inside = [_coefficient(child, parsed) for child in ast.iter_child_nodes(node)]
            return 0 if all(x == 0 for x in inside) else None


def _instant(compared: Compared, slope: int) -> Instant:
    left, right = compared.left, compared.right
    unit = 1 if "time" in (left.type.name, right.type.name) else SECOND

    def instant(env: Env) -> Micros:
        try:
            now = env.name("now")
            assert isinstance(now, int), "`now` is an integer of microseconds"
            gap = left.run(env) - right.run(env)
            return _turn(compared.run, env, now - round(slope * gap * unit))
        except (Unset, UnknownState, EvalError, TypeError):
            return 0

    return instant


def _turn(run: Run, env: Env, near: Micros) -> Micros:
    """Return the first instant, close to `near`, with the value that the comparison has after it; 0 if it never turns."""
    width = 2
    while run(EnvWith(env, "now", near - width)) == (after := run(EnvWith(env, "now", near + width))):
        width *= 8
        if width > _WIDEST:
            return 0
    low, high = near - width, near + width
    while high - low > 1:
        middle = (low + high) // 2
        if run(EnvWith(env, "now", middle)) == after:
            high = middle
        else:
            low = middle
    return high
