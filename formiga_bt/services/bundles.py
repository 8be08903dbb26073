"""The store of tasks that were loaded into a running engine: `.formiga/<site>/bundles/`.

| file | what |
|---|---|
| `<hash>/...` | the texts of one bundle, under their paths below the site's folder |
| `<hash>/bundle.json` | which of them is the task, and who loaded it; written last: a folder without it is none |
| `served.json` | task -> the folder that was loaded last; what the next start of the engine serves again |

A folder is written once and never changed. The hash is of the texts and their paths.
"""

import hashlib
import json
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any, Final

from msgspec import Struct

from formiga_bt.errors import SiteError
from formiga_bt.site_folder import write_durably

BUNDLES: Final = "bundles"
ABOUT: Final = "bundle.json"
SERVED: Final = "served.json"
SHOWN: Final = 16
"""Characters of a hash in a folder's name."""


class Stored(Struct, frozen=True):
    """A bundle on disk."""

    folder: Path
    file: str
    """The task's file, below the folder."""
    by: str = ""
    unix_millis: int = 0

    @property
    def task_file(self) -> Path:
        """Return where the task lies."""
        return self.folder / self.file

    def text(self) -> str:
        """Return the task's text.

        Raises:
            SiteError: it cannot be read.
        """
        try:
            return self.task_file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SiteError(f"cannot read {self.task_file}: {error}") from error


class BundleStore:
    """The store of one site; one thread at a time writes.

    Args:
        runtime: the site's runtime folder.
    """

    def __init__(self, runtime: Path) -> None:
        self.path = runtime / BUNDLES

    def keep(self, file: str, texts: Mapping[str, str], *, by: str, unix_millis: int) -> tuple[Stored, bool]:
        """Write a bundle, safely on disk when this returns; and return whether it is new.

        Raises:
            SiteError: it cannot be written.
        """
        said = json.dumps([file, sorted(texts.items())], ensure_ascii=True)
        folder = self.path / hashlib.sha256(said.encode()).hexdigest()[:SHOWN]
        known = _about(folder)
        if known is not None:
            return known, False
        shutil.rmtree(folder, ignore_errors=True)  # what a power cut left
        for name, text in texts.items():
            path = folder / PurePosixPath(name)
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise SiteError(f"cannot write {path.parent}: {error.strerror or error}") from error
            write_durably(path, text)
        about = {"file": file, "by": by, "unix_millis": unix_millis}
        write_durably(folder / ABOUT, json.dumps(about, indent=2) + "\n")
        return Stored(folder, file, by, unix_millis), True

    def drop(self, stored: Stored) -> None:
        """Remove a bundle that turned out to have errors."""
        with suppress(OSError):
            (stored.folder / ABOUT).unlink()
        shutil.rmtree(stored.folder, ignore_errors=True)

    def served(self) -> dict[str, Stored]:
        """Return what was loaded last for each task, in the order of loading; what is gone is left out."""
        try:
            said: Any = json.loads((self.path / SERVED).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        found = {}
        for name, folder in said.items() if isinstance(said, dict) else ():
            stored = _about(self.path / PurePosixPath(str(folder)).name)
            if stored is not None:
                found[str(name)] = stored
        return found

    def serve(self, task: str, stored: Stored | None) -> None:
        """Note that a bundle is the newest of a task, or (None) that the next start need not know of it.

        Raises:
            SiteError: it cannot be written.
        """
        folders = {name: one.folder.name for name, one in self.served().items() if name != task}
        if stored is not None:
            folders[task] = stored.folder.name
        write_durably(self.path / SERVED, json.dumps(folders, indent=2) + "\n")


def _about(folder: Path) -> Stored | None:
    try:
        said = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        return Stored(folder, str(said["file"]), str(said.get("by", "")), int(said.get("unix_millis", 0)))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
