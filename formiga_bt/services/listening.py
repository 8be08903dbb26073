"""Where the engine of a site listens for its agents, as the site file says."""

from collections.abc import Mapping

from formiga_bt.lang.model import Site
from formiga_bt.transport.zenoh_session import DEFAULT_ENDPOINT


def listen_of(site: Site) -> str:
    """Return the endpoint that the site file names, or the default."""
    zenoh = site.transports.get("zenoh")
    return str(zenoh.get("listen", DEFAULT_ENDPOINT)) if isinstance(zenoh, Mapping) else DEFAULT_ENDPOINT
