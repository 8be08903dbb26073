"""What a simulated drone can do: speeds and charge, per type, overridable per agent.

The numbers go out on the agent's card under these names. The defaults give 25 to 30 minutes of flight.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import msgspec
from msgspec import Struct


class DroneLimits(Struct, frozen=True, kw_only=True):
    """Limits of one drone; percent are points of charge, 0..100."""

    speed_m_s: float = 10.0
    climb_m_s: float = 3.0
    drain_cruise_percent_s: float = 0.065
    drain_hover_percent_s: float = 0.058
    charge_percent_s: float = 0.0
    """Gained per second on the ground within 2 m of its home."""
    failsafe_percent: float = 5.0
    """At this charge the drone lands by itself, and it starts or goes nowhere on its engine's word."""

    def replaced(self, changes: Mapping[str, float]) -> "DroneLimits":
        """Return these limits with some replaced.

        Raises:
            ValueError: a name is unknown, a number is negative or not finite, or a speed is zero.
        """
        unknown = sorted(changes.keys() - set(self.__struct_fields__))
        if unknown:
            raise ValueError(f"unknown limits {', '.join(unknown)}; known: {', '.join(self.__struct_fields__)}")
        for name, number in changes.items():
            if not math.isfinite(number) or number < 0 or (number == 0 and name in ("speed_m_s", "climb_m_s")):
                raise ValueError(f"limit {name} must be a positive number, got {number!r}")
        return msgspec.structs.replace(self, **changes)

    def on_card(self) -> dict[str, float]:
        """Return the limits as an agent announces them."""
        return {name: float(getattr(self, name)) for name in self.__struct_fields__}


DRONE_TYPES: Final[Mapping[str, DroneLimits]] = MappingProxyType(
    {
        "lwd": DroneLimits(speed_m_s=8.0, climb_m_s=2.5, drain_cruise_percent_s=0.06, drain_hover_percent_s=0.055),
        "hwd": DroneLimits(),
    }
)
"""Light-weight and heavy-weight drones."""

PERSON_TYPES: Final = ("picker", "watcher")
