"""Preemption: whom a HIGH request asks to step aside, and who may be asked at all.

It asks for what it needs, where it gets no agents; and beyond that for roles of no fixed number that say `preempt`: then it is
not served with those that are free, but waits for all that it can have.

A task may be ended to begin anew only while nothing is lost by it: in its steps, not held by a person, with no load on its
machines, no action sent that may not be repeated, no `critical` step running. `if_lost: rebind` asks the same.

`allocation` makes a `Preemption` at each look, after the policy's decision. It keeps nothing: who steps aside already is read
from the state each time, so a machine that is lost on its way home is replaced, and nobody is asked twice for the same slot.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import chain, combinations
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.filters import refusal
from formiga_bt.engine.allocator.policy import Decision
from formiga_bt.engine.kernel.causes import ClearanceHold, kind_and_agent
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import PRIORITIES, AgentRecord, AgentRequest, RoleRequest, TaskRecord, Verdict
from formiga_bt.lang.places import steps_around

MOST_SETS: Final = 1000
"""So many sets of tasks are compared for the smallest; beyond that one is taken from which none can be left out."""

Slots = Sequence[RoleRequest]
"""A role of machines as often as it has places."""

Team = Callable[[Sequence[str]], list[str] | None]
"""The agents that fill all slots if these tasks step aside, or None."""


class PreemptionPlan(Struct, frozen=True):
    """How a HIGH request gets its agents: from whom, and on their way already from whom."""

    request: str
    victims: tuple[str, ...]
    """Tasks to be preempted now."""
    awaited: dict[str, int]
    """Tasks that step aside for it, the victims among them -> the run that they end."""
    agents: frozenset[str]
    """The machines that it will have."""
    counts: dict[str, int]
    """Roles that get more than they need -> how many."""


# -- who may be asked --------------------------------------------------------------------------------------------------
def why_not_preemptible(core: Core, task: TaskRecord) -> str:
    """Return why a task may not be restarted now, or "" if it may.

    One of: `ending` (its steps are over or being stopped, or have not begun), `not_preemptible` (its file says so, or is of
    high priority), `held`, `ordered` (an order stands on a machine of it), `spent` (an action that may not be repeated was
    sent), `loaded`, `critical`.
    """
    return _why_not(core, task, "")


def may_rebind(core: Core, task: TaskRecord, agent_id: str) -> bool:
    """Return whether a task that loses an agent begins anew with another one, instead of its step failing.

    Call it when the agent is lost or quarantined, while it still stands in the task's roles and before the trees run on.
    """
    model = core.library.of(task)
    if model is None:
        return False
    roles = [name for name, agents in task.agents.roles.items() if agent_id in agents]
    rebinds = any(name in model.roles and model.roles[name].if_lost == "rebind" for name in roles)
    rebinds = rebinds or (bool(roles) and agent_id in task.agents.rebinds)
    return rebinds and not _why_not(core, task, agent_id)


def _why_not(core: Core, task: TaskRecord, lost: str) -> str:
    model = core.library.of(task)
    if (
        task.section != "steps"
        or task.status != "ACTIVE"
        or task.ending.stopping
        or task.outcome.status
        or task.restart.why
    ):
        return "ending"
    if model is None or task.system.agent or not model.preemptible:
        return "not_preemptible"
    others = [cause for cause in task.hold.causes if not lost or kind_and_agent(cause)[1] != lost]
    if any(not isinstance(cause, ClearanceHold) for cause in others):
        return "held"
    agents = [core.state.agents[agent_id] for agent_id in task.agents.granted]
    mine = [a for a in agents if not a.shared and (a.task == task.id or a.id == lost)]
    if any(a.id in core.state.orders for a in mine if a.id != lost):
        return "ordered"
    return _what_is_lost(core, task, mine)


def what_is_lost(core: Core, task: TaskRecord) -> str:
    """Return what would be lost if a task in its steps began anew: `spent`, `loaded` or `critical`, as above; "" = nothing."""
    machines = [core.state.agents[agent_id] for agent_id in task.agents.granted]
    return _what_is_lost(core, task, [a for a in machines if not a.shared and a.task == task.id])


def _what_is_lost(core: Core, task: TaskRecord, machines: Sequence[AgentRecord]) -> str:
    if task.restart.spent or any(core.state.tasks[child].restart.spent for child in task.family.children):
        return "spent"
    if any(a.payload_kg > 0 for a in machines):
        return "loaded"
    model, running = core.library.of(task), core.state.memory.get(task.id, {})
    critical = model is not None and any(step.critical for key in running for step in steps_around(model, key))
    return "critical" if critical else ""


# -- whom to ask -------------------------------------------------------------------------------------------------------
class Preemption:
    """One look at the HIGH requests that got nothing, or not all: who is coming home, who may be preempted, who is asked.

    Args:
        core: the engine's core; only read.
        requests: all that wait, in order of service.
        decision: what the policy made of them.
        agents: all agents.
        room: how many machines a request may have at most; None = as many as there are.
    """

    def __init__(
        self, core: Core, requests: Sequence[AgentRequest], decision: Decision, agents: Sequence[Candidate],
        room: Callable[[AgentRequest], int | None],
    ) -> None:  # fmt: skip
        self._core, self._room = core, room
        granted = {grant.task: grant for grant in decision.grants}
        urgent = [request for request in requests if request.priority == "high"]
        self._waiting = {request.task for request in urgent if request.task not in granted}
        self.plans: dict[str, PreemptionPlan] = {}
        """A plan for each that could have more if others step aside, in order of service."""
        asking = [r for r in urgent if r.task in self._waiting or any(role.more and role.preempt for role in r.roles)]
        if not asking:
            return
        machines = [a for a in agents if not a.shared and a.task in core.state.tasks]
        tasks = {a.task: core.state.tasks[a.task] for a in machines}
        ending = {t.id for t in tasks.values() if t.restart.why or _steps_aside(t) or t.section == "recover"}
        self._why_not = {
            t.id: why_not_preemptible(core, t) for t in tasks.values() if PRIORITIES[t.request.priority] > 0
        }
        willing = [t for t in tasks.values() if self._why_not.get(t.id) == ""]
        willing.sort(key=lambda t: (-PRIORITIES[t.request.priority], -t.order))
        self._home = {a.id: _at_home(core, a, leaving=a.task in ending) for a in machines}
        self._coming = [a.id for a in machines if a.task in ending]
        self._held = {t.id: [a.id for a in machines if a.task == t.id] for t in willing}
        given = {r.task: set().union(*granted[r.task].roles.values()) for r in urgent if r.task in granted}
        claimed: set[str] = set().union(*given.values())
        for request in asking:
            others = claimed - given.get(request.task, set())
            plan = self._plan(request, decision.verdicts.get(request.task, ()), others)
            if plan is not None:
                self.plans[request.task] = plan
                self._waiting.add(request.task)
                claimed |= plan.agents

    def kept(self, request: AgentRequest) -> AgentRequest:
        """Return a request as the policy sees it while others step aside for it: what fits already goes to nobody else."""
        plan = self.plans.get(request.task)
        if plan is None:
            return request
        counts = plan.counts
        roles = [replace(r, count=counts[r.role], more=0) if r.role in counts else r for r in request.roles]
        return replace(request, reserves=True, roles=tuple(roles))

    def told(self, request: AgentRequest, verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
        """Return the verdicts of a request, with what preemption makes of the busy ones."""
        if request.task not in self._waiting:
            return verdicts
        plan = self.plans.get(request.task)

        def tell(verdict: Verdict) -> Verdict:
            task = self._core.state.tasks.get(verdict.detail) if verdict.code == "busy" else None
            if task is None or self._core.state.agents[verdict.agent].task != task.id:
                return verdict
            if plan is not None and verdict.agent in plan.agents and task.id in plan.awaited:
                return replace(verdict, code="preempting")
            code = self._why_not.get(task.id, "")
            return replace(verdict, code="kept", why=code) if code not in ("", "ending") else verdict

        return tuple(tell(verdict) for verdict in verdicts)

    def _plan(self, request: AgentRequest, verdicts: Sequence[Verdict], claimed: set[str]) -> PreemptionPlan | None:
        """Return how the request gets all its agents, or None if it cannot, or need not wait for anybody to step aside."""
        fits = {(v.role, v.agent) for v in verdicts if v.code in ("fits", "chosen")}
        for role in request.roles:
            if role.shared and sum(name == role.role for name, _ in fits) < role.count:
                return None
        free = [v.agent for v in verdicts if (v.role, v.agent) in fits and v.agent not in claimed]
        ready = [*dict.fromkeys(free), *(a for a in self._coming if a not in claimed)]
        fits |= {
            (role.role, agent_id)
            for role in request.roles
            if not role.shared and role.preempt is not False
            for agent_id, home in self._home.items()
            if home is not None and refusal(home, role) is None
        }
        held = self._useful(fits, claimed, parents_of(self._core, request.holder))
        slots = _slots(request, fits, [*ready, *chain(*held.values())], self._room(request))
        if slots is None:
            return None
        victims, team = _victims(slots, fits, ready, held)
        tasks = self._core.state.tasks
        owners = [tasks[self._core.state.agents[agent_id].task] for agent_id in team if agent_id in self._home]
        awaited = {t.id: t.run for t in owners if _steps_aside(t) or t.id in victims}
        places = Counter(role.role for role in slots)
        counts = {role.role: places[role.role] for role in request.roles if places[role.role] > role.count}
        return PreemptionPlan(request.task, victims, awaited, frozenset(team), counts) if awaited else None

    def _useful(self, fits: set[tuple[str, str]], claimed: set[str], spared: frozenset[str]) -> dict[str, list[str]]:
        """Return the tasks that may be asked, with the agents of each that would help."""
        fit = {agent for _, agent in fits} - claimed
        found = {task: [a for a in agents if a in fit] for task, agents in self._held.items() if task not in spared}
        return {task: agents for task, agents in found.items() if agents}


def _slots(request: AgentRequest, fits: set[tuple[str, str]], agents: Sequence[str], room: int | None) -> Slots | None:
    """Return each role of machines as often as these agents can fill it: as it needs, and beyond that where it preempts.

    Args:
        request: whose roles they are.
        fits: (role, agent) of every agent that fits a role.
        agents: who may fill them.
        room: how many machines there may be at most; None = as many as there are.

    Returns:
        None if they cannot even fill what it needs.
    """
    roles = [role for role in request.roles if not role.shared]
    needs = [role for role in roles for _ in range(role.count)]
    able = Counter(role for role, _ in fits)
    beyond = [role for role in roles if role.preempt for _ in range(min(role.more, able[role.role]))]
    found = _fill(needs, beyond, fits, agents)
    if found is None:
        return None
    more = [beyond[slot - len(needs)] for slot in sorted(found) if slot >= len(needs)]
    return [*needs, *(more if room is None else more[: max(0, room - len(needs))])]


def _victims(
    slots: Slots, fits: set[tuple[str, str]], ready: Sequence[str], held: Mapping[str, Sequence[str]]
) -> tuple[tuple[str, ...], list[str]]:
    """Return the fewest, lowest, youngest tasks that must step aside, and the agents that fill the slots then.

    All of them together can fill the slots.
    """

    def team(tasks: Sequence[str]) -> list[str] | None:
        return match(slots, fits, [*ready, *(a for task in tasks for a in held[task])])

    everybody, found = tuple(held), team(())
    if found is not None:
        return (), found
    helped, fewest = len(ready), 0
    for size in sorted(map(len, held.values()), reverse=True):  # fewer tasks than that have not machines enough
        if helped < len(slots):
            helped, fewest = helped + size, fewest + 1
    tried = 0
    for number in range(max(1, fewest), len(slots) + 1):
        for some in combinations(everybody, number):
            found = team(some)
            if found is not None:
                return some, found
            tried += 1
            if tried >= MOST_SETS:
                return _pruned(everybody, team)
    raise AssertionError("as many tasks as slots suffice if all do")


def parents_of(core: Core, task_id: str) -> frozenset[str]:
    """Return the tasks by which a task was requested and with which it ends: it can gain nothing from their end."""
    found: set[str] = set()
    task = core.state.tasks.get(task_id)
    while task is not None and task.family.parent and not task.family.detached:
        found.add(task.family.parent)
        task = core.state.tasks.get(task.family.parent)
    return frozenset(found)


def _steps_aside(task: TaskRecord) -> bool:
    """Return whether a task is being ended because it was preempted."""
    return task.outcome.code == "preempted" and task.section != "done"


def _pruned(tasks: tuple[str, ...], team: Team) -> tuple[tuple[str, ...], list[str]]:
    """Return tasks of which none can be left out; those that come last are spared first."""
    kept = tasks
    for task in reversed(tasks):
        fewer = tuple(t for t in kept if t != task)
        if team(fewer) is not None:
            kept = fewer
    found = team(kept)
    assert found is not None
    return kept, found


def match(slots: Slots, fits: set[tuple[str, str]], agents: Sequence[str]) -> list[str] | None:
    """Return a different agent for each slot, the first ones where there is a choice; None if that cannot be.

    `fits` holds (role, agent) of every agent that fits a role.
    """
    found = _fill(slots, (), fits, agents)
    return None if found is None else [found[slot] for slot in range(len(slots))]


def _fill(needs: Slots, beyond: Slots, fits: set[tuple[str, str]], agents: Sequence[str]) -> dict[int, str] | None:
    """Return a different agent for each slot that is needed, and for as many as can be of those `beyond`, by its number."""
    slots = [*needs, *beyond]
    of_slot: dict[int, str] = {}
    of_agent: dict[str, int] = {}

    def fill(slot: int, seen: set[str]) -> bool:
        for agent in agents:
            if agent in seen or (slots[slot].role, agent) not in fits:
                continue
            seen.add(agent)
            holder = of_agent.get(agent)
            if holder is not None and slots[holder].role == slots[slot].role:
                continue  # it could only look on among the same agents as we do
            if holder is None or fill(holder, seen):
                of_slot[slot], of_agent[agent] = agent, slot
                return True
        return False

    if not all(fill(slot, set()) for slot in range(len(needs))):
        return None
    full: set[str] = set()
    for slot in range(len(needs), len(slots)):
        if slots[slot].role not in full and not fill(slot, set()):
            full.add(slots[slot].role)
    return of_slot


def _at_home(core: Core, agent: Candidate, *, leaving: bool) -> Candidate | None:
    """Return a machine as it will be when its task has given it back; None = it lands just now, who knows where."""
    goal = core.state.goals.get(agent.goal)
    if goal is not None and goal.in_flight and core.action(goal.action).lands and not leaving:
        return None
    brought = agent.landed != "grounded" and core.catalogue.types[agent.type].recover is not None
    landed, at_port = ("grounded", True) if brought else (agent.landed, agent.at_port)
    # Checks before a flight are told on the ground: the machine must pass them when it is there.
    return replace(agent, task="", goal="", word="STANDBY", landed=landed, at_port=at_port, preflight=False)
