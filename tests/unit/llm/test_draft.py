"""A request becomes a task that passes all checks, or a question, or a reason; what is wrong goes back to the model."""

import json
from functools import cache
from typing import Any

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.records import Draft, ModelReply
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

LOOK = "A light drone looks at the camp from 40 m for 30 seconds and comes home."
GOOD = tree(fly_to("camp"), {"wait": "30 s"}, home(), task="LookAtCamp")


@cache
def world() -> RequestWorld:
    return world_of()


def made(request: str, *answers: Any, **options: Any) -> tuple[Draft, Scripted]:
    chat = Scripted(*answers)
    return draft(request, world(), chat, options=Options(**options)), chat


def codes(found: Draft) -> list[str]:
    return [one.code for one in found.shortfalls]


def test_a_good_answer_is_a_task_after_one_round() -> None:
    found, chat = made(LOOK, GOOD)

    assert (found.kind, found.task, len(found.rounds), codes(found)) == ("task", "LookAtCamp", 1, [])
    assert found.flight is not None
    assert (found.flight.status, found.flight.landed) == ("SUCCEEDED", {"lwd_3": ("home",)})
    assert chat.temperatures == [0.0]


def test_the_file_says_where_each_value_came_from() -> None:
    found, _ = made(LOOK, tree(fly_to("camp"), {"wait": "30 s"}, fly_to("camp", "25 m"), home(), task="LookAtCamp"))

    assert found.yaml == (
        "# Drafted by scripted none from the request:\n"
        "#   A light drone looks at the camp from 40 m for 30 seconds and comes home.\n"
        "# Plan: As asked.\n"
        "formiga: 1\n"
        "task: LookAtCamp\n"
        'version: "0.1.0"\n'
        'description: "A light drone looks at the camp from 40 m for 30 seconds and comes home."\n'
        "imports: [lib/flying.yaml]\n"
        "params:\n"
        '  camp: {type: place, default: camp}  # "camp"\n'
        '  height: {type: distance, default: 40 m}  # "40 m"\n'
        '  pause: {type: duration, default: 30 s}  # "30 seconds"\n'
        "  height_2: {type: distance, default: 25 m}  # assumed\n"
        "agents:\n"
        "  drone:\n"
        "    type: lwd\n"
        "    near: ${camp}\n"
        "steps:\n"
        "  - call: FlyTo\n"
        "    with:\n"
        "      drone: ${drone}\n"
        "      to: ${camp}\n"
        "      height: ${height}\n"
        "  - wait: ${pause}\n"
        "  - call: FlyTo\n"
        "    with:\n"
        "      drone: ${drone}\n"
        "      to: ${camp}\n"
        "      height: ${height_2}\n"
        "  - call: ReturnHome\n"
        "    with:\n"
        "      drone: ${drone}\n"
    )
    assert [(v.name, v.text, v.words) for v in found.values] == [
        ("camp", "camp", "camp"),
        ("height", "40 m", "40 m"),
        ("pause", "30 s", "30 seconds"),
        ("height_2", "25 m", ""),
    ]


def test_what_is_wrong_is_told_to_a_fresh_try_and_then_with_the_answer_and_the_step(wording: Wording) -> None:
    found, chat = made(
        LOOK, tree({"do": "FlyTo", "agent": "drone", "to": "camp"}), tree(fly_to("xanadu"), home()), GOOD
    )

    assert (found.kind, len(found.rounds)) == ("task", 3)
    _, first, second = (one[-1].text for one in chat.asked)
    wording(first, second)
    assert "xanadu" in second
    assert [len(one) - len(chat.asked[0]) for one in chat.asked] == [0, 0, 2]
    assert chat.temperatures == [0.0, 0.6, 0.6]


def test_at_most_three_repairs_then_the_best_answer_is_shown_as_failed(wording: Wording) -> None:
    bad = [tree(fly_to("xanadu"), home(), task=f"Try{n}") for n in range(9)]
    found, chat = made(LOOK, *bad)

    assert (found.kind, len(chat.asked), found.is_flyable) == ("failed", 4, False)
    wording(found.say)


def test_a_shortfall_of_the_outcome_is_told_to_the_model(wording: Wording) -> None:
    found, chat = made(LOOK, tree(fly_to("lake_shore"), {"wait": "30 s"}, home()), GOOD)

    assert found.kind == "task"
    wording(chat.asked[1][-1].text)


def test_a_drone_left_in_the_air_comes_home_without_asking_the_model(wording: Wording) -> None:
    found, chat = made(LOOK, tree(fly_to("camp"), {"wait": "30 s"}))

    assert (found.kind, len(chat.asked)) == ("task", 1)
    wording(found.rounds[0].mends)
    assert "# Added: drone comes home at the end: a task may not leave it in the air\n" in found.yaml


def test_a_drone_that_may_be_home_already_flies_there_once() -> None:
    ask = {"ask": "Home?", "of": ["watcher"], "save_as": "reply"}
    branch = {"if": "reply.answer == 'yes'", "then": [home()], "else": [{"notify": "It stays."}]}
    found, _ = made("Ask the watcher at the camp whether it may go home.", tree(fly_to("camp"), ask, branch))

    assert found.kind == "task"
    assert found.flight is not None
    assert found.flight.landed == {"lwd_3": ("home",)}


def test_a_place_where_a_position_is_due_is_flown_over() -> None:
    found, _ = made(
        LOOK, tree(fly_to("camp"), {"do": "GoTo", "agent": "drone", "to": "camp"}, {"wait": "30 s"}, home())
    )

    assert found.kind == "task"
    assert "to: ${above(camp, height)}" in found.yaml


def test_a_return_from_the_ground_takes_off_first() -> None:
    request = "A light drone lands at the camp, waits 30 s and comes home."
    found, _ = made(request, tree({"do": "FlyAndLand", "agent": "drone", "at": "camp"}, {"wait": "30 s"}, home()))

    assert (found.kind, found.rounds[0].mends) == ("task", ())
    assert "call: FetchHome" in found.yaml
    assert found.flight is not None
    assert found.flight.landed == {"lwd_3": ("camp", "home")}


def test_an_agent_that_the_request_names_gets_the_one_role_that_it_can_have(wording: Wording) -> None:
    found, chat = made("lwd_1 goes to the camp at 40 m and returns home", tree(fly_to("camp"), home()))

    assert (found.kind, len(chat.asked)) == ("task", 1)
    wording(found.rounds[0].mends)
    assert "    id: lwd_1\n" in found.yaml


def test_one_drone_in_two_branches_does_one_thing_after_another(wording: Wording) -> None:
    steps = {"parallel": [fly_to("camp"), {"wait": "30 s"}, home()]}
    found, _ = made(LOOK, tree(steps))

    assert found.kind == "task"
    wording(found.rounds[0].mends)
    assert found.flight is not None
    assert found.flight.visited == {"lwd_3": ("base", "camp")}


@pytest.mark.parametrize(
    ("answer", "kind", "say"),
    [
        ({"plan": "", "answer": {"question": "Where shall it go?"}}, "question", "Where shall it go?"),
        (
            {"plan": "", "answer": {"impossible": "No drone can paint.", "instead": "one could look at it"}},
            "impossible",
            "No drone can paint. Possible instead: one could look at it.",
        ),
    ],
)
def test_a_question_or_a_reason_is_handed_on(answer: Any, kind: str, say: str) -> None:
    found, chat = made("Send a drone to the tower.", answer)

    assert (found.kind, found.say, found.yaml, len(chat.asked)) == (kind, say, "", 1)


@pytest.mark.parametrize(
    ("request_", "say"),
    [
        (
            "Spray water on the south field.",
            'the request says "Spray", and nothing here can do that; verbs: ReturnHome, FlyTo, FlyAndLand, FlyAlong, '
            "TakeOff, GoTo, LandIn, Explore, MiniFinder.",
        ),
        (
            "Send five light drones to the camp.",
            "the request speaks of 5 light drones; the site rovaniemi has only 3 light drones. "
            "Possible instead: the same with 3.",
        ),
        (
            "lwd_9 flies to the camp.",
            "the site rovaniemi has no lwd_9. Possible instead: with one of lwd_1, lwd_2, lwd_3.",
        ),
        (
            "Un dron sube hasta 200 m sobre el campamento.",
            "200 m is higher than any drone may fly here (120 m over the ground). Possible instead: the same at 120 m.",
        ),
        (
            "Fly to the camp at 1,000 m altitude.",
            "1,000 m is higher than any drone may fly here (120 m over the ground). Possible instead: the same at 120 m.",
        ),
        (
            "Fly to the camp at 200 m altitude.",
            "200 m is higher than any drone may fly here (120 m over the ground). Possible instead: the same at 120 m.",
        ),
    ],
)
def test_what_cannot_be_for_certain_is_said_without_a_model(request_: str, say: str) -> None:
    found, chat = made(request_, GOOD)

    assert (found.kind, found.say, chat.asked) == ("impossible", say, [])


@pytest.mark.parametrize(
    "request_",
    ["Fly to the camp, where they spray the field.", "Look at the paint near the camp.", "Fly 200 m over to the camp"],
)
def test_what_may_be_possible_is_left_to_the_model(request_: str) -> None:
    _, chat = made(request_, GOOD, rounds=0)

    assert len(chat.asked) == 1


def test_a_request_without_a_place_of_which_nothing_comes_is_asked_about(wording: Wording) -> None:
    found, _ = made("Have a look from above.", tree({"do": "Dance", "agent": "drone"}), rounds=0)

    assert found.kind == "question"
    wording(found.say)


def test_an_answer_that_was_cut_off_is_none(wording: Wording) -> None:
    cut = ModelReply(text=json.dumps(GOOD), data=GOOD, finish="length")
    found, chat = made(LOOK, cut, GOOD)

    assert found.kind == "task"
    wording(chat.asked[1][-1].text)


@pytest.mark.parametrize(
    "text", ["no JSON at all", "{", "[]", '{"plan": "x", "answer": {}}', '{"answer": {"tree": 3}}']
)
def test_nonsense_is_refused_and_asked_again(text: str) -> None:
    found, chat = made(LOOK, text, GOOD)

    assert (found.kind, len(chat.asked)) == ("task", 2)


def test_a_follow_up_changes_the_draft_before(wording: Wording) -> None:
    first, _ = made(LOOK, GOOD)
    chat = Scripted(tree(fly_to("camp"), {"ask": "May it go?", "of": ["watcher"]}, {"wait": "30 s"}, home()))
    found = draft("wait for the watcher before it leaves", world(), chat, previous=first)

    assert found.kind == "task"
    assert [m.role for m in chat.asked[0]] == ["system", "user", "assistant", "user"]
    assert chat.asked[0][2].text == first.rounds[0].reply.text
    assert found.flight is not None
    assert found.flight.asked == ("watcher_1",)
    wording(found.request)
    assert f"description: {json.dumps(LOOK)}\n" in found.yaml
    assert ("height", "40 m", "40 m") in [(v.name, v.text, v.words) for v in found.values]


def test_a_follow_up_is_compared_with_its_own_words_only() -> None:
    first, _ = made(LOOK, GOOD)
    higher = tree(fly_to("camp", "60 m"), home(), task="LookAtCamp")
    chat = Scripted(GOOD, higher)
    found = draft("fly at 60 m and do not wait", world(), chat, previous=first)

    assert (found.kind, len(chat.asked), codes(found)) == ("task", 2, [])
    assert 'says "60 m"' in chat.asked[1][-1].text
    assert [(v.name, v.words) for v in found.values] == [("camp", "camp"), ("height", "60 m")]


@pytest.mark.parametrize("request_", ["", "  \n ", "x" * 2001])
def test_an_empty_or_endless_request_is_refused(request_: str) -> None:
    with pytest.raises(UnusableFile, match="the request"):
        made(request_, GOOD)


def test_the_full_form_writes_the_same_language() -> None:
    answer = {
        "plan": "One drone.",
        "answer": {
            "tree": {
                "formiga": 1, "task": "Look", "imports": ["lib/flying.yaml"],
                "params": [
                    {"name": "height", "type": "distance", "default": {"lit": "40 m"}},
                    {"name": "pause", "type": "duration", "default": {"lit": "30 s"}},
                ],
                "agents": [{"name": "drone", "type": "lwd", "near": {"lit": "camp"}}],
                "steps": [
                    {"call": "FlyTo", "with": [
                        {"name": "drone", "value": {"expr": "drone"}}, {"name": "to", "value": {"lit": "camp"}},
                        {"name": "height", "value": {"expr": "height"}}]},
                    {"wait": {"expr": "pause"}},
                    {"call": "ReturnHome", "with": [{"name": "drone", "value": {"expr": "drone"}}]},
                ],
            },
            "run": [
                {"name": "height", "value": "40 m", "words": "from 40 m"},
                {"name": "pause", "value": "30 s", "words": "hours"},
            ],
        },
    }  # fmt: skip
    found, _ = made(LOOK, answer, form="full")

    assert (found.kind, codes(found)) == ("task", [])
    # words that a model claims and that are not in the request do not count
    assert [(v.name, v.words) for v in found.values] == [("height", "from 40 m"), ("pause", "30 seconds")]


def test_a_tuned_model_gets_the_brief_prompt_and_is_asked_again_without_a_word_of_its_answer(wording: Wording) -> None:
    chat = Scripted(tree(fly_to("xanadu"), home()), GOOD)
    chat.prompt, chat.is_plain = "brief-1", True  # type: ignore[attr-defined]
    found = draft(LOOK, world(), chat)

    assert found.kind == "task"
    first, second = chat.asked
    assert first == second
    assert [one.role for one in first] == ["system", "user"]
    assert "Rules:" not in first[0].text
    wording(first[0].text)
    assert chat.temperatures == [0.0, 0.6]
    assert chat.is_plain is False  # type: ignore[attr-defined]


def test_a_change_of_a_draft_is_asked_of_the_model_without_its_adapter() -> None:
    before, _ = made(LOOK, GOOD)
    chat = Scripted(GOOD)
    chat.prompt, chat.is_plain = "brief-1", False  # type: ignore[attr-defined]
    draft("wait a minute longer", world(), chat, previous=before)

    assert chat.is_plain is True  # type: ignore[attr-defined]
    assert "Rules:" in chat.asked[0][0].text


def test_a_role_without_anything_to_do_borrows_nobody(wording: Wording) -> None:
    two = tree(fly_to("camp"), {"wait": "30 s"}, home(), task="LookAtCamp",
               agents=[{"name": "drone", "type": "lwd"}, {"name": "spare", "type": "hwd"}])  # fmt: skip
    found, chat = made(LOOK, two)

    assert (found.kind, len(chat.asked)) == ("task", 1)
    assert "spare:" not in found.yaml
    wording(found.rounds[0].mends)
