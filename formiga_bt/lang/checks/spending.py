"""What machines take for ways, areas and hovering: seconds, and points of charge by the formulae of the gate."""

import math
from typing import Any

from msgspec import Struct, field

from formiga_bt.base.energy import Power, hover_pct, power_of, way_pct
from formiga_bt.base.geo import Position, Region
from formiga_bt.lang.checks.fleet import types_that_fit
from formiga_bt.lang.model import (
    Catalogue,
    Role,
    Site,
    Task,
)
from formiga_bt.lang.site.envelope import key_of


class Sum(Struct):
    """What some steps take at least: seconds, and by (role, type) seconds in the air and points of charge."""

    usual_s: float = 0.0
    """With the typical times of actions."""
    air: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)

    def add(self, other: "Sum") -> None:
        """Take what comes after this."""
        self.usual_s += other.usual_s
        for key, (seconds, points) in other.air.items():
            mine = self.air.get(key, (0.0, 0.0))
            self.air[key] = (mine[0] + seconds, mine[1] + points)


def of_branches(branches: list[Sum], pick: Any) -> Sum:
    """Return what branches take together: `min` or `max` of each, by charge."""
    keys = {key for one in branches for key in one.air}
    air = {key: pick((one.air.get(key, (0.0, 0.0)) for one in branches), key=lambda two: two[1]) for key in keys}
    return Sum(pick(one.usual_s for one in branches), air)


Where = dict[str, Position | None]
"""Roles in the air, and where they hover if that is known."""


def forget(at: Where, other: Where) -> None:
    """Keep what is the same on both paths: who is in the air on both, and where, if it is one point."""
    for role in list(at):
        if role not in other:
            del at[role]
        elif other[role] != at[role]:
            at[role] = None


class RoleSpending:
    """What each type that may fill a role of a task uses."""

    def __init__(self, task: Task, catalogue: Catalogue, site: Site | None) -> None:
        self._task = task
        self._catalogue = catalogue
        self._site = site
        self.powers: dict[str, dict[str, Power]] = {}
        """Machine types of a role, with what they use."""
        for role in task.roles.values():
            if not role.is_list:  # its items are not told apart
                types = types_that_fit(role, catalogue.types)
                powers = {one.name: power_of(one.limits) for one in types if not one.human}
                self.powers[role.name] = {name: power for name, power in powers.items() if power is not None}

    def hover(self, seconds: float, at: Where, but: str) -> Sum:
        """Return what machines in the air take while something else lasts so long."""
        return Sum(
            0.0,
            {
                (role, name): (seconds, hover_pct(seconds, power))
                for role in at
                if role != but
                for name, power in self.powers.get(role, {}).items()
                if seconds > 0
            },
        )

    def way(
        self, role: str, start: Position | None, end: Position, speed: float | None
    ) -> dict[tuple[str, str], tuple[float, float]]:
        """Return seconds and points by type for a straight way, empty where its start is not known."""
        found = {}
        for name, power in self.powers.get(role, {}).items():
            if start is None:
                continue
            level = math.hypot(end.east_m - start.east_m, end.north_m - start.north_m)
            fast = min(speed, power.speed_m_s) if speed else power.speed_m_s
            seconds = max(level / fast, abs(end.up_m - start.up_m) / power.climb_m_s)
            found[role, name] = (seconds, way_pct(start, end, power, speed_m_s=speed))
        return found

    def sweep(self, role: str, region: Region) -> dict[tuple[str, str], tuple[float, float]]:
        """Return seconds and points by type for covering an area in lanes."""
        found = {}
        for name, power in self.powers.get(role, {}).items():
            seconds = _area_m2(region) / (power.sweep_spacing_m * power.speed_m_s)
            found[role, name] = (seconds, seconds * power.cruise_pct_s)
        return found

    def least_reserve(self, role: Role) -> float:
        """Return the least charge that must be left of the machines that fit a role, percent; 0 if none fits."""
        types = types_that_fit(role, self._catalogue.types)
        return min((self.reserve(one.name) for one in types if not one.human), default=0.0)

    def reserve(self, type_name: str) -> float:
        """Return the charge that must be left, percent."""
        key = key_of("reserve")
        limits = self._catalogue.types[type_name].limits
        site = self._site.envelope if self._site is not None else {}
        return max(limits.get(key, 0.0), site.get(key, 0.0), self._task.envelope.get(key, 0.0))


def _area_m2(region: Region) -> float:
    corners = region.corners
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    return abs(sum(a.east_m * b.north_m - b.east_m * a.north_m for a, b in pairs)) / 2
