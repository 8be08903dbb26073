"""What a request says for certain is compared with what a task does; what is not certain is not said."""

from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from msgspec import structs

from formiga_bt.base.geo import Place
from formiga_bt.llm.envelope import read_answer
from formiga_bt.llm.judging.judge import judge
from formiga_bt.llm.judging.landings import landings
from formiga_bt.llm.records import RehearsedFlight
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.points import RequestPoint, with_points
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home, tree

LAND = {"do": "FlyAndLand", "agent": "drone", "at": "camp"}
THREE = (
    {"parallel": [
        {"sequence": [fly_to("camp", agent="a"), home("a")]},
        {"sequence": [fly_to("lake_shore", agent="b"), home("b")]},
        {"sequence": [fly_to("centroid(bog)", agent="c"), home("c")]},
    ]},
)  # fmt: skip


def along(way: str) -> dict[str, str]:
    return {"do": "FlyAlong", "agent": "drone", "way": way, "height": "20 m"}


HWD = ({"name": "drone", "type": "hwd"},)


@cache
def world() -> RequestWorld:
    return world_of()


def found(request: str, answer: Any) -> list[tuple[str, str]]:
    words = read(request, world().site, world().catalogue)
    judged = judge(read_answer(answer), words, world(), verbs_of(world()), "short", compared=words)
    return [(one.code, one.text) for one in judged.shortfalls]


@pytest.mark.parametrize(
    ("request_", "answer", "said"),
    [
        (
            "fly to the lake shore at 40 m",
            tree(fly_to("camp"), home()),
            ("place_not_used", 'the request names "lake shore", and the task never goes to lake_shore'),
        ),
        (
            "a light drone flies to the camp and comes home",
            tree(fly_to("camp"), fly_to("north_field"), home()),
            ("place_unasked", "the task goes to north_field, which the request does not name"),
        ),
        (
            "fly to the camp, 25 metres high",
            tree(fly_to("camp"), home()),
            ("amount_not_used", 'the request says "25 metres", and no value of the task is 25 metres'),
        ),
        (
            "lwd_1 flies to the camp",
            tree(fly_to("camp"), home(), agents=[{"name": "drone", "type": "lwd", "id": "lwd_2"}]),
            ("agent_not_used", 'the request names "lwd_1", and lwd_1 takes no part in the task'),
        ),
        (
            "two light drones fly to the camp",
            tree(fly_to("camp"), home()),
            ("wrong_count", "the request speaks of 2 light drone, the task uses 1"),
        ),
        (
            "a heavy drone flies to the camp",
            tree(fly_to("camp"), home()),
            ("type_not_used", "the request asks for a heavy drone (hwd), the task uses none"),
        ),
        (
            "fly to the camp, then the watcher has to confirm",
            tree(fly_to("camp"), home()),
            ("nobody_asked", "the request wants somebody to be asked or to confirm, and the task asks nobody"),
        ),
        (
            "a drone flies to the camp and returns home",
            tree(fly_to("camp"), {"ask": "All good?", "of": ["watchers"]}, home()),
            ("asked_unasked", "the task puts a question to people, and the request does not want that"),
        ),
        (
            "hover over the camp in a circle with a radius of 40 m",
            tree(fly_to("camp"), home()),
            ("amount_misused", "the request wants a radius of 40 m, and the task uses it as height"),
        ),
        (
            "hover at the camp, 20 m apart",
            tree(fly_to("camp", "20 m"), home()),
            ("amount_misused", 'the request says "20 m apart", and the task uses 20 m as a height only'),
        ),
        (
            "fly to the camp and ask the watcher whether all is well",
            tree(fly_to("camp"), {"ask": "All well?", "of": ["picker"]}, home()),
            ("wrong_person", "the request wants a watcher to be asked, and the task asks picker"),
        ),
        (
            "land at the camp, then come back",
            tree(fly_to("camp"), home()),
            ("not_landed_there", 'the request wants a landing at "camp", and nobody lands at camp'),
        ),
        (
            "fly to the camp and come back home",
            tree(LAND),
            ("not_home", "the request wants a machine to come home, and none stands at its port at the end"),
        ),
        (
            "fly to the camp, then on to its own port, and land",
            tree(LAND),
            ("not_home", "the request wants a machine to come home, and none stands at its port at the end"),
        ),
        (
            "put a drone over the camp and two more around it, then all come home",
            tree(fly_to("camp"), home()),
            ("wrong_count", "the request speaks of 3 machines, the task uses 1"),
        ),
        (
            "un dron mira el campo del norte y vuelve a casa",
            tree(fly_to("camp"), home()),
            ("place_not_used", 'the request names "campo del norte", and the task never goes to north_field'),
        ),
        (
            "a drone flies a triangle over the camp; the two sides at its right angle have 20 metres each",
            tree(along("triangle(camp, 90 m)"), home()),
            ("size_assumed", 'the request says "20 metres" of the triangle, and the task assumes its leg: 90 m'),
        ),
        (
            "a drone goes to the camp and turns once around that place with a distance of 15 metres",
            tree(along("circle(offset(camp, east=15 m), 30 m)"), home()),
            ("size_assumed", 'the request says "15 metres" of the circle, and the task assumes its radius: 30 m'),
        ),
        (
            "un dron rodea el campamento a una distancia de 20 m",
            tree(along("circle(camp, 30 m)"), home()),
            ("size_assumed", 'the request says "20 m" of the circle, and the task assumes its radius: 30 m'),
        ),
        (
            "a drone flies in a zigzag from the camp to the lake shore, 20 m to each side",
            tree(along("zigzag(camp, lake_shore, 12 m, 6)"), home()),
            ("size_assumed", 'the request says "20 m" of the zigzag, and the task assumes its amplitude: 12 m'),
        ),
    ],
)
def test_a_shortfall_is_told(request_: str, answer: Any, said: tuple[str, str]) -> None:
    assert said in found(request_, answer)


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("fly to the camp, then to every other field", tree(fly_to("camp"), fly_to("north_field"), home())),
        ("fly to the camp, then some way north", tree(fly_to("camp"), fly_to("north_field"), home())),
        ("fly to the camp, in a corner of 90 degrees", tree(fly_to("camp"), home())),
        ("a drone flies to the camp and three more times round it", tree(fly_to("camp"), home())),
        ("check the lake shore with a drone", tree(fly_to("lake_shore"), home())),
        ("un dron mira la orilla del lago y vuelve", tree(fly_to("lake_shore"), home())),
        ("a drone leaves its port, lands at the camp and stays there", tree(LAND)),
        ("fly to the camp, but not to the lake shore", tree(fly_to("camp"), home())),
        ("a heavy drone flies to the camp at 40 metres and comes home", tree(fly_to("camp"), home(), agents=HWD)),
        ("a drone lands at the camp and stays there", tree(LAND)),
        ("look at camp from forty meters", tree(fly_to("camp"), home())),
        ("Kevyt drooni lentää paikkaan camp 40 metrin korkeudella ja palaa kotiin", tree(fly_to("camp"), home())),
        ("the drone circles the base at a distance of 10 m", tree(
            {"do": "FlyAlong", "agent": "drone", "way": "circle(base, 10 m)", "height": "20 m"}, home())),
        ("land at the camp and do not come home", tree(LAND)),
        ("a drone lands at the camp. There is no need to fly back home", tree(LAND)),
        ("a drone lands at the camp while the others stay at their ports", tree(LAND)),
        ('a drone lands at the camp and tells everybody "I fly home now"', tree({"notify": "I fly home now"}, LAND)),
        ("look at the lake shore, then fly from the camp to the lake shore",
            tree(fly_to("lake_shore"), fly_to("camp"), fly_to("lake_shore"), home())),
        ("un dron aterriza en el campamento y no vuelve a casa", tree(LAND)),
        ("when the watcher agrees, fly to the camp", tree({"ask": "Go?", "of": ["watcher"]}, fly_to("camp"), home())),
        ("fly to the camp, twenty-five metres high", tree(fly_to("camp", "25 m"), home())),
        ("Two drones look at the camp and the lake shore; one heavy drone looks at the bog", tree(
            *THREE, agents=({"name": "a", "type": "lwd"}, {"name": "b", "type": "lwd"}, {"name": "c", "type": "hwd"}))),
        ("at least two drones look at the camp, the lake shore and the bog", tree(
            *THREE, agents=({"name": "a", "type": "lwd"}, {"name": "b", "type": "lwd"}, {"name": "c", "type": "hwd"}))),
        ("a drone that comes 20 m from the camp goes to the lake shore first",
            tree(fly_to("lake_shore", "20 m"), fly_to("camp", "20 m"), home())),
        ("a drone flies from the camp to the lake shore, having gone to the north field first",
            tree(fly_to("north_field"), fly_to("camp"), fly_to("lake_shore"), home())),
        ("a drone circles the camp at 20 m", tree(along("circle(camp, 30 m)"), home())),
        ("at 20 metres a drone circles the camp", tree(along("circle(camp, 30 m)"), home())),
        ("a drone circles the camp", tree(along("circle(camp, 30 m)"), home())),
        ("a drone circles a spot at a distance of 15 m from the camp",
            tree(along("circle(offset(camp, east=15 m), 30 m)"), home())),
        ("land a drone beside the camp", tree({**LAND, "at": "offset(camp, east=20 m)"})),
        ("a drone flies to the camp, looks round and lands", tree({**LAND, "at": "offset(camp, north=-8 m)"})),
        ("a drone flies a triangle at the camp, each side 20 m high", tree(along("triangle(camp, 90 m)"), home())),
    ],
)  # fmt: skip
def test_what_is_right_is_left_alone(request_: str, answer: Any) -> None:
    assert found(request_, answer) == []


@pytest.mark.parametrize(
    ("request_", "is_wanted"),
    [
        ("would you drop in at the camp with two drones and park them side by side?", True),
        ("a light drone, destination the camp, touchdown within five minutes", True),
        ("a drone flies to the camp, takes a long look, then lands", True),
        ("set a light drone gently down at the camp", True),
        ("un dron vuela hasta el camp y, al cabo de un rato, aterriza", True),
        ("a drone looks at the camp and lands", False),
        ("a drone flies to the landing site at the camp", False),
        ("a drone flies to the camp and comes down to 30 m there", False),
        ("a drone flies to the camp. Should the wind be strong, it goes to the camp, and later lands", False),
        ("a drone flies to the camp without landing", False),
        ("a drone flies to the camp, comes back and lands", False),
        ("one drone flies to the camp, and the other lands", False),
        ("put down a crate at the camp", False),
        ("take the first-aid kit to the camp by heavy drone", True),
        ("a heavy drone brings two boxes of tools to the camp", True),
        ("lleva un paquete al camp con un dron pesado", True),
        ("take a light drone to the camp", False),
        ("take a picture of the boxes next to the camp", False),
        ("lower the kit to the camp from a heavy drone", False),
        ("bring a kit to the camp. It hovers there and lowers it on a rope", False),
    ],
)
def test_a_landing_that_a_sentence_wants_at_its_one_place_is_missed_where_it_is_certain(
    request_: str, is_wanted: bool
) -> None:
    flight = RehearsedFlight(task="Mission", status="SUCCEEDED", landed={"lwd_1": ("home",)})
    missed = landings(read(request_, world().site, world().catalogue), flight)
    assert [(one.code, one.about) for one in missed] == [("not_landed_there", "camp")] * is_wanted


def test_a_machine_that_a_spanish_request_names_in_words_that_are_not_known_is_not_called_unasked() -> None:
    types = dict(world().catalogue.types)
    types["scout"] = structs.replace(types["lwd"], name="scout", label="scout drone")
    agents = {
        id: structs.replace(one, type="scout") if one.type == "lwd" else one for id, one in world().site.agents.items()
    }
    of_scouts = replace(
        world(),
        catalogue=structs.replace(world().catalogue, types=types),
        site=structs.replace(world().site, agents=agents),
    )

    def said(request: str) -> set[str]:
        agents = [{"name": "a", "type": "scout"}, {"name": "b", "type": "hwd"}]
        steps = [fly_to("camp", agent="a"), home("a"), fly_to("lake_shore", agent="b"), home("b")]
        words = read(request, of_scouts.site, of_scouts.catalogue)
        verbs = verbs_of(of_scouts)
        judged = judge(read_answer(tree(*steps, agents=agents)), words, of_scouts, verbs, "short", compared=words)
        return {one.code for one in judged.shortfalls}

    assert "type_unasked" not in said("Un dron explorador mira el campamento y un dron pesado la orilla del lago")
    assert "type_unasked" in said("A heavy drone looks at the camp and the lake shore")


def test_a_place_on_the_way_to_the_one_before_it_is_passed_and_not_gone_to_too_early() -> None:
    places = {"camp": Place(0.0, 60.0), "barn": Place(0.0, 120.0), "well": Place(0.0, 90.0), "mill": Place(60.0, 120.0)}
    here = replace(world(), site=structs.replace(world().site, places=places))

    def said(request: str, *stops: str) -> list[str]:
        words = read(request, here.site, here.catalogue)
        answer = read_answer(tree(*map(fly_to, stops), home()))
        judged = judge(answer, words, here, verbs_of(here), "short", compared=words)
        return [one.code for one in judged.shortfalls]

    request = "Look at the camp, the barn, then the {}, and come home"
    assert said(request.format("well"), "camp", "barn", "well") == []
    assert said(request.format("mill"), "camp", "mill", "barn") == ["wrong_order"]


def test_a_task_that_fails_in_the_dry_run_is_told_with_its_reason(wording: Wording) -> None:
    answer = tree(
        fly_to("camp"), {"ask": "Go?", "of": ["watcher"], "options": ["later", "now"], "go_on": "now"}, home()
    )

    code, text = found("ask the watcher at the camp", answer)[0]
    assert code == "not_succeeded"
    wording(text)  # fmt: skip


def test_a_place_whose_name_nobody_knows_in_spanish_may_be_meant_by_any_words() -> None:
    wide = with_points(world(), {"crossing": RequestPoint(66.5005, 25.699, "crossing")})
    answer = tree(fly_to("camp"), fly_to("crossing"), home())

    def unasked(request: str) -> list[str]:
        words = read(request, wide.site, wide.catalogue)
        judged = judge(read_answer(answer), words, wide, verbs_of(wide), "short", compared=words)
        return [one.about for one in judged.shortfalls if one.code == "place_unasked"]

    assert unasked("Un dron ligero va al campamento, luego al cruce y vuelve a casa") == []
    assert unasked("A light drone goes to the camp, then to the junction and comes home") == ["crossing"]


def test_what_a_message_says_is_no_wish_for_a_question() -> None:
    answer = tree(fly_to("camp"), {"notify": "Permission refused"}, home())

    said = found('A light drone flies to the camp, sends "Permission refused" and comes home', answer)
    assert "nobody_asked" not in [code for code, _ in said]
