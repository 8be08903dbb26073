"""An engine that is killed at a chosen step, and another one that goes on over the same fleet, in virtual time.

The fleet's own ledger judges: which goal ids each body began, and where it was told to go.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.transport.messages import GoalRequest
from tests.reloading import loaded, written

When = Literal["lost", "kept"]
"""A step whose commit did not come about, or one that was committed and whose effects never left."""


class Killed(Exception):  # noqa: N818 - it is no error
    """The engine's process is gone."""


class Begun(Struct, frozen=True):
    """A goal that a body began."""

    agent: str
    goal: str
    action: str
    fields: dict[str, Any]


class Killer:
    """A `Persist` that ends the engine at a step, counted from when it was set."""

    def __init__(self, flight: Rehearsal, after: int, when: When) -> None:
        self.flight, self.when = flight, when
        self.left = after
        self.shot = written(flight.engine.state)
        self.again: tuple[Any, ...] = ()

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        """Keep steps, or die."""
        (step,) = steps
        self.left -= 1
        dies = self.left <= 0
        if not dies or self.when == "kept":
            if dies or self.left == 1:
                self.shot = written(self.flight.engine.state)
            self.again = tuple(e for e in step.effects if isinstance(e, inp.CancelGoal | inp.NotifyPeople | inp.Alarm))
        if dies and self.when == "kept":
            self.flight.steps.append(step)  # it is in the journal, and nobody was told of it
        if dies:
            raise Killed
        return DURABLE


class Crashing:
    """A rehearsal whose engine may be killed.

    Args:
        flight: with its fleet added.
    """

    def __init__(self, flight: Rehearsal) -> None:
        self.flight = flight
        self.begun: list[Begun] = []
        self.seen: list[inp.EngineStep] = flight.steps
        self.shot = b""
        self.again: tuple[Any, ...] = ()
        self.killed_at = 0
        for agent in flight.sim.agents.values():
            self._watch(agent.front)

    def _watch(self, body: Any) -> None:
        start: Callable[[GoalRequest], str] = body.start

        def begin(request: GoalRequest) -> str:
            code = start(request)
            if not code:
                self.begun.append(Begun(request.agent, request.goal_id, request.action, dict(request.fields)))
            return code

        body.start = begin

    def kill_at(self, after: int, when: When = "kept") -> None:
        """Let the engine die with the step that comes so many after now."""
        self.flight.driver._persist = Killer(self.flight, after, when)

    def run(self, limit_s: float = 7200.0) -> bool:
        """Run until all tasks have ended; return False if the engine was killed before."""
        try:
            assert self.flight.run_until_ended(limit_s=limit_s), self.story()
        except Killed:
            self.die()
            return False
        return True

    def die(self) -> None:
        """The engine's process ends here."""
        killer = self.flight.driver._persist
        self.shot = killer.shot if isinstance(killer, Killer) else written(self.flight.engine.state)
        self.again = killer.again if isinstance(killer, Killer) else ()
        self.killed_at = self.flight.now
        self.flight.driver.close()

    def away(self, seconds: float) -> None:
        """Let the world go on alone."""
        scheduler = self.flight.scheduler
        limit = scheduler.now() + round(seconds * SECOND)
        while (at := scheduler.next_time()) is not None and at <= limit:
            scheduler.run_next()
        scheduler.advance_to(limit)

    def resume(self, away_s: float = 2.0, *, state: EngineState | None = None, **given: Any) -> inp.EngineStep:
        """Go on with another engine from what the killed one had kept; return its first step.

        Args:
            away_s: for how long there is no engine.
            state: instead of what a `Killer` has kept.
            given: fields of `Resumed`.
        """
        self.away(away_s)
        flight = self.flight
        old = flight.engine.core
        state = loaded(self.shot) if state is None else state
        flight.engine = Engine(
            old.site, old.catalogue, old.models, state=state, resumes=True, without=given.get("poison", ())
        )
        flight.driver = VirtualDriver(
            flight.engine, [flight.hub.transport], flight.scheduler, listeners=[self.seen.append]
        )
        now = flight.now
        said: dict[str, Any] = {
            "epoch": state.epoch + 1, "at": state.now, "since": self.killed_at, "wall": now, "heard": now,
            "again": self.again, "lost": flight.engine.unbuilt,
        }  # fmt: skip
        step = flight.driver.feed(inp.Resumed(**{**said, **given}))
        flight.driver._publish_clock()
        return step

    # -- what is judged ----------------------------------------------------------------------------------------------
    def twice(self) -> list[str]:
        """Return the ids of goals that a body began more than once."""
        return [goal for goal, n in Counter((one.agent, one.goal) for one in self.begun).items() if n > 1]

    def again_begun(self) -> list[str]:
        """Return the steps that were begun by more than one goal: whose next attempt, or next run, was flown."""
        steps = Counter(re.sub(r"@[\d+]+(?=$|~)", "", one.goal) for one in self.begun)
        return [step for step, n in steps.items() if n > 1]

    def legs(self) -> list[tuple[str, str, str]]:
        """Return what the machines were told to do, in order: agent, action and where to."""
        flown = [one for one in self.begun if one.action in ("TakeOff", "GoTo", "LandIn", "Explore")]
        return [(one.agent, one.action, repr(sorted(one.fields.items()))) for one in flown]

    def alarms(self) -> list[str]:
        """Return the alarms of all engines."""
        return [e.text for step in self.seen for e in step.effects if isinstance(e, inp.Alarm)]

    def story(self) -> str:
        """Return how it stands, for the message of a failed test."""
        state = self.flight.engine.state
        lines = [
            f"{t.id} {t.status} {t.section} held={t.hold.words} {t.outcome.code} {t.outcome.reason}"
            for t in state.tasks.values()
        ]
        lines += [f"{a.id} {a.liveness} {a.pool} {a.landed} {a.control} goal={a.goal}" for a in state.agents.values()]
        lines += [f"{g.id} {g.state} {g.code} {g.text}" for g in state.goals.values()]
        return "\n".join([*lines, repr(state.resume), *self.alarms()[-5:]])
