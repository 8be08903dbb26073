"""The short form: what it means in the language, and a task of the language in the short form."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.llm.editing import as_answer
from formiga_bt.llm.envelope import read_answer
from formiga_bt.llm.judging.judge import judge
from formiga_bt.llm.shaping.lifting import Lifter
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home, tree


@cache
def world() -> RequestWorld:
    return world_of()


def lifter(request: str = "") -> Lifter:
    return Lifter(read(request, world().site, world().catalogue), world().site)


@pytest.mark.parametrize(
    ("text", "type_", "key", "value", "params"),
    [
        ("40 m", "distance", "height", {"expr": "height"}, {"height": "40 m"}),
        ("camp", "place", "to", {"expr": "camp"}, {"camp": "camp"}),
        ("${camp}", "place", "to", {"expr": "camp"}, {"camp": "camp"}),
        ("base", "place", "to", {"expr": "base"}, {}),
        ("p3", "place", "at", {"expr": "p3"}, {"p3": "p3"}),
        ("66.501, 25.703", "place", "to", {"expr": "target"}, {"target": "66.501,25.703"}),
        ("circle(base, 3m)", "list of place", "way", {"expr": "circle(base, radius)"}, {"radius": "3 m"}),
        (
            "zigzag(camp, lake_shore, 5 m, 10)",
            "list of place",
            "way",
            {"expr": "zigzag(camp, lake_shore, amplitude, 10)"},
            {"amplitude": "5 m", "camp": "camp", "lake_shore": "lake_shore"},
        ),
        (
            "offset(camp, north=-5 m)",
            "place",
            "at",
            {"expr": "offset(camp, north=-north)"},
            {"north": "5 m", "camp": "camp"},
        ),
        ("camp", "position", "to", {"expr": "above(camp, height)"}, {"camp": "camp", "height": "20 m"}),
        ("bog", "region", "region", {"expr": "bog"}, {"bog": "bog"}),
        ("true", "bool", "on", {"lit": "true"}, {}),
        ("All done at camp", "text", "text", {"text": "All done at camp"}, {}),
        ("lwd_1", "agent", "who", {"lit": "lwd_1"}, {}),
    ],
)
def test_a_constant_becomes_a_param(text: str, type_: str, key: str, value: Any, params: dict[str, str]) -> None:
    made = lifter()

    assert made.value(text, type_, key) == value
    assert {one.name: one.text for one in made.values()} == params


def test_words_of_the_request_are_found_whatever_their_unit() -> None:
    made = lifter("circle of three metres, wait half a minute, then 90 seconds, at a height of 1.5 km")
    for text, type_ in (("3 m", "distance"), ("1.5 min", "duration"), ("1500 m", "distance"), ("7 m", "distance")):
        made.value(text, type_, "x")

    assert [one.words for one in made.values()] == ["three metres", "90 seconds", "1.5 km", ""]


def test_words_that_stand_once_in_the_request_are_one_param() -> None:
    once, twice = lifter("circle of 10 m, land 10 m north"), lifter("at 60 m")
    for made, text in ((once, "10 m"), (twice, "60 m")):
        made.value(text, "distance", "height")
        made.value(text, "distance", "altitude")

    assert [one.name for one in once.values()] == ["height", "altitude"]
    assert [one.name for one in twice.values()] == ["height"]


def test_texts_in_conditions_stay_as_they_are(wording: Wording) -> None:
    wording(lifter().expression("reply.answer == 'camp' and drone.battery > 40 %"))


def test_a_role_that_would_hide_a_helper_has_another_name() -> None:
    words = read("", world().site, world().catalogue)
    answer = tree(fly_to("camp", agent="first"), home("first"), agents=[{"name": "first", "type": "lwd"}])
    judged = judge(read_answer(answer), words, world(), verbs_of(world()), "short")

    assert judged.task is not None
    assert list(judged.task.roles) == ["first_agent"]


def test_whoever_is_asked_needs_no_role() -> None:
    words = read("", world().site, world().catalogue)
    steps = [{"ask": "Go?", "of": [who]} for who in ("watchers", "picker", "picker_2")]
    judged = judge(read_answer(tree(*steps, agents=[])), words, world(), verbs_of(world()), "short")

    assert judged.task is not None
    assert {name: role.types for name, role in judged.task.roles.items()} == {
        "picker": ("picker",),
        "the_picker": ("picker",),
    }


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ({"do": "Dance", "agent": "drone"}, "there is no verb 'Dance'; verbs: ReturnHome, "),
        ({"do": "LandIn", "agent": "drone"}, "LandIn needs 'at' (place)"),
        ({"do": "LandIn", "agent": "drone", "to": "camp"}, "LandIn does not take 'to'; it takes: at"),
        ({"jump": "high"}, "this is no step: it has none of the keys do, parallel, "),
        ({"ask": "Go?", "of": ["nobody"]}, "there is nobody called 'nobody'"),
        ({"for": "a, b", "in": "line(base, camp, 3)", "steps": []}, "2 names, but 1 lists"),
        ({"parallel": {"wait": "1 s"}}, "this must be a list"),
        ({"wait": {"a": 1}}, None),
    ],
)
def test_what_is_not_of_the_form_is_told_with_its_path(step: Any, said: str | None) -> None:
    words = read("", world().site, world().catalogue)
    judged = judge(read_answer(tree(step)), words, world(), verbs_of(world()), "short")

    assert judged.task is None
    if said is not None:
        assert judged.shortfalls[0].text.startswith(said)
        assert judged.shortfalls[0].where.startswith("$.steps[0]")


def test_a_drafted_task_is_the_same_again_after_it_was_shown_for_an_edit(wording: Wording) -> None:
    words = read("a circle of 30 m round camp, 25 m high", world().site, world().catalogue)
    steps = [
        {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 30 m)", "height": "25 m"},
        {"repeat": "2", "steps": [{"wait": "5 s"}, {"if": "drone.battery > 50 %", "then": [fly_to("camp")]}]},
        {"ask": "Home?", "of": ["watchers"], "options": ["yes", "no"]},
        home(),
    ]
    first = judge(read_answer(tree(*steps)), words, world(), verbs_of(world()), "short")
    purpose, answer, form = as_answer(first.yaml, world())
    again = judge(read_answer(json.loads(answer)), words, world(), verbs_of(world()), "short")

    assert form == "short"
    wording(purpose)
    assert again.task is not None
    body = "\nformiga: 1\n"
    assert again.yaml.partition(body)[2].replace('""', "") == first.yaml.partition(body)[2]


@pytest.mark.parametrize("name", ["pick_up", "watch_dog_request", "delivery"])
def test_a_task_that_the_short_form_cannot_say_is_shown_in_full(name: str) -> None:
    text = (Path(folder("trees")) / f"{name}.yaml").read_text(encoding="utf-8")
    _, answer, form = as_answer(text, world())

    assert (form, json.loads(answer)["answer"]["run"]) == ("full", [])
