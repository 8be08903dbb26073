"""What only the Zenoh wire can get wrong: ports, malformed messages, engines that come and go."""

import subprocess
import threading
import time
from collections.abc import Callable, Iterator

import msgspec
import pytest
from rigs import Rig, ZenohRig

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TransportError
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import AgentCard, AgentSeen, BadMessage, ClockBeat, GoalRequest, StatusArrived
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_agent import ZenohAgentLink, ZenohObserver

pytestmark = pytest.mark.network


def now() -> int:
    return time.monotonic_ns() // 1000


class Idle:
    def start(self, request: GoalRequest) -> str:
        return "raised" if request.fields.get("bad") else ""

    def cancel(self, goal_id: str) -> bool:
        return True


class Agent:
    """An agent in this process, on a session of its own, pumped by a thread."""

    def __init__(self, rig: ZenohRig, name: str, agent_type: str = "drone") -> None:
        self.link = ZenohAgentLink(rig.site, connect=rig.zenoh.endpoint)
        self.card = AgentCard(id=name, type=agent_type, boot_id="b1", actions=("Go",))
        self.side = AgentSide(self.card, Idle(), self.link, now=now)
        self.stop = threading.Event()
        self.link.serve(self.side)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self) -> None:
        while not self.stop.is_set():
            self.link.pump(0.02)

    def close(self) -> None:
        self.stop.set()
        self.thread.join(2)
        self.link.close()


@pytest.fixture
def engine(zenoh_rig: ZenohRig) -> ZenohRig:
    zenoh_rig.log.clear()
    return zenoh_rig


@pytest.fixture
def make(engine: ZenohRig) -> Iterator[Callable[..., Agent]]:
    made: list[Agent] = []

    def make_agent(name: str, agent_type: str = "drone") -> Agent:
        made.append(Agent(engine, name, agent_type))
        return made[-1]

    yield make_agent
    for agent in made:
        agent.close()


def test_a_taken_port_is_a_transport_error_with_a_way_out(engine: ZenohRig) -> None:
    second = ZenohTransport("other", listen=engine.zenoh.endpoint)
    with pytest.raises(TransportError, match="another engine running"):
        second.open(lambda: None)
    second.close()


def test_a_bad_site_name_is_a_transport_error() -> None:
    with pytest.raises(TransportError, match="cannot be part of a Zenoh key"):
        ZenohTransport("a/b", listen="tcp/127.0.0.1:0").open(lambda: None)


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (b"{nonsense", "JSON"),
        (b"", "truncated"),
        (b"\xff\xfe", ""),
        (b'{"id":"bad_1","type":"drone","battery":NaN}', "invalid character"),
        (b'{"id":"bad_1","type":"drone","battery":1e999}', "out of range"),
        (b'{"id":"bad_1","type":"drone","battery":"full"}', "Expected"),
        (b'{"id":"another","type":"drone","boot_id":"b","seq":1,"stamp":1}', "'another' came from 'bad_1'"),
        (b'{"id":"bad_1","type":"drone","boot_id":"b","stamp":1}', "missing required field `seq`"),
        (b'{"id":"bad_1","type":"boat","boot_id":"b","seq":1,"stamp":1}', "a boat came from a drone"),
        (b"[" * 50_000, ""),
        (b'"' + b"x" * 300_000 + b'"', "300002 bytes"),
    ],
)
def test_a_bad_status_is_reported_and_nothing_breaks(
    engine: ZenohRig, make: Callable[..., Agent], raw: bytes, text: str
) -> None:
    agent = make("bad_1")
    engine.event(AgentSeen, lambda e: e.card.id == "bad_1")
    agent.link._put("drone/bad_1/status", raw, None)
    assert text in engine.event(BadMessage, lambda e: e.agent == "bad_1").text
    mark = len(engine.log)
    agent.side.publish_status(battery=50.0)
    engine.event(StatusArrived, lambda e: e.status.id == "bad_1" and e.status.battery == 50.0, since=mark)


def test_an_event_of_another_agent_is_a_bad_message(engine: ZenohRig, make: Callable[..., Agent]) -> None:
    agent = make("liar")
    engine.event(AgentSeen, lambda e: e.card.id == "liar")
    agent.link._put("drone/liar/action/Go/event", b'{"goal_id":"x","agent":"victim","state":"succeeded"}', None)
    assert "victim" in engine.event(BadMessage, lambda e: e.agent == "liar").text


def test_an_id_that_is_in_use_by_another_type_is_a_bad_message(engine: ZenohRig, make: Callable[..., Agent]) -> None:
    make("twin")
    engine.event(AgentSeen, lambda e: e.card.id == "twin")
    make("twin", "boat")
    assert "same id" in engine.event(BadMessage, lambda e: e.agent == "twin").text


def test_a_changed_card_is_seen_again(engine: ZenohRig, make: Callable[..., Agent]) -> None:
    agent = make("card_1")
    engine.event(AgentSeen, lambda e: e.card.id == "card_1")
    mark = len(engine.log)
    agent.link.publish_card(msgspec.structs.replace(agent.card, limits={"speed_m_s": 3.0}))
    assert engine.event(AgentSeen, since=mark).card.limits == {"speed_m_s": 3.0}


def test_a_request_the_agent_cannot_read_is_refused(engine: ZenohRig, make: Callable[..., Agent]) -> None:
    make("strict")
    engine.event(AgentSeen, lambda e: e.card.id == "strict")
    goal = engine.goal("strict", ttl_beats="ten")
    refusal = engine.reported(goal, "rejected")
    assert refusal.code == "refused"
    assert "ttl_beats" in refusal.text


def test_another_sites_agents_are_not_heard(engine: ZenohRig) -> None:
    stranger = ZenohAgentLink("elsewhere", connect=engine.zenoh.endpoint)
    card = AgentCard(id="stranger", type="drone", boot_id="b", actions=())
    stranger.serve(AgentSide(card, Idle(), stranger, now=now))
    try:
        Rig.restart(engine, "neighbour")
        assert not [e for e in engine.log if isinstance(e, AgentSeen) and e.card.id == "stranger"]
    finally:
        stranger.close()


def test_an_engine_that_starts_again_finds_its_agents_and_cancels_what_it_no_longer_knows() -> None:
    rig = ZenohRig()
    try:
        agent = rig.new_peer()
        goal = rig.goal(agent, do="hold")
        rig.reported(goal, "accepted")
        rig.transport.close()
        rig.zenoh = ZenohTransport(rig.site, listen=rig.zenoh.endpoint, reply_timeout_s=1.0, lease_ms=2500)
        rig.transport = rig.zenoh
        rig.log.clear()
        rig.transport.open(rig.woken.set)
        rig.event(AgentSeen, lambda e: e.card.id == agent)
        assert rig.query(agent, goal).goals[0].state == "accepted"
        rig.transport.cancel_goal(agent, goal)
        rig.reported(goal, "canceled")
    finally:
        rig.close()


def test_an_agent_may_start_before_its_engine() -> None:
    rig = ZenohRig()
    endpoint = rig.zenoh.endpoint
    rig.transport.close()
    try:
        rig.start("early", "b1")
        rig.zenoh = rig.transport = ZenohTransport(rig.site, listen=endpoint, lease_ms=2500)
        rig.transport.open(rig.woken.set)
        assert rig.event(AgentSeen, lambda e: e.card.id == "early").card.boot_id == "b1"
    finally:
        rig.close()


def test_closing_is_bounded_while_an_agent_stands_still() -> None:
    rig = ZenohRig()
    agent = rig.new_peer()
    rig.freeze(agent)
    try:
        for _ in range(50):
            rig.goal(agent, do="succeed", padding="x" * 100_000)
        began = time.monotonic()
        rig.transport.close()
        rig.transport.close()
        assert time.monotonic() - began < 2.5
    finally:
        process: subprocess.Popen[bytes] = rig.running[agent]
        process.kill()
        process.wait(5)
        rig.close()


def test_an_observer_hears_agents_and_the_clock(engine: ZenohRig, make: Callable[..., Agent]) -> None:
    agent = make("seen_1")
    engine.event(AgentSeen, lambda e: e.card.id == "seen_1")
    observer = ZenohObserver(engine.site, connect=engine.zenoh.endpoint)
    observer.open("*/*/motion", "engine/clock")
    heard: dict[str, bytes] = {}

    def both() -> bool | None:
        agent.link.publish_extra("motion", {"t0_us": 0})
        engine.transport.publish_clock(ClockBeat(wall_us=0, engine_us=SECOND, speed=1.0, epoch=0, beat=0))
        heard.update(observer.poll())
        return len(heard) == 2 or None

    try:
        engine.wait(both, "motion and clock")
    finally:
        observer.close()
    assert heard["drone/seen_1/motion"] == b'{"t0_us":0}'
