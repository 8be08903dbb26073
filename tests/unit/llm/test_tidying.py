"""What a small model writes and a program puts as the language has it: `its port` as a place, a ring without its way back."""

from typing import Any

import pytest

from formiga_bt.llm.tidying import wants_centre
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged

DRONE = [{"name": "drone", "type": "lwd"}]
RING = {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 20 m)", "height": "30 m"}


def to(place: str, do: str = "FlyTo") -> dict[str, Any]:
    values = {"to": place, "height": "20 m"} if do == "FlyTo" else {"at": place}
    return {"do": do, "agent": "drone", **values}


@pytest.mark.parametrize(
    "ends",
    [
        [to("port")],
        [to("its_port"), home()],
        [home(), to("port"), home()],
        [to("its own port"), to("port", "LandIn")],
        [to("home port", "FlyAndLand")],
    ],
)
def test_a_flight_to_its_port_is_the_way_home(ends: list[dict[str, Any]]) -> None:
    found = judged(
        "A light drone flies to the camp at 30 m, to its port, and lands.", fly_to("camp"), *ends, agents=DRONE
    )

    assert [text for text in errors(found) if "30 m" not in text] == []
    assert found.yaml.count("ReturnHome") == 1
    assert "drone comes home: that is its port" in found.mends
    assert found.flight is not None
    assert list(found.flight.stands.values()) == ["home"]


def test_two_ways_home_that_a_model_wrote_itself_stay() -> None:
    found = judged("A light drone looks at the camp and comes home.", fly_to("camp"), home(), home(), agents=DRONE)

    assert found.yaml.count("ReturnHome") + found.yaml.count("FetchHome") == 2


def test_a_ring_ends_over_its_centre_if_the_request_says_so() -> None:
    request = "A light drone flies a circle of 20 m about the camp at 30 m, goes back to the centre, and comes home."
    found = judged(request, RING, home(), agents=DRONE)

    assert errors(found) == []
    assert found.mends == ("drone goes back to the centre, camp, after the circle, as the request says",)
    assert [step.strip() for step in found.yaml.splitlines() if "call:" in step] == [
        "- call: FlyAlong", "- call: FlyTo", "- call: ReturnHome",
    ]  # fmt: skip


def test_a_ring_in_a_branch_goes_back_in_that_branch() -> None:
    agents = [{"name": "drone", "type": "lwd"}, {"name": "other", "type": "lwd"}]
    request = (
        "One light drone flies a circle of 20 m about the camp at 30 m and then goes back to the centre, another one "
        "goes to the lake shore at 30 m at the same time."
    )
    there = {"do": "FlyTo", "agent": "other", "to": "lake_shore", "height": "30 m"}
    found = judged(request, {"parallel": [RING, there]}, agents=agents)

    assert errors(found) == []
    assert found.flight is not None
    assert "camp" in next(way for way in found.flight.visited.values() if "lake_shore" not in way)


@pytest.mark.parametrize(
    ("request_", "wants"),
    [
        ("It circles the camp and returns to the middle.", True),
        ("It circles the camp, then back to the centre of the circle, then home.", True),
        ("Da una vuelta al campamento, luego vuelve al centro y regresa.", True),
        ("It circles the camp, then flies to the centre of the east field.", False),
        ("It circles the camp, 20 m from the centre, then comes home.", False),
        ("Rodea el campamento y luego va al centro de la isla.", False),
    ],
)
def test_which_requests_want_the_way_back_to_the_centre(request_: str, wants: bool) -> None:
    assert wants_centre(request_) == wants


def test_nothing_is_added_where_the_tree_goes_there() -> None:
    request = "A light drone flies a circle of 20 m about the camp at 30 m, goes back to the centre, and comes home."

    assert judged(request, RING, fly_to("camp"), home(), agents=DRONE).mends == ()
