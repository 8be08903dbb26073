"""Bind the arguments of a helper's call and find the type of its result. Called by the checker.

Several forms of one helper are tried in order; the first that the arguments fit is taken, and the explanation of a
refusal is that of the form which came furthest.
"""

from collections.abc import Sequence

from msgspec import Struct

from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.helpers import REQUIRED, Arg, Helper
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.typed import Mismatch, Typed, constant, did_you_mean, is_measure, mismatch
from formiga_bt.lang.expr.typing_rules import POINTS, QUANTITIES, fits, in_words, join
from formiga_bt.lang.model import EvalError
from formiga_bt.lang.types import ANY, Type


class BoundCall(Struct, frozen=True):
    """A helper with its arguments in order, defaults filled in, and the type of the result."""

    helper: Helper
    args: list[Typed]
    returns: Type


def never_anywhere(bound: BoundCall) -> str:
    """Return why a call has no value wherever its points are, "" if it may have one: `circle(spot, 30 m, 2)`."""
    open_ = [arg for arg in bound.args if not arg.is_const]
    points = all(arg.type.name in ("place", "position") for arg in open_)
    if not open_ or not points or bound.helper.needs_env or len(open_) == len(bound.args):
        return ""
    reason = ""
    for which in range(2):
        values = [
            _somewhere(arg.type, at + 7 * which) if not arg.is_const else arg.const for at, arg in enumerate(bound.args)
        ]
        try:
            bound.helper.run(*values)
        except EvalError as error:
            reason = error.reason
        else:
            return ""
    return reason


def _somewhere(type_: Type, which: int) -> Place | Position:
    east, north = 131.0 * which, 89.0 - 43.0 * which
    return Place(east, north) if type_.name == "place" else Position(east, north, 60.0)


Problem = tuple[Typed | None, Mismatch]
"""The argument that is wrong (None: the call as a whole) and why."""


def bind(
    forms: Sequence[Helper], positional: Sequence[Typed], keywords: dict[str, Typed], scope: Scope
) -> BoundCall | Problem:
    """Return the form of a helper that takes these arguments, or the problem of the best of them."""
    best: tuple[int, Problem] | None = None
    for helper in forms:
        placed = _place(helper, positional, keywords)
        if isinstance(placed, Mismatch):
            rank, problem = 0, _whole(placed)
        else:
            result = _typed(helper, placed, scope)
            if isinstance(result, BoundCall):
                return result
            rank, problem = 1, result
        if best is None or rank > best[0]:
            best = rank, problem
    assert best is not None, "a helper has at least one form"
    return best[1]


def _whole(why: Mismatch) -> Problem:
    return None, why


def _place(
    helper: Helper, positional: Sequence[Typed], keywords: dict[str, Typed]
) -> list[tuple[Arg, Typed]] | Mismatch:
    """Pair values with arguments."""
    mend = helper.signature
    pairs: list[tuple[Arg, Typed]] = []
    by_name = {arg.name: arg for arg in helper.args}
    rest = bool(helper.args) and helper.args[-1].rest
    if len(positional) > len(helper.args) and not rest:
        said = f"{helper.name} takes {len(helper.args)} argument{'s' * (len(helper.args) != 1)}, not {len(positional)}"
        return Mismatch("E012", said, mend)
    for index, value in enumerate(positional):
        pairs.append((helper.args[min(index, len(helper.args) - 1)], value))
    given = {arg.name for arg, _ in pairs}
    for name, value in keywords.items():
        if name not in by_name:
            said = f"{helper.name} has no argument '{name}'{did_you_mean(name, by_name)}"
            return Mismatch("E012", said, mend)
        if name in given:
            return Mismatch("E012", f"'{name}' is given twice", mend)
        pairs.append((by_name[name], value))
        given.add(name)
    missing = [arg.name for arg in helper.args if arg.name not in given and arg.default is REQUIRED]
    if missing:
        return Mismatch("E012", f"{helper.name} misses '{missing[0]}'", mend)
    return pairs


def _typed(helper: Helper, pairs: list[tuple[Arg, Typed]], scope: Scope) -> BoundCall | Problem:
    bound: dict[str, Type] = {}
    for arg, value in pairs:
        why = _unify(arg, arg.type, value, value.type, bound, scope)
        if why is not None:
            return value, why
    given = {arg.name for arg, _ in pairs}
    order = {arg.name: index for index, arg in enumerate(helper.args)}
    values = [(order[arg.name], value) for arg, value in pairs]
    for arg in helper.args:
        if arg.name not in given:
            filled = Typed(arg.type, constant(arg.default), 0, 0, "", const=arg.default)
            values.append((order[arg.name], filled))
    args = [value for _, value in sorted(values, key=lambda pair: pair[0])]
    return BoundCall(helper, args, _resolve(helper.returns, bound))


def _unify(arg: Arg, want: Type, value: Typed, have: Type, bound: dict[str, Type], scope: Scope) -> Mismatch | None:
    """Bind the pseudo-types of an argument; return why the value does not fit, or None."""
    if have.name == "any":
        return None
    if want.name == "list" and have.name == "list" and want.item is not None and want.item.name.startswith("$"):
        return _unify(arg, want.item, value, have.item or ANY, bound, scope)
    if want.name == "list" and want.item is not None and want.item.name.startswith("$"):
        return Mismatch("E013", f"'{arg.name}' is due a list, this is {in_words(have)}", "lists stand in [ ]")
    if want.name == "$point":
        return _unify_point(arg, value, have, bound, scope)
    if want.name == "$quantity":
        return _unify_quantity(arg, value, have, bound, scope)
    if want.name == "$agent":
        if have.name != "agent":
            return Mismatch("E013", f"'{arg.name}' is due an agent, this is {in_words(have)}")
        bound["$agent"] = join(bound.get("$agent", have), have) or ANY
        return None
    if want.name == "$item":
        joined = join(bound.get("$item", have), have)
        if joined is None:
            said = f"the items of a list are of one type, these are {in_words(bound['$item'])} and {in_words(have)}"
            return Mismatch("E013", said)
        bound["$item"] = joined
        return None
    if want.name == "$value":
        bound["$value"] = have
        return None
    return None if fits(have, want) else mismatch(value, want, scope, arg.name)


def _unify_point(arg: Arg, value: Typed, have: Type, bound: dict[str, Type], scope: Scope) -> Mismatch | None:
    if have.name not in POINTS:
        if value.literal == "text" and scope.type_of(str(value.const)) is not None:
            return mismatch(value, Type("place"), scope, arg.name)
        return Mismatch("E013", f"'{arg.name}' is due a place or a position, this is {in_words(have)}")
    known = bound.setdefault("$point", have)
    if known.name == have.name:
        return None
    wanted = known if value.type.name != "list" else Type("list", item=known)
    return mismatch(value, wanted, scope, arg.name)


def _unify_quantity(arg: Arg, value: Typed, have: Type, bound: dict[str, Type], scope: Scope) -> Mismatch | None:
    if not is_measure(have):
        return Mismatch("E013", f"'{arg.name}' is due a number or a quantity, this is {in_words(have)}")
    known = bound.get("$quantity", have)
    joined = join(known, have)
    if joined is None:
        if value.literal == "number" and known.name in QUANTITIES:
            return mismatch(value, known, scope)
        return Mismatch("E013", f"cannot mix {in_words(known)} and {in_words(have)}")
    bound["$quantity"] = joined
    return None


def _resolve(type_: Type, bound: dict[str, Type]) -> Type:
    if type_.name == "list" and type_.item is not None:
        return Type("list", item=_resolve(type_.item, bound))
    return bound.get(type_.name, ANY) if type_.name.startswith("$") else type_
