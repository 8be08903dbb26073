"""What the trees of one task wait for: deadlines, live conditions, events of agents."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.pace import Pace
from formiga_bt.engine.kernel.state import event_key
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.engine.tasks.taskmemory import TaskMemory
from formiga_bt.engine.tasks.watching import watch_keys
from formiga_bt.lang.model import Expr


class Watched(NamedTuple):
    """What a node with live conditions is woken by: blackboard keys, and instants at which a comparison with `now` turns."""

    keys: tuple[str, ...]
    conditions: tuple[Expr, ...]
    instants: tuple[Micros, ...]
    stamp: int = -1
    """Of the task's names when the keys were found; -1 = they depend on more than those."""


class TaskWaits(TaskMemory):
    """Implements `TimeRun` and `WatchRun`."""

    def __init__(self, core: Core, task_id: str) -> None:
        super().__init__(core, task_id)
        self._watched: dict[str, Watched] = {}
        self._pace = Pace(core, task_id)

    @property
    def now(self) -> Micros:
        """Return the instant of the step."""
        return self._core.state.now

    @property
    def clock(self) -> Micros:
        """Return the task's own time, which stands still while it is held."""
        return self._core.task(self.task_id).hold.clock.at(self.now)

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

    def unwatch(self, path: str) -> None:
        """Forget a watch."""
        self._core.instants.drop(self.task_id, path)
        watched = self._watched.pop(path, None)
        for key in watched.keys if watched else ():
            self._core.board.unwatch(key, (self.task_id, path))

    def watch_event(self, path: str, agent: str, event: str) -> None:
        """Wake a node at each event of that name that an agent tells."""
        key = event_key(agent, event)
        self._watched[path] = Watched((key,), (), ())
        self._core.board.watch(key, (self.task_id, path))

    def watch_agents(self, path: str, fields: Sequence[tuple[str, str]]) -> None:
        """Wake a node when one of these (agent, field) changes."""
        records = [(self._core.state.agents[agent], field) for agent, field in fields]
        keys = tuple(f"/fleet/{one.type}/{one.id}/{field}" for one, field in records)
        self._watched[path] = Watched(keys, (), ())
        for key in keys:
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
