"""The engine's state, and `apply`: the one function that changes it. The live engine and the fold of a journal share it."""

from collections.abc import Callable, Mapping
from operator import attrgetter
from types import MappingProxyType
from typing import Any, Final

import msgspec
from msgspec import Struct, field

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.alarm_records import AlarmRecord
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.engine.kernel.records import (
    AgentEventRecord,
    AgentRecord,
    AgentRequest,
    Approval,
    ClearanceRecord,
    Closure,
    Deadline,
    Discovered,
    GoalRecord,
    Lockdown,
    Member,
    Question,
    Resuming,
    StandingOrder,
    TaskRecord,
    Verdict,
    Version,
    Wakes,
)
from formiga_bt.engine.kernel.rule_records import RuleRecord, RuleWatch
from formiga_bt.engine.kernel.timers import Timer, WallTimer
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.nodes.memory import Mem
from formiga_bt.safety.drafted import Drafted

KEPT_EVENTS: Final = 100
"""So many events of an agent are kept for those who will wait for them."""


class EngineState(Struct):
    """Everything that the engine knows, as data. Only `apply` writes it."""

    seq: int = 0
    now: Micros = 0
    epoch: int = 0
    tasks: dict[str, TaskRecord] = field(default_factory=dict)
    memory: dict[str, dict[str, Mem]] = field(default_factory=dict)
    """task -> node key -> memory"""
    scopes: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    """task -> scope -> name -> value"""
    agents: dict[str, AgentRecord] = field(default_factory=dict)
    goals: dict[str, GoalRecord] = field(default_factory=dict)
    questions: dict[str, Question] = field(default_factory=dict)
    clearances: dict[str, ClearanceRecord] = field(default_factory=dict)
    deadlines: dict[Timer, Deadline] = field(default_factory=dict)
    wall: dict[WallTimer, Micros] = field(default_factory=dict)
    orders: dict[str, StandingOrder] = field(default_factory=dict)
    """agent -> the order that stands on it"""
    lockdown: Lockdown | None = None
    resume: Resuming | None = None
    """while it is found out what happened when the engine was away"""
    approvals: dict[str, Approval] = field(default_factory=dict)
    """hash of a bundle and its site -> who approved it (`mode: real`)"""
    duty: dict[str, Micros] = field(default_factory=dict)
    """pilots on duty -> since when (`mode: real`)"""
    members: dict[str, Member] = field(default_factory=dict)
    """agents that people added to those of the site file"""
    discovered: dict[str, Discovered] = field(default_factory=dict)
    """actions that agents announce and that no catalogue has"""
    drafted: dict[str, Drafted] = field(default_factory=dict)
    """bundle of a task that a model wrote -> who asked for it"""
    library: dict[str, tuple[Version, ...]] = field(default_factory=dict)
    """task -> its versions, oldest first, once another than the first is served"""
    agent_events: dict[str, list[AgentEventRecord]] = field(default_factory=dict)
    """agent -> its newest events, oldest first; at most `KEPT_EVENTS`"""
    requests: dict[str, AgentRequest] = field(default_factory=dict)
    explanations: dict[str, tuple[Verdict, ...]] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)
    wakes: dict[str, Wakes] = field(default_factory=dict)
    """task -> what it has used of its budget of wakes, once it was in haste"""
    rules: dict[str, RuleRecord] = field(default_factory=dict)
    """the site's standing rules by name, and what became of them"""
    rule_watches: dict[str, dict[str, RuleWatch]] = field(default_factory=dict)
    """rule -> agent -> what it has seen of it"""
    alarms: dict[str, AlarmRecord] = field(default_factory=dict)
    """id -> alarm, in the order of raising: all that are open, and the newest that are cleared"""
    closures: dict[str, Closure] = field(default_factory=dict)
    """region or place -> who closed it for machines, and why"""
    news: dict[str, NewsMark] = field(default_factory=dict)
    """channel of the site's news -> how far it has come"""


def apply(state: EngineState, board: Blackboard, change: ch.Change) -> None:
    """Change `state`, and the blackboard that shows it, as `change` says."""
    APPLY[type(change)](state, board, change)


def _task(state: EngineState, board: Blackboard, change: ch.TaskPut) -> None:
    task = change.task
    old = state.tasks.get(task.id)
    state.tasks[task.id] = task
    if old is None or old.status != task.status:
        board.put(f"/tasks/{task.id}/status", task.status)
    if old is not None and old.hold.causes != task.hold.causes:
        board.touch(f"/tasks/{task.id}/held")
    if task.resources is not (old.resources if old is not None else None):
        board.touch(f"/tasks/{task.id}/resources")
    if task.agents.roles is not (old.agents.roles if old is not None else None):
        _show_grants(board, task)


def _show_grants(board: Blackboard, task: TaskRecord) -> None:
    if task.agents.roles:
        board.put(grants_key(task.id), task.agents.roles)
    else:
        board.drop(grants_key(task.id))


def _agent(state: EngineState, board: Blackboard, change: ch.AgentPut) -> None:
    agent = change.agent
    old = state.agents.get(agent.id)
    state.agents[agent.id] = agent
    board.touch(f"/fleet/{agent.type}/{agent.id}")
    _show_agent(board, agent, old)


def apply_heard(state: EngineState, board: Blackboard, change: ch.AgentPut) -> None:
    """Do what `apply` does with a record in which nothing differs that the blackboard shows."""
    agent = change.agent
    state.agents[agent.id] = agent
    board.touch(f"/fleet/{agent.type}/{agent.id}")


def _goal(state: EngineState, _: Blackboard, change: ch.GoalPut) -> None:
    state.goals[change.goal.id] = change.goal


def _goal_drop(state: EngineState, _: Blackboard, change: ch.GoalDrop) -> None:
    state.goals.pop(change.goal, None)


def _question(state: EngineState, _: Blackboard, change: ch.QuestionPut) -> None:
    state.questions[change.question.id] = change.question


def _question_drop(state: EngineState, _: Blackboard, change: ch.QuestionDrop) -> None:
    state.questions.pop(change.question, None)


def _clearance(state: EngineState, _: Blackboard, change: ch.ClearancePut) -> None:
    _set_or_drop(state.clearances, change.agent, change.clearance)


def _happened(state: EngineState, board: Blackboard, change: ch.AgentEventNoted) -> None:
    one = change.event
    state.agent_events[one.agent] = [*state.agent_events.get(one.agent, ()), one][-KEPT_EVENTS:]
    state.counters["agent_event"] = one.order
    board.touch(event_key(one.agent, one.event))


def _order(state: EngineState, board: Blackboard, change: ch.OrderPut) -> None:
    _set_or_drop(state.orders, change.agent, change.order)
    board.touch(f"/orders/{change.agent}")


def _lockdown(state: EngineState, board: Blackboard, change: ch.LockdownPut) -> None:
    state.lockdown = change.lockdown
    board.touch("/site/lockdown")


def _resume(state: EngineState, _: Blackboard, change: ch.ResumePut) -> None:
    state.resume = change.resume


def _wakes(state: EngineState, _: Blackboard, change: ch.WakesPut) -> None:
    state.wakes[change.task] = change.wakes


def _rule(state: EngineState, _: Blackboard, change: ch.RulePut) -> None:
    _set_or_drop(state.rules, change.name, change.rule)


def _rule_watch(state: EngineState, _: Blackboard, change: ch.RuleWatchPut) -> None:
    _set_or_drop(state.rule_watches.setdefault(change.rule, {}), change.agent, change.watch)


def _alarm(state: EngineState, _: Blackboard, change: ch.AlarmPut) -> None:
    state.alarms[change.alarm.id] = change.alarm


def _alarm_drop(state: EngineState, _: Blackboard, change: ch.AlarmDrop) -> None:
    state.alarms.pop(change.alarm, None)


def _news_marks(state: EngineState, _: Blackboard, change: ch.NewsMarksPut) -> None:
    state.news = dict(change.marks)


def _closure(state: EngineState, board: Blackboard, change: ch.ClosurePut) -> None:
    _set_or_drop(state.closures, change.name, change.closure)
    board.touch("/site/closures")


def _approval(state: EngineState, board: Blackboard, change: ch.ApprovalPut) -> None:
    _set_or_drop(state.approvals, change.digest, change.approval)
    board.touch("/site/approvals")


def _duty(state: EngineState, board: Blackboard, change: ch.DutyPut) -> None:
    _set_or_drop(state.duty, change.pilot, change.since)
    board.touch("/site/duty")


def _member(state: EngineState, board: Blackboard, change: ch.MemberPut) -> None:
    _set_or_drop(state.members, change.agent, change.member)
    board.touch("/site/members")


def _discovered(state: EngineState, board: Blackboard, change: ch.DiscoveredPut) -> None:
    state.discovered[change.action] = change.discovered
    board.touch("/site/discovered")


def _drafted(state: EngineState, board: Blackboard, change: ch.DraftedPut) -> None:
    state.drafted[change.bundle] = change.drafted
    board.touch("/site/drafted")


def _library(state: EngineState, board: Blackboard, change: ch.LibraryPut) -> None:
    state.library[change.task] = change.versions
    board.touch("/site/library")


def _scope(state: EngineState, _: Blackboard, change: ch.ScopePut) -> None:
    values = None if change.values is None else dict(change.values)
    _set_or_drop(state.scopes.setdefault(change.task, {}), change.scope, values)


def _var(state: EngineState, board: Blackboard, change: ch.VarPut) -> None:
    state.scopes[change.task][change.scope][change.name] = change.value
    board.touch(name_key(change.task, change.scope, change.name))


def _memory(state: EngineState, _: Blackboard, change: ch.NodeMem) -> None:
    memory = state.memory.get(change.task)
    if memory is None:
        memory = state.memory[change.task] = {}
    if change.mem is None:
        memory.pop(change.path, None)
    else:
        memory[change.path] = change.mem


def _ended(_: EngineState, __: Blackboard, ___: ch.NodesEnded) -> None:
    """Nothing: it is history, not state."""


def _deadline(state: EngineState, _: Blackboard, change: ch.DeadlineSet) -> None:
    deadline = change.deadline
    if deadline is None:
        state.deadlines.pop(change.timer, None)
    else:
        state.deadlines[change.timer] = deadline
        state.counters["deadline"] = deadline.seq


def _wall(state: EngineState, _: Blackboard, change: ch.WallTimerSet) -> None:
    _set_or_drop(state.wall, change.timer, change.after_us)


def _request(state: EngineState, board: Blackboard, change: ch.RequestPut) -> None:
    task_id, request = change.task, change.request
    was = state.requests.get(task_id)
    _set_or_drop(state.requests, task_id, request)
    if request is not None:
        _show_request(board, request)
        return
    board.drop(f"/allocation/requests/{task_id}")
    if was is not None and was.node:
        state.explanations.pop(task_id, None)  # of a block: its explanation ends with its wait
        board.unwatch(grants_key(was.holder), (was.holder, was.node))


def _show_request(board: Blackboard, request: AgentRequest) -> None:
    """Write a request; the node that asks is woken by the grant."""
    board.put(f"/allocation/requests/{request.task}", request)
    if request.node:
        board.watch(grants_key(request.holder), (request.holder, request.node))


def _granted(_: EngineState, board: Blackboard, change: ch.Granted) -> None:
    board.touch(grants_key(change.task))  # what it has now is written with its record


def _explained(state: EngineState, _: Blackboard, change: ch.Explained) -> None:
    state.explanations[change.task] = change.verdicts


def _reexplained(state: EngineState, _: Blackboard, change: ch.Reexplained) -> None:
    was = state.explanations.get(change.task)
    if was is not None:  # None: a reader folds without what was explained before
        now = list(was)
        for place, verdict in change.changed:
            now[place] = verdict
        state.explanations[change.task] = tuple(now)


def _counter(state: EngineState, _: Blackboard, change: ch.CounterSet) -> None:
    if change.name == "epoch":
        state.epoch = change.value
    else:
        state.counters[change.name] = change.value


def _forget(state: EngineState, _: Blackboard, change: ch.TaskForget) -> None:
    task_id = change.task
    state.memory.pop(task_id, None)
    state.scopes.pop(task_id, None)
    state.wakes.pop(task_id, None)


def _gone(state: EngineState, board: Blackboard, change: ch.TaskGone) -> None:
    state.tasks.pop(change.task, None)
    state.explanations.pop(change.task, None)
    board.drop(f"/tasks/{change.task}/status")


APPLY: Final[Mapping[type, Callable[[EngineState, Blackboard, Any], None]]] = MappingProxyType(
    {
        ch.TaskPut: _task,
        ch.AgentPut: _agent,
        ch.GoalPut: _goal,
        ch.GoalDrop: _goal_drop,
        ch.QuestionPut: _question,
        ch.QuestionDrop: _question_drop,
        ch.ClearancePut: _clearance,
        ch.AgentEventNoted: _happened,
        ch.OrderPut: _order,
        ch.LockdownPut: _lockdown,
        ch.ApprovalPut: _approval,
        ch.DutyPut: _duty,
        ch.ClosurePut: _closure,
        ch.MemberPut: _member,
        ch.DiscoveredPut: _discovered,
        ch.DraftedPut: _drafted,
        ch.LibraryPut: _library,
        ch.ScopePut: _scope,
        ch.VarPut: _var,
        ch.NodeMem: _memory,
        ch.NodesEnded: _ended,
        ch.DeadlineSet: _deadline,
        ch.WallTimerSet: _wall,
        ch.RequestPut: _request,
        ch.Granted: _granted,
        ch.Explained: _explained,
        ch.Reexplained: _reexplained,
        ch.CounterSet: _counter,
        ch.TaskForget: _forget,
        ch.TaskGone: _gone,
        ch.ResumePut: _resume,
        ch.WakesPut: _wakes,
        ch.RulePut: _rule,
        ch.RuleWatchPut: _rule_watch,
        ch.AlarmPut: _alarm,
        ch.AlarmDrop: _alarm_drop,
        ch.NewsMarksPut: _news_marks,
    }
)
"""How each kind of change is applied."""


def fold(state: EngineState, board: Blackboard, step: EngineStep) -> None:
    """Bring a state that stands before a recorded step to where it stood after it."""
    state.seq, state.now = step.seq, step.at
    for change in step.changes:
        apply(state, board, change)


def name_key(task_id: str, scope: str, name: str) -> str:
    """Return the blackboard key under which readers of a task's name are kept."""
    return f"/names/{task_id}/{scope}/{name}"


def grants_key(task_id: str) -> str:
    """Return the blackboard key of the agents that a task has, by role; those who wait for agents watch it."""
    return f"/allocation/grants/{task_id}"


def event_key(agent: str, event: str) -> str:
    """Return the blackboard key under which those who wait for an event of an agent are kept."""
    return f"/events/{agent}/{event}"


def is_member(agent: AgentRecord) -> bool:
    """Return whether an agent is there for those who look at the fleet: admitted and not lost."""
    return not agent.refused and agent.liveness != "LOST"


def members_key(agent_type: str) -> str:
    """Return the blackboard key that tells how many agents of exactly this type are there."""
    return f"/members/{agent_type}"


def _set_or_drop(table: dict[Any, Any], key: Any, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


_SHOWN = (
    "battery",
    "position",
    "landed",
    "control",
    "pool",
    "task",
    "action",
    "liveness",
    "layer_m",
    "home",
    "payload_kg",
)
_NEVER: Final = object()


_shown = attrgetter(*_SHOWN)


def _show_agent(board: Blackboard, agent: AgentRecord, old: AgentRecord | None = None) -> None:
    """Write what people and conditions may read of an agent; of one that was shown before only what differs."""
    now = _shown(agent)
    if old is None or old.type != agent.type:
        was: tuple[Any, ...] = (_NEVER,) * len(_SHOWN)
    else:
        was = _shown(old)
        if now == was and agent.fields == old.fields and is_member(agent) == is_member(old):
            return
    root = f"/fleet/{agent.type}/{agent.id}"
    member = is_member(agent)
    if board.get(f"{root}/member", False) != member:
        board.put(f"{root}/member", member)
        key = members_key(agent.type)
        board.put(key, board.get(key, 0) + (1 if member else -1))
    for name, value, before in zip(_SHOWN, now, was, strict=True):
        if value is not before:
            board.put(f"{root}/{name}", value)
    known: dict[str, Any] = old.fields if old is not None and old.type == agent.type else {}
    for name in {**known, **agent.fields} if agent.fields is not known else ():
        if (value := agent.fields.get(name)) != known.get(name):
            board.put(f"{root}/{name}", value)


# -- snapshots ---------------------------------------------------------------------------------------------------------
def snapshot(state: EngineState) -> bytes:
    """Return the whole state as msgpack, to compare two of them; what is read back is written by `journal.codec`."""
    return msgspec.msgpack.encode(state)


def board_of(state: EngineState) -> Blackboard:
    """Return a blackboard that shows a loaded state."""
    board = Blackboard()
    for task in state.tasks.values():
        board.put(f"/tasks/{task.id}/status", task.status)
        _show_grants(board, task)
    for agent in state.agents.values():
        _show_agent(board, agent)
    for request in state.requests.values():
        _show_request(board, request)
    return board
