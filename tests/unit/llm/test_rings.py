"""Rings: round whom, with how many points, flown and not only landed on."""

from typing import Any

import pytest

from formiga_bt.llm.shaping.rings import goals, meant, round_
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged, land, words

PAIR = [{"name": "first", "type": "lwd"}, {"name": "second", "type": "lwd"}]
DRONE = [{"name": "drone", "type": "lwd"}]
REQUEST = (
    "Two light drones: the first lands at the camp. Meanwhile the second flies a circle with a radius of 18 m round the "
    "first and lands, too."
)


def ring(way: str, agent: str = "second") -> dict[str, Any]:
    return {"do": "FlyAlong", "agent": agent, "way": way, "height": "30 m"}


@pytest.mark.parametrize(
    "round_whom", ["first", "first.position", "ground(first.position)", "center_of_first", "first_drone"]
)
def test_a_ring_round_a_machine_is_round_where_it_is_sent(round_whom: str, wording: Wording) -> None:
    branches = [{"sequence": [ring(f"circle({round_whom}, 18 m)"), land("second", "camp")]}, land("first", "camp")]
    found = judged(REQUEST, {"parallel": branches}, agents=PAIR)

    assert errors(found) == []
    wording(found.mends)
    assert "way: ${circle(camp, radius)}" in found.yaml
    assert found.flight is not None
    assert "camp" in found.flight.stands.values()


def test_a_ring_round_a_machine_that_goes_to_several_places_is_no_place(wording: Wording) -> None:
    there = {"sequence": [fly_to("lake_shore", agent="first"), land("first", "camp")]}
    branches = [{"sequence": [ring("circle(ground(first.position), 18 m)"), land("second", "camp")]}, there]
    found = judged(REQUEST, {"parallel": branches}, agents=PAIR)

    wording(errors(found))


def test_names_that_may_be_several_machines_are_none() -> None:
    assert meant("the_place_of_one", {"one": "one", "other": "other"}, "other") == "one"
    assert meant("one", {"one_drone": "one_drone", "one_lwd": "one_lwd"}, "") == ""
    tree = {"agents": PAIR, "steps": [land("first", "camp"), fly_to("first", agent="second")]}
    assert goals(tree) == {"first": "camp"}


@pytest.mark.parametrize(
    ("way", "found"),
    [
        ("circle(camp, 18 m, points=4)", "circle(camp, 18 m)"),
        ("circle(offset(camp, east=5 m), 18 m, 8)", "circle(offset(camp, east=5 m), 18 m)"),
        ("circle(camp, 18 m, points=40)", "circle(camp, 18 m, points=40)"),
        ("circle(camp, 18 m, points=6)", "circle(camp, 18 m, points=6)"),
    ],
)
def test_a_ring_is_round(way: str, found: str) -> None:
    assert round_(way, words("It circles the camp, 18 m from it, with 6 stops.")) == found


def test_a_ring_to_land_on_is_flown(wording: Wording) -> None:
    request = "A light drone flies a circle of 18 m round the camp and lands."
    found = judged(request, land("drone", "circle(camp, 18 m)"), agents=DRONE)

    assert errors(found) == []
    wording(found.mends)
    only = judged(request, land("drone", "last(circle(camp, 18 m))"), agents=DRONE)
    wording(errors(only))


def test_a_loop_over_a_ring_is_a_flight_along_it(wording: Wording) -> None:
    loop = {
        "for": "spot",
        "in": "circle(camp, 18 m)",
        "steps": [{"do": "FlyTo", "agent": "drone", "to": "spot", "height": "30 m"}],
    }
    found = judged("A light drone circles the camp, 18 m from it, and comes home.", loop, home(), agents=DRONE)

    assert errors(found) == []
    assert found.yaml.count("FlyAlong") == 1
    assert "for:" not in found.yaml
    wording(found.mends)
