"""`NotServed`: a task file that an engine does not serve, and why. `formiga up` finds them, whoever asks for one is told.

A file that was written since is found by `unread_in`, when somebody asks for its task.
"""

import shlex
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

from formiga_bt.lang.request.aliases import names_in

MOST_LOOKED_AT: Final = 500
"""Files of a folder in which the name of a task is looked for."""
MOST_READ: Final = 4_000
"""Characters of each; a task's name stands at its head."""


@dataclass(frozen=True, slots=True)
class NotServed:
    """A file that the start of an engine passed over."""

    why: str
    """Its first error and where that is."""
    command: str = ""
    """Tells all its errors."""
    names: tuple[str, ...] = ()
    """Of the task that it holds, the aliases too, as far as they can be read; of none, if another file has them."""
    load: str = ""
    """The command that has the engine read it again, or empty."""
    shipped: bool = False
    """It ships with formiga_bt, and this site has not what it needs: nobody chose it, so the start does not speak of it."""

    @property
    def text(self) -> str:
        """Return why it is not served, and the command that tells more."""
        return "; ".join(part for part in (self.why, self.command) if part)

    @property
    def hint(self) -> str:
        """Return what helps."""
        mended = f"; when it is fixed: {self.load}" if self.load else ""
        return f"{self.command} shows all errors{mended}"


def of_name(refused: Iterable[NotServed], name: str) -> NotServed | None:
    """Return the first file that holds the task of this name, or None."""
    return next((one for one in refused if name in one.names), None)


def unread_in(folder: Path, name: str) -> str:
    """Return the command that has an engine read the file below a folder that holds the task of this name, or empty."""
    for path in islice(sorted(folder.rglob("*.yaml")), MOST_LOOKED_AT):
        with suppress(OSError, UnicodeDecodeError), path.open(encoding="utf-8") as file:
            if name in names_in(file.read(MOST_READ)):
                return f"formiga load {shlex.quote(str(path))}"
    return ""
