"""The catalogues that ship, by name; and where who misses a type or an action finds it, there or beside the file."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

from formiga_bt.base.packaged import files as packaged_files
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import quoted_list

_MOST_BESIDE: Final = 200
"""So many files beside a task are looked at."""


def shipped_catalogues() -> Mapping[str, Path]:
    """Return the catalogues that ship, by name."""
    return {path.stem: path for path in packaged_files("actions")}


def types_help(at: Scalar, known: Iterable[str]) -> str:
    """Return what helps who named a type that is not known: those that are, and a catalogue that has it."""
    return "; ".join([f"types: {quoted_list(known)}", *_where(at, "types")])


def actions_help(at: Scalar, known: Collection[str], *, elsewhere: bool = False) -> str:
    """Return what helps who named an action that is not known; `elsewhere`: no type that is known has it."""
    where = _where(at, "actions") if elsewhere else ()
    return "; ".join([*([f"actions: {quoted_list(known)}"] if known else []), *where])


def _where(at: Scalar, section: str) -> Iterator[str]:
    """Say which catalogue has a name and how a site names it: one that ships, else one beside the file that asks for it."""
    entry = re.compile(rf"^{section}:[ ]*\n(?:(?:[ ].*|#.*)?\n)*?  {re.escape(at.text)}:", re.MULTILINE)
    for name, path in shipped_catalogues().items():
        if _has(path, entry):
            yield f"'{at.text}' is in a catalogue that ships: actions: [{name}] in site.yaml"
            return
    for word, path in _beside(Path(at.mark.file)):
        if _has(path, entry):
            yield f"'{at.text}' is in {word}: actions: [{word}] in site.yaml, or --actions {word}"
            return


def _beside(file: Path) -> Iterator[tuple[str, Path]]:
    """Iterate over the files in the folder of a file and in its `actions`, as a site there would name them.

    Of a task in `trees`, that is the folder above it.
    """
    if not file.is_file():  # it was given as a text
        return
    folder = file.absolute().parent
    folder = folder.parent if folder.name == "trees" else folder
    found = [*sorted(folder.glob("*.yaml")), *sorted((folder / "actions").glob("*.yaml"))]
    for path in found[:_MOST_BESIDE]:
        if path != file.absolute():
            yield path.relative_to(folder).as_posix(), path


def _has(path: Path, entry: re.Pattern[str]) -> bool:
    try:
        return entry.search(path.read_text(encoding="utf-8")) is not None
    except (OSError, UnicodeDecodeError):
        return False
