"""Of two branches only one is done: who lands there on a yes is not in the way of who lands there on a no."""

from functools import cache
from typing import Any

import pytest

from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.judge import Judged, judge
from formiga_bt.llm.shaping.whereabouts import NOWHERE, PossiblePlace, Whereabouts
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home

AGENTS = [
    {"name": "one", "type": "lwd"},
    {"name": "other", "type": "lwd"},
    {"name": "third", "type": "hwd"},
    {"name": "watcher", "type": "watcher"},
]
ASK = {"ask": "Shall it land?", "of": ["watcher"], "save_as": "reply"}
ASIDE = "offset(camp, east=east)"


@cache
def world() -> RequestWorld:
    return world_of()


def judged(*steps: Any) -> Judged:
    words = read("", world().site, world().catalogue)
    used = {one["agent"] for one in all_steps(steps) if "agent" in one} | {"watcher"}
    agents = [one for one in AGENTS if one["name"] in used]
    answer = ModelAnswer("", tree={"task": "Mission", "agents": agents, "steps": list(steps)})
    return judge(answer, words, world(), verbs_of(world()), "short")


def all_steps(data: Any) -> list[dict[str, Any]]:
    if isinstance(data, (list, tuple)):
        return [one for item in data for one in all_steps(item)]
    return [data, *all_steps(list(data.values()))] if isinstance(data, dict) else []


def land(agent: str, at: str = "camp") -> dict[str, Any]:
    return {"do": "FlyAndLand", "agent": agent, "at": at}


def on(condition: str, *steps: Any, otherwise: Any = ()) -> dict[str, Any]:
    return {"if": condition, "then": list(steps), **({"else": list(otherwise)} if otherwise else {})}


def moved(found: Judged) -> list[str]:
    assert found.task is not None, found.shortfalls
    return [one for one in found.mends if " keeps " in one]


YES, NO = "reply.answer == 'yes'", "reply.answer == 'no'"
KEEPS = "other keeps 5 m from the one at camp"


@pytest.mark.parametrize(
    ("steps", "mends"),
    [
        ([ASK, on(YES, land("one"), otherwise=[land("other")])], []),
        ([ASK, on(YES, land("one")), on(NO, land("other"))], []),
        ([ASK, on(YES, land("one")), on("reply.answer != 'yes'", land("other"))], []),
        ([ASK, on(YES, land("one")), on("not (reply.answer == 'yes')", land("other"))], []),
        ([ASK, on(YES, {"wait": "5 s"}, otherwise=[land("one")]), on(YES, land("other"))], []),
        ([ASK, on(YES, land("one"), land("other"))], [KEEPS]),
        ([ASK, on(YES, land("one")), on(YES, land("other"))], [KEEPS]),
        ([ASK, on(YES, land("one")), land("other")], [KEEPS]),
        ([ASK, on("one.battery > 50 %", land("one")), on(YES, land("other"))], [KEEPS]),
        ([ASK, land("one"), on(YES, home("one"), otherwise=[land("other")])], [KEEPS]),
        ([ASK, land("one"), on(YES, home("one")), on(NO, {"wait": "5 s"}, otherwise=[land("other")])], []),
        ([ASK, on(YES, land("one"), land("other"), otherwise=[land("other"), land("one")])],
         [KEEPS, "one keeps 5 m from the one at camp"]),
    ],
)  # fmt: skip
def test_who_is_there_on_another_answer_only_is_not_in_the_way(steps: list[Any], mends: list[str]) -> None:
    assert moved(judged(*steps)) == mends


def test_a_third_one_keeps_off_the_spots_of_both_branches(wording: Wording) -> None:
    found = judged(ASK, on(YES, land("one"), otherwise=[land("other")]), land("third"))

    wording(moved(found))
    assert ASIDE in found.yaml


def test_in_a_loop_the_other_branch_may_be_done_in_the_next_round() -> None:
    rounds = {"repeat": "2", "steps": [ASK, on(YES, land("one"), otherwise=[land("other")])]}
    back = {
        "repeat": "2",
        "steps": [ASK, on(YES, land("one"), home("one"), otherwise=[land("other"), home("other")])],
    }

    assert moved(judged(rounds)) == [KEEPS]
    assert moved(judged(back)) == []


def test_of_three_answers_two_others_are_left() -> None:
    ask = {**ASK, "options": ["land", "stay", "home"]}
    either = on("reply.answer != 'land'", land("one")), on("reply.answer != 'stay'", land("other"))

    assert moved(judged(ask, *either)) == [KEEPS]


def test_what_was_moved_aside_in_one_branch_has_the_place_in_the_other(wording: Wording) -> None:
    found = judged(ASK, land("one", "lake_shore"), on(YES, land("other", "lake_shore"), otherwise=[land("other")]))

    wording(moved(found))
    assert "at: ${camp}" in found.yaml


def test_who_stands_on_the_ground_after_one_of_the_branches_takes_off_to_come_home() -> None:
    found = judged(ASK, on(YES, land("one"), otherwise=[fly_to("camp", agent="one")]), home("one"))

    assert found.errors == 0, found.shortfalls
    assert "call: FetchHome" in found.yaml


def test_where_a_machine_is_after_two_branches_is_certain_only_if_both_lead_there() -> None:
    at = Whereabouts()
    at.begin_if(YES)
    at.goes("one", "camp", "20 m")
    at.begin_else()
    at.goes("one", "base", "20 m")
    at.end_if()
    at.begin_if(YES)
    inside = at.only("one")
    at.begin_else()
    at.end_if()

    assert at.only("one") == NOWHERE
    assert inside == PossiblePlace("camp", "20 m")
    assert at.others("other") == {("camp", "20 m"), ("base", "20 m")}
    at.leaves("one")
    assert at.of("one") == ()
