"""The core that all parts of the engine share while one step is made: state, changes, effects, deadlines, wakes.

Nothing here decides anything. Parts (`fleet`, `goals`, `people`, `gatekeeper`, `tasks`, `allocation`) read `state` and write
through `emit`, which applies each change at once, so that what is read next is already so.
"""

from collections.abc import Callable, Mapping
from operator import attrgetter
from types import MappingProxyType
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.energy import Power, power_of
from formiga_bt.base.geo import Frame
from formiga_bt.base.routes import RouteGraph
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ClearanceHold
from formiga_bt.engine.kernel.index import ROUTES, DeadlineHeap, Instants, StateIndex
from formiga_bt.engine.kernel.inputs import Effect, PublishState, SendGoal
from formiga_bt.engine.kernel.library import Bundles, Library
from formiga_bt.engine.kernel.news import News
from formiga_bt.engine.kernel.records import AgentRecord, Deadline, Discovered, GoalRecord, Paused, TaskPart, TaskRecord
from formiga_bt.engine.kernel.state import APPLY, EngineState, apply_heard, board_of
from formiga_bt.engine.kernel.timers import (
    AcceptDue,
    CancelDue,
    GraceDue,
    HopelessDue,
    NodeDue,
    TaskDue,
    Timer,
    UpdateDue,
    WallTimer,
)
from formiga_bt.lang.growing import grow, growing, read_announced
from formiga_bt.lang.model import ActionSpec, AgentType, Catalogue, Site, SiteAgent, Task
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.nodes.memory import Mem
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.rules import Rules, rules_of
from formiga_bt.safety.site_message import site_message

NO_ENVELOPE: Final[Mapping[str, float]] = MappingProxyType({})

NO_MEMORY: Final[Mapping[str, Mem]] = MappingProxyType({})

EVERYTHING: Final = ""
"""In `Core.stale`: look at all waiting goals."""

GATE_READS: Final = (
    "position",
    "landed",
    "control",
    "taken",
    "rebooted",
    "goal",
    "task",
    "liveness",
    "present",
    "pool",
    "lost_leg",
    "lost_area",
    "layer_m",
    "home",
    "inside",
    "wire",
    "lacks",
    "on_route",
    "avoids",
)
"""Fields of an agent that the gate's verdict on some goal depends on."""

_read_by_gate = attrgetter(*GATE_READS)


class Core:
    """State and the step under construction."""

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        tasks: Mapping[str, Task],
        state: EngineState,
        report: Callable[[News], None],
    ) -> None:
        self.report = report
        """Reports what concerns a part that is built later (`engine.news`)."""
        self.site_message: Final = site_message(site, catalogue.types.values())
        """What agents are told of the site."""
        self.site = site
        self.engine_id = ""
        """Which engine this is, as its driver was told; "": it has no name."""
        self.catalogue: Final = growing(catalogue)
        for name, found in state.discovered.items():
            self._learn(name, found)
        self.models = tasks if isinstance(tasks, Bundles) else Bundles(tasks)
        self.library = Library(state, tasks, self.models)
        self.state = state
        self.board: Blackboard = board_of(state)
        self.frame = Frame(site.lat, site.lng, site.ground_msl_m)
        self.airspace = Airspace(site)
        for name, closure in state.closures.items():
            self.airspace.close(name, closure.region, closure.reason)
        self.route_graph = RouteGraph(site.routes) if site.routes.nodes else None
        """None: machines on the ground drive straight ways."""
        self.guards: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
            {agent.id: agent.guards for agent in site.agents.values() if agent.guards}
        )
        """Agent -> its actions that need a resource to be empty."""
        self._rules: dict[tuple[str, str, str], Rules] = {}
        self._powers: dict[str, tuple[dict[str, float], Power | None]] = {}
        self.changes: list[ch.Change] = []
        self.effects: list[Effect] = []
        self.woken: dict[str, dict[str, None]] = {}
        """task -> node keys to wake, in order"""
        self.now: Micros = state.now
        """The instant of the step, engine time."""
        self.clock: Micros = state.now
        """What the driver's clock said when the present input came in: `now`, or later under overload."""
        self.stands_by = False
        """The next input is `Resumed` or `Outage`: nothing happens before it."""
        self.at_work = ""
        """The task that was settled last: if the engine stops by a bug, that one's."""
        self.running = ""
        """The task whose trees run a pass now, and how its nodes are woken at once."""
        self.wake_now: Callable[[str], None] | None = None
        self.named: dict[str, int] = {}
        """task -> how often its names have changed in this process"""
        self.due: set[tuple[str, str]] = set()
        """(task, node key) whose deadline fired in this step"""
        self.instants = Instants()
        self.answered: list[str] = []
        """Confirm goals that ended in this step and whose question must be looked at."""
        self.stale: set[str] = set()
        """Agents of which something changed that a waiting goal may wait for; `EVERYTHING` = look at all."""
        self.moved: dict[str, None] = dict.fromkeys(state.agents)
        """Agents that changed since the gate last looked at them as traffic."""
        self.index = StateIndex(state)
        self.open: dict[str, None] = {task.id: None for task in state.tasks.values() if task.section != "done"}
        """Tasks that have not ended: an index of the state."""
        self.touched: dict[str, bool] = {}
        """Tasks that are looked at -> whether that must be in this step (`engine.tasks.wake_queue`)."""
        self._deadlines = DeadlineHeap(state)
        index = self.index
        self._notes: dict[type, Callable[[Any], None]] = {
            ch.AgentPut: self._note_agent,
            ch.GoalPut: self._note_goal,
            ch.GoalDrop: self._note_drop,
            ch.TaskPut: self._note_task,
            ch.ClearancePut: self._note_clearance,
            ch.OrderPut: self._note_order,
            ch.ClosurePut: self._note_closure,
            ch.VarPut: self._note_names,
            ch.ScopePut: self._note_names,
            ch.TaskForget: self._note_forgotten,
            ch.DeadlineSet: self._note_deadline,
            ch.QuestionPut: lambda change: index.question(change.question),
            ch.QuestionDrop: lambda change: index.drop_question(change.question),
        }
        """What is noted of a change before it is applied."""

    # -- the step ------------------------------------------------------------------------------------------------
    def begin(self, now: Micros) -> None:
        """Start a step at `now`."""
        self.now = self.state.now = self.clock = now
        self.state.seq += 1
        self.changes, self.effects = [], []
        self.due.clear()
        if self.instants.at and not self.timers_stand:
            for task_id, key in self.instants.until(now):
                self.wake(task_id, key, may_wait=True)

    def emit(self, change: ch.Change) -> None:
        """Record a change and apply it."""
        self.changes.append(change)
        kind = type(change)
        if kind in self._notes:
            self._notes[kind](change)
        board = self.board
        APPLY[kind](self.state, board, change)
        if board.hits:
            for task_id, key in board.take_hits():
                self.wake(task_id, key, may_wait=True)

    def _note_agent(self, change: ch.AgentPut) -> None:
        new = change.agent
        old = self.state.agents.get(new.id)
        if old is None or _read_by_gate(old) != _read_by_gate(new):
            self.stale.add(new.id)
            self.moved[new.id] = None
            if new.id in self.guards or (old is not None and old.inside != new.inside):
                self.stale.add(EVERYTHING)  # who waits for a resource waits for whoever is in it
        were = old.on_route if old is not None else ()
        if were != new.on_route:
            self.index.on_route.put(new.id, new.on_route)
            if any(part not in new.on_route for part in were):
                self.stale.add(ROUTES)
        if new.task:
            self._touch_if_released(new)

    def _touch_if_released(self, agent: AgentRecord) -> None:
        task = self.state.tasks.get(agent.task)
        if task is not None and agent.id in task.agents.releasing:
            self.touch(task.id)  # it may be down now: an order brings it home, too

    def _note_goal(self, change: ch.GoalPut) -> None:
        goal = change.goal
        old = self.state.goals.get(goal.id)
        if old is not None and old.state == goal.state != "gated" and old.owner == goal.owner:
            return  # it goes on: nothing that is found by looking for it, and nobody's way
        self.index.goal(goal)
        if goal.state != "gated" and (goal.leg is not None or goal.area is not None):
            self.stale.add(goal.agent)
            self.moved[goal.agent] = None

    def _note_drop(self, change: ch.GoalDrop) -> None:
        self.index.drop_goal(change.goal)

    def _note_task(self, change: ch.TaskPut) -> None:
        task = change.task
        old = self.state.tasks.get(task.id)
        if old is not None and old.resources != task.resources:
            self.stale.add(EVERYTHING)  # of legs through a resource with a region
        if task.section == "done":
            self.open.pop(task.id, None)
            self.index.ended[task.id] = None
        else:
            self.open[task.id] = None

    def _note_deadline(self, change: ch.DeadlineSet) -> None:
        self.index.deadline(change)
        self._deadlines.forget()

    def _note_order(self, change: ch.OrderPut) -> None:
        self.stale.add(change.agent)

    def _note_closure(self, change: ch.ClosurePut) -> None:
        closure = change.closure
        if closure is None:
            self.airspace.open(change.name)
        else:
            self.airspace.close(change.name, closure.region, closure.reason)
        self.stale.add(EVERYTHING)

    def _note_names(self, change: ch.VarPut | ch.ScopePut) -> None:
        self.named[change.task] = self.named.get(change.task, 0) + 1

    def _note_forgotten(self, change: ch.TaskForget) -> None:
        self.named.pop(change.task, None)

    def _note_clearance(self, change: ch.ClearancePut) -> None:
        self.stale.add(change.agent)
        self.moved[change.agent] = None

    def effect(self, effect: Effect) -> None:
        """Add an effect; it leaves the process after the step is persisted."""
        self.effects.append(effect)

    def withdraw_send(self, goal_id: str) -> bool:
        """Take back a SendGoal of this very step; return whether there was one."""
        for index, effect in enumerate(self.effects):
            if isinstance(effect, SendGoal) and effect.goal_id == goal_id:
                del self.effects[index]
                return True
        return False

    def count(self, name: str) -> int:
        """Raise a journaled counter and return it (from 1)."""
        value = self.state.counters.get(name, 0) + 1
        self.emit(ch.CounterSet(name, value))
        return value

    # -- records ---------------------------------------------------------------------------------------------------
    def task(self, task_id: str) -> TaskRecord:
        """Return a task's record."""
        return self.state.tasks[task_id]

    def put_task(self, task_id: str, **fields: Any) -> TaskRecord:
        """Replace fields of a task's record; a new status or hold is published."""
        old = self.state.tasks[task_id]
        new = replace(old, **fields)
        if new == old:
            return old
        self.emit(ch.TaskPut(new))
        if new.status != old.status or bool(new.hold.causes) != bool(old.hold.causes):
            word = "HELD" if new.hold.causes and new.status in ("ASSIGNED", "ACTIVE", "ENDING") else new.status
            self.effect(PublishState(task_id, word, new.outcome.code, new.outcome.reason))
        return new

    def put_part(self, task_id: str, part: TaskPart, **fields: Any) -> TaskRecord:
        """Replace fields of one part of a task's record."""
        return self.put_task(task_id, **{part: replace(getattr(self.state.tasks[task_id], part), **fields)})

    def put_agent(self, agent_id: str, **fields: Any) -> AgentRecord:
        """Replace fields of an agent's record."""
        old = self.state.agents[agent_id]
        new = replace(old, **fields)
        if new != old:
            self.emit(ch.AgentPut(new))
        return new

    def put_heard(self, agent: AgentRecord) -> None:
        """Replace an agent's record by one that only says that it was heard of: as `emit` does, for most statuses there are."""
        change = ch.AgentPut(agent)
        self.changes.append(change)
        apply_heard(self.state, self.board, change)
        if agent.task:
            self._touch_if_released(agent)

    def put_goal(self, goal_id: str, **fields: Any) -> GoalRecord:
        """Replace fields of a goal's record."""
        old = self.state.goals[goal_id]
        new = replace(old, **fields)
        if new != old:
            self.emit(ch.GoalPut(new))
        return new

    def model(self, task: TaskRecord) -> Task:
        """Return the checked model that a task runs."""
        found = self.library.of(task)
        assert found is not None, f"the model of {task.id} ({task.name} {task.request.bundle[:8]}) was not added"
        return found

    def discover(self, action: str, found: Discovered) -> None:
        """Note an action that no catalogue has; once it is known, the catalogue has it."""
        self.emit(ch.DiscoveredPut(action, found))
        self._learn(action, found)

    def _learn(self, action: str, found: Discovered) -> None:
        usable = found.known and (
            self.site.mode == "simulation" or found.by
        )  # a simulation's word is none where it is real
        spec, _ = read_announced(action, found.text) if usable else (None, [])
        if spec is not None:
            grow(self.catalogue, spec, found.types)

    def listed(self, agent_id: str) -> SiteAgent | None:
        """Return what the site file says of an agent, or the person who added it to the fleet; None = nobody lists it."""
        listed = self.site.agents.get(agent_id)
        member = self.state.members.get(agent_id)
        return SiteAgent(agent_id, member.type, member.home) if listed is None and member is not None else listed

    def homes(self) -> list[str]:
        """Return the ports and stations that belong to listed agents."""
        members = self.state.members.items()
        added = [member.home for name, member in members if name not in self.site.agents]
        return [agent.home for agent in self.site.agents.values()] + added

    def agent_type(self, agent: AgentRecord) -> AgentType:
        """Return the catalogue's entry for an agent; of one that is in it no more, a type that can do nothing."""
        return self.catalogue.types.get(agent.type) or AgentType(agent.type, Mark("", 0, 0))

    def action(self, name: str) -> ActionSpec:
        """Return the catalogue's entry for an action."""
        return self.catalogue.actions[name]

    def asked_speed(self, goal: GoalRecord) -> float | None:
        """Return the speed that a goal asks for, m/s; None = as fast as its machine goes."""
        speed = goal.fields.get(self.action(goal.action).speed)
        return float(speed) if isinstance(speed, int | float) else None

    def rules(self, agent: AgentRecord, task_id: str) -> Rules:
        """Return the limits of a machine that flies for a task."""
        task = self.state.tasks.get(task_id)
        model = self.library.of(task) if task is not None else None
        key = (agent.type, model.bundle if model is not None else "", model.name if model is not None else "")
        found = self._rules.get(key)
        if found is None:
            envelope = model.envelope if model is not None else NO_ENVELOPE
            found = self._rules[key] = rules_of(self.agent_type(agent), self.site, envelope)
        return found

    def power(self, agent: AgentRecord) -> Power | None:
        """Return what a machine uses and how fast it is: its type's numbers, and what it announces itself."""
        known = self._powers.get(agent.id)
        if known is None or known[0] is not agent.limits:
            known = self._powers[agent.id] = (agent.limits, power_of(self.agent_type(agent).limits, agent.limits))
        return known[1]

    # -- waking ------------------------------------------------------------------------------------------------------
    def wake(self, task_id: str, key: str, *, may_wait: bool = False) -> None:
        """Make a node of a task due for a visit in this step; `may_wait`: or soon after, where very many are."""
        if task_id == self.running and self.wake_now is not None:
            self.wake_now(key)  # in the pass under way: readers ahead of it are visited still, those behind in the next
            return
        woken = self.woken.get(task_id)
        if woken is None:
            self.woken[task_id] = {key: None}
        else:
            woken[key] = None
        if may_wait:
            self.touched.setdefault(task_id, False)
        else:
            self.touched[task_id] = True

    def touch(self, task_id: str) -> None:
        """Have a task's sections and ending looked at in this step."""
        self.touched[task_id] = True

    # -- time ----------------------------------------------------------------------------------------------------------
    def set_deadline(self, timer: Timer, at: Micros, task: str = "", *, pausable: bool = False) -> None:
        """Set an engine-time deadline. Deadlines of a held task stand still: only what is left is kept."""
        record = self.state.tasks.get(task)
        if pausable and record is not None and clock_stands(record):
            clock = record.hold.clock.without(timer)
            self.put_part(task, "hold", clock=replace(clock, paused=(*clock.paused, Paused(timer, at - self.now))))
            return
        seq = self.state.counters.get("deadline", 0) + 1
        self.emit(ch.DeadlineSet(timer, Deadline(at, seq, task, pausable)))
        self._deadlines.push(at, seq, timer)

    def clear_deadline(self, timer: Timer) -> None:
        """Forget a deadline, also one that stands still."""
        if timer in self.state.deadlines:
            self.emit(ch.DeadlineSet(timer, None))
        if isinstance(timer, NodeDue | TaskDue | HopelessDue):
            task = self.state.tasks.get(timer.task)
            if task is not None and task.hold.clock.paused:
                self.put_part(task.id, "hold", clock=task.hold.clock.without(timer))

    def pause_deadlines(self, task_id: str) -> None:
        """Let the pausable deadlines of a task stand still."""
        own = [(timer, self.state.deadlines[timer]) for timer in self.index.deadlines_of(task_id)]
        mine = tuple(Paused(timer, deadline.at - self.now) for timer, deadline in own if deadline.pausable)
        if mine:
            clock = self.task(task_id).hold.clock
            self.put_part(task_id, "hold", clock=replace(clock, paused=(*clock.paused, *mine)))
            for one in mine:
                self.emit(ch.DeadlineSet(one.timer, None))

    def resume_deadlines(self, task_id: str) -> None:
        """Let the deadlines of a task run again."""
        clock = self.task(task_id).hold.clock
        if clock.paused:
            self.put_part(task_id, "hold", clock=replace(clock, paused=()))
            for one in clock.paused:
                self.set_deadline(one.timer, self.now + one.left_us, task_id, pausable=True)

    @property
    def timers_stand(self) -> bool:
        """Return whether no timer fires: it is not known yet what happened while the engine was away."""
        resume = self.state.resume
        return self.stands_by or (resume is not None and resume.phase == "asking")

    def next_deadline(self) -> tuple[Micros, Timer] | None:
        """Return the earliest live deadline, ties in the order of setting."""
        if self.stands_by or (self.state.resume is not None and self.timers_stand):
            return None
        return self._deadlines.first()

    def set_wall(self, timer: WallTimer, after_us: Micros | None) -> None:
        """Ask the driver for `WallDue` after so much wall time, or (None) no more."""
        if after_us is None and timer not in self.state.wall:
            return
        self.emit(ch.WallTimerSet(timer, after_us))

    def clear_walls(self, goal_id: str) -> None:
        """Ask for no wall time on account of a goal any more."""
        for timer in (AcceptDue(goal_id), CancelDue(goal_id), GraceDue(goal_id), UpdateDue(goal_id)):
            self.set_wall(timer, None)

    def keep_memory(self, task_id: str, fresh: Mapping[str, Mem | None]) -> None:
        """Record what nodes of a task remember now, as far as it differs: as `emit` does, for very many."""
        state, board, changes, put = self.state, self.board, self.changes, APPLY[ch.NodeMem]
        old = state.memory.get(task_id, NO_MEMORY)
        for path, mem in fresh.items():
            if old.get(path) != mem:
                change = ch.NodeMem(task_id, path, mem)
                changes.append(change)
                put(state, board, change)


def clock_stands(task: TaskRecord) -> bool:
    """Return whether a task's deadlines stand still: it is held for another cause than clearance."""
    causes = task.hold.causes
    return bool(causes) and any(not isinstance(cause, ClearanceHold) for cause in causes)
