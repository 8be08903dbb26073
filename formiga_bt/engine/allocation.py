"""Allocation as a part of the engine: requests on the blackboard, a coalesced look at them, grants and explanations.

The policy is plugged in; this part turns tasks into requests, records the outcome as changes, and gives each granted machine a
cruise layer of its own while there are enough.
"""

from operator import attrgetter
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.energy import CALM
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.agents.grants import assign
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.energy import Charge
from formiga_bt.engine.allocator.filters import could_serve, hopeless, looked
from formiga_bt.engine.allocator.holders import Holders
from formiga_bt.engine.allocator.policy import Decision, Policy
from formiga_bt.engine.allocator.preemption import Preemption, PreemptionPlan
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, AgentRequest, Verdict
from formiga_bt.engine.kernel.timers import AllocationDue, HopelessDue, NodeDue, TaskDue
from formiga_bt.engine.resources import Resources
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.engine.tasks.timing import Timing

"""After so long a LOW request ranks as MEDIUM; nothing ever ages to HIGH."""

RESERVE_AFTER_US: Micros = 120 * SECOND
"""A team that has waited so long keeps fitting agents as they become free."""

ALLOCATION: Final = AllocationDue()

EVERY_US: Micros = 50_000
"""Least engine time between two looks."""

EACH_US: Micros = 100
"""The same for each waiting request: looking at thousands takes longer than 50 ms, and nothing else would be done."""

KNOWN_AFTER_US: Micros = 10 * SECOND
"""After so long the fleet counts as known, though agents of the site are still missing."""

BRANCHES: Final = ("/fleet/", "/orders/", "/allocation/requests/", "/tasks/", "/site/")
"""Where the blackboard tells of what may change a decision."""

_read = attrgetter(
    "type", "order", "shared", "mobility", "actions", "refused", "refused_at_rest", "pool", "liveness", "control", "task",
    "goal", "word", "landed", "battery", "position", "quarantine", "taken", "out", "checks", "home", "layer_m", "wind",
    "payload_kg", "limits",
)  # fmt: skip
"""What a candidate is made from."""


class Allocation:
    """Between waiting tasks and free agents."""

    def __init__(
        self, core: Core, tasks: Tasks, fleet: Fleet, authority: Authority, policy: Policy, timing: Timing
    ) -> None:
        self._core = core
        self._tasks = tasks
        self._fleet = fleet
        self._policy = policy
        self._authority = authority
        self._timing = timing
        self._holders = Holders(core)
        self._resources = Resources(core, tasks, self._holders)
        self._roster = Roster()
        self._heard = core.board.listen(*BRANCHES)
        self._changed: dict[str, None] = dict.fromkeys(core.state.agents)
        """Agents that changed since the last look."""
        self._agent_of: dict[str, str] = {}
        """Keys of the blackboard -> the agent that they are of."""
        self._known: dict[str, tuple[Any, ...]] = {}
        """Agent -> what its candidate was made from."""
        self._hopeless: dict[str, tuple[tuple[Verdict, ...], str]] = {}
        """Waiting requests -> the explanation last looked at, and why it says that nobody could ever serve them."""

    def hear(self) -> None:
        """Take what changed on the blackboard; if requests wait, a look is due 50 ms after the last one, or later for many."""
        heard, known = self._heard, self._agent_of
        if not heard:
            return
        for key in heard:
            agent = known.get(key) or _agent_of(key)
            if agent:
                known[key] = agent
                self._changed[agent] = None
        heard.clear()
        core = self._core
        if core.state.requests and ALLOCATION not in core.state.deadlines:
            last = core.state.counters.get("alloc_at", -EVERY_US)
            core.set_deadline(ALLOCATION, max(core.now, last + max(EVERY_US, len(core.state.requests) * EACH_US)))

    def look(self) -> None:
        """Let the policy decide; record grants and explanations."""
        core = self._core
        core.emit(ch.CounterSet("alloc_at", core.now))
        self._timing.review()
        waiting = sorted(core.state.requests.values(), key=lambda r: r.rank(core.now))
        requests = [self._aged(r) for r in waiting]
        if any(r.units for r in requests):
            blocks = [r for r in requests if r.units]
            self._resources.serve(blocks, self._authority.blocked_of(blocks), self._explain)
            requests = [r for r in requests if not r.units]
        agents = self._candidates()
        blocked = self._authority.blocked_of(requests)
        decision, aside, unsafe = self._decide_safely([r for r in requests if r.task not in blocked], agents)
        blocked |= unsafe
        for request in requests:
            if request.task in blocked:
                self._explain_blocked(request, *blocked[request.task], agents)
                continue
            verdicts = decision.verdicts.get(request.task, ())
            verdicts = aside.told(request, verdicts)
            self._explain(request.task, verdicts)
        for grant in decision.grants:
            request = core.state.requests[grant.task]
            if late := self._authority.blocked(request):  # a grant before this one took the pilot's room
                self._explain_blocked(request, *late, agents)
                continue
            pilot, roles = self._authority.pilot(request), self._authority.trimmed(request, grant.roles)
            lists = frozenset(role.role for role in request.roles if role.is_list)
            core.put_part(request.holder, "agents", pilot=pilot or core.task(request.holder).agents.pilot)
            assign(core, request.holder, roles)
            core.emit(ch.RequestPut(grant.task, None))
            if request.node:
                self._tasks.granted_more(request, roles)
            else:
                self._tasks.granted(grant.task, roles, lists)

        self._answer_hopeless(requests, decision, agents)
        for request in requests:
            if request.priority == "high" and request.task in core.state.requests:
                self._preempt(core.state.requests[request.task], aside.plans.get(request.task))
                if blocked.get(request.task, ("",))[0] == "no_pilot" and could_serve(request, agents):
                    for victim in self._authority.step_aside_for(request):
                        self._tasks.restart(victim, "preempted", f"for {request.holder}, which needs its pilot")

    def _decide_safely(
        self, requests: list[AgentRequest], agents: Roster
    ) -> tuple[Decision, Preemption, dict[str, tuple[str, str]]]:
        """Return a decision after which all that could end can still end, and who gets nothing for that."""
        unsafe: dict[str, tuple[str, str]] = {}
        while True:
            left = [r for r in requests if r.task not in unsafe]
            decision, aside = self._decide(left, agents)
            grants = [(grant.task, grant.roles) for grant in decision.grants]
            held_up = self._holders.held_up_by_machines({r.task: r for r in left}, grants) if grants else None
            if held_up is None:
                return decision, aside, unsafe
            unsafe[held_up[0]] = "safe_order", held_up[1]

    def _decide(self, requests: list[AgentRequest], agents: list[Candidate]) -> tuple[Decision, Preemption]:
        """Return the policy's decision, and whom the HIGH requests that get nothing, or not all, ask to step aside."""
        decision = self._policy(requests, agents)
        aside = Preemption(self._core, requests, decision, agents, self._authority.most_machines)
        kept = [aside.kept(request) for request in requests] if aside.plans else requests
        if kept != requests:  # what fits already must not go to others while the rest of the team is freed
            decision = self._policy(kept, agents)
        return decision, aside

    def _preempt(self, request: AgentRequest, plan: PreemptionPlan | None) -> None:
        """Have the victims of a plan step aside; meanwhile the roles' `wait` stands still."""
        core = self._core
        for victim in plan.victims if plan is not None else ():
            self._tasks.restart(victim, "preempted", f"for {request.holder}")
        if request.task not in core.state.requests:
            return  # it was of a task that has just stepped aside
        awaited = plan.awaited if plan is not None else {}
        if awaited == request.preempting:
            return
        due = wait_of(request)
        if not request.preempting and due in core.state.deadlines:
            request = replace(request, wait_left=core.state.deadlines[due].at - core.now)
            core.clear_deadline(due)
        elif not awaited and request.wait_left is not None:
            over = core.now + request.wait_left
            core.set_deadline(due, over, request.holder, pausable=True)
            roles = tuple(replace(role, wait_until=over if role.wait_until else None) for role in request.roles)
            request = replace(request, wait_left=None, roles=roles)
        core.emit(ch.RequestPut(request.task, replace(request, preempting=awaited)))

    def _explain_blocked(self, request: AgentRequest, code: str, detail: str, agents: list[Candidate]) -> None:
        """Say what keeps a request waiting whoever is free, and how the agents look meanwhile."""
        verdicts = (Verdict("", "", code, None, detail), *looked(request, agents))
        self._explain(request.task, verdicts)

    def _explain(self, task: str, verdicts: tuple[Verdict, ...]) -> None:
        """Note what is thought of each agent for a request, as a difference where little is new."""
        core = self._core
        was = core.state.explanations.get(task)
        if was == verdicts:
            return
        if was is not None and len(was) == len(verdicts):
            changed = tuple((n, now) for n, (old, now) in enumerate(zip(was, verdicts, strict=True)) if now != old)
            if 2 * len(changed) <= len(verdicts):
                core.emit(ch.Reexplained(task, core.now, changed))
                return
        core.emit(ch.Explained(task, core.now, verdicts))

    def _aged(self, request: AgentRequest) -> AgentRequest:
        """Return a request as it ranks now.

        LOW counts as MEDIUM after an hour; a team reserves after two minutes, and whom others step aside for at once.
        """
        waited = self._core.now - request.at
        machines = sum(role.count for role in request.roles if not role.shared)
        reserves = bool(request.preempting) or (machines > 1 and waited >= RESERVE_AFTER_US)
        return replace(request, priority=request.served_as(self._core.now), reserves=reserves)

    def _answer_hopeless(self, requests: list[AgentRequest], decision: Decision, agents: Roster) -> None:
        """End requests that no known agent could ever serve, once the site's agents were seen or 10 s passed."""
        core = self._core
        granted = {grant.task for grant in decision.grants}
        seen_all = all(agent in core.state.agents for agent in core.site.agents)
        former, self._hopeless = self._hopeless, {}
        for request in requests:
            if request.task in granted:
                continue
            verdicts = core.state.explanations.get(request.task, ())
            known = former.get(request.task)
            reason = (
                known[1] if known is not None and known[0] is verdicts else hopeless(request, verdicts, agents.find)
            )
            self._hopeless[request.task] = verdicts, reason
            if not reason:
                continue
            if seen_all or core.now - request.at >= KNOWN_AFTER_US:
                self._tasks.refuse_request(request, reason)
            else:
                due = HopelessDue(request.holder, request.node)
                core.set_deadline(due, request.at + KNOWN_AFTER_US, request.holder)

    def candidate(self, agent_id: str) -> Candidate:
        """Return an agent that is known as it is seen now."""
        found = self._candidates().find(agent_id)
        assert found is not None, f"{agent_id} is known, and no candidate was made of it"
        return found

    def _candidates(self) -> Roster:
        """Return all agents; only those that changed since the last look are seen anew."""
        core = self._core
        self.hear()
        changed, self._changed = self._changed, {}
        orders, known = core.state.orders, self._known
        for agent_id in changed:  # new ones come in the order of their admission
            agent = core.state.agents[agent_id]
            read = (*_read(agent), orders.get(agent_id))
            if known.get(agent_id) != read:  # most statuses of who stands by change nothing of it
                known[agent_id] = read
                self._roster.put(self._candidate(agent))
        self._roster.begin()
        return self._roster

    def _candidate(self, a: AgentRecord) -> Candidate:
        core = self._core
        preflight = core.site.preflight or core.site.mode == "real"
        orders = core.state.orders
        return Candidate(
            id=a.id,
            type=a.type,
            order=a.order,
            shared=a.shared,
            mobility=a.mobility,
            actions=a.actions,
            refused=a.refused or a.refused_at_rest,
            pool=a.pool,
            liveness=a.liveness,
            control=a.control,
            task=a.task,
            goal=a.goal,
            word=a.word,
            landed=a.landed,
            at_port=self._fleet.at_port(a),
            battery=a.battery if a.battery is not None else 0.0,
            position=a.position,
            detail=a.quarantine,
            taken=a.taken,
            out=a.out,
            ordered=orders[a.id].stop if a.id in orders else "",
            preflight=preflight and a.flies,
            checks=a.checks,
            charge=self._charge(a),
        )

    def _charge(self, agent: AgentRecord) -> Charge | None:
        """Return what is known of a machine's charge, if its type tells what it drains."""
        core = self._core
        kind = core.catalogue.types.get(agent.type)
        if kind is None or not agent.flies or agent.position is None or agent.battery is None:
            return None
        power, reserve = core.power(agent), core.rules(agent, "").reserve_pct
        port = core.site.ports.get(agent.home)
        return (
            None
            if power is None
            else Charge(
                battery=agent.battery,
                reserve=reserve,
                power=power,
                position=agent.position,
                home=port.at if port is not None else None,
                layer_m=agent.layer_m if agent.layer_m is not None else min(core.site.layers_m),
                lowest_m=min(core.site.layers_m),
                wind=agent.wind or CALM,
                payload_kg=agent.payload_kg,
            )
        )


def _agent_of(key: str) -> str:
    """Return the agent that a key is of, "" = of none."""
    match key.split("/"):
        case ["", "fleet", _, agent, *_] | ["", "orders", agent]:
            return agent
        case _:
            return ""


def wait_of(request: AgentRequest) -> NodeDue | TaskDue:
    """Return the deadline up to which a request waits."""
    return NodeDue(request.holder, request.node) if request.node else TaskDue(request.task, "wait")
