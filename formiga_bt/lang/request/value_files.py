"""Values of parameters that stand in files: the rows of a table, the features of a map, or plain YAML.

| file | what it gives |
|---|---|
| `.csv` | a list, an item a row; of a parameter that is no list its only row (`tables`) |
| `.geojson`, `.json` | a list, an item a feature, else the only feature (`geojson`); other JSON as YAML |
| `.yaml`, `.yml` | a value as it is written under `params`, or a mapping of several parameters |

A row becomes what the type is: a place of its columns `lat` and `lng` (or `east` and `north`), a record of the columns that are
called as its fields, anything else of its only column. Nothing of a file is computed: `${...}` is refused. What is wrong is
reported with the file and the row. Called where values are bound: command line, engine, scenarios, cases.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from msgspec import Struct

from formiga_bt.base.bounds import MOST_FILE_BYTES
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Param
from formiga_bt.lang.request import geojson
from formiga_bt.lang.request.tables import read_table
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar, parse
from formiga_bt.lang.text.reading import Problems, did_you_mean, quoted_list, read_text, shorten, why_unreadable
from formiga_bt.lang.types import PLACE, Type

SUFFIXES: Final = (".csv", ".geojson", ".json", ".yaml", ".yml")
_LAT_LNG: Final = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*")
_POINTS: Final = (("lat", "lng"), ("lat", "lon"), ("east", "north"))


class ValueFile(Struct, frozen=True):
    """A file of values, and the parameter that it is for; "" = the one that is called as the file is, or several."""

    file: str
    text: str
    param: str = ""


def read_value_file(path: Path, param: str = "") -> ValueFile | str:
    """Return a file of values, or why it cannot be used."""
    if path.suffix.lower() not in SUFFIXES:
        return f"'{shorten(str(path))}' is no file of values: {', '.join(SUFFIXES)}"
    try:
        if not path.is_file():
            return f"there is no file '{shorten(str(path))}'"
        if path.stat().st_size > MOST_FILE_BYTES:
            return f"{path} is larger than {MOST_FILE_BYTES:,} bytes"
        return ValueFile(str(path), path.read_text(encoding="utf-8-sig"), param)
    except (OSError, ValueError) as error:
        return f"{path} cannot be read: {why_unreadable(error)}"


def read_params_from(node: Node, folder: Path, problems: Problems) -> list[ValueFile]:
    """Return the files that a key `params_from` names: one, a list of them, or a mapping of parameters to files."""
    pairs: list[tuple[str, Node]] = [("", node)]
    if isinstance(node, Mapping_):
        pairs = [(entry.key.text, entry.value) for entry in node.entries]
    elif isinstance(node, Listing):
        pairs = [("", item) for item in node.items]
    found = []
    for param, item in pairs:
        at = read_text(item, problems, "params_from")
        if at is None:
            continue
        leads_out = Path(at.text).is_absolute() or "\0" in at.text
        read = "a file is named by its path from here" if leads_out else read_value_file(folder / at.text, param)
        if isinstance(read, str):
            problems.add("E008", at.mark, read, "a file beside this one, such as spots.csv")
        else:
            found.append(read)
    return found


def entries_of(files: Iterable[ValueFile], params: Mapping[str, Param], problems: Problems) -> list[Entry]:
    """Return what files say of parameters, as if it were written under `params`; what is wrong was reported.

    Args:
        files: of values.
        params: of the task, by their names and aliases.
        problems: where to report.
    """
    return [entry for one in files for entry in _entries(one, params, problems)]


def _entries(one: ValueFile, params: Mapping[str, Param], problems: Problems) -> list[Entry]:
    node = _read(one, problems)
    if node is None:
        return []
    is_table = one.file.lower().endswith(".csv")
    if not one.param and (several := _several(node)):
        return [entry for entry in several if not _computes(entry.value, problems)]
    name = _name(one)
    if name not in params:
        what = f"the file is for the parameter '{shorten(name)}', and there is none{did_you_mean(name, params)}"
        help_ = f"say which it is for: {{{next(iter(params), 'NAME')}: {Path(one.file).name}}}"
        problems.add("E010", Mark(one.file, 1, 1), what, help_)
        return []
    value = _shaped(node, params[name], is_table, problems)
    return [Entry(Scalar(name, Mark(one.file, 1, 1)), value)] if value is not None else []


def given_in(files: Iterable[ValueFile]) -> list[str]:
    """Return the names under which files give parameters."""
    found = []
    for one in files:
        several = () if one.param else _several(_read(one, Problems()))
        found += [entry.key.text for entry in several] or [_name(one)]
    return found


def _name(one: ValueFile) -> str:
    return one.param or re.sub(r"\W", "_", Path(one.file).stem)


def _several(node: Node | None) -> tuple[Entry, ...]:
    """Return the entries of a document that is a mapping of parameters."""
    return node.entries if isinstance(node, Mapping_) and not geojson.is_geojson(node) else ()


def _read(one: ValueFile, problems: Problems) -> Node | None:
    if one.file.lower().endswith(".csv"):
        if len(one.text) > MOST_FILE_BYTES:
            problems.add("E003", Mark(one.file, 1, 1), f"the file is larger than {MOST_FILE_BYTES:,} bytes")
            return None
        return read_table(one.text, one.file, problems)
    is_json = Path(one.file).suffix.lower() in (".json", ".geojson")
    node, found = parse(one.text.replace("\t", " ") if is_json else one.text, one.file)
    problems.extend(found)
    if node is None and not found:
        problems.add("E008", Mark(one.file, 1, 1), "the file is empty")
    return None if found else node


def _shaped(node: Node, param: Param, is_table: bool, problems: Problems) -> Node | None:
    """Return the value of a parameter as the language writes it."""
    before = len(problems.found)
    of, item = param.type, param.type.item
    if geojson.is_geojson(node) and isinstance(node, Mapping_):
        found = geojson.features(node, problems)
        made = [_of_feature(one, item if of.name == "list" and item is not None else of, problems) for one in found]
        if of.name == "list" and len(made) == 1 and item == PLACE and isinstance(made[0], Listing):
            return made[0]  # a line is its places
    elif is_table and isinstance(node, Listing):
        found = [row for row in node.items if isinstance(row, Mapping_)]
        kind = PLACE if of.name == "region" else item if of.name == "list" and item is not None else of
        made = [_of_row(row, kind, param.name, problems) for row in found]
        if of.name == "region":
            of = Type("list", item=PLACE)
    else:
        return None if _computes(node, problems) else _plain(node, of)
    values = tuple(one for one in made if one is not None and not _computes(one, problems))
    if problems.has_errors(before):
        return None
    if of.name == "list":
        return Listing(values, node.mark)
    if len(values) != 1:
        mark = found[1].mark if len(found) > 1 else node.mark
        what = f"'{param.name}' is one {param.type}, this file holds {len(values)}"
        problems.add("E008", mark, what, f"a list takes them all: {{list: {param.type.name}}}")
        return None
    return values[0]


def _of_row(row: Mapping_, of: Type, name: str, problems: Problems) -> Node | None:
    if of.name in ("place", "position"):
        return _point(row, of) or _only(row, of, name, problems)
    if of.name == "record":
        return _record(row.entries, of, _point(row, PLACE), row.mark)
    return _only(row, of, name, problems)


def _of_feature(feature: Mapping_, of: Type, problems: Problems) -> Node | None:
    if of.name not in ("place", "position", "region", "record", "list", "any"):
        problems.add("E013", feature.mark, f"a feature of GeoJSON is no {of}")
        return None
    made = geojson.shape(feature, problems)
    return _record(geojson.properties(feature), of, made, feature.mark) if of.name == "record" and made else made


def _record(entries: Sequence[Entry], of: Type, made: Node | None, mark: Mark) -> Mapping_:
    """Return the record of a row: the columns that are called as its fields, and its only place, if that has no column."""
    mine = [Entry(one.key, _plain(one.value, of.fields[one.key.text])) for one in entries if one.key.text in of.fields]
    named = {one.key.text for one in mine}
    open_ = [name for name, kind in of.fields.items() if name not in named and kind.name in ("place", "region")]
    if made is not None and len(open_) == 1:
        mine.append(Entry(Scalar(open_[0], made.mark), made))
    return Mapping_(tuple(mine), mark)


def _point(row: Mapping_, of: Type) -> Mapping_ | None:
    """Return the point of a row's columns, None if it has not both of a pair."""
    for first, second in _POINTS:
        pair = [row.get(first), row.get(second)]
        if all(one is not None for one in pair):
            found = [Entry(Scalar(one.key.text.replace("lon", "lng"), one.key.mark), one.value) for one in pair if one]
            height = row.get("height") if of.name == "position" else None
            return Mapping_((*found, *([height] if height is not None else [])), row.mark)
    return None


def _only(row: Mapping_, of: Type, name: str, problems: Problems) -> Node | None:
    """Return the value of a row that is to be one value: its only column, or the one that is called as the parameter."""
    entry = row.get(name) or (row.entries[0] if len(row.entries) == 1 else None)
    if entry is None:
        columns = quoted_list([one.key.text for one in row.entries]) or "none"
        needs = "columns lat and lng, or east and north" if of == PLACE else f"one column, or one called '{name}'"
        problems.add("E022", row.mark, f"this row is no {of}; its columns: {columns}", f"it needs {needs}")
        return None
    return _plain(entry.value, of)


def _plain(node: Node, of: Type) -> Node:
    """Return a value with places that are written `66.5, 25.7` as `{lat, lng}`."""
    if isinstance(node, Listing) and of.name in ("list", "region"):
        inner = PLACE if of.name == "region" else of.item
        return Listing(tuple(_plain(one, inner) for one in node.items), node.mark) if inner is not None else node
    degrees = _LAT_LNG.fullmatch(node.text) if isinstance(node, Scalar) and of == PLACE else None
    if degrees is None:
        return node
    pair = (("lat", degrees[1]), ("lng", degrees[2]))
    return Mapping_(tuple(Entry(Scalar(key, node.mark), Scalar(text, node.mark)) for key, text in pair), node.mark)


def _computes(node: Node, problems: Problems) -> bool:
    """Report a value that would be computed; a file holds values only."""
    if isinstance(node, Scalar):
        if "${" in node.text:
            problems.add("E008", node.mark, "a file of values computes nothing", "write the value itself, without ${}")
        return "${" in node.text
    inner = node.items if isinstance(node, Listing) else [entry.value for entry in node.entries]
    return [one for one in inner if _computes(one, problems)] != []
