"""The command that answers a question."""

from formiga_bt.cli.inbox import answer_command


def test_it_says_who_answers_where_several_could() -> None:
    question = {"number": "Q4", "here": ["picker_1", "watcher_1"], "answers": {}}
    assert answer_command(question, "clear") == "formiga answer Q4 clear --by picker_1"
    assert answer_command({**question, "answers": {"picker_1": "wait"}}, "clear") == "formiga answer Q4 clear"
    assert answer_command({**question, "here": ["watcher_1"]}, "clear") == "formiga answer Q4 clear"
