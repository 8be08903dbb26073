"""What always holds, checked after every step of the engine. Cheap: each check looks at what the step changed.

The state that is looked at is folded here from the steps; at times it is compared with the live one.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.engine.kernel.state import APPLY, EngineState, snapshot
from formiga_bt.engine.kernel.timers import GraceDue
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.transport.messages import GoalRequest
from tests.simulation.causes import cause_of, unwoken, waits
from tests.simulation.ground import RULES as GROUND
from tests.simulation.lifecycle import Recorder
from tests.simulation.standing import RULES as STANDING
from tests.simulation.standing import between, of_effects, of_step

if TYPE_CHECKING:
    from tests.simulation.world import World

RULES: Final = {
    "two_tasks": "no machine that is not shared is held by two tasks, none belongs to a task that has ended",
    "claims": "no more units of a resource are held than there are, and none by a task that has ended",
    "ended": "a task that has ended stays as it ended",
    "wait": "whatever a task waits for is of the closed list, and still stands",
    "wake": "who has something to do is woken in that very step",
    "life": "each transition stands in the tables of life cycles",
    "twice": "no goal id is begun twice by a machine",
    "released": "no task gives back a machine in the air, unless an engine that could not keep it had sent it up anew",
    "left": "no machine stays in the air without a task, an order, an errand, or a quarantine with an alarm",
    "fold": "the folded steps give the live state",
    "journal": "what is read from the journal is the state that was kept",
    "silence": "no machine is lost for what the engine did not hear while it stood still itself",
    "seq": "steps are numbered without gaps, and time never goes back",
    "durable": "nothing leaves before its step is kept, unless the journal is full",
    "forgotten": "what a client or an agent has heard of is known after a restart",
    "rest": "after the calm every task has ended and everything has landed, or is quarantined with an alarm",
    "exception": "the engine raises nothing, no task ends by an exception or runs away",
    **STANDING,
    **GROUND,
}
FOLD_EVERY: Final = 500
LOOK_US: Final[Micros] = 2 * SECOND
LEFT_US: Final[Micros] = 12 * SECOND
TERMINAL: Final = frozenset({"SUCCEEDED", "FAILED", "CANCELED"})
Watcher = Callable[[ch.Change, Any], None]
"""Told of each change, with the record that it replaces (None: there was none, or it has none)."""


class Violation(Struct, frozen=True):
    """Something that always holds did not."""

    rule: str
    text: str
    step: int
    """Number of the step, counted over all engines of the run."""
    at_s: float = 0.0

    def __str__(self) -> str:
        return f"{self.at_s:9.3f} s, step {self.step}: {self.rule}: {self.text}"


class Mute(Blackboard):
    """Nobody reads the blackboard of a folded state."""

    def put(self, key: str, value: Any) -> bool:
        return False

    def touch(self, key: str) -> None:
        pass

    def drop(self, key: str) -> None:
        pass


class Invariants:
    """Looks at each step of all engines of a run."""

    def __init__(self, world: "World") -> None:
        self.world = world
        self.state = EngineState()
        self.violations: list[Violation] = []
        self.counts: Counter[str] = Counter()
        self.life = Recorder()
        self.causes: set[str] = set()
        self.watchers: list[Watcher] = []
        self.steps = 0
        self._start = world.now
        self._board = Mute()
        self._told: set[tuple[str, str]] = set()
        self._holders: dict[str, dict[str, None]] = {}
        self._alarmed: set[str] = set()
        self._looked: Micros = 0
        self._since: dict[str, Micros] = {}
        self._resumed: Micros = 0
        self._begun: dict[tuple[str, str], int] = {}
        """Who began what, in which life of its process."""
        self.forgotten: set[str] = set()
        """Goals that were sent while the journal was full, by an engine that died before they were kept."""
        self._kept_goals: set[str] = set()
        self._open: dict[str, None] = {}

    @property
    def transitions(self) -> frozenset[tuple[str, str, str]]:
        """Return the transitions of life cycles that were taken."""
        return frozenset(self.life.seen)

    def tell(self, rule: str, text: str, once: str = "") -> None:
        """Note a violation; of one kind on one thing (`once`) only the first."""
        assert rule in RULES, rule
        if once and (rule, once) in self._told:
            return
        self._told.add((rule, once))
        self.violations.append(Violation(rule, text, self.steps, (self.world.now - self._start) / SECOND))

    def begin(self, state: EngineState) -> None:
        """An engine begins with a state: that of a start, or what was read from the journal."""
        self.state = state
        self.life.load(state)
        self._holders.clear()
        self._since.clear()
        self._resumed = self.world.now
        self._open = {task.id: None for task in state.tasks.values() if task.section != "done"}
        for task in state.tasks.values():
            self._hold(task, None)

    # -- each step -----------------------------------------------------------------------------------------------------
    def step(self, step: inp.EngineStep) -> None:
        """Look at a step, before it is kept."""
        state, self.steps = self.state, self.steps + 1
        if step.seq != state.seq + 1:
            self.tell("seq", f"step {step.seq} follows {state.seq}")
        if step.at < state.now:
            self.tell("seq", f"step {step.seq} is at {step.at}, before {state.now}")
        for rule, text in of_step(state, step):
            self.tell(rule, text, text)
        state.seq, state.now = step.seq, step.at
        for change in step.changes:
            before = self._before(change)
            APPLY[type(change)](state, self._board, change)
            self._change(change, before)
            for watch in self.watchers:
                watch(change, before)
        for rule, text in of_effects(state, step):
            self.tell(rule, text, text)
        for row in self.life.look(step):
            self.tell("life", f"step {step.seq} ({type(step.input).__name__}): {row}", str(row))
        for task_id in _touched(step):
            self._look_for_cause(task_id)
        for effect in step.effects:
            if isinstance(effect, inp.Alarm):
                self.counts[f"alarm {effect.code}"] += 1
                if effect.agent:
                    self._alarmed.add(effect.agent)
            elif isinstance(effect, inp.SendGoal):
                if not self.world.plan.ahead:
                    self._kept_goals.add(effect.goal_id)
                self.counts["goals"] += 1
        if self.steps % FOLD_EVERY == 0:
            self.fold()
        if step.at - self._looked >= LOOK_US:
            self._looked = step.at
            self.look()

    def kept(self, goals: Iterable[str]) -> None:
        """Goals whose steps are on disk, or wait for it with an engine that has said so: they may leave."""
        self._kept_goals.update(goals)

    def _before(self, change: ch.Change) -> Any:
        state = self.state
        match change:
            case ch.TaskPut():
                return state.tasks.get(change.task.id)
            case ch.AgentPut():
                return state.agents.get(change.agent.id)
            case ch.GoalPut():
                return state.goals.get(change.goal.id)
            case ch.GoalDrop():
                return state.goals.get(change.goal)
            case ch.OrderPut():
                return state.orders.get(change.agent)
            case ch.RequestPut():
                return state.requests.get(change.task)
            case ch.ClearancePut():
                return state.clearances.get(change.agent)
            case ch.QuestionPut():
                return state.questions.get(change.question.id)
            case ch.QuestionDrop():
                return state.questions.get(change.question)
            case ch.LockdownPut():
                return state.lockdown
            case ch.ResumePut():
                return state.resume
        return None

    def _change(self, change: ch.Change, before: Any) -> None:
        match change:
            case ch.AgentPut(agent):
                self._agent(agent, before)
            case ch.TaskPut(task):
                self._task(task, before)

    def _agent(self, agent: AgentRecord, before: AgentRecord | None) -> None:
        stood, kind = self.world.stood_until, self.world.engine.core.catalogue.types.get(agent.type)
        if stood is not None and kind is not None and agent.liveness == "LOST" and before and before.liveness != "LOST":
            silent = self.world.now - stood
            if silent < kind.lost_after_us:
                self.tell(
                    "silence", f"{agent.id} is LOST {silent / SECOND:.1f} s after the engine stood still", agent.id
                )
        if agent.pool != "QUARANTINED" and (before is None or before.pool != agent.pool):
            self._alarmed.discard(agent.id)
        released = before is not None and before.task and not agent.task and agent.pool == "STANDBY"
        if released and agent.landed == "airborne" and not self.forgotten:
            self.tell(
                "released", f"{agent.id} is in the air, and {before.task if before else ''} gives it back", agent.id
            )
        if agent.task and (before is None or before.task != agent.task):
            task = self.state.tasks.get(agent.task)
            if task is None or task.section == "done":
                self.tell("two_tasks", f"{agent.id} belongs to {agent.task}, which has ended", agent.id)

    def _task(self, task: TaskRecord, before: TaskRecord | None) -> None:
        if before is None:
            self._open[task.id] = None
            self.counts["system tasks" if task.system.agent else "tasks"] += 1
        if before is not None and before.status in TERMINAL and before.status != task.status:
            self.tell("ended", f"{task.id} was {before.status} and is {task.status}")
        if task.section == "done" and (before is None or before.section != task.section):
            self._open.pop(task.id, None)
            self.counts[f"{task.status} {task.outcome.code}".strip()] += not task.system.agent
            if task.outcome.code in ("cannot_compute", "exception", "runaway") and task.id not in self.world.blamed:
                self.tell(
                    "exception", f"{task.id} ({task.name}) ends {task.outcome.code}: {task.outcome.reason}", task.id
                )
        if task.resources.claims:
            self._claims(task)
        if before is None or before.agents.roles is not task.agents.roles or before.section != task.section:
            self._hold(task, before)

    def _claims(self, task: TaskRecord) -> None:
        if task.section == "done":
            self.tell("claims", f"{task.id} has ended, and holds {task.resources.units}")
        resources = self.world.engine.core.site.resources
        for name in task.resources.units:
            held = sum(self.state.tasks[one].resources.units.get(name, 0) for one in self._open)
            if name not in resources or held > resources[name].capacity:
                self.tell("claims", f"{held} of {name} are held")

    def _hold(self, task: TaskRecord, before: TaskRecord | None) -> None:
        if task.system.agent:
            return
        for agent in _machines(before) if before is not None else ():
            self._holders.get(agent, {}).pop(task.id, None)
        for agent in _machines(task):
            record = self.state.agents.get(agent)
            if record is None or self.world.engine.core.agent_type(record).shared:
                continue
            holders = self._holders.setdefault(agent, {})
            holders[task.id] = None
            if len(holders) > 1:
                self.tell("two_tasks", f"{agent} is held by {' and '.join(holders)}", agent)

    # -- from time to time ---------------------------------------------------------------------------------------------
    def fold(self) -> None:
        """Compare the folded state with the live one."""
        if snapshot(self.state) != snapshot(self.world.engine.state):
            self.tell("fold", "the folded steps give another state than the live one", "fold")

    def look(self) -> None:
        """Look for machines that are left, for tasks that wait for nothing, and for who missed a wake."""
        for task_id in list(self._open):
            self._look_for_cause(task_id)
        for rule, text in between(self.state, self.world.engine):
            self.tell(rule, text, text.partition(" ")[0])
        for task_id, node in unwoken(self.world.engine):
            self.tell("wake", f"{task_id}: {node} has something to do and was not visited", task_id)
        if self.state.resume is not None and self.state.resume.phase != "watching":
            return
        if self.state.counters.get("deposed"):
            return  # another engine cares for them
        for name, body in self.world.machines.items():
            self._look_at(self.state.agents.get(name), body.is_airborne)

    def _look_at(self, agent: AgentRecord | None, airborne: bool) -> None:
        if agent is None:
            return
        state = self.state
        task = state.tasks.get(agent.task)
        cared = task is not None and task.section not in ("", "done")
        cared = cared or any(t.system.agent == agent.id and t.section == "recover" for t in state.tasks.values())
        cared = cared or agent.id in state.orders or agent.control != "engine" or agent.taken
        cared = cared or (agent.pool == "QUARANTINED" and agent.id in self._alarmed) or agent.liveness == "SUSPECT"
        goal = state.goals.get(
            agent.goal
        )  # what it does is being canceled: it is brought home, or quarantined, within the grace
        cared = cared or (goal is not None and goal.state == "canceling" and GraceDue(goal.id) in state.wall)
        # One that said that it stood, flew off without a goal, told so in a step that was not kept, and says nothing since.
        unknown = not agent.may_be_airborne and (agent.heard_at or 0) <= self._resumed and agent.liveness == "LOST"
        if not airborne or cared or unknown or self.world.machines[agent.id].state().control != "engine":
            self._since.pop(agent.id, None)
            return
        if state.now - self._since.setdefault(agent.id, state.now) > LEFT_US:
            how = f"{agent.pool} {agent.liveness}, task {agent.task or 'none'}"
            self.tell("left", f"{agent.id} flies, and nobody cares for it: {how}", agent.id)

    def _look_for_cause(self, task_id: str) -> None:
        task = self.state.tasks.get(task_id)
        if task is None or task.ended:
            return
        causes, none = waits(self.state, task)
        self.causes |= causes
        for text in none:
            self.tell("wait", f"{task_id} ({task.name}): {text}", task_id)

    # -- agents and clients --------------------------------------------------------------------------------------------
    def begins(self, request: GoalRequest, boot: int) -> None:
        """A machine's body begins a goal, in the how-manieth life of its process."""
        key = (request.agent, request.goal_id)
        before = self._begun.get(key)
        self._begun[key] = boot
        if before is not None and request.goal_id in self.forgotten and before < boot:
            self.counts["begun again, for nobody remembered it"] += 1  # with a full journal that is not promised
        elif before is not None:
            self.tell("twice", f"{request.agent} begins {request.goal_id} again", request.goal_id)
        if request.goal_id not in self._kept_goals:
            self.tell("durable", f"{request.agent} begins {request.goal_id}, which no step that was kept has sent")

    def finish(self) -> None:
        """Look at what is left after the calm."""
        self.fold()
        for task_id in self._open:
            task = self.state.tasks[task_id]
            cause = cause_of(self.state, task)
            self.tell(
                "rest", f"{task_id} ({task.name}) is still {task.status} in {task.section}: {cause or 'no cause'}"
            )
        for name, body in self.world.machines.items():
            agent = self.state.agents[name]
            if body.is_airborne and (agent.pool != "QUARANTINED" or name not in self._alarmed):
                self.tell("rest", f"{name} is in the air: {agent.pool} {agent.task} {agent.liveness} {agent.control}")


def _machines(task: TaskRecord) -> list[str]:
    return [agent for group in task.agents.roles.values() for agent in group] if task.section != "done" else []


def _touched(step: inp.EngineStep) -> dict[str, None]:
    """Return the tasks whose record, or whose tree, a step changed."""
    found: dict[str, None] = {}
    for change in step.changes:
        if isinstance(change, ch.TaskPut):
            found[change.task.id] = None
        elif isinstance(change, ch.NodeMem):
            found[change.task] = None
        elif isinstance(change, ch.GoalPut) and change.goal.task:
            found[change.goal.task] = None
    return found
