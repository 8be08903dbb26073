"""The names that an expression may read at one place of a task, and the fields of agents and built-ins.

Built by the loader as it walks a task; read by the expression checker. Scopes are never changed: each narrowing or
addition returns a new one.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

from formiga_bt.lang.expr.helpers import STANDARD, Helpers
from formiga_bt.lang.model import AgentType, Site
from formiga_bt.lang.types import (
    ANY,
    BOOL,
    DISTANCE,
    DURATION,
    INT,
    MASS,
    NUMBER,
    PERCENT,
    PLACE,
    POSITION,
    REGION,
    TEXT,
    TIME,
    Type,
    enum_of,
    record_of,
)

STATUS: Final = enum_of("STANDBY", "ASSIGNED", "EXECUTING ACTION", "PARKED_AWAY", "QUARANTINED")
CONTROL: Final = enum_of("engine", "pilot", "failsafe", "unknown")

AGENT_FIELDS: Final[Mapping[str, Type]] = MappingProxyType(
    {
        "id": TEXT,
        "type": TEXT,
        "position": POSITION,
        "home": PLACE,
        "battery": PERCENT,
        "status": STATUS,
        "airborne": BOOL,
        "payload": MASS,
        "age": DURATION,
        "control": CONTROL,
        "transit_height": DISTANCE,
    }
)
"""What an expression may read of any agent; the blackboard's last value."""

PLACE_FIELDS: Final[Mapping[str, Type]] = MappingProxyType({"lat": NUMBER, "lng": NUMBER})
POSITION_FIELDS: Final[Mapping[str, Type]] = MappingProxyType({**PLACE_FIELDS, "height": DISTANCE})
TASK_FIELDS: Final = record_of(id=TEXT, name=TEXT, priority=enum_of("low", "medium", "high"), run=INT)
BUILT_INS: Final = ("base", "task", "now", "site")
"""Always there in a task. `error`, `abort` and `result` are names that the loader adds where they have a value."""


def _site_type(site: Site | None) -> Type:
    """Return the type of `site`: three records by name, open (any name goes) without a site file."""

    def names(of: Type, known: Mapping[str, object] | None) -> Type:
        return Type("names", item=of, values=tuple(known or ()))

    return record_of(
        ports=names(PLACE, site.ports if site else None),
        places=names(PLACE, site.places if site else None),
        regions=names(REGION, site.regions if site else None),
    )


def fields_of(type_: Type, agent_types: Mapping[str, AgentType]) -> dict[str, Type] | None:
    """Return what may be read of a value with a dot: nothing that is known of `any`; None for a type without fields.

    Args:
        type_: of the value.
        agent_types: all agent types, when known.
    """
    match type_.name:
        case "agent":
            if not agent_types:
                return dict(AGENT_FIELDS)
            return {**AGENT_FIELDS, "type": enum_of(*agent_types), **_own_fields(type_, agent_types)}
        case "place":
            return dict(PLACE_FIELDS)
        case "position":
            return dict(POSITION_FIELDS)
        case "record":
            return dict(type_.fields)
        case "any":
            return {}
        case "names":
            return dict.fromkeys(type_.values, type_.item or ANY)
    return None


def _own_fields(type_: Type, agent_types: Mapping[str, AgentType]) -> dict[str, Type]:
    """Return the fields that every type which an agent may have declares, alike."""
    kinds = [agent_types[name] for name in type_.of if name in agent_types]
    if not kinds:
        return {}
    first, *others = kinds
    return {name: of for name, of in first.fields.items() if all(one.fields.get(name) == of for one in others)}


OUTSIDE: Final = ("base", "site")
"""The built-ins that a parameter given from outside may read."""


_BUILT_IN_TYPES: Final[Mapping[str, Type]] = MappingProxyType({"base": PLACE, "task": TASK_FIELDS, "now": TIME})


class MaybeUnset(NamedTuple):
    """Why a name may have no value."""

    code: Literal["E019", "E067"] = "E019"
    """Saved on some paths only, or an optional param."""
    saved: str = ""
    """Where it is saved, if on one path only, as messages call it: `line 14`."""


class Scope:
    """The names that are visible at a place of a task, with their types.

    Args:
        names: params, vars, roles, saved and loop names; `error`, `abort`, `result` where they have a value.
        agent_types: of the catalogue, when known.
        roles: which of the names are roles (for messages).
        maybe_unset: names that must be tested with `is_set` before use, each with its reason; of a set of names
            they were saved on some paths only.
        site: the checked site, when known.
        helpers: the pure functions that may be called.
        built_ins: those of `BUILT_INS` that have a value here; without a task there is no `task` and no `now`.
        counts: how many items the lists have of which that is known: roles with a count, vars that no step assigns.
    """

    __slots__ = ("agent_types", "built_ins", "counts", "helpers", "maybe_unset", "names", "roles", "site")

    def __init__(
        self,
        names: Mapping[str, Type],
        *,
        agent_types: Mapping[str, AgentType] | None = None,
        roles: frozenset[str] = frozenset(),
        maybe_unset: Mapping[str, MaybeUnset] | frozenset[str] = frozenset(),
        site: Site | None = None,
        helpers: Helpers = STANDARD,
        built_ins: tuple[str, ...] = BUILT_INS,
        counts: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        self.names = MappingProxyType(dict(names))
        self.agent_types: Mapping[str, AgentType] = (
            MappingProxyType(agent_types) if agent_types else MappingProxyType({})
        )
        self.roles = roles
        reasons = maybe_unset if isinstance(maybe_unset, Mapping) else dict.fromkeys(sorted(maybe_unset), MaybeUnset())
        self.maybe_unset = MappingProxyType(dict(reasons))
        self.site = site
        self.helpers = helpers
        self.built_ins = built_ins
        self.counts = counts

    def _with(
        self, names: Mapping[str, Type], maybe_unset: Mapping[str, MaybeUnset], roles: frozenset[str] | None = None
    ) -> "Scope":
        return Scope(
            names,
            agent_types=self.agent_types,
            roles=self.roles if roles is None else roles,
            maybe_unset=maybe_unset,
            site=self.site,
            helpers=self.helpers,
            built_ins=self.built_ins,
            counts={name: count for name, count in self.counts.items() if names.get(name) is self.names.get(name)},
        )

    def with_names(
        self,
        more: Mapping[str, Type],
        *,
        roles: frozenset[str] = frozenset(),
        maybe_unset: Mapping[str, MaybeUnset] | None = None,
    ) -> "Scope":
        """Return a child scope with more names; those given in `maybe_unset` must be tested before use."""
        left = {name: reason for name, reason in self.maybe_unset.items() if name not in more}
        return self._with({**self.names, **more}, {**left, **(maybe_unset or {})}, self.roles | roles)

    def narrowed(self, set_names: frozenset[str]) -> "Scope":
        """Return this scope where these names are known to be set."""
        if not set_names & self.maybe_unset.keys():
            return self
        return self._with(self.names, {n: why for n, why in self.maybe_unset.items() if n not in set_names})

    def type_of(self, name: str) -> Type | None:
        """Return the type of a name, or None if it is not visible here."""
        found = self.names.get(name)
        if found is not None or name not in self.built_ins:
            return found
        return _site_type(self.site) if name == "site" else _BUILT_IN_TYPES[name]

    def visible(self) -> tuple[str, ...]:
        """Return every name that is legal here, the author's own first."""
        return (*self.names, *(name for name in self.built_ins if name not in self.names))
