"""A site as the envelope sees it: fence and no-fly regions with their edges worked out, the ground, layers, the sun.

Made once per site and kept; asking it is cheap. Holds no state of machines.
"""

from formiga_bt.clock import Micros
from formiga_bt.geo import Position
from formiga_bt.lang.model import Site

Way = tuple[Position, Position]
"""A straight way; both ends equal = it stays there."""


class Airspace:
    """What a site allows. `statistics` are not kept: it never changes."""

    def __init__(self, site: Site) -> None:
        self.site = site

    def sun_is_up(self, now: Micros) -> bool:
        """Return whether the sun is up at the base at engine time `now` (microseconds of UTC since 1970)."""
        raise NotImplementedError
