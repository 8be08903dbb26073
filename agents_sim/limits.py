"""What simulated drones and people can do: speeds, charge, how far they see; per type, overridable per agent.

A drone's numbers go out on its card under these names. The defaults give 25 to 30 minutes of flight.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Final, Self

import msgspec
from msgspec import Struct


class Limits(Struct, frozen=True, kw_only=True):
    """Numbers by name that a spec may override."""

    calls: ClassVar[Mapping[str, str]] = MappingProxyType({"charge_pct_s": "charge_percent_s"})
    """Names of the catalogue that a body calls otherwise."""

    def of_type(self, said: Mapping[str, float]) -> Self:
        """Return these limits with the numbers that the catalogue says of the type, as far as they are of a body."""
        known = {self.calls.get(name, name): number for name, number in said.items()}
        known = {name: number for name, number in known.items() if name in self.__struct_fields__}
        return self.replaced(
            {name: number for name, number in known.items() if number > 0.0 or not name.endswith("_m_s")}
        )

    def replaced(self, changes: Mapping[str, float]) -> Self:
        """Return these limits with some replaced.

        Raises:
            ValueError: a name is unknown, a number is negative or not finite, or a speed is zero.
        """
        unknown = sorted(changes.keys() - set(self.__struct_fields__))
        if unknown:
            raise ValueError(f"unknown limits {', '.join(unknown)}; known: {', '.join(self.__struct_fields__)}")
        for name, number in changes.items():
            if not math.isfinite(number) or number < 0 or (number == 0 and name.endswith("_m_s")):
                raise ValueError(f"limit {name} must be a positive number, got {number!r}")
        return msgspec.structs.replace(self, **changes)


class MachineLimits(Limits, frozen=True, kw_only=True):
    """Limits of one machine; percent are points of charge, 0..100."""

    speed_m_s: float = 1.0
    drive_drain_pct_s: float = 0.0
    charge_percent_s: float = 0.0
    """Gained per second at rest within 2 m of its home, or of a station that charges it."""
    failsafe_percent: float = 5.0
    """At this charge it ends what it does by itself, and goes nowhere on its engine's word."""

    def on_card(self) -> dict[str, float]:
        """Return the limits as an agent announces them."""
        said = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: float(number) for name, number in said.items() if number is not None}


class DroneLimits(MachineLimits, frozen=True, kw_only=True):
    """Limits of one drone."""

    speed_m_s: float = 10.0
    climb_m_s: float = 3.0
    cruise_drain_pct_s: float = 0.065
    hover_drain_pct_s: float = 0.058
    climb_drain_pct_s: float | None = None
    """While it gains height; None: as in cruise."""
    payload_drain_pct_kg_s: float = 0.0
    """Added in the air, for each kilogram it carries."""
    return_height_m: float = 0.0
    """Coming home by itself it first climbs to this height over the base's ground, if it is lower."""

    @property
    def climbing_percent_s(self) -> float:
        """Return what climbing drains."""
        return self.cruise_drain_pct_s if self.climb_drain_pct_s is None else self.climb_drain_pct_s

    def on_card(self) -> dict[str, float]:
        """Return the limits as an agent announces them."""
        return {**super().on_card(), "climb_drain_pct_s": self.climbing_percent_s}


class PersonLimits(Limits, frozen=True, kw_only=True):
    """How a person walks and follows a drone, and how well the tracker they carry works (`finder`, `following`)."""

    calls: ClassVar[Mapping[str, str]] = MappingProxyType({"speed_m_s": "walk_m_s"})

    walk_m_s: float = 1.4
    sight_m: float = 80.0
    """A drone farther away, over ground, is out of sight."""
    reaction_s: float = 4.0
    """From when they see the drone, or see it move on, to when they walk."""
    finder_range_m: float = 20.0
    """At most this far from the base they are in range."""
    fix_error_m: float = 30.0
    """How far off the first fix of a search is; each further one is half as far off."""
    fix_floor_m: float = 3.0
    """How far off a fix is at best."""
    fix_takes_s: float = 2.0


DRONE_TYPES: Final[Mapping[str, DroneLimits]] = MappingProxyType(
    {
        "lwd": DroneLimits(speed_m_s=8.0, climb_m_s=2.5, cruise_drain_pct_s=0.06, hover_drain_pct_s=0.055),
        "hwd": DroneLimits(),
    }
)
"""Light-weight and heavy-weight drones."""

PERSON_TYPES: Final = ("picker", "watcher")
TRACKED_TYPES: Final = ("picker",)
"""People who carry a tracker: they answer MiniFinder."""
