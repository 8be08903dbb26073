"""A simple area sweep: parallel tracks over a polygon. Used by the drone's Explore."""

from formiga_bt.base.geo import Place, mm


def sweep(corners: list[Place], spacing_m: float) -> list[Place]:
    """Return the way along east-west tracks, south to north, each from edge to edge of the polygon, turn by turn.

    A track over a concave polygon is flown from its first to its last edge, gaps included.
    """
    south, north = min(c.north_m for c in corners), max(c.north_m for c in corners)
    tracks = max(1, round((north - south) / spacing_m))
    step = (north - south) / tracks
    way: list[Place] = []
    for index in range(tracks):
        at = south + (index + 0.5) * step
        crossings = _crossings(corners, at)
        if len(crossings) < 2:
            continue
        ends = [Place(mm(crossings[0]), mm(at)), Place(mm(crossings[-1]), mm(at))]
        way += ends if index % 2 == 0 else ends[::-1]
    return way or [corners[0]]


def _crossings(corners: list[Place], north_m: float) -> list[float]:
    """Return where the line at `north_m` crosses the polygon's edges, west to east."""
    found = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        if (a.north_m <= north_m) != (b.north_m <= north_m):
            share = (north_m - a.north_m) / (b.north_m - a.north_m)
            found.append(a.east_m + share * (b.east_m - a.east_m))
    return sorted(found)
