"""At which engine time a start begins (ADR 15).

Engine time never goes back. In a simulation it goes on from where the former engine ended, the outage passed at its speed.
In mode real it is the wall clock; a history that goes further than a little beyond the wall clock is a question to a person.
"""

from formiga_bt.base.clock import MOST_AHEAD, Micros, wall_clock_us
from formiga_bt.base.errors import SiteError
from formiga_bt.lang.model import Site
from formiga_bt.services.kept.resuming import Comeback
from formiga_bt.show.offset import span_words


class ClockAhead(SiteError):  # noqa: N818 - it names the state
    """The history of a site in mode real is further ahead of the wall clock than can be made up for."""

    code = "clock_ahead"


def follows_wall(site: Site) -> bool:
    """Return whether the engine time of a site follows the wall clock."""
    return site.mode == "real"


def begin_at(site: Site, reached: Micros, back: Comeback | None, wall: Micros | None = None) -> Micros:
    """Return the engine time that a start does not begin before.

    Args:
        site: says the mode.
        reached: engine time that the journal and the runtime folder know.
        back: what is gone on from.
        wall: the wall clock now.

    Raises:
        ClockAhead: mode real, and it would begin more than `MOST_AHEAD` ahead of the wall clock.
    """
    wall = wall_clock_us() if wall is None else wall
    if not follows_wall(site):
        return back.begins_at if back is not None else 0
    begins = max(reached, back.sign.at if back is not None else 0)
    if begins - wall > MOST_AHEAD:
        raise ClockAhead(
            f"clock_ahead: the history of {site.name} is {span_words(begins - wall)} ahead of the wall clock, which "
            "a site in mode real lives by",
            help="if this machine's clock is wrong, set it right and start again; if an earlier start was a simulation at "
            "another speed, begin a new history: formiga up --start-anew",
        )
    return begins
