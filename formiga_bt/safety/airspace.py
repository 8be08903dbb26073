"""A site as the envelope sees it: fence and no-fly regions with their edges worked out, the ground, layers, the sun.

Made once per site and kept; asking it is cheap. Holds no state of machines.
"""

from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.sun import sun_is_up
from formiga_bt.lang.model import Site
from formiga_bt.safety.terrain import Terrain, terrain_of
from formiga_bt.safety.zones import Zone

HIGHEST_LAYER_M: Final = 90.0
"""Of a site that lists no layers."""


class Airspace:
    """What a site allows. Only what people close and open changes, and that stands in the engine's state."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.fence = Zone("fence", site.fence, keep_in=True) if site.fence is not None else None
        self.no_fly = tuple(
            Zone(_name_of(region, index, site, "no-fly"), region, keep_in=False)
            for index, region in enumerate(site.no_fly)
        )
        self.zones: tuple[Zone, ...] = (*self.no_fly, *((self.fence,) if self.fence is not None else ()))
        """No-fly regions first: they are the graver ones."""
        no_go = [
            Zone(_name_of(region, index, site, "no-go"), region, keep_in=False)
            for index, region in enumerate(site.no_go)
        ]
        self.ground_zones: tuple[Zone, ...] = (*no_go, *((self.fence,) if self.fence is not None else ()))
        """What binds who drives."""
        self._always = self.zones, self.ground_zones
        self._shut: dict[str, Zone] = {}
        self.closed: tuple[Zone, ...] = ()
        """Regions that people closed for all machines; the graver zones come first, and these are."""
        self.chargers = tuple(one.at for one in site.stations.values() if one.charges)
        self.terrain: Terrain = terrain_of(site)
        self.highest_layer_m = max(site.layers_m, default=HIGHEST_LAYER_M)
        self._sun: tuple[Micros, bool] | None = None

    def close(self, name: str, region: Region, reason: str) -> None:
        """Close a region for all machines."""
        self._shut[name] = Zone(f"{name} (closed: {reason})", region, keep_in=False)
        self._join()

    def open(self, name: str) -> None:
        """Open a region that was closed."""
        self._shut.pop(name, None)
        self._join()

    def _join(self) -> None:
        self.closed = tuple(self._shut.values())
        air, ground = self._always
        self.zones, self.ground_zones = (*self.closed, *air), (*self.closed, *ground)

    def ground_m(self, at: Place | Position) -> float:
        """Return the height of the ground at a place over the base's ground; 0 where it is unknown."""
        return self.terrain.ground_m(at) or 0.0

    def is_open(self, at: Place | Position) -> bool:
        """Return whether a machine may be over a place: in the fence, in no no-fly region, over known ground."""
        return self.terrain.ground_m(at) is not None and not any(zone.is_broken_at(at) for zone in self.zones)

    def sun_is_up(self, now: Micros) -> bool:
        """Return whether the sun is up at the base at engine time `now` (microseconds of UTC since 1970), to a minute."""
        minute = now // (60 * SECOND)
        if self._sun is None or self._sun[0] != minute:
            self._sun = minute, sun_is_up(self.site.lat, self.site.lng, minute * 60 * SECOND)
        return self._sun[1]


def _name_of(region: Region, index: int, site: Site, what: str) -> str:
    named = (name for name, known in site.regions.items() if known == region)
    return next(named, f"{what} region {index + 1}")
