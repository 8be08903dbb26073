"""Checks of the engine: the ports that it takes, and how it is."""

import os
import re
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from formiga_bt.base.authority import read_running
from formiga_bt.base.endpoints import is_tls
from formiga_bt.base.site_folder import is_running
from formiga_bt.cli.operator.checkup.finding import Finding, Level, Patient
from formiga_bt.client import Client, NoEngine
from formiga_bt.services.http.server import read_address
from formiga_bt.services.listening import keys_of, listen_of

LISTENS: Final = "0A"
"""State of a socket in /proc/net/tcp."""
TCP: Final = re.compile(r"(?:tcp|tls)/(.+:\d+)")
STATUS: Final[dict[str, Level]] = {"ok": "ok", "overloaded": "warn", "draining": "warn", "stopping": "warn"}


def ports(patient: Patient) -> Iterator[Finding]:
    """Check that ports are free, or held by this site's engine; of a site with keys the wire's is its router's."""
    ours, model = patient.engine, patient.model
    if ours is None:
        yield _port("the API", patient.http)
    else:
        yield Finding("ok", f"the engine of this site serves the API ({_who(ours.pid)})", ours.url)
        if ours.endpoint and not is_tls(ours.endpoint):
            yield Finding("ok", f"the engine of this site serves the agents' wire ({_who(ours.pid)})", ours.endpoint)
    if model is None or (found := TCP.match(listen_of(model))) is None:
        return
    keys = keys_of(model)
    if keys is None and ours is None:
        yield _port("the agents' wire", found[1])
    elif keys is not None and read_running(keys) is None:
        yield _port("the router", found[1])


def _port(what: str, address: str) -> Finding:
    host, port = read_address(address)
    if not port:
        return Finding("ok", f"{what} takes a free port", address)
    try:
        # As the engine itself opens it: a socket of the last start that is still closing is no obstacle.
        socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET).close()
    except OSError as error:
        holder = holder_of(port)
        text = f"{what} cannot be served: {error.strerror or error}" + (f"; held by {holder}" if holder else "")
        return Finding("fail", text, address, "end what holds it, or take another port (--http, --listen)")
    return Finding("ok", f"the port of {what} is free", address)


def holder_of(port: int) -> str:
    """Return which process listens at a TCP port of this machine, in words; empty: none, or it is not ours to see."""
    sockets = set()
    for table in ("tcp", "tcp6"):
        with suppress(OSError):
            for line in Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]:
                cells = line.split()
                if cells[3] == LISTENS and int(cells[1].rpartition(":")[2], 16) == port:
                    sockets.add(f"socket:[{cells[9]}]")
    for folder in Path("/proc").iterdir() if sockets else ():
        if folder.name.isdigit():
            with suppress(OSError):  # it has ended, or is somebody else's
                if any(os.readlink(one) in sockets for one in (folder / "fd").iterdir()):
                    return _who(int(folder.name))
    return "a process of another user" if sockets else ""


def _who(pid: int) -> str:
    name = ""
    with suppress(OSError):
        name = Path(f"/proc/{pid}/comm").read_text(encoding="utf-8", errors="replace").strip()
    return f"process {pid}" + (f", {name}" if name else "")


def health(patient: Patient) -> Iterator[Finding]:
    """Check how the engine is, as it says itself."""
    if patient.engine is None:
        if is_running(patient.runtime):
            what = (
                "something holds the site's lock and cannot be found: an engine that starts or ends, or one that hangs"
            )
            yield Finding(
                "warn", what, str(patient.runtime / "lock"), "look again in some seconds; then look for its process"
            )
        else:
            yield Finding("ok", "no engine runs on this site", str(patient.runtime))
        return
    where = patient.engine.url
    try:
        told = Client(patient.engine).health()
    except NoEngine as error:
        fix = f"look at its terminal; process {patient.engine.pid}"
        yield Finding("fail", f"it holds the site and does not answer: {error.text}", where, fix)
        return
    text = f"it is {told.status}, start {told.epoch}" + (f": {told.text}" if told.text else "")
    yield Finding(STATUS.get(told.status, "fail"), text, where)
    if told.journal != "ok":
        level: Level = "warn" if told.journal == "slow" else "fail"
        fix = "make room, or bring its disk or server back; nothing need be started anew (docs/journal.md: Full, Gone)"
        yield Finding(level, f"its journal is {told.journal}", where, fix)
    for one in told.house:
        yield Finding("warn", f"{one.text} ({one.code})", where)
    if told.lockdown.on:
        yield Finding("warn", "lockdown stands: nothing starts", where, "formiga lockdown release")
