"""W098 of conditions: true, or false, whatever the values are that they compare with constants.

A condition is worked out for all that its parts can be: between the bounds of a param or of a form's field, a charge of 0 % to
100 %, a length of 0 or more. Only so many values are tried as its constants tell apart. A second time the defaults of params
count as constants: bounds of one value that contradict each other by default (`from` 20:00 `until` 06:00, of one day) were
hardly meant so.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import pairwise, product
from types import MappingProxyType
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.units import format_quantity
from formiga_bt.lang.expr.tokens import ExprSyntax, Parsed, parse_expression
from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model import Ask, Expr, Param, Step
from formiga_bt.lang.walk import children

Words = tuple[str, str]
"""What is wrong, and what helps."""
_Constant = float | str
_Tried = Mapping[str, Any]
"""A part of a condition, as it is written -> what it is taken to be."""

_MOST: Final = 2_000
"""So many ways in which parts can turn out are tried."""
_CLOCK: Final = re.compile(r"(\d{2}):(\d{2})(?::(\d{2}))?")
_COMPARE: Final[Mapping[type[ast.AST], Callable[[Any, Any], bool]]] = MappingProxyType(
    {
        ast.Eq: operator.eq,
        ast.NotEq: operator.ne,
        ast.Lt: operator.lt,
        ast.LtE: operator.le,
        ast.Gt: operator.gt,
        ast.GtE: operator.ge,
    }
)


class Range(Struct, frozen=True):
    """What a number can be."""

    least: float = -math.inf
    most: float = math.inf
    whole: bool = False
    told: str = ""
    """In words, such as `at most 20`."""

    def tries(self, cuts: Iterable[float]) -> list[float]:
        """Return numbers in it, one for each part into which the cuts divide it, and the cuts."""
        ends = [end for end in (self.least, self.most) if math.isfinite(end)]
        near = (
            {round_(cut) for cut in (*cuts, *ends) for round_ in (math.floor, math.ceil)}
            if self.whole
            else {*cuts, *ends}
        )
        points = sorted(point for point in near if self.least <= point <= self.most)
        if not points:
            return [0.0]
        between = [math.floor(a) + 1 if self.whole else (a + b) / 2 for a, b in pairwise(points)]
        beyond = [points[0] - 1] * (self.least == -math.inf) + [points[-1] + 1] * (self.most == math.inf)
        return sorted({*points, *between, *beyond})


_ANYTHING: Final = Range()
_NOT_LESS_THAN_0: Final = Range(0.0, told="never less than 0")


class Ranges:
    """Works out the conditions of one body.

    Args:
        params: that it reads.
        steps: of the body, which save what people fill in.
    """

    def __init__(self, params: Mapping[str, Param], steps: Iterable[Step]) -> None:
        self._known = {name: bounds for name, param in params.items() if (bounds := _of_param(param)) is not None}
        self._defaults = {name: value for name, param in params.items() if (value := _default(param)) is not None}
        self._shown = {name: param.default.source for name, param in params.items() if param.default is not None}
        self._forms: dict[str, tuple[FormField, ...]] = {}
        for name, form in _saved(steps):
            self._forms[name] = form if self._forms.get(name, form) == form else ()

    def foregone(self, expr: Expr, parsed: Parsed, form: tuple[FormField, ...] = ()) -> Words | None:
        """Return what is wrong with a condition that always turns out alike; `form` belongs to its `result`."""
        if expr.type.name != "bool" or expr.is_const:
            return None
        forms = {**self._forms, "result": form}
        plain = _Condition(parsed, {}, lambda node: self.range_of(node, parsed, forms))
        end = plain.turns_out()
        if end is not None:
            told = "; ".join(f"'{part}' is {bounds.told}" for part, bounds in plain.ranges.items() if bounds.told)
            why = f": {told}" if told else ", whatever is compared"
            return f"this is {_always(end)}{why}", "compare with another value, or take the condition away"
        by_default = _Condition(parsed, self._defaults, lambda _: _ANYTHING)
        end = by_default.turns_out()
        if end is None or len(by_default.used) < 2:
            return None
        told = " and ".join(f"{name} ({self._shown[name]})" for name in by_default.used)
        return f"with the defaults of {told} this is {_always(end)}", "mend a default, or the comparison"

    def range_of(self, node: ast.AST, parsed: Parsed, forms: Mapping[str, tuple[FormField, ...]]) -> Range:
        """Return what a part of a condition can be."""
        match node:
            case ast.Name(id=name):
                return self._known.get(parsed.token(name).text, _ANYTHING)
            case ast.Attribute(value=ast.Name(id=owner), attr=attr):
                word = parsed.token(attr).text
                fields = forms.get(parsed.token(owner).text, ())
                field = next((one for one in fields if one.name == word), None)
                if field is not None:
                    return _bounded(field.type, field.least, field.most)
                return Range(0.0, 100.0, told="0 % to 100 %") if word == "battery" else _ANYTHING
            case ast.Call(func=ast.Name(id=name)):
                helper = parsed.token(name).text
                if helper == "len":
                    return Range(0.0, whole=True, told=_NOT_LESS_THAN_0.told)
                return _NOT_LESS_THAN_0 if helper == "distance" else _ANYTHING
            case _:
                return _ANYTHING


def may_be(turned: Mapping[str, bool]) -> bool:
    """Return whether conditions may turn out so at one moment, all of them; what cannot be told may be."""
    try:
        parsed = parse_expression(" and ".join(f"{'' if holds else 'not '}({word})" for word, holds in turned.items()))
    except ExprSyntax:
        return True
    return _Condition(parsed, {}, lambda node: Ranges({}, ()).range_of(node, parsed, {})).turns_out() is not False


class _Condition:
    """One condition: which of its parts are compared with constants, and how it turns out.

    Args:
        parsed: the condition.
        given: names that count as constants, beside a part that is none.
        range_: what a part can be.
    """

    def __init__(self, parsed: Parsed, given: Mapping[str, float], range_: Callable[[ast.AST], Range]) -> None:
        self._parsed = parsed
        self._given = given
        self._cuts: dict[str, set[_Constant]] = {}
        self._leaves: dict[str, None] = {}
        self.ranges: dict[str, Range] = {}
        self.used: dict[str, None] = {}
        """Names that counted as constants."""
        self._range = range_
        self._collect(parsed.root)

    def turns_out(self) -> bool | None:
        """Return how it turns out, whatever its parts are; None = one way or the other."""
        tried = {leaf: [True, False] for leaf in self._leaves}
        tried |= {part: self._tries(part, cuts) for part, cuts in self._cuts.items()}
        if math.prod(map(len, tried.values())) > _MOST:
            return None
        ends = {self._truth(self._parsed.root, dict(zip(tried, one, strict=True))) for one in product(*tried.values())}
        return ends.pop() if len(ends) == 1 else None

    def _tries(self, part: str, cuts: set[_Constant]) -> list[Any]:
        numbers = [cut for cut in cuts if not isinstance(cut, str)]
        if not numbers:
            return [*cuts, ""]
        if part == "now":  # it is never just then
            return [one for one in _ANYTHING.tries(numbers) if one not in numbers]
        return list(self.ranges[part].tries(numbers))

    def _collect(self, node: ast.AST) -> None:
        match node:
            case ast.BoolOp(values=values):
                for value in values:
                    self._collect(value)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self._collect(operand)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                for one in (test, body, orelse):
                    self._collect(one)
            case ast.Compare():
                for left, _, right in _pairs(node):
                    self._compared(left, right)
            case _ if self._constant(node) is None:
                self._leaves[self._parsed.text(node)] = None

    def _compared(self, left: ast.AST, right: ast.AST) -> None:
        for part, other in ((left, right), (right, left)):
            constant = self._of(other, part)
            if constant is not None and self._of(part, other) is None:
                text = self._parsed.text(part)
                cuts = self._cuts.setdefault(text, set())
                cuts.add(constant)
                self.ranges[text] = self._range(part)
                if isinstance(other, ast.Name) and (name := self._parsed.token(other.id).text) in self._given:
                    self.used[name] = None
                return
        self._leaves[self._pair(left, right)] = None

    def _of(self, node: ast.AST, beside: ast.AST) -> _Constant | None:
        """Return the constant that a side of a comparison is; a name that is given counts only beside what is no constant."""
        constant = self._constant(node)
        if constant is not None or not isinstance(node, ast.Name):
            return constant
        name = self._parsed.token(node.id).text
        plain = isinstance(beside, ast.Name) and self._parsed.token(beside.id).text in self._given
        return None if plain or self._constant(beside) is not None else self._given.get(name)

    def _constant(self, node: ast.AST) -> _Constant | None:
        if isinstance(node, ast.Call):
            clock = _CLOCK.fullmatch(self._parsed.text(node).removeprefix("today(").strip("')\" "))
            return _seconds(clock) if clock is not None else None
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inner = self._constant(node.operand)
            return -inner if isinstance(inner, float) else None
        if not isinstance(node, ast.Name):
            return None
        token = self._parsed.token(node.id)
        if token.kind in ("number", "quantity"):
            return float(token.value)
        if token.kind == "text":
            return str(token.value)
        return float(token.value) if token.kind == "bool" else None

    def _pair(self, left: ast.AST, right: ast.AST) -> str:
        return f"{self._parsed.text(left)} ? {self._parsed.text(right)}"

    def _truth(self, node: ast.AST, tried: _Tried) -> bool | None:
        """Return how a part of the condition turns out; None = nobody knows."""
        match node:
            case ast.BoolOp(op=op, values=values):
                ends = [self._truth(value, tried) for value in values]
                short = isinstance(op, ast.Or)
                return short if short in ends else None if None in ends else not short
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                end = self._truth(operand, tried)
                return None if end is None else not end
            case ast.IfExp(test=test, body=body, orelse=orelse):
                end = self._truth(test, tried)
                ways = [self._truth(one, tried) for one in ([body] * (end is not False) + [orelse] * (end is not True))]
                return ways[0] if len(set(ways)) == 1 else None
            case ast.Compare():
                ends = [self._compare(*pair, tried) for pair in _pairs(node)]
                return False if False in ends else None if None in ends else True
            case _:
                constant = self._constant(node)
                return bool(tried[self._parsed.text(node)]) if constant is None else bool(constant)

    def _compare(self, left: ast.AST, op: ast.cmpop, right: ast.AST, tried: _Tried) -> bool | None:
        compare = _COMPARE.get(type(op))
        sides = [self._side(one, other, tried) for one, other in ((left, right), (right, left))]
        if compare is None or None in sides or isinstance(sides[0], str) is not isinstance(sides[1], str):
            return None
        return compare(*sides)

    def _side(self, node: ast.AST, beside: ast.AST, tried: _Tried) -> Any:
        constant = self._of(node, beside)
        return tried.get(self._parsed.text(node)) if constant is None else constant


def _pairs(node: ast.Compare) -> Iterator[tuple[ast.expr, ast.cmpop, ast.expr]]:
    sides = (node.left, *node.comparators)
    for index, op in enumerate(node.ops):
        yield sides[index], op, sides[index + 1]


def _always(end: bool) -> str:
    return "always true" if end else "never true"


def _of_param(param: Param) -> Range | None:
    least, most = (_number(one) for one in (param.min, param.max))
    return None if least is most is None else _bounded(param.type.name, least, most)


def _bounded(kind: str, least: float | None, most: float | None) -> Range:
    words = [
        f"at {word} {format_quantity(kind, end)}" for word, end in (("least", least), ("most", most)) if end is not None
    ]
    return Range(
        -math.inf if least is None else least, math.inf if most is None else most, kind == "int", " and ".join(words)
    )


def _number(expr: Expr | None) -> float | None:
    const = expr.const if expr is not None and expr.is_const else None
    return float(const) if isinstance(const, int | float) and not isinstance(const, bool) else None


def _default(param: Param) -> float | None:
    """Return the default of a param as a number; of a time of the day its seconds."""
    clock = _CLOCK.fullmatch(param.default.source) if param.default is not None and param.type.name == "time" else None
    return _seconds(clock) if clock is not None else _number(param.default)


def _seconds(clock: re.Match[str]) -> float:
    return int(clock[1]) * 3600.0 + int(clock[2]) * 60.0 + int(clock[3] or 0)


def _saved(steps: Iterable[Step]) -> Iterator[tuple[str, tuple[FormField, ...]]]:
    """Iterate over the names that steps save, with what a person filled in for each; nothing of other steps."""
    for step in steps:
        name = getattr(step, "save_as", "")
        if name:
            yield name, step.form if isinstance(step, Ask) else ()
        yield from _saved(children(step))
