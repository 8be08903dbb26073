"""`TaskRun`: the services of one running task, between its trees and the parts of the engine."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from formiga_bt.base.clock import Micros
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import drains
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.engine.kernel.pace import Pace
from formiga_bt.engine.kernel.records import Question, Releasing, TaskRecord, request_id
from formiga_bt.engine.kernel.state import event_key
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.engine.tasks.children import Children
from formiga_bt.engine.tasks.cleanup import Cleanups
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.treerun import CompiledTrees, TaskTrees, TreesFactory
from formiga_bt.engine.tasks.watching import watch_keys
from formiga_bt.lang.model import MOST_VISITS, Env, Expr, Role
from formiga_bt.nodes.ends import Drain, End, FinallyEnd
from formiga_bt.nodes.memory import Mem
from formiga_bt.nodes.run import (
    AROUND,
    THROUGH,
    AskOrder,
    CleanupOrder,
    EndLetter,
    Failure,
    GoalOrder,
    GoalView,
    Runaway,
    Served,
    TaskOrder,
)

NO_VALUES: Final[Mapping[str, Any]] = MappingProxyType({})


class Watched(NamedTuple):
    """What a node with live conditions is woken by: blackboard keys, and instants at which a comparison with `now` turns."""

    keys: tuple[str, ...]
    conditions: tuple[Expr, ...]
    instants: tuple[Micros, ...]
    stamp: int = -1
    """Of the task's names when the keys were found; -1 = they depend on more than those."""


class TaskRun:
    """Implements `nodes.run.Run` for one task."""

    def __init__(
        self,
        core: Core,
        goals: Goals,
        people: People,
        requests: Requests,
        children: Children,
        task_id: str,
        factory: TreesFactory,
    ) -> None:
        self._core = core
        self._goals = goals
        self._people = people
        self._requests = requests
        self._children = children
        self.task_id = task_id
        self._fresh: dict[str, Mem | None] = {}
        self._ended: list[tuple[str, str, str]] = []
        self._spent = 0
        self._spent_seq = -1
        self._watched: dict[str, Watched] = {}
        self._pace = Pace(core, task_id)
        self.trees: TaskTrees = factory(self)
        self.cleanups = Cleanups(core, task_id, self.trees)
        self._compiled = self.trees if isinstance(self.trees, CompiledTrees) else None

    def close(self) -> None:
        """The task has ended: let go of its trees, so that their memory is free at once."""
        if self._compiled is not None:
            self._compiled.close()

    @property
    def now(self) -> Micros:
        """Return the instant of the step."""
        return self._core.state.now

    @property
    def clock(self) -> Micros:
        """Return the task's own time, which stands still while it is held."""
        return self._core.task(self.task_id).hold.clock.at(self.now)

    def spend(self) -> None:
        """Count a visit against this input's budget."""
        if self._spent_seq != self._core.state.seq:
            self._spent_seq, self._spent = self._core.state.seq, 0
        self._spent += 1
        if self._spent > MOST_VISITS:
            self._spent = 0  # what cleans up after this runs in the same step, with a budget of its own
            raise Runaway(f"more than {MOST_VISITS} nodes visited for one input")

    def env(self, scope: str, error: Failure | None = None, extra: Mapping[str, Any] | None = None) -> TaskEnv:
        """Return the names of a scope."""
        state = self._core.state
        task = state.tasks[self.task_id]
        scopes = state.scopes.get(self.task_id)
        values = (scopes.get(scope) if scopes is not None else None) or NO_VALUES
        if error is None and task.section in ("on_failure", "finally"):
            error = task.outcome.failure
        return TaskEnv(self._core, task, values, error, extra)

    # -- memory ----------------------------------------------------------------------------------------------------
    def remember(self, path: str, mem: Mem | None) -> None:
        """Keep a node's memory until the pass is over."""
        self._fresh[path] = mem

    def memory(self, path: str) -> Mem | None:
        """Return a node's memory."""
        if path in self._fresh:
            return self._fresh[path]
        return self._core.state.memory.get(self.task_id, {}).get(path)

    def ended(self, path: str, how: EndLetter, code: str = "") -> None:
        """Tell how a step ended when the pass is over."""
        self._ended.append((path, how, code))

    def flush(self) -> None:
        """Write what changed in a pass: which steps ended, then the memory of those that run."""
        if self._ended:
            self._core.emit(ch.NodesEnded(self.task_id, tuple(self._ended)))
            self._ended.clear()
        if self._fresh:
            self._core.keep_memory(self.task_id, self._fresh)
            self._fresh.clear()

    def register(self, path: str, node: Any) -> None:
        """Let wakes reach a node of compiled trees."""
        if self._compiled is not None:
            self._compiled.register(path, node)

    def unregister(self, path: str) -> None:
        """Forget a node of compiled trees."""
        if self._compiled is not None:
            self._compiled.unregister(path)

    # -- time ------------------------------------------------------------------------------------------------------
    def set_deadline(self, path: str, at: Micros) -> None:
        """Wake a node at an instant, or later if the task's clocks woke it too often."""
        at = self._pace.round_up(path, at)
        self._core.set_deadline(NodeDue(self.task_id, path), at, self.task_id, pausable=True)

    def clear_deadline(self, path: str) -> None:
        """Forget a node's deadline."""
        core = self._core
        if core.due:
            core.due.discard((self.task_id, path))
        core.clear_deadline(NodeDue(self.task_id, path))

    def deadline(self, path: str) -> Micros | None:
        """Return a node's deadline; of one that stands still, as if it ran from now."""
        timer = NodeDue(self.task_id, path)
        left = self._core.task(self.task_id).hold.clock.left_of(timer)
        if left is not None:
            return self.now + left
        found = self._core.state.deadlines.get(timer)
        return found.at if found else None

    def is_due(self, path: str) -> bool:
        """Return whether a node's deadline fired in this step."""
        return (self.task_id, path) in self._core.due

    def watch(self, path: str, conditions: tuple[Expr, ...], scope: str) -> None:
        """Wake a node when what its live conditions read changes, or a comparison with `now` does."""
        old, stamp = self._watched.get(path), self._core.named.get(self.task_id, 0)
        if old is not None and old.stamp == stamp and not old.instants and old.conditions == conditions:
            return  # the names are what they were, so the keys are
        env = self.env(scope)
        found = [watch_keys(self._core, env, cond, self.task_id, scope) for cond in conditions]
        keys = tuple(dict.fromkeys(key for some, _ in found for key in some))
        if not all(fixed for _, fixed in found):
            stamp = -1
        if old is None or old.keys != keys:
            self.unwatch(path)
            for key in keys:
                self._core.board.watch(key, (self.task_id, path))
        if old is None or old.conditions != conditions or any(0 < at <= self.now for at in old.instants):
            instants = tuple(instant(env) for cond in conditions for instant in cond.deadlines)
        else:
            instants = old.instants
        self._watched[path] = Watched(keys, conditions, instants, stamp)
        self._core.instants.drop(self.task_id, path)
        coming = min((at for at in instants if at > self.now), default=None)
        if coming is not None:
            self._core.instants.set(self.task_id, path, coming)
            if self.deadline(path) != coming:  # what depends on `now` never stands still
                self._core.set_deadline(NodeDue(self.task_id, path), coming, self.task_id)

    def wake_watchers(self) -> None:
        """Have each live condition looked at."""
        for path in self._watched:
            self._core.wake(self.task_id, path, may_wait=True)

    def watch_event(self, path: str, agent: str, event: str) -> None:
        """Wake a node at each event of that name that an agent tells."""
        key = event_key(agent, event)
        self._watched[path] = Watched((key,), (), ())
        self._core.board.watch(key, (self.task_id, path))

    def newest_event(self) -> int:
        """Return the order of the newest event of anyone."""
        return self._core.state.counters.get("agent_event", 0)

    def events_seen(self, agent: str, event: str) -> int:
        """Return the order of the last event of that name that this task took, or of the last before its admission."""
        task = self._core.task(self.task_id)
        return max(task.events.since, task.events.taken.get(f"{agent}|{event}", 0))

    def take_event(self, agent: str, event: str, after: int) -> Mapping[str, Any] | None:
        """Take the next event after an order; return its fields with `at`, or None."""
        for one in self._core.state.agent_events.get(agent, ()):
            if one.event == event and one.order > after:
                task = self._core.task(self.task_id)
                taken = max(one.order, task.events.taken.get(f"{agent}|{event}", 0))
                self._core.put_part(self.task_id, "events", taken={**task.events.taken, f"{agent}|{event}": taken})
                return {**one.fields, "at": one.at}
        return None

    def unwatch(self, path: str) -> None:
        """Forget a watch."""
        self._core.instants.drop(self.task_id, path)
        watched = self._watched.pop(path, None)
        for key in watched.keys if watched else ():
            self._core.board.unwatch(key, (self.task_id, path))

    def release(self, agent: str, path: str, after: Drain = ()) -> None:
        """Give an agent back."""
        releasing = {**self._core.task(self.task_id).agents.releasing, agent: Releasing(path, after)}
        self._core.put_part(self.task_id, "agents", releasing=releasing)
        self._core.touch(self.task_id)

    def is_released(self, agent: str) -> bool:
        """Return whether the task no longer holds an agent."""
        return not any(agent in agents for agents in self._core.task(self.task_id).agents.roles.values())

    # -- goals -----------------------------------------------------------------------------------------------------
    def goal_id(self, path: str) -> str:
        """Return `<task>/<run>/<instance path>`; the path begins with the section."""
        return f"{self.task_id}/{self._core.task(self.task_id).run}/{path}"

    def order(self, order: GoalOrder) -> Failure | None:
        """Order a goal."""
        return self._goals.order(self.task_id, order)

    def goal(self, goal_id: str) -> GoalView:
        """Return a goal's record."""
        return self._core.state.goals[goal_id]

    def drop_goal(self, goal_id: str) -> None:
        """Forget an ended goal."""
        self._core.emit(ch.GoalDrop(goal_id))

    def cleanup(self, order: CleanupOrder, tree: Any = None) -> FinallyEnd | None:
        """Take over the `finally` of a stopped sequence."""
        return self.cleanups.take(order, tree)

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal; return whether to wait for its end."""
        return self._goals.cancel(goal_id)

    def is_over(self, end: End) -> bool:
        """Return whether what a drain set waits for is over."""
        return drains.is_over(self._core.state, self._core.task(self.task_id), end)

    def adopt(self, end: End, owner: str) -> None:
        """Change who is woken at an end."""
        drains.adopt(self._core, self.task_id, end, owner)

    def forget(self, end: End) -> None:
        """Drop what is over."""
        drains.forget(self._core, self.task_id, end)

    # -- other tasks -----------------------------------------------------------------------------------------------
    def start_task(self, order: TaskOrder) -> str | Failure:
        """Start another task."""
        return self._children.start(self.task_id, order)

    def child(self, task_id: str) -> TaskRecord:
        """Return a started task's record; it has the shape of a TaskView."""
        return self._core.task(task_id)

    def end_task(self, task_id: str) -> bool:
        """Abort a started task."""
        return self._children.end(task_id)

    # -- agents of a block -----------------------------------------------------------------------------------------
    def want_agents(self, path: str, roles: Mapping[str, Role], env: Env, but_not: tuple[str, ...]) -> Micros:
        """Ask the allocator."""
        request = self._requests.want(self.task_id, path, roles, env, but_not)
        return min(role.wait_until for role in request.roles if role.wait_until is not None)

    def take_agents(self, path: str) -> Served | None:
        """Return the allocator's answer, once."""
        served = self._core.task(self.task_id).agents.served
        if path in served:
            self._core.put_part(self.task_id, "agents", served={key: one for key, one in served.items() if key != path})
        return served.get(path)

    def withdraw_agents(self, path: str) -> tuple[str, ...]:
        """Ask no more."""
        served = self.take_agents(path)
        key = request_id(self.task_id, path)
        if key in self._core.state.requests:
            self._core.emit(ch.RequestPut(key, None))
        return tuple(agent for group in served.roles.values() for agent in group) if served is not None else ()

    # -- people ----------------------------------------------------------------------------------------------------
    def ask(self, order: AskOrder) -> None:
        """Open a question."""
        self._people.open(self.task_id, order)

    def question(self, ask_id: str) -> Question:
        """Return a question's record; it has the shape of a QuestionView."""
        return self._core.state.questions[ask_id]

    def close_question(self, ask_id: str) -> None:
        """Withdraw or forget a question."""
        self._people.close(ask_id)

    def people(self, site_role: str) -> tuple[str, ...]:
        """Return who has a site role."""
        return self._people.of_role(site_role)

    def notify(self, text: str, to: tuple[str, ...], severity: str, path: str) -> None:  # noqa: ARG002
        """Tell people."""
        self._core.effect(NotifyPeople(text, to, severity, self.task_id))  # type: ignore[arg-type]

    # -- names -----------------------------------------------------------------------------------------------------
    def open_scope(self, scope: str, values: Mapping[str, Any]) -> None:
        """Open a scope."""
        self._core.emit(ch.ScopePut(self.task_id, scope, dict(values)))

    def close_scope(self, scope: str) -> None:
        """Forget a scope."""
        if scope in self._core.state.scopes.get(self.task_id, {}):
            self._core.emit(ch.ScopePut(self.task_id, scope, None))

    def set_var(self, scope: str, name: str, value: Any) -> None:
        """Set a name, in the scope that it belongs to."""
        scopes = self._core.state.scopes[self.task_id]
        while THROUGH in scopes[scope] and name not in scopes[scope]:
            scope = scopes[scope][AROUND]
        self._core.emit(ch.VarPut(self.task_id, scope, name, value))
