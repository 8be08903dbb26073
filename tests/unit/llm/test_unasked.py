"""What a small model writes besides what was asked is left out, where the request shows that nobody asked for it."""

from typing import Any

import pytest

from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged

DRONE = [{"name": "drone", "type": "lwd"}]
ZIGZAG = "A light drone flies in a zigzag from the camp to the lake shore at 30 m: 4 legs, 9 m to each side{}, and comes home."
ROUND = "An LWD goes over the camp, the lake shore and the south field at 40 m, 15 s over each{}, and comes home."


def along(way: str, height: str = "30 m") -> dict[str, Any]:
    return {"do": "FlyAlong", "agent": "drone", "way": way, "height": height}


@pytest.mark.parametrize(
    "way", ["zigzag(offset(camp, north=9 m), lake_shore, 9 m, 4)", "zigzag(camp, offset(lake_shore, west=9 m), 9 m, 4)"]
)
def test_a_zigzag_begins_and_ends_at_the_places_of_the_request(way: str) -> None:
    found = judged(ZIGZAG.format(""), along(way), home(), agents=DRONE)

    assert errors(found) == []
    assert "zigzag(camp, lake_shore, amplitude, 4)" in found.yaml
    assert (
        len([one for one in found.mends if "9 m is the swing of the zigzag, and the request says no side" in one]) == 1
    )


@pytest.mark.parametrize(
    "more", [", beginning 9 m north of the camp", ", from a spot beside the camp", ", 9 m beside the camp"]
)
def test_a_spot_beside_a_place_stays_if_the_request_may_mean_it(more: str) -> None:
    found = judged(
        ZIGZAG.format(more), along("zigzag(offset(camp, north=9 m), lake_shore, 9 m, 4)"), home(), agents=DRONE
    )

    assert "offset(" in found.yaml


def test_another_length_beside_a_place_and_a_second_machine_stay() -> None:
    other = along("zigzag(offset(camp, north=4 m), lake_shore, 9 m, 4)")
    assert "offset(" in judged(ZIGZAG.format(""), other, home(), agents=DRONE).yaml
    way = along("zigzag(offset(camp, north=9 m), lake_shore, 9 m, 4)")
    two = [*DRONE, {"name": "second", "type": "lwd"}]
    assert "offset(" in judged(ZIGZAG.format(""), way, home(), fly_to("camp", agent="second"), agents=two).yaml


@pytest.mark.parametrize(("more", "ways"), [("", 0), (", first without stopping and then again", 1)])
def test_a_round_is_flown_once(more: str, ways: int) -> None:
    stops = [one for place in ("camp", "lake_shore", "south_field") for one in (fly_to(place), {"wait": "15 s"})]
    found = judged(ROUND.format(more), along("[camp, lake_shore, south_field]", "40 m"), *stops, home(), agents=DRONE)

    assert errors(found) == []
    assert found.yaml.count("call: FlyAlong") == ways
    assert found.yaml.count("call: FlyTo") == 3
    told = "drone flies the round once: the request names each of its places once"
    assert (told in found.mends) == (not ways)


def test_a_way_along_other_places_stays() -> None:
    stops = [one for place in ("lake_shore", "camp") for one in (fly_to(place), {"wait": "15 s"})]
    found = judged(ROUND.format(""), along("[camp, lake_shore, south_field]", "40 m"), *stops, home(), agents=DRONE)

    assert found.yaml.count("call: FlyAlong") == 1
