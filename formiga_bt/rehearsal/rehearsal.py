"""A whole site in this process on the virtual clock: the production engine, simulated agents, the memory wire, a referee.

Called by `formiga dryrun`, by tests and by whoever wants to know what a tree would do before a person approves it.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from msgspec.structs import replace

from agents_sim.referee import Referee
from agents_sim.world import STATUS_EVERY_US, AgentSpec, SimFleet
from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, Submit
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.replies import Accepted, Done, granted
from formiga_bt.engine.tasks.requests import WAIT_US
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreesFactory
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.scenario.entries import START
from formiga_bt.lang.site.standing import beginnings, chargers
from formiga_bt.rehearsal.bodies import kind_of
from formiga_bt.transport.memory import MemoryHub


def patience(task: Task) -> Micros | None:
    """Return how long a task that is alone on its site is let wait for agents; None: as its roles say.

    Who it does not get in that time does not become free by itself: a rehearsal then says so, where a running engine waits on.
    """
    return None if any(role.wait is not None for role in task.roles.values()) else WAIT_US


class Rehearsal:
    """One engine and its simulated fleet.

    Args:
        site: where.
        catalogue: agent types and actions.
        tasks: the checked tasks that may be submitted.
        specs: the agents; `fleet_of` makes them from a site.
        seed: of the wire's faults.
        trees: as `Engine`.
        start: engine time at the start.
        status_every_us: how often each agent publishes its status besides changes.
        keep_steps: whether `steps` holds all that the engine did; a long run of many agents has many of them.
    """

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        tasks: Iterable[Task],
        specs: Sequence[AgentSpec],
        *,
        seed: int = 0,
        trees: TreesFactory = CompiledTrees,
        start: Micros = START,
        status_every_us: Micros = STATUS_EVERY_US,
        keep_steps: bool = True,
    ) -> None:
        self.scheduler = VirtualScheduler(start)
        self.hub = MemoryHub(self.scheduler, seed=seed)
        self.referee = Referee()
        self.sim = SimFleet(self.scheduler, self.hub, recorder=self.referee, status_every_us=status_every_us)
        self.engine = Engine(site, catalogue, {task.name: task for task in tasks}, trees=trees)
        self.steps: list[EngineStep] = []
        listeners = [self.steps.append] if keep_steps else []
        self.driver = VirtualDriver(self.engine, [self.hub.transport], self.scheduler, listeners=listeners)
        self.driver.start()
        for spec in specs:
            self.sim.add(spec)

    @property
    def now(self) -> Micros:
        """Return the engine time."""
        return self.scheduler.now()

    def submit(self, task: str, params: Mapping[str, Any] | None = None, **options: Any) -> str:
        """Submit a task; return its id.

        Raises:
            TaskError: the engine refused it.
        """
        reply = self.ask(Submit(task, dict(params or {}), **options))
        assert isinstance(reply, Accepted)
        return reply.task

    def abort(self, task_id: str, **options: Any) -> None:
        """Abort a task."""
        self.ask(Abort(task_id, **options))

    def ask(self, given: Any) -> Accepted | Done:
        """Give an input of a person and return the reply.

        Raises:
            TaskError: the engine refused it.
        """
        reply = self.driver.feed(given).reply
        self.driver.drain()
        return granted(reply)

    def task(self, task_id: str) -> TaskRecord:
        """Return a task's record."""
        return self.engine.state.tasks[task_id]

    def ended(self, *task_ids: str) -> bool:
        """Return whether these tasks (all, if none is named) have ended."""
        still_open = self.engine.core.open
        return not any(t in still_open for t in task_ids) if task_ids else not still_open

    def run_for(self, seconds: float) -> None:
        """Let so much engine time pass."""
        limit = self.now + round(seconds * SECOND)
        self.driver.run_until(lambda: False, limit)
        self.scheduler.advance_to(limit)

    def run_until_ended(self, *task_ids: str, limit_s: float = 7200.0) -> bool:
        """Run until these tasks (all, if none is named) have ended; return whether they did in time."""
        return self.driver.run_until(lambda: self.ended(*task_ids), self.now + round(limit_s * SECOND))

    def run_until(self, done: Any, limit_s: float = 7200.0) -> bool:
        """Run until `done()`; return whether it came true in time."""
        return self.driver.run_until(done, self.now + round(limit_s * SECOND))

    def close(self) -> None:
        """Stop the simulated fleet."""
        self.sim.close()
        self.driver.close()


def simulated(site: Site) -> Site:
    """Return a site as its simulations see it: as it is, but nothing must be approved and no pilot be on duty."""
    return replace(site, mode="simulation")


def fleet_of(
    site: Site, catalogue: Catalogue, *, scripts: Mapping[str, Sequence[Mapping[str, Any]]] | None = None
) -> list[AgentSpec]:
    """Return the agents that a site lists, as simulated ones (`lang.site.standing` says where they begin).

    Args:
        site: the site.
        catalogue: says what each can do.
        scripts: answers of people by id; without one, a person answers the first option after some seconds.
    """
    return [
        AgentSpec(
            id=name,
            type=(of := site.agents[name].type),
            at=begins.at,
            home=begins.home,
            chargers=chargers(site, catalogue.types[of]),
            script=(scripts or {}).get(name, ()),
            does=kind_of(catalogue, of),
        )
        for name, begins in beginnings(site, catalogue).items()
    ]
