"""Regions where a place is due: all of them is looked at if the request says so, else a machine flies to the middle."""

from typing import Any

import pytest

from formiga_bt.llm.shaping.regions import looked_at
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import TWO, errors, judged, words, world

PAIR = [{"name": "drones", "type": "lwd", "count": 2}]
DRONE = [{"name": "drone", "type": "lwd"}]


@pytest.mark.parametrize(
    ("request_", "regions"),
    [
        ("Two light drones search the bog and the lake.", {"bog", "lake"}),
        ("One scans the bog, one the lake, 60 m.", {"bog", "lake"}),
        ("Un dron ligero rastrea la turbera y el lago.", {"bog", "lake"}),
        ("Survey the bog, then fly over the lake.", {"bog"}),
        ("Fly to the lake. Look at all of the bog.", {"bog"}),
        ("Search for the picker at the lake.", set()),
        ("Fly over the lake and look at the bog.", set()),
    ],
)
def test_which_regions_are_looked_at(request_: str, regions: set[str]) -> None:
    assert looked_at(words(request_), world().site.regions) == regions


def test_a_team_looks_at_a_region_each(wording: Wording) -> None:
    found = judged(
        "Two light drones at once: one searches the bog, one the lake, at 45 m; then home.",
        {"parallel": [fly_to("bog", "45 m", "drones"), fly_to("centroid(lake)", "45 m", "drones")]},
        home("drones"),
        agents=PAIR,
    )

    assert errors(found) == []
    wording(found.mends[0])
    assert found.flight is not None
    assert found.flight.timeline is not None
    rows = [row.agent for row in found.flight.timeline.actions if row.action == "Explore"]
    assert len({*rows}) == 2
    assert "near: ${[centroid(bog), centroid(lake)]}" in found.yaml
    assert "altitude: {type: distance, default: 45 m}" in found.yaml


def test_two_machines_look_at_a_region_each_and_go_home() -> None:
    found = judged(
        "Scan the lake and the bog with two light drones at 45 m and return.",
        {"parallel": [fly_to("lake", "45 m", "one"), fly_to("bog", "45 m", "other")]},
        {"parallel": [home("one"), home("other")]},
        agents=TWO,
    )

    assert errors(found) == []
    assert found.yaml.count("Explore") == 2


@pytest.mark.parametrize(
    ("request_", "steps", "kept"),
    [
        ("A light drone flies over the bog and comes home.", [fly_to("bog")], "centroid(bog)"),
        ("A light drone flies over the bog and lands there.", [{"do": "FlyAndLand", "agent": "drone", "at": "bog"}],
         "centroid(bog)"),
        ("A light drone explores the bog and comes home.",
         [fly_to("bog"), {"do": "Explore", "agent": "drone", "region": "bog"}], "centroid(bog)"),
    ],
)  # fmt: skip
def test_a_machine_flies_to_the_middle_of_a_region(
    request_: str, steps: list[Any], kept: str, wording: Wording
) -> None:
    found = judged(request_, *steps, home(), agents=DRONE)

    assert errors(found) == []
    assert kept in found.yaml
    wording(found.mends)


def test_what_is_not_certain_stays_an_error() -> None:
    twice = [fly_to("bog", agent="one"), fly_to("bog", agent="other")]
    assert errors(judged("Two light drones explore the bog.", {"parallel": twice}, agents=TWO)) != []
    heavy = [{"name": "drone", "type": "hwd"}]
    assert errors(judged("A heavy drone explores the bog.", fly_to("bog"), agents=heavy)) != []


def test_a_machine_on_the_ground_away_from_home_still_takes_off_for_it() -> None:
    land = {"do": "FlyAndLand", "agent": "drone", "at": "camp"}

    assert "FetchHome" in judged("A light drone lands at the camp and comes home.", land, home(), agents=DRONE).yaml
