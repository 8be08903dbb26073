"""What an address says about who can reach it: this machine only, or others; and whether they reach it by TLS.

Called by the checker of site files, by `formiga up`, and by the HTTP door.
"""

import ipaddress
from typing import Final

from formiga_bt.base.errors import TransportError

LOCAL: Final = frozenset({"unixsock-stream", "unixpipe"})
"""Kinds of Zenoh endpoints that no other machine reaches."""
TLS: Final = frozenset({"tls"})
"""Kinds that are encrypted, with certificates of both ends."""
EVERYWHERE: Final = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}


def is_loopback(host: str) -> bool:
    """Return whether a host name or address is this machine's own."""
    bare = host.strip("[]")
    if bare == "localhost":
        return True
    try:
        return ipaddress.ip_address(bare).is_loopback
    except ValueError:
        return False


def is_local(endpoint: str) -> bool:
    """Return whether only this machine reaches a Zenoh endpoint, such as `tcp/127.0.0.1:7447`; False if that is not known."""
    kind, _, rest = endpoint.partition("/")
    host = rest.partition("#")[0].partition("?")[0].rpartition(":")[0]
    return kind in LOCAL or is_loopback(host)


def is_tls(endpoint: str) -> bool:
    """Return whether what passes a Zenoh endpoint is encrypted."""
    return endpoint.partition("/")[0] in TLS


def reached_at(endpoint: str) -> str:
    """Return where this machine reaches a listener: `tls/0.0.0.0:7447` at `tls/127.0.0.1:7447`."""
    for host, own in EVERYWHERE.items():
        endpoint = endpoint.replace(f"/{host}:", f"/{own}:")
    return endpoint


def open_to_others(endpoint: str, mode: str, *, insecure: bool = False, keys: bool = False) -> tuple[str, str]:
    """Return why a site may not listen to agents at an endpoint, and what helps; two empty texts if it may.

    Whoever reaches the wire without keys can be any agent and can command every machine, so beyond this machine it must be TLS.

    Args:
        endpoint: of Zenoh.
        mode: of the site.
        insecure: the site file accepts it, which only a simulation may.
        keys: the site has keys.
    """
    if keys:
        if not is_tls(endpoint) or "#" in endpoint or "?" in endpoint:
            return f"'{endpoint}' is not plain TLS, but the site has keys", "write tls/HOST:PORT and nothing more"
        if endpoint.endswith(":0"):
            return f"'{endpoint}' names no port: router and engine are two processes", "write tls/HOST:PORT"
        return "", ""
    if is_tls(endpoint):
        return f"'{endpoint}' is TLS, and the site has no keys", "make them: formiga access ca; then say keys: FOLDER"
    if is_local(endpoint) or (insecure and mode != "real"):
        return "", ""
    what = f"'{endpoint}' lets whoever reaches it command every machine: it is not this machine's own, and not TLS"
    ways = "make keys and listen by TLS: formiga access ca; or listen at tcp/127.0.0.1:PORT, where a VPN or an SSH tunnel ends"
    return what, ways if mode == "real" else f"{ways}; or say insecure: true beside listen, in a simulation"


def check_connect(endpoint: str, *, keys: bool, insecure: bool = False) -> None:
    """Look whether an agent may connect to an endpoint.

    Args:
        endpoint: of Zenoh.
        keys: the agent has keys.
        insecure: whoever starts it accepts that others can be its engine.

    Raises:
        TransportError: it has keys and it is not TLS, or the other way round; or others reach it, and it is not TLS.
    """
    if keys != is_tls(endpoint):
        what = f"'{endpoint}' is not TLS, but there are keys" if keys else f"'{endpoint}' is TLS, which needs keys"
        raise TransportError(
            what, help="connect at tls/HOST:PORT" if keys else "name the folder that you were given: --keys"
        )
    if not keys and not insecure and not is_local(endpoint):
        what = f"'{endpoint}' is not this machine's own, and not TLS: whoever reaches it can be the engine"
        raise TransportError(what, help="connect by TLS with keys: --keys FOLDER; or say --insecure, in a simulation")
