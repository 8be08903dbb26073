"""Places at which an engine kills itself (SIGKILL), so that tests can see that what follows a crash is right.

    FORMIGA_FAILPOINT=after_commit:17 formiga up        dies at the 17th time that it passes there

Off unless the environment names one; no file, no request and no task can. They stand around the driver's seams, what keeps
steps and the wires, and only while one is set: without, an engine has nothing of them. Called by `cli.operator.up` and
`services.host`.
"""

import os
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from formiga_bt.base.errors import SiteError
from formiga_bt.engine.drivers.persist import Outcome, Persist, PersistAhead
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.transport.base import AgentTransport, TellsSite
from formiga_bt.transport.messages import TERMINAL, ClockBeat, GoalRequest, SiteMessage, TransportEvent, UpdateRequest

VARIABLE: Final = "FORMIGA_FAILPOINT"
POINTS: Final[Mapping[str, str]] = {
    "before_commit": "steps with an order for an agent were taken, nothing of them is on disk",
    "after_commit": "steps with an order for an agent are on disk, nothing has left",
    "after_send": "an order has left, its acknowledgement has not come",
    "after_result": "a goal's end was taken, it is not on disk",
    "in_cleanup": "an order or the end of a goal of on_failure, on_abort, finally or recover is on disk",
    "in_reconcile": "after a restart, while agents are asked what became of their goals",
    "in_snapshot": "a snapshot of the state is written, and not committed",
}
"""Where an engine can be killed, and how things stand there."""
LEAVES_S: Final = 0.05
"""An order that was given to a wire has left the process after this."""

_ORDERS: Final = (inp.SendGoal, inp.CancelGoal, inp.UpdateGoalFields)


def kill(text: str) -> None:
    """End this process at once, without any tidying up; say which point it was."""
    os.write(2, f"failpoint {text}: killed\n".encode())
    os.kill(os.getpid(), signal.SIGKILL)


class Failpoint:
    """One place, and how often it is passed before the process dies there.

    Args:
        point: one of `POINTS`.
        at: dies at this passing, from 1.
        die: what dying is.
    """

    def __init__(self, point: str, at: int = 1, die: Callable[[str], None] = kill) -> None:
        self.point, self.at = point, at
        self.passed = 0
        self._die = die

    def passing(self, point: str) -> None:
        """Note that the engine is at a point; it may not come back from here."""
        if point == self.point:
            self.passed += 1
            if self.passed == self.at:
                if point == "after_send":
                    time.sleep(LEAVES_S)
                self._die(f"{point}:{self.at}")

    def persist(self, inner: Persist, state: Callable[[], EngineState]) -> "FailingPersist":
        """Stand around what keeps steps; what keeps them ahead goes on doing so."""
        if isinstance(inner, PersistAhead):
            return FailingAhead(self, inner, state)
        return FailingPersist(self, inner, state)

    def wire(self, inner: AgentTransport) -> "FailingWire":
        """Stand around a wire."""
        return FailingWire(self, inner)


def named(environment: Mapping[str, str], mode: str) -> Failpoint | None:
    """Return the point that the environment names, None if there is none.

    Args:
        environment: of the process.
        mode: of the site.

    Raises:
        SiteError: there is no such point, or the site is real.
    """
    text = environment.get(VARIABLE, "").strip()
    if not text:
        return None
    point, _, number = text.partition(":")
    if point not in POINTS:
        known = "\n".join(f"    {name:<14} {what}" for name, what in POINTS.items())
        raise SiteError(f"{VARIABLE}={text}: there is no point {point!r}", help=f"one of\n{known}")
    if number and not (number.isascii() and number.isdigit() and int(number)):
        raise SiteError(f"{VARIABLE}={text}: {number!r} is no number from 1", help=f"{VARIABLE}={point}:17")
    if mode == "real":
        raise SiteError(
            f"{VARIABLE} kills the engine, and this site is in mode real; nothing was started",
            help=f"unset {VARIABLE}; failpoints are for sites in mode simulation",
        )
    return Failpoint(point, int(number or 1))


class FailingPersist:
    """Keeps steps by another, and passes points before and after."""

    def __init__(self, failpoint: Failpoint, inner: Persist, state: Callable[[], EngineState]) -> None:
        self._failpoint, self._inner, self._state = failpoint, inner, state

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        """Keep steps; see `Persist.keep`."""
        self._before(steps)
        kept = self._inner.keep(steps)
        self._after(steps)
        return kept

    def _before(self, steps: Sequence[inp.EngineStep]) -> None:
        if _has_orders(steps):
            self._failpoint.passing("before_commit")
        if any(_is_end(step.input) for step in steps):
            self._failpoint.passing("after_result")

    def _after(self, steps: Sequence[inp.EngineStep]) -> None:
        if _has_orders(steps):
            self._failpoint.passing("after_commit")
        if any(_is_cleanup(goal) for step in steps for goal in _goals(step)):
            self._failpoint.passing("in_cleanup")
        resume = self._state().resume
        if resume is not None and resume.phase != "watching":
            self._failpoint.passing("in_reconcile")


class FailingAhead(FailingPersist):
    """As `FailingPersist`, around what keeps steps in three parts (`PersistAhead`)."""

    def __init__(self, failpoint: Failpoint, inner: PersistAhead, state: Callable[[], EngineState]) -> None:
        super().__init__(failpoint, inner, state)
        self._ahead = inner
        self._steps: Sequence[inp.EngineStep] = ()

    def start(self, steps: Sequence[inp.EngineStep]) -> bool:
        """Write steps; see `PersistAhead.start`."""
        self._before(steps)
        self._steps = steps
        return self._ahead.start(steps)

    def commit(self) -> None:
        """Make them durable."""
        self._ahead.commit()

    def finish(self) -> Outcome:
        """Return what became of them."""
        kept = self._ahead.finish()
        self._after(self._steps)
        return kept


def _has_orders(steps: Sequence[inp.EngineStep]) -> bool:
    return any(isinstance(effect, _ORDERS) for step in steps for effect in step.effects)


def _is_end(given: inp.Input) -> bool:
    if isinstance(given, inp.QueryReplyInput):
        return any(goal.state in TERMINAL for goal in given.goals)
    return isinstance(given, inp.GoalEventInput) and given.event.state in TERMINAL


def _goals(step: inp.EngineStep) -> list[str]:
    """Return the goals that a step orders, or that end with it."""
    found = [effect.goal_id for effect in step.effects if isinstance(effect, _ORDERS)]
    if isinstance(step.input, inp.GoalEventInput) and _is_end(step.input):
        found.append(step.input.event.goal_id)
    return found


def _is_cleanup(goal_id: str) -> bool:
    """Return whether a goal, by its id `<task>/<run>/<section>/<path>`, tidies up after a task."""
    parts = goal_id.split("/")
    return len(parts) > 3 and parts[2].partition(":")[0] in ("on_failure", "on_abort", "finally", "recover")


class FailingWire:
    """Another wire, and a point after each order that leaves."""

    def __init__(self, failpoint: Failpoint, inner: AgentTransport) -> None:
        self._failpoint, self._inner = failpoint, inner
        self.name, self.guarantees = inner.name, inner.guarantees

    def open(self, wake: Callable[[], None]) -> None:
        """Open the wire."""
        self._inner.open(wake)

    def close(self) -> None:
        """Close it."""
        self._inner.close()

    def poll(self) -> Sequence[TransportEvent]:
        """Return what came in."""
        return self._inner.poll()

    def send_goal(self, request: GoalRequest) -> None:
        """Send a goal, and perhaps die."""
        self._inner.send_goal(request)
        self._failpoint.passing("after_send")

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Send a cancel, and perhaps die."""
        self._inner.cancel_goal(agent, goal_id)
        self._failpoint.passing("after_send")

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what an agent knows."""
        self._inner.query_goals(agent, goal_ids)

    def send_update(self, update: UpdateRequest) -> None:
        """Send other fields for a goal that runs, and perhaps die."""
        self._inner.send_update(update)
        self._failpoint.passing("after_send")

    def publish_site(self, message: SiteMessage) -> None:
        """Tell agents of the site, where the wire can."""
        if isinstance(self._inner, TellsSite):
            self._inner.publish_site(message)

    def publish_clock(self, beat: ClockBeat) -> None:
        """Publish the engine's clock."""
        self._inner.publish_clock(beat)
