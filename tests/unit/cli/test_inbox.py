"""A question as people read it, and the command that answers it."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.cli.operator.inbox import answer_command, in_words
from formiga_bt.show.facts import QuestionFact


def test_it_says_who_answers_where_several_could() -> None:
    both = QuestionFact(number="Q4", task="Look-1", text="Seen it?", here=("picker_1", "watcher_1"))
    assert answer_command(both, "clear") == "formiga answer Q4 clear --by picker_1"
    one = QuestionFact(number="Q4", task="Look-1", text="Seen it?", here=("watcher_1",))
    assert answer_command(one, "clear") == "formiga answer Q4 clear"


@pytest.mark.parametrize(
    ("kind", "said", "lapses", "end"),
    [
        ("ask", "yes_", 51, "; lapses in 51 s, then its step fails: yes_"),
        ("ask", "", 51, "; lapses in 51 s, then its step fails"),
        ("clearance", "hwd_1 does not land here", 51, "; lapses in 51 s, then: hwd_1 does not land here"),
        ("ask", "yes_", None, ""),
    ],
)
def test_it_never_promises_an_answer_that_nobody_gives(kind: str, said: str, lapses: int | None, end: str) -> None:
    question = QuestionFact(
        number="Q4", kind=kind, text="Seen it?", options=("yes_", "no_"), asked=("eve",), here=("eve",), task="Look-1",
        asked_at=SECOND, lapses_at=None if lapses is None else (10 + lapses) * SECOND, if_no_answer=said,
    )  # fmt: skip
    assert in_words(question, 10 * SECOND).splitlines()[-1] == f"    asked: eve; for Look-1, since 9 s{end}"
