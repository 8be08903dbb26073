"""The catalogues that ship, by name, and which of them would help who misses a type."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from formiga_bt.base.packaged import files as packaged_files
from formiga_bt.lang.text.reading import quoted_list


def shipped_catalogues() -> Mapping[str, Path]:
    """Return the catalogues that ship, by name."""
    return {path.stem: path for path in packaged_files("actions")}


def types_help(word: str, known: Iterable[str]) -> str:
    """Return what helps who named a type that is not known: those that are, and the catalogue that ships and has it."""
    entry = re.compile(rf"^  {re.escape(word)}:", re.MULTILINE)
    having = [name for name, path in shipped_catalogues().items() if entry.search(path.read_text(encoding="utf-8"))]
    said = f"types: {quoted_list(known)}"
    return f"{said}; '{word}' is in a catalogue that ships: actions: [{having[0]}] in site.yaml" if having else said
