"""A small world for random missions: carts and people that do what a script says, over the memory wire, in virtual time.

All delays are whole or half seconds and the wire has none, so that events, deadlines and orders often fall on one instant.
"""

import tempfile
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler
from formiga_bt.base.geo import Position
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreesFactory
from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.memory import MemoryHub
from formiga_bt.transport.messages import AgentCard, GoalRequest

START: Micros = 1_000_000 * SECOND
STATUS_EVERY = 10 * SECOND
CARTS = ("c1", "c2", "c3")
PEOPLE = ("ann", "bob")
CART_ACTIONS = ("Move", "Haul", "Home")

CATALOGUE = """\
types:
  cart:
    label: cart
    mobility: air
    actions: [Move, Haul, Home]
    events:
      ping: {n: int}
      pong: {}
    recover: back.yaml#Back
    suspect_after: 15 s
    lost_after: 25 s
  person:
    label: person
    human: true
    shared: true
    actions: [Confirm]
    suspect_after: 1 h
    lost_after: 2 h
actions:
  Move:
    fields: {far: {type: int, default: 1}}
    result: {ok: bool, n: int}
    repeatable: true
    cancel_grace: 6 s
    typical: 500 ms
  Haul: {result: {ok: bool, n: int}, cancel_grace: 6 s, typical: 500 ms}
  Home: {effect: {airborne: false}, repeatable: true, typical: 500 ms}
  Confirm:
    fields:
      question: {type: text}
      options: {list: text}
    result: {answer: text, by: text, at: time, form: any}
    repeatable: true
    typical: 500 ms
"""
BACK = """\
formiga: 1
subtrees:
  Back:
    params: {one: agent}
    steps:
      - do: one.Home
        retry: {attempts: 2, delay: 1 s}
"""
SITE = """\
formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7, ground_msl: 120 m}
ports:
  a: {at: {east: 0 m, north: 0 m}}
  b: {at: {east: 40 m, north: 0 m}}
  c: {at: {east: 80 m, north: 0 m}}
terrain: {flat: true, relief: 1 m}
people: {watchers: [ann, bob]}
resources: {lift: {capacity: 1}, bay: {capacity: 2}}
agents:
  c1: {type: cart, home: a}
  c2: {type: cart, home: b}
  c3: {type: cart, home: c}
  ann: {type: person}
  bob: {type: person}
"""


@cache
def yard() -> tuple[Site, Catalogue]:
    """Return the site and the catalogue of all random missions."""
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        for file, text in (("catalogue.yaml", CATALOGUE), ("back.yaml", BACK), ("site.yaml", SITE)):
            (here / file).write_text(text, encoding="utf-8")
        catalogue, found, _ = load_catalogue([here / "catalogue.yaml"], [here])
        assert not found, found
        site, found, _ = load_site(here / "site.yaml")
        assert site is not None, found
        return site, catalogue


class Deed(Struct, frozen=True):
    """What an agent makes of its next goal: how it ends and after how long, and how it takes a cancel."""

    end: str = "succeeded"
    """succeeded, failed, rejected, never; bad = a result that cannot be read; lost = succeeds, but the result is lost."""
    after: float = 1.0
    ok: bool = True
    n: int = 1
    cancel: str = "confirm"
    """confirm (after `cancel_after`), at_once, refuse, never = say canceling and nothing more."""
    cancel_after: float = 0.5
    follows: str = ""
    """How it takes other fields while it runs: empty = it follows; else the code of its refusal."""


class Event(Struct, frozen=True):
    """Something that happens to the mission from outside, at a time in seconds."""

    at: float
    what: str
    whom: str = ""


class Scripted:
    """The body of one agent (an `AgentBody`): goals end as its deeds say, in order; without more, they succeed."""

    def __init__(self, world: "World", agent: str, deeds: Iterable[Deed]) -> None:
        self.world = world
        self.agent = agent
        self.human = agent in PEOPLE
        self.deeds = list(deeds)
        self.running: dict[str, Deed] = {}
        self.boots = 0
        self.side: AgentSide | None = None
        self.landed = "grounded"
        self.battery = 80.0
        self.drift = 0.0
        self.told = 0
        self.log: list[tuple[str, str]] = []
        self.boot()

    def boot(self) -> None:
        self.boots += 1
        world, boot = self.world, self.boots
        link = world.hub.link(self.agent)
        card = AgentCard(
            id=self.agent,
            type="person" if self.human else "cart",
            boot_id=f"{self.agent}-{boot}",
            actions=("Confirm",) if self.human else CART_ACTIONS,
            mobility="people" if self.human else "air",
        )
        self.running.clear()
        self.side = AgentSide(card, self, link, now=world.scheduler.now)
        self.set_status()
        link.serve(self.side)
        if not self.human:
            self.report(boot)

    def set_status(self) -> None:
        assert self.side is not None
        east = 40.0 * CARTS.index(self.agent) if not self.human else -30.0
        self.side.set_status(battery=self.battery, position=Position(east + self.drift, 0.0, 0.0), landed=self.landed)

    def show(self) -> None:
        """Tell what is new at once."""
        if self.side is not None:
            self.set_status()
            self.side.publish_status()

    def report(self, boot: int) -> None:
        def again() -> None:
            if self.side is not None and self.boots == boot and not self.world.closed:
                self.side.publish_status()
                self.report(boot)

        self.world.scheduler.call_at(self.world.scheduler.now() + STATUS_EVERY, again)

    def start(self, request: GoalRequest) -> str:
        self.log.append(("start", request.goal_id))
        deed = self.deeds.pop(0) if self.deeds else Deed()
        if deed.end == "rejected":
            return "not_now"
        self.running[request.goal_id] = deed
        if deed.end != "never":
            self.later(deed.after, lambda: self.finish(request, deed))
        return ""

    def later(self, after: float, call: Any) -> None:
        boot = self.boots
        at = self.world.scheduler.now() + round(after * SECOND)
        self.world.scheduler.call_at(at, lambda: call() if boot == self.boots and self.side is not None else None)

    def finish(self, request: GoalRequest, deed: Deed) -> None:
        assert self.side is not None
        if self.running.pop(request.goal_id, None) is None:
            return
        if deed.end == "failed":
            self.side.finish(request.goal_id, "failed", code="stuck", text="stuck in the mud")
            return
        result: dict[str, Any] = {"ok": deed.ok, "n": deed.n}
        if self.human:
            options = request.fields["options"]
            answer = options[deed.n % len(options)]
            result = {"answer": answer, "by": self.agent, "at": self.world.scheduler.now()}
            if request.fields.get("form"):
                result["form"] = {"many": deed.n} if deed.n != 3 else {"many": 11}
        elif deed.end == "bad":
            result = {"ok": "perhaps", "n": "many"}
        if request.action in ("Haul", "Home"):  # whoever has hauled needs to be brought home
            self.landed = "airborne" if request.action == "Haul" else "grounded"
            self.set_status()
        if deed.end == "lost":
            self.world.hub.lose_results(self.agent)
        self.side.finish(request.goal_id, "succeeded", result=result)

    def cancel(self, goal_id: str) -> bool:
        self.log.append(("cancel", goal_id))
        deed = self.running.get(goal_id, Deed())
        if deed.cancel == "refuse":
            return False
        if deed.cancel == "at_once":
            self.canceled(goal_id)
        elif deed.cancel == "confirm":
            self.later(deed.cancel_after, lambda: self.canceled(goal_id))
        return True

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        self.log.append(("update", f"{goal_id} {sorted(fields.items())}"))
        return self.running.get(goal_id, Deed()).follows

    def canceled(self, goal_id: str) -> None:
        assert self.side is not None
        if self.running.pop(goal_id, None) is not None:
            self.side.finish(goal_id, "canceled")

    def change(self, what: str) -> None:
        """Let something happen that live conditions look at."""
        match what:
            case "low" | "full" | "pulse":
                self.battery = 80.0 if what == "full" else 40.0
            case "rise" | "sink":
                self.landed = "airborne" if what == "rise" else "grounded"
            case "drift":
                self.drift += 150.0
        self.show()
        if what == "pulse":  # too short for whoever would poll
            self.later(0.05, lambda: self.change("full"))

    def tell(self, event: str) -> None:
        assert self.side is not None
        self.told += 1
        self.side.report_event(event, **({"n": self.told} if event == "ping" else {}))

    def take_over(self) -> None:
        if self.side is not None:
            self.running.clear()
            self.side.take_control("pilot")

    def hand_back(self) -> None:
        if self.side is not None:
            self.side.take_control("engine")

    def kill(self) -> None:
        self.side = None
        self.boots += 1
        self.world.hub.kill(self.agent)


class World:
    """One engine, its agents and the events of one mission."""

    def __init__(
        self,
        tasks: Iterable[Task],
        deeds: Mapping[str, Iterable[Deed]],
        events: Iterable[Event],
        *,
        trees: TreesFactory = CompiledTrees,
        watch: Any = None,
    ) -> None:
        site, catalogue = yard()
        self.closed = False
        self.scheduler = VirtualScheduler(START)
        self.hub = MemoryHub(self.scheduler, delay_us=0)
        self.models = {task.name: task for task in tasks}
        self.engine = Engine(site, catalogue, self.models, trees=trees)
        if getattr(trees, "looks_at_everything", False):
            self._wake_all_on_any_change()
        self.steps: list[EngineStep] = []
        self.statuses: list[dict[str, dict[str, str]]] = []
        self.watch = watch
        self.driver = VirtualDriver(self.engine, [self.hub.transport], self.scheduler, listeners=[self._note])
        self.driver.start()
        self.frozen: dict[str, None] = {}
        self.bodies = {one: Scripted(self, one, deeds.get(one, ())) for one in (*CARTS, *PEOPLE)}
        for event in events:
            at = START + round(event.at * SECOND)
            self.scheduler.call_at(at, lambda event=event: self.happen(event))  # type: ignore[misc]

    def _wake_all_on_any_change(self) -> None:
        core, emit = self.engine.core, self.engine.core.emit

        def emit_and_wake(change: ch.Change) -> None:
            emit(change)
            if isinstance(change, ch.AgentPut | ch.VarPut):
                for task in self.engine.runs.open:
                    core.wake(task, "")

        core.emit = emit_and_wake  # type: ignore[method-assign]

    def _note(self, step: EngineStep) -> None:
        self.steps.append(step)
        self.statuses.append({task: self.engine.statuses(task) for task in self.engine.runs.open})
        if self.watch is not None:
            self.watch(self, step)

    def open_tasks(self) -> list[str]:
        return [task.id for task in self.engine.state.tasks.values() if task.section != "done"]

    def happen(self, event: Event) -> None:
        body = self.bodies.get(event.whom)
        match event.what:
            case "submit":
                self.driver.feed(inp.Submit(event.whom))
            case "abort" | "now" | "abandon":
                how = "" if event.what == "abort" else event.what
                for task in self.open_tasks()[:1]:
                    self.driver.feed(inp.Abort(task, how, "ann"))  # type: ignore[arg-type]
            case "kill" if body is not None and body.side is not None:
                body.kill()
                self.frozen.pop(event.whom, None)
            case "restart" if body is not None and body.side is None:
                body.boot()
            case "freeze" if body is not None and body.side is not None and event.whom not in self.frozen:
                self.frozen[event.whom] = None
                self.hub.freeze(event.whom)
            case "thaw" if event.whom in self.frozen:
                del self.frozen[event.whom]
                self.hub.thaw(event.whom)
            case "take_over" if body is not None:
                body.take_over()
            case "hand_back" if body is not None:
                body.hand_back()
                self.scheduler.call_at(self.scheduler.now(), lambda: self._handback_end(event.whom))
            case "low" | "full" | "pulse" | "rise" | "sink" | "drift" if body is not None:
                body.change(event.what)
            case "ping" | "pong" if body is not None and body.side is not None:
                body.tell(event.what)
            case "hold" | "continue":
                self.driver.feed(inp.Operator(event.what, event.whom, "ann"))
            case "clear":
                self.driver.feed(inp.Operator("clear", event.whom, "ann"))

    def _handback_end(self, agent: str) -> None:
        self.driver.feed(inp.Operator("handback_end", agent, "ann"))

    def run(self, limit_s: float = 240.0) -> None:
        """Let the mission run; then mend everything and end what has not ended."""
        self._until(limit_s)
        for round_ in range(4):
            for agent in CARTS:
                for what in ("thaw", "restart", "hand_back", "clear"):
                    self.happen(Event(0.0, what, agent))
                self.driver.drain()
            for task in self.open_tasks():
                self.driver.feed(inp.Abort(task, "abandon" if round_ == 3 else "now", "ann"))
            self._until(limit_s + 90.0 * (round_ + 1))
            if not self.open_tasks():
                break
        self.closed = True

    def _until(self, limit_s: float) -> None:
        limit = START + round(limit_s * SECOND)
        last = START + round(45 * SECOND)
        self.driver.run_until(
            lambda: not self.open_tasks() and self.scheduler.now() > last and bool(self.engine.state.tasks), limit
        )
