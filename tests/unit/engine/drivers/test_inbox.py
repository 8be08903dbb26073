"""Lanes of the inbox: who goes first, and that only telemetry is ever replaced."""

import threading
import time

from formiga_bt.engine.drivers.inbox import (
    HIGH,
    NORMAL,
    ORDERS,
    TELEMETRY,
    TURN_AFTER,
    URGENT,
    URGENT_HIGH,
    Inbox,
    InboxLoad,
    lane_of,
)
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.transport.messages import GoalEvent
from tests.unit.engine.drivers.conftest import card, status


def event(goal: str = "g") -> inp.GoalEventInput:
    return inp.GoalEventInput(GoalEvent(goal_id=goal, agent="lwd_1", state="running"))


def drain(inbox: Inbox) -> list[inp.Input]:
    found = []
    while (item := inbox.take()) is not None:
        found.append(item[0])
    return found


def test_each_input_has_its_lane() -> None:
    lanes = {
        ORDERS: [
            inp.Abort("T-1"),
            inp.Operator("clear", "lwd_1"),
            inp.LockdownOrder("hold"),
            inp.Started(1),
        ],
        URGENT: [event(), inp.BadStatusInput("a", "")],
        HIGH: [inp.Submit("T", {}, "high")],
        NORMAL: [
            inp.Submit("T", {}),
            inp.Submit("T", {}, "low"),
            inp.Serve("T", "ab"),
            inp.AgentSeenInput(card()),
            inp.AgentGoneInput("a"),
        ],
        TELEMETRY: [inp.AgentStatusInput(status())],
    }
    for lane, inputs in lanes.items():
        assert [lane_of(given) for given in inputs] == [lane] * len(inputs)


def test_lanes_go_in_order_and_each_is_first_come_first_served() -> None:
    inbox = Inbox()
    telemetry, low, high = inp.AgentStatusInput(status()), inp.Submit("T", {}), inp.Submit("T", {}, "high")
    for given in (telemetry, low, event("1"), high, inp.Abort("T-1"), event("2")):
        inbox.put(given)
    assert drain(inbox) == [inp.Abort("T-1"), event("1"), event("2"), high, low, telemetry]
    assert inbox.take() is None


def test_news_of_high_tasks_go_before_other_news() -> None:
    inbox = Inbox(lambda task: task == "Urgent-2")
    for goal in ("Calm-1/1/steps/steps[0]", "Urgent-2/1/steps/steps[0]", "Calm-1/1/steps/steps[1]"):
        inbox.put(event(goal))
    assert lane_of(event("Urgent-2/1/steps/steps[0]"), lambda task: task == "Urgent-2") == URGENT_HIGH
    assert [given.event.goal_id for given in drain(inbox)] == [  # type: ignore[union-attr]
        "Urgent-2/1/steps/steps[0]", "Calm-1/1/steps/steps[0]", "Calm-1/1/steps/steps[1]",
    ]  # fmt: skip


def test_under_overload_no_lane_starves_and_orders_of_people_never_wait() -> None:
    inbox = Inbox()
    inbox.put(inp.AgentStatusInput(status()))
    inbox.put(inp.Submit("T", {}))
    order: list[str] = []
    for number in range(3 * TURN_AFTER):
        inbox.put(event(str(number)))
        if number == TURN_AFTER - 1:
            inbox.put(inp.Abort("T-1"))
        given = inbox.take()
        assert given is not None
        order.append(type(given[0]).__name__)
    turns = {name: order.index(name) for name in ("Abort", "AgentStatusInput", "Submit")}
    assert turns["Abort"] == TURN_AFTER - 1, "at once"
    assert {turns["AgentStatusInput"], turns["Submit"]} == {TURN_AFTER + 1, TURN_AFTER + 2}
    assert len(drain(inbox)) == 3, "the news that these went before"


def test_what_waits_is_told() -> None:
    inbox = Inbox()
    for seq in (1, 2):
        inbox.put(inp.AgentStatusInput(status(seq=seq)))
    inbox.put(event("1"))
    inbox.take()
    assert inbox.statistics() == InboxLoad({"telemetry": 1}, most=2, replaced=1)


def test_telemetry_keeps_the_latest_of_each_agent_and_takes_turns() -> None:
    inbox = Inbox()
    for seq in range(1, 1001):
        inbox.put(inp.AgentStatusInput(status("lwd_1", seq=seq)))
    inbox.put(inp.AgentStatusInput(status("lwd_2", seq=1)))
    inbox.put(inp.AgentStatusInput(status("lwd_1", seq=1001)))
    assert inbox.replaced == 1000
    # The one that spoke again goes behind: nobody who talks much keeps another from being heard.
    assert [(g.status.id, g.status.seq) for g in drain(inbox)] == [("lwd_2", 1), ("lwd_1", 1001)]  # type: ignore[union-attr]


def test_who_came_and_went_is_gone() -> None:
    inbox = Inbox()
    inbox.put(inp.AgentSeenInput(card()))
    inbox.put(inp.AgentGoneInput("lwd_1"))
    assert drain(inbox) == [inp.AgentSeenInput(card()), inp.AgentGoneInput("lwd_1")]


def test_a_status_of_the_former_process_does_not_come_after_the_new_card() -> None:
    inbox = Inbox()
    inbox.put(inp.AgentStatusInput(status(boot="b1")))
    inbox.put(inp.AgentStatusInput(status("lwd_2", boot="b1")))
    inbox.put(inp.AgentSeenInput(card(boot="b2")))
    assert drain(inbox) == [inp.AgentSeenInput(card(boot="b2")), inp.AgentStatusInput(status("lwd_2", boot="b1"))]


def test_the_waiter_comes_back_with_its_input() -> None:
    inbox = Inbox()
    waiter = object()
    inbox.put(inp.Abort("T-1"), waiter)
    assert inbox.take() == (inp.Abort("T-1"), waiter)


def test_a_put_ends_the_wait_of_another_thread() -> None:
    inbox = Inbox()
    timer = threading.Timer(0.02, lambda: inbox.put(event()))
    timer.start()
    began = time.monotonic()
    inbox.wait(10.0)
    assert time.monotonic() - began < 5.0
    assert inbox.take() is not None
    timer.join()


def test_a_put_before_the_wait_is_not_missed() -> None:
    inbox = Inbox()
    inbox.put(event())
    began = time.monotonic()
    inbox.wait(10.0)
    assert time.monotonic() - began < 5.0
