"""Programs in the paper's Python: T4 and T5 after its appendix A, T6 to T10 after its appendix B, T1 to T3 after its text.

Their slips are put right: names that are not defined, a lost longitude, a landing that was a take-off, half a circle, three
points in a line, a zigzag that never arrives, a drone that stays in the air when the watcher says no.
"""

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

from experiments.e2_llm.fly import World, place_of
from experiments.e2_llm.requests import Request
from formiga_bt.base.geo import Frame, Place

_EXAMPLES: Final[Mapping[str, str]] = {
    "T1": 'MoveTask("lwd_2")',
    "T2": "ExploreRegion(None, [@bog@], 60)",
    "T3": "PickUp(None, @camp@)",
    "T4": 'WatchDogSOS(None, "sos", @camp@)',
    "T5": 'WatchDogRequest(None, "lost", @camp@, "picker_1")',
    "T6": "CircleTask(None, @camp@, 20, 4)",
    "T7": "TriangleTask(None, None, None, @camp@, 20, 12)",
    "T8": "ZigzagTask(None, @base@, @camp@, 20, 6, 5)",
    "T9": "PatrolAndEscort(None, None, @camp@, 20, 12)",
}
"""How the examples call their functions, for the requests of `paper_examples.json`; `@camp@` is a place in degrees."""
_CALLS: Final[Mapping[str, str]] = {
    "T1": "MoveTask({robot!r})",
    "T2": "ExploreRegion(None, [{region}], {altitude})",
    "T3": "PickUp(None, {target})",
    "T4": "WatchDogSOS(None, 'sos', {target})",
    "T5": "WatchDogRequest(None, 'lost', {target}, {username!r})",
    "T6": "CircleTask(None, {center}, 20, {radius})",
    "T7": "TriangleTask(None, None, None, {corner}, 20, {leg})",
    "T8": "ZigzagTask(None, {start}, {end}, 20, {amplitude}, {legs})",
    "T9": "PatrolAndEscort(None, None, {target}, 20, {radius})",
    "T10": "DeliverTask(None, None, {target}, {next_stop}, 20, {spacing})",
}


@cache
def function(task: str) -> str:
    """Return the function of a task."""
    return (Path(__file__).parent / "programs" / f"{task}.py.txt").read_text(encoding="utf-8")


def degrees(world: World, name: str) -> str:
    """Return a place, a port or the base as `66.500000, 25.700000`; a region as the list of its corners."""
    site = world.site
    frame = Frame(site.lat, site.lng, site.ground_msl_m)
    if name in site.regions:
        return ", ".join(f"({_pair(frame, (one.east_m, one.north_m))})" for one in site.regions[name].corners)
    return _pair(frame, place_of(world, name))


def example(task: str, world: World) -> str:
    """Return the program of an example: the function, and its call."""
    call = re.sub("@([a-z_]+)@", lambda found: degrees(world, found[1]), _EXAMPLES[task])
    return f"{function(task)}\n{call}\n"


def reference(request: Request, world: World) -> str:
    """Return the program that does what a request of T1 to T10 asks for."""
    task = "T10" if request.task == "T10+" else request.task
    values: dict[str, str] = {"center": degrees(world, "base")}
    for name, text in request.values.items():
        is_there = text in world.site.places or text in world.site.regions
        values[name] = degrees(world, text) if is_there else text.removesuffix(" m")
    return f"{function(task)}\n{_CALLS[task].format(**values)}\n"


def _pair(frame: Frame, flat: tuple[float, float]) -> str:
    lat, lng = frame.lat_lng(Place(*flat))
    return f"{lat:.6f}, {lng:.6f}"
