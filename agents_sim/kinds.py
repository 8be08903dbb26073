"""What a simulated agent can do, as plain data: what the catalogue says of its type, and what a rehearsal wants of its results.

Whoever knows the catalogue makes a `Kind` (`formiga_bt.rehearsal.bodies`); a body carries it out and knows no type by its name.
"""

import zlib
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.machines import Mobility

SPREAD = 0.1
"""A typical duration is up to this share shorter or longer."""


class SimAction(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An action as a body carries it out."""

    moves_to: str = ""
    """The field that says where the agent goes (a place or a position)."""
    height: str = ""
    """The field that says how high it takes off."""
    speed: str = "speed"
    """The field that says how fast it goes."""
    requires: Literal["", "airborne", "grounded"] = ""
    effect: Literal["", "airborne", "grounded"] = ""
    """How it stands afterwards; of what flies."""
    cuts: bool = False
    """It stops the rotors at once."""
    typical_us: Micros = 60_000_000
    """How long it lasts where nothing else says it."""
    result: Mapping[str, Any] = {}
    """What it gives, as it passes the wire: the first legal value of each field."""


class Kind(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A type of agents."""

    mobility: Mobility
    actions: Mapping[str, SimAction] = {}
    limits: Mapping[str, float] = {}
    """Numbers of the catalogue by name; a body takes those that it knows."""
    body: str = ""
    """The name of a body that is registered (`bodies.find`); "" = the one of its mobility."""


class Outcome(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What becomes of goals of an action, as a scenario or a test case wants it."""

    action: str
    nth: int = 0
    """Which goal of this action of the agent, from 1; 0 = each."""
    give: Mapping[str, Any] = {}
    """Fields of the result, as they pass the wire; the others are as ever."""
    fail: str = ""
    """It fails with this code where it would have ended."""
    delay_s: float = 0.0
    """So much later it begins."""


class Outcomes:
    """The outcomes that one agent is to have; counts its goals.

    Args:
        wanted: in order; the first that fits counts.
    """

    def __init__(self, wanted: Sequence[Outcome] = ()) -> None:
        self._wanted = tuple(wanted)
        self._counts: dict[str, int] = {}

    def next(self, action: str) -> Outcome | None:
        """Count a goal of an action, and return what is to become of it; None = nothing is said."""
        count = self._counts[action] = self._counts.get(action, 0) + 1
        return next((one for one in self._wanted if one.action == action and one.nth in (0, count)), None)


def lasts_us(action: SimAction, seed: int, goal_id: str) -> Micros:
    """Return how long a goal lasts whose action says only what is typical: the same for the same seed and goal."""
    share = zlib.crc32(f"{seed}/{goal_id}".encode()) / 2**32
    return round(action.typical_us * (1.0 - SPREAD + 2.0 * SPREAD * share))
