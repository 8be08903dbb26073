"""A follow-up goes on from what became the task: the edited answer, the best one, a person's own words in the file."""

import json
from functools import cache
from typing import Any

import pytest
from msgspec import structs

from formiga_bt.base.errors import UnusableFile
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.following import following
from formiga_bt.llm.records import Draft
from formiga_bt.llm.world import RequestWorld, world_of
from formiga_bt.safety.drafted import drafted, stamped
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

LOOK = "A light drone looks at the camp from 40 m for 30 seconds and comes home."
GOOD = tree(fly_to("camp"), {"wait": "30 s"}, home(), task="LookAtCamp")
OFF = tree(fly_to("camp", "20 m"), {"wait": "10 s"}, home(), task="LookAtCamp")


@cache
def world() -> RequestWorld:
    return world_of()


def made(request: str, *answers: Any, **options: Any) -> Draft:
    """Return a draft as it is found again: its text begins with the line of its origin, and ends with a line end."""
    found = draft(request, world(), Scripted(*answers), options=Options(**options))
    return structs.replace(found, yaml=stamped(found.yaml, drafted(["eve"], "m"))) if found.yaml else found


def steps_of(answer: str) -> Any:
    return json.loads(answer)["answer"]["tree"]["steps"]


def test_the_answer_that_a_program_edited_is_shown() -> None:
    found = made(LOOK, OFF)
    after = following(found, "call it so", world())

    assert found.rounds[0].answer
    assert after.before is not None
    assert (after.request, after.before[0], after.form) == ("call it so", LOOK, "short")
    assert steps_of(after.before[1]) == GOOD["answer"]["tree"]["steps"]


def test_what_a_person_wrote_into_the_file_is_shown() -> None:
    found = made(LOOK, GOOD)
    after = following(structs.replace(found, yaml=found.yaml.replace("40 m", "55 m")), "call it so", world())

    assert after.before is not None
    assert steps_of(after.before[1]) == [fly_to("camp", "55 m"), {"wait": "30 s"}, home()]


def test_of_a_failed_draft_the_best_answer_is_shown() -> None:
    better, worse = tree(fly_to("xanadu"), home()), tree(fly_to("xanadu"), fly_to("lago"), home())
    found = made(LOOK, better, worse, rounds=1)
    after = following(found, "I mean the camp", world())

    assert found.kind == "failed"
    assert after.before is not None
    assert json.loads(after.before[1]) == better


def test_of_a_failed_draft_without_a_text_the_best_answer_is_shown_too() -> None:
    better, worse = tree({"do": "Dance", "agent": "drone"}), "no JSON at all"
    found = made(LOOK, better, worse, rounds=1)
    after = following(found, "fly to it", world())

    assert (found.kind, found.yaml) == ("failed", "")
    assert after.before == (LOOK, json.dumps(better))


def test_of_a_draft_without_any_tree_both_requests_are_asked_anew() -> None:
    found = made(LOOK, "no JSON at all", rounds=0)
    after = following(found, "with lwd_1", world())

    assert (after.request, after.before, after.form) == (f"{LOOK}\nwith lwd_1", None, "short")


def test_a_question_of_a_program_is_answered_by_asking_anew(wording: Wording) -> None:
    first = made("send a drone to have a look", GOOD)
    chat = Scripted(tree(fly_to("camp"), home()))
    found = draft("at the camp", world(), chat, previous=first)

    assert (first.kind, first.rounds) == ("question", ())
    assert found.kind == "task"
    wording(found.request)
    assert "<request>send a drone to have a look\nat the camp</request>" in chat.asked[0][-1].text


def test_a_question_of_a_model_is_answered_in_the_same_talk() -> None:
    question = {"plan": "", "answer": {"question": "From how high?"}}
    first = made("Have a drone look at the tower.", question)
    after = following(first, "from 30 m", world())

    assert after.before == ("Have a drone look at the tower.", json.dumps(question))


def test_what_could_not_be_is_asked_anew_with_the_words_that_make_it_possible(wording: Wording) -> None:
    first = made("send 7 drones to the camp", GOOD)
    after = following(first, "only 2 drones then", world())

    assert (first.kind, first.rounds) == ("impossible", ())
    assert after.before is None
    wording(after.request)


def test_words_that_take_back_what_could_not_be_are_a_change(wording: Wording) -> None:
    first = made("A light drone flies to the camp at 200 m altitude and comes home.", GOOD)
    chat = Scripted(tree(fly_to("camp", "30 m"), home()))
    found = draft("at 30 m then", world(), chat, previous=first)

    assert (first.kind, first.rounds, found.kind) == ("impossible", (), "task")
    wording(json.loads(chat.asked[0][2].text)["answer"]["impossible"])


def test_a_proposal_of_an_assistant_is_shown_as_it_is() -> None:
    mine = Draft(request="a look", kind="task", yaml=made(LOOK, GOOD).yaml, provider="mcp:x")
    after = following(mine, "from 50 m", world())

    assert after.before is not None
    assert after.before[0] == "a look"
    assert steps_of(after.before[1]) == GOOD["answer"]["tree"]["steps"]


@pytest.mark.parametrize("yaml", ["formiga: 1\ntask: A\n", "x: [", "formiga: 1\ntask: A\nsteps: [{dance: 1}]\n"])
def test_a_task_that_somebody_broke_is_told(yaml: str, wording: Wording) -> None:
    mine = Draft(request="a look", kind="task", yaml=yaml, provider="mcp:x")

    with pytest.raises(UnusableFile) as told:
        following(mine, "from 50 m", world(), None, "drafts/1/task.yaml")
    wording(str(told.value))


def test_the_form_is_that_of_the_answer_before_unless_another_is_wanted(wording: Wording) -> None:
    found = made(LOOK, GOOD)
    full = following(found, "higher", world(), "full")
    priority = structs.replace(found, yaml=found.yaml.replace("version:", "priority: high\nversion:"))

    assert full.form == "full"
    assert full.before is not None
    assert steps_of(full.before[1])[0]["call"] == "FlyTo"
    assert following(priority, "higher", world()).form == "full"
    with pytest.raises(UnusableFile) as refused:
        following(priority, "higher", world(), "short")
    wording(refused.value)


def test_two_requests_that_are_too_long_together_are_refused(wording: Wording) -> None:
    first = made("send a drone to have a look", GOOD)

    with pytest.raises(UnusableFile) as refused:
        draft("x" * 1990, world(), Scripted(GOOD), previous=first)
    wording(refused.value)
