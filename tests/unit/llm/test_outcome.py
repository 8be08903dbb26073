"""What a dry run shows of a draft."""

from functools import cache
from typing import Any

from formiga_bt.llm.envelope import read_answer
from formiga_bt.llm.judging.judge import Judged, judge
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.unit.llm.scripted import fly_to, home, tree


@cache
def world() -> RequestWorld:
    return world_of()


def judged(answer: Any, request: str = "") -> Judged:
    words = read(request, world().site, world().catalogue)
    return judge(read_answer(answer), words, world(), verbs_of(world()), "short")


def test_who_went_where_and_stands_where() -> None:
    steps = [
        fly_to("camp"),
        {"do": "FlyAndLand", "agent": "drone", "at": "offset(lake_shore, north=20 m)"},
        {"ask": "Fine?", "of": ["watchers"]},
    ]
    flight = judged(tree(*steps)).flight

    assert flight is not None
    assert (flight.status, flight.agents) == ("SUCCEEDED", {"drone": ("lwd_3",)})
    assert flight.visited == {"lwd_3": ("base", "camp")}
    assert flight.landed == {"lwd_3": ("180 E -140 N",)}
    assert flight.stands == {"lwd_3": "180 E -140 N"}
    assert (flight.asked, flight.moved_unasked, flight.crashes) == (("watcher_1",), (), 0)
    assert flight.least_battery["lwd_3"] > 80
    assert flight.chart is not None
    assert flight.timeline is not None
    assert [row.action for row in flight.timeline.actions if row.agent == "lwd_3"][:2] == ["TakeOff", "GoTo"]


def test_a_landing_far_away_is_flown_to() -> None:
    found = judged(tree(fly_to("camp"), {"do": "LandIn", "agent": "drone", "at": "lake_shore"}, home()))

    assert not found.errors
    assert found.flight is not None
    assert found.flight.landed == {"lwd_3": ("lake_shore", "home")}


def test_too_few_machines_are_told() -> None:
    agents = [{"name": f"d{n}", "type": "hwd"} for n in range(3)]
    found = judged(tree({"parallel": [fly_to("camp", agent=one["name"]) for one in agents]}, agents=agents))

    assert found.errors
