"""Parameters from the command line: `target=camp`, `target=66.501,25.703`, `region=@area.geojson`, `height=60 m`.

`@file` is replaced by what the file holds: GeoJSON (a point, a line, a polygon without holes) becomes degrees in the form that
the language reads, any other file its text.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.base.errors import TreeError
from formiga_bt.cli.inputs import UnusableFile

if TYPE_CHECKING:
    from formiga_bt.lang.model import Task
    from formiga_bt.lang.request.profiles import Profile
    from formiga_bt.show.facts import LibraryTask

ProfileOption = Annotated[
    str,
    typer.Option(
        help="Values for parameters that are not given: a profile's name, for example paper-code, or its file.",
        metavar="NAME",
    ),
]

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


def of_profile(word: str, task: "Task", given: Iterable[str]) -> dict[str, str]:
    """Return what a profile says of the parameters of a task that are not given, under whatever alias.

    Raises:
        UnusableFile: there is no such profile.
        TreeError: its file has errors.
    """
    return _profile(word).fill(task, given) if word else {}


def of_profile_by_name(
    word: str, task: str, given: Iterable[str], library: "Sequence[LibraryTask]" = ()
) -> dict[str, str]:
    """Return the same for a task of a running engine: the parameters not given under any name that it has there.

    Args:
        word: the profile's name or file; "" = none.
        task: the task's name, or an alias.
        given: the names that a person used.
        library: what the engine says can be requested (`/v1/library`).

    Raises:
        UnusableFile: there is no such profile.
        TreeError: its file has errors.
    """
    if not word:
        return {}
    entry = next((one for one in library if one.task == task), None)
    entry = entry or next((one for one in library if task in one.aliases), None)
    params = entry.params if entry is not None else ()
    names = {alias: param.name for param in params for alias in (*param.aliases, param.name)}
    taken = {names.get(name, name) for name in given}
    texts = _profile(word).texts(task if entry is None else entry.task)
    return {name: text for name, text in texts.items() if names.get(name, name) not in taken}


def _profile(word: str) -> "Profile":
    from formiga_bt.lang.request.profiles import load_profile, profile_file, unknown_profile

    path = profile_file(word, (Path(),))
    if path is None:
        raise UnusableFile(f"--profile: {unknown_profile(word, (Path(),))}")
    loaded = load_profile(path)
    if loaded.profile is None:
        raise TreeError(f"{path} is no usable profile", loaded.diagnostics)
    return loaded.profile


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
        why = f"it has no {error}" if isinstance(error, KeyError) else f"{error}"
        if isinstance(error, IndexError | TypeError):
            why = "a point of it is no pair of numbers"
        raise UnusableFile(f"{path} is no usable GeoJSON: {why}") from error
    raise UnusableFile(f"{path} holds a {kind}; use a Point, a LineString or a Polygon without holes")


def _ring(rings: Any, path: Path) -> list[dict[str, float]]:
    if len(rings) != 1:
        raise UnusableFile(f"{path} holds a Polygon of {len(rings)} rings; a region has one, its border, and no holes")
    corners = [_degrees(point) for point in rings[0]]
    return corners[:-1] if len(corners) > 1 and corners[0] == corners[-1] else corners


def _degrees(point: Any) -> dict[str, float]:
    lng, lat = float(point[0]), float(point[1])  # GeoJSON says longitude first
    if not (-90.0 <= lat <= 90.0 and -180.0 <= lng <= 180.0):
        raise ValueError(f"({lng:g}, {lat:g}) are no degrees of longitude and latitude")
    return {"lat": lat, "lng": lng}
