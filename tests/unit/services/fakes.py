"""An engine of paper for tests of what people read: it answers as it is told, and changes the view's state itself."""

from collections.abc import Callable
from typing import Any

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.changes import Change
from formiga_bt.engine.kernel.inputs import EngineStep, Input, TimerDue
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder, TaskAgents, TaskRecord, TaskRequest
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.engine.kernel.timers import TurnDue
from formiga_bt.lang.model import Site
from formiga_bt.services.refused import Refused
from formiga_bt.services.stops import Stops
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import hint_for

NOW = 1000 * SECOND


def machine(name: str, **fields: Any) -> AgentRecord:
    """Return a drone that flies for PickUp-3, unless said otherwise."""
    given = {
        "type": "hwd", "liveness": "ALIVE", "present": True, "control": "engine", "landed": "airborne", "home": "p3",
        "task": "PickUp-3", "pool": "ASSIGNED", "battery": 60.0, **fields,
    }  # fmt: skip
    return AgentRecord(id=name, **given)


def task(name: str = "PickUp-3", *agents: str, **fields: Any) -> TaskRecord:
    """Return a task in its steps that was granted these agents."""
    given = {
        "name": name.split("-")[0], "order": 1, "request": TaskRequest(bundle=""), "status": "ACTIVE", "section": "steps",
        "agents": TaskAgents(roles={"drone": agents} if agents else {}, granted=agents), **fields,
    }  # fmt: skip
    return TaskRecord(id=name, **given)


def order(agent: str, stop: Any, **fields: Any) -> StandingOrder:
    """Return an order of eve for one machine."""
    return StandingOrder(**{"agent": agent, "stop": stop, "by": "eve", "scope": "agent", "at": NOW, **fields})


class Paper:
    """Stops over a view, without an engine: `then` says what the next order changes, `refuse` that it is refused."""

    def __init__(self, *, preflight: bool = False) -> None:
        self.view = EngineView(1)
        self.view.start()
        self.asked: list[Input] = []
        self._then: tuple[Change, ...] = ()
        self._error: TaskError | None = None
        self._seq = 0
        site = Site(name="meadow", lat=66.5, lng=25.7, preflight=preflight)
        self.stops = Stops(self._ask, self.view, site, lambda: NOW)

    def put(self, *changes: Change) -> None:
        """Change the state."""
        self._seq += 1
        self.view.feed_step(EngineStep(self._seq, NOW, TimerDue(TurnDue()), changes, ()))
        self.view.catch_up()

    def then(self, *changes: Change) -> None:
        """Let the next order change this."""
        self._then = changes

    def refuse(self, code: str, text: str = "no") -> None:
        """Let every order be refused."""
        self._error = TaskError(code, text)

    def _ask(self, given: Input) -> Done:
        self.asked.append(given)
        if self._error is not None:
            raise Refused(self._error.code, str(self._error), hint_for(self._error.code, getattr(given, "target", "")))
        self.put(*self._then)
        return Done()


def raised(call: Callable[[], object]) -> Refused:
    """Return the refusal that a call raises."""
    try:
        call()
    except Refused as refused:
        return refused
    raise AssertionError("it was not refused")
