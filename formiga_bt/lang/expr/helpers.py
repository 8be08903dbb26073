"""The helpers that an expression may call: a registry of pure, typed functions.

A helper declares its arguments as the author sees them; the checker binds and types a call before anything runs.
Pseudo-types: `$point` (a place or a position, the same for all such arguments of one call), `$quantity` (a number,
a quantity or a time), `$agent` (the result has the types of the argument), `$item` (of a list), `$value`
(any). A further helper is one `Helper` in the tuples below, or of a registry of one's own given to `Scope`.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final

from msgspec import Struct

from formiga_bt.lang.expr import chance, daytime, item_calls, members, region_shapes, shapes
from formiga_bt.lang.model import EvalError
from formiga_bt.lang.types import (
    ANGLE,
    BOOL,
    DISTANCE,
    INT,
    NUMBER,
    PLACE,
    POSITION,
    REGION,
    TEXT,
    TIME,
    Type,
    list_of,
)

REQUIRED: Final[Any] = object()
"""Default of an argument that must be given."""

AGENT: Final = Type("$agent")
POINT: Final = Type("$point")
QUANTITY: Final = Type("$quantity")
ITEM: Final = Type("$item")
VALUE: Final = Type("$value")


class Arg(Struct, frozen=True):
    """An argument of a helper. `rest` takes one or more values and is the last."""

    name: str
    type: Type
    default: Any = REQUIRED
    rest: bool = False


class Helper(Struct, frozen=True):
    """A pure function with its types; with `needs_env` it gets the environment first. May raise only `EvalError`."""

    name: str
    args: tuple[Arg, ...]
    returns: Type
    run: Callable[..., Any]
    help: str
    needs_env: bool = False
    daily: bool = False
    """Its value depends on the day of `now`."""
    of_task: bool = False
    """Its value depends on the task that reads it, so there is none before there is a task."""
    refuses: Callable[[Any], str] | None = None
    """Tells why a constant first argument is none, or ""."""
    looks_at: str = ""
    """Field of the agents given that it reads."""
    each: bool = False
    """Its second argument is read for each item of the first, under the name `item`; `run` gets the items and what was read."""

    @property
    def signature(self) -> str:
        """Return how it is called: `circle(center, radius, points=24, start=0)`."""
        shown = (
            a.name + ("..." if a.rest else "") + ("" if a.default is REQUIRED else f"={a.default:g}") for a in self.args
        )
        return f"{self.name}({', '.join(shown)})"


class Helpers:
    """Helpers by name; several of one name are forms of one helper, tried in order."""

    def __init__(self, helpers: Iterable[Helper]) -> None:
        forms: dict[str, list[Helper]] = {}
        for helper in helpers:
            forms.setdefault(helper.name, []).append(helper)
        self._forms: Mapping[str, tuple[Helper, ...]] = MappingProxyType({k: tuple(v) for k, v in forms.items()})

    def forms(self, name: str) -> tuple[Helper, ...]:
        """Return the forms of a helper, empty if there is none of that name."""
        return self._forms.get(name, ())

    def names(self) -> tuple[str, ...]:
        """Return the names of all helpers, with `is_set`, which the checker itself knows."""
        return (*self._forms, "is_set")

    def reserved(self) -> tuple[str, ...]:
        """Return the names that no author may give; `where` and its like are plain words, and only calls of them are calls."""
        return tuple(name for name in self.names() if not any(form.each for form in self.forms(name)))


def _floor_mod(a: float, b: float) -> float:
    if b == 0:
        raise EvalError("division by zero")
    return a % b


def _whole(x: float) -> int:
    return round(x)


def _rounded(x: float, digits: int = 0) -> float:
    if not -9 <= digits <= 9:
        raise EvalError(f"round takes -9 to 9 digits, not {digits}")
    return round(x, digits)


def _range(n: int) -> tuple[int, ...]:
    if not 0 <= n <= 1000:
        raise EvalError(f"range takes 0 to 1000, not {n}")
    return tuple(range(n))


def _whole_list(items: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(items) > item_calls.MOST_ITEMS:
        raise EvalError(f"a list of {len(items)} items is too long, {item_calls.MOST_ITEMS} are the most")
    return items


def _end(which: int, name: str) -> Callable[[tuple[Any, ...]], Any]:
    def run(items: tuple[Any, ...]) -> Any:
        if not items:
            raise EvalError(f"{name} of an empty list")
        return items[which]

    return run


def _extreme(pick: Callable[[Iterable[Any]], Any], name: str) -> Callable[[tuple[Any, ...]], Any]:
    def run(items: tuple[Any, ...]) -> Any:
        if not items:
            raise EvalError(f"{name} of an empty list")
        return pick(items)

    return run


def _several(pick: Callable[[Iterable[Any]], Any]) -> Callable[..., Any]:
    return lambda *items: pick(items)


def _sum(items: tuple[float, ...]) -> float:
    return sum(items) if all(isinstance(item, int) for item in items) else math.fsum(items)


_P, _Q = Arg("p", POINT), Arg("x", QUANTITY)
_A_B = (Arg("a", POINT), Arg("b", POINT))
_EAST_NORTH = (Arg("east", DISTANCE, 0.0), Arg("north", DISTANCE, 0.0))
_CENTER = (Arg("center", POINT), Arg("radius", DISTANCE))
_REGION, _ITEMS = Arg("region", REGION), Arg("items", list_of(ITEM))

_POINTS: Final = (
    Helper("above", (Arg("place", PLACE), Arg("height", DISTANCE)), POSITION, shapes.above,
           "the position this high over the ground at the place", needs_env=True),
    Helper("at_height", (Arg("place", PLACE), Arg("height", DISTANCE)), POSITION, shapes.at_height,
           "the position over the place, this high over the base's ground"),
    Helper("ground", (Arg("position", POSITION),), PLACE, shapes.ground, "the place straight below"),
    Helper("offset", (Arg("p", PLACE), *_EAST_NORTH), PLACE, shapes.moved, "the place so far east and north"),
    Helper("offset", (Arg("p", POSITION), *_EAST_NORTH, Arg("up", DISTANCE, 0.0)), POSITION, shapes.moved,
           "the position so far east, north and up"),
    Helper("toward", (*_A_B, Arg("dist", DISTANCE)), POINT, shapes.toward, "the point so far from a toward b"),
    Helper("distance", _A_B, DISTANCE, shapes.between, "over ground between places, straight between positions"),
    Helper("bearing", _A_B, ANGLE, shapes.bearing, "direction from a to b, clockwise from north"),
    Helper("midpoint", _A_B, POINT, shapes.midpoint, "the point half way"),
    Helper("line", (*_A_B, Arg("n", INT)), list_of(POINT), shapes.line, "n points from a to b, both included"),
    Helper("circle", (*_CENTER, Arg("points", INT, 24), Arg("start", ANGLE, 0.0)), list_of(POINT), shapes.circle,
           "a closed circle: points + 1 points, clockwise"),
    Helper("polygon", (*_CENTER, Arg("sides", INT)), list_of(POINT), shapes.polygon,
           "the corners of a regular polygon, clockwise from north"),
    Helper("triangle", (Arg("corner", POINT), Arg("leg", DISTANCE), Arg("heading", ANGLE, 0.0)), list_of(POINT),
           shapes.triangle, "three points, the right angle first"),
    Helper("zigzag", (Arg("start", POINT), Arg("end", POINT), Arg("amplitude", DISTANCE), Arg("legs", INT)),
           list_of(POINT), shapes.zigzag, "legs + 1 points, exactly to the end"),
    Helper("nearest", (_P, Arg("list", list_of(POINT))), POINT, shapes.nearest, "the nearest of a list"),
    Helper("nearest", (_P, Arg("agents", list_of(AGENT))), AGENT, members.nearest_agent,
           "the nearest of those whose position is known", needs_env=True, looks_at="position"),
)  # fmt: skip

_REGIONS: Final = (
    Helper("lawnmower", (_REGION, Arg("spacing", DISTANCE), Arg("altitude", DISTANCE), Arg("angle", ANGLE, 0.0)),
           list_of(POSITION), region_shapes.lawnmower, "a path in lanes over the region", needs_env=True),
    Helper("split", (_REGION, Arg("parts", INT)), list_of(REGION), region_shapes.split, "parts of equal area"),
    Helper("split_by_area", (_REGION, Arg("max_area", NUMBER)), list_of(REGION), region_shapes.split_by_area,
           "equal parts, none larger than so many square metres"),
    Helper("centroid", (_REGION,), PLACE, region_shapes.centroid, "the centre of the region"),
    Helper("area", (_REGION,), NUMBER, region_shapes.area, "the area in square metres"),
    Helper("inside", (_P, _REGION), BOOL, region_shapes.inside, "whether the point is over the region"),
)  # fmt: skip

_NUMBERS: Final = (
    Helper("len", (_ITEMS,), INT, len, "how many items"),
    Helper("min", (Arg("items", list_of(QUANTITY)),), QUANTITY, _extreme(min, "min"), "the least of a list"),
    Helper("min", (_Q, Arg("others", QUANTITY, rest=True)), QUANTITY, _several(min), "the least"),
    Helper("max", (Arg("items", list_of(QUANTITY)),), QUANTITY, _extreme(max, "max"), "the greatest of a list"),
    Helper("max", (_Q, Arg("others", QUANTITY, rest=True)), QUANTITY, _several(max), "the greatest"),
    Helper("abs", (_Q,), QUANTITY, abs, "without its sign"),
    Helper("round", (Arg("x", NUMBER),), INT, _whole, "the nearest whole number"),
    Helper("round", (_Q, Arg("digits", INT, 0)), QUANTITY, _rounded, "rounded to so many digits"),
    Helper("sum", (Arg("items", list_of(QUANTITY)),), QUANTITY, _sum, "the sum of a list"),
    Helper("mod", (Arg("a", QUANTITY), Arg("b", QUANTITY)), QUANTITY, _floor_mod, "the remainder of a / b"),
    Helper("range", (Arg("n", INT),), list_of(INT), _range, "0, 1, .. n - 1"),
    Helper("first", (_ITEMS,), ITEM, _end(0, "first"), "the first item"),
    Helper("last", (_ITEMS,), ITEM, _end(-1, "last"), "the last item"),
    Helper("reverse", (_ITEMS,), list_of(ITEM), lambda items: items[::-1], "the list backwards"),
)  # fmt: skip

_LISTS: Final = (
    Helper("where", (_ITEMS, Arg("holds", BOOL)), list_of(ITEM), item_calls.where,
           "the items for which a condition over `item` holds: `where(finds, item.score > 3)`", each=True),
    Helper("count", (_ITEMS, Arg("holds", BOOL)), INT, item_calls.count, "for how many items it holds", each=True),
    Helper("each", (_ITEMS, Arg("value", VALUE)), list_of(VALUE), item_calls.each,
           "what an expression over `item` gives for each: `each(finds, item.spot)`", each=True),
    Helper("sort", (_ITEMS, Arg("by", QUANTITY)), list_of(ITEM), item_calls.ordered,
           "the items from the least to the greatest `by`; equal ones stay in their order", each=True),
    Helper("append", (_ITEMS, Arg("x", ITEM)), list_of(ITEM), lambda items, x: _whole_list((*items, x)),
           "the list with one more item"),
    Helper("concat", (_ITEMS, Arg("more", list_of(ITEM))), list_of(ITEM), lambda a, b: _whole_list((*a, *b)),
           "both lists in one"),
)  # fmt: skip

_CHANCE: Final = (
    Helper("random", (Arg("seed", INT),), NUMBER, chance.random,
           "a number from 0 to below 1, by chance; the same for the same seed in the same run of a task",
           needs_env=True, of_task=True),
    Helper("shuffle", (_ITEMS, Arg("seed", INT)), list_of(ITEM), chance.shuffle,
           "the list in an order by chance; the same for the same seed in the same run of a task",
           needs_env=True, of_task=True),
)  # fmt: skip

_TIMES: Final = (
    Helper("today", (Arg("at", TEXT),), TIME, daytime.today, "this time of today, such as '06:30', in the site's time zone",
           needs_env=True, daily=True, refuses=daytime.why_no_time_of_day),
    Helper("sunrise", (Arg("place", PLACE),), TIME, daytime.sunrise, "when the sun rises there today",
           needs_env=True, daily=True),
    Helper("sunset", (Arg("place", PLACE),), TIME, daytime.sunset, "when the sun sets there today",
           needs_env=True, daily=True),
)  # fmt: skip

_FLEET: Final = (
    Helper(members.FLEET, (Arg("type", TEXT),), list_of(Type("agent")), members.fleet,
           "the agents of a type (and of types that extend it) that are there now, in the order of their admission; "
           "to read and to ask, not to command", needs_env=True),
)  # fmt: skip

STANDARD: Final = Helpers((*_POINTS, *_REGIONS, *_NUMBERS, *_LISTS, *_CHANCE, *_TIMES, *_FLEET))
"""The helpers of the language."""
