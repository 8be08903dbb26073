"""Waits in prose for machines that are there already; those of one branch for another."""

from typing import Any

import pytest

from formiga_bt.llm.shaping.waits import without_idle_waits
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to
from tests.unit.llm.test_teams import TEAM, TWO, errors, judged, land

REQUEST = "Three light drones form a triangle of 20 m over the camp and land below when all are there."
UP = {"do": "FlyTo", "agent": "drones", "to": "triangle(camp, 20 m)", "height": "30 m"}
DOWN = land("drones", "triangle(camp, 20 m)")


def waited(text: str, *, people: bool = False, agents: Any = TEAM) -> list[Any]:
    tree = {"agents": agents, "steps": [UP, {"wait_until": text}, DOWN]}
    added: list[str] = []
    found: list[Any] = without_idle_waits(tree, people, added)["steps"]
    assert bool(added) is (len(found) == 2)
    return found


@pytest.mark.parametrize(
    ("text", "is_left_out"),
    [
        ("they are there", True),
        ("everyone is in position", True),
        ("${all three drones have arrived}", True),
        ("drones_ready", True),
        ("todos están en su sitio", True),
        ("everyone is out of the field", False),
        ("the watcher is there", False),
        ("not all are there", False),
        ("drones[0].airborne", False),
        ("reply.answer == 'ready'", False),
        ("the drones are at 40 m", False),
    ],
)
def test_a_wait_for_who_is_there_is_left_out(text: str, is_left_out: bool) -> None:
    assert (waited(text) == [UP, DOWN]) is is_left_out


def test_where_people_have_a_role_everyone_may_be_them() -> None:
    assert waited("everyone is there", people=True)[1] == {"wait_until": "everyone is there"}
    assert waited("all drones are there", people=True)[1] == {"wait_until": "all drones are there"}
    assert waited("the drones are there", people=True) == [UP, DOWN]


def test_a_wait_before_anything_was_done_stays() -> None:
    first = [{"wait_until": "they are ready"}, UP]

    assert without_idle_waits({"agents": TEAM, "steps": first}, False, [])["steps"] == first


def test_a_draft_lands_them_when_all_are_there(wording: Wording) -> None:
    found = judged(REQUEST, UP, {"wait_until": "everyone is there"}, DOWN, agents=TEAM)

    assert errors(found) == []
    wording(found.mends)


def test_branches_that_wait_for_each_other_go_on_together(wording: Wording) -> None:
    def branch(agent: str, place: str) -> dict[str, Any]:
        wait = {"wait_until": "the other one is there"}
        return {"sequence": [fly_to(place, agent=agent), wait, land(agent, place)]}

    both = {"parallel": [branch("one", "camp"), branch("other", "lake_shore")]}
    request = "Two light drones fly to the camp and the lake shore; when both are there, each lands."
    found = judged(request, both, agents=TWO)

    assert errors(found) == []
    wording(found.mends)
    assert found.yaml.count("parallel:") == 2
    assert found.yaml.index("FlyAndLand") > found.yaml.rindex("call: FlyTo")


def test_one_branch_that_waits_for_another_alone_stays_as_it_is() -> None:
    waits = {"sequence": [fly_to("camp", agent="one"), {"wait_until": "the other is there"}, land("one", "camp")]}
    both = [{"parallel": [waits, {"sequence": [land("other", "lake_shore")]}]}]

    assert without_idle_waits({"agents": TWO, "steps": both}, False, [])["steps"] == both
