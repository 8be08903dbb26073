"""A request that only wants a question put to somebody: read, drafted without the model if need be, compared."""

import pytest

from formiga_bt.llm.draft import draft
from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.contradicted import contradicted
from formiga_bt.llm.words.only_question import only_question, tree_of
from tests.unit.llm.scripted import Scripted, fly_to, home
from tests.unit.llm.test_teams import judged, words, world


@pytest.mark.parametrize(
    ("request_", "people", "text"),
    [
        ("Only ask picker_1 whether the gate is shut. No drone takes off.", "picker_1", "Is the gate shut?"),
        ("Put the question to the watcher if they need help, nothing else.", "watcher", "Do you need help?"),
        (
            "Please ask picker_2 if she is back at the camp, without any flight.",
            "picker_2",
            "Are you back at the camp?",
        ),
        ("Ask picker_1 and picker_2 how many buckets are left.", "picker_1 picker_2", "How many buckets are left?"),
        (
            "Just ask picker_1 whether a drone may land at the camp; nobody flies.",
            "picker_1",
            "May a drone land at the camp?",
        ),
        ("Simplemente pregúntale a picker_1 si todo va bien. Ningún dron despega.", "picker_1", "¿Todo va bien?"),
        ('Ask the watcher: "Who has the key?" Nothing flies.', "watcher", "Who has the key?"),
    ],
)
def test_a_request_may_want_a_question_and_nothing_else(request_: str, people: str, text: str) -> None:
    found = only_question(words(request_), world())

    assert found is not None
    assert ([one.id or one.type for one in found.people], found.text) == (people.split(), text)


@pytest.mark.parametrize(
    "request_",
    [
        "Ask picker_1 whether a drone may land at the camp.",
        "Ask picker_1 if it is free and send a light drone to the camp.",
        "Ask picker_1 if it is free. If so, lwd_1 goes there.",
        "Ask picker_1 if it is free and tell the watcher.",
        "Just ask somebody whether the gate is shut.",
        "A light drone flies to the camp and asks picker_1 if all is well.",
    ],
)
def test_a_request_that_wants_more_is_no_mere_question(request_: str) -> None:
    assert only_question(words(request_), world()) is None


def test_a_model_that_answers_the_question_itself_is_asked_anew_and_then_it_is_drafted_without() -> None:
    request = "Just ask picker_2 whether the east field is dry for 100 m. No drone flies."
    chat = Scripted({"plan": "", "answer": {"question": "Is the field dry?"}})
    made = draft(request, world(), chat)

    assert (made.kind, len(chat.asked) > 1) == ("task", True)
    assert made.rounds[0].shortfalls[0].code == "contradicted"
    assert made.flight is not None
    assert (made.flight.asked, made.flight.visited) == (("picker_2",), {})
    assert 'ask: "Is the east field dry for 100 m?"' in made.yaml
    assert "expect" not in made.yaml  # a no is an answer, and no failure
    assert (
        "# Added: the question of the request is put to picker_2, and no more: no answer of the model did that"
        in made.yaml
    )


def test_a_question_back_is_an_answer_where_a_flight_is_wanted() -> None:
    assert (
        contradicted(
            ModelAnswer("", question="Which camp?"), world(), words("Ask picker_1 and fly a drone to the camp.")
        )
        == ""
    )


def test_a_drone_that_flies_where_only_a_question_was_wanted_is_found() -> None:
    request = "Just ask picker_2 whether the camp is dry."
    only = only_question(words(request), world())
    assert only is not None
    steps = tree_of(only)["steps"]
    found = judged(request, *steps, fly_to("camp"), home(), agents=[{"name": "drone", "type": "lwd"}])

    assert [one.code for one in found.shortfalls] == ["flies_unasked"]
