"""The driver and its journal: durable first, then effects and answers; what happens when nothing can be kept."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future

import pytest

from formiga_bt.base.errors import SiteError, TaskError
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.drivers.realtime import EngineStopped, RealtimeDriver
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal
from formiga_bt.engine.restart.journal_backpressure import begins_something
from formiga_bt.lang.types import AgentRef
from tests.golden import Wording
from tests.unit.engine.drivers.conftest import FakeTransport, WatchedEngine
from tests.unit.engine.drivers.test_realtime import ready, until

MOVE = inp.Submit("MoveTask", {"robot": AgentRef("lwd_1")})
FULL = inp.JournalState("full", "no room")


class Disk:
    """Keeps steps; may be held shut, full, or broken."""

    def __init__(self) -> None:
        self.batches: list[list[inp.EngineStep]] = []
        self.open = threading.Event()
        self.open.set()
        self.full = False
        self.told = "ok"
        self.error: Exception | None = None

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        self.open.wait(5.0)
        if self.error is not None:
            raise self.error
        return self.take(steps)

    def take(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        self.batches.append(list(steps))
        now = "full" if self.full else "ok"
        news = inp.JournalState(now, "no room" if self.full else "") if now != self.told else None
        self.told = now
        return Outcome(not self.full, news)

    @property
    def steps(self) -> list[inp.EngineStep]:
        return [step for batch in self.batches for step in batch]


@pytest.fixture
def disk() -> Disk:
    return Disk()


@pytest.fixture
def wire() -> FakeTransport:
    return FakeTransport()


@pytest.fixture
def driver(engine: WatchedEngine, wire: FakeTransport, disk: Disk) -> Iterator[RealtimeDriver]:
    driver = RealtimeDriver(engine, [wire], speed=20.0, persist=disk)
    driver.start()
    ready(engine, wire)
    yield driver
    disk.open.set()
    driver.stop()


def test_nothing_leaves_and_nobody_is_answered_before_a_step_is_durable(
    driver: RealtimeDriver, engine: WatchedEngine, wire: FakeTransport, disk: Disk
) -> None:
    heard: list[int] = []
    driver.listeners.append(lambda step: heard.append(step.seq))
    disk.open.clear()
    reply = driver.post(MOVE)
    until(lambda: engine.seen(inp.Submit))
    submitted = engine.state.seq
    time.sleep(0.05)
    assert not reply.done()
    assert not wire.goals
    assert submitted not in heard
    disk.open.set()
    assert reply.result(5.0) == Accepted("MoveTask-1")
    until(lambda: wire.goals)
    assert [step.seq for step in disk.steps] == list(range(1, len(disk.steps) + 1))


def test_steps_that_come_together_are_one_batch(driver: RealtimeDriver, disk: Disk) -> None:
    disk.open.clear()
    first = driver.post(inp.Duty("nobody", True))
    until(first.running)
    time.sleep(0.02)
    replies = [driver.post(inp.Operator("hold", "", "me")) for _ in range(20)]
    disk.open.set()
    for reply in replies:
        reply.result(5.0)
    together = max(sum(isinstance(step.input, inp.Operator) for step in batch) for batch in disk.batches)
    assert together > 1
    assert sum(isinstance(step.input, inp.Operator) for step in disk.steps) == 20


class SlowDisk(Disk):
    """A disk that is waited for in another thread."""

    def start(self, steps: Sequence[inp.EngineStep]) -> bool:
        self.started = list(steps)
        return True

    def commit(self) -> None:
        self.open.wait(5.0)
        if self.error is not None:
            raise self.error

    def finish(self) -> Outcome:
        return self.take(self.started)


@pytest.fixture
def slow(engine: WatchedEngine, wire: FakeTransport, monkeypatch: pytest.MonkeyPatch) -> Iterator[RealtimeDriver]:
    """Return a driver that hands over every step as if it were busy."""
    monkeypatch.setattr("formiga_bt.engine.drivers.realtime.BATCH_US", 0)
    driver = RealtimeDriver(engine, [wire], speed=20.0, persist=SlowDisk())
    driver.start()
    ready(engine, wire)
    yield driver
    driver._persist.open.set()  # type: ignore[union-attr]
    driver.stop()


def at_submit(slow: RealtimeDriver, engine: WatchedEngine, do: Callable[[], None]) -> "Future[str]":
    """Request a task; when it is taken, shut the disk and do something, in the driver's thread."""

    def before(given: inp.Input) -> None:
        if isinstance(given, inp.Submit):
            assert slow._ahead is not None
            if slow._ahead._commit is not None:
                slow._ahead._commit.result(5.0)  # what came before is on disk
            slow._persist.open.clear()  # type: ignore[union-attr]
            do()

    engine.before = before
    return slow.post(MOVE)


def test_a_busy_engine_goes_on_while_the_disk_is_waited_for_and_nobody_is_answered(
    slow: RealtimeDriver, engine: WatchedEngine, wire: FakeTransport
) -> None:
    disk: SlowDisk = slow._persist  # type: ignore[assignment]
    orders: list[Future[str]] = []
    first = at_submit(slow, engine, lambda: orders.append(slow.post(inp.Operator("hold", "", "me"))))
    until(lambda: engine.seen(inp.Operator))
    time.sleep(0.02)
    assert not first.done()
    assert not orders[0].done()
    assert not wire.goals
    disk.open.set()
    assert first.result(5.0) == Accepted("MoveTask-1")
    assert orders[0].result(5.0) == Done()
    until(lambda: wire.goals or engine.state.tasks["MoveTask-1"].hold.words)
    slow.stop()
    assert [step.seq for step in disk.steps] == list(range(1, len(disk.steps) + 1)), "in order, and all"


def test_an_engine_that_learns_in_the_commit_that_it_may_not_write_sends_nothing(
    slow: RealtimeDriver, engine: WatchedEngine, wire: FakeTransport, wording: Wording
) -> None:
    disk: SlowDisk = slow._persist  # type: ignore[assignment]
    first = at_submit(slow, engine, lambda: None)
    until(lambda: engine.seen(inp.Submit))
    disk.error = SiteError("another engine has taken the site")
    disk.open.set()
    with pytest.raises(EngineStopped) as refused:
        first.result(5.0)
    wording(refused.value)
    until(lambda: slow.error is not None)
    assert not wire.goals


def test_a_full_disk_refuses_new_tasks_and_lets_go_on_what_flies(
    driver: RealtimeDriver, engine: WatchedEngine, wire: FakeTransport, disk: Disk, wording: Wording
) -> None:
    alarms: list[inp.Effect] = []
    driver.listeners.append(
        lambda step: alarms.extend(e for e in step.effects if isinstance(e, inp.Alarm | inp.NotifyPeople))
    )
    assert driver.ask(MOVE) == Accepted("MoveTask-1")
    until(lambda: wire.goals)
    disk.full = True
    with pytest.raises(TaskError) as told:
        driver.ask(MOVE)
    assert told.value.code == "journal_full"
    wording(str(told.value))
    until(lambda: engine.state.tasks["MoveTask-2"].status == "CANCELED")
    with pytest.raises(TaskError) as told:
        driver.ask(MOVE)
    wording(str(told.value))
    (alarm,) = alarms
    assert isinstance(alarm, inp.Alarm)
    assert alarm.code == "journal_full"
    wording(alarm.text)
    assert driver.ask(inp.Operator("hold", "lwd_1", "me")) == Done(kept=False), "carried out at once, and told"
    until(lambda: wire.cancels)
    disk.full = False
    driver.ask(inp.Operator("continue", "lwd_1", "me"))
    until(lambda: engine.state.counters["journal"] == 0)
    assert driver.ask(MOVE) == Accepted("MoveTask-3")
    until(lambda: len(alarms) == 2)
    assert isinstance(alarms[1], inp.NotifyPeople)
    wording(alarms[1].text)


def test_what_lets_more_begin_is_answered_only_when_it_is_kept(
    driver: RealtimeDriver, disk: Disk, wording: Wording
) -> None:
    assert driver.ask(inp.LockdownOrder("land", "me")) == Done()
    until(lambda: driver.statistics().inbox.waiting == {})
    assert driver.kept_seq == driver.engine.state.seq
    disk.full = True
    release = driver.post(inp.LockdownOrder("release", "me"))
    until(lambda: disk.told == "full")
    assert driver.ask(inp.Operator("hold", "", "me")) == Done(kept=False)
    assert driver.kept_seq < driver.engine.state.seq
    with pytest.raises(TaskError) as refused:
        driver.ask(inp.LockdownOrder("release", "me"))
    wording(refused.value)
    assert not release.done()
    disk.full = False
    until(lambda: driver.kept_seq >= len(disk.steps) - 1)
    assert release.result(10.0) == Done(), "the disk is tried again, whether or not anything happens"


def test_who_waits_for_the_disk_is_told_when_the_engine_stops(driver: RealtimeDriver, disk: Disk) -> None:
    driver.ask(inp.LockdownOrder("land", "me"))
    disk.full = True
    release = driver.post(inp.LockdownOrder("release", "me"))
    until(lambda: disk.told == "full")
    driver.stop()
    with pytest.raises(EngineStopped):
        release.result(10.0)


@pytest.mark.parametrize(
    ("given", "begins"),
    [
        (MOVE, True),
        (inp.Serve("Move", "ab"), True),
        (inp.Operator("restart", "Move-1"), True),
        (inp.LockdownOrder("release"), True),
        (inp.Approve("ab", "Move", "ann"), True),
        (inp.Duty("ann", True), True),
        (inp.Abort("Move-1"), False),
        (inp.LockdownOrder("hold"), False),
        (inp.Approve("ab", "Move", "ann", revoke=True), False),
        (inp.Duty("ann", False), False),
        *((inp.Operator(order), False) for order in ("hold", "land", "return", "cut", "continue", "clear")),
    ],
)
def test_what_stops_or_ends_something_acts_also_on_a_full_disk(given: inp.Input, begins: bool) -> None:
    assert begins_something(given) is begins


def test_an_engine_that_may_not_write_any_more_ends_and_sends_nothing(
    driver: RealtimeDriver, wire: FakeTransport, disk: Disk, wording: Wording
) -> None:
    disk.error = SiteError("another engine has taken the site")
    with pytest.raises(EngineStopped) as refused:
        driver.ask(MOVE)
    wording(refused.value)
    until(lambda: driver.error is not None)
    assert not wire.goals
    with pytest.raises(EngineStopped) as refused:
        driver.ask(MOVE)
    wording(refused.value)


def test_steps_before_a_bug_are_kept(driver: RealtimeDriver, engine: WatchedEngine, disk: Disk) -> None:
    def breaks(given: inp.Input) -> None:
        if isinstance(given, inp.Abort):
            raise ZeroDivisionError

    engine.before = breaks
    disk.open.clear()
    first = driver.post(MOVE)
    until(lambda: engine.seen(inp.Submit))
    second, third = driver.post(inp.Operator("hold", "nobody", "me")), driver.post(inp.Abort("MoveTask-1"))
    disk.open.set()
    assert first.result(5.0) == Accepted("MoveTask-1")
    with pytest.raises(EngineStopped, match="by a bug"):
        third.result(5.0)
    refusal = second.result(5.0)
    assert isinstance(refusal, Refusal), "handled right before, and kept"
    assert refusal.code == "unknown_target"
    assert isinstance(disk.steps[-1].input, inp.Operator)


@pytest.mark.parametrize("state", ["slow", "full"])
def test_how_the_journal_stands_is_told_once(engine: WatchedEngine, state: str) -> None:
    give: Callable[..., inp.EngineStep] = lambda s, at: engine.handle(at, inp.JournalState(s, "why"))  # noqa: E731
    assert [effect.code for effect in give(state, 1).effects if isinstance(effect, inp.Alarm)] == [f"journal_{state}"]
    assert give(state, 2).effects == ()
    assert [type(effect) for effect in give("ok", 3).effects] == [inp.NotifyPeople]
    assert give("ok", 4).changes == ()


def test_what_is_durable_is_a_constant() -> None:
    assert Outcome(True) == DURABLE
