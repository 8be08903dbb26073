"""A task file as the answer of a model: nothing of it is lost on the way, or it is shown in the full form."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.editing import as_answer
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted

LOOK = """\
formiga: 1
task: Look
version: "{version}"
description: a look at the camp
imports: [lib/flying.yaml]
params:
  spot: {{type: place, default: camp{bound}}}
  fire: {{type: duration, default: 30 s}}
agents:
  drone: {{type: lwd, near: "${{{near}}}"}}
  person: {{type: watcher}}
steps:
  - call: FlyTo
    with: {{drone: "${{drone}}", to: "${{spot}}", height: 40 m}}
  - ask: {text}
    of: [person]
    options: ["no fire", "fire"]
    timeout: {timeout}
{then}  - wait: ${{fire}}
  - call: ReturnHome
    with: {{drone: "${{drone}}"}}
"""
EXPECT = "    expect: result.answer == 'no fire'\n"
USUAL = {"version": "0.1.0", "bound": "", "near": "spot", "text": "Home?", "timeout": "15 min", "then": EXPECT}


@cache
def world() -> RequestWorld:
    return world_of()


def shown(**other: str) -> tuple[Any, str]:
    _, answer, form = as_answer(LOOK.format(**USUAL | other), world())
    return json.loads(answer)["answer"]["tree"], form


def test_what_the_short_form_says_is_shown_in_it() -> None:
    tree, form = shown()

    assert form == "short"
    assert tree["agents"] == [{"name": "drone", "type": "lwd"}, {"name": "person", "type": "watcher"}]
    assert tree["steps"][1] == {"ask": "Home?", "of": ["person"], "options": ["no fire", "fire"]}
    assert "version" not in tree


@pytest.mark.parametrize(("near", "said"), [("lake_shore", "lake_shore"), ("base", "base"), ("spot", None)])
def test_a_place_near_which_somebody_is_wanted_is_kept(near: str, said: str | None) -> None:
    tree, form = shown(near=near)

    assert (form, tree["agents"][0].get("near")) == ("short", said)


@pytest.mark.parametrize(
    "other",
    [
        {"timeout": "2 min"},
        {"then": ""},
        {"then": EXPECT + "    save_as: reply\n"},
        {"bound": ", label: Where"},
        {"text": "Is it over ${spot}?"},
    ],
    ids=["timeout", "any answer", "answer and expect", "words of a form", "a param in a text"],
)
def test_what_it_would_lose_is_shown_in_the_full_form(other: dict[str, str]) -> None:
    _, form = shown(**other)

    assert form == "full"


def test_words_in_quotes_are_no_params(wording: Wording) -> None:
    then = "    save_as: reply\n  - if: reply.answer == 'no fire' and fire > 1 s\n    then: [{wait: 1 s}]\n"
    tree, form = shown(then=then)

    assert form == "short"
    wording(tree["steps"][2]["if"])


def test_an_answer_that_is_not_the_first_option_is_kept() -> None:
    tree, _ = shown(then=EXPECT.replace("no fire", "fire"))

    assert tree["steps"][1]["go_on"] == "fire"


def test_the_version_of_a_task_is_kept() -> None:
    text = LOOK.format(**USUAL | {"version": "2.0.1"})
    purpose, answer, _ = as_answer(text, world())
    told = json.loads(answer)
    del told["answer"]["tree"]["version"]  # no model says it
    chat = Scripted(json.loads(json.dumps(told).replace("40 m", "60 m")))
    found = draft("fly at 60 m", world(), chat, edit=(purpose, answer), options=Options(rounds=0))

    assert found.kind == "task"
    assert 'version: "2.0.1"\n' in found.yaml
    chat = Scripted(json.loads(json.dumps(told).replace("40 m", "70 m")))
    again = draft("fly at 70 m", world(), chat, previous=found, options=Options(rounds=0))
    assert 'version: "2.0.1"\n' in again.yaml


def test_an_example_need_not_be_exact() -> None:
    text = LOOK.format(**USUAL | {"timeout": "2 min", "near": "lake_shore", "bound": ", label: Where"})
    _, answer, form = as_answer(text, world(), exact=False)

    assert form == "short"
    assert "near" not in json.loads(answer)["answer"]["tree"]["agents"][0]


def test_the_full_form_can_be_wanted() -> None:
    _, answer, form = as_answer(LOOK.format(**USUAL), world(), "full")

    assert form == "full"
    assert json.loads(answer)["answer"]["run"] == []


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "dance: 1",
        "task: A\nsteps: [{dance: 1}]",
        "task: A\nsteps: 3",
        "agents: {a: [1]}",
        "steps: [{wait: 1, x: 2}]",
    ],
)
def test_what_is_no_task_has_no_json_form(text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"."):
        from_yaml(text, world().catalogue)
