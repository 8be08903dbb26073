"""The store of tasks that were loaded into a running engine: `.formiga/<site>/bundles/`.

| file | what |
|---|---|
| `<hash>.json` | one bundle: the texts by their paths below the site's folder, which of them is the task, who loaded it |
| `served.json` | task -> the bundle that was loaded last; what the next start of the engine serves again |

A bundle is written once and never changed. The hash is of the texts and their paths: a path that a caller names is data in the
file, and never a path on this disk.
"""

import hashlib
import json
import os.path
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from formiga_bt.base.durable import move_aside
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import write_durably

BUNDLES: Final = "bundles"
SERVED: Final = "served.json"
SHOWN: Final = 16
"""Characters of a hash in a file's name."""


class Bundle(Struct, frozen=True):
    """What a file of the store holds."""

    file: str
    """Which of the texts is the task."""
    texts: dict[str, str]
    by: str = ""
    unix_millis: int = 0

    def __post_init__(self) -> None:
        if self.file not in self.texts:
            raise ValueError(f"it has no text of {self.file!r}")


class Stored(Struct, frozen=True):
    """A bundle on disk."""

    path: Path
    bundle: Bundle

    @property
    def folder(self) -> Path:
        """Return the folder below which its texts count as lying; no such folder is on the disk."""
        return self.path.with_suffix("")

    @property
    def task_file(self) -> Path:
        """Return where the task counts as lying."""
        return self.folder / self.bundle.file

    def text(self) -> str:
        """Return the task's text."""
        return self.bundle.texts[self.bundle.file]

    def read(self, path: Path) -> str:
        """Return a text of the bundle by where it counts as lying.

        Raises:
            FileNotFoundError: it is not in the bundle.
        """
        name = os.path.relpath(os.path.normpath(path), self.folder)
        if name not in self.bundle.texts:
            raise FileNotFoundError(2, "it is not in the bundle")
        return self.bundle.texts[name]


class BundleStore:
    """The store of one site; one thread at a time writes.

    Args:
        runtime: the site's runtime folder.
    """

    def __init__(self, runtime: Path) -> None:
        self.path = runtime / BUNDLES
        self.unusable: dict[str, str] = {}
        """Files that could not be used and were set aside: why, by name, in sentences."""

    def keep(self, file: str, texts: Mapping[str, str], *, by: str, unix_millis: int) -> tuple[Stored, bool]:
        """Write a bundle, safely on disk when this returns; and return whether it is new.

        Raises:
            SiteError: it cannot be written.
        """
        text = json.dumps([file, sorted(texts.items())], ensure_ascii=True)
        path = self.path / f"{hashlib.sha256(text.encode()).hexdigest()[:SHOWN]}.json"
        known = self._stored(path)
        if known is not None:
            return known, False
        bundle = Bundle(file, dict(texts), by, unix_millis)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SiteError(f"cannot write {self.path}: {error.strerror or error}") from error
        write_durably(path, msgspec.json.format(msgspec.json.encode(bundle)).decode() + "\n")
        return Stored(path, bundle), True

    def drop(self, stored: Stored) -> None:
        """Remove a bundle that turned out to have errors."""
        with suppress(OSError):
            stored.path.unlink()

    def served(self) -> dict[str, Stored]:
        """Return what was loaded last for each task, in the order of loading.

        What cannot be used is set aside (`unusable`); what is gone is named there, too.
        """
        file = self.path / SERVED
        names: dict[str, str] = {}
        if os.path.lexists(file):
            try:
                if not file.is_file():
                    raise ValueError("it is no file")
                names = msgspec.json.decode(file.read_bytes(), type=dict[str, str])
            except (OSError, ValueError, RecursionError):
                self._aside(file, "tasks that were loaded are not served: load them again")
        found = {}
        for name, key in names.items():
            plain = "".join(one for one in key if one.isalnum())[:SHOWN]
            stored = self._stored(self.path / f"{plain}.json")
            if stored is not None:
                found[name] = stored
            else:
                self.unusable.setdefault(
                    name, f"{name} was loaded, and its files are gone or damaged: it is not served; load it again"
                )
        return found

    def serve(self, task: str, stored: Stored | None) -> None:
        """Note that a bundle is the newest of a task, or (None) that the next start need not know of it.

        Raises:
            SiteError: it cannot be written.
        """
        keys = {name: one.path.stem for name, one in self.served().items() if name != task}
        if stored is not None:
            keys[task] = stored.path.stem
        write_durably(self.path / SERVED, json.dumps(keys, indent=2) + "\n")

    def _stored(self, path: Path) -> Stored | None:
        """Return the bundle of a file; one that cannot be used is set aside."""
        if not os.path.lexists(path):
            return None
        try:
            if not path.is_file():
                raise ValueError("it is no file")
            return Stored(path, msgspec.json.decode(path.read_bytes(), type=Bundle))
        except (OSError, ValueError, RecursionError):
            self._aside(path, "the task in it is not served: load it again")
            return None

    def _aside(self, file: Path, follows: str) -> None:
        with suppress(SiteError):
            where: Any = move_aside([file])
            self.unusable[file.name] = f"{BUNDLES}/{file.name} cannot be used; it was set aside in {where}: {follows}"
