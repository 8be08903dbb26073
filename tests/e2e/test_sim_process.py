"""A simulated drone as an OS process over real Zenoh: flown, killed in flight, found again."""

import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest

from agents_sim.goalbook import read_books
from agents_sim.launch import FleetProcesses
from agents_sim.ledger import judge
from agents_sim.referee import Referee, Verdict
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from formiga_bt.transport.messages import (
    AgentGone,
    AgentSeen,
    AgentStatus,
    ClockBeat,
    GoalEvent,
    GoalReported,
    GoalRequest,
    QueryReplied,
    StatusArrived,
    TransportEvent,
)
from formiga_bt.transport.zenoh import ZenohTransport

pytestmark = pytest.mark.network

SPEED = 10.0
ENGINE_EPOCH_US = 2_000_000_000 * SECOND  # far from the wall clock: agents must take our time, not their own


class Engine:
    """As much of an engine as agents see: goals, a clock that beats, and ears."""

    def __init__(self) -> None:
        self.wire = ZenohTransport("sim-test", listen="tcp/127.0.0.1:0")
        self.heard: list[TransportEvent] = []
        self._began = time.monotonic()
        self._beat = 0
        self._next_beat = 0.0

    def now_us(self) -> int:
        return ENGINE_EPOCH_US + round((time.monotonic() - self._began) * SPEED * SECOND)

    def wait(self, is_met: Callable[[], bool], within_s: float = 20.0) -> None:
        end = time.monotonic() + within_s
        while not is_met():
            assert time.monotonic() < end, f"waited in vain; heard: {self.heard[-5:]}"
            self.step()
            time.sleep(0.01)

    def step(self) -> None:
        if time.monotonic() >= self._next_beat:
            self._next_beat = time.monotonic() + 1.0
            self._beat += 1
            beat = ClockBeat(wall_us=0, engine_us=self.now_us(), speed=SPEED, epoch=1, beat=self._beat)
            self.wire.publish_clock(beat)
        self.heard += self.wire.poll()

    def order(
        self,
        goal_id: str,
        action: str,
        agent: str = "hwd_1",
        ttl_beats: int = 10,
        link_silence_s: float | None = None,
        **fields: object,
    ) -> None:
        self.wire.send_goal(
            GoalRequest(
                goal_id=goal_id,
                agent=agent,
                action=action,
                fields=fields,
                epoch=1,
                beat=self._beat,
                ttl_beats=ttl_beats,
                link_silence_s=link_silence_s,
            )
        )

    def boots(self) -> list[str]:
        return [event.card.boot_id for event in self.heard if isinstance(event, AgentSeen)]

    def events(self, goal_id: str) -> list[GoalEvent]:
        return [e.event for e in self.heard if isinstance(e, GoalReported) and e.event.goal_id == goal_id]

    def has_ended(self, goal_id: str, state: str = "succeeded") -> bool:
        return state in [event.state for event in self.events(goal_id)]

    def status(self) -> AgentStatus | None:
        statuses = [event.status for event in self.heard if isinstance(event, StatusArrived)]
        return statuses[-1] if statuses else None


@pytest.fixture
def engine() -> Iterator[Engine]:
    engine = Engine()
    engine.wire.open(lambda: None)
    try:
        yield engine
    finally:
        engine.wire.close()


def test_a_drone_killed_in_flight_is_found_hovering_there(engine: Engine, tmp_path: Path) -> None:
    spec = AgentSpec(id="hwd_1", type="hwd", at=Place(0.0, -20.0), battery=90.0)
    with FleetProcesses([spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: bool(engine.boots()))
        engine.wait(lambda: (s := engine.status()) is not None and s.stamp >= ENGINE_EPOCH_US and s.beat > 0)

        began = time.monotonic()
        engine.order("up", "TakeOff", altitude=60.0)
        engine.wait(lambda: engine.has_ended("up"))
        assert 1.5 < time.monotonic() - began < 8.0  # 20 s of engine time at speed 10

        engine.order("leg", "GoTo", to={"east_m": 900.0, "north_m": -20.0, "up_m": 60.0})  # 90 s: 9 s of wall time
        engine.wait(lambda: (s := engine.status()) is not None and s.position is not None and s.position.east_m > 100)
        before = engine.status()
        fleet.kill("hwd_1")
        engine.wait(lambda: any(isinstance(event, AgentGone) for event in engine.heard))

        fleet.restart("hwd_1")
        engine.wait(lambda: len(set(engine.boots())) == 2)
        new_boot = engine.boots()[-1]
        engine.wait(lambda: (s := engine.status()) is not None and s.boot_id == new_boot and s.beat > 0)
        found = engine.status()
        assert before is not None
        assert found is not None
        assert (found.landed, found.status) == ("airborne", "STANDBY")
        assert before.position is not None
        assert found.position is not None
        # It flew on for what passed between its last status and its death, at 100 m per second of wall time.
        assert before.position.east_m - 1.0 <= found.position.east_m < 800.0
        assert found.position.up_m == 60.0
        assert 50.0 < found.battery < before.battery
        engine.wire.query_goals("hwd_1", ["leg"])
        engine.wait(lambda: any(isinstance(event, QueryReplied) for event in engine.heard))
        replied = next(event for event in engine.heard if isinstance(event, QueryReplied))
        assert [goal.state for goal in replied.goals] == ["unknown"]

        at = {"east_m": found.position.east_m, "north_m": found.position.north_m}
        engine.order("down", "LandIn", at=at)
        engine.wait(lambda: engine.has_ended("down"))
        pid = fleet.pid("hwd_1")
    assert fleet.ended() == {"hwd_1": 0}, fleet.log_of("hwd_1").read_text()
    assert not Path(f"/proc/{pid}").exists()

    referee = Referee()
    verdict = referee.verdict(judge(tmp_path, referee))
    assert verdict.is_clean
    assert referee.statistics()["drones"] == 1


def test_a_person_answers_and_the_pilot_takes_over(engine: Engine, tmp_path: Path) -> None:
    specs = [
        AgentSpec(id="picker_1", type="picker", script=[{"match": "loaded", "options": ["loaded"], "after": "4 s"}]),
        AgentSpec(id="hwd_1", type="hwd", limits={"climb_m_s": 2.0}),
    ]
    with FleetProcesses(specs, site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: len(engine.boots()) == 2)
        engine.order("ask", "Confirm", agent="picker_1", question="On board?", options=["not_yet", "loaded"])
        engine.wait(lambda: engine.has_ended("ask"))
        assert engine.events("ask")[-1].result["answer"] == "loaded"

        engine.order("up", "TakeOff", altitude=100.0)
        engine.wait(lambda: engine.has_ended("up", "running"))
        fleet.take_over("hwd_1")
        engine.wait(lambda: engine.has_ended("up", "taken_over"))
        fleet.freeze("picker_1")  # and a frozen process ends all the same
    assert set(fleet.ended()) == {"picker_1", "hwd_1"}


def test_the_referee_process_sees_a_crash_of_two_processes(engine: Engine, tmp_path: Path) -> None:
    specs = [
        AgentSpec(id="hwd_1", type="hwd", at=Position(0.0, 0.0, 60.0)),
        AgentSpec(id="hwd_2", type="hwd", at=Position(200.0, 0.0, 61.0)),
    ]
    words = ["-m", "agents_sim.watch", "--site", "sim-test", "--connect", engine.wire.endpoint]
    words += ["--exit-with-parent", str(os.getpid())]
    referee = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE)
    try:
        with FleetProcesses(specs, site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path):
            engine.wait(lambda: len(engine.boots()) == 2)
            engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
            engine.order("there", "GoTo", to={"east_m": 200.0, "north_m": 0.0, "up_m": 60.0})
            engine.order("back", "GoTo", agent="hwd_2", to={"east_m": 0.0, "north_m": 0.0, "up_m": 61.0})
            engine.wait(lambda: engine.has_ended("there") and engine.has_ended("back"))
            end = time.monotonic() + 2.5  # its verdict is a little late
            engine.wait(lambda: time.monotonic() > end)
        referee.terminate()
        printed, _ = referee.communicate(timeout=10)
    finally:
        referee.kill()
        referee.wait()
    verdict = msgspec.json.decode(printed, type=Verdict)
    assert referee.returncode == 1
    assert [(crash.a, crash.b) for crash in verdict.crashes] == [("hwd_1", "hwd_2")]
    assert 1.0 <= verdict.crashes[0].distance_m < 2.0


def test_a_process_that_stood_still_refuses_what_is_too_old(engine: Engine, tmp_path: Path) -> None:
    spec = AgentSpec(id="hwd_1", type="hwd")
    with FleetProcesses([spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        fleet.freeze("hwd_1")
        engine.order("old", "TakeOff", ttl_beats=1, altitude=30.0)
        end = time.monotonic() + 2.2
        engine.wait(lambda: time.monotonic() > end)
        fleet.thaw("hwd_1")
        engine.wait(lambda: engine.has_ended("old", "rejected"))
        assert engine.events("old")[-1].code == "goal_expired"


def test_a_drone_flies_on_while_nothing_of_it_can_be_written(engine: Engine, tmp_path: Path) -> None:
    """No file of its process can grow, as on a full disk: also not the log that its stderr is."""
    spec = AgentSpec(id="hwd_1", type="hwd", at=Place(0.0, -20.0))
    book, log = tmp_path / "hwd_1.goals.jsonl", tmp_path / "hwd_1.log"
    with FleetProcesses([spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        before = resource.prlimit(fleet.pid("hwd_1"), resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        engine.order("up", "TakeOff", altitude=10.0)
        engine.wait(lambda: engine.has_ended("up"))
        assert (book.read_bytes(), log.read_bytes()) == (b"", b"")

        resource.prlimit(fleet.pid("hwd_1"), resource.RLIMIT_FSIZE, before)
        engine.wait(lambda: book.read_bytes().count(b"\n") == 2)
        engine.wait(lambda: b"written again" in log.read_bytes())
        assert fleet.is_running("hwd_1")
    assert [(note.goal, note.state) for note in read_books(tmp_path)] == [("up", "begun"), ("up", "succeeded")]
    told = log.read_text(encoding="utf-8").splitlines()
    assert re.fullmatch(r"hwd_1: \S+ cannot be written \(File too large\); it goes on, and writes again .*", told[0])
    assert told[1:] == ["hwd_1: its files are written again"]
    referee = Referee()
    assert referee.verdict(judge(tmp_path, referee)).is_clean
