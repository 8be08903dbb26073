"""Helpers for tests of trees and engines: the shipped world, agents that do what a test says, and checks that hold always.

bench = Bench(site, catalogue, tasks)            the production engine in virtual time, no agents yet
drone = bench.agent("hwd_1", "hwd", at=port)     an agent that does what the test says
task = bench.submit("PickUp", {...}); bench.run_for(5)
drone.succeed(); bench.run_for(1)
bench.check()                                    what must hold after every run
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.machines import Mobility
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import Alarm, Effect, EngineStep
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.kernel.state import EngineState, fold, snapshot
from formiga_bt.lang.compose import compose
from formiga_bt.lang.loader import load_task, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.memory import MemoryHub, MemoryLink
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalRequest, Landed

E = TypeVar("E")
BASE = Place(0.0, 0.0)


@cache
def packaged_world(site: str = "demo-site.yaml") -> tuple[Site, Catalogue]:
    """Return a site that ships with formiga_bt, by its file below `trees/`, and its catalogue."""
    world = compose(folder("trees") / site)
    assert world.site is not None, world.diagnostics
    return world.site, world.catalogue


@cache
def packaged_task(name: str, site: str = "demo-site.yaml") -> Task:
    """Return a task that ships with formiga_bt, by its file below `trees/` without `.yaml`, for a site that ships."""
    place, catalogue = packaged_world(site)
    loaded = load_task(folder("trees") / f"{name}.yaml", catalogue=catalogue, site=place)
    assert loaded.task is not None, loaded.diagnostics
    return loaded.task


def task_of(text: str, site: Site, catalogue: Catalogue, name: str = "Try") -> Task:
    """Return the checked task of a text; `formiga:` and `task:` are put before it."""
    loaded = load_task_text(f"formiga: 1\ntask: {name}\n{text}", "try.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None, [str(d) for d in loaded.diagnostics if d.severity == "error"]
    return loaded.task


def folded(steps: Iterable[EngineStep]) -> EngineState:
    """Return the state that the changes of recorded steps lead to, from nothing."""
    state, board = EngineState(), Blackboard()
    for step in steps:
        fold(state, board, step)
    return state


class ScriptedAgent:
    """An agent over the memory wire whose body is the test (an `AgentBody`).

    Goals run until the test ends them, unless `auto` gives their action a duration in seconds. It reports each second.
    """

    def __init__(
        self,
        hub: MemoryHub,
        agent: str,
        kind: str,
        *,
        at: Place | Position = BASE,
        actions: Sequence[str] = (),
        mobility: Mobility = "air",
        auto: Mapping[str, float] | None = None,
        landed: Landed = "grounded",
        effects: Mapping[str, str] | None = None,
        moves: Mapping[str, str] | None = None,
    ) -> None:
        self.id, self.kind, self.mobility, self.actions = agent, kind, mobility, tuple(actions)
        self.auto = dict(auto or {})
        self.effects = dict(effects or {})
        """What `landed` is after an action that succeeded."""
        self.moves = dict(moves or {})
        """Which field of an action says where the agent is after it."""
        self.requests: list[GoalRequest] = []
        """Every goal begun, in order."""
        self.cancels: list[str] = []
        self.rejects: list[str] = []
        """Codes with which the next goals are refused."""
        self.ends: list[str] = []
        """How the next goals of `auto` end: "succeeded" (then also when the list is over), or the code of a failure."""
        self.takes_cancel = True
        self.confirms_cancel = True
        self.silent = False
        """Publishes no status by itself."""
        self._hub = hub
        self._boots = 0
        self._fields: dict[str, Any] = {
            "position": at if isinstance(at, Position) else Position(at.east_m, at.north_m, 0.0),
            "landed": landed,
            "battery": 100.0,
        }
        self.boot()

    def boot(self) -> None:
        """Start (again): a new process that remembers no goal."""
        self._boots += 1
        card = AgentCard(
            id=self.id,
            type=self.kind,
            boot_id=f"{self.id}-{self._boots}",
            actions=self.actions,
            mobility=self.mobility,
        )
        self.link: MemoryLink = self._hub.link(self.id)
        self.side = AgentSide(card, self, self.link, now=self._hub.scheduler.now)
        self.side.set_status(**self._fields)
        self.link.serve(self.side)
        self._beat(self._boots)

    def kill(self) -> None:
        """End the process without a word."""
        self._boots += 1
        self._hub.kill(self.id)

    @property
    def goal(self) -> GoalRequest:
        """Return the newest goal that runs."""
        return self.side.active[-1]

    @property
    def done(self) -> list[str]:
        """Return the actions of every goal begun."""
        return [request.action for request in self.requests]

    def say(self, **fields: Any) -> None:
        """Change fields of the status and publish it."""
        self._fields.update(fields)
        self.side.publish_status(**fields)

    def tell(self, **fields: Any) -> None:
        """Publish one status with these fields as they are, right or wrong."""
        status = AgentStatus(**{**_plain(self.side.status), "seq": self.side.status.seq + 1, **fields})
        self.link.publish_status(status)

    def succeed(self, result: dict[str, Any] | None = None, **fields: Any) -> None:
        """End the newest goal well."""
        self._finish(self.goal, "succeeded", "", result or {}, fields)

    def fail(self, code: str = "broken") -> None:
        """End the newest goal badly."""
        self._finish(self.goal, "failed", code, {}, {})

    def answer(self, word: str) -> None:
        """Answer the newest question, as a person."""
        self.succeed({"answer": word, "by": self.id, "at": self._hub.scheduler.now()})

    def _finish(self, goal: GoalRequest, state: Any, code: str, result: dict[str, Any], fields: dict[str, Any]) -> None:
        if state == "succeeded" and self.mobility != "people":
            to = goal.fields.get(self.moves.get(goal.action, ""))
            fields = {
                **_moved(goal, to, self._fields["position"], self.effects.get(goal.action) == "airborne"),
                **fields,
            }
            if self.effects.get(goal.action):
                fields = {"landed": self.effects[goal.action], **fields}
        self._fields.update(fields)
        self.side.set_status(**fields)
        self.side.finish(goal.goal_id, state, code=code, result=result)

    # An AgentBody.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or refuse it."""
        if self.rejects:
            return self.rejects.pop(0)
        self.requests.append(request)
        if request.action in self.auto:
            how = self.ends.pop(0) if self.ends else "succeeded"
            at = self._hub.scheduler.now() + round(self.auto[request.action] * SECOND)
            state, code = ("succeeded", "") if how == "succeeded" else ("failed", how)
            self._hub.scheduler.call_at(at, lambda: self._finish(request, state, code, {}, {}))
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Stop, as the test wants it."""
        self.cancels.append(goal_id)
        if self.takes_cancel and self.confirms_cancel:
            self.side.finish(goal_id, "canceled")
        return self.takes_cancel

    def _beat(self, boot: int) -> None:
        def report() -> None:
            if boot != self._boots:
                return
            if not self.silent:
                self.side.publish_status()
            self._beat(boot)

        self._hub.scheduler.call_at(self._hub.scheduler.now() + SECOND, report)


def _plain(status: AgentStatus) -> dict[str, Any]:
    return {name: getattr(status, name) for name in AgentStatus.__struct_fields__}


def _moved(goal: GoalRequest, to: Any, here: Position, up: bool) -> dict[str, Any]:
    if to:
        return {"position": Position(to["east_m"], to["north_m"], to.get("up_m", 0.0))}
    if up and "altitude" in goal.fields:
        return {"position": Position(here.east_m, here.north_m, float(goal.fields["altitude"]))}
    return {}


class Bench(Rehearsal):
    """A rehearsal whose agents do what the test says."""

    def __init__(self, site: Site, catalogue: Catalogue, tasks: Iterable[Task], **options: Any) -> None:
        super().__init__(site, catalogue, tasks, (), **options)
        self.site = site
        self.catalogue = catalogue

    def agent(self, agent: str, kind: str, *, at: Place | Position | None = None, **options: Any) -> ScriptedAgent:
        """Add an agent; a machine stands at its own port unless `at` says otherwise. Then let it be seen."""
        spec = self.catalogue.types[kind]
        listed = self.site.agents.get(agent)
        spot = self.site.ports.get(listed.home) or self.site.stations.get(listed.home) if listed else None
        where = at or (listed.at if listed else None) or (spot.at if spot else Place(0.0, 0.0))
        actions = self.catalogue.actions
        options = {
            "actions": spec.actions,
            "mobility": spec.mobility,
            "effects": {name: action.effect for name, action in actions.items()},
            "moves": {name: action.moves_to for name, action in actions.items()},
            **options,
        }
        made = ScriptedAgent(self.hub, agent, kind, at=where, **options)
        self.run_for(0.5)
        return made

    def record(self, agent: str) -> AgentRecord:
        """Return what the engine knows of an agent."""
        return self.engine.state.agents[agent]

    def check(self) -> None:
        """Check what must hold after every run (see `check_rehearsal`)."""
        check_rehearsal(self)


def effects(rehearsal: Rehearsal, kind: type[E]) -> list[E]:
    """Return the effects of one kind, in order."""
    return [effect for step in rehearsal.steps for effect in step.effects if isinstance(effect, kind)]


def alarms(rehearsal: Rehearsal) -> list[str]:
    """Return the codes of all alarms."""
    return [alarm.code for alarm in effects(rehearsal, Alarm)]


def find(rehearsal: Rehearsal, test: Callable[[Effect], bool]) -> EngineStep:
    """Return the first step with an effect that fits."""
    return next(step for step in rehearsal.steps if any(test(effect) for effect in step.effects))


def check_rehearsal(rehearsal: Rehearsal) -> None:
    """Check what must hold after every run.

    Folding the recorded steps gives the live state, byte for byte; ended tasks leave nothing behind; no machine is in the
    air without a task, an order or a quarantine; the referee saw no crash.
    """
    state = rehearsal.engine.state
    assert snapshot(folded(rehearsal.steps)) == snapshot(state), "the fold of the journal differs from the live state"
    ended = {task.id for task in state.tasks.values() if task.section == "done"}
    for task in state.tasks.values():
        assert (task.status in ("SUCCEEDED", "FAILED", "CANCELED")) == (task.id in ended), task
    left = {
        "goals": [goal.id for goal in state.goals.values() if goal.task in ended],
        "questions": [q.id for q in state.questions.values() if q.task in ended],
        "memory": [task for task in ended if state.memory.get(task) or state.scopes.get(task)],
        "deadlines": [timer for timer, deadline in state.deadlines.items() if deadline.task in ended],
        "agents": [agent.id for agent in state.agents.values() if agent.task in ended and not agent.human],
        "clearances": [c.agent for c in state.clearances.values() if c.task in ended and c.state != "given"],
    }
    assert not any(left.values()), f"left behind: {left}"
    for agent in state.agents.values():
        idle = not agent.task and agent.pool != "QUARANTINED" and not agent.human
        fresh = agent.liveness == "ALIVE" and agent.control == "engine"
        if idle and fresh and agent.landed == "airborne":
            flown = any(agent.id in task.agents.granted for task in state.tasks.values())
            assert not flown, f"{agent.id} was left in the air"
    verdict = rehearsal.referee.verdict(rehearsal.now)
    assert verdict.is_clean, verdict
