"""An answer may hold anything: it is asked for again, and no draft is lost."""

import json
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.llm import draft as drafting
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.drafts import keep, read_draft
from formiga_bt.llm.envelope import read_answer
from formiga_bt.llm.records import Draft, Origin
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

LOOK = "A light drone looks at the camp from 40 m for 30 seconds and comes home."
GOOD = tree(fly_to("camp"), {"wait": "30 s"}, home(), task="LookAtCamp")
FULL: Any = {
    "plan": "One drone.",
    "answer": {
        "tree": {
            "formiga": 1, "task": "Look", "imports": ["lib/flying.yaml"],
            "params": [{"name": "height", "type": "distance", "default": {"lit": "40 m"}},
                       {"name": "pause", "type": "duration", "default": {"lit": "30 s"}}],
            "agents": [{"name": "drone", "type": "lwd", "near": {"lit": "camp"}}],
            "steps": [
                {"call": "FlyTo", "with": [
                    {"name": "drone", "value": {"expr": "drone"}}, {"name": "to", "value": {"lit": "camp"}},
                    {"name": "height", "value": {"expr": "height"}}]},
                {"wait": {"expr": "pause"}},
                {"call": "ReturnHome", "with": [{"name": "drone", "value": {"expr": "drone"}}]},
            ],
        },
        "run": [],
    },
}  # fmt: skip
HALF = "\ud800"
ORIGIN = Origin(by="eve", request=LOOK, provider="x", model="", prompt_sha256="", rounds=1)


@cache
def world() -> RequestWorld:
    return world_of()


def made(*answers: Any, **options: Any) -> tuple[Draft, Scripted]:
    chat = Scripted(*answers)
    return draft(LOOK, world(), chat, options=Options(**options)), chat


def full(**other: Any) -> Any:
    found = deepcopy(FULL)
    found["answer"]["tree"] |= other
    return found


def of_role(**other: Any) -> Any:
    return tree(fly_to("camp"), {"wait": "30 s"}, home(), agents=[{"name": "drone", "type": "lwd"} | other])


@pytest.mark.parametrize("id_", [["lwd_1"], {"a": 1}, [[]]])
def test_the_id_of_a_role_is_one_text(id_: Any, wording: Wording) -> None:
    found, _ = made(of_role(id=id_), GOOD)

    assert (found.kind, len(found.rounds)) == ("task", 2)
    (wrong,) = found.rounds[0].shortfalls
    assert wrong.code == "form"
    wording(wrong.text)


@pytest.mark.parametrize(
    "other",
    [
        {"imports": [{"name": "lib/flying.yaml"}]},
        {"imports": 2.5},
        {"imports": True},
        {"params": True},
        {"params": [3]},
        {"agents": [{"name": "drone", "type": []}]},
        {"agents": 7},
        {"steps": [{"dance": 1}]},
        {"steps": [{"wait": {"lit": "1 s"}, "call": []}]},
        {"steps": {}},
        {"task": []},
    ],
)
def test_values_of_the_wrong_type_are_asked_for_again(other: dict[str, Any]) -> None:
    found, chat = made(full(**other), FULL, form="full")

    assert (found.kind, len(chat.asked)) == ("task", 2)
    assert any(one.severity == "error" for one in found.rounds[0].shortfalls)


def test_whatever_an_answer_makes_of_the_program_it_is_one_thing_that_is_wrong(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    judge = drafting.judge
    seen: list[Any] = []

    def breaks_once(*args: Any, **more: Any) -> Any:
        seen.append(args[0])
        if len(seen) == 1:
            raise StopIteration
        return judge(*args, **more)

    monkeypatch.setattr(drafting, "judge", breaks_once)
    found, chat = made(GOOD)

    assert (found.kind, len(chat.asked), len(found.rounds)) == ("task", 2, 2)
    (wrong,) = found.rounds[0].shortfalls
    assert (wrong.code, wrong.where) == ("form", "$")
    wording(wrong.text)  # fmt: skip


def test_what_is_wrong_with_the_machine_is_not_blamed_on_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_args: Any, **_more: Any) -> Any:
        raise UnusableFile("cannot read lib/flying.yaml")

    monkeypatch.setattr(drafting, "judge", fails)
    with pytest.raises(UnusableFile, match="cannot read"):
        made(GOOD)


def test_an_edit_that_breaks_leaves_the_answer_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_args: Any, **_more: Any) -> Any:
        raise KeyError("steps")

    monkeypatch.setattr(drafting, "nearest", fails)
    found, chat = made(tree(fly_to("camp", "20 m"), {"wait": "30 s"}, home()), GOOD)

    assert (found.kind, len(chat.asked)) == ("task", 2)


@pytest.mark.parametrize("is_parsed", [True, False], ids=["value", "text"])
@pytest.mark.parametrize(
    "answer",
    [
        {**GOOD, "plan": HALF},
        {"plan": "", "answer": {"question": f"Where{HALF}?"}},
        tree(fly_to("camp"), {"notify": HALF}, {"wait": "30 s"}, home()),
        tree({**fly_to("camp"), HALF: HALF}, home()),
        {**GOOD, "more": 10**40},
    ],
    ids=["plan", "question", "text", "key", "number"],
)
def test_halves_of_letters_are_kept_as_what_can_be_written(answer: Any, is_parsed: bool, tmp_path: Path) -> None:
    found, _ = made(answer if is_parsed else json.dumps(answer), rounds=0)
    kept = keep(tmp_path, found, ORIGIN)

    assert kept.folder.is_dir()
    assert HALF not in read_draft(tmp_path, 1).draft.yaml + found.say + found.plan


def test_a_whole_letter_in_two_halves_stays() -> None:
    assert read_answer(None, '{"plan": "\\ud83d\\ude81", "answer": {"question": "Where?"}}').plan == "\U0001f681"


def test_a_name_of_the_command_line_that_is_no_text_is_kept(tmp_path: Path) -> None:
    found, _ = made(GOOD)
    keep(tmp_path, found, Origin(by="e\udcffve", request=LOOK, provider="x", model="", prompt_sha256="", rounds=1))

    assert read_draft(tmp_path, 1).origin.by == "e\ufffdve"
