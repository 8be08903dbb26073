"""Where the engine of a site listens for its agents, as the site file says, and whether it may."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.base.endpoints import open_to_others
from formiga_bt.base.errors import SiteError
from formiga_bt.lang.model import Site
from formiga_bt.transport.zenoh_session import DEFAULT_ENDPOINT


def _zenoh(site: Site) -> Mapping[str, Any]:
    zenoh = site.transports.get("zenoh")
    return zenoh if isinstance(zenoh, Mapping) else {}


def listen_of(site: Site) -> str:
    """Return the endpoint that the site file names, or the default."""
    return str(_zenoh(site).get("listen", DEFAULT_ENDPOINT))


def check_listen(site: Site, endpoint: str, where: str = "") -> None:
    """Look whether the agents of a site may be listened to at an endpoint.

    Args:
        site: its mode and what its file accepts count.
        endpoint: of Zenoh.
        where: who named it, if not the site file.

    Raises:
        SiteError: others reach it, and it is not TLS.
    """
    why, help_ = open_to_others(endpoint, site.mode, insecure=_zenoh(site).get("insecure") == "true")
    if why:
        place = where or f"{site.file}: transports: zenoh: listen"
        raise SiteError(f"{place}: {why}; site {site.name} is in mode {site.mode}", help=f"{help_}")
