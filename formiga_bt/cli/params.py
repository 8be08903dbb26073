"""Parameters from the command line: `target=camp`, `target=66.501,25.703`, `region=@area.geojson`, `height=60 m`.

`@file` is replaced by what the file holds: GeoJSON (a point, a line, a polygon without holes) becomes degrees in the form that
the language reads, any other file its text.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.bounds import MOST_FILE_BYTES
from formiga_bt.base.errors import TreeError
from formiga_bt.cli.inputs import UnusableFile

if TYPE_CHECKING:
    from formiga_bt.lang.model import Task
    from formiga_bt.lang.request.profiles import Profile
    from formiga_bt.lang.request.value_files import ValueFile
    from formiga_bt.show.facts import LibraryTask

ParamsFromOption = Annotated[
    list[str] | None,
    typer.Option(
        "--params-from",
        help="A file of parameters: rows of a .csv, features of a .geojson, .yaml; may be repeated. NAME=FILE says for which.",
        metavar="FILE",
    ),
]
ProfileOption = Annotated[
    str,
    typer.Option(
        help="Values for parameters that are not given: a profile's name, for example paper-code, or its file.",
        metavar="NAME",
    ),
]


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
        if path.stat().st_size > MOST_FILE_BYTES:
            raise UnusableFile(f"{path} is larger than {MOST_FILE_BYTES:,} bytes")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise UnusableFile(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from error
    if path.suffix.lower() not in (".json", ".geojson"):
        return text.strip()
    return _of_json(text, str(path))


def _of_json(text: str, file: str) -> str:
    from formiga_bt.base.diagnostics import render
    from formiga_bt.lang.params import written
    from formiga_bt.lang.request import geojson
    from formiga_bt.lang.text.document import Mapping_, parse
    from formiga_bt.lang.text.reading import Problems

    problems = Problems()
    node, found = parse(text.replace("\t", " "), file)
    problems.extend(found)
    if not isinstance(node, Mapping_) or not geojson.is_geojson(node):
        value, said = None, text.strip()
    else:
        features = geojson.features(node, problems)
        if len(features) != 1 and not found:
            what = f"this file holds {len(features)} features; a parameter is one"
            problems.add("E008", node.mark, what, "--params-from takes a list of them")
        value = geojson.shape(features[0], problems) if len(features) == 1 else None
        said = written(value) if value is not None else ""
    if problems.found:
        raise UnusableFile("\n\n".join(render(one, {file: text}) for one in problems.found))
    return said


def value_files(words: Sequence[str]) -> "tuple[ValueFile, ...]":
    """Return the files of `--params-from`: `FILE`, or `NAME=FILE` of a parameter that is not called as the file is.

    Raises:
        UnusableFile: one cannot be read.
    """
    from formiga_bt.lang.request.value_files import read_value_file

    found = []
    for word in words:
        name, equals, file = word.rpartition("=")
        read = read_value_file(Path(file), name.strip()) if not equals or name.strip() else f"'{word}' is not NAME=FILE"
        if isinstance(read, str):
            raise UnusableFile(f"--params-from: {read}")
        found.append(read)
    return tuple(found)
