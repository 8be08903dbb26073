"""The router of a secured site: TLS with certificates of both ends, and rules made of who has keys.

It is a process of its own: who gets in, and what each may write, does not depend on the engine. Zenoh takes no new rules
while it runs, so `Router.restart` opens the session anew: links are cut for about 3 s.

Why somebody is refused is known to Zenoh's own log only. The process that runs a router takes that in (`Refusals`) and says
each reason once a while, in words.
"""

import json
import os
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, Final

import msgspec

from formiga_bt.base.authority import RUNNING, Running, read_holders
from formiga_bt.base.certificates import ROUTER, Keys, read_keys
from formiga_bt.base.durable import write_held
from formiga_bt.base.visible import visible
from formiga_bt.transport.zenoh_rules import Member, access_control
from formiga_bt.transport.zenoh_session import close_session, on_network_thread, open_session

LOG: Final = "error,zenoh_link_tls=warn,zenoh::net::routing::interceptor=trace"
"""What Zenoh says of links that it does not take, and of messages that its rules do not let through."""
AGAIN_S: Final = 60.0
"""The same refusal is said again after so long."""
MOST_KNOWN: Final = 1_000
MOST_SAID: Final = 20
"""Refusals of one that are said in `AGAIN_S`."""
LONGEST: Final = 300


class Router:
    """A router with its rules.

    Args:
        site: the site's name.
        keys: the site's folder of keys.
        listen: a TLS endpoint.
        simulation: whether the site is in mode simulation.
        tell: takes a line for people; called in threads of Zenoh's.
    """

    def __init__(self, site: str, keys: Path, listen: str, *, simulation: bool, tell: Callable[[str], None]) -> None:
        self._site, self._keys, self._listen = site, keys, listen
        self._simulation, self._tell = simulation, tell
        self._session: Any = None
        self._heard: Any = None
        self._held: IO[str] | None = None
        self.names: dict[str, str] = {}
        """Zenoh's number of a session -> whose certificate it showed."""
        self.members: tuple[Member, ...] = ()

    def open(self) -> None:
        """Read who has keys, and let them in; takes about half a second.

        Raises:
            KeysError: the keys cannot be used.
            TransportError: the port is taken, or the endpoint is bad.
            SiteError: the folder of keys cannot be written.
        """
        self._open(*self._read())

    def _read(self) -> tuple[Keys, tuple[Member, ...]]:
        now_s = time.time()
        own = read_keys(self._keys / "router", now_s, ROUTER)
        counting = read_holders(self._keys).counting(now_s)
        return own, tuple(Member(one.name, one.common_name, one.is_program) for one in counting)

    def _open(self, own: Keys, members: tuple[Member, ...]) -> None:
        self.members = members
        rules = access_control(self._site, members, simulation=self._simulation)
        self._session = open_session("router", "", listen=[self._listen], keys=own, rules=rules)
        self._heard = self._session.info.declare_link_events_listener(on_network_thread(self._on_link), history=True)
        running = Running(os.getpid(), self._listen, tuple(one.common_name for one in self.members))
        self._held = write_held(self._keys / RUNNING, json.dumps(msgspec.to_builtins(running)) + "\n")

    def close(self) -> None:
        """Cut all links; takes at most 2 s."""
        session, self._session, self._heard = self._session, None, None
        if session is not None:
            close_session(session)
        if self._held is not None:
            self._held.close()
            self._held = None

    def restart(self) -> None:
        """Take new rules, and a new certificate of its own.

        Raises:
            KeysError: the keys cannot be used; the router goes on with those that it had.
            TransportError: the port was taken meanwhile; the router is closed.
            SiteError: the folder of keys cannot be written.
        """
        found = self._read()
        self.close()
        self._open(*found)

    def _on_link(self, event: Any) -> None:
        link = event.link
        number, who = str(link.zid), str(link.auth_identifier or "somebody without a name")
        is_there = str(event.kind).endswith("PUT")
        if is_there and len(self.names) > MOST_KNOWN:
            self.names.clear()
        self.names[number] = who
        where = str(link.dst).partition("/")[2]
        self._tell(f"{who} is here, from {where}" if is_there else f"{who} has gone ({where})")


class Refusals:
    """Reads Zenoh's log, and says in words who was refused what.

    Args:
        names: number of a session -> whose it is.
        tell: takes a line for people.
        clock: seconds of a clock that never goes back.
    """

    def __init__(
        self, names: Callable[[str], str], tell: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._names, self._tell, self._clock = names, tell, clock
        self._last: dict[bytes, bytes] = {}
        self._said: dict[str, set[str]] = {}
        """Of whom what was said since the last minute began."""
        self._until = 0.0

    def read(self, log: IO[bytes]) -> None:
        """Read until the log ends."""
        for line in log:
            try:
                self.take(line)
            except Exception as error:  # noqa: BLE001 - who stops reading lets the router's threads wait for room in the pipe
                self._say("router", f"a line of Zenoh's log cannot be read: {error}")

    def take(self, line: bytes) -> None:
        """Take a line of the log."""
        if b"unauthorized to" in line:
            self._last[_thread(line)] = line
        elif b"Msg intercepted!" in line:
            said = self._last.pop(_thread(line), None)
            if said is not None:
                self._refused(said)
        elif b"zenoh_link_tls" in line and b"WARN" in line:
            what = _PLAIN.sub(b"", line).split(b": ", 1)[-1].decode(errors="replace")
            self._say("", f"refused a connection: {_in_words(what)}")
        elif b"ERROR" in line:
            text = _PLAIN.sub(b"", line).decode(errors="replace").partition(" ERROR ")[2].strip()
            self._say("router", f"zenoh: {text}")

    def _refused(self, line: bytes) -> None:
        found = _DENIED.search(_PLAIN.sub(b"", line).decode(errors="replace"))
        if found is None:
            return
        number, what, flow, key = found.groups()
        who = self._names(number) or number
        if flow == "ingress":
            self._say(who, f"refused {who}: {what.lower()} {key}")

    def _say(self, who: str, text: str) -> None:
        """Say something once in `AGAIN_S`, and of each only so much: who makes up ever new keys fills no disk."""
        now = self._clock()
        if now >= self._until:
            self._said, self._until = {}, now + AGAIN_S
        said = self._said.setdefault(who, set()) if len(self._said) < MOST_KNOWN else self._said.get(who)
        if said is None or text in said or len(said) > MOST_SAID:
            return
        said.add(text)
        self._tell(
            visible(
                text[:LONGEST] if len(said) <= MOST_SAID else f"refused {who or 'connections'}: and more, this minute"
            )
        )


_PLAIN: Final = re.compile(rb"\x1b\[[0-9;]*m")
_THREAD: Final = re.compile(rb"ThreadId\((\d+)\)")
_DENIED: Final = re.compile(r"([0-9a-f]{8,32})(?: on \S+)? is unauthorized to (.+?) \((ingress|egress)\) on (\S+)")
_REASONS: Final = (
    ("certificate expired", "its certificate has expired"),
    ("not valid yet", "its certificate does not count yet: which of the two clocks is wrong?"),
    ("BadSignature", "its certificate is not of this site's authority"),
    ("UnknownIssuer", "its certificate is not of this site's authority"),
    ("peer sent no certificates", "it showed no certificate"),
    ("InvalidContentType", "it does not speak TLS"),
)


def _thread(line: bytes) -> bytes:
    found = _THREAD.search(line)
    return found[1] if found else b""


def _in_words(what: str) -> str:
    return next((said for word, said in _REASONS if word in what), what.strip().partition(" Hint:")[0][:300])


def hear_refusals(refusals: Refusals) -> IO[str]:
    """Let Zenoh's log, which goes to this process's output, be read by `refusals`; return the output as it was before.

    Called once, before the first session of the process.
    """
    from formiga_bt.transport.zenoh_session import begin_log

    shown = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace")
    out, into = os.pipe()
    os.dup2(into, 1)
    os.close(into)
    begin_log(LOG)
    threading.Thread(target=refusals.read, args=(os.fdopen(out, "rb"),), name="formiga-refusals", daemon=True).start()
    return shown
