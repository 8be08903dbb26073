"""The closed list of what a task can wait for, and what an open task waits for now.

`causes_of` goes through all that a task has under way: its request for agents, each running step, what a stop waits for, each
machine on its way home. For each it says which cause of the list it waits for, and looks whether that still stands: whether the
timer is set, the goal in flight, the question open. A wait whose cause has gone is `Cause("")`: nothing would ever end it.
"""

from collections.abc import Iterator, Mapping
from typing import Final, assert_never

from msgspec import Struct

from formiga_bt.engine.kernel.causes import (
    ClearanceHold,
    HoldCause,
    LockdownHold,
    OperatorHold,
    ResumeHold,
    TakeOverHold,
    in_words,
    kind_and_agent,
)
from formiga_bt.engine.kernel.drains import is_over
from formiga_bt.engine.kernel.records import AgentRequest, Cleanup, GoalRecord, Question, TaskRecord, request_id
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import (
    AcceptDue,
    AllocationDue,
    CancelDue,
    ClearanceAgain,
    ClearanceDue,
    EscalationDue,
    GraceDue,
    HomeAgain,
    LiveDue,
    NodeDue,
    Timer,
)
from formiga_bt.nodes.ends import AgentReleased, ChildEnd, Drain, End, FinallyEnd, GoalEnd
from formiga_bt.nodes.memory import (
    AskMem,
    DoMem,
    GatherMem,
    ItemsMem,
    LiveMem,
    LoopMem,
    Mem,
    PassMem,
    RequestMem,
    RetryMem,
    TimeoutMem,
    WaitForMem,
    WaitMem,
    WithMem,
    WithResourceMem,
)

CAUSES: Final[Mapping[str, str]] = {
    "agents": "the allocator has found no fitting agents yet",
    "agents.not_before": "agents, which it gets no earlier than its request says",
    "agents.after": "agents, which it gets once the tasks that its request names have succeeded",
    "agents.lockdown": "agents, which nobody gets while the site is locked down",
    "agents.not_approved": "agents, which it gets once a person has approved the task",
    "agents.no_pilot": "agents, which it gets once a pilot on duty has room for them",
    "agents.safe_order": "agents, which another task needs first so that both can end",
    "resource": "a resource of the site, which others hold or wait for",
    "agents.held": "agents, which it gets once its task is not HELD any more",
    "goal.sent": "an agent has been given a goal and has not confirmed it yet; it is asked again",
    "goal.accepted": "an agent has a goal and has not begun",
    "goal.running": "an agent carries out a goal",
    "goal.canceling": "an agent was asked to stop and has not confirmed that yet; bounded by its `cancel_grace`",
    "goal.interrupted": "an order or a pilot interrupted a goal: a person says how it goes on",
    "gate.control": "a machine is not the engine's to command, or was not handed back",
    "gate.stopped": "an order stands on the machine",
    "gate.lockdown": "the site is locked down",
    "gate.epoch": "another engine commands the site",
    "gate.suspect": "the machine is not heard of",
    "gate.quarantined": "the machine is quarantined",
    "gate.unreachable": "the agent cannot be reached",
    "gate.draining": "another goal of the machine must end first",
    "gate.held": "the task is HELD",
    "gate.reconcile": "the engine was away and does not know yet what the machine did",
    "gate.rebooted": "a machine was started anew and has not said since that it flies: a person clears it",
    "gate.clearance": "people must say that they stand clear",
    "gate.spot_busy": "another machine is on the spot",
    "gate.port_busy": "another machine is at the port",
    "gate.leg_busy": "another machine is in the way",
    "gate.route_busy": "another machine is on the routes where the way leads",
    "gate.route_order": "going on along the routes would keep a machine from ever coming to where it drives",
    "gate.resource_busy": "a resource that the way leads through has no room",
    "gate.no_claim": "the way leads through a resource that the task does not hold",
    "question": "people have not answered yet",
    "time": "a time has not passed yet: of a `wait`, of a round, before the next attempt",
    "condition": "a condition of a `wait_until` is not true yet",
    "event": "an agent has not reported an event yet",
    "task": "a task that it requested has not ended",
    "release": "a machine that it gives back is on its way home, or has a goal still",
    "finally": "a `finally` of steps that were stopped runs, or waits for their goals",
    "recover.pause": "a way home failed and is tried again in a moment",
    "recover.order": "its machine is brought down by an order, not by the task, or a person says how it goes on",
    "held.operator": "a person stopped it, and says how it goes on",
    "held.clearance": "HELD until people say that they stand clear",
    "held.take-over": "HELD until its machine is handed back",
    "held.lockdown": "HELD until lockdown is released",
    "held.resume": "HELD after an outage until a person says continue",
}
"""Every cause -> in words."""

SECTIONS: Final = ("steps", "on_failure", "on_abort", "finally")


class Cause(Struct, frozen=True):
    """One thing that a task waits for. `code` is of `CAUSES`; "" = nothing would ever end this wait."""

    code: str
    at: str = ""
    """Node key, section, or machine."""
    of: str = ""
    """The goal, question, request, deadline, task or agent waited for."""


def causes_of(state: EngineState, task: TaskRecord) -> tuple[Cause, ...]:
    """Return what an open task waits for; empty if it has ended."""
    return () if task.ended else tuple(_Waits(state, task).all())


class _Waits:
    """The waits of one task."""

    def __init__(self, state: EngineState, task: TaskRecord) -> None:
        self.state = state
        self.task = task
        self.memory: Mapping[str, Mem] = state.memory.get(task.id, {})

    def all(self) -> Iterator[Cause]:
        """Iterate over everything that the task has under way."""
        task = self.task
        yield from map(self._held, task.hold.causes)
        if task.status == "PENDING":
            yield self._request(self.state.requests.get(task.id), "")
            return
        found = list(self._nodes())
        yield from found
        yield from self._recovering()
        for agent in task.agents.releasing:
            yield self._leaving(agent)
        for cleanup in task.ending.cleanups:
            if not cleanup.ended:
                yield self._cleanup(cleanup)
        if task.ending.stopping:
            yield from self._drain(task.ending.drain, "!task")
        elif task.section in SECTIONS:
            yield from self._covered(task.section, found)
        elif task.section == "recover":
            yield from self._way_home()

    def _held(self, held: HoldCause) -> Cause:
        state = self.state
        match held:
            case LockdownHold():
                stands = state.lockdown is not None
            case ClearanceHold(agent_id):
                record = state.clearances.get(agent_id)
                stands = record is not None and record.state in ("asked", "waiting")
            case TakeOverHold(agent_id):
                agent = state.agents[agent_id]
                stands = agent.taken or agent.control != "engine"
            case OperatorHold() | ResumeHold():
                stands = True
            case _:
                assert_never(held)
        return Cause(f"held.{kind_and_agent(held)[0]}" if stands else "", "", in_words(held))

    # -- nodes ---------------------------------------------------------------------------------------------------------
    def _nodes(self) -> Iterator[Cause]:
        for key, mem in self.memory.items():
            yield from self._node(key, mem)

    def _node(self, key: str, mem: Mem) -> Iterator[Cause]:
        match mem:
            case DoMem(goal):
                yield self._do(key, goal)
            case AskMem(ask):
                yield self._question(self.state.questions.get(ask), key, ask)
            case WaitMem():
                yield self._time(key)
            case LoopMem() | RetryMem() if mem.waiting:
                yield self._time(key)
            case WaitForMem(agent):
                yield Cause("event", key, agent)
            case PassMem() if ":" not in key.partition("/")[2]:
                yield Cause("condition", key)
            case RequestMem(child):
                found = self.state.tasks.get(child)
                yield Cause("task" if found is not None and not found.ended else "", key, child)
            case WithMem("waits") | WithResourceMem("waits"):
                yield self._block(key)
            case WithMem("releases", agents):
                names = [name for group in agents.values() for name in group if name in self.task.agents.releasing]
                yield Cause("release" if names else "", key, ", ".join(names))
            case TimeoutMem() | LiveMem() | GatherMem() if mem.halting:
                yield from self._drain(mem.drain, key)
            case TimeoutMem() if not self._is_set(NodeDue(self.task.id, key)):
                yield Cause("", key, "the deadline of a timeout")

    def _covered(self, section: str, found: list[Cause]) -> Iterator[Cause]:
        """Complain of a section, or a composite in it, below which nothing waits."""
        waits = [_bare(cause.at) for cause in found]
        if section not in self.memory:
            yield Cause("", section, "its tree")
        for key, mem in self.memory.items():
            if isinstance(mem, ItemsMem) or _section(key) != section:
                continue
            bare = _bare(key)
            if not any(at.startswith(bare) and at[len(bare) : len(bare) + 1] in ("", ".", "@", "/") for at in waits):
                yield Cause("", key, "a step below it")

    def _do(self, key: str, goal_id: str) -> Cause:
        if goal_id in self.state.agents:  # a `release`
            return Cause("release" if goal_id in self.task.agents.releasing else "", key, goal_id)
        goal = self.state.goals.get(goal_id)
        return Cause("" if goal is None else self.goal(goal), key, goal_id)

    def _time(self, key: str) -> Cause:
        return Cause("time" if self._is_set(NodeDue(self.task.id, key)) else "", key, "its deadline")

    def _is_set(self, due: Timer) -> bool:
        return due in self.state.deadlines or self.task.hold.clock.left_of(due) is not None

    def _block(self, key: str) -> Cause:
        name = request_id(self.task.id, key)
        request = self.state.requests.get(name)
        bound = self._is_set(NodeDue(self.task.id, key)) or (request is not None and request.wait_left is not None)
        return self._request(request, key) if bound else Cause("", key, "the end of its wait")

    def _request(self, request: AgentRequest | None, at: str) -> Cause:
        if request is None:
            return Cause("", at, "its request")
        if request.units:
            looked = request.task in self.state.explanations or AllocationDue() in self.state.deadlines
            return Cause("resource" if looked else "", at, request.task)
        for verdict in self.state.explanations.get(request.task, ()):
            if not verdict.role:
                return Cause(f"agents.{verdict.code}", at, request.task)
        looked = request.task in self.state.explanations or AllocationDue() in self.state.deadlines
        return Cause("agents" if looked else "", at, request.task)

    # -- goals and questions -------------------------------------------------------------------------------------------
    def goal(self, goal: GoalRecord) -> str:
        """Return the cause of a goal that has not ended, or ""."""
        state, wall = self.state, self.state.wall
        agent = state.agents[goal.agent]
        stands = True
        match goal.state:
            case "gated":
                return f"gate.{goal.code}" if self._gated(goal) else ""
            case "sent":
                stands = AcceptDue(goal.id) in wall
            case "accepted" | "running":
                stands = agent.human or (agent.liveness != "LOST" and LiveDue(agent.id) in wall)
            case "canceling":
                stands = CancelDue(goal.id) in wall and GraceDue(goal.id) in wall
            case "interrupted":
                ordered = agent.id in state.orders or agent.taken or agent.control != "engine"
                stands = bool(self.task.hold.causes) or ordered
            case _:
                stands = False  # it has ended, and nobody took its end
        return f"goal.{goal.state}" if stands else ""

    def _gated(self, goal: GoalRecord) -> bool:
        state, agent = self.state, self.state.agents[goal.agent]
        match goal.code:
            case "control":
                return agent.control != "engine" or agent.taken
            case "stopped":
                return agent.id in state.orders
            case "lockdown":
                return state.lockdown is not None
            case "epoch":
                return bool(state.counters.get("deposed"))
            case "suspect" | "unreachable":
                return agent.liveness != "ALIVE" or not agent.present
            case "quarantined":
                return agent.pool == "QUARANTINED"
            case "draining":
                other = state.goals.get(agent.goal)
                return other is not None and other.in_flight
            case "held":
                return bool(self.task.hold.causes)
            case "reconcile":
                return state.resume is not None
            case "rebooted":
                return agent.rebooted
            case "clearance":
                return self._clearance(goal)
            case "leg_busy" | "spot_busy" | "port_busy" | "route_busy":
                return goal.text in state.agents
            case "route_order":
                return goal.text in state.agents or goal.text in state.tasks
            case "resource_busy" | "no_claim":
                return bool(goal.text)
        return False

    def _clearance(self, goal: GoalRecord) -> bool:
        record = self.state.clearances.get(goal.agent)
        if record is None or record.goal != goal.id or ClearanceDue(goal.agent) not in self.state.deadlines:
            return False
        if record.state == "waiting":
            return ClearanceAgain(goal.agent) in self.state.deadlines
        question = self.state.questions.get(f"clear/{goal.agent}/{record.n}")
        return record.state == "asked" and question is not None and question.reply is None

    def _question(self, question: Question | None, at: str, of: str) -> Cause:
        if question is None or question.reply is not None:
            return Cause("", at, of)
        more = question.escalate_us is not None and question.tier + 1 < len(question.tiers)
        if more and EscalationDue(of) not in self.state.deadlines:
            return Cause("", at, "its escalation")
        return Cause("question", at, of)

    # -- stops, releases, the way home ---------------------------------------------------------------------------------
    def _drain(self, drain: Drain, at: str) -> Iterator[Cause]:
        """Tell of each member of a drain set that is not over; one without any such member should be over."""
        left = [end for end in drain if not is_over(self.state, self.task, end)]
        yield from (self._member(end, at) for end in left)
        if not left:
            yield Cause("", at, "its drain set")

    def _member(self, end: End, at: str) -> Cause:
        match end:
            case GoalEnd(goal):
                return Cause(self.goal(self.state.goals[goal]), at, goal)
            case FinallyEnd(cleanup):
                return Cause("finally", at, cleanup)
            case AgentReleased(agent):
                return Cause("release", at, agent)
            case ChildEnd(child):
                return Cause("task", at, child)
            case _:
                assert_never(end)

    def _cleanup(self, cleanup: Cleanup) -> Cause:
        if cleanup.state == "running":
            bare = _bare(cleanup.path)
            runs = any(_bare(key).startswith(bare) for key in self.memory)
            waits = runs and self._is_set(NodeDue(self.task.id, cleanup.id))
            return Cause("finally" if waits else "", cleanup.path, cleanup.id)
        left = [end for end in cleanup.after if not is_over(self.state, self.task, end)]
        return Cause("finally" if left else "", cleanup.path, cleanup.id)

    def _leaving(self, agent_id: str) -> Cause:
        """A machine is being given back: it has a goal still, or is brought home, or a `finally` may still command it."""
        task = self.task
        busy = any(goal.agent == agent_id and not goal.ended for goal in self.state.goals.values())
        after = task.agents.releasing[agent_id].after
        kept = any(FinallyEnd(cleanup.id) in after and not cleanup.ended for cleanup in task.ending.cleanups)
        home = any(one.agent == agent_id and one.state in ("running", "waiting") for one in task.agents.recovering)
        return Cause("release" if busy or kept or home else "", agent_id, agent_id)

    def _recovering(self) -> Iterator[Cause]:
        for one in self.task.agents.recovering:
            if one.state == "waiting":
                is_set = HomeAgain(self.task.id, one.agent) in self.state.deadlines
                yield Cause("recover.pause" if is_set else "", one.agent, "the end of its pause")
            elif one.state == "running" and one.section not in self.memory:
                yield Cause("", one.agent, "its way home")

    def _way_home(self) -> Iterator[Cause]:
        """In `recover`: a machine is on its way, waits for its next try, or comes down by an order of its own."""
        task, state = self.task, self.state
        if any(one.state in ("running", "waiting") for one in task.agents.recovering):
            return
        for agent_id in task.agents.granted:
            order = state.orders.get(agent_id)
            agent = state.agents[agent_id]
            if agent.task != task.id or order is None or order.state == "done" or order.task == task.id:
                continue
            # An order begins when the goal of the one that it replaces has ended, and its pilot has given the machine back.
            # One that failed stands, with an alarm, until a person gives another.
            person = "a person" if agent.taken or agent.control != "engine" or order.state == "failed" else ""
            if order.task or agent.goal or person:
                yield Cause("recover.order", agent_id, order.task or agent.goal or person)
                return
        yield Cause("", "recover", "a way home")


def _section(key: str) -> str:
    return key.partition("/")[0].partition(":")[0]


def _bare(key: str) -> str:
    """Return a node's path without the word of its modifier."""
    section, slash, path = key.partition("/")
    return section + slash + path.partition(":")[0]
