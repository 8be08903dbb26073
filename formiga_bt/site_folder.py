"""The runtime folder of a site, `.formiga/<site>/` beside the site file: what must outlive one start of the engine.

| file | what |
|---|---|
| `lock` | `flock`ed by the engine of the site; it goes when its process goes, however it ends |
| `epoch` | a number, one higher at each start; agents refuse orders of a lower one |
| `marks.json` | engine time and counters: a new start never uses an id or an instant again |
| `engine.json` | where the engine is: API, agents' endpoint, process |
| `token` | the word that callers from other machines must know |
| `approvals.jsonl` | who approved what, and took it back: a line each, never changed |
| `bundles/` | tasks that were loaded into the engine while it ran (`services.bundles`) |
| `journal.db` | the journal: every step of the engine (`formiga_bt.journal`) |
| `journal.at` | where the journal is instead, if it was told to be elsewhere: a path or a URL without password |
| `flights.jsonl` | the flight log: a line for each flight that has ended |
| `flying.json` | flights that have not ended |

Called by `formiga up` (through `SiteFolder`), and by every command that looks for a running engine (`find_engines`).
"""

import fcntl
import json
import os
import re
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, Final

from formiga_bt.errors import SiteError

FOLDER: Final = ".formiga"
RESERVE: Final = 100
"""So many ids of each kind are set aside at once; after a crash the rest of them is passed over."""
APPROVALS: Final = "approvals.jsonl"
JOURNAL: Final = "journal.db"
JOURNAL_AT: Final = "journal.at"
FLIGHTS: Final = "flights.jsonl"
FLYING: Final = "flying.json"
COUNTERS: Final = ("task", "question", "clearance")
"""The counters that goal ids are made of."""
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
    folder: str = ""

    @property
    def token_file(self) -> Path:
        """Return the file with the token."""
        return Path(self.folder) / "token"


class SiteFolder:
    """The runtime folder of one site, held by one engine. A context manager: entering takes the lock.

    Args:
        beside: the folder of the site file.
        site: the site's name.
    """

    def __init__(self, beside: Path, site: str) -> None:
        self.site = site
        self.path = beside.resolve() / FOLDER / site
        self._lock: IO[str] | None = None
        self._reserved: dict[str, int] = {}
        self._last: dict[str, int] = {}
        self._now_us = 0

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
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", self.site):
            raise SiteError(f"the site's name {self.site!r} cannot name a folder: use letters, digits, '_' and '-'")
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = (self.path / "lock").open("a+", encoding="utf-8")
        except OSError as error:
            raise SiteError(f"cannot write the site's runtime folder {self.path}: {error.strerror or error}") from error
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
        (self.path / "engine.json").unlink(missing_ok=True)  # where an engine that was killed has been

    def release(self) -> None:
        """Give the site back; may be called twice."""
        if self._lock is None:
            return
        (self.path / "engine.json").unlink(missing_ok=True)
        self._lock.close()
        self._lock = None

    # -- epoch and marks -------------------------------------------------------------------------------------------
    def next_epoch(self) -> int:
        """Return the epoch of this start: one higher than the last, and safely on disk.

        Raises:
            SiteError: the file holds no number, or cannot be written.
        """
        file = self.path / "epoch"
        try:
            text = file.read_text(encoding="ascii").strip() if file.exists() else "0"
            if not (text.isascii() and text.isdigit()):
                raise SiteError(
                    f"{file} holds {text[:40]!r}, not a number\n"
                    "  help: write a number there that is at least the highest epoch your agents have seen"
                )
            epoch = int(text) + 1
            _write_durably(file, f"{epoch}\n")
        except (OSError, UnicodeDecodeError) as error:
            raise SiteError(f"cannot use {file}: {error}") from error
        return epoch

    def raise_epoch(self, epoch: int) -> None:
        """Note that this start has a higher epoch: the journal knew of starts that this folder did not.

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

    def marks(self) -> tuple[int, dict[str, int]]:
        """Return the engine time reached by the last start, and the counters to go on from.

        Raises:
            SiteError: the file cannot be read or written.
        """
        file = self.path / "marks.json"
        try:
            data: Any = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
            self._now_us = int(data.get("now_us", 0))
            self._last = {name: int(data.get("counters", {}).get(name, 0)) for name in COUNTERS}
        except (OSError, ValueError, TypeError, AttributeError) as error:
            raise SiteError(
                f"cannot read {file}: {error}\n  help: if it is damaged beyond repair, delete it"
            ) from error
        self._reserved = dict(self._last)
        return self._now_us, dict(self._last)

    def counted(self, name: str, value: int, now_us: int) -> None:
        """Note that a counter has this value; must return before an id made of it leaves the process.

        Raises:
            SiteError: the file cannot be written.
        """
        if name not in COUNTERS:
            return
        self._last[name] = value
        self._now_us = max(self._now_us, now_us)
        if value > self._reserved.get(name, 0):
            self._reserved[name] = value + RESERVE
            self._save(self._reserved)

    def settle(self, now_us: int) -> None:
        """At a clean end: what was set aside and not used is free again."""
        self._now_us = max(self._now_us, now_us)
        self._save(self._last)

    def _save(self, counters: Mapping[str, int]) -> None:
        text = json.dumps({"now_us": self._now_us, "counters": dict(counters)})
        try:
            _write_durably(self.path / "marks.json", text + "\n")
        except OSError as error:
            raise SiteError(f"cannot write {self.path / 'marks.json'}: {error.strerror or error}") from error

    # -- where the engine is -----------------------------------------------------------------------------------------
    def publish(self, *, epoch: int, url: str, endpoint: str) -> EngineAddress:
        """Write `engine.json`."""
        address = EngineAddress(self.site, os.getpid(), epoch, url, endpoint)
        _write_durably(self.path / "engine.json", json.dumps(asdict(address), indent=2) + "\n")
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

                with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as made:
                    made.write(secrets.token_urlsafe(24) + "\n")
            token = file.read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise SiteError(f"cannot use {file}: {error}") from error
        if len(token) < 16:
            raise SiteError(f"{file} holds no token of at least 16 characters\n  help: delete it; a new one is made")
        return token


def append_line(file: Path, record: Mapping[str, Any]) -> None:
    """Add a record to a file of JSON lines, safely on disk when this returns; what a power cut left half written stays alone.

    Raises:
        SiteError: the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        is_new = not file.exists()
        with file.open("ab+") as lines:
            torn = lines.tell() > 0 and _last_byte(lines) != b"\n"
            text = json.dumps(dict(record), ensure_ascii=False)
            lines.write((b"\n" if torn else b"") + text.encode() + b"\n")
            lines.flush()
            os.fsync(lines.fileno())
        if is_new:
            _sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error


def _last_byte(file: IO[bytes]) -> bytes:
    file.seek(-1, os.SEEK_END)
    return file.read(1)


def read_lines(file: Path) -> list[dict[str, Any]]:
    """Return the records of a file of JSON lines, those that a power cut cut short left out; none, if there is no file.

    Raises:
        SiteError: the file is there but cannot be read.
    """
    try:
        texts = file.read_bytes().splitlines() if file.exists() else []
    except OSError as error:
        raise SiteError(f"cannot read {file}: {error.strerror or error}") from error
    found = []
    for text in texts:
        try:
            record = json.loads(text)
        except ValueError:
            continue
        if isinstance(record, dict):
            found.append(record)
    return found


def write_durably(file: Path, text: str) -> None:
    """Replace a file so that after a power cut it is either the old or the new one.

    Raises:
        SiteError: it cannot be written.
    """
    try:
        _write_durably(file, text)
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error


def _write_durably(file: Path, text: str) -> None:
    """Replace a file so that after a power cut it is either the old or the new one."""
    beside = file.with_name(f".{file.name}.new")
    with beside.open("w", encoding="utf-8") as new:
        new.write(text)
        new.flush()
        os.fsync(new.fileno())
    beside.replace(file)
    _sync_folder(file.parent)


def _sync_folder(path: Path) -> None:
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def read_address(folder: Path) -> EngineAddress | None:
    """Return what `engine.json` of a runtime folder says, or None."""
    try:
        data = json.loads((folder / "engine.json").read_text(encoding="utf-8"))
        return EngineAddress(**{**data, "folder": str(folder)})
    except (OSError, ValueError, TypeError):
        return None


def is_running(folder: Path) -> bool:
    """Return whether an engine holds the lock of a runtime folder."""
    try:
        with (folder / "lock").open("r", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


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
        sites = sorted(p for p in (folder / FOLDER).glob("*") if is_running(p))
        if found := [address for site in sites if (address := read_address(site)) is not None]:
            return found
    return []
