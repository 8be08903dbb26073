"""What stands around the code of an expression when it runs: whoever has no value says where it is written, and why.

The checker knows most types before any run. A param of type `any`, and what is made of it, is only known when it runs: there
a value of another type than is due is an `EvalError` too, so that nothing else comes out of an expression.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.expr.typed import Run
from formiga_bt.lang.expr.typing_rules import QUANTITIES, in_words
from formiga_bt.lang.model import Env, EvalError, Expr, Unset
from formiga_bt.lang.types import AgentRef, Type

_CLASSES: Final[Mapping[str, tuple[type, ...]]] = MappingProxyType(
    {
        **dict.fromkeys(("number", *sorted(QUANTITIES)), (int, float)),
        **dict.fromkeys(("int", "time"), (int,)),
        **dict.fromkeys(("record", "names"), (dict,)),
        "bool": (bool,),
        "text": (str, bool, int, float),
        "place": (Place,),
        "position": (Position,),
        "region": (Region,),
        "agent": (AgentRef,),
    }
)
"""Of values, by the name of a type; a text may be made of anything short."""


def named(run: Run, source: str, mark: Mark) -> Run:
    """Return the code that says of an error in which expression it was, and where that stands: the innermost one."""

    def name(env: Env) -> Any:
        try:
            return run(env)
        except (EvalError, Unset) as error:
            if error.of is None:
                error.of = source, mark
            raise

    return name


def guarded(run: Run) -> Run:
    """Return the code with errors of unknown types (a param of type `any`) turned into EvalError."""

    def guard(env: Env) -> Any:
        try:
            return run(env)
        except (TypeError, AttributeError, ValueError, ArithmeticError, LookupError) as error:
            raise EvalError(f"a value has the wrong type here ({type(error).__name__})") from error

    return guard


def is_open(type_: Type) -> bool:
    """Return whether a type, or what it is made of, is only known at run time."""
    parts = (*((type_.item,) if type_.item is not None else ()), *type_.fields.values())
    return type_.name == "any" or any(is_open(part) for part in parts)


def of_type(run: Run, due: Type) -> Run:
    """Return the code with a value of another type than is due turned into EvalError."""

    def check(env: Env) -> Any:
        value = run(env)
        if not is_of(value, due):
            shown = repr(value)
            raise EvalError(f"{in_words(due)} is due here, not {shown if len(shown) <= 60 else shown[:57] + '...'}")
        return value

    return check


def sure_of_type(expr: Expr, due: Type) -> Expr:
    """Return an expression whose type is only known at run time with that check; any other as it is."""
    if not is_open(expr.type) or expr.is_const:
        return expr
    return replace(expr, run=named(of_type(expr.run, due), expr.source, expr.mark))


def is_of(value: Any, due: Type) -> bool:
    """Return whether a value may stand where a type is due. Of an agent it is not known which type it is."""
    if due.name == "list":
        return isinstance(value, tuple) and all(due.item is None or is_of(part, due.item) for part in value)
    if due.name in ("enum", "literal"):
        return isinstance(value, str) and (not due.values or value in due.values)
    classes = _CLASSES.get(due.name)
    return classes is None or (isinstance(value, classes) and (bool in classes or not isinstance(value, bool)))
