"""Findings, and how checks are run: side by side, and none for longer than it is given.

A check that reads a file of a dead network disk, or asks a server that says nothing, cannot be ended. So each runs in a thread
that nobody waits for beyond its time, and that the end of the process takes along.
"""

import threading
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from msgspec import Struct

from formiga_bt.base.errors import FormigaError, UnusableFile

if TYPE_CHECKING:
    from formiga_bt.base.site_folder import EngineAddress
    from formiga_bt.cli.inputs import CheckWorld
    from formiga_bt.lang.model import Site

Level = Literal["ok", "warn", "fail"]
"""`warn`: it works, and somebody should look. `fail`: it does not, or is not safe."""
RANK: Final = ("ok", "warn", "fail")
GIVEN_S: Final = 10.0
"""So long a check may take."""


class Finding(Struct, frozen=True, omit_defaults=True):
    """What a check found."""

    level: Level
    what: str
    where: str = ""
    """The file, address or machine."""
    fix: str = ""
    """What a person can do."""


class Patient(Struct, frozen=True):
    """What is looked at."""

    site: Path
    """The site file."""
    http: str
    """`host:port` of the API, as `formiga up` is told."""
    runtime: Path
    """The runtime folder, whether it is there or not."""
    world: "CheckWorld | None" = None
    """None: the site file cannot be used."""
    engine: "EngineAddress | None" = None
    """None: none runs, or it cannot be found."""

    @property
    def model(self) -> "Site | None":
        """Return the checked site."""
        return self.world.site if self.world is not None else None


class Check(Struct, frozen=True):
    """A row of the table."""

    name: str
    about: str
    """What is looked at, for people."""
    look: Callable[[Patient], Iterable[Finding]]
    late: str = "look whether a disk or a server there answers at all"
    """What to do if it does not end."""


class Checked(Struct, frozen=True):
    """What a check found, under its name."""

    check: str
    finding: Finding


def read_patient(read: Callable[[], Patient], given_s: float = GIVEN_S) -> Patient | None:
    """Return what a reader makes of a site; None: it did not come to its end, as on a disk that does not answer.

    Raises:
        FormigaError: the reader's.
    """
    made: list[Patient] = []
    wrong: list[FormigaError] = []

    def run() -> None:
        try:
            made.append(read())
        except FormigaError as error:
            wrong.append(error)

    thread = threading.Thread(target=run, name="check-read", daemon=True)
    thread.start()
    thread.join(given_s)
    if wrong:
        raise wrong[0]
    return made[0] if made else None


def run_checks(checks: Sequence[Check], patient: Patient, given_s: float = GIVEN_S) -> list[Checked]:
    """Return what all checks find, in their order, within `given_s` seconds."""
    found: dict[str, list[Finding]] = {}

    def run(check: Check) -> None:
        found[check.name] = _looked(check, patient)

    threads = [threading.Thread(target=run, args=(one,), name=f"check-{one.name}", daemon=True) for one in checks]
    for thread in threads:
        thread.start()
    until = time.monotonic() + given_s
    for thread in threads:
        thread.join(max(0.0, until - time.monotonic()))
    return [
        Checked(one.name, finding)
        for one in checks
        for finding in found.get(one.name) or [late(one.about, given_s, one.late)]
    ]


def worst(found: Iterable[Checked]) -> Level:
    """Return the worst level of all."""
    return max((one.finding.level for one in found), key=RANK.index, default="ok")


def _looked(check: Check, patient: Patient) -> list[Finding]:
    try:
        return list(check.look(patient)) or [Finding("ok", check.about)]
    except UnusableFile as error:
        return [Finding("fail", error.text, fix=error.help)]
    except FormigaError as error:
        text, _, hint = error.text.partition("\n  help: ")
        return [Finding("fail", text, fix=error.help or hint)]
    except Exception as error:  # noqa: BLE001 - a bug in one check must not hide what the others find
        return [Finding("warn", f"this check has a bug: {type(error).__name__}: {error}")]


def late(about: str, given_s: float = GIVEN_S, fix: str = "look whether its disk answers at all") -> Finding:
    """Return the finding of a look that did not come to its end."""
    return Finding("fail", f"no answer within {given_s:g} s: {about}", fix=fix)
