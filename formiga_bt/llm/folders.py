"""Where things of models are kept: fetched files and what was learned in the user's cache, the default in the configuration.

Nothing secret is ever written in either.
"""

import json
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any


def cache_folder() -> Path:
    """Return the folder of things that can be had again: XDG_CACHE_HOME/formiga, or ~/.cache/formiga."""
    return _base("XDG_CACHE_HOME", ".cache")


def config_folder() -> Path:
    """Return the folder of what a person chose: XDG_CONFIG_HOME/formiga, or ~/.config/formiga."""
    return _base("XDG_CONFIG_HOME", ".config")


def _base(variable: str, otherwise: str) -> Path:
    named = Path(os.environ.get(variable, ""))
    return (named if named.is_absolute() else Path.home() / otherwise) / "formiga"


def read_object(path: Path) -> dict[str, Any]:
    """Return the JSON object in a small file; {} if there is none that can be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def write_object(path: Path, value: dict[str, Any]) -> None:
    """Put a JSON object in a file, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(value, file, indent=2, sort_keys=True)
            file.write("\n")
        Path(name).replace(path)
    except BaseException:
        with suppress(OSError):
            Path(name).unlink()
        raise
