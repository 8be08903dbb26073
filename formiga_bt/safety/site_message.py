"""The site as it is told to agents, and whether an agent has that version."""

from collections.abc import Iterable, Sequence
from hashlib import sha256
from typing import Any, Final

import msgspec
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Region
from formiga_bt.lang.model import AgentType, Site
from formiga_bt.safety.rules import rules_of
from formiga_bt.transport.messages import PreflightCheck, SiteBase, SiteMessage, SitePoint, SiteStation

CHECK: Final = "site"
"""The preflight check that an agent which flies has the site as it is now."""


def site_message(site: Site, types: Iterable[AgentType] = ()) -> SiteMessage:
    """Return what agents are told of a site; equal sites have equal versions, whatever their files look like.

    Args:
        site: the site.
        types: the types of machines that may be there.
    """
    stations = {
        one.name: SiteStation(at=_point(one.at), heading_deg=one.heading_deg, charges=one.charges, kinds=one.kinds)
        for one in site.stations.values()
    }
    message = SiteMessage(
        site=site.name,
        version="",
        base=SiteBase(site.lat, site.lng, site.ground_msl_m),
        fence=_outline(site.fence),
        no_fly=tuple(_outline(one) for one in site.no_fly),
        no_go=tuple(_outline(one) for one in site.no_go),
        transit_m=tuple(site.layers_m),
        return_m=_height_of_return(site, types),
        stations=stations,
        ports={port.name: _point(port.at) for port in site.ports.values()},
    )
    return replace(message, version=sha256(msgspec.json.encode(message, order="sorted")).hexdigest()[:16])


def _height_of_return(site: Site, types: Iterable[AgentType]) -> float | None:
    """Return the highest layer in which machines of all these types may fly, the lowest one if there is none, metres.

    Each machine flies home there when it hears nothing, one with a low `max_height` too.
    """
    limit = min((rules_of(one, site).max_height_m for one in types if one.flies), default=float("inf"))
    low_enough = [layer for layer in site.layers_m if layer <= limit]
    return max(low_enough) if low_enough else min(site.layers_m, default=None)


def with_site(checks: Sequence[PreflightCheck], said: str, version: str) -> tuple[PreflightCheck, ...]:
    """Return an agent's preflight checks and, after them, whether it has the site as it is now.

    Args:
        checks: as the agent tells them; none = it tells of none, and nothing is added.
        said: the version of the site that it says it has.
        version: of the site.
    """
    if not checks:
        return ()
    text = "" if said == version else f"it has {said}" if said else "it has no site message yet"
    return (*(one for one in checks if one.check != CHECK), PreflightCheck(CHECK, said == version, text))


def _outline(region: Any) -> tuple[SitePoint, ...]:
    return tuple(_point(corner) for corner in region.corners) if isinstance(region, Region) else ()


def _point(at: Place) -> SitePoint:
    return SitePoint(at.east_m, at.north_m)
