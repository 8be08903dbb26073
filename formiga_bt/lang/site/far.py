"""W071: a place that is too far from the base to be meant; most often latitude and longitude are exchanged.

Degrees are measured on the sphere, for a place on the other side of the earth has no sensible metres east and north.
"""

import math
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.model import Site
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import Problems

FAR_M: Final = 50_000.0
"""Nothing that flies from a base station gets so far, and comes home."""
_EARTH_M: Final = 6_371_000.0


def apart_m(lat: float, lng: float, other_lat: float, other_lng: float) -> float:
    """Return the way over the earth between two points in degrees, metres."""
    a, b = math.radians(lat), math.radians(other_lat)
    rise, turn = (b - a) / 2, math.radians(other_lng - lng) / 2
    part = math.sin(rise) ** 2 + math.cos(a) * math.cos(b) * math.sin(turn) ** 2
    return 2 * _EARTH_M * math.asin(min(1.0, math.sqrt(part)))


def warn_degrees(lat: float, lng: float, base: tuple[float, float], mark: Mark, problems: Problems) -> bool:
    """Report W071 for a point in degrees that is far from the base; return whether it is."""
    away = apart_m(lat, lng, *base)
    if away <= FAR_M:
        return False
    swapped = abs(lng) <= 90 and apart_m(lng, lat, *base) <= FAR_M
    what = f"{_km(away)} from the base: {'lat and lng swapped?' if swapped else 'is this the place?'}"
    help_ = f"write {{lat: {lng:.9g}, lng: {lat:.9g}}}" if swapped else "see the signs, and the site's base"
    problems.add("W071", mark, what, help_)
    return True


def warn_far(node: Node, site: Site | None, problems: Problems) -> bool:
    """Report W071 for each `{lat, lng}` in a value that is far from the site's base; return whether there was any."""
    if isinstance(node, Listing):
        far = [warn_far(item, site, problems) for item in node.items]  # all of them are told
        return any(far)
    if not isinstance(node, Mapping_) or site is None:
        return False
    lat, lng = (_number(node, key) for key in ("lat", "lng"))
    if lat is None or lng is None:
        return False
    return warn_degrees(lat, lng, (site.lat, site.lng), node.mark, problems)


def warn_metres(point: Place | Position, mark: Mark, problems: Problems) -> bool:
    """Report W071 for a point in metres that is far from the base; return whether it is."""
    away = math.hypot(point.east_m, point.north_m)
    if away > FAR_M:
        problems.add("W071", mark, f"{_km(away)} from the base: is this the place?", "m or km?")
    return away > FAR_M


def _number(node: Mapping_, key: str) -> float | None:
    entry = node.get(key)
    try:
        return float(entry.value.text) if entry is not None and isinstance(entry.value, Scalar) else None
    except ValueError:
        return None


def _km(metres: float) -> str:
    return f"{metres / 1000:,.0f} km".replace(",", " ")
