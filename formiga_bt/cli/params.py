"""Parameters from the command line: `target=camp`, `target=66.501,25.703`, `region=@area.geojson`, `height=60 m`.

`@file` is replaced by what the file holds: GeoJSON (a point, a line, a polygon without holes) becomes degrees in the form that
the language reads, any other file its text.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from formiga_bt.cli.inputs import UnusableFile

LIMIT = 1_000_000
"""Bytes of a file."""


def read_params(words: Sequence[str]) -> dict[str, str]:
    """Return `NAME=VALUE` words as a mapping.

    Raises:
        UnusableFile: a word has no `=`, a name comes twice, or a file cannot be used.
    """
    found: dict[str, str] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not name.strip():
            raise UnusableFile(f"'{word}' is not NAME=VALUE")
        if name.strip() in found:
            raise UnusableFile(f"'{name.strip()}' is given twice")
        found[name.strip()] = of_file(Path(value[1:])) if value.startswith("@") else value
    return found


def of_file(path: Path) -> str:
    """Return what a file says as the text of a parameter.

    Raises:
        UnusableFile: it cannot be read, or is GeoJSON of a shape that no parameter has.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UnusableFile(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from error
    if len(text) > LIMIT:
        raise UnusableFile(f"{path} is larger than {LIMIT:,} bytes")
    if path.suffix.lower() not in (".json", ".geojson"):
        return text.strip()
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UnusableFile(f"{path} is no JSON: {error}") from error
    return json.dumps(_value(data, path))


def _value(data: Any, path: Path) -> Any:
    if not isinstance(data, Mapping) or "type" not in data:
        return data
    kind = data["type"]
    try:
        if kind == "FeatureCollection":
            features = data["features"]
            if len(features) != 1:
                raise UnusableFile(f"{path} holds {len(features)} features; a parameter is one: save it alone")
            return _value(features[0], path)
        if kind == "Feature":
            return _value(data["geometry"], path)
        if kind == "Point":
            return _degrees(data["coordinates"])
        if kind in ("LineString", "MultiPoint"):
            return [_degrees(point) for point in data["coordinates"]]
        if kind == "Polygon":
            return _ring(data["coordinates"], path)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise UnusableFile(f"{path} is no usable GeoJSON: {type(error).__name__} {error}") from error
    raise UnusableFile(f"{path} holds a {kind}; use a Point, a LineString or a Polygon without holes")


def _ring(rings: Any, path: Path) -> list[dict[str, float]]:
    if len(rings) != 1:
        raise UnusableFile(f"{path} holds a Polygon with {len(rings) - 1} holes; a region has none")
    corners = [_degrees(point) for point in rings[0]]
    return corners[:-1] if len(corners) > 1 and corners[0] == corners[-1] else corners


def _degrees(point: Any) -> dict[str, float]:
    lng, lat = float(point[0]), float(point[1])  # GeoJSON says longitude first
    if not (-90.0 <= lat <= 90.0 and -180.0 <= lng <= 180.0):
        raise ValueError(f"({lng:g}, {lat:g}) are no degrees of longitude and latitude")
    return {"lat": lat, "lng": lng}
