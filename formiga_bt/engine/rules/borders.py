"""On which side of a border an agent is, although its fixes jump.

A fix of a phone in the open is off by about 5 m. So a region is left only more than `BAND_M` beyond its border, and entered on
or inside it: whoever stands at the border is on the side on which they were.
"""

from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Region, outline_of
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.lang.model.rules import Passage

BAND_M: Final = 10.0
"""So far beyond its border a region is left; back over the border itself it is entered."""
OLDEST_US: Final = 60 * SECOND
"""Positions older than this (engine time) say nothing."""


def is_fresh(agent: AgentRecord, now: Micros) -> bool:
    """Return whether an agent's position is known, and not too old to say where it is."""
    return agent.position is not None and now - agent.said_at <= OLDEST_US


def side_of(agent: AgentRecord, region: Region) -> bool | None:
    """Return whether an agent is inside a region (True) or outside; None: it stays on the side on which it was."""
    at = agent.position
    if at is None:
        return None
    outline = outline_of(region)
    if outline.contains(at.east_m, at.north_m):
        return True
    return False if outline.border_m(at.east_m, at.north_m) > BAND_M else None


def counts(what: Passage, *, inside: bool) -> bool:
    """Return whether to be inside (or outside) now is what a rule waits for, of an agent that was not."""
    match what:
        case "leaves":
            return not inside
        case "enters":
            return inside
        case "crosses":
            return True
