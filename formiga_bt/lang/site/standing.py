"""Where the agents of a site begin, and where they charge: of a simulation, a scenario and a test case alike.

Machines stand at their port, their station or where the site places them, people at the site's places in turn. What the site
places nowhere stands on the nearest free spot to the base.
"""

from collections.abc import Iterator, Sequence

from msgspec import Struct

from formiga_bt.base.geo import Place, horizontal_m, is_within
from formiga_bt.lang.model import AgentType, Catalogue, Site

APART_M = 5.0
"""Spots that nobody chose are at least so far from each other, and from all else that stands."""
RINGS = 60


class Beginning(Struct, frozen=True):
    """Where an agent begins."""

    at: Place
    home: Place | None = None
    """Its own port or station."""


def beginnings(site: Site, catalogue: Catalogue) -> dict[str, Beginning]:
    """Return where each agent of a site begins whose type the catalogue has, in the order of the site."""
    found: dict[str, Beginning | None] = {}
    people: Sequence[Place] = list(site.places.values()) or [Place(20.0, -20.0)]
    asked = 0
    for agent in site.agents.values():
        kind = catalogue.types.get(agent.type)
        if kind is None:
            continue
        if kind.mobility == "people":
            found[agent.id] = Beginning(agent.at or people[asked % len(people)])
            asked += agent.at is None
            continue
        home = _home(site, agent.home)
        at = agent.at or home
        found[agent.id] = Beginning(at, home) if at is not None else None
    return _all_placed(site, found)


def chargers(site: Site, kind: AgentType) -> tuple[Place, ...]:
    """Return where a machine of a type charges: what flies at every port, what drives at the stations that are for it."""
    if kind.mobility == "air":
        return tuple(port.at for port in site.ports.values())
    if kind.mobility != "ground":
        return ()
    names = {kind.name, *kind.extends}
    return tuple(one.at for one in site.stations.values() if one.charges and (not one.kinds or names & set(one.kinds)))


def _home(site: Site, name: str) -> Place | None:
    port, station = site.ports.get(name), site.stations.get(name)
    if port is not None:
        at: Place = port.at
        return at
    return station.at if station is not None else None


def _all_placed(site: Site, found: dict[str, Beginning | None]) -> dict[str, Beginning]:
    taken = [Place(0.0, 0.0), *(port.at for port in site.ports.values()), *(one.at for one in site.stations.values())]
    taken += [one.at for one in found.values() if one is not None]
    spots = _spots(site, taken)
    return {name: one if one is not None else Beginning(next(spots)) for name, one in found.items()}


def _spots(site: Site, taken: list[Place]) -> Iterator[Place]:
    """Iterate over free spots, outwards from the base; the base itself when there are no more."""
    for ring in range(1, RINGS):
        for step in range(-ring, ring):
            for east, north in ((step, -ring), (ring, step), (-step, ring), (-ring, -step)):
                spot = Place(east * APART_M, north * APART_M)
                if _is_free(site, spot, taken):
                    taken.append(spot)
                    yield spot
    while True:
        yield Place(0.0, 0.0)


def _is_free(site: Site, spot: Place, taken: list[Place]) -> bool:
    if site.fence is not None and not is_within(spot, site.fence):
        return False
    if any(is_within(spot, region) for region in (*site.no_fly, *site.no_go)):
        return False
    return all(horizontal_m(spot, one) >= APART_M for one in taken)
