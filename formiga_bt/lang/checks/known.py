"""What an expression may read before any run, and what its value is then."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.base.geo import Place
from formiga_bt.lang.model import (
    EvalError,
    Expr,
    Site,
    UnknownState,
    Unset,
)
from formiga_bt.lang.request.binding import BASE, SiteEnv
from formiga_bt.lang.types import AgentRef, Value, agent_type

Names = Mapping[str, Value]


class _Known:
    """What an expression may read before any run: base, site, and names that have one value."""

    def __init__(self, site: Site | None, names: Names) -> None:
        self._site = SiteEnv(site) if site is not None else None
        self._names = names

    def name(self, name: str) -> Value:
        if name in self._names:
            return self._names[name]
        if self._site is not None:
            return self._site.name(name)
        if name == "base":
            return BASE
        raise Unset(name)

    def is_set(self, name: str) -> bool:
        if name in self._names:
            return True
        raise Unset(name)

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        raise UnknownState(f"{agent.id}.{name}")

    def lat_lng(self, point: Any) -> tuple[float, float]:
        return self._of_site().lat_lng(point)

    def place(self, lat: float, lng: float) -> Place:
        return self._of_site().place(lat, lng)

    def ground_up_m(self, place: Any) -> float:
        return self._site.ground_up_m(place) if self._site is not None else 0.0

    def members(self, type_name: str) -> Any:
        raise Unset(type_name)

    def _of_site(self) -> SiteEnv:
        if self._site is None:
            raise Unset("site")
        return self._site


def value_of(expr: Expr | None, names: Names, site: Site | None) -> Any:
    """Return the value of an expression, or None if it is not known before a run."""
    if expr is None or expr.is_const:
        return expr.const if expr is not None else None
    if any(read.field or (read.name not in names and read.name not in ("base", "site")) for read in expr.reads):
        return None
    try:
        return expr.run(_Known(site, names))
    except (Unset, UnknownState, EvalError, ArithmeticError, LookupError):
        return None


def agents_of(expr: Expr, names: Names) -> AgentRef | tuple[AgentRef, ...] | None:
    """Return the agent or the list of agents that an expression stands for, or None if that is not known before a run."""
    if agent_type(expr.type).name != "agent":
        return None
    value = value_of(expr, names, None)
    if isinstance(value, tuple) and value and all(isinstance(one, AgentRef) for one in value):
        return value
    return value if isinstance(value, AgentRef) else None
