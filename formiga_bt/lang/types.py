"""Types of the task language, and the runtime values that belong to them.

| type | value at run time |
|---|---|
| number, int, percent | float / int; percent is 0..100 |
| distance, speed, angle, mass | float in m, m/s, deg, kg |
| duration | float in seconds |
| time | int, microseconds since 1970 (engine time) |
| text, enum, bool | str, str, bool |
| place, position, region | `geo.Place`, `geo.Position`, `geo.Region` |
| agent | `AgentRef` |
| list | tuple |
| record | dict with text keys (results of actions, answers, `error`, `task`, `abort`, `result`, records of a file) |
"""

from collections.abc import Mapping
from operator import attrgetter
from typing import Any

from msgspec import Struct, field
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position, Region


class AgentRef(Struct, frozen=True, tag_field="is", tag="agent"):
    """An agent as a value: its id. Fields are read through the environment of the expression."""

    id: str


Value = bool | int | float | str | Place | Position | Region | AgentRef | tuple[Any, ...] | dict[str, Any] | None
"""Any value of a running tree; None only stands for "not set"."""


class Type(Struct, frozen=True, eq=False):
    """A type. `ANY` is the poison type that stops cascades of errors; it fits everything."""

    name: str
    item: "Type | None" = None
    """Of a list."""
    values: tuple[str, ...] = ()
    """Of an enum."""
    of: tuple[str, ...] = ()
    """Agent types that an agent value may have; empty = any."""
    fields: Mapping[str, "Type"] = field(default_factory=dict)
    """Of a record."""
    foreign: bool = False
    """Of an agent that the task does not hold (`fleet('hwd')`, a param): it may be looked at and asked, not commanded."""

    def __eq__(self, other: object) -> bool:
        """Return whether two types are the same, foreign or not."""
        return isinstance(other, Type) and _named(self) == _named(other) and self.fields == other.fields

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __hash__(self) -> int:
        """Return a hash that equal types share."""
        return hash(_named(self))

    @property
    def is_foreign(self) -> bool:
        """Return whether it is an agent that the task does not hold, or a list of such agents."""
        return self.foreign or (self.item is not None and self.item.is_foreign)

    def __str__(self) -> str:
        if self.name == "list" and self.item is not None:
            return f"list of {self.item}"
        if self.name == "enum":
            return "one of " + ", ".join(self.values)
        if self.name == "record" and self.fields:
            return "record of " + ", ".join(self.fields)
        if self.name == "agent" and self.of:
            return " or ".join(self.of) + " agent"
        return self.name


_named = attrgetter("name", "item", "values", "of")

ANY = Type("any")
NUMBER, INT, TEXT, BOOL, PERCENT = Type("number"), Type("int"), Type("text"), Type("bool"), Type("percent")
DISTANCE, DURATION, SPEED, ANGLE, MASS, TIME = (
    Type("distance"), Type("duration"), Type("speed"), Type("angle"), Type("mass"), Type("time"),
)  # fmt: skip
PLACE, POSITION, REGION, AGENT = Type("place"), Type("position"), Type("region"), Type("agent")


def list_of(item: Type) -> Type:
    """Return the type of a list of `item`."""
    return Type("list", item=item)


def enum_of(*values: str) -> Type:
    """Return the type of an enum."""
    return Type("enum", values=values)


def record_of(**fields: Type) -> Type:
    """Return the type of a record with these fields."""
    return Type("record", fields=fields)


def spelled(type_: Type) -> str:
    """Return a type with the types of a record's fields, as two versions of a file are compared."""
    if type_.name == "list" and type_.item is not None:
        return f"list of {spelled(type_.item)}"
    if type_.name == "record":
        return "record of " + ", ".join(f"{name} ({spelled(of)})" for name, of in type_.fields.items())
    return str(type_)


def agent_type(type_: Type) -> Type:
    """Return the type of the agents that a value of this type is, or is a list of."""
    return type_.item if type_.name == "list" and type_.item is not None else type_


def not_held(type_: Type) -> Type:
    """Return the type of a task's own param: of agents that its caller names, which the task does not hold for that."""
    if type_.name == "list" and type_.item is not None:
        return replace(type_, item=not_held(type_.item))
    return replace(type_, foreign=True) if type_.name == "agent" else type_
