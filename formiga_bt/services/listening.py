"""The wires of an engine, as the site file says, and where it listens for its agents, if it may."""

from formiga_bt.base.endpoints import open_to_others
from formiga_bt.base.errors import SiteError
from formiga_bt.base.wires import ZENOH, WireSetup, make_wire, wire_kind
from formiga_bt.lang.model import Site
from formiga_bt.transport.base import AgentTransport
from formiga_bt.transport.zenoh_session import DEFAULT_ENDPOINT


def listen_of(site: Site) -> str:
    """Return the endpoint that the site file names, or the default."""
    return str(site.transports.get(ZENOH.name, {}).get("listen", DEFAULT_ENDPOINT))


def check_listen(site: Site, endpoint: str, where: str = "") -> None:
    """Look whether the agents of a site may be listened to at an endpoint.

    Args:
        site: its mode and what its file accepts count.
        endpoint: of Zenoh.
        where: who named it, if not the site file.

    Raises:
        SiteError: others reach it, and it is not TLS.
    """
    insecure = site.transports.get(ZENOH.name, {}).get("insecure") is True
    why, help_ = open_to_others(endpoint, site.mode, insecure=insecure)
    if why:
        place = where or f"{site.file}: transports: zenoh: listen"
        raise SiteError(f"{place}: {why}; site {site.name} is in mode {site.mode}", help=f"{help_}")


def make_wires(site: Site, listen: str = "") -> list[AgentTransport]:
    """Return the wires of a site, not open yet: those of its table, or the one that ships.

    Args:
        site: checked.
        listen: where agents connect by Zenoh, instead of what the site file says.

    Raises:
        FormigaError: a wire cannot be made.
        SiteError: others would reach one, or there is none to listen with.
    """
    table = site.transports or {ZENOH.name: {}}
    if listen and ZENOH.name not in table:
        raise SiteError(f"--listen {listen}: site {site.name} has no zenoh among its transports", help="add zenoh: {}")
    made: list[AgentTransport] = []
    for name, options in table.items():
        given = dict(options)
        if name == ZENOH.name:
            given["listen"] = listen or listen_of(site)
            check_listen(site, str(given["listen"]), where="--listen" if listen else "")
        made.append(make_wire(wire_kind(name), WireSetup(site.name, given)))
    return made
