"""What an address says about who can reach it: this machine only, or others; and whether they reach it by TLS.

Called by the checker of site files, by `formiga up`, and by the HTTP door.
"""

import ipaddress
from typing import Final

LOCAL: Final = frozenset({"unixsock-stream", "unixpipe"})
"""Kinds of Zenoh endpoints that no other machine reaches."""
TLS: Final = frozenset({"tls", "quic"})
"""Kinds that are encrypted; none of them opens without a certificate of the engine's."""


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


def open_to_others(endpoint: str, mode: str, *, insecure: bool = False) -> tuple[str, str]:
    """Return why a site may not listen to agents at an endpoint, and what helps; two empty texts if it may.

    Whoever reaches the wire can be any agent and can command every machine, so beyond this machine it must be TLS.

    Args:
        endpoint: of Zenoh.
        mode: of the site.
        insecure: the site file accepts it, which only a simulation may.
    """
    if is_local(endpoint) or is_tls(endpoint) or (insecure and mode != "real"):
        return "", ""
    what = f"'{endpoint}' lets whoever reaches it command every machine: it is not this machine's own, and not TLS"
    ways = "listen at tcp/127.0.0.1:PORT, where a VPN or an SSH tunnel ends, or by TLS (docs/wire.md)"
    return what, ways if mode == "real" else f"{ways}; or say insecure: true beside listen, in a simulation"
