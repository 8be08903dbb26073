"""The realtime driver over a wire that records: order of timers, wall timers, replies, ends."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError, TransportError
from formiga_bt.base.geo import Position
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.drivers.realtime import TIMERS_A_TURN, EngineStopped, RealtimeDriver, standstill_us
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal
from formiga_bt.engine.kernel.timers import LiveDue, NodeDue, OrderDue, TurnDue
from formiga_bt.lang.types import AgentRef
from formiga_bt.transport.messages import AgentGone, AgentSeen, StatusArrived
from tests.golden import Wording
from tests.unit.engine.drivers.conftest import FakeTransport, WatchedEngine, card, status

MOVE = inp.Submit("MoveTask", {"robot": AgentRef("lwd_1")})


@pytest.fixture
def wire() -> FakeTransport:
    return FakeTransport()


@pytest.fixture
def driver(engine: WatchedEngine, wire: FakeTransport) -> Iterator[RealtimeDriver]:
    driver = RealtimeDriver(engine, [wire], speed=20.0)
    yield driver
    driver.stop()
    assert driver._thread is None or not driver._thread.is_alive()


def until(is_met: Callable[[], object]) -> None:
    end = time.monotonic() + 5.0
    while not is_met():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


@pytest.mark.parametrize("speed", [0.0, -1.0, 20.1, float("nan")])
def test_a_speed_at_which_people_could_not_follow_is_refused(engine: Engine, speed: float, wording: Wording) -> None:
    with pytest.raises(ValueError, match="speed") as refused:
        RealtimeDriver(engine, [], speed=speed)
    wording(refused.value)


def test_the_first_input_is_the_epoch_and_the_clock_beats_with_it(engine: WatchedEngine, wire: FakeTransport) -> None:
    driver = RealtimeDriver(engine, [wire], speed=7.0, epoch=3)
    driver.start()
    until(lambda: engine.inputs and wire.beats)
    driver.stop()
    assert engine.inputs[0][1] == inp.Started(3)
    assert (wire.beats[0].epoch, wire.beats[0].speed, wire.beats[0].beat) == (3, 7.0, 1)
    assert engine.state.epoch == 3


def test_engine_time_goes_at_its_speed_and_never_back(driver: RealtimeDriver) -> None:
    before, wall = driver.now(), time.monotonic()
    until(lambda: time.monotonic() > wall + 0.05)
    passed, wall_passed = (driver.now() - before) / 1e6, time.monotonic() - wall
    assert 0.5 < passed / wall_passed / 20.0 < 1.5


def test_a_change_of_speed_makes_no_jump_and_is_told_at_once(
    engine: WatchedEngine, wire: FakeTransport, wording: Wording
) -> None:
    """Formats 2: the clock is published at each change; engine time never goes back or leaps."""
    driver = RealtimeDriver(engine, [wire], speed=20.0)
    driver.start()
    until(lambda: wire.beats)
    before = driver.now()
    driver.set_speed(1.0)
    after = driver.now()
    until(lambda: wire.beats[-1].speed == 1.0)
    driver.stop()

    assert before <= after < before + 20 * 1_000_000
    assert wire.beats[-1].engine_us >= after
    with pytest.raises(ValueError, match="speed") as refused:
        driver.set_speed(21.0)
    wording(refused.value)


def test_engine_time_begins_after_what_was_journaled(engine: WatchedEngine) -> None:
    engine.state.now = 3_000_000_000 * 1_000_000  # the wall clock was set back since
    assert RealtimeDriver(engine, []).now() >= engine.state.now


def test_an_order_is_answered_or_refused_by_its_code(driver: RealtimeDriver, wording: Wording) -> None:
    driver.start()
    assert driver.ask(MOVE) == Accepted("MoveTask-1")
    with pytest.raises(TaskError) as refused:
        driver.ask(inp.Submit("Nope", {}))
    wording(refused.value)
    assert refused.value.code == "unknown_task"
    assert driver.ask(inp.Abort("MoveTask-1")) == Done()


def test_deadlines_that_lie_before_an_input_are_given_first(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    driver.start()
    for _ in range(20):
        driver.ask(MOVE)  # each sets the allocator's timer, 50 ms of engine time ahead: 2.5 ms at this speed
    until(lambda: engine.next_deadline() is None)
    times = [at for at, _ in engine.inputs]
    assert times == sorted(times)
    assert engine.seen(inp.TimerDue)
    assert driver.error is None  # the engine asserts that none was passed over


def test_timers_fire_also_while_inputs_pour_in(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    driver.start()
    wire.put(AgentSeen(card()))
    driver.ask(MOVE)
    seq = 0
    end = time.monotonic() + 5.0
    while not engine.seen(inp.TimerDue):
        assert time.monotonic() < end
        seq += 1
        wire.put(StatusArrived(status(seq=seq)))
    assert driver.error is None


def test_a_wall_timer_is_armed_and_armed_anew(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    driver._set_wall(LiveDue("a"), 30_000)
    driver._set_wall(LiveDue("b"), 30_000)
    driver._set_wall(LiveDue("c"), 10_000)
    driver._set_wall(LiveDue("a"), 60_000)  # later: the first no longer counts
    driver._set_wall(LiveDue("b"), None)
    given: list[str] = []
    engine._wall = lambda due, at: given.append(due.agent)  # type: ignore[method-assign]
    began = time.monotonic()
    driver.start()
    until(lambda: len(given) == 2)
    assert given == ["c", "a"]
    assert time.monotonic() - began > 0.03
    assert not driver._wall_live


def test_the_engines_changes_arm_wall_timers(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    driver.start()
    wire.put(AgentSeen(card()), StatusArrived(status()))
    until(lambda: LiveDue("lwd_1") in engine.state.wall)
    until(lambda: LiveDue("lwd_1") in driver._wall_live)
    assert engine.state.agents["lwd_1"].liveness == "ALIVE"
    wire.put(AgentGone("lwd_1"))
    until(lambda: engine.state.agents["lwd_1"].liveness == "SUSPECT")


def ready(engine: WatchedEngine, wire: FakeTransport) -> None:
    """Have lwd_1 stand at its port."""
    port = engine.core.site.ports["p1"].at
    told = replace(status(battery=100.0), position=Position(port.east_m, port.north_m, 0.0))
    wire.put(AgentSeen(card()), StatusArrived(told))
    until(lambda: engine.state.agents and engine.state.agents["lwd_1"].position is not None)


def test_steps_are_persisted_before_their_effects_leave_and_told_after(
    engine: WatchedEngine, wire: FakeTransport
) -> None:
    told: list[tuple[str, int, bool, int]] = []

    def note(word: str) -> Callable[[inp.EngineStep], None]:
        return lambda step: told.append(
            (word, step.seq, any(isinstance(e, inp.SendGoal) for e in step.effects), len(wire.goals))
        )

    class Keeps:
        def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
            for step in steps:
                note("persist")(step)
            return DURABLE

    driver = RealtimeDriver(engine, [wire], speed=20.0, persist=Keeps(), listeners=[note("listen")])
    driver.start()
    ready(engine, wire)
    driver.ask(MOVE)
    until(lambda: wire.goals)
    driver.stop()
    for seq in range(1, len(told) // 2 + 1):
        assert [word for word, of, *_ in told if of == seq] == ["persist", "listen"]
    assert [seq for word, seq, *_ in told if word == "listen"] == list(range(1, len(told) // 2 + 1))
    sending = next(seq for _, seq, sends, _ in told if sends)
    assert [(word, goals) for word, seq, _, goals in told if seq == sending] == [("persist", 0), ("listen", 1)]


def test_an_agent_that_no_wire_has_is_unreachable(engine: WatchedEngine, driver: RealtimeDriver) -> None:
    driver.start()
    failed = driver.switchboard.carry_out(inp.CancelGoal("g", "nobody"), 1)
    assert failed == inp.EffectFailed("nobody", "cancel", "g", "unreachable", "no transport has this agent")


def test_a_wire_that_fails_to_send_leaves_the_outcome_unknown(wire: FakeTransport, driver: RealtimeDriver) -> None:
    wire.incoming = [AgentSeen(card())]
    driver.switchboard.poll()
    wire.fails = [TransportError("cut")]
    goal = inp.SendGoal("g", "lwd_1", "TakeOff", {}, 1, 10)
    assert driver.switchboard.carry_out(goal, 7) == inp.EffectFailed("lwd_1", "goal", "g", "unknown", "cut")
    assert driver.switchboard.carry_out(goal, 7) is None
    assert (wire.goals[0].beat, wire.goals[0].task_id) == (7, "None")


def test_a_bug_in_the_engine_stops_the_driver_and_whoever_waits_is_told(
    engine: WatchedEngine, driver: RealtimeDriver, caplog: pytest.LogCaptureFixture, wording: Wording
) -> None:
    driver.start()
    entered, go = threading.Event(), threading.Event()

    def fail(given: inp.Input) -> None:
        if isinstance(given, inp.Abort):
            entered.set()
            go.wait(5.0)
            raise AssertionError("a bug")

    engine.before = fail
    culprit = driver.post(inp.Abort("T-1"))
    assert entered.wait(5.0)
    behind = driver.post(MOVE)  # waits in the inbox when it happens
    go.set()
    for future in (culprit, behind):
        with pytest.raises(EngineStopped) as refused:
            future.result(5.0)
        wording(refused.value)
    with pytest.raises(EngineStopped, match="by a bug"):
        driver.ask(MOVE)
    assert isinstance(driver.error, AssertionError)
    assert "the engine stopped" in caplog.text


def test_stop_is_quick_refuses_who_waits_and_may_come_twice(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver, wording: Wording
) -> None:
    driver.start()
    entered, go = threading.Event(), threading.Event()
    engine.before = lambda given: (entered.set(), go.wait(5.0))[0] if isinstance(given, inp.Abort) else None  # type: ignore[func-returns-value]
    first = driver.post(inp.Abort("T-1"))
    assert entered.wait(5.0)
    second = driver.post(inp.Abort("T-2"))
    driver._stopping.set()
    go.set()
    began = time.monotonic()
    driver.stop()
    driver.stop()
    assert time.monotonic() - began < 2.0
    refusal = first.result(0)
    assert isinstance(refusal, Refusal)
    assert refusal.code == "unknown_task"  # under way: it is ended
    for late in (second, driver.post(MOVE)):
        with pytest.raises(EngineStopped) as refused:
            late.result(0)
        wording(refused.value)
    assert not wire.is_open
    assert driver.error is None


def test_a_driver_that_was_never_started_refuses_when_stopped(driver: RealtimeDriver) -> None:
    waiting = driver.post(MOVE)
    driver.stop()
    with pytest.raises(EngineStopped):
        waiting.result(0)


def test_an_order_that_is_not_taken_in_time_is_withdrawn(
    engine: WatchedEngine, driver: RealtimeDriver, wording: Wording
) -> None:
    go = threading.Event()
    engine.before = lambda given: go.wait(5.0) and None if isinstance(given, inp.Started) else None
    driver.start()
    with pytest.raises(TaskError) as late:
        driver.ask(MOVE, timeout_s=0.02)
    wording(late.value)
    assert late.value.code == "no_reply"
    go.set()
    assert driver.ask(MOVE) == Accepted("MoveTask-1")  # the first was never carried out
    assert len(engine.seen(inp.Submit)) == 1


def test_a_wire_that_cannot_be_opened_closes_those_opened_before(
    engine: WatchedEngine, wire: FakeTransport, wording: Wording
) -> None:
    bad = FakeTransport()
    bad.fails = [TransportError("the port is taken")]
    driver = RealtimeDriver(engine, [wire, bad])
    with pytest.raises(TransportError) as refused:
        driver.start()
    wording(refused.value)
    assert (wire.opens, wire.is_open) == (1, False)
    driver.stop()


def test_goals_carry_the_beat_of_their_sending(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    driver.start()
    ready(engine, wire)
    driver.ask(MOVE)
    until(lambda: wire.goals)
    assert (wire.goals[0].action, wire.goals[0].epoch, wire.goals[0].task_id) == ("TakeOff", 1, "MoveTask-1")
    assert wire.goals[0].beat >= 1


def test_a_flood_of_deadlines_keeps_no_order_waiting(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    due = driver.now()
    for number in range(1000):
        engine.core.set_deadline(OrderDue(f"nobody_{number}"), due)
    answer = driver.post(inp.LockdownOrder("release"))
    driver.start()
    assert answer.result(5.0) == Done()
    until(lambda: len(engine.seen(inp.TimerDue)) == 1000)

    kinds = [type(given).__name__ for _, given in engine.inputs]
    assert kinds[: kinds.index("LockdownOrder")].count("TimerDue") <= 2 * TIMERS_A_TURN
    times = [at for at, _ in engine.inputs]
    assert times == sorted(times)
    assert driver.error is None
    until(lambda: driver.statistics().behind_s == 0.0)


def test_the_inbox_has_its_turn_after_each_part_of_those_that_one_status_woke(
    engine: WatchedEngine, wire: FakeTransport, driver: RealtimeDriver
) -> None:
    core, left = engine.core, iter(range(100))
    engine.wake_queue.go_on = lambda: core.set_deadline(TurnDue(), core.now) if next(left, None) is not None else None  # type: ignore[method-assign]
    core.set_deadline(TurnDue(), driver.now())
    answers = [driver.post(inp.LockdownOrder("release")) for _ in range(3)]
    driver.start()
    assert [answer.result(5.0) for answer in answers] == [Done()] * 3
    until(lambda: len(engine.seen(inp.TimerDue)) == 101)

    kinds = [type(given).__name__ for _, given in engine.inputs]
    orders = [place for place, kind in enumerate(kinds) if kind == "LockdownOrder"]
    assert orders[-1] <= 8  # Started, then one or two parts before each


def test_who_sends_more_requests_than_can_wait_is_told_busy(
    monkeypatch: pytest.MonkeyPatch, driver: RealtimeDriver, wording: Wording
) -> None:
    monkeypatch.setattr("formiga_bt.engine.drivers.inbox.MOST_REQUESTS", 2)
    waiting = [driver.post(MOVE), driver.post(MOVE)]
    with pytest.raises(TaskError) as refused:
        driver.ask(MOVE)
    wording(refused.value)
    assert refused.value.code == "busy"
    assert driver.statistics().inbox.waiting == {"requests": 2}
    assert not any(one.done() for one in waiting)


class Stopped(RealtimeDriver):
    """A driver whose process can be made to have stood still."""

    stood_us = 0

    def _wall_now(self) -> int:  # type: ignore[override]
        return RealtimeDriver._wall_now() + self.stood_us

    def stand_still(self, seconds: float) -> None:
        self.stood_us += round(seconds * 1e6)
        self._inbox.wake()


def test_after_a_standstill_of_the_process_agents_are_asked_and_none_is_lost(
    engine: WatchedEngine, wire: FakeTransport
) -> None:
    driver = Stopped(engine, [wire])
    driver.start()
    wire.put(AgentSeen(card()), StatusArrived(replace(status(), position=Position(0.0, 0.0, 0.0))))
    until(lambda: LiveDue("lwd_1") in engine.state.wall and engine.state.agents["lwd_1"].position)
    beat = wire.beats[-1].beat
    before = len(engine.inputs)

    driver.stand_still(120.0)
    until(lambda: engine.seen(inp.Outage))
    until(lambda: len(wire.beats) > beat and wire.beats[-1].beat >= beat + 119)
    driver.ask(MOVE)
    driver.stop()

    (_, first), *rest = engine.inputs[before:]
    assert isinstance(first, inp.Outage)
    assert 119e6 < first.wall - first.since < 125e6
    assert not [given for _, given in rest if isinstance(given, inp.WallDue) and given.timer == LiveDue("lwd_1")]
    assert engine.state.agents["lwd_1"].liveness == "ALIVE"


def test_a_step_that_takes_long_is_a_standstill_too(engine: WatchedEngine, wire: FakeTransport) -> None:
    driver = Stopped(engine, [wire])
    engine.before = lambda given: driver.stand_still(40.0) if isinstance(given, inp.Submit) else None
    driver.start()
    driver.ask(MOVE)
    until(lambda: engine.seen(inp.Outage))
    driver.stop()
    times = [at for at, _ in engine.inputs]
    assert times == sorted(times)


def test_waiting_for_something_to_do_is_no_standstill(engine: WatchedEngine, wire: FakeTransport) -> None:
    driver = Stopped(engine, [wire])
    driver._standstill = 200_000
    driver.start()
    until(lambda: len(wire.beats) > 2)
    driver.stop()
    assert not engine.seen(inp.Outage)


def test_a_goal_that_was_to_leave_before_a_standstill_is_looked_at_again(
    engine: WatchedEngine, wire: FakeTransport
) -> None:
    """What was decided half a minute ago does not leave after it; nor is it begun twice."""

    class Slow:
        sent = 0

        def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
            if not self.sent and any(isinstance(e, inp.SendGoal) for step in steps for e in step.effects):
                self.sent += 1
                driver.stand_still(25.0)  # a commit that takes as long
            return DURABLE

    driver = Stopped(engine, [wire], persist=Slow())
    driver.start()
    ready(engine, wire)
    driver.ask(MOVE)
    until(lambda: engine.seen(inp.Outage) and engine.seen(inp.EffectFailed))
    assert wire.goals == []
    last = engine.state.agents["lwd_1"]
    wire.put(StatusArrived(replace(status(seq=last.seq + 1), position=last.position)))
    until(lambda: wire.goals)
    driver.stop()
    assert len(wire.goals) == 1
    assert wire.goals[0].beat >= 25
    assert not [task for task in engine.state.tasks.values() if task.outcome.code]


def test_an_engine_that_comes_late_tells_it_once_and_when_it_has_caught_up(
    engine: WatchedEngine, wire: FakeTransport, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = RealtimeDriver(engine, [wire])
    late = [0]
    now = driver.now()
    monkeypatch.setattr(engine, "next_deadline", lambda: (now - late[0], NodeDue("x", "y")))
    monkeypatch.setattr(driver, "_handle", lambda at, given: engine.inputs.append((at, given)))

    for second, behind_s in enumerate((0.0, 1.9, 2.5, 2.5, 9.0, 3.0, 1.0, 0.4, 0.0, 2.5)):
        driver._turn, late[0] = second * 1_000_000, round(behind_s * 1e6)
        driver._note_load(now)
        assert driver.is_behind == (3 <= second < 7), second

    assert [given for _, given in engine.inputs] == [inp.Behind(2_500_000, 2_500_000), inp.Behind(0, 9_000_000)]


def test_a_status_that_waits_for_its_turn_counts_as_heard(engine: WatchedEngine, wire: FakeTransport) -> None:
    """Else an engine that comes late would take a machine for silent whose words it has."""
    driver = Stopped(engine, [wire])
    driver.start()
    wire.put(AgentSeen(card()), StatusArrived(status()))
    until(lambda: LiveDue("lwd_1") in engine.state.wall)
    driver.stop()
    driver._turn = driver._wall_now() + 20_000_000
    driver._inbox.put(inp.AgentStatusInput(replace(status(), seq=9), driver._turn - 1_000))

    assert not driver._wall_timers()
    assert engine.seen(inp.WallDue) == []
    assert driver._inbox.heard("lwd_1") == driver._turn - 1_000


def test_a_standstill_is_as_long_as_the_shortest_silence_that_counts(engine: WatchedEngine) -> None:
    catalogue = engine.core.catalogue
    lwd = catalogue.types["lwd"]
    assert standstill_us(catalogue) == 3_000_000
    quick = replace(lwd, suspect_after_us=2_000_000, lost_after_us=2_400_000)
    assert standstill_us(replace(catalogue, types={**catalogue.types, "lwd": quick})) == 1_200_000
