"""The site's agents as simulated ones, each in a process of its own: `formiga up --sim`, and `formiga sim` beside any engine.

One process simulates the agents of a site: it holds `sim.lock` of the runtime folder, which goes when the process goes.
"""

import fcntl
import os
import shutil
import time
from collections import Counter
from collections.abc import Container
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Final

from agents_sim.launch import FleetProcesses
from formiga_bt.base.authority import check_keys
from formiga_bt.base.errors import SiteError
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal.rehearsal import fleet_of

STARTS: Final = 3
"""So often an agent whose process ended by itself is started again."""
LOCK: Final = "sim.lock"
FILES: Final = "sim"
"""The folder of the agents' files, in the runtime folder."""


class Simulated:
    """A context manager: the agents run inside, none is left after.

    Args:
        site, catalogue: which agents there are.
        connect: where they look for an engine.
        folder: the site's runtime folder.
        without: agents that are not simulated: people who answer at the desk.
        keys: the site's folder of keys, if it is secured.
        anew: how a person starts all of them anew.

    Raises:
        KeysError: one of them has no keys that count.
        SiteError: they are simulated already, or the runtime folder cannot be written.
    """

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        *,
        connect: str,
        folder: Path,
        without: Container[str] = (),
        keys: Path | None = None,
        anew: str = "end the engine and start it again: formiga down, then formiga up --sim",
    ) -> None:
        self._specs = [spec for spec in fleet_of(site, catalogue) if spec.id not in without]
        self._site, self._connect, self._folder, self._anew = site.name, connect, folder, anew
        self._keys = keys
        if keys is not None:
            check_keys(keys, [spec.id for spec in self._specs], time.time())
        self._lock: IO[str] | None = None
        self._fleet: FleetProcesses | None = None
        self._again: Counter[str] = Counter()
        self._left: set[str] = set()

    @property
    def agents(self) -> list[str]:
        """Return the ids of all that are simulated."""
        return [spec.id for spec in self._specs]

    def look(self) -> list[str]:
        """Start agents again whose processes ended by themselves, `STARTS` times each; return what to tell."""
        told = []
        ended = self._fleet.ended() if self._fleet is not None else {}
        for agent, code in ended.items():
            if agent in self._left or self._fleet is None:
                continue
            what = f"the process of the simulated {agent} ended with status {code}: {self._fleet.last_words(agent)}"
            if self._again[agent] < STARTS:
                self._again[agent] += 1
                self._fleet.start(agent)
                told.append(f"{what}\n  it was started again ({self._again[agent]} of at most {STARTS} times)")
            else:
                self._left.add(agent)
                told.append(
                    f"{what}\n  it is not started again; what it printed: {self._fleet.log_of(agent)}\n"
                    f"  help: {self._anew}"
                )
        return told

    def __enter__(self) -> "Simulated":
        self._lock = _take(self._folder)
        # Afresh at each start: an engine that is new, too, would know nothing of goals that an old body still flies.
        state_dir = self._folder / FILES
        shutil.rmtree(state_dir, ignore_errors=True)
        self._fleet = FleetProcesses(
            self._specs, site=self._site, connect=self._connect, state_dir=state_dir, keys=self._keys
        )
        try:
            self._fleet.__enter__()
        except BaseException:
            self._lock.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._fleet is not None:
            self._fleet.close()
        if self._lock is not None:
            self._lock.close()


def check_unsimulated(folder: Path) -> None:
    """Look whether the agents of a runtime folder's site are not simulated yet; only `Simulated` makes sure of it.

    Raises:
        SiteError: they are, or the folder cannot be written.
    """
    _take(folder).close()


def _take(folder: Path) -> IO[str]:
    """Return the lock, taken.

    Raises:
        SiteError: somebody has it, or it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / LOCK).open("a+", encoding="utf-8")
    except OSError as error:
        raise SiteError(
            f"cannot write the site's runtime folder {folder}: {error.strerror or error}",
            help="let this user write there (read-only or full disk? another owner?), then start again",
        ) from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        lock.seek(0)
        who = lock.read().strip()
        lock.close()
        raise SiteError(
            f"the agents of the site '{folder.name}' are simulated already{f' ({who})' if who else ''}",
            help="start the engine without --sim, they connect to it; or end that process first",
        ) from error
    with suppress(OSError):  # on a full disk nobody knows who has it
        lock.truncate(0)
        lock.write(f"process {os.getpid()}")
        lock.flush()
    return lock
