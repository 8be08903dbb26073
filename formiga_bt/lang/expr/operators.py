"""The code of operators: closures over the environment, each with bounded results.

Numbers stay within 2**53 (engine times do too); anything else, division by zero included, is an `EvalError`. Called by
the checker after types are known, so no closure tests a type. One comparison costs well under a microsecond.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.typed import Run, Typed, constant
from formiga_bt.lang.model import NOT_CONST, Env, EvalError, Unset
from formiga_bt.lang.types import AgentRef

LIMIT: Final = 2**53

SYMBOLS: Final[Mapping[type[ast.AST], str]] = MappingProxyType(
    {
        ast.Add: "+",
        ast.Sub: "-",
        ast.Mult: "*",
        ast.Div: "/",
        ast.FloorDiv: "//",
        ast.Eq: "==",
        ast.NotEq: "!=",
        ast.Lt: "<",
        ast.LtE: "<=",
        ast.Gt: ">",
        ast.GtE: ">=",
        ast.In: "in",
        ast.NotIn: "not in",
    }
)
_COMPARE: Final[Mapping[str, Callable[[Any, Any], bool]]] = MappingProxyType(
    {
        "==": operator.eq,
        "!=": operator.ne,
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
        "in": lambda item, items: item in items,
        "not in": lambda item, items: item not in items,
    }
)


def bounded(value: Any) -> Any:
    """Return a number, or refuse it: beyond 2**53, or not a number at all."""
    if -LIMIT <= value <= LIMIT:
        return value
    raise EvalError("the number is too large")


def arithmetic_code(op: str, left: Typed, right: Typed) -> Run:
    """Return the code of `left op right`; the types are known to fit."""
    a, b = left.run, right.run
    if "time" in (left.type.name, right.type.name):
        return _time_code(op, left, right)
    match op:
        case "+":
            return lambda env: bounded(a(env) + b(env))
        case "-":
            return lambda env: bounded(a(env) - b(env))
        case "*":
            return lambda env: bounded(a(env) * b(env))
        case "/":
            return lambda env: _divided(a(env), b(env))
        case _:
            return lambda env: _floored(
                a(env), b(env), whole=left.type.name != "number" and right.type.name != "number"
            )


def _time_code(op: str, left: Typed, right: Typed) -> Run:
    a, b = left.run, right.run
    if left.type.name == "time" and right.type.name == "time":
        return lambda env: (a(env) - b(env)) / SECOND
    if left.type.name == "time":
        sign = SECOND if op == "+" else -SECOND
        return lambda env: bounded(a(env) + round(b(env) * sign))
    return lambda env: bounded(b(env) + round(a(env) * SECOND))


def _divided(a: Any, b: Any) -> Any:
    if b == 0:
        raise EvalError("division by zero")
    return bounded(a / b)


def _floored(a: Any, b: Any, *, whole: bool) -> Any:
    if b == 0:
        raise EvalError("division by zero")
    result = bounded(a // b)
    return int(result) if whole else result


def compare_code(op: str, left: Typed, right: Typed) -> Run:
    """Return the code of one comparison, shorter where a side is constant."""
    compare = _COMPARE[op]
    a, b = left.run, right.run
    if right.const is not NOT_CONST:
        fixed = right.const
        match op:
            case ">":
                return lambda env: a(env) > fixed
            case "<":
                return lambda env: a(env) < fixed
            case "==":
                return lambda env: a(env) == fixed
        return lambda env: compare(a(env), fixed)
    return lambda env: compare(a(env), b(env))


def all_code(parts: list[Run]) -> Run:
    """Return the code of `a and b and ...`."""
    if len(parts) == 2:
        a, b = parts
        return lambda env: a(env) and b(env)
    return lambda env: all(part(env) for part in parts)


def any_code(parts: list[Run]) -> Run:
    """Return the code of `a or b or ...`."""
    if len(parts) == 2:
        a, b = parts
        return lambda env: a(env) or b(env)
    return lambda env: any(part(env) for part in parts)


def name_code(name: str) -> Run:
    """Return the code that reads a name."""

    def run(env: Env) -> Any:
        value = env.name(name)
        if value is None:
            raise Unset(name)
        return value

    return run


def agent_field_code(agent: Run, name: str) -> Run:
    """Return the code that reads an agent's field as last known; its id is always known."""
    if name == "id":
        return lambda env: agent(env).id

    def run(env: Env) -> Any:
        ref = agent(env)
        assert isinstance(ref, AgentRef), "the checker lets only agents through"
        value = env.agent_field(ref, name)
        if value is None:
            raise Unset(name)
        return value

    return run


def record_field_code(record: Run, name: str) -> Run:
    """Return the code that reads a field of a record; a missing one is unset."""

    def run(env: Env) -> Any:
        value = record(env).get(name)
        if value is None:
            raise Unset(name)
        return value

    return run


def is_there_code(field: Run) -> Run:
    """Return the code that tells whether a field has a value."""

    def run(env: Env) -> bool:
        try:
            field(env)
        except Unset:
            return False
        return True

    return run


def any_field_code(owner: Run, name: str) -> Run:
    """Return the code of a field of a value whose type is only known at run time."""

    def run(env: Env) -> Any:
        value = owner(env)
        if isinstance(value, AgentRef):
            return agent_field_code(constant(value), name)(env)
        if isinstance(value, dict):
            return record_field_code(constant(value), name)(env)
        if isinstance(value, (Place, Position)) and name in ("lat", "lng", "height"):
            return point_field_code(constant(value), name)(env)
        raise EvalError(f"there is no field '{name}'")

    return run


def point_field_code(point: Run, name: str) -> Run:
    """Return the code of `.lat`, `.lng` and `.height` (over the base's ground)."""
    if name == "height":
        return lambda env: point(env).up_m
    index = 0 if name == "lat" else 1
    return lambda env: env.lat_lng(point(env))[index]


def item_code(items: Run, index: Run) -> Run:
    """Return the code of `list[index]`."""

    def run(env: Env) -> Any:
        found, at = items(env), index(env)
        if not 0 <= at < len(found):
            raise EvalError(f"the list has {len(found)} items, there is no [{at}]")
        return found[at]

    return run


def call_code(call: Callable[..., Any], args: list[Run], *, needs_env: bool) -> Run:
    """Return the code of a helper's call."""
    if needs_env:
        return lambda env: call(env, *[arg(env) for arg in args])
    if len(args) == 1:
        only = args[0]
        return lambda env: call(only(env))
    return lambda env: call(*[arg(env) for arg in args])
