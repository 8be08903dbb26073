"""What both ends of the Zenoh wire share: how a session is opened and closed, and the keys.

The site's name is the session's namespace, so two sites never hear each other. Multicast and gossip are off: nothing is
found, everything is named. Called by `zenoh.py` (the engine, a router), `zenoh_agent.py` (an agent, a peer) and
`zenoh_router.py` (the router of a secured site). With keys a session speaks TLS, and both ends show a certificate.
"""

import contextlib
import json
import re
import socket
import threading
from collections.abc import Mapping, Sequence
from typing import Any, Final

import zenoh

from formiga_bt.base.certificates import Keys
from formiga_bt.base.endpoints import is_tls
from formiga_bt.base.errors import TransportError

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
DEFAULT_TLS: Final = "tls/127.0.0.1:7447"
LEASE_MS: Final = 3000
"""A link that is silent this long is gone (a frozen process, a cut cable). A killed process is noticed at once."""
CLOSE_S: Final = 2.0
"""`Session.close` has been seen to hang on a stuck link; it gets this long."""

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


def check_name(what: str, name: str) -> str:
    """Return a name that may be one part of a key.

    Raises:
        TransportError: it is none.
    """
    if not _NAME.fullmatch(name):
        raise TransportError(f"{what} {name!r} cannot be part of a Zenoh key: use letters, digits, '_' and '-'")
    return name


def free_endpoint(endpoint: str) -> str:
    """Return the endpoint with port 0 replaced by a port that is free now; other endpoints unchanged."""
    found = re.fullmatch(r"(tcp|tls)/(.+):0", endpoint)
    if not found:
        return endpoint
    with socket.socket() as probe:
        probe.bind((found[2], 0))
        return f"{found[1]}/{found[2]}:{probe.getsockname()[1]}"


def open_session(
    mode: str,
    site: str,
    *,
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    lease_ms: int = LEASE_MS,
    keys: Keys | None = None,
    rules: Mapping[str, Any] | None = None,
) -> Any:
    """Open a session. Returns after about half a second; whom it connects to may be absent and come and go.

    Args:
        mode: router, peer or client.
        site: the namespace of all keys; empty, of a router of its own: none.
        listen: endpoints where others connect; with keys TLS only.
        connect: endpoints of others; with keys TLS only.
        lease_ms: a link that is silent so long is gone.
        keys: what it proves who it is with.
        rules: the access control of a router.

    Raises:
        TransportError: the name of the site or an endpoint is bad, or the port is taken.
    """
    config: dict[str, Any] = {
        "mode": mode,
        "listen": {"endpoints": list(listen)},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"link": {"tx": {"lease": lease_ms}}},
    }
    if site or rules is None:
        config["namespace"] = check_name("site", site)
    if rules is not None:
        config["access_control"] = dict(rules)
    if keys is not None:
        if bad := [one for one in (*listen, *connect) if not is_tls(one) or "#" in one]:
            raise TransportError(f"{bad[0]} is not TLS, but there are keys\n  help: write tls/HOST:PORT")
        config["transport"]["link"]["tls"] = keys.tls(listens=bool(listen))
    if connect:
        config["connect"] = {
            "endpoints": list(connect),
            # A client that retries would make open() wait for ever, whatever exit_on_failure says.
            "timeout_ms": 0 if mode == "client" else -1,
            "exit_on_failure": mode == "client",
            "retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2},
        }
    try:
        return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as error:
        where = ", ".join([*listen, *connect])
        cause = re.split(r"\s+at \S+\.rs:\d+", str(error))[0].rstrip(" .")  # the rest is where in Zenoh's own code
        raise TransportError(
            f"cannot open Zenoh at {where}: {cause}\n"
            + (
                "  help: is another engine running there? Stop it, or choose another place: `--listen ENDPOINT`,"
                " or 'listen' in site.yaml"
                if listen
                else "  help: an endpoint is for example tcp/127.0.0.1:7447"
            )
        ) from error


def begin_log(what: str) -> None:
    """Let Zenoh print what it has to say, by its filter; once in a process."""
    zenoh.init_log_from_env_or(what)


def close_session(session: Any) -> None:
    """Close a session within `CLOSE_S`; a hanging one is left to a daemon thread."""
    closer = threading.Thread(target=_close, args=(session,), daemon=True, name="zenoh-close")
    closer.start()
    closer.join(CLOSE_S)


def _close(session: Any) -> None:
    with contextlib.suppress(zenoh.ZError):  # closed by the other end: nothing is left to do
        session.close()


def on_network_thread(call: Any, drop: Any = None) -> Any:
    """Return a handler that runs on Zenoh's own thread: `call` may only enqueue, or everything waits for it."""
    return zenoh.handlers.Callback(call, drop, indirect=False)
