"""Ours: `Engine.handle`, fed by hand. What a step costs here includes its record, its changes and its goals."""

import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from benchmarks.peers.trees import Node, task_text
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Position
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.types import AgentRef
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalEvent, GoalState

CATALOGUE = """\
types:
  worker: {label: worker, human: true, shared: true, actions: [Work], suspect_after: 1 h, lost_after: 2 h}
  cart: {label: cart, mobility: air, actions: [Roll], recover: back.yaml#Back, suspect_after: 1 h, lost_after: 2 h}
actions:
  Roll: {repeatable: true}
  Work: {fields: {leaf: {type: text}}, repeatable: true, concurrency: 1000000}
"""
BACK = """\
formiga: 1
subtrees:
  Back: {params: {one: agent}, steps: [{do: one.Roll}]}
"""
SITE = """\
formiga_site: 1
name: bench
base: {lat: 66.5, lng: 25.7, ground_msl: 120 m}
terrain: {flat: true, relief: 1 m}
people: {watchers: [worker_0]}
agents:
  worker_0: {type: worker}
actions: []
"""
START = 1_000_000 * SECOND
PORTION = 1000
"""So many requests wait at once: an engine queues 10,000 at most."""
STATUS = {"SUCCEEDED": "success", "FAILED": "failure"}


def world() -> tuple[Site, Catalogue]:
    """Return a site with one worker whom many tasks may address."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "catalogue.yaml").write_text(CATALOGUE, encoding="utf-8")
        (here / "back.yaml").write_text(BACK, encoding="utf-8")
        (here / "site.yaml").write_text(SITE, encoding="utf-8")
        catalogue, found, _ = load_catalogue([here / "catalogue.yaml"], [here])
        assert not found, found
        site, found, _ = load_site(here / "site.yaml", catalogue)
        assert site is not None, found
        return site, catalogue


class OurFleet:
    """One engine with so many tasks.

    Args:
        text: of the task.
        count: how many.
        start: engine time at which it begins.
    """

    def __init__(self, text: str, count: int, start: Micros = START) -> None:
        site, catalogue = world()
        loaded = load_task_text(text, "peer.yaml", catalogue=catalogue, site=site)
        assert loaded.task is not None, loaded.diagnostics
        self.task = loaded.task.name
        self.engine = Engine(site, catalogue, {self.task: loaded.task})
        self.now = start
        self.ids: list[str] = []
        self.goals: dict[str, dict[str, str]] = {}
        """Task -> action -> its goal."""
        self.n = 0
        self.give(inp.Started(1))
        card = AgentCard(id="worker_0", type="worker", boot_id="b", actions=("Work",), mobility="people")
        self.give(inp.AgentSeenInput(card))
        status = AgentStatus(
            id="worker_0", type="worker", boot_id="b", seq=1, stamp=0, position=Position(0.0, 0.0, 0.0)
        )
        self.give(inp.AgentStatusInput(status))
        self.carts: list[str] = []
        if "who" in loaded.task.params:
            self._add_carts(count)
        while len(self.ids) < count:
            self.submit(min(PORTION, count - len(self.ids)))

    def submit(self, count: int) -> list[str]:
        """Submit so many tasks and let them start; return their ids."""
        new = []
        for number in range(len(self.ids), len(self.ids) + count):
            params = {"who": AgentRef(self.carts[number])} if self.carts else {}
            reply = self.give(inp.Submit(self.task, params)).reply
            assert isinstance(reply, Accepted), reply
            new.append(reply.task)
        self.ids += new
        self.let(SECOND)
        return new

    def give(self, given: inp.Input) -> inp.EngineStep:
        """Hand in an input and note the goals that it ordered."""
        step = self.engine.handle(self.now, given)
        for effect in step.effects:
            if isinstance(effect, inp.SendGoal):
                task = effect.goal_id.split("/", 1)[0]
                self.goals.setdefault(task, {})[effect.fields["leaf"]] = effect.goal_id
        return step

    def let(self, us: int) -> None:
        """Let so much time pass."""
        until = self.now + us
        while (due := self.engine.next_deadline()) is not None and due[0] <= until:
            self.now = max(self.now, due[0])
            self.give(inp.TimerDue(due[1]))
        self.now = until

    def idle_round(self) -> None:
        """Ask when something is due, once for all trees: that is all."""
        self.engine.next_deadline()

    def _add_carts(self, count: int) -> None:
        """Let a machine for each task announce itself: what the task watches."""
        self.carts = [f"cart_{number}" for number in range(count)]
        for number, cart in enumerate(self.carts):
            self.give(inp.AgentSeenInput(AgentCard(id=cart, type="cart", boot_id="b", actions=("Roll",))))
            self.give(self._charge(number, 90.0))

    def _charge(self, number: int, percent: float) -> inp.AgentStatusInput:
        self.n += 1
        status = AgentStatus(
            id=self.carts[number],
            type="cart",
            boot_id="b",
            seq=self.n,
            stamp=self.now,
            battery=percent,
            position=Position(5.0 * number, 5.0, 0.0),
            landed="grounded",
        )
        return inp.AgentStatusInput(status)

    def news(self, trees: Sequence[int]) -> None:
        if self.carts:
            for tree in trees:
                self.give(self._charge(tree, 50.0 + self.n % 400 / 10))
            return
        for tree in trees:
            goal = next(iter(self.goals[self.ids[tree]].values()))
            self.give(self.event(goal, "running"))

    burst = news

    def results(self, trees: Sequence[int], action: str, ok: bool = True) -> None:
        if self.carts:
            assert ok, "a wait for a charge only succeeds"
            for tree in trees:
                self.give(self._charge(tree, 10.0))
            return
        for tree in trees:
            goal = self.goals[self.ids[tree]].pop(action)
            self.give(self.event(goal, "succeeded" if ok else "failed"))

    def event(self, goal: str, state: GoalState) -> inp.GoalEventInput:
        """Return news of a goal."""
        self.n += 1
        return inp.GoalEventInput(
            GoalEvent(goal_id=goal, agent="worker_0", state=state, n=self.n, code="no" if state == "failed" else "")
        )

    def status(self, tree: int) -> str:
        return STATUS.get(self.engine.state.tasks[self.ids[tree]].status, "running")

    def running(self, tree: int) -> frozenset[str]:
        if self.carts:
            return frozenset({"deep"} if self.status(tree) == "running" else ())
        return frozenset(self.goals.get(self.ids[tree], {}))

    def close(self) -> None:
        self.ids.clear()


class Ours:
    """formiga_bt itself."""

    name = "formiga_bt"
    given = "Engine.handle: each step with its record, its changes, its goals; requested, granted and started as in operation"
    lacks: tuple[str, ...] = ()
    most = 1_000_000

    def version(self) -> str:
        return version("formiga-bt")

    def build(self, tree: Node, name: str, count: int) -> OurFleet:
        return OurFleet(task_text(name, tree), count)
