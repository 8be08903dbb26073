"""What happened in a run, a row each: begun once, told with the engine's answer, ended once."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, Input, LockdownOrder, Operator, Started
from formiga_bt.engine.kernel.records import AgentRecord, ClearanceRecord, GoalRecord, Lockdown, Question, StandingOrder
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.show.history.runlog import RunLog
from tests.golden import Wording


class Feeder:
    """Feeds changes at an instant, in seconds."""

    def __init__(self) -> None:
        self.log = RunLog()
        self.seq = 0

    def __call__(self, at: int, *changes: ch.Change, by: Input | None = None, reply: str = "") -> None:
        self.seq += 1
        self.log.feed(EngineStep(self.seq, at * SECOND, by or Started(1), changes, (), reply))

    @property
    def rows(self) -> list[tuple[int, str, str, str, str]]:
        return [(row.at // SECOND, row.who, row.what, row.did, row.ended) for row in self.log.happened.rows]


@pytest.fixture
def feed() -> Feeder:
    feed = Feeder()
    feed(0, drone())
    return feed


def drone(**fields: Any) -> ch.AgentPut:
    known = {
        "id": "d",
        "type": "hwd",
        "liveness": "ALIVE",
        "task": "Go-1",
        "on_link_loss": "return",
        "landed": "airborne",
    }
    return ch.AgentPut(AgentRecord(**{**known, **fields}))


def order(stop: str, scope: str, at: int, **fields: Any) -> ch.OrderPut:
    return ch.OrderPut("d", StandingOrder(agent="d", stop=stop, by="ann", scope=scope, at=at * SECOND, **fields))  # type: ignore[arg-type]


def test_a_take_over_lasts_until_a_person_hands_back(feed: Feeder, wording: Wording) -> None:
    feed(10, drone(taken=True, control="pilot"))
    wording(feed.rows)
    feed(20, drone(taken=True, control="engine"))
    feed(40, drone(), by=Operator("handback_continue", "d", "ann"))
    wording(feed.rows)


def test_a_short_silence_is_no_event_and_a_long_one_is(feed: Feeder, wording: Wording) -> None:
    feed(10, drone(liveness="SUSPECT"))
    feed(12, drone())
    assert feed.rows == []
    feed(20, drone(liveness="SUSPECT"))
    feed(35, drone())
    wording(feed.rows)


def test_one_that_is_lost_is_told_while_it_is_lost(feed: Feeder, wording: Wording) -> None:
    feed(10, drone(liveness="SUSPECT"))
    feed(40, drone(liveness="LOST"))
    wording(feed.rows)
    feed(70, drone(task=""))
    wording(feed.rows[0][4])


def test_a_silence_and_what_the_drone_did_of_it_are_one_event(feed: Feeder, wording: Wording) -> None:
    feed(10, drone(liveness="SUSPECT"))
    feed(30, drone(taken=True, control="failsafe"))
    feed(60, drone(), by=Operator("handback_end", "d", "ann"))
    wording(feed.rows)


def test_a_failsafe_without_a_silence_is_its_own(feed: Feeder, wording: Wording) -> None:
    feed(10, drone(taken=True, control="failsafe", task=""))
    wording(feed.rows)


def test_a_breach_ends_when_the_drone_is_down(feed: Feeder, wording: Wording) -> None:
    feed(10, order("return", "engine", 10, why="envelope.reserve"))
    feed(50, drone(landed="grounded"))
    feed(51, ch.OrderPut("d", None))
    wording(feed.rows)


def test_an_order_of_a_person_and_the_one_that_replaces_it(feed: Feeder, wording: Wording) -> None:
    feed(10, order("hold", "agent", 10))
    feed(20, order("return", "agent", 20))
    feed(30, order("return", "agent", 20, state="done"))
    wording(feed.rows)


def test_lockdown_is_one_event_with_all_its_orders(feed: Feeder, wording: Wording) -> None:
    feed(10, ch.LockdownPut(Lockdown("return", "ann", 10 * SECOND)), order("return", "lockdown", 10))
    feed(60, ch.LockdownPut(None), by=LockdownOrder("release", "bob"))
    wording(feed.rows)


def test_nobody_answered_a_clearance(feed: Feeder, wording: Wording) -> None:
    goal = GoalRecord(id="g", agent="d", action="LandIn", task="Go-1")
    asked = ClearanceRecord(agent="d", task="Go-1", goal="g", n=1, state="asked", opened_at=10 * SECOND)
    feed(10, ch.GoalPut(goal), ch.ClearancePut("d", asked))
    feed(99, ch.ClearancePut("d", None))
    feed(100, ch.GoalPut(GoalRecord(id="g", agent="d", action="LandIn", state="gate_refused", code="no_clearance")))
    wording(feed.rows)


@pytest.mark.parametrize(("dropped_at", "rows"), [(99, 0), (100, 1)])
def test_a_question_whose_time_ran_out(feed: Feeder, dropped_at: int, rows: int) -> None:
    question = Question(
        id="q", number="Q7", task="Go-1", priority="medium", kind="ask", text="Loaded?", options=("yes",),
        tiers=(("ann",),), expires_at=100 * SECOND, asked_at=10 * SECOND,
    )  # fmt: skip
    feed(10, ch.QuestionPut(question))
    feed(dropped_at, ch.QuestionDrop("q"))
    expected = [(10, "ann", "no answer to Q7", "Loaded?", "its time was over after 90 s")]
    assert feed.rows == expected[:rows]


def test_a_refused_order_is_a_line_of_the_log(feed: Feeder, wording: Wording) -> None:
    feed(10, by=Operator("hold", "", "ann"), reply=Refusal("lockdown", "the site is locked down"))
    feed(11, by=Operator("hold", "", "ann"), reply="ok")
    assert [line.severity for line in feed.log.lines] == ["warning"]
    wording([line.text for line in feed.log.lines])
