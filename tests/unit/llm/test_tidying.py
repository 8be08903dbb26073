"""What a small model writes and a program puts as the language has it: `its port` as a place, a ring without its way back."""

import re
from typing import Any

import pytest

from formiga_bt.llm.shaping.tidying import wants_centre
from tests.golden import Wording
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
def test_a_flight_to_its_port_is_the_way_home(ends: list[dict[str, Any]], wording: Wording) -> None:
    found = judged(
        "A light drone flies to the camp at 30 m, to its port, and lands.", fly_to("camp"), *ends, agents=DRONE
    )

    assert [text for text in errors(found) if "30 m" not in text] == []
    assert found.yaml.count("ReturnHome") == 1
    wording(found.mends)
    assert found.flight is not None
    assert list(found.flight.stands.values()) == ["home"]


def test_two_ways_home_that_a_model_wrote_itself_stay() -> None:
    found = judged("A light drone looks at the camp and comes home.", fly_to("camp"), home(), home(), agents=DRONE)

    assert found.yaml.count("ReturnHome") + found.yaml.count("FetchHome") == 2


def test_a_ring_ends_over_its_centre_if_the_request_says_so(wording: Wording) -> None:
    request = "A light drone flies a circle of 20 m about the camp at 30 m, goes back to the centre, and comes home."
    found = judged(request, RING, home(), agents=DRONE)

    assert errors(found) == []
    wording(found.mends)
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


LOOK = "Every 5 minutes a light drone looks at the camp from 40 m and goes home again, 3 times in all."
STARTS = "3 times, 5 min from one start to the next: an LWD over the camp at 40 m and back to its port."


@pytest.mark.parametrize("request_", [LOOK, STARTS])
@pytest.mark.parametrize(
    "steps",
    [
        [{"repeat": "3", "steps": [fly_to("camp"), {"wait": "5 min"}, home()]}],
        [{"repeat": "3", "steps": [{"repeat": "5 min", "steps": [fly_to("camp"), home()]}]}],
        [{"repeat": "3", "steps": [fly_to("camp"), home()]}],
    ],
)
def test_every_so_often_is_a_period_and_no_pause(request_: str, steps: list[dict[str, Any]]) -> None:
    found = judged(request_, *steps, agents=DRONE)

    assert errors(found) == []
    assert "every: ${every}" in found.yaml
    assert "wait:" not in found.yaml
    assert found.yaml.count("repeat:") == 1
    assert any(one.startswith("it begins every 5 min") for one in found.mends)


def test_a_pause_that_is_asked_for_stays() -> None:
    request = "3 times: a light drone looks at the camp from 40 m for 5 minutes and comes home."
    found = judged(request, {"repeat": "3", "steps": [fly_to("camp"), {"wait": "5 min"}, home()]}, agents=DRONE)

    assert errors(found) == []
    assert found.mends == ()


@pytest.mark.parametrize(
    ("request_", "wrong"),
    [
        ("2 laps around the camp at 40 m, radius 20 m, with an LWD; then home.", "2 laps"),
        ("An LWD da tres vueltas alrededor del campamento a 40 m y vuelve a casa, con 20 m de radio.", "tres vueltas"),
        ("One lap around the camp at 40 m, radius 20 m, with an LWD; then home.", ""),
    ],
)
def test_laps_that_are_asked_for_are_flown(request_: str, wrong: str) -> None:
    ring = {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 20 m)", "height": "40 m"}
    said = [one for one in errors(judged(request_, ring, home(), agents=DRONE)) if "times" in one]
    count = "2" if wrong == "2 laps" else "3"

    assert said == ([f'the request says "{wrong}", and the task does nothing {count} times'] if wrong else [])
    assert [one for one in errors(judged(request_, ring, ring, ring, home(), agents=DRONE)) if "times" in one] == []
    assert not any(
        "times" in one for one in errors(judged(request_, {"repeat": count, "steps": [ring]}, home(), agents=DRONE))
    )


def test_a_parallel_of_one_branch_with_two_machines_is_one_branch_each(wording: Wording) -> None:
    agents = [{"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"}]
    request = (
        "A light drone lands at the camp. Meanwhile another one hovers at the lake shore, 40 m, 30 s, and comes home."
    )
    there = {"do": "FlyTo", "agent": "other", "to": "lake_shore", "height": "40 m"}
    landing = {"do": "FlyAndLand", "agent": "one", "at": "camp"}
    steps = [landing, there, {"wait": "30 s"}, home("other")]
    found = judged(request, {"parallel": [{"sequence": steps}]}, agents=agents)

    assert errors(found) == []
    wording(found.mends)
    assert found.yaml.index("FlyTo") < found.yaml.index("wait:") < found.yaml.index("ReturnHome")

    alone = [{**one, "agent": "other"} if "agent" in one else one for one in (landing, there, {"wait": "30 s"}, home())]
    assert judged(request, {"parallel": [{"sequence": alone}]}, agents=agents[1:]).mends == ()


def test_a_question_whose_answer_nobody_looks_at_goes_on_after_a_yes() -> None:
    agents = [*DRONE, {"name": "watcher", "type": "watcher"}]
    request = "Ask a watcher, then a light drone looks at the camp from 40 m and comes home."
    ask = {"ask": "May it fly?", "of": ["watcher"], "save_as": "reply"}
    found = judged(request, ask, {**ask, "save_as": "again"}, fly_to("camp"), home(), agents=agents)

    assert errors(found) == []
    assert found.mends == ("it goes on after a yes only, for no step looks at the answer",) * 2
    assert found.yaml.count("expect: result.answer == 'yes'") == 2

    which = {**ask, "options": ["east", "west"]}
    assert judged(request, which, fly_to("camp"), home(), agents=agents).mends == ()
    told = {"notify": "the reply was ${reply.answer}"}
    assert judged(request, ask, fly_to("camp"), home(), told, agents=agents).mends == ()

    looked_at = {"if": "reply.answer == 'yes'", "then": [fly_to("camp"), home()]}
    assert judged(request, ask, looked_at, agents=agents).mends == ()


WATCHED = [*DRONE, {"name": "watcher", "type": "watcher"}]


@pytest.mark.parametrize("kept", [{}, {"save_as": "reply"}])
def test_whatever_is_answered_it_goes_on(kept: dict[str, str], wording: Wording) -> None:
    request = (
        "A light drone looks at the camp, asks the watcher whether it looks fine, and comes home whatever she says."
    )
    ask = {"ask": "Does it look fine?", "of": ["watcher"], **kept}
    found = judged(request, fly_to("camp"), ask, home(), agents=WATCHED)

    assert errors(found) == []
    wording(found.mends)
    assert "expect" not in found.yaml
    plain = judged(request.replace(" whatever she says", " then"), fly_to("camp"), ask, home(), agents=WATCHED)
    assert "expect: result.answer == 'yes'" in plain.yaml


@pytest.mark.parametrize(
    ("options", "expected"), [(["none", "few", "many"], ""), (["go", "stop"], "go"), (["wait", "go on"], "wait")]
)
def test_an_answer_that_is_no_yes_decides_nothing(options: list[str], expected: str) -> None:
    request = "A light drone looks at the camp, asks the watcher how many there are, and comes home."
    ask = {"ask": "How many?", "of": ["watcher"], "options": options}
    found = judged(request, fly_to("camp"), ask, home(), agents=WATCHED)

    assert errors(found) == []
    assert re.findall(r"expect: result.answer == '(.*)'", found.yaml) == ([expected] if expected else [])
