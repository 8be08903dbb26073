import threading

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TransportError
from formiga_bt.transport.desk import MOST_OPEN, DeskTransport
from formiga_bt.transport.messages import (
    AgentSeen,
    ClockBeat,
    EventArrived,
    GoalReported,
    GoalRequest,
    QueryReplied,
    SendFailed,
    StatusArrived,
)
from tests.golden import Wording

ASK = {
    "question": "Is the crate loaded?",
    "options": ["not_yet", "loaded"],
    "note": "stand clear",
    "number": "Q7",
    "expires_us": 90 * SECOND,
    "if_no_answer": "the drone flies home",
}


class Desk:
    def __init__(self) -> None:
        self.time = 0
        self.changes = 0
        self.wakes = 0
        self.transport = DeskTransport(now=lambda: self.time, boot_id="d1", on_change=self.change)
        self.transport.open(self.wake)
        self.transport.add_person("anna", "person", name="Anna")
        self.transport.add_person("ben", "person")
        self.transport.poll()

    def change(self) -> None:
        self.changes += 1

    def wake(self) -> None:
        self.wakes += 1

    def ask(self, goal_id: str, person: str = "anna", **changes: object) -> str:
        self.transport.send_goal(
            GoalRequest(
                goal_id=goal_id, agent=person, action="Confirm", fields={**ASK, **changes}, task_id="PickUp-1", epoch=1
            )
        )
        (event,) = self.transport.poll()
        assert isinstance(event, GoalReported)
        return event.event.code or event.event.state


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_people_are_human_agents(wording: Wording) -> None:
    transport = DeskTransport(now=lambda: 5)
    transport.add_person("anna", "picker", "Anna")
    wakes: list[None] = []
    transport.open(lambda: wakes.append(None))
    assert wakes
    seen, status = transport.poll()
    assert isinstance(seen, AgentSeen)
    assert (seen.card.type, seen.card.mobility, seen.card.actions, seen.card.boot_id) == (
        "picker",
        "people",
        ("Confirm",),
        "desk-5",
    )
    assert isinstance(status, StatusArrived)
    assert (status.status.id, status.status.status) == ("anna", "STANDBY")
    with pytest.raises(TransportError) as refused:
        transport.add_person("anna", "person")
    wording(refused.value)


def test_a_question_is_shown_and_answered_with_who_and_when(desk: Desk) -> None:
    desk.transport.publish_clock(ClockBeat(wall_us=0, engine_us=60 * SECOND, speed=1.0, epoch=1, beat=1))
    assert {e.status.beat for e in desk.transport.poll() if isinstance(e, StatusArrived)} == {1}
    assert desk.ask("g1") == "accepted"
    (question,) = desk.transport.open_questions()
    assert (question.person, question.person_name, question.task_id, question.asked_at) == (
        "anna",
        "Anna",
        "PickUp-1",
        60 * SECOND,
    )
    assert (question.ask.number, question.ask.options) == ("Q7", ("not_yet", "loaded"))
    desk.time += 2 * SECOND
    assert desk.transport.answer("q7", "loaded") is None
    (end,) = desk.transport.poll()
    assert isinstance(end, GoalReported)
    assert (end.event.state, end.event.result) == (
        "succeeded",
        {"answer": "loaded", "by": "anna", "at": 62 * SECOND},
    )
    assert end.event.status is not None
    assert desk.transport.open_questions() == ()
    assert desk.changes == 2


def test_a_wrong_option_changes_nothing(desk: Desk) -> None:
    desk.ask("g1")
    text = desk.transport.answer("g1", "maybe")
    assert text is not None
    assert text.startswith("bad_option")
    assert "not_yet, loaded" in text
    assert len(desk.transport.open_questions()) == 1


def test_an_answer_after_the_end_is_late(desk: Desk) -> None:
    desk.ask("g1")
    assert desk.transport.answer("g1", "loaded") is None
    for goal in ("g1", "Q7", "", "never"):
        assert str(desk.transport.answer(goal, "loaded")).startswith("answer_late")


def test_a_question_can_be_withdrawn(desk: Desk) -> None:
    desk.ask("g1")
    desk.transport.cancel_goal("anna", "g1")
    states = [e.event.state for e in desk.transport.poll() if isinstance(e, GoalReported)]
    assert states == ["canceled", "canceled"], "the news and the reply"
    assert desk.transport.open_questions() == ()


def test_people_have_their_own_questions_in_order(desk: Desk) -> None:
    desk.ask("g2", "ben", number="Q1")
    desk.time += 1
    desk.ask("g1", "anna", number="Q2")
    desk.ask("g3", "ben", number="Q3")
    assert [q.goal_id for q in desk.transport.open_questions()] == ["g2", "g1", "g3"]
    assert [q.goal_id for q in desk.transport.open_questions("ben")] == ["g2", "g3"]
    assert desk.transport.find("Q2", "ben") is None


@pytest.mark.parametrize("bad", [{"options": []}, {"options": "loaded"}, {"question": None}, {"options": [1]}])
def test_a_question_without_a_sense_is_rejected(desk: Desk, bad: dict[str, object]) -> None:
    assert desk.ask("g1", **bad) == "bad_fields"


def test_too_many_questions_are_rejected(desk: Desk) -> None:
    assert {desk.ask(f"g{i}") for i in range(MOST_OPEN)} == {"accepted"}
    assert desk.ask("more") == "too_many_questions"


def test_who_is_not_at_the_desk_is_unreachable(desk: Desk) -> None:
    desk.transport.query_goals("carl", ["g1"])
    (failure,) = desk.transport.poll()
    assert isinstance(failure, SendFailed)
    assert failure.outcome == "unreachable"


def test_what_became_of_questions_can_be_queried(desk: Desk) -> None:
    desk.ask("g1")
    desk.transport.query_goals("anna", ["g1", "g2"])
    (reply,) = desk.transport.poll()
    assert isinstance(reply, QueryReplied)
    assert (reply.boot_id, [event.state for event in reply.goals]) == ("d1", ["accepted", "unknown"])


def test_answers_may_come_from_any_thread_and_count_once(desk: Desk) -> None:
    desk.ask("g1")
    texts: list[str | None] = []
    threads = [threading.Thread(target=lambda: texts.append(desk.transport.answer("g1", "loaded"))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert texts.count(None) == 1
    assert len([e for e in desk.transport.poll() if isinstance(e, GoalReported)]) == 1


def test_a_person_tells_events_that_are_counted(desk: Desk, wording: Wording) -> None:
    wakes = desk.wakes
    desk.transport.report_event("anna", "sos", {})
    desk.transport.report_event("anna", "fell", {"force": 3.0})
    told = desk.transport.poll()

    assert desk.wakes == wakes + 2
    assert [(e.event.agent, e.event.event, e.event.n, e.event.fields) for e in told if isinstance(e, EventArrived)] == [
        ("anna", "sos", 1, {}),
        ("anna", "fell", 2, {"force": 3.0}),
    ]
    with pytest.raises(TransportError) as refused:
        desk.transport.report_event("eve", "sos", {})
    wording(refused.value)
