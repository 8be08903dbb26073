"""Of two machines of which a request sends one home, the other one stays where it was sent; what is not certain is not said."""

from functools import cache

import pytest

from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.judging.homecoming import stays_at
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.unit.llm.scripted import Scripted, home, tree

BOTH = ({"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"})


@cache
def world() -> RequestWorld:
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


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        ("Two light drones land at the camp and the lake shore, then both come home.", True),
        ("One light drone lands at the camp, another one at the lake shore. Both return.", True),
        ("All drones fly home after they have landed at the camp and the lake shore.", True),
        ("Un dron ligero aterriza en el campamento, otro en la orilla del lago. Luego los dos vuelven a casa.", True),
        ("Two light drones land at the camp and the lake shore; the first one comes home.", False),
        ("Two light drones land at the camp and the lake shore; both come home unless the wind is strong.", False),
        ("Two light drones land at the camp and the lake shore. One comes home, both are looked at.", False),
    ],
)
def test_all_come_home_where_a_request_says_so(request_: str, told: bool) -> None:
    lands = [{"do": "FlyAndLand", "agent": n, "at": p} for n, p in (("one", "camp"), ("other", "lake_shore"))]
    made = draft(request_, world(), Scripted(tree(*lands, home("one"), agents=BOTH)), options=Options(rounds=0))

    assert made.flight is not None
    assert ("# Added: other comes home, as the request says" in made.yaml) is told
    assert sorted(made.flight.stands.values()) == ["home", "home" if told else "lake_shore"]


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        ("Un dron ligero aterriza en el campamento. Antes de volver a casa espera 1 minuto.", True),
        ("A light drone lands at the camp and waits there for 1 minute before coming home.", True),
        ("LWD: camp, land, back.", True),
        ("A light drone lands at the camp instead of coming home.", False),
    ],
)
def test_a_way_home_is_read_in_more_words(request_: str, told: bool) -> None:
    steps = [{"do": "FlyAndLand", "agent": "one", "at": "camp"}, {"wait": "1 min"}]
    made = draft(request_, world(), Scripted(tree(*steps, agents=BOTH[:1])), options=Options(rounds=0))

    assert ("comes home, as the request says" in made.yaml) is told
