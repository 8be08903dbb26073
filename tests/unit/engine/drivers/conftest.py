"""A site, a catalogue and a wire that records, for drivers."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from formiga_bt.base.clock import Micros
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import EngineStep, Input
from formiga_bt.lang.loader import load_catalogue, load_site, load_task
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.transport.messages import AgentCard, AgentStatus, ClockBeat, GoalRequest, TransportEvent

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="session")
def world() -> tuple[Site, Catalogue, Task]:
    catalogue, _, _ = load_catalogue([ROOT / "actions" / "base.yaml"])
    site, _, _ = load_site(ROOT / "trees" / "demo-site.yaml")
    assert site is not None
    task = load_task(ROOT / "trees" / "move_task.yaml", catalogue=catalogue, site=site).task
    assert task is not None
    return site, catalogue, task


@pytest.fixture
def engine(world: tuple[Site, Catalogue, Task]) -> "WatchedEngine":
    site, catalogue, task = world
    return WatchedEngine(site, catalogue, {task.name: task})


class WatchedEngine(Engine):
    """An engine that notes its inputs, and may be told to fail or to dawdle at one."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.inputs: list[tuple[Micros, Input]] = []
        self.before: Callable[[Input], None] = lambda given: None

    def handle(self, now: Micros, given: Input) -> EngineStep:
        self.before(given)
        self.inputs.append((now, given))
        return super().handle(now, given)

    def seen(self, kind: type) -> list[Input]:
        return [given for _, given in self.inputs if isinstance(given, kind)]


class FakeTransport:
    """A wire that notes what is sent and hands over what a test puts in."""

    name = "fake"
    guarantees = GUARANTEES

    def __init__(self) -> None:
        self.incoming: list[TransportEvent] = []
        self.goals: list[GoalRequest] = []
        self.cancels: list[str] = []
        self.beats: list[ClockBeat] = []
        self.is_open = False
        self.opens = self.closes = 0
        self.fails: list[Exception] = []
        self._wake: Callable[[], None] = lambda: None

    def open(self, wake: Callable[[], None]) -> None:
        if self.fails:
            raise self.fails.pop(0)
        self._wake, self.is_open = wake, True
        self.opens += 1

    def close(self) -> None:
        self.is_open = False
        self.closes += 1

    def poll(self) -> Sequence[TransportEvent]:
        events, self.incoming = self.incoming, []
        return events

    def put(self, *events: TransportEvent) -> None:
        self.incoming = [*self.incoming, *events]
        self._wake()

    def send_goal(self, request: GoalRequest) -> None:
        if self.fails:
            raise self.fails.pop(0)
        self.goals.append(request)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        self.cancels.append(goal_id)

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None: ...

    def publish_clock(self, beat: ClockBeat) -> None:
        self.beats.append(beat)


def card(agent: str = "lwd_1", kind: str = "lwd", boot: str = "b1") -> AgentCard:
    return AgentCard(id=agent, type=kind, boot_id=boot, actions=("TakeOff", "GoTo", "LandIn"))


def status(
    agent: str = "lwd_1", kind: str = "lwd", seq: int = 1, boot: str = "b1", battery: float = 90.0
) -> AgentStatus:
    return AgentStatus(id=agent, type=kind, seq=seq, stamp=seq, boot_id=boot, battery=battery, landed="grounded")
