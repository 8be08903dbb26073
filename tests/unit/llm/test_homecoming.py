"""Of two machines of which a request sends one home, the other one stays where it was sent; what is not certain is not said."""

from functools import cache

import pytest

from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.judging.homecoming import stays_at
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import World, world_of
from tests.unit.llm.scripted import Scripted, home, tree

BOTH = ({"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"})


@cache
def world() -> World:
    return world_of()


@pytest.mark.parametrize(
    ("request_", "place"),
    [
        (
            "Two LWDs land at the camp 5 m apart; then the first goes home, the second flies on to the lake shore.",
            "lake_shore",
        ),
        ("They land. On a yes drone one returns to its port while drone two moves to the camp, both landing.", "camp"),
        ("Then one goes home to its port and the other to the camp. Both come home in the end.", ""),
        ("On a yes one of them returns to its port and the other one moves to the camp and lands.", "camp"),
        ("The first one goes home, then both fly to the camp.", ""),
        ("The first one goes home, the second goes to the camp and comes home too.", ""),
        ("The first one returns to its port while the second looks at the camp and then at the lake shore.", ""),
        ("El primero vuelve a casa y el otro va al campamento y aterriza.", "camp"),
        ("A light drone looks at the camp and comes home.", ""),
    ],
)
def test_where_the_second_one_stays(request_: str, place: str) -> None:
    assert stays_at(read(request_, world().site, world().catalogue)) == place


def test_who_is_left_at_a_place_does_not_come_home() -> None:
    request = (
        "Two light drones land at the camp, 5 m apart. Then one goes home to its port, the other on to the lake shore."
    )
    lands = {"do": "FlyAndLand", "agent": "one", "at": "camp"}
    beside = {"do": "FlyAndLand", "agent": "other", "at": "offset(camp, east=5 m)"}
    on = {"do": "FlyAndLand", "agent": "other", "at": "lake_shore"}
    wrong = tree({"parallel": [lands, beside]}, home("one"), on, home("other"), agents=BOTH)
    made = draft(request, world(), Scripted(wrong), options=Options(rounds=0))

    assert made.kind == "task"
    assert "# Added: other stays at lake_shore, as the request says" in made.yaml
    assert made.flight is not None
    assert sorted(made.flight.stands.values()) == ["home", "lake_shore"]
