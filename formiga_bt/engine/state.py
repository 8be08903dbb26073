"""The engine's state, and `apply`: the one function that changes it. The live engine and the fold of a journal share it."""

from typing import Any, Final

import msgspec
from msgspec import Struct, field

from formiga_bt.blackboard import Blackboard
from formiga_bt.clock import Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.inputs import Step
from formiga_bt.engine.records import (
    AgentRecord,
    Approval,
    ClearanceRecord,
    Deadline,
    GoalRecord,
    Happening,
    Lockdown,
    Question,
    Request,
    StandingOrder,
    TaskRecord,
    Verdict,
    Version,
)
from formiga_bt.geo import Place, Position, Region
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.memory import Mem
from formiga_bt.nodes.run import Failure

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
    deadlines: dict[str, Deadline] = field(default_factory=dict)
    wall: dict[str, Micros] = field(default_factory=dict)
    orders: dict[str, StandingOrder] = field(default_factory=dict)
    """agent -> the order that stands on it"""
    lockdown: Lockdown | None = None
    approvals: dict[str, Approval] = field(default_factory=dict)
    """hash of a bundle and its site -> who approved it (`mode: real`)"""
    duty: dict[str, Micros] = field(default_factory=dict)
    """pilots on duty -> since when (`mode: real`)"""
    library: dict[str, tuple[Version, ...]] = field(default_factory=dict)
    """task -> its versions, oldest first, once another than the first is served"""
    happenings: dict[str, list[Happening]] = field(default_factory=dict)
    """agent -> its newest events, oldest first; at most `KEPT_EVENTS`"""
    requests: dict[str, Request] = field(default_factory=dict)
    explanations: dict[str, tuple[Verdict, ...]] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)


def apply(state: EngineState, board: Blackboard, change: ch.Change) -> None:
    """Change `state`, and the blackboard that shows it, as `change` says."""
    match change:
        case ch.TaskPut(task):
            state.tasks[task.id] = task
            board.put(f"/tasks/{task.id}/status", task.status)
        case ch.AgentPut(agent):
            state.agents[agent.id] = agent
            _show_agent(board, agent)
        case ch.GoalPut(goal):
            state.goals[goal.id] = goal
        case ch.GoalDrop(goal_id):
            state.goals.pop(goal_id, None)
        case ch.QuestionPut(question):
            state.questions[question.id] = question
        case ch.QuestionDrop(question_id):
            state.questions.pop(question_id, None)
        case ch.ClearancePut(agent_id, clearance):
            _set_or_drop(state.clearances, agent_id, clearance)
        case ch.Happened(one):
            state.happenings[one.agent] = [*state.happenings.get(one.agent, ()), one][-KEPT_EVENTS:]
            state.counters["happening"] = one.order
            board.touch(event_key(one.agent, one.event))
        case ch.OrderPut(agent_id, order):
            _set_or_drop(state.orders, agent_id, order)
        case ch.LockdownPut(lockdown):
            state.lockdown = lockdown
        case ch.ApprovalPut(digest, approval):
            _set_or_drop(state.approvals, digest, approval)
        case ch.DutyPut(pilot, since):
            _set_or_drop(state.duty, pilot, since)
        case ch.LibraryPut(name, versions):
            state.library[name] = versions
        case ch.ScopePut(task_id, scope, values):
            _set_or_drop(state.scopes.setdefault(task_id, {}), scope, None if values is None else dict(values))
        case ch.VarPut(task_id, scope, name, value):
            state.scopes[task_id][scope][name] = value
            board.touch(name_key(task_id, scope, name))
        case ch.NodeMem(task_id, path, mem):
            _set_or_drop(state.memory.setdefault(task_id, {}), path, mem)
        case ch.NodesEnded():
            pass  # history, not state
        case ch.DeadlineSet(key, deadline):
            _set_or_drop(state.deadlines, key, deadline)
            if deadline is not None:
                state.counters["deadline"] = deadline.seq
        case ch.WallTimerSet(key, after_us):
            _set_or_drop(state.wall, key, after_us)
        case ch.RequestPut(task_id, request):
            _set_or_drop(state.requests, task_id, request)
            if request is None and "|" in task_id:  # of a block: its explanation ends with its wait
                state.explanations.pop(task_id, None)
            board.put(f"/allocation/requests/{task_id}", request)
        case ch.Granted(task_id, roles, _):
            board.put(f"/allocation/grants/{task_id}", roles)
        case ch.Explained(task_id, _, verdicts):
            state.explanations[task_id] = verdicts
        case ch.CounterSet("epoch", value):
            state.epoch = value
        case ch.CounterSet(name, value):
            state.counters[name] = value
        case ch.TaskForget(task_id):
            state.memory.pop(task_id, None)
            state.scopes.pop(task_id, None)
            board.drop(f"/allocation/requests/{task_id}")
            board.drop(f"/allocation/grants/{task_id}")


def fold(state: EngineState, board: Blackboard, step: Step) -> None:
    """Bring a state that stands before a recorded step to where it stood after it."""
    state.seq, state.now = step.seq, step.at
    for change in step.changes:
        apply(state, board, change)


def name_key(task_id: str, scope: str, name: str) -> str:
    """Return the blackboard key under which readers of a task's name are kept."""
    return f"/tasks/{task_id}/{scope}/{name}"


def event_key(agent: str, event: str) -> str:
    """Return the blackboard key under which those who wait for an event of an agent are kept."""
    return f"/events/{agent}/{event}"


def is_member(agent: AgentRecord) -> bool:
    """Return whether an agent is there for those who look at the fleet: admitted and not lost."""
    return not agent.refused and agent.liveness != "LOST"


def members_key(agent_type: str) -> str:
    """Return the blackboard key that tells how many agents of exactly this type are there."""
    return f"/fleet/{agent_type}/members"


def _set_or_drop(table: dict[str, Any], key: str, value: Any) -> None:
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


def _show_agent(board: Blackboard, agent: AgentRecord) -> None:
    root = f"/fleet/{agent.type}/{agent.id}"
    member = is_member(agent)
    if board.get(f"{root}/member", False) != member:
        board.put(f"{root}/member", member)
        key = members_key(agent.type)
        board.put(key, board.get(key, 0) + (1 if member else -1))
    for name in _SHOWN:
        board.put(f"{root}/{name}", getattr(agent, name))


# -- snapshots ---------------------------------------------------------------------------------------------------------
# Values inside `Any` fields come back from JSON as plain mappings; their tag says what they were.
_TAGGED: dict[str, type[Struct]] = {"place": Place, "position": Position, "region": Region, "agent": AgentRef}


def revive(value: Any) -> Any:
    """Return a runtime value from its JSON form: tagged mappings become points, regions, agents; lists become tuples."""
    if isinstance(value, dict):
        kind = _TAGGED.get(value.get("is", ""))
        if kind is not None:
            return msgspec.convert(value, kind)
        return {key: revive(item) for key, item in value.items()}
    if isinstance(value, list):
        return tuple(revive(item) for item in value)
    return value


def snapshot(state: EngineState) -> bytes:
    """Return the whole state as JSON."""
    return msgspec.json.encode(state)


def load_snapshot(data: bytes) -> EngineState:
    """Return the state that `snapshot` wrote."""
    state = msgspec.json.decode(data, type=EngineState)
    state.scopes = {
        task: {scope: {name: revive(v) for name, v in values.items()} for scope, values in scopes.items()}
        for task, scopes in state.scopes.items()
    }
    for task_id, task in state.tasks.items():
        if task.params:
            state.tasks[task_id] = msgspec.structs.replace(task, params=revive(task.params))
    for goal_id, goal in state.goals.items():
        state.goals[goal_id] = msgspec.structs.replace(goal, fields=revive(goal.fields), result=revive(goal.result))
    for agent_id, happened in state.happenings.items():
        state.happenings[agent_id] = [msgspec.structs.replace(one, fields=revive(one.fields)) for one in happened]
    for memory in state.memory.values():
        for path, mem in memory.items():
            failure = getattr(mem, "failure", None)
            if isinstance(failure, dict):
                mem = msgspec.structs.replace(mem, failure=msgspec.convert(failure, Failure))
            for name in ("items", "collected"):
                if getattr(mem, name, ()):
                    mem = msgspec.structs.replace(mem, **{name: revive(list(getattr(mem, name)))})
            memory[path] = mem
    for task_id, request in state.requests.items():
        roles = tuple(msgspec.structs.replace(r, near=revive(list(r.near))) for r in request.roles)
        state.requests[task_id] = msgspec.structs.replace(request, roles=roles)
    return state


def board_of(state: EngineState) -> Blackboard:
    """Return a blackboard that shows a loaded state."""
    board = Blackboard()
    for task in state.tasks.values():
        board.put(f"/tasks/{task.id}/status", task.status)
    for agent in state.agents.values():
        _show_agent(board, agent)
    for task_id, request in state.requests.items():
        board.put(f"/allocation/requests/{task_id}", request)
    return board
