"""Random scenes from a seed: a site, a fleet, requests, and what goes wrong meanwhile. All data; `runs` plays them.

Times are seconds after the fleet has announced itself. Each fault has an end of its own or ends when the calm begins.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Region
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Site, SiteAgent, Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from tests.safety.drawn import COUNT, drawn

SHIPPED = ("move_task", "pick_up", "explore_region", "watch_dog_sos", "watch_dog_request")
FLEET = (
    ("hwd_1", "hwd", "p5"), ("lwd_1", "lwd", "p1"), ("lwd_2", "lwd", "p2"), ("hwd_2", "hwd", "p6"), ("hwd_3", "hwd", "p7"),
    ("lwd_3", "lwd", "p4"),
)  # fmt: skip
FIELDS = (
    Place(20.0, 260.0), Place(220.0, 120.0), Place(-60.0, -180.0), Place(-230.0, 60.0), Place(180.0, -160.0),
    Place(90.0, 150.0),
)  # fmt: skip
ANSWERS: Mapping[str, Sequence[Mapping[str, Any]]] = {
    "answers": (),
    "slow": ({"match": "*", "options": ["clear", "yes", "loaded", "yes_loaded", "land"], "after": "50 s"},),
    "never": ({"never": True},),
    "refuses": ({"match": "clear", "options": ["refuse"], "after": "3 s"},),
    "waits": ({"match": "start here", "options": ["wait", "clear"], "after": "3 s"},
              {"match": "land here", "options": ["wait", "wait", "clear"], "after": "4 s"}),
}  # fmt: skip
"""Scripts of people; one without a rule that fits says the first option that is a yes."""

HARD = 100_000
"""From this seed on much more happens in a scene."""
WILD = 200_000
"""From this seed on the trees are drawn at random (`drawn`); as much happens as below `HARD`."""
UNSURE = 300_000
"""From this seed on drones do not always know whether they stand; as much else happens as below `HARD`."""

BY_HAND = 400_000
"""From this seed on persons give and take agents by hand, too; drones know whether they stand."""

STOPS = ("hold", "return", "land", "cut")


class Deed(Struct, frozen=True):
    """Something that somebody does, or that goes wrong."""

    at: float
    what: str
    whom: str = ""
    """An agent, or `#<n>`: the n-th open task, modulo their number; "" = all."""
    how: str = ""
    much: float = 0.0

    def __str__(self) -> str:
        more = f" {self.much:g}" if self.much else ""
        return f"{self.what} {self.whom} {self.how}".strip() + more


class Request(Struct, frozen=True):
    """A task that is asked for."""

    at: float
    task: str
    params: dict[str, Any]
    priority: Any = None


class Scene(Struct, frozen=True):
    """All that decides a run."""

    seed: int
    site: Site
    specs: tuple[AgentSpec, ...]
    requests: tuple[Request, ...]
    deeds: tuple[Deed, ...]
    calm_at: float


def tasks(seed: int) -> tuple[Task, ...]:
    """Return the tasks of a scene: the shipped ones and those in `trees`, or drawn ones."""
    return drawn() if WILD <= seed < UNSURE else _written()


@cache
def _written() -> tuple[Task, ...]:
    site, catalogue = packaged_world()
    found = [packaged_task(name) for name in SHIPPED]
    for file in sorted((Path(__file__).parent / "trees").glob("*.yaml")):
        loaded = load_task(file, catalogue=catalogue, site=site)
        assert loaded.task is not None, [str(d) for d in loaded.diagnostics]
        found.append(loaded.task)
    return tuple(found)


def scene(seed: int) -> Scene:
    """Return the scene of a seed."""
    dice = Random(seed)
    drones = FLEET[: dice.choice((2, 2, 3, 3, 4, 6))]
    people = {"watcher_1": "watcher", "picker_1": "picker", **({"picker_2": "picker"} if dice.random() < 0.5 else {})}
    site = _site(dice, drones, people)
    lasts = dice.choice((120.0, 240.0, 400.0))
    requests = [_request(dice, drones, list(people), dice.uniform(0.0, lasts * 0.6)) for _ in range(dice.randint(1, 4))]
    requests[0] = Request(0.0, requests[0].task, requests[0].params)
    if WILD <= seed < UNSURE:
        requests = [_drawn(dice, request) for request in requests]
    return Scene(
        seed,
        site,
        (*_machines(dice, site, drones), *_people(dice, people)),
        tuple(sorted(requests, key=lambda r: r.at)),
        tuple(sorted(_deeds(dice, seed, [name for name, _, _ in drones], lasts), key=lambda d: d.at)),
        lasts,
    )


def _site(dice: Random, drones: Sequence[tuple[str, str, str]], people: Mapping[str, str]) -> Site:
    site, _ = packaged_world()
    changes: dict[str, Any] = {
        "agents": {
            **{name: SiteAgent(name, kind, port) for name, kind, port in drones},
            **{name: SiteAgent(name, kind) for name, kind in people.items()},
        },
        "layers_m": dice.choice(((60.0, 75.0, 90.0), (60.0, 75.0, 90.0), (60.0, 75.0), (60.0,))),
    }
    if dice.random() < 0.4:
        half_m = dice.choice((280.0, 320.0))
        corners = ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))
        changes["fence"] = Region(tuple(Place(*corner) for corner in corners))
    if dice.random() < 0.4:
        east, north = dice.choice(((110.0, 80.0), (-150.0, -60.0), (0.0, 120.0), (120.0, -100.0)))
        corners = ((east, north), (east + 40.0, north), (east + 40.0, north + 50.0), (east, north + 50.0))
        changes["no_fly"] = (Region(tuple(Place(*corner) for corner in corners)),)
    if dice.random() < 0.3:
        changes["envelope"] = dice.choice(({"reserve_pct": 40.0}, {"max_height_m": 100.0}))
    return replace(site, **changes)


def _machines(dice: Random, site: Site, drones: Sequence[tuple[str, str, str]]) -> list[AgentSpec]:
    found = []
    for name, kind, port in drones:
        home = site.ports[port].at
        at: Any = home
        if dice.random() < 0.08:
            at = Place(-20.0 - 15.0 * len(found), -60.0)
        battery = dice.choice((100.0, 100.0, 90.0, 60.0, 38.0))
        cut: Any = {"cut": dice.random() < 0.5} if "cut" in AgentSpec.__struct_fields__ else {}
        found.append(AgentSpec(id=name, type=kind, at=at, home=home, kind="drone", battery=battery, **cut))
    return found


def _people(dice: Random, people: Mapping[str, str]) -> list[AgentSpec]:
    found = []
    for index, (name, kind) in enumerate(people.items()):
        script = ANSWERS[dice.choice(("answers", "answers", "answers", "slow", "never", "refuses", "waits"))]
        place = FIELDS[index] if kind == "picker" else Place(30.0, -40.0)
        away = Place(place.east_m + 20.0, place.north_m + 6.0)
        found.append(AgentSpec(id=name, type=kind, at=away, script=script, kind="person"))
    return found


def _request(dice: Random, drones: Sequence[tuple[str, str, str]], people: Sequence[str], at: float) -> Request:
    spot, other = dice.sample(FIELDS, 2)
    picker = AgentRef(dice.choice([name for name in people if name.startswith("picker")]))
    corners = (spot, Place(spot.east_m + 60.0, spot.north_m), Place(spot.east_m + 60.0, spot.north_m - 60.0))
    params: dict[str, dict[str, Any]] = {
        "MoveTask": {"robot": AgentRef(dice.choice(drones)[0])},
        "PickUp": {"target": spot, "user": picker},
        "ExploreRegion": {"region": Region(corners)},
        "WatchDogSOS": {"alarmtype": "sos", "target": spot},
        "WatchDogRequest": {"alarmtype": "lost", "target": spot, "username": picker},
        "Circle": {"center": spot, "altitude": dice.choice((40.0, 60.0, 110.0, 140.0))},
        "Triangle": {"corner": spot},
        "ZigZag": {"start": spot, "end": other, "altitude": dice.choice((50.0, 95.0, 110.0))},
        "PatrolAndEscort": {"at": spot},
        "Delivery": {"to": spot, "next_stop": other},
    }
    task = dice.choice(sorted(params))
    return Request(at, task, params[task], dice.choice((None, None, "high", "low")))


def _drawn(dice: Random, request: Request) -> Request:
    to, other = dice.sample(FIELDS, 2)
    return Request(request.at, f"Drawn{dice.randrange(COUNT)}", {"to": to, "other": other}, request.priority)


def _deeds(dice: Random, seed: int, drones: Sequence[str], lasts: float) -> list[Deed]:
    found: list[Deed] = []
    for _ in range(dice.choice((15, 25, 40) if HARD <= seed < WILD else (1, 2, 3, 4, 6, 8, 10))):
        # A third of all comes together with something else.
        near = found and dice.random() < 0.35
        at = max(0.0, dice.choice(found).at + dice.uniform(-1.5, 1.5)) if near else dice.uniform(3.0, lasts)
        found += _deed(dice, round(at, 3), drones)
    if seed >= BY_HAND:
        found += _by_hand(Random(f"by hand/{seed}"), drones, lasts)
    elif seed >= UNSURE:
        unsure = Random(f"unsure/{seed}")
        for _ in range(unsure.choice((1, 2, 4))):
            at, drone = round(unsure.uniform(1.0, lasts), 3), unsure.choice(drones)
            until = round(at + unsure.choice((0.5, 3.0, 12.0, 40.0)), 3)
            found += [Deed(at, "unsure", drone), Deed(until, "sure", drone)]
    if dice.random() < 0.25:
        # People lose their link, too: nobody of them is ever LOST, and questions wait.
        at, person = round(dice.uniform(3.0, lasts), 3), dice.choice(("watcher_1", "picker_1"))
        until = round(at + dice.choice((5.0, 40.0, 120.0)), 3)
        word, end = dice.choice((("freeze", "thaw"), ("kill", "restart_process")))
        found += [Deed(at, word, person), Deed(until, end, person)]
    return found


def _by_hand(dice: Random, drones: Sequence[str], lasts: float) -> list[Deed]:
    found = []
    for _ in range(dice.choice((4, 8, 16))):
        at, agent, task = round(dice.uniform(1.0, lasts), 3), dice.choice(drones), f"#{dice.randrange(4)}"
        kind = dice.choice(("assign", "assign", "unassign", "unassign", "out", "in", "prioritize"))
        found.append(Deed(at, kind, agent, dice.choice(("low", "medium", "high")) if kind == "prioritize" else task))
    return found


def _deed(dice: Random, at: float, drones: Sequence[str]) -> list[Deed]:
    agent, until = dice.choice(drones), round(at + dice.choice((2.0, 6.0, 15.0, 28.0, 45.0, 90.0)), 3)
    target = dice.choice((agent, agent, f"#{dice.randrange(4)}", ""))
    kind = dice.choice((
        "pilot", "pilot", "pilot", "kill", "freeze", "refuse", "lose", "mute", "nan", "wire", "slow",
        "stop", "stop", "stop", "stop", "continue", "restart", "lockdown", "lockdown", "abort", "abort", "clear",
        "battery", "wind", "link",
    ))  # fmt: skip
    match kind:
        case "pilot":
            back = dice.choice(("continue", "return", "end"))
            return [
                Deed(at, "pilot", agent),
                Deed(until, "pilot_off", agent),
                Deed(until + 1.0, "handback", agent, back),
            ]
        case "kill":
            return [Deed(at, "kill", agent), Deed(until, "restart_process", agent)]
        case "freeze":
            return [Deed(at, "freeze", agent), Deed(until, "thaw", agent)]
        case "refuse" | "lose" | "nan":
            return [Deed(at, kind, agent, much=float(dice.randint(1, 4)))]
        case "mute":
            return [Deed(at, "mute", agent), Deed(until, "unmute", agent)]
        case "wire":
            how = dice.choice(("drop", "duplicate", "reorder", "all"))
            return [Deed(at, "wire", agent, how, dice.choice((0.1, 0.3))), Deed(until + 30.0, "wire_off", agent)]
        case "slow":
            return [Deed(at, "slow", agent, much=dice.choice((0.3, 1.0, 2.5))), Deed(until, "slow_off", agent)]
        case "stop":
            deeds = [Deed(at, "order", target, dice.choice(STOPS[:3] if dice.random() < 0.9 else STOPS))]
            return [*deeds, Deed(until, "order", target, "continue")] if dice.random() < 0.6 else deeds
        case "continue" | "restart":
            return [Deed(at, "order", target, kind)]
        case "lockdown":
            deeds = [Deed(at, "lockdown", "", dice.choice(("hold", "return", "land")))]
            if dice.random() < 0.3:
                deeds.append(Deed(round((at + until) / 2, 3), "lockdown", "", dice.choice(("hold", "return", "land"))))
            return [*deeds, Deed(until, "lockdown", "", "release")]
        case "abort":
            return [Deed(at, "abort", f"#{dice.randrange(4)}", dice.choice(("", "", "now", "abandon")))]
        case "battery":
            return [Deed(at, "battery", agent, much=dice.choice((34.0, 27.0, 20.0)))]
        case "wind":
            return [Deed(at, "wind", agent, much=dice.choice((6.0, 12.0))), Deed(until, "wind_off", agent)]
        case "link":
            return [Deed(at, "link", agent), Deed(until, "link_on", agent)]
        case _:
            return [Deed(at, kind, agent)]
