"""`do` with `track`: what `with` reads is looked at every so often, and the agent is told where it goes now.

| at a look | what comes of it |
|---|---|
| the goal is not on its way, or is being stopped | nothing |
| no field differs from what the agent follows (places: by more than `within`) | nothing |
| one differs | the agent is asked to follow it; the gate judges that as it does a goal |
| the gate, the wire or the agent does not let it, or a value is not known | the old target stands |
| so for 10 s | the goal is canceled, and the step fails `no_update` when that has ended |

A goal that succeeds while it is being canceled counts: the work was done.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Final

from msgspec.structs import replace
from py_trees.common import Status

from formiga_bt.base.clock import SECOND, micros
from formiga_bt.base.geo import Place, Position, distance_m, horizontal_m
from formiga_bt.lang import model
from formiga_bt.lang.model import EvalError, UnknownState, Unset
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.base import RUNNING
from formiga_bt.nodes.leaves import DoNode
from formiga_bt.nodes.memory import DoMem, Following, Mem
from formiga_bt.nodes.run import Failure, GoalRun, GoalView

PATIENCE_US: Final = 10 * SECOND
"""So long an agent may go on to a target that has moved without taking a new one."""
WITHIN_M: Final = 1.0
SOONEST_US: Final = SECOND // 10
LATEST_US: Final = 10 * SECOND
"""How often is looked at least and most, whatever `every` says."""


class TrackingNode(DoNode):
    """`do` with `track`."""

    times: ClassVar[bool] = True

    def __init__(self, step: model.Do, track: model.Track) -> None:
        super().__init__(step)
        self.track = track
        self.following = Following(0, 0.0)

    def _send(self, run: GoalRun) -> Status:
        run.clear_deadline(self.key)  # of an earlier goal
        env, within = self.env(run), self.track.within
        every = min(max(micros(self.track.every.run(env)), SOONEST_US), LATEST_US)
        self.following = Following(every, WITHIN_M if within is None else float(within.run(env)))
        status = super()._send(run)
        if status is RUNNING:
            self._look_later(run)
        return status

    def memo(self, goal: str) -> DoMem:
        """Return the memory while a goal runs."""
        return DoMem(goal, self.sent, self.following)

    def on_proceed(self, run: GoalRun) -> Status:
        """Look at the goal, and at what moves when it is time for that."""
        view = run.goal(self.goal)
        if view.state == "canceled" and self.following.failure is not None:
            run.drop_goal(self.goal)
            return self.fail_as(self.following.failure)
        status = super().on_proceed(run)
        return self._look(run) if status is RUNNING and run.is_due(self.key) else status

    def is_quiet(self, run: GoalRun) -> bool:
        """Return whether the goal goes on, and it is not time to look."""
        return super().is_quiet(run) and not run.is_due(self.key)

    def on_restore(self, run: GoalRun, mem: Mem) -> None:
        """Wait for the same goal."""
        super().on_restore(run, mem)
        assert isinstance(mem, DoMem)
        assert mem.following is not None
        self.following = mem.following

    # -- looking ---------------------------------------------------------------------------------------------------
    def _look(self, run: GoalRun) -> Status:
        run.clear_deadline(self.key)
        view = run.goal(self.goal)
        if self.following.failure is not None:
            return RUNNING
        if view.state in ("sent", "accepted", "running"):
            self.following = self._followed(run, view)
        since = self.following.behind_since
        if since is not None and run.clock - since >= PATIENCE_US:
            return self._give_up(run, view)
        self._look_later(run)
        self.remember(run, self.memo(self.goal))
        return RUNNING

    def _look_later(self, run: GoalRun) -> None:
        every, since = self.following.every_us, self.following.behind_since
        left = every if since is None else since + PATIENCE_US - run.clock
        run.set_deadline(self.key, run.now + min(every, left))

    def _followed(self, run: GoalRun, view: GoalView) -> Following:
        """Tell the agent what has changed; return how far it follows."""
        was = self.following
        if view.turned_at != was.turned_at:
            was = replace(was, turned_at=view.turned_at, behind_since=None, why="")
        behind = run.clock if was.behind_since is None else was.behind_since
        try:
            changed = self._changed(run, view)
        except (UnknownState, Unset, EvalError) as unknown:
            return replace(was, behind_since=behind, why=f"where to cannot be computed ({unknown})")
        if not changed:
            return replace(was, behind_since=None, why="")
        why = run.change_goal(view.id, changed)
        return replace(was, behind_since=behind, why=why or view.no_update)

    def _changed(self, run: GoalRun, view: GoalView) -> dict[str, Any]:
        env = self.env(run, {"agent": AgentRef(view.agent)})
        now = {name: self.step.fields[name].run(env) for name in self.track.fields}
        return differing(now, view.fields, self.following.within_m)

    def _give_up(self, run: GoalRun, view: GoalView) -> Status:
        """Cancel the goal; the step fails once it has ended."""
        why = f": {self.following.why}" if self.following.why else ""
        reason = f"{view.agent} took no new target for {PATIENCE_US // SECOND} s{why}"
        again = view.repeatable
        failure = Failure("no_update", reason, self.path, view.agent, retryable=again, by_another=not again)
        if not run.cancel(self.goal):
            return self.fail_as(failure)
        self.following = replace(self.following, failure=failure)
        self.remember(run, self.memo(self.goal))
        return RUNNING


def differing(now: Mapping[str, Any], before: Mapping[str, Any], within_m: float) -> dict[str, Any]:
    """Return the values that differ from those before: places and positions by more than so many metres."""
    return {name: value for name, value in now.items() if not _near(value, before.get(name), within_m)}


def _near(one: Any, other: Any, within_m: float) -> bool:
    if isinstance(one, Position) and isinstance(other, Position):
        return distance_m(one, other) <= within_m
    if isinstance(one, Place) and isinstance(other, Place):
        return horizontal_m(one, other) <= within_m
    if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        return all(_near(a, b, within_m) for a, b in zip(one, other, strict=True))
    return bool(one == other)
