"""Where the files that ship with formiga_bt lie: the action catalogue, the task library, the pages of codes.

In a checkout they are the folders `actions/`, `trees/` and `docs/` beside the package, in an installed wheel they lie inside it
(`formiga_bt/_data`). Used by the command line and by whoever needs the default catalogue.
"""

from pathlib import Path
from typing import Literal

Folder = Literal["actions", "trees", "docs"]

_PACKAGE = Path(__file__).resolve().parents[1]


def folder(name: Folder) -> Path:
    """Return the shipped folder `name`, which need not exist in a broken installation."""
    inside = _PACKAGE / "_data" / name
    return inside if inside.is_dir() else _PACKAGE.parent / name


def files(name: Folder) -> list[Path]:
    """Return the YAML files of a shipped folder and its subfolders, sorted, without `*.test.yaml`."""
    found = folder(name).rglob("*.yaml")
    return sorted(path for path in found if not path.name.endswith(".test.yaml"))
