"""What a seed means: a fleet, requests and faults, as frozen data. `world` plays it.

Times are seconds after the fleet has announced itself. Each fault has an end of its own, or ends when the calm begins.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from random import Random
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Region
from formiga_bt.lang.model import Catalogue, Site, SiteAgent, Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import packaged_world
from tests.simulation.more import APPROVER, MORE_FROM, PILOTS, RELAY_FROM, YARD_FROM, more
from tests.simulation.trees import CHILDREN, TREES, task_of, ten_site

DRONES: Final = (
    ("lwd_1", "lwd", "p5"), ("hwd_1", "hwd", "p7"), ("lwd_2", "lwd", "p6"), ("lwd_3", "lwd", "p9"), ("hwd_2", "hwd", "p10"),
    ("lwd_4", "lwd", "p4"), ("hwd_3", "hwd", "p11"),
)  # fmt: skip
PEOPLE: Final = (("watcher_1", "watcher"), ("picker_1", "picker"), ("watcher_2", "watcher"), ("picker_2", "picker"))
FIELDS: Final = (
    Place(0.0, 160.0), Place(70.0, 130.0), Place(-80.0, 140.0), Place(-30.0, -70.0), Place(60.0, -80.0), Place(-120.0, -40.0),
)  # fmt: skip
SCRIPTS: Final[Mapping[str, Sequence[Mapping[str, Any]]]] = {
    "answers": (),
    "slow": ({"match": "*", "options": ["clear", "yes", "loaded"], "after": "15 s"},),
    "never": ({"match": "*", "never": True},),
    "refuses": ({"match": "clear", "options": ["refuse"], "after": "2 s"},),
    "waits": ({"match": "land here", "options": ["wait", "clear"], "after": "3 s"},),
}
FAST: Final = {"speed_m_s": 25.0, "climb_m_s": 8.0, "charge_percent_s": 1.0}
"""Machines are quick, so that a seed is short; all else is as in the catalogue."""
FAULTS: Final = (
    "wire", "wire", "slow", "crash", "crash", "freeze", "cut_off", "engine", "engine", "engine", "disk_full", "disk_slow",
    "wall", "pilot", "refuse", "lose", "mute", "battery", "silent", "nan", "wire_of_person",
)  # fmt: skip
ORDERS: Final = ("stop", "stop", "abort", "abort", "lockdown", "clear", "continue", "restart", "event")
MIN_TASKS, MIN_AGENTS, MIN_FAULTS = 20, 6, 5


class Ask(Struct, frozen=True):
    """A request of a task."""

    at: float
    task: str
    params: dict[str, Any]
    priority: Any = None


class Deed(Struct, frozen=True):
    """A fault, or what somebody does."""

    at: float
    what: str
    whom: str = ""
    """An agent; `@<agent>`: its task; `#<n>`: the n-th open task, modulo their number; `~<n>`: of those that end; "": all."""
    how: str = ""
    much: float = 0.0
    again: tuple[int, ...] = ()
    """Of the end of an engine: after how many steps each of the next ones ends."""
    away_s: float = 0.0
    blames: int = 0
    """Of the end of an engine: the how-manieth open task is said to have caused it; 0 = none."""
    count: int = 1

    def __str__(self) -> str:
        more = [f"{self.much:g}" if self.much else "", f"away {self.away_s:g} s" if self.away_s else ""]
        return " ".join(w for w in (self.what, self.whom, self.how, *more, str(self.again or "")) if w)


class Plan(Struct, frozen=True):
    """All that decides a run."""

    seed: int
    drones: int
    people: tuple[tuple[str, str, str], ...]
    """Id, type and script of each."""
    asks: tuple[Ask, ...]
    deeds: tuple[Deed, ...]
    calm_at: float
    on_file: bool = False
    """The journal is a real SQLite file."""
    batteries: tuple[float, ...] = ()
    real: bool = False
    """The site is in mode real: tasks need an approval, machines a pilot."""
    ahead: bool = False
    """The engine goes on while its steps are committed."""

    @property
    def agents(self) -> int:
        """Return how many agents take part."""
        return self.drones + len(self.people)

    @property
    def site(self) -> Site:
        """Return the site."""
        people = tuple((name, kind) for name, kind, _ in self.people)
        return _real_of(self.drones, people) if self.real else _site(self.drones, people)

    @property
    def catalogue(self) -> Catalogue:
        """Return the catalogue of the site."""
        return packaged_world()[1]

    def models(self) -> dict[str, Task]:
        """Return the tasks that are requested, by the names that they are asked for by."""
        return {name: task_of(name) for name in dict.fromkeys((*CHILDREN, *(ask.task for ask in self.asks)))}

    def specs(self) -> list[AgentSpec]:
        """Return the simulated agents."""
        ports = ten_site().ports
        found = [
            AgentSpec(
                id=name, type=kind, at=ports[port].at, home=ports[port].at, kind="drone", limits=FAST, cut=True,
                battery=self.batteries[at],
            )
            for at, (name, kind, port) in enumerate(DRONES[: self.drones])
        ]  # fmt: skip
        for at, (name, kind, script) in enumerate(self.people):
            place = FIELDS[at] if kind == "picker" else Place(30.0, -40.0)
            spot = Place(place.east_m + 25.0, place.north_m + 6.0)
            found.append(AgentSpec(id=name, type=kind, at=spot, script=SCRIPTS[script], kind="person"))
        return found


@cache
def _site(drones: int, people: tuple[tuple[str, str], ...]) -> Site:
    listed = {name: SiteAgent(name, kind, port) for name, kind, port in DRONES[:drones]}
    listed |= {name: SiteAgent(name, kind) for name, kind in people}
    watchers = tuple(name for name, kind in people if kind == "watcher")
    return replace(ten_site(), agents=listed, people={"watchers": watchers})


@cache
def _real_of(drones: int, people: tuple[tuple[str, str], ...]) -> Site:
    site = _site(drones, people)
    return replace(site, mode="real", pilots=dict(PILOTS), people={**site.people, "approvers": (APPROVER,)})


def plan(seed: int) -> Plan:
    """Return the plan of a seed; from `MORE_FROM` on it has more in it, from `YARD_FROM` to `RELAY_FROM` it is of a yard."""
    if YARD_FROM <= seed < RELAY_FROM:
        from tests.simulation.yard import yard_plan

        return yard_plan(seed)
    return more(plan_without(seed)) if seed >= MORE_FROM else plan_without(seed)


def plan_without(seed: int) -> Plan:
    """Return what every seed draws."""
    dice = Random(f"simulation/{seed}")
    drones = dice.randint(4, len(DRONES))
    people = tuple(
        (name, kind, dice.choice(("answers", "answers", "answers", "slow", "never", "refuses", "waits")))
        for name, kind in PEOPLE[: dice.randint(2, len(PEOPLE))]
    )
    lasts = dice.choice((90.0, 150.0, 240.0))
    asks = sorted(
        (_ask(dice, drones, people, lasts) for _ in range(MIN_TASKS + dice.randint(0, 4))), key=lambda ask: ask.at
    )
    machines = [name for name, _, _ in DRONES[:drones]]
    return Plan(
        seed, drones, people, tuple(asks), deeds(dice, machines, [name for name, _, _ in people], lasts), lasts,
        on_file=dice.random() < 0.02,
        batteries=tuple(dice.choice((100.0, 100.0, 90.0, 70.0, 40.0)) for _ in machines),
    )  # fmt: skip


def _ask(dice: Random, drones: int, people: Sequence[tuple[str, str, str]], lasts: float) -> Ask:
    at = round(dice.uniform(0.0, lasts * 0.7), 3)
    priority = dice.choice((None, None, None, "high", "low"))
    to, other = dice.sample(FIELDS, 2)
    if dice.random() < 0.65:
        return Ask(at, f"Tree{dice.randrange(TREES)}", {"to": to, "other": other, "n": dice.randrange(10)}, priority)
    picker = AgentRef(dice.choice([name for name, kind, _ in people if kind == "picker"]))
    robot = {"robot": AgentRef(dice.choice(DRONES[:drones])[0])} if dice.random() < 0.5 else {}
    corners = (to, Place(to.east_m + 30.0, to.north_m), Place(to.east_m + 30.0, to.north_m - 25.0))
    params: dict[str, dict[str, Any]] = {
        "move_task": robot,
        "pick_up": {"target": to, "user": picker},
        "explore_region": {"region": Region(corners)},
        "watch_dog_sos": {"alarmtype": "sos", "target": to},
        "watch_dog_request": {"alarmtype": "lost", "target": to, "username": picker},
        "circle": {"center": to, "points": 4},
        "triangle": {"corner": to},
        "zig_zag": {"start": to, "end": other, "legs": 3},
        "patrol_and_escort": {"target": to, "points": 4},
        "delivery": {"target": to, "next_stop": other, "return_second": dice.random() < 0.5},
    }
    task = dice.choice(sorted(params))
    return Ask(at, task, params[task], priority)


def deeds(dice: Random, machines: Sequence[str], people: Sequence[str], lasts: float) -> tuple[Deed, ...]:
    """Return what goes wrong, and what people order."""
    found: list[Deed] = []
    for index in range(dice.choice((5, 6, 8, 10, 14)) + dice.randint(2, 6)):
        near = found and dice.random() < 0.35  # a third of all comes together with something else
        at = max(0.0, dice.choice(found).at + dice.uniform(-1.5, 1.5)) if near else dice.uniform(2.0, lasts)
        kind = dice.choice(FAULTS) if index < MIN_FAULTS or dice.random() < 0.6 else dice.choice(ORDERS)
        found += _deed(dice, kind, round(min(at, lasts - 1.0), 3), machines, people)
    return tuple(sorted(found, key=lambda deed: deed.at))


def _deed(dice: Random, kind: str, at: float, machines: Sequence[str], people: Sequence[str]) -> list[Deed]:
    agent, until = dice.choice(machines), round(at + dice.choice((1.0, 4.0, 9.0, 20.0, 35.0, 60.0)), 3)
    target = dice.choice((agent, agent, f"#{dice.randrange(20)}", f"#{dice.randrange(20)}", ""))
    match kind:
        case "wire":
            how = dice.choice(("drop", "duplicate", "reorder", "all"))
            return [Deed(at, "wire", agent, how, dice.choice((0.1, 0.3))), Deed(until + 20.0, "wire_off", agent)]
        case "wire_of_person":
            who, how = dice.choice(people), dice.choice(("drop", "duplicate", "reorder", "all"))
            return [Deed(at, "wire", who, how, 0.3), Deed(until + 20.0, "wire_off", who)]
        case "nan":
            return [Deed(at, "nan", agent, much=float(dice.randint(1, 6)))]
        case "slow":
            return [Deed(at, "slow", agent, much=dice.choice((0.3, 1.0, 2.5))), Deed(until, "slow_off", agent)]
        case "crash":
            return [Deed(at, "crash", agent), Deed(until, "rejoin", agent)]
        case "freeze":
            return [Deed(at, "freeze", agent), Deed(until, "thaw", agent)]
        case "cut_off":
            return [Deed(at, "cut_off", agent), Deed(until, "join", agent)]
        case "silent":
            who = dice.choice(people)
            word, end = dice.choice((("freeze", "thaw"), ("crash", "rejoin")))
            return [Deed(at, word, who), Deed(until, end, who)]
        case "engine":
            again = tuple(dice.choice((1, 2, 3, 5, 9, 20, 60)) for _ in range(dice.choice((0, 0, 0, 1, 1, 2))))
            away = dice.choice((0.1, 1.0, 1.0, 3.0, 12.0, 28.0, 45.0, 150.0))
            return [Deed(at, "engine", "", dice.choice(("lost", "kept")), dice.randint(1, 40), again, away)]
        case "disk_full" | "disk_slow":
            return [Deed(at, kind), Deed(until, "disk_ok")]
        case "wall":
            return [Deed(at, "wall", much=dice.choice((-3600.0, -20.0, -0.5, 0.5, 20.0, 3600.0, 86400.0)))]
        case "pilot":
            back = dice.choice(("continue", "return", "end"))
            return [
                Deed(at, "pilot", agent), Deed(until, "pilot_off", agent), Deed(until + 1.0, "handback", agent, back),
            ]  # fmt: skip
        case "refuse" | "lose":
            return [Deed(at, kind, agent, much=float(dice.randint(1, 4)))]
        case "mute":
            return [Deed(at, "mute", agent), Deed(until, "unmute", agent)]
        case "battery":
            return [Deed(at, "battery", agent, much=dice.choice((34.0, 27.0, 20.0)))]
        case "stop":
            stop = dice.choice(("hold", "return", "land", "cut") if dice.random() < 0.2 else ("hold", "return", "land"))
            deeds = [Deed(at, "order", target, stop)]
            return [*deeds, Deed(until, "order", target, "continue")] if dice.random() < 0.6 else deeds
        case "continue" | "restart":
            return [Deed(at, "order", target, kind)]
        case "lockdown":
            hows = ("hold", "return", "land")
            return [Deed(at, "lockdown", "", dice.choice(hows)), Deed(until, "lockdown", "", "release")]
        case "abort":
            return [Deed(at, "abort", f"#{dice.randrange(20)}", dice.choice(("", "", "now", "abandon")))]
        case "event":
            pickers = [name for name in people if name.startswith("picker")]
            return [Deed(at, "event", dice.choice(pickers), "sos")]
        case _:
            return [Deed(at, kind, agent)]


KINDS: Final = frozenset({*FAULTS, *ORDERS})
