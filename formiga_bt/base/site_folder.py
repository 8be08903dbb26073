"""The runtime folder of a site, `.formiga/<site>/` beside the site file: what must outlive one start of the engine.

| file | what |
|---|---|
| `lock` | `flock`ed by the engine of the site; it goes when its process goes, however it ends |
| `epoch` | a number, one higher at each start; agents refuse orders of a lower one |
| `marks.json` | engine time and counters: a new start never uses an id or an instant again |
| `exact` | empty; while it is there the journal has every id that was used, also after a kill or a power cut |
| `engine.json` | where the engine is: API, local door, agents' endpoint, process; `flock`ed by it, else a leftover |
| `door` | the local door, a Unix socket, while the engine runs; elsewhere if this path is too long |
| `token` | the word that callers from other machines must know, in mode real all callers |
| `accounts.json` | accounts with their roles, and the hashes of their tokens |
| `keys/` | keys of the engine, the router and the agents, and the authority that made them (`authority.py`) |
| `audit.jsonl` | who asked for what, and what was refused: a line each; `audit.1.jsonl` is the older half |
| `secrets.json` | of each person with a secret of their own: its hash |
| `approvals.jsonl` | who approved what, and took it back: a line each, never changed |
| `fleet.jsonl` | who added which agent to the fleet, and removed it: a line each, never changed |
| `discovered.jsonl` | actions that agents announced, that no catalogue has, and that tasks may use: a line each |
| `fleets.jsonl` | fleets that were saved by name: a line each, the last of a name counts |
| `bundles/` | tasks that were loaded into the engine while it ran (`services.kept.bundles`) |
| `journal.db` | the journal: every step of the engine (`formiga_bt.journal`) |
| `journal.at` | where the journal is instead, if it was told to be elsewhere: a path or a URL without password |
| `no-journal` | the last start kept no journal, or none has begun yet |
| `restored.json` | the folder was made of a backup, and no start has journaled yet that all is HELD |
| `flights.jsonl` | the flight log: a line for each flight that has ended |
| `flying.json` | flights that have not ended |

Files are their owner's alone (0600), folders too (0700), whatever the umask; those of earlier versions are made so at a start.
Called by `formiga up` (through `SiteFolder`), and by every command that looks for a running engine (`find_engines`).
"""

import fcntl
import json
import os
import re
import time
import uuid
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, Final

from formiga_bt.base.durable import (
    append_line,
    is_held,
    make_private,
    move_aside,
    private_folder,
    read_lines,
    remove_durably,
    write_durably,
    write_held,
)
from formiga_bt.base.errors import SiteError
from formiga_bt.base.unusable_files import set_unusable_aside

__all__ = [
    "APPROVALS", "COUNTERS", "DISCOVERED", "FLEET", "FLEETS", "FLIGHTS", "FLYING", "FOLDER", "JOURNAL", "JOURNAL_AT",
    "RESERVE", "RESTORED", "EngineAddress", "SiteFolder", "append_line", "check_free", "find_engines", "find_folders",
    "is_running", "is_site_name", "journal_of", "read_address", "read_lines", "write_durably",
]  # fmt: skip

FOLDER: Final = ".formiga"
RESERVE: Final = 100
"""So many ids of each kind are set aside at once; after a crash the rest of them is passed over."""
LEFT: Final = 50
"""When no more of them are left, the next ones are set aside: a full disk then leaves ids for stops and ways home."""
UNTOLD: Final = 10_000
"""An older version did not note the counters of safety goals: they go on from here."""
RETRY_S: Final = 1.0
"""What could not be written is tried again after this."""
APPROVALS: Final = "approvals.jsonl"
FLEET: Final = "fleet.jsonl"
DISCOVERED: Final = "discovered.jsonl"
FLEETS: Final = "fleets.jsonl"
JOURNAL: Final = "journal.db"
JOURNAL_AT: Final = "journal.at"
FLIGHTS: Final = "flights.jsonl"
FLYING: Final = "flying.json"
EXACT: Final = "exact"
NO_JOURNAL: Final = "no-journal"
RESTORED: Final = "restored.json"
EVIDENCE: Final = ("epoch", "marks.json", FLYING, "alive.json", JOURNAL_AT)
"""Files that an earlier start left."""
UNKNOWN: Final = 1_000_000
"""Ids of each kind are passed over for each earlier start, if it is not known how many were used."""
UNKNOWN_EPOCHS: Final = 500
"""Passed over if the last epoch is not known: agents take a step of up to 1,000."""
COUNTERS: Final = ("task", "question", "clearance", "safety", "alarm")
"""The counters that ids of goals, and numbers of questions and alarms, are made of."""
TAKE_TRIES: Final = 5


@dataclass(frozen=True, slots=True)
class EngineAddress:
    """What `engine.json` says."""

    site: str
    pid: int
    epoch: int
    url: str
    """Of the HTTP API, without `/v1`."""
    endpoint: str
    """Where agents connect."""
    socket: str = ""
    """Path of its local door, a Unix socket; empty: it has none."""
    folder: str = ""

    @property
    def token_file(self) -> Path:
        """Return the file with the token."""
        return Path(self.folder) / "token"


def is_site_name(name: str) -> bool:
    """Return whether a site's name can name a folder."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name) is not None


class SiteFolder:
    """The runtime folder of one site, held by one engine. A context manager: entering takes the lock.

    Args:
        beside: the folder of the site file.
        site: the site's name.
        clock: seconds of a clock that never goes back.
    """

    def __init__(self, beside: Path, site: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.site = site
        self.path = beside.resolve() / FOLDER / site
        self.was_exact = False
        """The journal of the last start, which did not end cleanly, has every id that was used."""
        self.lack = ""
        """Why something that was noted is not on disk; empty: all of it is."""
        self.unusable: dict[str, str] = {}
        """Files that could not be used and were set aside at this start: why, by name."""
        self.lost_marks = False
        """It is not known which ids earlier starts have used."""
        self._clock = clock
        self._is_anew = self._had_evidence = False
        self._last_epoch = 0
        self._lock: IO[str] | None = None
        self._published: IO[str] | None = None
        """`engine.json`, held."""
        self._reserved = dict.fromkeys(COUNTERS, 0)
        self._last = dict.fromkeys(COUNTERS, 0)
        self._now_us = 0
        self._lines: deque[tuple[str, Mapping[str, Any]]] = deque()
        """What waits to be written: name of the file, record."""
        self._retry_at = 0.0

    def __enter__(self) -> "SiteFolder":
        self.take()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    # -- the lock ------------------------------------------------------------------------------------------------
    def take(self) -> None:
        """Take the site.

        Raises:
            SiteError: an engine runs on this site, or the folder cannot be written.
        """
        if not is_site_name(self.site):
            raise SiteError(f"the site's name {self.site!r} cannot name a folder: use letters, digits, '_' and '-'")
        try:
            private_folder(self.path.parent)
            private_folder(self.path)
            if os.path.lexists(self.path / "lock") and not (self.path / "lock").is_file():
                move_aside([self.path / "lock"])
            lock = (self.path / "lock").open("a+", encoding="utf-8")
        except OSError as error:
            raise SiteError(
                f"cannot write the site's runtime folder {self.path}: {error.strerror or error}",
                help="let this user write there (read-only or full disk? another owner?), then start again",
            ) from error
        for left in reversed(range(TAKE_TRIES)):
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError as error:
                if not left:
                    lock.close()
                    raise SiteError(_taken(self.path)) from error
                time.sleep(0.05)  # a command may just be looking whether an engine runs
        self._lock = lock
        self._had_evidence = any(os.path.lexists(self.path / one) for one in EVIDENCE)
        self.unusable = set_unusable_aside(self.path)
        there = _left_address(self.path)
        self._last_epoch = there.epoch if there is not None else 0
        if "epoch" in self.unusable:
            self._last_epoch += UNKNOWN_EPOCHS
        self.lost_marks = self._had_evidence and not (self.path / "marks.json").exists()
        self.keep_private()
        (self.path / "engine.json").unlink(missing_ok=True)  # where an engine that was killed has been

    def keep_private(self) -> None:
        """Take the rights of others away from all that is in the folder now: what libraries write follows the umask."""
        make_private(self.path)

    def release(self) -> None:
        """Give the site back; may be called twice."""
        if self._lock is None:
            return
        (self.path / "engine.json").unlink(missing_ok=True)
        if self._published is not None:
            self._published.close()
            self._published = None
        self._lock.close()
        self._lock = None

    # -- epoch and marks -------------------------------------------------------------------------------------------
    def next_epoch(self) -> int:
        """Return the epoch of this start: one higher than any that this folder knows, and safely on disk.

        Raises:
            SiteError: it cannot be written.
        """
        file = self.path / "epoch"
        try:
            known = int(file.read_text(encoding="ascii")) if file.exists() else 0
        except (OSError, ValueError) as error:  # it was looked at when the lock was taken
            raise SiteError(f"cannot use {file}: {error}") from error
        epoch = max(known, self._last_epoch) + 1
        write_durably(file, f"{epoch}\n")
        return epoch

    def engine_id(self) -> str:
        """Return which engine has this folder: made at its first start, and the same from then on.

        Raises:
            SiteError: it cannot be read or written.
        """
        file = self.path / "engine_id"
        try:
            known = file.read_text(encoding="ascii").strip() if file.exists() else ""
        except (OSError, ValueError) as error:
            raise SiteError(f"cannot use {file}: {error}") from error
        if not known:
            known = uuid.uuid4().hex[:12]
            write_durably(file, f"{known}\n")
        return known

    def raise_epoch(self, epoch: int) -> None:
        """Note the highest epoch in use: the journal knew of starts that this folder did not, or agents follow a higher one.

        Raises:
            SiteError: it cannot be written.
        """
        write_durably(self.path / "epoch", f"{epoch}\n")

    def keep_journal_at(self, where: str) -> None:
        """Note where the journal is, for whoever looks for it; that of the folder itself is found without.

        Args:
            where: an absolute path, or a URL without password.

        Raises:
            SiteError: it cannot be written.
        """
        file = self.path / JOURNAL_AT
        if where == str((self.path / JOURNAL).resolve()):
            file.unlink(missing_ok=True)
        elif journal_of(self.path) != where:
            write_durably(file, f"{where}\n")

    @property
    def had_journal(self) -> bool:
        """Return whether an earlier start kept a journal, by what it left here."""
        return not (self.path / NO_JOURNAL).exists() and (
            self._had_evidence or any((self.path / one).exists() for one in EVIDENCE)
        )

    @property
    def was_restored(self) -> bool:
        """Return whether this folder was made of a backup, and nobody has journaled yet that all is HELD."""
        return os.path.lexists(self.path / RESTORED)

    def forget_restored(self) -> None:
        """Note that all is HELD, safely.

        Raises:
            SiteError: it cannot be noted.
        """
        remove_durably(self.path / RESTORED)

    def note_journal(self, on: bool) -> None:
        """Note whether a journal has this site from now on.

        Raises:
            SiteError: it cannot be noted.
        """
        file = self.path / NO_JOURNAL
        if on != file.exists():
            return
        if on:
            remove_durably(file)
        else:
            write_durably(file, "")

    def begin_anew(self) -> Path | None:
        """Set aside what has a meaning only with the former engine's history; return the folder where it is now.

        Engine time is forgotten. Counters, the epoch, approvals, what was loaded, and flights stay.

        Raises:
            SiteError: it cannot be set aside.
        """
        self._is_anew = True
        return move_aside([self.path / one for one in ("alive.json", "resuming.json")])

    def marks(self) -> tuple[int, dict[str, int]]:
        """Return the engine time reached by the last start, and the counters to go on from.

        Raises:
            SiteError: the file cannot be read or written.
        """
        file = self.path / "marks.json"
        try:
            data: Any = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        except (OSError, ValueError) as error:  # it was looked at when the lock was taken
            raise SiteError(f"cannot read {file}: {error}") from error
        self._now_us = 0 if self._is_anew else int(data.get("now_us", 0))
        counters = data.get("counters", {})
        self._last = {name: int(counters.get(name, UNTOLD if counters else 0)) for name in COUNTERS}
        self._reserved = dict(self._last)
        self.was_exact = (self.path / EXACT).exists()
        return self._now_us, dict(self._last)

    def reserve(self, counters: Mapping[str, int], now_us: int) -> None:
        """Set ids aside for a start that goes on from these counters.

        Raises:
            SiteError: the file cannot be written.
        """
        self._last = {name: counters.get(name, 0) for name in COUNTERS}
        self._now_us = max(self._now_us, now_us)
        self._set_aside()

    def counted(self, name: str, value: int, now_us: int) -> None:
        """Note that a counter has this value, before an id made of it leaves the process; `lack` tells if that failed."""
        if name in COUNTERS:
            self._last[name] = value
            self._now_us = max(self._now_us, now_us)
            self.write_waiting()

    def add_line(self, name: str, record: Mapping[str, Any]) -> None:
        """Add a record to a file of JSON lines of this folder; `lack` tells if it must wait."""
        self._lines.append((name, record))
        self.write_waiting()

    def write_waiting(self) -> None:
        """Write what is not on disk yet; after a failure not before a second is over. `lack` tells how it went."""
        if self.lack and self._clock() < self._retry_at:
            return
        try:
            if self._is_low:
                self._set_aside()
            while self._lines:
                name, record = self._lines[0]
                append_line(self.path / name, record)
                self._lines.popleft()
        except SiteError as error:
            self.lack, self._retry_at = str(error), self._clock() + RETRY_S
        else:
            self.lack = ""

    def note_exact(self, on: bool) -> None:
        """Note whether the journal has every id from now on. That it has not is noted on a full disk, too."""
        try:
            if on:
                write_durably(self.path / EXACT, "")
            elif (self.path / EXACT).exists():
                remove_durably(self.path / EXACT)
        except SiteError as error:
            self.lack, self._retry_at = str(error), self._clock() + RETRY_S

    def settle(self, now_us: int) -> None:
        """At a clean end: write what waits; what was set aside and not used is free again.

        Raises:
            SiteError: the files cannot be written.
        """
        self._now_us, self._retry_at = max(self._now_us, now_us), 0.0
        self.write_waiting()
        if self.lack:
            raise SiteError(self.lack)
        self._save(self._last)
        self.note_exact(False)

    @property
    def _is_low(self) -> bool:
        """Return whether ids of some kind come to their end."""
        return any(value > self._reserved[name] - LEFT for name, value in self._last.items() if value)

    def _set_aside(self) -> None:
        more = {name: n + RESERVE for name, n in self._last.items() if n > self._reserved[name] - LEFT}
        reserved = {**self._reserved, **more}
        self._save(reserved)
        self._reserved = reserved

    def _save(self, counters: Mapping[str, int]) -> None:
        text = json.dumps({"now_us": self._now_us, "counters": dict(counters)})
        write_durably(self.path / "marks.json", text + "\n")

    # -- where the engine is -----------------------------------------------------------------------------------------
    def publish(self, *, epoch: int, url: str, endpoint: str, socket: str = "") -> EngineAddress:
        """Write `engine.json`."""
        address = EngineAddress(self.site, os.getpid(), epoch, url, endpoint, socket)
        self._published = write_held(self.path / "engine.json", json.dumps(asdict(address), indent=2) + "\n")
        return address

    def token(self) -> str:
        """Return the site's token; made at the first call, readable by its owner only.

        Raises:
            SiteError: the file cannot be read or written.
        """
        file = self.path / "token"
        try:
            if not file.exists():
                import secrets  # commands that only look for an engine need none of it

                write_durably(file, secrets.token_urlsafe(24) + "\n")
            return file.read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise SiteError(f"cannot use {file}: {error}") from error


def read_address(folder: Path) -> EngineAddress | None:
    """Return where the engine of a runtime folder is; None: none runs, or it still starts."""
    return _left_address(folder) if is_held(folder / "engine.json") else None


def _left_address(folder: Path) -> EngineAddress | None:
    """Return what `engine.json` says, also one that a killed engine left."""
    try:
        data = json.loads((folder / "engine.json").read_text(encoding="utf-8"))
        return EngineAddress(**{**data, "folder": str(folder)})
    except (OSError, ValueError, TypeError):
        return None


def is_running(folder: Path) -> bool:
    """Return whether an engine holds the lock of a runtime folder; it may still start, and not be found yet."""
    return is_held(folder / "lock")


def _taken(folder: Path) -> str:
    there = read_address(folder)
    who = f" (process {there.pid}, {there.url})" if there else ""
    return (
        f"an engine runs on the site '{folder.name}' already{who}\n"
        "  help: use that one (`formiga tasks`), or end it first: formiga down"
    )


def check_free(beside: Path, site: str) -> None:
    """Look whether a site is free; only `SiteFolder.take` makes sure of it.

    Raises:
        SiteError: an engine runs on it.
    """
    folder = beside.resolve() / FOLDER / site
    if is_running(folder):
        raise SiteError(_taken(folder))


def journal_of(folder: Path) -> str:
    """Return the path or URL of the journal that the last engine of a runtime folder kept; empty: there is none yet."""
    try:
        told = (folder / JOURNAL_AT).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        told = ""
    return told or (str(folder / JOURNAL) if (folder / JOURNAL).is_file() else "")


def find_folders(start: Path) -> list[Path]:
    """Return the runtime folders of this folder's sites, or else of the nearest folder above it that has any."""
    for folder in (start.resolve(), *start.resolve().parents):
        if found := sorted(p for p in (folder / FOLDER).glob("*") if p.is_dir()):
            return found
    return []


def find_engines(start: Path) -> list[EngineAddress]:
    """Return the engines that run on sites of this folder, or else of the nearest folder above it that has any."""
    for folder in (start.resolve(), *start.resolve().parents):
        sites = sorted((folder / FOLDER).glob("*"))
        if found := [address for site in sites if (address := read_address(site)) is not None]:
            return found
    return []
