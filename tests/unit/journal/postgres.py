"""A PostgreSQL server of a test's own: in a temporary folder, on a socket there, gone at the end."""

import glob
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def _program(name: str) -> str:
    found = [*sorted(glob.glob(f"/usr/lib/postgresql/*/bin/{name}"), reverse=True), shutil.which(name) or ""]
    if not found[0]:
        raise FileNotFoundError(f"no {name}: install PostgreSQL (Debian, Ubuntu: apt install postgresql)")
    return found[0]


@contextmanager
def server() -> Iterator[str]:
    """Run a server; give the URL of its database `postgres`. The server refuses to run as root, so it never does."""
    initdb, control = _program("initdb"), _program("pg_ctl")
    folder = Path(tempfile.mkdtemp(prefix="formiga-pg-"))
    who: dict[str, str] = {}
    if os.getuid() == 0:
        names = {one.pw_name for one in pwd.getpwall()}
        who = {"user": "postgres" if "postgres" in names else "nobody"}
        shutil.chown(folder, who["user"])
    data = folder / "data"

    def call(*command: str) -> None:
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, timeout=60, **who)  # type: ignore[call-overload]
        assert done.returncode == 0, done.stdout + done.stderr

    try:
        call(initdb, "-D", str(data), "-U", "formiga", "-A", "trust", "-E", "UTF8", "--locale=C", "--no-sync")
        options = f"-k {folder} -c listen_addresses='' -c fsync=off -c max_connections=20"
        call(control, "-D", str(data), "-w", "-l", str(folder / "log"), "-o", options, "start")
        try:
            yield f"postgresql://formiga@/postgres?host={folder}"
        finally:
            call(control, "-D", str(data), "-w", "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
