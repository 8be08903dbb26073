"""Files of a site's runtime folder that cannot be used are set aside before anything reads them, so that a start succeeds.

`FILES` says what each file must be. Whatever is something else (a folder, a pipe, a link to nowhere, text that is cut short) is
moved into a folder `aside-N` beside it, never deleted, and reported. What is lost thereby is lost on the safe side: an
approval that cannot be read is none, an id or an epoch that is not known is passed over. The journal's own files are the
journal's matter.
"""

import json
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.bounds import MOST_EPOCH
from formiga_bt.base.durable import move_aside
from formiga_bt.base.errors import SiteError
from formiga_bt.base.person_secrets import SECRETS, read_secrets

MOST_BYTES: Final = 256_000_000
"""A larger file is none of ours."""


Check = Callable[[Path], bool]


def _is_empty(file: Path) -> bool:
    return not file.read_bytes()


def _is_epoch(file: Path) -> bool:
    text = file.read_bytes().strip()
    return text.isdigit() and len(text) <= 10 and int(text) < MOST_EPOCH


def _is_engine_id(file: Path) -> bool:
    text = file.read_text(encoding="ascii").strip()
    return 8 <= len(text) <= 64 and text.isalnum()


def _is_marks(file: Path) -> bool:
    said = _json(file)
    counters = said.get("counters", {})
    return isinstance(counters, dict) and all(
        isinstance(one, int) and 0 <= one < 2**62 for one in (said.get("now_us", 0), *counters.values())
    )


def _is_token(file: Path) -> bool:
    text = file.read_text(encoding="ascii").strip()
    return len(text) >= 16 and text.isprintable()


def _is_text(file: Path) -> bool:
    return file.read_text(encoding="utf-8").strip().isprintable()


def _is_file(file: Path) -> bool:
    return file.is_file()


def _is_read_by(read: Callable[[Path], object]) -> Check:
    """Return the check of a file that its reader must be able to use."""

    def check(file: Path) -> bool:
        try:
            read(file.parent)
        except SiteError:
            return False
        return True

    return check


def _is_register(file: Path) -> bool:
    from formiga_bt.base.accounts import read_register  # slow to import, and an order of a hurry reads no accounts

    return _is_read_by(read_register)(file)


def _json(file: Path) -> dict[str, Any]:
    said = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(said, dict):
        raise ValueError("it is no JSON object")
    return said


def _is_object(file: Path) -> bool:
    return isinstance(_json(file), dict)


def _is_lines(file: Path) -> bool:
    """Return whether each line is a JSON object; the last one may have been cut short by a power cut."""
    whole = file.read_bytes().split(b"\n")[:-1]  # what stands behind the last end of a line was never acknowledged
    return all(isinstance(json.loads(line), dict) for line in whole if line.strip())


FILES: Final[Mapping[str, tuple[Check, str]]] = {
    "epoch": (_is_epoch, "a higher epoch than any that is known is taken"),
    "engine_id": (
        _is_engine_id,
        "a new one is made: agents follow it when they have heard nothing of the old one for 30 s",
    ),
    "marks.json": (_is_marks, "ids go on from the journal's, or a million of each kind are passed over"),
    "exact": (_is_empty, "ids are passed over"),
    "no-journal": (_is_empty, "nothing is lost"),
    "engine.json": (_is_object, "nothing is lost"),
    "token": (_is_token, "a new token is made; callers from other machines need it"),
    "accounts.json": (_is_register, "nobody has an account any more: formiga access add NAME --role ROLE"),
    "audit.jsonl": (_is_file, "a new audit begins"),
    SECRETS: (
        _is_read_by(read_secrets),
        "nobody has a secret any more: each sets a new one, formiga access secret NAME",
    ),
    "approvals.jsonl": (_is_lines, "what it approved is not approved any more: approve anew"),
    "fleet.jsonl": (_is_lines, "who was added to the fleet is known from the journal only: formiga agents add ID"),
    "fleets.jsonl": (_is_lines, "fleets that were saved are gone: formiga agents save NAME"),
    "discovered.jsonl": (
        _is_lines,
        "actions that agents announced are unknown until they do so again: formiga catalogue",
    ),
    "drafted.jsonl": (_is_lines, "which tasks a model wrote is known from their files and from the journal only"),
    "journal.at": (_is_text, "the journal is looked for in the runtime folder; name it: --journal FILE|URL"),
    "flights.jsonl": (_is_lines, "a new flight log begins"),
    "flying.json": (_is_object, "flights under way at the end of the last start have no record"),
    "alive.json": (_is_object, "the outage counts from the journal's last step"),
    "resuming.json": (_is_object, "tasks that ended the engine while they were resumed are tried again"),
}
"""Name -> whether a file can be used, and what follows if it cannot."""
FOLDERS: Final[Mapping[str, str]] = {"bundles": "tasks that were loaded are not served: load them again"}


def set_unusable_aside(folder: Path) -> dict[str, str]:
    """Set aside what cannot be used; return why, by name, in sentences for people.

    Args:
        folder: a runtime folder that this process holds the lock of.

    Raises:
        SiteError: something cannot be set aside: the folder cannot be written.
    """
    found: dict[str, str] = {}
    for name, (check, follows) in FILES.items():
        why = _wrong(folder / name, check)
        if why:
            found[name] = _aside(folder / name, why, follows)
        unfinished = folder / f".{name}.new"  # of a write that a kill cut off; anything else would be in the way
        if _kind(unfinished) not in ("", "file"):
            found[unfinished.name] = _aside(unfinished, f"is a {_kind(unfinished)}", "nothing is lost")
    for name, follows in FOLDERS.items():
        if (kind := _kind(folder / name)) not in ("", "folder"):
            found[name] = _aside(folder / name, f"is a {kind}", follows)
    return found


def unusable(folder: Path) -> dict[str, str]:
    """Return what of a runtime folder cannot be used, and what follows, by name; nothing is changed."""
    files = ((name, _wrong(folder / name, check), follows) for name, (check, follows) in FILES.items())
    found = {name: f"{name} {why}: {follows}" for name, why, follows in files if why}
    for name, follows in FOLDERS.items():
        if (kind := _kind(folder / name)) not in ("", "folder"):
            found[name] = f"{name} is a {kind}: {follows}"
    return found


def _aside(file: Path, why: str, follows: str) -> str:
    where = move_aside([file])
    assert where is not None, file
    return f"{file.name} {why}; it was set aside in {where}: {follows}"


def _wrong(file: Path, check: Check) -> str:
    """Return what is wrong with a file, or an empty text; one that is not there is fine."""
    kind = _kind(file)
    if not kind:
        return ""
    if kind != "file":
        return f"is a {kind}"
    try:
        if file.stat().st_size > MOST_BYTES:
            return "is too large"
        return "" if check(file) else "cannot be understood"
    except SiteError as error:
        return f"cannot be read ({error})"
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"
    except (ValueError, RecursionError):
        return "cannot be understood"


def _kind(path: Path) -> str:
    """Return what is at a path, without opening it; empty: nothing."""
    try:
        mode = path.lstat().st_mode
        if stat.S_ISLNK(mode):
            mode = path.stat().st_mode
    except FileNotFoundError:
        return "link to nowhere" if path.is_symlink() else ""
    except OSError:
        return "link in a circle"
    if stat.S_ISREG(mode):
        return "file"
    return "folder" if stat.S_ISDIR(mode) else "device"
