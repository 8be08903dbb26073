"""Expressions as the checker leaves them: what they read, of what type they are, how to run them, and what that may raise."""

from collections.abc import Callable
from operator import attrgetter
from typing import Any, Protocol

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.types import AgentRef, Type, Value


class Unset(Exception):  # noqa: N818 - a signal of the expression: an absent optional key, else the task ends `cannot_compute`
    """A name was read that has no value (the checker refuses such trees; at run time the task ends `cannot_compute`)."""

    of: "tuple[str, Mark] | None" = None
    """The innermost expression that has no value: as written, and where."""


class EvalError(Exception):
    """An expression has no result: division by zero, an index beyond the list, a number that is too large.

    At run time the task ends with `cannot_compute`; the checker reports it where the expression is constant.
    """

    of: "tuple[str, Mark] | None" = None
    """The innermost expression that has no result: as written, and where."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


def why_not_computed(error: Exception) -> str:
    """Return why an expression has no value: for people, with its text and place where they are known."""
    match error:
        case EvalError():
            why = error.reason
        case Unset():
            why = f"'{error}' has no value here"
        case UnknownState():
            return f"{error.key} is not known yet"
        case _:
            return f"{type(error).__name__}: {error}"
    return f"'{error.of[0]}' at {error.of[1]}: {why}" if error.of is not None else why


class UnknownState(Exception):  # noqa: N818
    """A field of an agent was read that is not known yet; `key` is its blackboard key."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.key = key


class Env(Protocol):
    """What an expression may read. The engine, the checker's constant folder and tests each have one."""

    def name(self, name: str) -> Value:
        """Return a param, var, role, saved or loop name, or a built-in (`base`, `task`, `now`, `site`, `error`, ...).

        A role is an `AgentRef`, or a tuple of them when it has a count; `site` and `task` are dicts.

        Raises:
            Unset: the name has no value here.
        """
        ...

    def is_set(self, name: str) -> bool:
        """Return whether the name has a value."""
        ...

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        """Return an agent's field as last known.

        Raises:
            UnknownState: never reported yet.
        """
        ...

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Return the agents of a type, and of those that extend it, that are admitted and not lost, in order of admission.

        Raises:
            Unset: read where there is no task.
        """
        ...

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return latitude and longitude (degrees) of a place or position, for `.lat` and `.lng`."""
        ...

    def place(self, lat: float, lng: float) -> Any:
        """Return the place at a latitude and longitude (degrees)."""
        ...

    def ground_up_m(self, place: Any) -> float:
        """Return the height of the ground at a place over the base's ground, metres (0 on flat sites)."""
        ...


class Dependency(Struct, frozen=True):
    """Something an expression depends on: a name, or a field of the agent that a name stands for."""

    name: str
    field: str = ""
    """Field of an agent (battery, position, ...), else empty."""


NOT_CONST: Any = object()
"""`Expr.const` of an expression that must be evaluated."""


class Expr(Struct, frozen=True, eq=False):
    """A typed, compiled expression or literal.

    `run(env)` evaluates it; a literal has `const` set and `run` returns it. Equality and hash ignore the code.
    """

    source: str
    type: Type
    mark: Mark
    run: Callable[[Env], Any]
    reads: tuple[Dependency, ...] = ()
    deadlines: tuple[Callable[[Env], Micros], ...] = ()
    """Of a live condition that uses `now`: the instants (engine time) at which a comparison with `now` changes."""
    const: Any = NOT_CONST

    def __eq__(self, other: object) -> bool:
        """Return whether two expressions say the same at the same place."""
        return isinstance(other, Expr) and _told(self) == _told(other)

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __hash__(self) -> int:
        """Return a hash of what it says."""
        return hash(_told(self))

    @property
    def is_const(self) -> bool:
        """Return whether the value is known before any run."""
        return self.const is not NOT_CONST


_told = attrgetter("source", "type", "mark", "reads")
