"""The requests of T1 to T10 in words: thirty of each, with what each asks for in numbers.

The first ten of a task have the paper's own sentence (section 5.2), with its numbers filled in and, where the sentence says
nothing, what its program in appendix B does next; the others are paraphrases. Numbers, places and wordings are drawn by the
number of the run alone. T6 to T10 have ten fresh wordings more, runs 30 to 39 (`fresh.py`). These wordings are for evaluation:
no example and no training set may have them.
"""

import random
from collections.abc import Callable, Mapping
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm import fresh
from experiments.e2_llm.fly import Scene, World, place_of
from experiments.e2_llm.judging import SCENES
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.geo import Frame, Place

RUNS: Final = 30
PAPER_RUNS: Final = 10
"""So many of them have the paper's sentence."""


class Request(Struct, frozen=True, kw_only=True):
    """One request and what it asks for."""

    task: str
    run: int
    words: str
    paper_words: bool
    goal: dict[str, Any]
    """For the oracle."""
    reference: str
    """The shipped tree that does it."""
    values: dict[str, str]
    """What the reference is run with."""
    scenes: dict[str, Scene]

    @property
    def id(self) -> str:
        """Return a name of its own."""
        return f"{self.task}/{self.run:02d}"


FIELDS: Final = ("north_field", "east_field", "south_field", "west_field", "lake_shore")

WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    "T1": (
        "{robot} stands at {place}. Bring it back to its own port.",
        "Please get {robot} home from {place}.",
        "{robot} was left at {place}; it should take off, return to its port and land there.",
        "Fly {robot} back to where it lives.",
    ),
    "T2": (
        "Explore the region {region} with a light drone from {height} m and bring it home.",
        "Have an LWD look over all of {region}, flying at {height} m, then return to its port.",
        "I want the whole {region} area searched by one lightweight drone at {height} metres.",
        "Survey {region} from {height} m. One light drone is enough; it goes home afterwards.",
    ),
    "T3": (
        "Send a heavy drone to fetch the full buckets of {picker} at {place}. It lands there, waits until they say that it is "
        "loaded, and comes back to its port.",
        "{picker} has berries to be collected at {place}: an HWD lands, waits for the confirmation of loading and flies home.",
        "Pick up the harvest of {picker} at {place} with a heavyweight drone.",
        "A heavy drone should land at {place}, wait for {picker} to confirm the loading, then return.",
    ),
    "T4": (
        "SOS from {place}! Send a heavy drone over it, have a watcher say whether the picker is safe, then bring it home.",
        "There is an alarm at {place}: an HWD goes and hovers above, a watcher confirms what the camera shows, it returns.",
        "Emergency at {place}. Heavy drone there, ask the watcher about the picker's safety, return to port.",
        "Check the alarm at {place} with a heavyweight drone and a watcher's confirmation; after that it flies back.",
    ),
    "T5": (
        "{picker} is lost near {place}. Send a heavy drone there; if a watcher confirms that it is them, follow their "
        "MiniFinder until it says that it is in range, then bring the drone home. If not, bring it home at once.",
        "{picker} asked for guidance at {place}: HWD there, watcher confirms, then go where their MiniFinder says, again "
        "every 15 s until in range, return. When the watcher says no, just return.",
    ),
    "T6": (
        "A LWD takes off and flies in a circular pattern with a {radius} m radius around {center}. Then it goes back to the "
        "centre, flies to its port and lands.",
        "Take one light drone, fly once round {center} at a distance of {radius} metres, return to the middle, go home.",
        "I need a full circle of radius {radius} m about {center}, flown by a lightweight drone. After the lap it passes over "
        "the centre again and lands at its own port.",
        "Circle {center} with an LWD: {radius} m from the centre all the way round. It finishes over {center} and then "
        "returns to base to land.",
        "One light drone should orbit {center}, {radius} m out, one complete turn, then over the centre, then home.",
        "Please fly a loop ({radius} m radius, closed) around {center} using a single LWD. Back over {center} at the end, and "
        "then back to its port.",
        "With a small drone make a round flight about {center}; keep {radius} m away from it. When done: centre, port, land.",
        "Round {center} once with a light drone, radius {radius} m; afterwards to the middle of the circle and home.",
    ),
    "T7": (
        "Three LWDs take off and form a triangular formation. One drone is positioned directly above {corner}, representing "
        "the right-angle corner of the triangle; both legs are {leg} m long. Once in formation, all three drones land "
        "together.",
        "Use three light drones to make a right triangle in the air: the right angle above {corner}, two sides of {leg} m. "
        "When all three are in place they come down at the same time, each where it is.",
        "I want 3 LWDs standing as a right-angled isosceles triangle with legs of {leg} metres and its right angle over "
        "{corner}. Nobody lands before the figure is complete; then all land.",
        "Form up with three lightweight drones: one over {corner}, one {leg} m to one side of it, one {leg} m at a right "
        "angle to that. Wait for each other, then land all three right below.",
        "Three light drones, triangle, corner of 90 degrees at {corner}, legs {leg} m. Land together when everyone is there.",
        "Put a drone over {corner} and two more {leg} m away from it in perpendicular directions, all of them LWDs; as soon "
        "as the three are in position, land them together.",
    ),
    "T8": (
        "A single LWD takes off and reaches its target by moving in a zigzag pattern from {start} to {end}, {amplitude} m to "
        "each side in {legs} legs. After completing the zigzag motion, the drone lands at the target location.",
        "Fly a light drone to {start} and from there in zigzag to {end}: {legs} legs, swinging {amplitude} m left and right "
        "of the straight line. It lands at {end}.",
        "One lightweight drone, zigzag between {start} and {end}, {amplitude} metres amplitude, {legs} straight legs, landing "
        "at the end point.",
        "Send an LWD zigzagging from {start} towards {end} (legs: {legs}, {amplitude} m off the line on alternating sides) "
        "and set it down there.",
        "From {start}, go to {end} like a saw blade: {legs} legs, corners {amplitude} m beside the line. A light drone does "
        "it and lands at {end}.",
        "Have a small drone weave from {start} to {end} in {legs} legs, {amplitude} m to either side, and land on arrival.",
    ),
    "T9": (
        "Two LWDs are involved. The first drone takes off and lands at {target}. Meanwhile, the second drone patrols by "
        "moving in a circular path with a radius of {radius} m around the first drone and lands asynchronously.",
        "One light drone flies to {target} and lands there while another one flies a full circle of {radius} m about that "
        "spot; the second lands on its own, without waiting.",
        "Escort at {target}: an LWD lands there. At the same time a second LWD goes once round it, {radius} metres away, and "
        "then lands as well.",
        "With two light drones: A lands at {target}; B circles A at {radius} m (a complete circle) and lands when it is done. "
        "They work at the same time.",
        "Let a lightweight drone settle at {target}. A second lightweight drone patrols round it, {radius} m radius, one "
        "whole lap, simultaneously, and lands independently.",
        "Two small drones at once: the first to {target} to land, the second on a closed ring of {radius} m round {target}, "
        "then landing too.",
    ),
    "T10": (
        "Two LWD drones take off, fly to {target}, and land {spacing} meters apart. After confirmation from a watcher (for "
        "loading or unloading a package), the first drone returns to the base port and lands, while the second proceeds to "
        "{next} and lands.",
        "Send two light drones to {target}; they land {spacing} m from each other. Only when a watcher confirms, one of them "
        "goes home to its port and the other one flies on to {next} and lands there.",
        "Delivery to {target} with two lightweight drones, landing {spacing} metres apart. Ask a watcher. On yes: the first "
        "home, the second to {next}. On no: both stay.",
        "Two LWDs land beside each other at {target} ({spacing} m between them) and wait for a watcher's word; then drone one "
        "returns to its port while drone two continues to {next}, both landing.",
        "Have a pair of light drones deliver at {target}, {spacing} m apart on the ground. After the watcher's OK one flies "
        "back home and one goes on and lands at {next}.",
        "Land two light drones at {target} with {spacing} m between. When the watcher has agreed, they part: one to its own "
        "port, one to {next}; each lands.",
    ),
}  # fmt: skip
"""The wordings of each task; the first is the paper's."""

FOLLOWED: Final = {**SCENES, "yes": Scene(people={"picker_2": "east_field"}, walks={"picker_2": ("camp",)})}


def requests(task: str, world: World, runs: int = RUNS, first: int = 0) -> list[Request]:
    """Return the requests of a task from a first run on, always the same. `T10+` has those of T10."""
    last = last_run(task)
    if first + runs - 1 > last:
        raise FormigaError(f"{task} has runs 0 to {last}; runs {first} to {first + runs - 1} were asked for")
    return [_request(task, run, world) for run in range(first, first + runs)]


def last_run(task: str) -> int:
    """Return the last run of a task: 49 where there are fresh wordings, else 29."""
    return RUNS + len(fresh.FRESH.get(_of(task), ())) - 1


def _of(task: str) -> str:
    return "T10" if task == "T10+" else task


def _request(task: str, run: int, world: World) -> Request:
    of = _of(task)
    rng = random.Random(f"{of}/{run}")
    say: Callable[[str], str] = lambda name: _called(name, world, rng)  # noqa: E731
    told, goal, reference, values, scenes = _KINDS[of](rng, world, say)
    wordings = WORDS[of]
    paper = run < PAPER_RUNS
    if run >= fresh.FIRST:
        words = fresh.FRESH[of][run - fresh.FIRST]
    else:
        words = wordings[0] if paper else wordings[1 + (run - PAPER_RUNS) % (len(wordings) - 1)]
    return Request(
        task=task,
        run=run,
        words=words.format(**fresh.in_words(told)),
        paper_words=paper,
        goal=goal,
        reference=reference,
        values=values,
        scenes=scenes,
    )


def _called(name: str, world: World, rng: random.Random) -> str:
    """Return how a person names a place: by its name, or by its degrees."""
    if name == "base":
        return "the base station"
    if rng.random() < 0.5:
        return f"the {name.replace('_', ' ')}"
    site = world.site
    lat, lng = Frame(site.lat, site.lng, site.ground_msl_m).lat_lng(Place(*place_of(world, name)))
    return f"{lat:.6f} N {lng:.6f} E"


_Made = tuple[dict[str, str], dict[str, Any], str, dict[str, str], dict[str, Scene]]
_Say = Callable[[str], str]


def _move(rng: random.Random, world: World, say: _Say) -> _Made:  # noqa: ARG001
    robot, place = rng.choice(("lwd_1", "lwd_2", "lwd_3", "hwd_1", "hwd_2")), rng.choice(FIELDS)
    scenes = {"yes": Scene(parked={robot: place})}
    return {"robot": robot, "place": say(place)}, {"robot": robot}, "move_task", {"robot": robot}, scenes


def _explore(rng: random.Random, world: World, say: _Say) -> _Made:  # noqa: ARG001
    region, height = rng.choice(("lake", "bog")), rng.choice((30, 40, 50, 60))
    corners = [(one.east_m, one.north_m) for one in world.site.regions[region].corners]
    told = {"region": f"the {region}", "height": str(height)}
    return told, {"corners": corners}, "explore_region", {"region": region, "altitude": f"{height} m"}, dict(SCENES)


def _pick_up(rng: random.Random, world: World, say: _Say) -> _Made:
    picker, place = rng.choice(("picker_1", "picker_2")), rng.choice(FIELDS)
    told = {"picker": picker, "place": say(place)}
    return told, {"target": place_of(world, place)}, "pick_up", {"target": place, "user": picker}, dict(SCENES)


def _sos(rng: random.Random, world: World, say: _Say) -> _Made:
    place = rng.choice(FIELDS)
    values = {"alarmtype": "sos", "target": place}
    return {"place": say(place)}, {"target": place_of(world, place)}, "watch_dog_sos", values, dict(SCENES)


def _lost(rng: random.Random, world: World, say: _Say) -> _Made:  # noqa: ARG001
    goal = {"target": place_of(world, "east_field"), "picker": "picker_2", "fixes": 2}
    values = {"alarmtype": "lost", "target": "east_field", "username": "picker_2"}
    return {"place": say("east_field"), "picker": "picker_2"}, goal, "watch_dog_request", values, dict(FOLLOWED)


def _circle(rng: random.Random, world: World, say: _Say) -> _Made:
    center, radius = rng.choice(("base", "base", *FIELDS)), rng.choice((3, 3, 5, 8, 12, 20, 30))
    goal = {"center": place_of(world, center), "radius_m": float(radius)}
    values = {"radius": f"{radius} m"} | ({} if center == "base" else {"center": center})
    return {"center": say(center), "radius": str(radius)}, goal, "circle", values, dict(SCENES)


def _triangle(rng: random.Random, world: World, say: _Say) -> _Made:
    corner, leg = rng.choice(FIELDS), rng.choice((10, 10, 15, 20, 30))
    goal = {"corner": place_of(world, corner), "leg_m": float(leg)}
    return (
        {"corner": say(corner), "leg": str(leg)},
        goal,
        "triangle",
        {"corner": corner, "leg": f"{leg} m"},
        dict(SCENES),
    )


def _zigzag(rng: random.Random, world: World, say: _Say) -> _Made:
    start, end = rng.sample(FIELDS, 2)
    wide, legs = rng.choice((5, 5, 8, 10, 15)), rng.choice((6, 8, 10, 10))
    goal = {"start": place_of(world, start), "end": place_of(world, end), "amplitude_m": float(wide), "legs": legs}
    told = {"start": say(start), "end": say(end), "amplitude": str(wide), "legs": str(legs)}
    values = {"start": start, "end": end, "amplitude": f"{wide} m", "legs": str(legs)}
    return told, goal, "zig_zag", values, dict(SCENES)


def _patrol(rng: random.Random, world: World, say: _Say) -> _Made:
    target, radius = rng.choice(FIELDS), rng.choice((10, 10, 15, 20))
    goal = {"target": place_of(world, target), "radius_m": float(radius)}
    told = {"target": say(target), "radius": str(radius)}
    return told, goal, "patrol_and_escort", {"target": target, "radius": f"{radius} m"}, dict(SCENES)


def _delivery(rng: random.Random, world: World, say: _Say) -> _Made:
    target, onward = rng.sample(FIELDS, 2)
    spacing = rng.choice((5, 5, 5, 8, 10))
    goal = {"target": place_of(world, target), "next_stop": place_of(world, onward), "spacing_m": float(spacing)}
    told = {"target": say(target), "next": say(onward), "spacing": str(spacing)}
    return told, goal, "delivery", {"target": target, "next_stop": onward, "spacing": f"{spacing} m"}, dict(SCENES)


_KINDS: Final[Mapping[str, Callable[[random.Random, World, _Say], _Made]]] = {
    "T1": _move,
    "T2": _explore,
    "T3": _pick_up,
    "T4": _sos,
    "T5": _lost,
    "T6": _circle,
    "T7": _triangle,
    "T8": _zigzag,
    "T9": _patrol,
    "T10": _delivery,
}
