"""A question as people read it, and the command that answers it."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.cli.operator.inbox import answer_command, in_words
from formiga_bt.show.facts import QuestionFact
from tests.golden import Wording


def test_it_says_who_answers_where_several_could(wording: Wording) -> None:
    both = QuestionFact(number="Q4", task="Look-1", text="Seen it?", here=("picker_1", "watcher_1"))
    wording(answer_command(both, "clear"))
    one = QuestionFact(number="Q4", task="Look-1", text="Seen it?", here=("watcher_1",))
    wording(answer_command(one, "clear"))


@pytest.mark.parametrize(
    ("kind", "said", "lapses"),
    [("ask", "yes_", 51), ("ask", "", 51), ("clearance", "hwd_1 does not land here", 51), ("ask", "yes_", None)],
)
def test_it_never_promises_an_answer_that_nobody_gives(
    kind: str, said: str, lapses: int | None, wording: Wording
) -> None:
    question = QuestionFact(
        number="Q4", kind=kind, text="Seen it?", options=("yes_", "no_"), asked=("eve",), here=("eve",), task="Look-1",
        asked_at=SECOND, lapses_at=None if lapses is None else (10 + lapses) * SECOND, if_no_answer=said,
    )  # fmt: skip
    wording(in_words(question, 10 * SECOND).splitlines()[-1])
