"""WatchDogRequest judged by where the picker is: random pickers, weather and troubles, one flight a seed.

python -m tests.missions.guiding --seeds 0-100       many seeds: how they ended, and how far from the base the pickers stood
python -m tests.missions.guiding --seed 17           one of them

A flight is right if its picker stands within 20 m of the base 5 min after the task's end, or if the task did not succeed: then
it must have a reason code and have raised an alarm.
"""

import argparse
import contextlib
import math
import random
import sys
from collections import Counter
from statistics import median
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.kernel.inputs import NotifyPeople, Operator, SendGoal
from formiga_bt.lang.model import Site
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, check_rehearsal, effects, packaged_task, packaged_world

RANGE_M: Final = 20.0
LIMIT_S: Final = 3.5 * 3600.0
STAYS_S: Final = 300.0
"""So long after its end the picker is looked at: nobody must lead them away again."""
PICKER: Final = "picker_2"
TROUBLES: Final = ("none", "none", "none", "low", "killed", "silent", "pilot", "phone", "busy")


class Guided(Struct, frozen=True, kw_only=True):
    """How one flight ended."""

    seed: int
    trouble: str
    status: str
    code: str
    began_m: float
    """From the base to where the picker was lost."""
    ended_m: float
    """From the base to where they stand at the end."""
    took_s: float
    alarms: int
    drones: int
    """How many flew for it."""

    @property
    def came_home(self) -> bool:
        """Return whether the picker stands near the base."""
        return self.ended_m <= RANGE_M

    @property
    def is_right(self) -> bool:
        """Return whether they do, or the task says why not."""
        return self.came_home if self.status == "SUCCEEDED" else bool(self.code) and self.alarms > 0

    def line(self) -> str:
        """Return it for people."""
        end = f"{self.status} {self.code}".strip()
        return (
            f"seed {self.seed:3} {self.trouble:6} {end}: {self.began_m:.0f} m -> {self.ended_m:.1f} m from the base "
            f"in {self.took_s:.0f} s, {self.drones} drones, {self.alarms} alarms" + ("" if self.is_right else "  WRONG")
        )


def guided(seed: int) -> Guided:
    """Fly one seed on the demo's site."""
    draw = random.Random(seed)
    site, catalogue = packaged_world()
    start = _around(draw, Place(0.0, 0.0), draw.uniform(60.0, 520.0))
    alarm = _around(draw, start, draw.uniform(0.0, 120.0))
    trouble = draw.choice(TROUBLES)
    changes: dict[str, dict[str, Any]] = {
        PICKER: {
            "at": start,
            "walk": [_around(draw, start, 150.0)] if draw.random() < 0.5 else [],
            "limits": {
                "walk_m_s": draw.uniform(0.6, 1.8), "reaction_s": draw.uniform(0.0, 12.0), "sight_m": draw.uniform(30.0, 80.0),
                "fix_error_m": draw.uniform(3.0, 60.0),
            },
        }
    }  # fmt: skip
    wind = (draw.uniform(-5.0, 5.0), draw.uniform(-5.0, 5.0))
    for drone in ("hwd_1", "hwd_2"):
        changes[drone] = {"wind": wind, "battery": draw.uniform(42.0, 55.0) if trouble == "low" else 100.0}
    specs = [replace(spec, **changes.get(spec.id, {})) for spec in fleet_of(site, catalogue)]
    tasks = [packaged_task(name) for name in ("watch_dog_request", "pick_up", "explore_region", "move_task")]
    run = Rehearsal(site, catalogue, tasks, specs, seed=seed)
    run.run_for(1.0)
    try:
        return _flown(run, site, draw, seed, trouble, start, alarm)
    finally:
        run.close()


def _flown(
    run: Rehearsal, site: Site, draw: random.Random, seed: int, trouble: str, start: Place, alarm: Place
) -> Guided:
    if trouble == "busy":
        run.submit("PickUp", {"target": site.places["north_field"], "user": AgentRef("picker_1")})
        run.submit("ExploreRegion", {"region": site.regions["bog"]})
    began = run.now
    params = {"alarmtype": "lost", "target": alarm, "username": AgentRef(PICKER)}
    task = run.submit("WatchDogRequest", params)
    _happens(run, draw, trouble, task)
    _watch_over(run, seed, task)
    took_s = (run.now - began) / SECOND
    run.run_for(STAYS_S)
    assert run.run_until_ended(limit_s=LIMIT_S), f"seed {seed}: the others go on and on"
    check_rehearsal(run)
    record = run.task(task)
    base = Place(0.0, 0.0)
    flown = {goal.agent for goal in effects(run, SendGoal) if (goal.task, goal.action) == (task, "TakeOff")}
    return Guided(
        seed=seed, trouble=trouble, status=record.status, code=record.outcome.code, took_s=took_s,
        began_m=horizontal_m(start, base), ended_m=horizontal_m(run.sim[PICKER].person.position(), base),
        alarms=len(_alarms(run, task)), drones=len(flown),
    )  # fmt: skip


def _watch_over(run: Rehearsal, seed: int, task: str) -> None:
    """Run a task to its end; each minute a person hands back who was taken over."""
    end = run.now + round(LIMIT_S * SECOND)
    while not run.run_until_ended(task, limit_s=60.0):
        assert run.now < end, f"seed {seed}: {task} goes on and on"
        for agent in run.engine.state.agents.values():
            if agent.taken and agent.control == "engine":
                with contextlib.suppress(TaskError):  # its task had ended before
                    run.ask(Operator("handback_continue", agent.id, "ann"))


def _alarms(run: Rehearsal, task: str) -> list[str]:
    """Return what people were notified of as alarms: by the task, and by the engine."""
    notices = [one.text for one in effects(run, NotifyPeople) if one.task == task and one.severity == "alarm"]
    return notices + alarms(run)


def _happens(run: Rehearsal, draw: random.Random, trouble: str, task: str) -> None:
    """Let time pass until a trouble came, and went again."""
    if trouble in ("none", "low", "busy"):
        return
    run.run_for(draw.uniform(60.0, 240.0))
    drone = next((a for a in run.task(task).agents.granted if a.startswith("hwd")), "")
    match trouble:
        case "killed" if drone:
            run.sim.kill(drone)
            run.run_for(draw.uniform(5.0, 120.0))
            run.sim.restart(drone)
        case "silent" if drone:
            run.sim.lose_link(drone)
            run.run_for(draw.uniform(5.0, 120.0))
            run.sim.mend_link(drone)
        case "pilot" if drone:
            run.sim.take_over(drone)
            run.run_for(60.0)
            run.sim.hand_back(drone)
        case "phone":
            run.sim.kill(PICKER)
            run.run_for(draw.uniform(5.0, 120.0))
            run.sim.restart(PICKER)


def _around(draw: random.Random, at: Place, away_m: float) -> Place:
    angle = draw.uniform(0.0, math.tau)
    east, north = at.east_m + away_m * math.cos(angle), at.north_m + away_m * math.sin(angle)
    return Place(round(max(-580.0, min(580.0, east)), 3), round(max(-580.0, min(580.0, north)), 3))


def main() -> int:
    """Play what the command line says; 1 if a flight is not right."""
    parser = argparse.ArgumentParser(description="WatchDogRequest, judged by where the picker is.")
    parser.add_argument("--seed", type=int, help="play this one")
    parser.add_argument("--seeds", default="0-100", help="play these, first-last (last excluded)")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last)) if options.seed is None else range(options.seed, options.seed + 1)
    found = []
    for seed in seeds:
        found.append(guided(seed))
        print(found[-1].line(), flush=True)
    home = [one for one in found if one.came_home]
    ends = Counter(one.code or "succeeded" for one in found)
    print(f"{len(found)} flights: {len(home)} pickers within {RANGE_M:.0f} m of the base, {dict(ends)}", end="")
    print(
        f"; at most {max((one.ended_m for one in home), default=0.0):.1f} m off, median {median(o.took_s for o in found):.0f} s"
    )
    return int(not all(one.is_right for one in found))


if __name__ == "__main__":
    sys.exit(main())
