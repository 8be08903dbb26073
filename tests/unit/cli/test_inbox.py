"""A question as people read it, and the command that answers it."""

import pytest

from formiga_bt.cli.operator.inbox import answer_command, in_words


def test_it_says_who_answers_where_several_could() -> None:
    question = {"number": "Q4", "here": ["picker_1", "watcher_1"], "answers": {}}
    assert answer_command(question, "clear") == "formiga answer Q4 clear --by picker_1"
    assert answer_command({**question, "answers": {"picker_1": "wait"}}, "clear") == "formiga answer Q4 clear"
    assert answer_command({**question, "here": ["watcher_1"]}, "clear") == "formiga answer Q4 clear"


@pytest.mark.parametrize(
    ("kind", "said", "lapses", "end"),
    [
        ("ask", "yes_", 51.2, "; lapses in 51 s, then its step fails: yes_"),
        ("ask", "", 51.2, "; lapses in 51 s, then its step fails"),
        ("clearance", "hwd_1 does not land here", 51.2, "; lapses in 51 s, then: hwd_1 does not land here"),
        ("ask", "yes_", None, ""),
    ],
)
def test_it_never_promises_an_answer_that_nobody_gives(kind: str, said: str, lapses: float | None, end: str) -> None:
    question = {
        "number": "Q4", "kind": kind, "text": "Seen it?", "options": ["yes_", "no_"], "note": "", "asked": ["eve"],
        "here": ["eve"], "task": "Look-1", "waiting_s": 9.0, "lapses_in_s": lapses, "if_no_answer": said,
    }  # fmt: skip
    assert in_words(question).splitlines()[-1] == f"    asked: eve; for Look-1, since 9 s{end}"
