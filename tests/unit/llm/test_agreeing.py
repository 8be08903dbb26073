"""Of several answers that pass, the one is taken that most of them mean, whatever they are called."""

from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.errors import Cancelled, LlmError, NoKey
from formiga_bt.llm.judging.agreeing import elected, is_settled
from formiga_bt.llm.records import ModelReply
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

LOOK = "A light drone looks at the camp and comes home."
LOW = tree(fly_to("camp", "20 m"), home(), task="Low")
HIGH = tree(fly_to("camp", "50 m"), home(), task="High")
HIGH_TOO = tree({"sequence": [fly_to("camp", "50 m")]}, home(), task="OtherName")
BAD = tree(fly_to("xanadu"), home(), task="Bad")
ASKS = {"plan": "", "answer": {"question": "How high?"}}


@cache
def world() -> RequestWorld:
    return world_of()


def chosen(*answers: object, candidates: int = 0) -> tuple[str, int]:
    chat = Scripted(*answers)
    made = draft(LOOK, world(), chat, options=Options(candidates=candidates or len(answers), rounds=0))
    return made.task or made.kind, len(chat.asked)


def test_what_most_answers_mean_is_taken_and_not_what_came_first() -> None:
    assert chosen(LOW, HIGH, HIGH_TOO) == ("High", 3)


def test_what_does_not_pass_has_no_vote() -> None:
    assert chosen(BAD, LOW, BAD) == ("Low", 3)


def test_equal_votes_take_the_first_which_is_the_likeliest() -> None:
    assert chosen(LOW, HIGH) == ("Low", 2)


def test_a_question_is_an_answer_too() -> None:
    assert chosen(LOW, ASKS, ASKS) == ("question", 3)


def test_who_reads_a_draft_is_told_when_no_two_answers_do_the_same(wording: Wording) -> None:
    def warnings(*answers: object) -> list[str]:
        made = draft(LOOK, world(), Scripted(*answers), options=Options(candidates=len(answers), rounds=0))
        assert made.shortfalls == made.rounds[-1].shortfalls
        return [one.text for one in made.shortfalls if one.code == "answers_differ"]

    wording(warnings(LOW, HIGH))
    assert warnings(HIGH, HIGH_TOO) == warnings(LOW, HIGH, HIGH_TOO) == warnings(LOW, BAD) == warnings(LOW) == []


def test_nobody_is_asked_once_the_vote_is_settled() -> None:
    assert chosen(HIGH, HIGH_TOO, LOW, candidates=3) == ("High", 2)


class BreaksOff(Scripted):
    """Says what it was told to, and then fails with an error."""

    def __init__(self, error: LlmError, *given: object) -> None:
        super().__init__(*given)
        self.error, self.left = error, len(given)

    def complete(self, *args: Any, **more: Any) -> ModelReply:
        self.left -= 1
        if self.left < 0:
            raise self.error
        return super().complete(*args, **more)


def test_what_passed_is_kept_when_the_model_then_fails(wording: Wording) -> None:
    chat = BreaksOff(NoKey("groq refuses the key (HTTP 401)\n  help: another"), BAD, LOW)
    made = draft(LOOK, world(), chat, options=Options(candidates=4, rounds=0))

    assert (made.kind, made.task, len(made.rounds)) == ("task", "Low", 2)
    assert [(one.code, one.severity) for one in made.shortfalls if one.code == "answers_missing"] == [
        ("answers_missing", "warning")
    ]
    wording([one.text for one in made.shortfalls if one.code == "answers_missing"])  # fmt: skip


@pytest.mark.parametrize(
    ("error", "given_"), [(NoKey("no"), (BAD,)), (NoKey("no"), ()), (Cancelled("stopped"), (LOW,))]
)
def test_without_one_that_passed_or_when_a_person_stops_it_is_told(error: LlmError, given_: tuple[object, ...]) -> None:
    with pytest.raises(type(error)):
        draft(LOOK, world(), BreaksOff(error, *given_), options=Options(candidates=3, rounds=0))


@given(st.lists(st.integers(0, 3), min_size=1, max_size=9), st.lists(st.integers(0, 3), max_size=9))
def test_a_settled_vote_stays(so_far: list[int], more: list[int]) -> None:
    if is_settled(so_far, len(more)):
        every = [*so_far, *more]
        assert every[elected(every)] == so_far[elected(so_far)]
