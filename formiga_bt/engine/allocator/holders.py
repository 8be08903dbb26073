"""The jobs of the safe order, made from the state: who holds machines and resources, and what each may still ask for.

A block with resources is a job: it needs what blocks inside it may ask for, and the ways home of the machines of its task,
should that end there. A task with machines is a job that ends after its blocks and the tasks that it requested; it needs what
any of its steps may ask for. Tasks that hold nothing, and those that ask for nothing further, are in nobody's way. Machines on
routes (`drives`) are jobs, too: blocks and tasks end after the drives of their machines.
"""

from collections.abc import Iterable, Mapping

from msgspec.structs import replace

from formiga_bt.base.geo import Place, way_enters
from formiga_bt.engine.allocator.demand import Demand, demand_of
from formiga_bt.engine.allocator.drives import Drives, Moved
from formiga_bt.engine.allocator.safe_order import FULLY, Job, can_end, left_waiting
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, AgentRequest, TaskRecord
from formiga_bt.lang.model import Port, Station, WithResource
from formiga_bt.lang.places import steps_around

Roles = Mapping[str, tuple[str, ...]]


class Holders:
    """Says of grants whether they keep somebody from ever ending. Reads the core; keeps only what models ask for."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._drives = Drives(core)
        self._demands: dict[tuple[str, str], Demand] = {}
        self._some_ask = False
        """A task was granted in this process, or before it, that asks for something while it holds something."""
        self._looked = False

    # -- grants --------------------------------------------------------------------------------------------------------
    def held_up_by_units(self, request: AgentRequest) -> str:
        """Return the task that could end no more if a block got its resources, or ""."""
        before = self._jobs({})
        task = self._core.task(request.holder)
        claimed = self._block(task, request.node, request.units)
        after = [self._behind(job, task.id, request.node) for job in before if job.id != task.id]
        after.append(claimed)
        roots = [job for job in before if job.id == task.id] or [self._root(task, (), {})]
        after += [Job(job.id, job.task, job.holds, job.needs, (*job.after, claimed.id)) for job in roots]
        if not any(job.id == task.id for job in before):
            before = [*before, *roots]
        free = self._free(before, {})
        then = {key: have - request.units.get(key, 0) for key, have in free.items()}
        return left_waiting(before, after, free, then, self._core.route_graph)

    def held_up_by_way(self, agent: AgentRecord, node: str, to: str) -> str:
        """Return the machine or task that could end no more if a machine drove on, or "".

        Args:
            agent: the machine.
            node: the next node of its way.
            to: where its way ends.
        """
        known = None if self._some_hold() else self._drives.held_up_by_way(agent, node, to)
        if known is not None:
            return known
        if self._drives.leaves_at_once(agent, node, to):
            return ""
        moved = agent.id, node, to
        after, before = self._with_drives(moved), self._with_drives(None)
        free, then = self._free(before, {}), self._free(after, {}, moved)
        return left_waiting(before, after, free, then, self._core.route_graph)

    def is_stuck(self, agent: AgentRecord) -> bool:
        """Return whether a machine on the routes could not come to where it is to go, however the others drive on."""
        jobs = self._with_drives(None)
        can = can_end(jobs, self._free(jobs, {}), self._core.route_graph)
        mine = self._drives.job_id(agent.id)
        return any(job.id == mine and not job.may_stay for job in jobs) and can.get(mine) != FULLY

    def _with_drives(self, moved: Moved | None) -> list[Job]:
        """Return the jobs that a drive depends on: those of tasks only if any holds a resource."""
        return self._jobs({}, moved) if self._some_hold() else self._drives.jobs(moved)

    def _some_hold(self) -> bool:
        """Return whether any task holds a resource."""
        tasks = self._core.state.tasks
        return bool(self._core.site.resources) and any(tasks[one].resources.claims for one in self._core.open)

    def held_up_by_machines(
        self, requests: Mapping[str, AgentRequest], grants: Iterable[tuple[str, Roles]]
    ) -> tuple[str, str] | None:
        """Return the request of the first of some grants after which a task could end no more, and that task; or None."""
        core = self._core
        grants = list(grants)
        new = [core.task(requests[request_id].holder) for request_id, _ in grants]
        if not self._some_ask:  # of those granted before, each was looked at then; after a start once
            self._some_ask = sum(map(self._asks, new if self._looked else [*self._open(), *new])) > 0
            self._looked = True
        if not self._some_ask:
            return None  # nobody ever holds anything while it waits: most sites
        given: dict[str, str] = {}
        for request_id, roles in grants:
            holder = requests[request_id].holder
            before = self._jobs(given)
            more = {a: holder for group in roles.values() for a in group if not core.state.agents[a].human}
            after = self._jobs({**given, **more})
            keys = [*before, *after]
            free, then = self._free(keys, given), self._free(keys, {**given, **more})
            waits = left_waiting(before, after, free, then, core.route_graph)
            if waits:
                return request_id, waits
            given |= more
        return None

    # -- jobs ----------------------------------------------------------------------------------------------------------
    def _open(self) -> list[TaskRecord]:
        tasks = self._core.state.tasks
        return [tasks[task] for task in self._core.open if tasks[task].section not in ("", "done")]

    def _asks(self, task: TaskRecord) -> bool:
        return bool(self._demand_of(task)) or bool(task.resources.claims)

    def _jobs(self, given: Mapping[str, str], moved: Moved | None = None) -> list[Job]:
        """Return who holds something; `given`: machines that are about to be a task's, `moved`: one that is to drive on."""
        for task in self._open():
            self._demand_of(task)  # so that every pool that anybody asks for is known
        core = self._core
        agents = core.state.agents.values()
        machines: dict[str, list[AgentRecord]] = {}
        for agent in agents:
            of = given.get(agent.id) or agent.task
            if of and not agent.human and not agent.shared:
                machines.setdefault(of, []).append(agent)
        found: list[Job] = []
        for task in [self._core.state.tasks[one] for one in self._core.open]:
            mine = machines.get(task.id, [])
            if not mine and not task.resources.claims:
                continue
            blocks = self._blocks(task)
            found += blocks
            found.append(self._root(task, mine, {one.id: None for one in blocks}))
        drives = self._drives.jobs(moved)
        if not drives:
            return found
        first: dict[str, list[str]] = {}
        for job in drives:
            if not job.may_stay:
                first.setdefault(core.state.agents[job.task].task, []).append(job.id)
        found = [replace(job, after=(*job.after, *first.get(job.task, ()))) for job in found]
        return [*drives, *found]

    def _blocks(self, task: TaskRecord) -> list[Job]:
        claims = task.resources.claims
        jobs = [self._block(task, node, claim.units) for node, claim in claims.items() if not claim.left]
        return [
            Job(job.id, job.task, job.holds, job.needs, tuple(o.id for o in jobs if o.id.startswith(f"{job.id}.")))
            for job in jobs
        ]

    def _block(self, task: TaskRecord, node: str, units: Mapping[str, int]) -> Job:
        model = self._core.library.of(task)
        around = steps_around(model, node) if model is not None else ()
        step = around[-1] if around else None
        needs = dict(demand_of(step.steps, self._core.catalogue.types)) if isinstance(step, WithResource) else {}
        held = task.resources.units
        for name, one in self._ways_home(task).items():
            if name not in held and name not in units:
                needs[name] = max(needs.get(name, 0), one)
        return Job(f"{task.id}|{node}", task.id, dict(units), needs)

    def _behind(self, job: Job, task_id: str, node: str) -> Job:
        """Return a job as it is once a block inside it is one, too."""
        inner = f"{task_id}|{node}"
        return (
            Job(job.id, job.task, job.holds, job.needs, (*job.after, inner)) if inner.startswith(f"{job.id}.") else job
        )

    def _root(self, task: TaskRecord, mine: Iterable[AgentRecord], blocks: Mapping[str, None]) -> Job:
        machines = list(mine)
        holds: dict[str, int] = {f"@{agent.id}": 1 for agent in machines}
        left = [claim for claim in task.resources.claims.values() if claim.left]
        for claim in left:
            for name, one in claim.units.items():
                holds[name] = holds.get(name, 0) + one
        units = task.resources.units
        for agent in machines:
            for name in agent.inside:
                if name not in units:
                    holds[name] = holds.get(name, 0) + 1
        needs = dict(self._demand_of(task))
        own = self._of_its_own(task)
        for pool in [key for key in needs if key.startswith("@")]:  # what its blocks have, they need not ask for
            have = sum(self._is_of(agent, pool) for agent in machines if own is not None and agent.id not in own)
            needs[pool] = max(0, needs[pool] - have)
        for name, one in self._ways_home(task).items():
            if name not in holds:
                needs[name] = max(needs.get(name, 0), one)
        children = [child for child in task.family.children if child in self._core.open]
        return Job(task.id, task.id, self._pooled(machines, holds), needs, (*blocks, *children))

    def _of_its_own(self, task: TaskRecord) -> frozenset[str] | None:
        """Return the machines that a task has for all its steps, not for a block; None: all that it gets now."""
        model = self._core.library.of(task)
        if model is None or task.section == "":
            return None
        return frozenset(a for role, agents in task.agents.roles.items() if role in model.roles for a in agents)

    def _pooled(self, machines: Iterable[AgentRecord], holds: Mapping[str, int]) -> dict[str, int]:
        """Return what a task holds, its machines counted in every pool that anybody asks."""
        found = {key: units for key, units in holds.items() if not key.startswith("@")}
        for pool in dict.fromkeys(key for one in self._demands.values() for key in one if key.startswith("@")):
            count = sum(self._is_of(agent, pool) for agent in machines)
            if count:
                found[pool] = count
        return found

    def _is_of(self, agent: AgentRecord, pool: str) -> bool:
        return agent.type in pool[1:].split("|")

    def _demand_of(self, task: TaskRecord) -> Demand:
        model = self._core.library.of(task)
        if model is None or task.section not in ("", "steps") or task.outcome.status:
            return {}
        return self._demand(model.bundle, model.name, model.steps)

    def _demand(self, bundle: str, name: str, steps: tuple) -> Demand:  # type: ignore[type-arg]
        key = (bundle, name)
        if key not in self._demands:
            self._demands[key] = demand_of(steps, self._core.catalogue.types)
        return self._demands[key]

    def _ways_home(self, task: TaskRecord) -> Demand:
        """Return the resources on the straight ways home of a task's machines, which they need if it ends now."""
        core, found = self._core, Demand()
        homes: dict[str, Port | Station] = {**core.site.ports, **core.site.stations}
        for agent in core.state.agents.values():
            home = homes.get(agent.home)
            if agent.task != task.id or agent.human or agent.position is None or home is None:
                continue
            for name, resource in core.site.resources.items():
                if resource.region is not None and name not in agent.inside:
                    at: Place = home.at
                    if way_enters(agent.position, at, resource.region):
                        found[name] = 1
        return found

    # -- what is free --------------------------------------------------------------------------------------------------
    def _free(self, jobs: Iterable[Job], given: Mapping[str, str], moved: Moved | None = None) -> dict[str, int]:
        core = self._core
        free = {name: resource.capacity for name, resource in core.site.resources.items()}
        for task in [core.state.tasks[one] for one in core.open]:
            for name, units in task.resources.units.items():
                free[name] = free.get(name, 0) - units
        for agent in core.state.agents.values():
            owner = core.state.tasks.get(agent.task)
            for name in agent.inside:
                if owner is None or name not in owner.resources.units:
                    free[name] = free.get(name, 0) - 1
        self._drives.take(free, moved)
        pools = dict.fromkeys(key for job in jobs for key in job.needs if key.startswith("@"))
        for pool in pools:
            free[pool] = sum(
                not (given.get(agent.id) or agent.task)
                and not agent.human
                and agent.pool != "QUARANTINED"
                and agent.liveness != "LOST"
                and self._is_of(agent, pool)
                for agent in core.state.agents.values()
            )
        return free
