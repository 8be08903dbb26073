"""The virtual driver: what comes first at one instant, and that it never waits."""

import pytest

from formiga_bt.base.clock import SECOND, VirtualScheduler
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.timers import AllocationDue, LiveDue
from formiga_bt.lang.types import AgentRef
from formiga_bt.transport.messages import AgentSeen, SendFailed, StatusArrived
from tests.unit.engine.drivers.conftest import FakeTransport, WatchedEngine, card, status

START = 1_000 * SECOND
MOVE = inp.Submit("MoveTask", {"robot": AgentRef("lwd_1")})


@pytest.fixture
def wire() -> FakeTransport:
    return FakeTransport()


@pytest.fixture
def driver(engine: WatchedEngine, wire: FakeTransport) -> VirtualDriver:
    driver = VirtualDriver(engine, [wire], VirtualScheduler(START))
    driver.start()
    return driver


def test_at_one_instant_the_world_comes_first_then_wall_timers_then_deadlines(
    engine: WatchedEngine, wire: FakeTransport, driver: VirtualDriver
) -> None:
    at = START + 50_000
    order: list[str] = []
    engine._wall = lambda due, at: order.append(due.agent)  # type: ignore[method-assign]
    engine._timer = lambda due: (order.append("timer"), engine.core.clear_deadline(due))[0]  # type: ignore[method-assign, func-returns-value]
    engine.core.set_deadline(AllocationDue(), at)
    driver._set_wall(LiveDue("w2"), 50_000)
    driver._set_wall(LiveDue("w1"), 50_000)
    driver.scheduler.call_at(at, lambda: order.append("world"))
    assert driver.run_until(lambda: len(order) == 4, at)
    assert order == ["world", "w2", "w1", "timer"]
    assert driver.scheduler.now() == at


def test_a_deadline_before_an_input_is_given_first_one_at_it_after(
    engine: WatchedEngine, driver: VirtualDriver
) -> None:
    driver.feed(MOVE)  # sets the allocator's timer
    due = engine.next_deadline()
    assert due is not None
    driver.scheduler.advance_to(due[0])
    driver.feed(inp.AgentGoneInput("nobody"))
    assert not engine.seen(inp.TimerDue)  # at the very deadline the input goes first
    driver.scheduler.advance_to(due[0] + 1)
    driver.feed(inp.AgentGoneInput("nobody"))
    kinds = [type(given).__name__ for _, given in engine.inputs[-2:]]
    assert kinds == ["TimerDue", "AgentGoneInput"]


def test_wall_timers_are_armed_anew_and_cleared(engine: WatchedEngine, driver: VirtualDriver) -> None:
    given: list[tuple[str, int]] = []
    engine._wall = lambda due, at: given.append((due.agent, at))  # type: ignore[method-assign]
    driver._set_wall(LiveDue("a"), 10_000)
    driver._set_wall(LiveDue("b"), 20_000)
    driver._set_wall(LiveDue("a"), 30_000)
    driver._set_wall(LiveDue("b"), None)
    driver.run_until(lambda: False, START + SECOND)
    assert given == [("a", START + 30_000)]


def test_beats_follow_the_virtual_second(wire: FakeTransport, driver: VirtualDriver) -> None:
    for second in range(1, 4):
        driver.scheduler.call_at(START + second * SECOND, lambda: None)
    driver.run_until(lambda: False, START + 10 * SECOND)
    beats = [beat.beat for beat in wire.beats]
    assert beats == sorted(beats)
    assert beats[-1] >= 1_002
    assert all(beat.engine_us == beat.wall_us for beat in wire.beats)


def test_what_the_wires_have_is_fed_in_order_with_the_time_of_its_coming(
    engine: WatchedEngine, wire: FakeTransport, driver: VirtualDriver
) -> None:
    wire.put(AgentSeen(card()), StatusArrived(status()), SendFailed("lwd_1", "goal", "g", "unknown", "lost"))
    driver.drain()
    assert [given for _, given in engine.inputs[1:]] == [
        inp.AgentSeenInput(card(), START, "fake"),
        inp.AgentStatusInput(status(), START, START),
        inp.EffectFailed("lwd_1", "goal", "g", "unknown", "lost"),
    ]


def test_a_send_that_fails_comes_back_as_an_input_a_moment_later(
    engine: WatchedEngine, wire: FakeTransport, driver: VirtualDriver
) -> None:
    failed = driver.switchboard.carry_out(inp.QueryGoal("nobody"), 1)
    assert failed is not None
    original = engine.handle

    def handle(now: int, given: inp.Input) -> inp.EngineStep:
        step = original(now, given)
        if isinstance(given, inp.AgentGoneInput):
            return inp.EngineStep(step.seq, now, given, step.changes, (inp.QueryGoal("nobody"),), "")
        return step

    engine.handle = handle  # type: ignore[method-assign]
    driver.feed(inp.AgentGoneInput("nobody"))
    driver.run_until(lambda: bool(engine.seen(inp.EffectFailed)), START + SECOND)
    assert engine.inputs[-1] == (START + 1, failed)


def test_it_ends_when_nothing_is_left_to_happen(driver: VirtualDriver) -> None:
    assert not driver.run_until(lambda: False, START + 3600 * SECOND)
    assert driver.next_time() is None
    assert driver.scheduler.now() < START + SECOND
    assert not driver.run_one()


def test_the_look_whether_an_agent_is_heard_of_is_no_step_while_it_is_and_on_time_when_it_is_not(
    engine: WatchedEngine, wire: FakeTransport, driver: VirtualDriver
) -> None:
    wire.put(AgentSeen(card()), StatusArrived(status()))
    driver.drain()
    for second in range(1, 61):
        driver.scheduler.call_at(START + second * SECOND, lambda n=second: wire.put(StatusArrived(status(seq=100 + n))))  # type: ignore[misc]
    silent = START + 60 * SECOND
    driver.run_until(lambda: False, silent + SECOND)
    assert not engine.seen(inp.WallDue)
    assert engine.state.agents["lwd_1"].liveness == "ALIVE"

    assert driver.run_until(lambda: engine.state.agents["lwd_1"].liveness == "SUSPECT", silent + 10 * SECOND)

    assert driver.scheduler.now() == silent + 3 * SECOND
    assert engine.seen(inp.WallDue) == [inp.WallDue(LiveDue("lwd_1"), silent + 3 * SECOND)]
    assert driver.run_until(lambda: engine.state.agents["lwd_1"].liveness == "LOST", silent + 60 * SECOND)
    assert driver.scheduler.now() == silent + 30 * SECOND
