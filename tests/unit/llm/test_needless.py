"""A question whose answer stands in the request is not put to a person; words of motion are no doings that nothing can do."""

import pytest

from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.contradicted import contradicted
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.feasible import impossible
from formiga_bt.llm.words.wording import Words, read
from formiga_bt.llm.world import world_of

WORLD = world_of()


def words(request: str) -> Words:
    return read(request, WORLD.site, WORLD.catalogue)


@pytest.mark.parametrize(
    ("question", "request_"),
    [
        (
            "Where shall the light drone go? The site has camp and lake_shore.",
            "A light drone looks at the camp and returns.",
        ),
        ("Which places, and in which order?", "An LWD visits the camp and the lake shore, 20 s each."),
        ("What shall be done at west_field?", "Manda hwd_1 sobre el campo oeste a 45 m y que vuelva."),
        ("Which machine is meant? The site has lwd_1.", "Send a heavy drone to the camp."),
        ("How about a flight to the lake shore?", "Send a heavy drone to the camp."),
        (
            "Between which places? The site has camp.",
            "A light drone goes twice round the camp, 30 m out, and comes home.",
        ),
    ],
)
def test_what_the_request_says_is_not_asked(question: str, request_: str) -> None:
    assert contradicted(ModelAnswer("", question=question), WORLD, words(request_)).startswith("the answer ")


@pytest.mark.parametrize(
    ("question", "request_"),
    [
        ("Where shall the light drone go? The site has camp.", "A light drone flies over there, then to the camp."),
        ("Where shall the light drone go? The site has camp.", "A light drone flies from the camp to the lighthouse."),
        ("Between which places? The site has camp.", "A light drone goes to and fro at the camp."),
        ("Round which place shall it fly?", "A light drone flies a circle of 20 m and lands at the camp."),
        ("What shall be done at camp?", "The camp, with hwd_1, now."),
        ("Which machine is meant? The site has lwd_1.", "The same drone goes to the camp."),
        ("Who is to be asked? There are watcher_1.", "A light drone flies to the camp and asks."),
    ],
)
def test_other_questions_may_be_asked(question: str, request_: str) -> None:
    assert contradicted(ModelAnswer("", question=question), WORLD, words(request_)) == ""


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ("Drop by the camp with lwd_1 and pull back to the base.", ""),
        ("lwd_1 shall drop to 10 m over the camp and shoot up to 40 m.", ""),
        ("Fly lwd_1 to the camp and drop the box.", '"drop"'),
        ("lwd_1 shall pull up the fence at the camp.", '"pull"'),
        ("Push the cart to the camp with hwd_1.", '"Push"'),
    ],
)
def test_words_of_motion_are_no_doings(request_: str, said: str) -> None:
    found = impossible(words(request_), WORLD, verbs_of(WORLD))

    assert (found.why if found is not None else "").partition(",")[0].endswith(said)
    assert (found is None) == (not said)
