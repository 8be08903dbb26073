"""Questions of a draft are put to each who must agree, and when the machine is where the request has it by then."""

from typing import Any

import pytest

from formiga_bt.llm.shaping.asking import as_asked
from formiga_bt.llm.words.questions import questions
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged, land, words, world

PICKERS = [
    {"name": "picker", "type": "picker", "id": "picker_1"},
    {"name": "picker", "type": "picker", "id": "picker_2"},
]
DRONE = {"name": "drone", "type": "lwd"}
BOTH = "Ask picker_1 and then picker_2 if it is free; after two yes a light drone flies to the camp at 40 m and comes home."
BY_TURNS = "picker_1 and picker_2 are asked one after the other and must each say yes, as the request says"


def ask(*of: str, text: str = "Is it free?", **more: str) -> dict[str, Any]:
    return {"ask": text, "of": list(of), **more}


def lines(text: str) -> list[str]:
    kinds = ("ask:", "- picker", "- watcher", "call:", "if:", "then:", "else:", "expect:", "notify:")
    return [line.strip() for line in text.partition("\nsteps:")[2].splitlines() if any(kind in line for kind in kinds)]


@pytest.mark.parametrize(
    "condition", ["responses.both_say_yes", "all(responses)", "responses[0] == 'yes' && responses[1] == 'yes'"]
)
def test_each_of_two_who_must_agree_is_asked(condition: str) -> None:
    found = judged(
        BOTH,
        ask("picker", "picker_2", save_as="responses"),
        {"if": condition, "then": [fly_to("camp"), home()]},
        agents=[DRONE, *PICKERS],
    )

    assert errors(found) == []
    assert found.mends == (BY_TURNS,)
    assert found.flight is not None
    assert found.flight.asked == ("picker_1", "picker_2")
    assert found.yaml.count("expect: result.answer == 'yes'") == 2
    assert " if: " not in found.yaml


def test_what_is_done_on_a_no_stays_so() -> None:
    found = judged(
        BOTH,
        ask("picker_1", "picker_2", save_as="said"),
        {"if": "said.yes", "then": [fly_to("camp"), home()], "else": [{"notify": "They are not ready."}]},
        agents=[DRONE],
    )

    assert errors(found) == []
    assert "if: said_1.answer == 'yes' and said_2.answer == 'yes'" in found.yaml
    assert "They are not ready." in found.yaml


def test_who_must_agree_too_is_asked_right_after_the_other(wording: Wording) -> None:
    request = "A light drone lands at the camp. First the picker (picker_2) and then a watcher must agree before it flies home."
    found = judged(request, land("drone", "camp"), ask("picker"), home(), agents=[DRONE, PICKERS[1]])

    assert errors(found) == []
    wording(found.mends)
    assert found.flight is not None
    assert found.flight.asked == ("picker_2", "watcher_1")


@pytest.mark.parametrize(
    ("request_", "steps"),
    [
        ("Ask picker_1 or picker_2 if the way is free.", [ask("picker_1", "picker_2")]),
        (
            BOTH,
            [
                ask("picker_1", "picker_2", save_as="said"),
                {"if": "said.answer == 'no'", "then": [fly_to("camp"), home()]},
            ],
        ),
        (BOTH, [ask("picker_1"), ask("picker_2"), fly_to("camp"), home()]),
        (BOTH, [{"repeat": "2", "steps": [ask("picker_1")]}, fly_to("camp"), home()]),
    ],
)
def test_questions_that_are_right_or_not_certainly_wrong_stay(request_: str, steps: list[Any]) -> None:
    answer = {"task": "Mission", "agents": [DRONE], "steps": steps}
    told: list[str] = []

    assert as_asked(answer, questions(words(request_), world()), world(), told) == answer
    assert told == []


@pytest.mark.parametrize(
    ("of", "wrong"),
    [
        (["picker_1"], "the request wants picker_2 to be asked, and the task asks picker_1 only"),
        (
            ["picker_1", "picker_2"],
            "the request wants picker_1 and picker_2 to agree, and the task goes on with the first answer of any of them",
        ),
    ],
)
def test_somebody_whose_word_does_not_count_is_found(of: list[str], wrong: str) -> None:
    found = judged(BOTH, {"repeat": "1", "steps": [ask(*of)]}, fly_to("camp"), home(), agents=[DRONE])

    assert wrong in errors(found)


def test_the_flight_that_is_told_first_is_in_front_of_the_question(wording: Wording) -> None:
    request = "A light drone hovers over the camp at 40 m; when a watcher agrees, it lands, otherwise it comes home."
    answer = {"if": "said.answer == 'yes'", "then": [fly_to("camp"), land("drone", "camp")], "else": [home()]}
    found = judged(request, ask("watcher", save_as="said"), answer, agents=[DRONE])

    assert errors(found) == []
    wording(found.mends, lines(found.yaml))  # fmt: skip


@pytest.mark.parametrize(
    "steps",
    [
        [ask("picker_1", text="May it go there?"), land("drone", "camp"), home()],
        [
            ask("picker_1", text="May it go there?", save_as="said"),
            {"if": "said.answer == 'yes'", "then": [land("drone", "camp"), home()]},
        ],
        [
            ask("picker_1", text="May it go there?", save_as="said"),
            {"if": "said.answer == 'yes'", "then": [land("drone", "camp")], "else": []},
            home(),
        ],
    ],
)
def test_who_decides_on_the_way_back_is_asked_there(steps: list[Any], wording: Wording) -> None:
    request = (
        "Carry buckets to the camp by light drone. It lands and takes off again only when picker_1 says yes; then home."
    )
    found = judged(request, *steps, agents=[DRONE])

    assert errors(found) == []
    wording([line for line in lines(found.yaml) if "call" in line or "ask" in line])  # fmt: skip


def test_a_drone_that_lands_at_once_hovers_there_first(wording: Wording) -> None:
    request = "A light drone hovers over the camp at 35 m; when the watcher agrees, it lands."
    found = judged(request, ask("watcher"), land("drone", "camp"), agents=[DRONE])

    assert errors(found) == []
    wording([line for line in lines(found.yaml) if "call" in line or "ask" in line])  # fmt: skip


def test_a_question_that_is_put_too_early_is_found() -> None:
    request = "A light drone hovers over the camp at 40 m; when the watcher agrees, it lands."
    found = judged(request, ask("watcher"), {"sequence": [land("drone", "camp")]}, agents=[DRONE])
    wrong = [one for one in found.shortfalls if one.code == "asked_too_early"]

    assert [one.about for one in wrong] == ["camp"]
    again = judged(request, fly_to("camp"), ask("watcher"), land("drone", "camp"), agents=[DRONE])
    assert errors(again) == []


def test_a_question_before_the_flight_stays_where_the_request_has_it() -> None:
    for request in (
        "If the watcher agrees, a light drone flies to the camp at 40 m and comes home.",
        "A light drone flies to the camp at 40 m when the watcher agrees, and comes home.",
    ):
        found = judged(request, ask("watcher"), fly_to("camp"), home(), agents=[DRONE])

        assert (errors(found), found.mends) == ([], ())
