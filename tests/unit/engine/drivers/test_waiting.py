"""Stops never expire; what lets something go on does; other orders are dropped with their caller."""

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.drivers.waiting import AGE_S, CALLER, Caller, never_expires, refusal_of_old, since_boot
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.lang.types import AgentRef
from tests.golden import Wording
from tests.unit.engine.drivers.conftest import FakeTransport, WatchedEngine

MOVE = inp.Submit("MoveTask", {"robot": AgentRef("lwd_1")})
STOPS: list[inp.Input] = [
    inp.Operator("hold"), inp.Operator("return", "hwd_1"), inp.Operator("land"), inp.Operator("cut", "hwd_1"),
    inp.LockdownOrder("return"), inp.LockdownOrder("land"), inp.Abort("T-1"), inp.Abort("T-1", "now"),
]  # fmt: skip
GOING_ON: list[inp.Input] = [
    inp.Operator("continue"), inp.Operator("restart", "T-1"), inp.Operator("clear", "hwd_1"),
    inp.Operator("removed", "hwd_1"), inp.Operator("handback_continue", "hwd_1"), inp.Operator("handback_end", "hwd_1"),
    inp.LockdownOrder("release"),
]  # fmt: skip


@pytest.fixture
def driver(engine: WatchedEngine) -> Iterator[RealtimeDriver]:
    driver = RealtimeDriver(engine, [FakeTransport()])
    yield driver
    driver.stop()


def until(is_met: Callable[[], object]) -> None:
    end = time.monotonic() + 10.0
    while not is_met():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


@pytest.mark.parametrize("given", STOPS)
def test_stops_never_expire(given: inp.Input) -> None:
    assert never_expires(given)
    assert refusal_of_old(given, 1e6) is None


@pytest.mark.parametrize("given", GOING_ON)
def test_what_lets_go_on_is_good_for_half_a_minute(given: inp.Input) -> None:
    assert not never_expires(given)
    assert refusal_of_old(given, AGE_S) is None
    refusal = refusal_of_old(given, AGE_S + 1)
    assert refusal is not None
    assert refusal.code == "too_old"


@pytest.mark.parametrize("given", [MOVE, inp.Approve("d", "T", "ann"), inp.Duty("pia", True)])
def test_other_orders_have_no_age(given: inp.Input) -> None:
    assert not never_expires(given)
    assert refusal_of_old(given, 1e6) is None


def test_an_old_order_is_refused_when_the_driver_takes_it(engine: WatchedEngine, driver: RealtimeDriver) -> None:
    driver.start()
    before = CALLER.set(Caller(since_boot() - AGE_S - 1))
    try:
        with pytest.raises(TaskError) as old:
            driver.ask(inp.Operator("continue"))
        assert driver.ask(inp.Operator("land")) == Done()
    finally:
        CALLER.reset(before)
    assert old.value.code == "too_old"
    assert [given.order for given in engine.seen(inp.Operator)] == ["land"]
    driver.ask(inp.Operator("continue"))


def test_an_order_is_dropped_with_its_caller_and_a_stop_is_not(engine: WatchedEngine, driver: RealtimeDriver) -> None:
    go, entered = threading.Event(), threading.Event()

    def hold(given: inp.Input) -> None:
        if isinstance(given, inp.Started):
            entered.set()
            go.wait(10.0)

    engine.before = hold
    driver.start()
    assert entered.wait(5.0)
    caller, codes = Caller(since_boot()), []

    def give(given: inp.Input) -> None:
        before = CALLER.set(caller)
        try:
            driver.ask(given, timeout_s=10.0)
        except TaskError as error:
            codes.append(error.code)
        finally:
            CALLER.reset(before)

    orders: list[inp.Input] = [MOVE, inp.Operator("continue"), inp.Operator("land"), inp.LockdownOrder("hold")]
    threads = [threading.Thread(target=give, args=(one,)) for one in orders]
    for thread in threads:
        thread.start()
    until(lambda: sum(driver.statistics().inbox.waiting.values()) == len(orders))
    caller.leave()
    until(lambda: len(codes) == 2)
    give(MOVE)  # whose caller has gone before it came
    go.set()
    for thread in threads:
        thread.join(10.0)
    assert codes == ["client_gone"] * 3
    assert engine.seen(inp.Submit) == []
    assert [given.order for given in engine.seen(inp.Operator)] == ["land"]
    assert len(engine.seen(inp.LockdownOrder)) == 1


def test_a_stop_is_carried_out_though_nobody_waits_any_longer(
    engine: WatchedEngine, driver: RealtimeDriver, wording: Wording
) -> None:
    go = threading.Event()
    engine.before = lambda given: go.wait(5.0) and None if isinstance(given, inp.Started) else None
    driver.start()
    with pytest.raises(TaskError) as late:
        driver.ask(inp.Operator("land"), timeout_s=0.02)
    wording(late.value)
    assert late.value.code == "no_reply"
    go.set()
    until(lambda: engine.seen(inp.Operator))
