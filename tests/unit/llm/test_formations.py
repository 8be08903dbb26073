"""Teams that stand as a figure or in a row: where each lands, how far apart they are, how long the legs are."""

from typing import Any

import pytest

from formiga_bt.llm.shaping.formations import can_land_at, lands_below, leg_of, legs_in
from formiga_bt.llm.shaping.teams import gap_of, spaced
from formiga_bt.llm.words.landings import lands_only
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import TEAM, TWO, errors, judged, land, words

BELOW = "Three light drones stand as a triangle with legs of 12 m at the camp; each lands right below."


def hover(to: str, height: str = "30 m", agent: str = "drones") -> dict[str, Any]:
    return {"do": "FlyTo", "agent": agent, "to": to, "height": height}


@pytest.mark.parametrize(
    ("request_", "is_below"),
    [
        ("They hover at the camp and land right below.", True),
        ("They hover at the camp, then all land straight down.", True),
        ("Wait for the others; land where they are.", True),
        ("Se juntan sobre el campamento y aterrizan justo debajo.", True),
        ("They land below the camp.", False),
        ("They hover, then land at the camp, where they are seen.", False),
        ("Land where they are told to.", False),
        ("They land at the lake shore, right below.", False),
        ("They fly below 30 m and land.", False),
    ],
)
def test_who_lands_below_where_it_hovers(request_: str, is_below: bool) -> None:
    assert lands_below(words(request_)) is is_below


@pytest.mark.parametrize("at", ["line(camp, offset(camp, east=12 m), 3)", "camp", "triangle(lake_shore, 12 m)"])
def test_a_team_lands_below_where_it_hovers(at: str, wording: Wording) -> None:
    found = judged(BELOW, hover("triangle(camp, 12 m)"), land("drones", at), agents=TEAM)

    assert errors(found) == []
    wording(found.mends)
    assert "do: drone.LandIn" in found.yaml
    assert "FlyAndLand" not in found.yaml


def test_a_machine_lands_below_where_it_hovers(wording: Wording) -> None:
    up = [fly_to("camp", agent="one"), fly_to("offset(camp, east=15 m)", agent="other")]
    found = judged(
        "Two light drones hover 15 m apart at the camp and land where they are.",
        {"parallel": up},
        {"parallel": [land("one", "offset(camp, east=15 m)"), land("other", "camp")]},
        agents=TWO,
    )

    assert errors(found) == []
    assert found.flight is not None
    wording(sorted(found.flight.stands.values()))
    assert found.flight.stands == {one: places[0] for one, places in found.flight.landed.items()}


def test_a_place_that_is_named_once_is_that_of_the_figure() -> None:
    once = "Three light drones form a triangle with legs of 12 m at the camp and land together."
    steps = [hover("triangle(camp, 12 m)"), land("drones", "camp")]

    assert "triangle(camp, 12 m)" in judged(once, *steps, agents=TEAM).mends[0]
    assert "keep 5 m" in judged(once.replace("land together", "land at the camp"), *steps, agents=TEAM).mends[0]
    assert "keep 5 m" in judged(once.replace("land together", "land in a row"), *steps, agents=TEAM).mends[0]


@pytest.mark.parametrize(
    ("row", "found"),
    [
        ("line(camp, offset(camp, east=16 m), 3)", "[camp, offset(camp, east=8 m), offset(camp, east=2 * 8 m)]"),
        ("line(camp, offset(camp, north=-8 m), 3)", "[camp, offset(camp, north=-8 m), offset(camp, north=-2 * 8 m)]"),
        ("line(camp, offset(camp, east=20 m), 3)", ""),
        ("line(camp, lake_shore, 3)", ""),
        ("line(camp, offset(camp, east=16 m), 4)", ""),
    ],
)
def test_a_row_has_the_gap_between_neighbours(row: str, found: str) -> None:
    assert spaced(row, 3, "8 m") == (found or row)
    assert spaced(row, 3, "") == row


def test_a_row_of_three_stands_as_far_apart_as_the_request_says(wording: Wording) -> None:
    request = "Three light drones land at the camp in a row, with 8 m between neighbours."
    found = judged(request, land("drones", "line(camp, offset(camp, east=8 m), 3)"), agents=TEAM)

    assert errors(found) == []
    assert found.flight is not None
    wording(sorted(found.flight.stands.values()), found.mends)


@pytest.mark.parametrize(
    ("request_", "gap"),
    [
        ("they land 9 m uno de otro", "9 m"),
        ("aterrizan a nueve metros entre sí", "9 m"),
        ("they stand with 9 m between the drones", "9 m"),
        ("they fly between 9 m and 12 m", ""),
    ],
)
def test_how_far_apart_neighbours_are(request_: str, gap: str) -> None:
    assert gap_of(words(request_)) == gap


@pytest.mark.parametrize(
    ("request_", "leg"),
    [
        ("A triangle at the camp, legs of 12 m", "12 m"),
        ("As a right angle at the camp with 12 m long legs", "12 m"),
        ("Un triángulo en el campamento, catetos de 12 m", "12 m"),
        ("A triangle at the camp, 12 m", ""),
        ("One over the camp, two more 12 m away from it in perpendicular directions", "12 m"),
        ("Two more 12 m away from it in a row", ""),
        ("A triangle at the camp, 12 m along both legs, 35 m high", ""),
        ("A zigzag at the camp, legs of 12 m", ""),
    ],
)
def test_how_long_legs_are(request_: str, leg: str) -> None:
    assert leg_of(words(request_)) == leg


@pytest.mark.parametrize(
    ("said", "to", "height", "flown"),
    [
        ("legs 12 m", "triangle(camp, 90 m)", "12 m", ("12 m", "20 m")),
        ("legs 12 m, at 40 m", "triangle(camp, 40 m)", "12 m", ("12 m", "40 m")),
        ("legs 12 m", "triangle(offset(camp, east=5 m), 12 m)", "12 m", ("12 m", "20 m")),
        ("legs 12 m, at 12 m", "triangle(camp, 12 m)", "12 m", ("12 m", "12 m")),
    ],
)
def test_the_legs_are_those_of_the_request_and_no_height(said: str, to: str, height: str, flown: Any) -> None:
    request = f"Three light drones form a triangle at the camp, {said}, and land together."
    found = judged(request, hover(to, height), land("drones", to), agents=TEAM)

    texts = {value.name: value.text for value in found.values}
    assert legs_in(to)
    assert (texts["leg"], texts["height"]) == flown


def test_who_is_to_land_and_never_does_lands_where_it_hovers(wording: Wording) -> None:
    request = "Three light drones land at the camp in a row, 8 m apart, and stay there."
    row = "[camp, offset(camp, east=8 m), offset(camp, east=16 m)]"
    found = judged(request, hover(row), agents=TEAM)

    assert errors(found) == []
    wording(found.mends)
    assert judged("Three light drones land at the lake shore.", hover(row), agents=TEAM).yaml.count("ReturnHome") == 1
    assert can_land_at("lake_shore", words("It flies to the lake shore and lands."))
    assert not can_land_at("lake_shore", words("It flies to the camp and lands."))
    assert not can_land_at("lake_shore", words("It hovers at the lake shore and lands in the meadow."))


def test_a_team_that_is_left_in_the_air_comes_home() -> None:
    found = judged("Two light drones look at the camp and at the lake shore.", hover("[camp, lake_shore]"), agents=[
        {"name": "drones", "type": "lwd", "count": 2}
    ])  # fmt: skip

    assert errors(found) == []
    assert found.flight is not None
    assert set(found.flight.stands.values()) == {"home"}


def test_a_way_home_in_spanish_is_one() -> None:
    assert not lands_only(words("Un dron ligero aterriza en el campamento y luego vuelve a casa."))
    assert lands_only(words("Un dron ligero aterriza en el campamento."))
    assert not lands_only(words("A light drone looks at the camp and lands where it started."))
    assert not lands_only(words("LWD over the camp, then landing on the pad of departure."))
    assert not lands_only(words("Un dron ligero mira el campamento y aterriza donde despegó."))
    assert lands_only(words("Gather two light drones on the ground at the camp."))
    assert not lands_only(words("A light drone looks at people on the ground at the camp."))
    steps = [land("drone", "camp"), home()]
    request = "Un dron ligero aterriza en el campamento y luego regresa a su puerto."
    assert judged(request, *steps, agents=[{"name": "drone", "type": "lwd"}]).mends == ()
