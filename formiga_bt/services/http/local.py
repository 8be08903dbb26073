"""The local door: a Unix socket that only the engine's own user, and root, can reach, and that no HTTP client can fill.

Its path lies in the site's runtime folder, or, if that would be too long for a socket, in a folder of this user's own below
XDG_RUNTIME_DIR or the folder for temporary files. `engine.json` tells where it is.
"""

import hashlib
import os
import socket
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from formiga_bt.base.durable import PRIVATE_FILE, PRIVATE_FOLDER

NAME: Final = "door"
LONGEST: Final = 100
"""Bytes of a path, at most; systems allow 103 to 107."""


def open_local(runtime: Path, environment: Mapping[str, str] = os.environ) -> tuple[socket.socket | None, str]:
    """Open the local door of a site that this process holds; return its socket and its path, or None and why there is none."""
    why = ""
    for path in _paths(runtime, environment):
        try:
            if path.parent != runtime:
                _check_own(path.parent)
            return _listen(path), str(path)
        except OSError as error:
            why = f"{path}: {error.strerror or error}"
    return None, why


def close_local(sock: socket.socket, path: str) -> None:
    """Close the door; its path is free again."""
    sock.close()
    with suppress(OSError):
        os.unlink(path)


def _paths(runtime: Path, environment: Mapping[str, str]) -> Iterator[Path]:
    if len(os.fsencode(runtime / NAME)) < LONGEST:
        yield runtime / NAME
    name = hashlib.sha256(os.fsencode(runtime)).hexdigest()[:16]
    bases = [Path(base) / "formiga" for base in [environment.get("XDG_RUNTIME_DIR", "")] if base]
    bases.append(Path(tempfile.gettempdir()) / f"formiga-{os.geteuid()}")
    for base in bases:
        if len(os.fsencode(base / name)) < LONGEST:
            yield base / name


def _check_own(folder: Path) -> None:
    """Make a folder that is this user's alone.

    Raises:
        OSError: it cannot be made, or is somebody else's.
    """
    folder.mkdir(mode=PRIVATE_FOLDER, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        raise PermissionError(1, "it is not a folder of this user")
    folder.chmod(PRIVATE_FOLDER)


def _listen(path: Path) -> socket.socket:
    with suppress(FileNotFoundError):
        path.unlink()  # of an engine that was killed; this one holds the site
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.bind(os.fspath(path))
        path.chmod(PRIVATE_FILE)
        sock.listen(128)
    except OSError:
        sock.close()
        raise
    return sock
