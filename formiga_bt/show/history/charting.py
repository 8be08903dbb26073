"""A site and the ways of its agents as a `Chart`: base, ports, places, areas, tracks, and where something happened."""

from collections.abc import Collection, Iterator
from typing import Literal

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.model import Site
from formiga_bt.safety.airspace import Airspace
from formiga_bt.show.facts import Chart, MapLane, MapMark, MapShape, Point
from formiga_bt.show.history.ledger import Ledger


def chart(ledger: Ledger, site: Site, now: Micros, tasks: Collection[str] = ()) -> Chart:
    """Return the site with the ways for these tasks, or with all ways."""
    wanted = frozenset(tasks) if tasks else None
    ways = sorted(ledger.ways.values(), key=lambda way: way.agent)
    # a person belongs to no task: those who are asked for one are on its map
    people = {row.agent for task in wanted or () for row in ledger.story(task).rows}
    events = [event.mark for event in ledger.events if wanted is None or event.task in wanted]
    searches = [search.shape for search in ledger.searches if wanted is None or search.task in wanted]
    return Chart(
        site=site.name,
        at=now,
        marks=(*_marks(site), *events),
        shapes=(*_shapes(site), *searches),
        tracks=tuple(
            track
            for way in ways
            for track in way.tracks(None if way.mobility == "people" and way.agent in people else wanted)
        ),
        lanes=tuple(_lanes(site)),
        origin_lat=site.lat,
        origin_lng=site.lng,
    )


def _marks(site: Site) -> Iterator[MapMark]:
    yield MapMark(name="base", kind="base", at=Point(0.0, 0.0))
    for port in site.ports.values():
        yield from _mark(port.name, "port", port.at)
    for station in site.stations.values():
        yield from _mark(station.name, "station", station.at)
    for node in site.routes.nodes.values():
        if node.is_end and node.name not in site.stations:
            yield from _mark(node.name, "park", node.at)
    for name, at in site.places.items():
        yield from _mark(name, "place", at)


def _mark(name: str, kind: Literal["port", "station", "park", "place"], at: object) -> Iterator[MapMark]:
    if isinstance(at, Place | Position):
        up = at.up_m if isinstance(at, Position) else 0.0
        yield MapMark(name=name, kind=kind, at=Point(at.east_m, at.north_m, up))


def _lanes(site: Site) -> Iterator[MapLane]:
    nodes = site.routes.nodes
    for edge in site.routes.edges:
        a, b = nodes[edge.a].at, nodes[edge.b].at
        start, end = Point(a.east_m, a.north_m), Point(b.east_m, b.north_m)
        yield MapLane(name=edge.name, start=start, end=end, one_way=edge.one_way)


def _shapes(site: Site) -> Iterator[MapShape]:
    if isinstance(site.fence, Region):
        yield MapShape(name="fence", kind="fence", corners=_corners(site.fence))
    for region, zone in zip(site.no_fly, Airspace(site).no_fly, strict=True):
        yield MapShape(name=zone.name, kind="zone", corners=_corners(region), forbidden=True)
    for index, region in enumerate(site.no_go):
        if region not in site.no_fly:
            yield MapShape(name=f"no-go region {index + 1}", kind="zone", corners=_corners(region), forbidden=True)
    for name, region in site.regions.items():
        if isinstance(region, Region) and region not in (*site.no_fly, *site.no_go):
            yield MapShape(name=name, kind="region", corners=_corners(region))


def _corners(region: Region) -> tuple[Point, ...]:
    return tuple(Point(corner.east_m, corner.north_m) for corner in region.corners)
