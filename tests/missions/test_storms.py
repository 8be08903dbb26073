"""Many faults at random times: whatever happens, tasks end, folds are equal, and no drone is left in the air unattended."""

import contextlib
import random
from collections.abc import Callable

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.transport.memory import Faults
from tests.missions.conftest import Fly
from tests.missions.test_shipped import SITE
from tests.shares import in_ci

DRONES = ("hwd_1", "hwd_2", "lwd_1", "lwd_2")
PEOPLE = ("picker_1", "picker_2", "watcher_1")
FIELDS = ("north_field", "east_field", "west_field", "south_field")


class Storm:
    """Does one thing after another to a rehearsal, then calms down."""

    def __init__(self, rehearsal: Rehearsal, seed: int) -> None:
        self.rehearsal = rehearsal
        self.dice = random.Random(seed)
        self.dead: set[str] = set()
        self.frozen: set[str] = set()
        self.piloted: set[str] = set()

    def act(self) -> None:
        sim, dice = self.rehearsal.sim, self.dice
        free = [a for a in (*DRONES, *PEOPLE) if a not in self.dead | self.frozen]
        match dice.choice(
            ["kill", "restart", "freeze", "thaw", "pilot", "back", "nan", "lose", "refuse", "abort", "submit"]
        ):
            case "kill" if free:
                self.dead.add(agent := dice.choice(free))
                sim.kill(agent)
            case "restart" if self.dead:
                self.dead.remove(agent := min(self.dead))
                sim.restart(agent)
            case "freeze" if free:
                self.frozen.add(agent := dice.choice(free))
                sim.freeze(agent)
            case "thaw" if self.frozen:
                self.frozen.remove(agent := min(self.frozen))
                sim.thaw(agent)
            case "pilot":
                self.piloted.add(agent := dice.choice(DRONES))
                sim.take_over(agent)
            case "back" if self.piloted:
                self.hand_back(min(self.piloted))
            case "nan" if free:
                sim.nan_status(dice.choice(free), dice.randint(1, 8))
            case "lose":
                sim.lose_next_result(dice.choice(DRONES))
            case "refuse":
                sim.refuse_next(dice.choice(DRONES), count=dice.randint(1, 2))
            case "abort":
                self.abort()
            case _:
                self.submit()

    def submit(self) -> None:
        if self.dice.random() < 0.3:
            self.rehearsal.submit("MoveTask", {"robot": AgentRef(self.dice.choice(DRONES))})
        else:
            where, who = SITE.places[self.dice.choice(FIELDS)], AgentRef(self.dice.choice(PEOPLE[:2]))
            self.rehearsal.submit("PickUp", {"target": where, "user": who})

    def abort(self) -> None:
        running = [t.id for t in self.rehearsal.engine.state.tasks.values() if t.section != "done"]
        if running:
            self.try_order(lambda: self.rehearsal.abort(self.dice.choice(running), how=self.dice.choice(["", "now"])))

    def end_what_waits(self) -> None:
        """Abort requests that no machine fits any more: they wait as long as it takes."""
        for task in list(self.rehearsal.engine.state.tasks.values()):
            if task.status == "PENDING":
                self.rehearsal.abort(task.id)

    def hand_back(self, agent: str) -> None:
        self.piloted.discard(agent)
        self.rehearsal.sim.hand_back(agent)
        self.rehearsal.run_for(1)
        self.try_order(lambda: self.rehearsal.ask(Operator("handback_end", agent)))

    @staticmethod
    def try_order(order: Callable[[], object]) -> None:
        with contextlib.suppress(TaskError):
            order()

    def calm(self) -> None:
        """Everybody is back, and people clear what is quarantined."""
        for agent in sorted(self.dead):
            self.rehearsal.sim.restart(agent)
        for agent in sorted(self.frozen):
            self.rehearsal.sim.thaw(agent)
        for agent in sorted(self.piloted):
            self.hand_back(agent)
        self.rehearsal.run_for(5)
        for agent in DRONES:
            self.rehearsal.sim[agent].front.refusals.clear()
            self.try_order(lambda a=agent: self.rehearsal.ask(Operator("handback_end", a)))


QUICK = (1, 10, 17, 145)
"""Seeds that found something once."""
EACH_RUN = (*QUICK, *range(2, 8))
SEEDS = [*EACH_RUN, *in_ci(seed for seed in range(25) if seed not in EACH_RUN)]


@pytest.mark.parametrize("seed", SEEDS)
def test_after_any_storm_everything_ends_and_nobody_is_left_in_the_air(fly: Fly, seed: int) -> None:
    rehearsal = fly()
    storm = Storm(rehearsal, seed)
    if seed % 2:
        for agent in DRONES:
            rehearsal.hub.set_faults(agent, Faults(drop=0.05, duplicate=0.1, reorder=0.1, jitter_us=20_000))
    storm.submit()
    for _ in range(12):
        rehearsal.run_for(storm.dice.uniform(1, 40))
        storm.act()

    storm.calm()

    if not rehearsal.run_until_ended(limit_s=3600):
        storm.end_what_waits()
    assert rehearsal.run_until_ended(limit_s=3600), [
        t for t in rehearsal.engine.state.tasks.values() if t.section != "done"
    ]
    for agent in DRONES:
        storm.try_order(lambda a=agent: rehearsal.ask(Operator("clear", a)))
    rehearsal.run_for(90)  # lost replies are asked for again, lies come to an end
    assert rehearsal.run_until_ended(limit_s=1800)
    rehearsal.run_for(5)
    for agent in DRONES:
        record = rehearsal.engine.state.agents[agent]
        low = (record.battery or 0.0) < 30.0
        assert record.landed == "grounded" or low, (agent, record)
        assert record.task == ""
