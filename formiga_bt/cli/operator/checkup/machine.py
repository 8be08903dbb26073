"""Checks of the machine: its Python, its clock, its disks."""

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Final

from packaging.requirements import InvalidRequirement, Requirement

from formiga_bt import __version__
from formiga_bt.base.clock import SECOND
from formiga_bt.base.clock_sync import clock_sync
from formiga_bt.base.extras import DISTRIBUTION
from formiga_bt.base.site_folder import journal_of
from formiga_bt.cli.operator.checkup.finding import Finding, Level, Patient

OLDEST: Final = (3, 11)
OFF_S: Final = 2.0
"""A clock that is off by more is told."""
LITTLE: Final = 1_000_000_000
TOO_LITTLE: Final = 100_000_000
"""Bytes on a disk."""
TRIES: Final = 15
SLOW_S: Final = 0.05
TOO_SLOW_S: Final = 0.5
"""The engine raises `journal_slow` for a commit that takes longer."""
PROBE: Final = ".formiga-doctor-"


def versions(patient: Patient) -> Iterator[Finding]:  # noqa: ARG001 - as every check
    """Check Python and the libraries."""
    if sys.version_info[:2] < OLDEST:
        yield Finding("fail", f"Python {sys.version.split()[0]} is too old", sys.executable, "Python 3.11 or newer")
    try:
        needed = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        yield Finding("warn", "formiga_bt is not installed: what it requires is not known", sys.executable)
        return
    wrong = [text for line in needed if (text := _lack(line))]
    for text in wrong:
        fix = f"{sys.executable} -m pip install '{text.partition(' is ')[0]}'"
        yield Finding("fail", text, sys.executable, fix)
    if not wrong:
        yield Finding("ok", f"formiga_bt {__version__}, Python {sys.version.split()[0]}, all libraries as required")


def _lack(line: str) -> str:
    """Return what is wrong with an installed library; of extras only those that are there are looked at."""
    try:
        need = Requirement(line)
    except InvalidRequirement:
        return ""
    optional = need.marker is not None and not need.marker.evaluate({"extra": ""})
    bare = f"{need.name}{need.specifier}"
    try:
        found = metadata.version(need.name)
    except metadata.PackageNotFoundError:
        return "" if optional else f"{bare} is not installed"
    if need.specifier.contains(found, prereleases=True):
        return ""
    return "" if optional else f"{bare} is required, and {found} is installed"


def clock(patient: Patient) -> Iterator[Finding]:
    """Check whether something keeps this machine's clock right, and that engine time is near it."""
    told = clock_sync()
    fix = "timedatectl set-ntp true, or install chrony; a container has the clock of its host"
    if told is None:
        yield Finding("warn", "this system does not say whether its clock is right", fix=fix)
    elif not told.synchronised:
        level: Level = "fail" if patient.model is not None and patient.model.mode == "real" else "warn"
        yield Finding(level, "nothing keeps this machine's clock right: the kernel calls it not synchronised", fix=fix)
    elif told.most_off_s > OFF_S:
        yield Finding("warn", f"this machine's clock may be off by {told.most_off_s:.1f} s", fix=fix)
    else:
        yield Finding("ok", f"this machine's clock is right to {told.most_off_s * 1000:.0f} ms, says the kernel")
    ahead = _ahead_s(patient)
    if ahead is not None and abs(ahead) > OFF_S:
        text = f"engine time is {abs(ahead):.1f} s {'ahead of' if ahead > 0 else 'behind'} the wall clock"
        yield Finding("warn", text, fix="it approaches it by 1 % of the time that passes; docs/operating.md, The clock")


def _ahead_s(patient: Patient) -> float | None:
    if patient.engine is None or patient.model is None or patient.model.mode != "real":
        return None
    from formiga_bt.client import Client

    return Client(patient.engine).health().ahead_us / SECOND


def disks(patient: Patient) -> Iterator[Finding]:
    """Check the disks of the runtime folder and of the journal."""
    places = [_there(patient.runtime)]
    where = journal_of(patient.runtime)
    if where and "://" not in where:
        places.append(_there(Path(where).parent))
    for place in dict.fromkeys(places):
        yield _room(place)
        yield _speed(place)


def _there(place: Path) -> Path:
    """Return a folder, or the nearest one above it that is there."""
    return next(one for one in (place, *place.parents) if one.is_dir())


def _room(place: Path) -> Finding:
    found = os.statvfs(place)
    free = found.f_bavail * found.f_frsize
    text = f"{free / 1e9:.1f} GB are free"
    if found.f_files and not found.f_favail:
        return Finding("fail", "no more files can be made: the disk has no inodes left", str(place), "remove files")
    if free < LITTLE:
        level: Level = "fail" if free < TOO_LITTLE else "warn"
        return Finding(level, f"only {free / 1e6:.0f} MB are free", str(place), "make room; formiga journal compact")
    return Finding("ok", text, str(place))


def _speed(place: Path) -> Finding:
    """Return how long it takes until some bytes are safely on disk: each order waits for that."""
    taken = []
    try:
        with tempfile.NamedTemporaryFile(dir=place, prefix=PROBE) as probe:
            for _ in range(TRIES):
                begun = time.perf_counter()
                probe.write(b"x" * 8192)
                probe.flush()
                os.fsync(probe.fileno())
                taken.append(time.perf_counter() - begun)
    except OSError as error:
        text = f"it cannot be written: {error.strerror or error}"
        return Finding("fail", text, str(place), "make room, or let this user write there")
    middle, most = statistics.median(taken), max(taken)
    text = f"8 kB are on disk after {middle * 1000:.1f} ms (median of {TRIES}), {most * 1000:.1f} ms at most"
    if middle > SLOW_S:
        level: Level = "fail" if middle > TOO_SLOW_S else "warn"
        fix = "every order waits for it: take another disk, or formiga up --durability normal in a simulation"
        return Finding(level, text, str(place), fix)
    return Finding("ok", text, str(place))
