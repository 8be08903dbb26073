"""What is said in several ways is shown to a model in one; the request stays as it was. Short lists of ends are read."""

import pytest

from formiga_bt.llm.draft import draft
from formiga_bt.llm.shaping.tidying import wants_centre
from formiga_bt.llm.words.endings import ends_home, stations
from formiga_bt.llm.words.plain_words import plainly
from formiga_bt.llm.world import world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree
from tests.unit.llm.test_teams import errors, judged

WORLD = world_of()
DRONE = [{"name": "drone", "type": "lwd"}]


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("It weaves its way from the camp to the bog.", "It flies in a zigzag from the camp to the bog."),
        ("Slalom to the camp, 8 m on both sides.", "Fly in a zigzag to the camp, 8 m to each side."),
        ("As the teeth of a saw, in 7 segments, turns ten metres off the line.",
         "In a zigzag, in 7 legs, ten metres to each side."),
        ("A dron serpentea hasta el lago, 4 m a izquierda y derecha de la recta.",
         "A dron vuela en zigzag hasta el lago, 4 m a cada lado."),
        ("Weaving in 5 legs of a zigzag, 6 m on either side.", "Weaving in 5 legs of a zigzag, 6 m to each side."),
        ("Two stretches, 6 m left and right.", "Two stretches, 6 m left and right."),
        ("It settles at the camp.", "It lands at the camp."),
        ("It settles the matter; the box is set down there.", "It settles the matter; the box is set down there."),
        ("Se posa en el campamento.", "Aterriza en el campamento."),
        ("Make a circular flight round the camp.", "Make a circle round the camp."),
        ("It flies a full loop of 12 m around the camp.", "It flies a circle of 12 m around the camp."),
        ("A round trip about the farms: camp, bog.", "A round trip about the farms: camp, bog."),
        ("One three-sixty round the camp, 15 m out.", "One circle round the camp, 15 m out."),
        ("Fly a 360 about the camp.", "Fly a circle about the camp."),
        ("Fly 360 m around the hill.", "Fly 360 m around the hill."),
        ("Loiter above the camp and come back.", "Hover above the camp and come home."),
        ("Combs through the whole bog, then returns.", "Explores the bog, then returns home."),
        ("Search the camp.", "Search the camp."),
        ("Assemble two heavy drones on the ground at the camp, with 12 m between neighbours.",
         "Park two heavy drones on the ground at the camp, 12 m apart."),
        ("Collect the boxes on the ground.", "Collect the boxes on the ground."),
        ("It drops by the camp, makes for the lake and heads back.", "It flies to the camp, flies to the lake and comes home."),
        ('Tell "weave and return." and settle there.', 'Tell "weave and return." and land there.'),
        ("Fly to Loop about and touch down.", "Fly to Loop about and land."),
        ("It circles it. Once done: middle, its port, touchdown.",
         "It circles it. Once done it goes back to the centre and comes home."),
        ("Al terminar: centro, puerto.", "Al terminar vuelve al centro y vuelve a casa."),
        ("Finally: the lake, home.", "Finally: the lake, home."),
    ],
)  # fmt: skip
def test_a_model_is_shown_plain_words(said: str, plain: str) -> None:
    assert plainly(said, ["bog"], ["camp", "lake", "Loop about"]) == plain


def test_the_request_stays_as_it_was_in_the_file_and_in_the_records(wording: Wording) -> None:
    request = "A light drone loiters over the camp at 40 m for 20 s and comes back."
    chat = Scripted(tree(fly_to("camp"), {"wait": "20 s"}, home()))
    made = draft(request, WORLD, chat)

    wording(chat.asked[0][-1].text)
    assert (made.kind, made.request) == ("task", request)
    assert f"#   {request}" in made.yaml


@pytest.mark.parametrize("said", ["weaves", "slaloms", "flies like a saw blade", "vuela en eslalon", "serpentea"])
def test_a_figure_in_other_words_is_missed_in_a_task_that_flies_none(said: str, wording: Wording) -> None:
    request = f"A light drone {said} from the camp to the lake shore and lands there."
    land = {"do": "FlyAndLand", "agent": "drone", "at": "lake_shore"}

    wording(errors(judged(request, fly_to("camp"), land, agents=DRONE)))


@pytest.mark.parametrize(
    ("request_", "listed", "centre", "to_port"),
    [
        ("It circles the camp. When done: centre, port, land.", ("centre", "home", "land"), True, True),
        ("Da la vuelta; luego: al centro, a casa.", ("centre", "home"), True, True),
        ("After that - the middle, then the lake.", ("centre", "the lake"), True, False),
        ("Then: home, camp.", ("home", "camp"), False, False),
        ("Stations: centre of the field, port 3.", (), False, False),
    ],
)
def test_a_list_of_stations_at_the_end_is_read(
    request_: str, listed: tuple[str, ...], centre: bool, to_port: bool
) -> None:
    assert (stations(request_), wants_centre(request_), ends_home(request_)) == (listed, centre, to_port)


def test_who_does_not_come_home_though_such_a_list_says_so_is_told(wording: Wording) -> None:
    request = "A light drone circles the camp at 20 m radius. When over: middle, port."
    ring = {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 20 m)", "height": "20 m"}
    land = {"do": "FlyAndLand", "agent": "drone", "at": "camp"}
    found = judged(request, ring, land, agents=DRONE)

    wording(errors(found))
    assert errors(judged(request, ring, home(), agents=DRONE)) == []


def test_a_landing_in_other_words_is_missed(wording: Wording) -> None:
    request = "A light drone touches down at the camp and comes home."
    found = judged(request, fly_to("camp"), home(), agents=DRONE)

    wording(errors(found))
