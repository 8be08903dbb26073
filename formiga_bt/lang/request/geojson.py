"""GeoJSON as nodes of the language: points as `{lat, lng}`, lines as lists of places, polygons without holes as regions.

GeoJSON says longitude first, and its heights are over an ellipsoid: they are left out. A feature has its properties besides.
"""

from typing import Final

from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import Problems

_KINDS: Final = (
    "FeatureCollection", "Feature", "Point", "LineString", "MultiPoint", "Polygon", "MultiPolygon", "MultiLineString",
    "GeometryCollection",
)  # fmt: skip

_SHAPES: Final = ("Point", "LineString", "MultiPoint", "Polygon")


def is_geojson(node: Node | None) -> bool:
    """Return whether a document is GeoJSON."""
    return isinstance(node, Mapping_) and _word(node, "type") in _KINDS


def features(node: Mapping_, problems: Problems) -> list[Mapping_]:
    """Return the features of a document, one that is only a shape as a feature without properties."""
    if _word(node, "type") != "FeatureCollection":
        return [node]
    entry = node.get("features")
    items = entry.value.items if entry is not None and isinstance(entry.value, Listing) else None
    if items is None:
        problems.add("E008", node.mark, "this GeoJSON has no list of features")
    return [item for item in items or () if isinstance(item, Mapping_)]


def properties(feature: Mapping_) -> tuple[Entry, ...]:
    """Return the properties of a feature that say something."""
    entry = feature.get("properties")
    entries = entry.value.entries if entry is not None and isinstance(entry.value, Mapping_) else ()
    return tuple(one for one in entries if not (isinstance(one.value, Scalar) and one.value.text in ("", "null")))


def shape(feature: Mapping_, problems: Problems) -> Node | None:
    """Return the point, line or region of a feature as the language writes it; None if it has none, which was reported."""
    inner = feature.get("geometry") if _word(feature, "type") == "Feature" else None
    at = inner.value if inner is not None else feature
    kind = _word(at, "type") if isinstance(at, Mapping_) else ""
    points = at.get("coordinates") if isinstance(at, Mapping_) else None
    if points is None or kind not in _SHAPES:
        what = f"this {kind} has no coordinates" if kind in _SHAPES else "this feature has no shape"
        what = f"this is a {kind}" if kind in _KINDS and kind not in ("Feature", *_SHAPES) else what
        problems.add("E008", at.mark, what, "use a Point, a LineString or a Polygon without holes")
        return None
    if kind == "Point":
        return _degrees(points.value, problems)
    if kind != "Polygon":
        return _places(points.value, problems)
    rings = points.value.items if isinstance(points.value, Listing) else ()
    if len(rings) != 1:
        what = f"a region has one ring, its border, and no holes; this Polygon has {len(rings)}"
        problems.add("E008", points.value.mark, what)
        return None
    border = _places(rings[0], problems)
    if border is not None and len(border.items) > 1 and _same(border.items[0], border.items[-1]):
        return Listing(border.items[:-1], border.mark)
    return border


def _places(node: Node, problems: Problems) -> Listing | None:
    if not isinstance(node, Listing):
        problems.add("E008", node.mark, "coordinates are a list of points: [[longitude, latitude], ...]")
        return None
    places = [place for item in node.items if (place := _degrees(item, problems)) is not None]
    return Listing(tuple(places), node.mark) if len(places) == len(node.items) else None


def _degrees(node: Node, problems: Problems) -> Mapping_ | None:
    items = node.items if isinstance(node, Listing) else ()
    if len(items) < 2 or not all(isinstance(item, Scalar) for item in items):
        problems.add("E008", node.mark, "a point is a list of numbers: [longitude, latitude]")
        return None
    lng, lat = items[:2]
    return Mapping_((Entry(Scalar("lat", lat.mark), lat), Entry(Scalar("lng", lng.mark), lng)), node.mark)


def _same(first: Node, last: Node) -> bool:
    return [_text(first, key) for key in ("lat", "lng")] == [_text(last, key) for key in ("lat", "lng")]


def _text(node: Node, key: str) -> str:
    entry = node.get(key) if isinstance(node, Mapping_) else None
    return entry.value.text if entry is not None and isinstance(entry.value, Scalar) else ""


_word = _text
