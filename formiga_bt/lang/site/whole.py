"""Checks of a whole site: what its keys say must fit together before any machine flies there.

The fence holds the base, every port and every waiting point; no no-fly region does; spots stand apart; layers and waiting
points lie between the ground and the greatest height. Called by `lang.site` once its keys are read without error.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, Region, distance_m, horizontal_m, is_within
from formiga_bt.base.machines import MOVING
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.model import AgentType, Site
from formiga_bt.lang.site.envelope import Limit, ceiling, key_of, strictest
from formiga_bt.lang.site.routes import check_routes
from formiga_bt.lang.text.reading import Problems


class Written(Struct):
    """Where the parts of a site stand in its file."""

    base: Mark | None = None
    fence: Mark | None = None
    terrain: Mark | None = None
    no_fly: list[tuple[Region, Mark]] = field(default_factory=list)
    no_go: list[tuple[Region, Mark]] = field(default_factory=list)
    stations: dict[str, Mark] = field(default_factory=dict)
    stands: dict[str, Mark] = field(default_factory=dict)
    """Of agents: where `at` stands."""
    nodes: dict[str, Mark] = field(default_factory=dict)
    """Of routes, without the stations,"""
    edges: dict[str, Mark] = field(default_factory=dict)
    """and their edges by name."""
    layers: list[tuple[float, Mark]] = field(default_factory=list)
    ports: dict[str, Mark] = field(default_factory=dict)
    waiting: dict[str, Mark] = field(default_factory=dict)
    limits: dict[str, Limit] = field(default_factory=dict)


def check_whole(site: Site, written: Written, types: Iterable[AgentType], problems: Problems) -> None:
    """Report what does not fit together.

    Args:
        site: as it was read.
        written: where its parts stand.
        types: of the machines that move there; empty if they are not known.
        problems: where to report.
    """
    known = [one for one in types if one.flies]
    spots = list(_spots(site, written))
    _check_fences(site, written, spots, written.no_fly, "a no-fly region", problems)
    _check_fences(site, written, _stands(site, written), written.no_go, "a no-go region", problems)
    _check_heights_known(site, written, spots, problems)
    _check_apart(site, written, problems)
    if site.routes.nodes:
        check_routes(site, written.nodes, written.edges, written.stations, problems)
    _check_layers(site, written, known, problems)
    _check_waiting(site, written, known, problems)


def _spots(site: Site, written: Written) -> Iterator[tuple[str, Place | Position, Mark]]:
    """Iterate over where machines stand or hover: what it is called, the point, the place in the file."""
    if written.base is not None:
        yield "the base", Place(0.0, 0.0), written.base
    for name, port in site.ports.items():
        yield f"port '{name}'", port.at, written.ports[name]
        if port.waiting is not None:
            yield f"the waiting point of '{name}'", port.waiting, written.waiting[name]


def _stands(site: Site, written: Written) -> Iterator[tuple[str, Place, Mark]]:
    """Iterate over where ground machines stand, as `_spots`."""
    for name, station in site.stations.items():
        yield f"station '{name}'", station.at, written.stations[name]
    for name, mark in written.stands.items():
        at = site.agents[name].at if name in site.agents else None
        if at is not None:
            yield f"'{name}'", at, mark


def _check_fences(
    site: Site,
    written: Written,
    spots: Iterable[tuple[str, Any, Mark]],
    shut: Iterable[tuple[Region, Mark]],
    called: str,
    problems: Problems,
) -> None:
    for what, point, mark in spots:
        if site.fence is not None and not is_within(point, site.fence):
            help_ = "move it inside, or widen the fence"
            problems.add("E083", mark, f"{what} lies outside the fence{_line(written.fence)}", help_)
        for region, at in shut:
            if is_within(point, region):
                problems.add("E083", mark, f"{what} lies in {called}{_line(at)}", "move it out, or the region")
                break


def _line(mark: Mark | None) -> str:
    return f" ({mark.said})" if mark is not None else ""


def _check_heights_known(
    site: Site, written: Written, spots: Iterable[tuple[str, Any, Mark]], problems: Problems
) -> None:
    """Report E086 where the height file does not reach, and where it has the base at another height."""
    if site.heights is None or written.terrain is None:
        return
    corners = site.fence.corners if site.fence is not None else ()
    points = [(what, point) for what, point, _ in spots]
    points += [(f"corner {number} of the fence", corner) for number, corner in enumerate(corners, start=1)]
    for what, point in points:
        if site.heights.ground_m(point.east_m, point.north_m) is None:
            help_ = "the file counts in metres east and north of the base, and must reach as far as the fence"
            problems.add("E086", written.terrain, f"the file has no height of the ground at {what}", help_)
            return
    off = site.heights.ground_m(0.0, 0.0) or 0.0
    most = max(site.relief_m, 5.0)
    if abs(off) > most:
        said = f"the file has the base's ground {_m(site.ground_msl_m + off)} over the sea"
        help_ = "ground_msl of base: and the file must mean the same heights"
        problems.add("E086", written.terrain, f"{said}, 'ground_msl' is {_m(site.ground_msl_m)}", help_)


def _m(metres: float) -> str:
    return format_quantity("distance", round(metres, 1))


def _check_apart(site: Site, written: Written, problems: Problems) -> None:
    """Report E084 for ports and stations closer than `min_spacing`, and for waiting points closer than `separation`."""
    spots = [(f"port '{one.name}'", one.at, written.ports[one.name]) for one in site.ports.values()]
    spots += [(f"station '{one.name}'", one.at, written.stations[one.name]) for one in site.stations.values()]
    for (one, here, _), (other, there, mark) in combinations(spots, 2):
        apart = horizontal_m(here, there)
        if apart < site.min_spacing_m:
            what = f"{other} is {_m(apart)} from {one}; min_spacing is {_m(site.min_spacing_m)}"
            problems.add("E084", mark, what, "move one of them")
    for port, next_ in combinations(site.ports.values(), 2):
        if port.waiting is not None and next_.waiting is not None:
            apart = distance_m(port.waiting, next_.waiting)
            if apart < site.separation_m:
                what = f"who waits for '{next_.name}' is {_m(apart)} from who waits for '{port.name}'"
                help_ = f"separation is {_m(site.separation_m)}: move one of them, or give it another height"
                problems.add("E084", written.waiting[next_.name], what, help_)


def _least_clearance(site: Site, types: Iterable[AgentType]) -> float:
    """Return the greatest terrain clearance that any machine here must keep, metres."""
    key = key_of("terrain_clearance")
    known = [one.limits[key] for one in types if key in one.limits]
    if key in site.envelope:
        known.append(site.envelope[key])
    return strictest("terrain_clearance", known) or 0.0


def _check_layers(site: Site, written: Written, types: Iterable[AgentType], problems: Problems) -> None:
    known = list(types)
    layers: list[tuple[float, Mark | None]] = [*written.layers] or [(height, None) for height in site.layers_m]
    top = written.limits.get("max_height")
    if top is not None and all(top.value < height for height, _ in layers):
        what = f"max_height {top.shown} is below the lowest layer, {_m(min(height for height, _ in layers))}"
        problems.add("E061", top.mark, what, "raise max_height, or give the site lower layers: layers: [..]")
        return
    for height, mark in layers:
        at = mark or (top.mark if top is not None else None)
        if at is not None:
            _check_layer(site, height, at, known, problems)
    _check_ceilings(site, layers, known, problems)
    for (one, _), (other, mark) in combinations(sorted(layers, key=lambda layer: layer[0]), 2):
        if mark is not None and 0 < other - one < site.separation_m:
            what = f"layers {_m(one)} and {_m(other)} are closer than separation, {_m(site.separation_m)}"
            problems.add("E082", mark, what, "drones of different tasks cross in different layers: move one")


def _check_ceilings(
    site: Site, layers: Iterable[tuple[float, Mark | None]], types: Sequence[AgentType], problems: Problems
) -> None:
    """Report E082 for a type that may fly in none of the layers; a grant gives each machine one that is low enough."""
    height, mark = min(layers, key=lambda layer: layer[0])
    highest, _ = _highest(site, types)
    for agent_type in types:
        limit, owner = ceiling("max_height", agent_type, site.envelope, {})
        if mark is not None and limit < height <= highest:
            what = f"the lowest layer, {_m(height)}, is above the limit of {_m(limit)} for {owner}"
            problems.add("E082", mark, what, f"add one of at most {_m(limit)}: each machine crosses where it may fly")


def _highest(site: Site, types: Iterable[AgentType]) -> tuple[float, str]:
    """Return the height that no type may fly above, metres over the ground, and whose limit that is; inf = there is none."""
    limits = [ceiling("max_height", agent_type, site.envelope, {}) for agent_type in types]
    return max(
        limits, default=(site.envelope.get(key_of("max_height"), float("inf")), "this site"), key=lambda one: one[0]
    )


def _check_layer(site: Site, height: float, mark: Mark, types: Iterable[AgentType], problems: Problems) -> None:
    limit, owner = _highest(site, types)
    if height > limit:
        what = f"layer {_m(height)} is above the limit of {_m(limit)} for {owner}"
        problems.add("E082", mark, what, "lower it; nothing may fly there")
        return
    least = site.relief_m + _least_clearance(site, types)
    if height < least:
        what = f"layer {_m(height)} is too near the ground, which may rise {_m(site.relief_m)}"
        problems.add("E082", mark, what, f"at least {_m(least)}: relief and terrain_clearance together")


def _check_waiting(site: Site, written: Written, types: Iterable[AgentType], problems: Problems) -> None:
    """Report E082 for a waiting point too near the ground below it, or above the greatest height."""
    known = list(types)
    clearance = _least_clearance(site, known)
    for name, port in site.ports.items():
        if port.waiting is None:
            continue
        at_home = {agent.type for agent in site.agents.values() if agent.home == name}
        mine = [one for one in known if one.name in at_home] or known  # at a free port any of them may have to wait
        limit = min((ceiling("max_height", one, site.envelope, {})[0] for one in mine), default=float("inf"))
        below = site.heights.ground_m(port.waiting.east_m, port.waiting.north_m) if site.heights is not None else 0.0
        least = (below or 0.0) + site.relief_m + clearance
        what = f"the waiting point of '{name}' is at {_m(port.waiting.up_m)} over the base's ground"
        if port.waiting.up_m < least:
            help_ = f"at least {_m(least)}: the ground below, relief and terrain_clearance together"
            problems.add("E082", written.waiting[name], f"{what}, too near the ground", help_)
        elif port.waiting.up_m - (below or 0.0) > limit:
            problems.add("E082", written.waiting[name], f"{what}, above the limit of {_m(limit)}", "lower it")


def machines(site: Site, types: Mapping[str, AgentType]) -> list[AgentType]:
    """Return the types of the site's agents that move; if it lists none, all that fly and have an envelope."""
    listed = {agent.type for agent in site.agents.values()}
    found = [one for name, one in types.items() if name in listed and one.mobility in MOVING]
    return found or [one for one in types.values() if one.flies and key_of("max_height") in one.limits]
