"""A noun means an agent, and a number how many, only where that is certain."""

from dataclasses import replace
from functools import cache

import pytest
from msgspec import structs

from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.words.wording import read, roles_of, types_said
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree


@cache
def world() -> RequestWorld:
    """Return the demo world, with three more types of machines, of which it has none."""
    shipped = world_of()
    types = dict(shipped.catalogue.types)
    for name, label in (("eye", "camera drone"), ("scout", "scout drone"), ("mule", "mule")):
        types[name] = structs.replace(types["lwd"], name=name, label=label)
    site = structs.replace(shipped.site, places={**shipped.site.places, "mule_path": shipped.site.places["camp"]})
    return replace(shipped, catalogue=structs.replace(shipped.catalogue, types=types), site=site)


def types_of(request: str) -> set[str]:
    return types_said(read(request, world().site, world().catalogue), world().catalogue)


@pytest.mark.parametrize(
    "request_",
    [
        "A drone keeps an eye on the camp and comes home",
        "A drone keeps a close eye on the camp and comes home",
        "Look at the camp with an eye to the trees",
        "A bird's eye view of the camp",
        "Hover at eye level",
        "A drone flies to the camp and scouts the shore",
        "A drone shall scout all of the bog",
        "Scout the camp",
        "Fly to the camp to scout",
        "Fly over the mule path at 40 m",
        "Que un dron eche un ojo al campamento",
    ],
)
def test_a_word_in_a_saying_a_doing_or_a_place_is_no_machine(request_: str) -> None:
    assert types_of(request_) == set()


@pytest.mark.parametrize(
    ("request_", "types"),
    [
        ("An eye keeps an eye on the camp", {"eye"}),
        ("Two eyes hover over the camp", {"eye"}),
        ("A scout flies to the camp", {"scout"}),
        ("Send the scout to scout the camp", {"scout"}),
        ("Scout flies over camp", {"scout"}),
        ("The mule goes along the mule path", {"mule"}),
        ("The scout drone and two mules land", {"scout", "mule"}),
        ("LWD to the camp, HWD to the shore", {"lwd", "hwd"}),
        ("Can scout look at the camp?", {"scout"}),
        ("Can scout drone look at camp?", {"scout"}),
        ("Ask watcher whether all is well", {"watcher"}),
    ],
)
def test_a_noun_that_means_an_agent_is_read(request_: str, types: set[str]) -> None:
    assert types_of(request_) == types


@pytest.mark.parametrize(
    ("request_", "counts"),
    [
        ("One of 2 light drones hovers over each of the camp and the lake shore", {"lwd": 2}),
        ("On a yes two light drones land, on no one heavy drone lands", {"lwd": 2, "hwd": 1}),
        ("Ask the watcher, and only if so two light drones land", {"lwd": 2}),
        ("Would you have one heavy drone watch the camp?", {"hwd": 1}),
        ("No envíes dos drones ligeros al campamento", {}),
        ("In teams of 2 light drones", {}),
        ("One of the 2 light drones lands", {}),
        ("One of the two LWDs lands at the camp, the other of the two circles it", {"lwd": 2}),
        ("Three of the light drones hover over the camp, 5 m from each other", {"lwd": 3}),
        ("A couple of light drones hover, a couple of metres apart", {"lwd": 2}),
        ("Three-ship, LWD: over the camp", {"lwd": 3}),
        ("A two-ship of light drones hovers", {"lwd": 2}),
        ("LWDs, two. Camp, 30 m. Home.", {"lwd": 2}),
        ("Use light drones, two. Look at the camp.", {"lwd": 2}),
        ("2x LWD to the camp", {"lwd": 2}),
        ("A lightweight drone goes to the camp, one more lightweight drone to the shore", {"lwd": 2}),
        ("Un par de drones ligeros va al campamento", {"lwd": 2}),
        ("Tres de los drones ligeros van al campamento", {"lwd": 3}),
        ("Un dron ligero va al campamento y un dron ligero más a la orilla", {"lwd": 2}),
        ("Two of the light drones land, the third hovers", {}),
        ("Each pair of light drones lands", {}),
        ("Up to a couple of light drones land", {}),
        ("Do not send a couple of light drones", {}),
        ("Two light drones go to the camp, another two light drones to the shore", {}),
        ("One light drone goes to the camp, one light drone to the shore", {}),
        ("One light drone lands while the other circles it", {}),
        ("A light drone lands, one more light drone lands, and a third one hovers", {}),
        ("The light drones, two metres apart, land", {}),
        ("The light drones, 2.5 m apart, land", {}),
        ("Points for light drones: 2, 3, 5", {}),
        ("A light drone circles the camp a couple of times", {}),
    ],
)
def test_how_many_take_part(request_: str, counts: dict[str, int]) -> None:
    assert read(request_, world().site, world().catalogue).counts == counts


def test_a_saying_asks_for_no_machine_and_a_right_task_is_not_refused() -> None:
    request = "A light drone keeps an eye on the camp from 40 m for 30 seconds and comes home."
    found = draft(request, world(), Scripted(tree(fly_to("camp"), {"wait": "30 s"}, home())), options=Options(rounds=0))

    assert (found.kind, found.say) == ("task", "")
    words = read(request.replace("A light", "One light"), world().site, world().catalogue)
    assert roles_of(words, world().catalogue) == (("lwd", 1),)


@pytest.mark.parametrize(
    "request_",
    [
        "Send 7 drones to the camp",
        "Have seven drones look at the camp",
        "Manda siete drones al campamento",
        "Siete drones ligeros sobrevuelan el campamento",
        "Seven light drones hover over the camp",
        "A team of twelve drones lands at the camp",
        "Twenty-five drones fly to the camp",
        "Thirty five drones fly to the camp",
        "If the watcher agrees, 6 UAVs look at the camp",
        "Two mules fly to the camp",
        "One hundred drones fly to the camp",
    ],
)
def test_more_machines_than_there_are_is_told_without_a_model(request_: str, wording: Wording) -> None:
    chat = Scripted(tree(fly_to("camp"), home()))
    found = draft(request_, world(), chat)

    assert (found.kind, chat.asked) == ("impossible", [])
    wording(found.say)


@pytest.mark.parametrize(
    "request_",
    [
        "A drone flies round the camp 7 times",
        "Fly 7 m from the camp with a drone",
        "Watch the camp for 7 min, drones",
        "A drone keeps 7 drone lengths from the camp",
        "At 10:30 drones fly to the camp",
        "Every day at 7 drones look at the camp",
        "Up to 7 drones look at the camp",
        "No more than seven drones look at the camp",
        "Do not send 7 drones to the camp, but one",
        "One of the 7 drones goes to the camp",
        "Send 2 or 7 drones to the camp",
        "Send 5-7 drones to the camp",
        "From row 12 drones fly to the camp",
        "We have 9 drones; send one to the camp",
        'Tell everybody "7 drones are coming", and send one to the camp',
        "Como máximo siete drones van al campamento",
    ],
)
def test_a_number_of_something_else_or_an_uncertain_one_is_left_to_the_model(request_: str) -> None:
    chat = Scripted(tree(fly_to("camp"), home()))
    found = draft(request_, world(), chat, options=Options(rounds=0))

    assert len(chat.asked) == 1
    assert found.kind != "impossible"


def test_a_place_whose_name_ends_in_a_number_counts_no_drones() -> None:
    places = {**world().site.places, "checkpoint_2": world().site.places["camp"]}
    words = read("At checkpoint 2 drones turn back", structs.replace(world().site, places=places), world().catalogue)

    assert (words.places, words.counts) == ({"checkpoint_2": "checkpoint 2"}, {})


def test_machines_of_a_type_are_not_counted_as_any_machines_too() -> None:
    words = read("Dos drones ligeros y uno pesado van al campamento", world().site, world().catalogue)

    assert words.counts == {"lwd": 2}


@pytest.mark.parametrize(
    ("request_", "metres"),
    [
        ("twenty-five metres high", [25.0]),
        ("twenty five metres high", [25.0]),
        ("cuarenta y cinco metros", [45.0]),
        ("two hundred metres away", [200.0]),
        ("eighty metres", [80.0]),
        ("one hundred and twenty metres", []),
        ("ciento veinte metros", []),
        ("two drones, twenty metres apart", [20.0]),
        ("a fifteen-metre circle", [15.0]),
        ("the drone flies 1,200 m to the north", [1200.0]),
        ("the drone flies 1.250 km to the north", [1250.0]),
        ("el dron vuela 1.200 m hacia el norte y vuelve", [1200.0]),
        ("el dron vuela a 12,5 m del camino", [12.5]),
    ],
)
def test_a_number_is_read_whole_or_not_at_all(request_: str, metres: list[float]) -> None:
    assert [one.si for one in read(request_, world().site, world().catalogue).amounts] == metres
