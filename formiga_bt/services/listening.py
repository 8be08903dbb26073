"""The wires of an engine, as the site file says, and where it listens for its agents, if it may."""

from pathlib import Path

from formiga_bt.base.endpoints import open_to_others
from formiga_bt.base.errors import SiteError
from formiga_bt.base.wires import ZENOH, WireSetup, make_wire, wire_kind
from formiga_bt.lang.model import Site
from formiga_bt.transport.base import AgentTransport
from formiga_bt.transport.zenoh_session import DEFAULT_ENDPOINT, DEFAULT_TLS


def listen_of(site: Site) -> str:
    """Return the endpoint that the site file names, or the default."""
    default = DEFAULT_TLS if keys_of(site) is not None else DEFAULT_ENDPOINT
    return str(site.transports.get(ZENOH.name, {}).get("listen", default))


def keys_of(site: Site) -> Path | None:
    """Return the site's folder of keys, if its file names one; it counts from that file's folder."""
    named = site.transports.get(ZENOH.name, {}).get("keys", "")
    return (Path(site.file).parent / str(named)).resolve() if named else None


def check_listen(site: Site, endpoint: str, where: str = "", *, keys: bool = False) -> None:
    """Look whether the agents of a site may be listened to at an endpoint.

    Args:
        site: its mode and what its file accepts count.
        endpoint: of Zenoh.
        where: who named it, if not the site file.
        keys: the wire has keys.

    Raises:
        SiteError: others reach it, and it is not TLS; or only one of TLS and keys is there.
    """
    insecure = site.transports.get(ZENOH.name, {}).get("insecure") is True
    why, help_ = open_to_others(endpoint, site.mode, insecure=insecure, keys=keys)
    if why:
        place = where or f"{site.file}: transports: zenoh: listen"
        raise SiteError(f"{place}: {why}; site {site.name} is in mode {site.mode}", help=f"{help_}")


def make_wires(site: Site, listen: str = "", keys: Path | None = None) -> list[AgentTransport]:
    """Return the wires of a site, not open yet: those of its table, or the one that ships.

    Args:
        site: checked.
        listen: where agents connect by Zenoh, instead of what the site file says.
        keys: the site's folder of keys, instead of what the site file says.

    Raises:
        FormigaError: a wire cannot be made.
        SiteError: others would reach one, or there is none to listen with.
    """
    table = site.transports or {ZENOH.name: {}}
    if (listen or keys) and ZENOH.name not in table:
        said = f"--listen {listen}" if listen else f"--keys {keys}"
        raise SiteError(f"{said}: site {site.name} has no zenoh among its transports", help="add zenoh: {}")
    made: list[AgentTransport] = []
    for name, options in table.items():
        given = dict(options)
        if name == ZENOH.name:
            folder = keys.resolve() if keys is not None else keys_of(site)
            if folder is not None:
                given["keys"] = str(folder)
            named = bool(listen) or "listen" in options
            given["listen"] = listen or (listen_of(site) if named or folder is None else DEFAULT_TLS)
            check_listen(site, str(given["listen"]), where="--listen" if listen else "", keys=folder is not None)
        made.append(make_wire(wire_kind(name), WireSetup(site.name, given)))
    return made
