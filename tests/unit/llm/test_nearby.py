"""A tree that is a few edits away from what the request says is edited by a program, judged as any other, and told."""

from functools import cache
from typing import Any

import pytest

from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.edits.nearby import DEEP, MOST, nearest
from formiga_bt.llm.edits.steps import EditCase
from formiga_bt.llm.edits.table import EDITS
from formiga_bt.llm.envelope import ModelAnswer, read_answer
from formiga_bt.llm.judging.judge import Judged
from formiga_bt.llm.records import Draft, Shortfall
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.legs import legs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

Steps = list[dict[str, Any]]
PAIR = ({"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"})
BOTH_TYPES = ({"name": "small", "type": "lwd"}, {"name": "big", "type": "hwd"})
WATCHER = {"name": "watcher", "type": "watcher"}
DRONE = ({"name": "drone", "type": "lwd"},)
ASK = {"ask": "Is it loaded?", "of": ["watcher"]}
RING = {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 8 m)", "height": "20 m"}
TO_CAMP = {"parallel": [fly_to("camp", "30 m", "one"), fly_to("offset(camp, east=6 m)", "30 m", "other")]}
FERRY = (
    "Two light drones fly to the camp and land 6 m apart. After the watcher has confirmed, the first one returns to its "
    "port, and the second one goes on to the lake shore and lands."
)


@cache
def world() -> RequestWorld:
    return world_of()


def lands(place: str, agent: str) -> dict[str, str]:
    return {"do": "FlyAndLand", "agent": agent, "at": place}


def made(request: str, *answers: Any, rounds: int = 0) -> Draft:
    return draft(request, world(), Scripted(*answers), options=Options(rounds=rounds))


def edits(request: str, code: str, *steps: Any, agents: Any = DRONE, about: str = "", wanted: int = 0) -> list[Steps]:
    """Return the steps of each tree that the edits for something wrong propose."""
    words = read(request, world().site, world().catalogue)
    of = tree(*steps, agents=agents)["answer"]["tree"]
    case = EditCase(of, words, world(), verbs_of(world()), Shortfall(code, "", about=about, wanted=wanted))
    return [new["steps"] for edit in EDITS[code] for new, _ in edit(case)]


@pytest.mark.parametrize(
    "after",
    [
        [home("one")],
        [home("one"), home("other")],
        [{"parallel": [home("one"), home("other")]}],
    ],
)
def test_who_only_flew_there_lands_and_who_goes_on_goes_on(after: Steps, wording: Wording) -> None:
    found = made(FERRY, tree(TO_CAMP, ASK, *after, agents=[*PAIR, WATCHER]))

    assert found.kind == "task", found.say
    assert found.flight is not None
    wording(sorted(found.flight.landed.values()))
    assert "# Added: one and other land at camp, as the request says\n" in found.yaml
    assert "# Added: other goes on to lake_shore and lands there, as the request says\n" in found.yaml
    assert found.rounds[0].reply.data["answer"]["tree"]["steps"][0] == TO_CAMP
    assert "FlyAndLand" in found.rounds[0].answer


def test_what_a_change_begins_with_is_the_edited_answer() -> None:
    answer = tree(TO_CAMP, ASK, home("one"), agents=[*PAIR, WATCHER])
    before, chat = made(FERRY, answer), Scripted(answer)
    draft("Wait for 20 seconds there.", world(), chat, options=Options(rounds=0), previous=before)

    assert before.rounds[0].answer in [one.text for one in chat.asked[0]]


@pytest.mark.parametrize(
    ("request_", "about", "steps", "agents", "wanted"),
    [
        (  # the height was asked for: the landing comes after it
            "A light drone looks at the camp from 30 m, then lands at the camp.",
            "camp",
            [fly_to("camp", "30 m")],
            DRONE,
            [fly_to("camp", "30 m"), lands("camp", "drone")],
        ),
        (  # so does a stay
            "A light drone hovers over the camp for 20 s and then lands at the camp.",
            "camp",
            [fly_to("camp"), {"wait": "20 s"}, home()],
            DRONE,
            [fly_to("camp"), {"wait": "20 s"}, lands("camp", "drone"), home()],
        ),
        (  # only the one that is meant
            "A light drone and a heavy drone fly to the camp, and the heavy drone lands at the camp.",
            "camp",
            [fly_to("camp", agent="small"), fly_to("camp", agent="big")],
            BOTH_TYPES,
            [fly_to("camp", agent="small"), lands("camp", "big")],
        ),
    ],
)
def test_the_machine_that_is_meant_lands_there(
    request_: str, about: str, steps: Steps, agents: Any, wanted: Steps
) -> None:
    assert edits(request_, "not_landed_there", *steps, agents=agents, about=about) == [wanted]


@pytest.mark.parametrize(
    ("request_", "steps"),
    [
        (
            "A light drone flies over the camp and to the lake shore, then lands at the camp.",
            [fly_to("camp"), fly_to("lake_shore"), home()],
        ),
        ("Two drones fly to the camp. One lands at the camp.", [TO_CAMP]),
        ("Three drones fly to the camp and land.", [TO_CAMP]),
    ],
)
def test_which_time_and_which_machine_lands_is_not_guessed(request_: str, steps: Steps) -> None:
    agents = DRONE if len(steps) > 1 else PAIR

    assert edits(request_, "not_landed_there", *steps, agents=agents, about="camp") == []


def test_who_goes_on_after_an_answer_does_not_go_before_it() -> None:
    steps = [TO_CAMP, home("other"), ASK, home("one")]

    assert edits(FERRY, "place_not_used", *steps, agents=[*PAIR, WATCHER], about="lake_shore") == []


@pytest.mark.parametrize(
    ("request_", "steps", "agents", "wanted"),
    [
        (
            "El dron pesado regresa a su puerto, el dron ligero continúa hasta la orilla del lago y aterriza.",
            [fly_to("camp", agent="small"), fly_to("camp", agent="big"), home("big")],
            BOTH_TYPES,
            [fly_to("camp", agent="small"), fly_to("camp", agent="big"), home("big"), lands("lake_shore", "small")],
        ),
        (
            "A light drone flies to the camp, then on to the lake shore at 25 m, and comes home.",
            [fly_to("camp"), home()],
            DRONE,
            [fly_to("camp"), fly_to("lake_shore", "25 m"), home()],
        ),
        (
            "Two light drones land at the camp. One flies on to the lake shore and lands, then both come home.",
            [lands("camp", "one"), lands("camp", "other"), home("one")],
            PAIR,
            [lands("camp", "one"), lands("camp", "other"), home("one"), lands("lake_shore", "other"), home("other")],
        ),
    ],
)
def test_the_machine_that_goes_on_goes_there_and_home_if_it_is_to(
    request_: str, steps: Steps, agents: Any, wanted: Steps
) -> None:
    assert edits(request_, "place_not_used", *steps, agents=agents, about="lake_shore") == [wanted]


@pytest.mark.parametrize(
    "request_",
    [
        "A light and a heavy drone fly to the camp. The heavy one returns home, the light one goes on to the lake shore.",
        "Two drones fly to the camp. If the watcher agrees, one goes on to the lake shore.",
        "Two drones fly to the camp. One comes home, none goes on to the lake shore, nor flies to the lake shore.",
        "Two drones fly to the camp. The other flies to the lake shore, looks for a boat and comes home.",
        "Both fly to the camp, then both fly on to the lake shore.",
        "One flies to the lake shore and on to the camp.",
    ],
)
def test_who_goes_on_is_not_guessed(request_: str) -> None:
    steps = [fly_to("camp", agent="small"), fly_to("camp", agent="big"), home("small")]

    assert edits(request_, "place_not_used", *steps, agents=BOTH_TYPES, about="lake_shore") == []


@pytest.mark.parametrize(
    ("request_", "about", "steps", "repeated"),
    [
        ("A light drone flies 3 laps round the camp and comes home.", "3 laps", [RING], [RING]),
        ("Un dron da 3 vueltas al campamento y regresa a su puerto.", "3 vueltas", [RING], [RING]),
        (
            "A drone flies from the camp to the lake shore 3 times, and waits 9 s each time.",
            "3 times",
            [fly_to("camp"), {"wait": "9 s"}, fly_to("lake_shore"), {"wait": "9 s"}],
            [fly_to("camp"), {"wait": "9 s"}, fly_to("lake_shore"), {"wait": "9 s"}],
        ),
        (
            "A drone does 3 rounds between the camp and the lake shore.",
            "3 rounds",
            [{**RING, "way": "[camp, lake_shore]"}],
            [{**RING, "way": "[camp, lake_shore]"}],
        ),
        ("A drone circles the camp and then asks the watcher. It says so 3 times.", "3 times", [RING, ASK], None),
        ("Each flies 3 laps.", "3 laps", [RING, RING], None),
        ("A drone circles the camp 3 times.", "3 times", [RING], [RING]),
        ("A drone circles the camp and then calls 3 times.", "3 times", [RING], None),
    ],
)
def test_only_what_is_to_be_done_several_times_is_repeated(
    request_: str, about: str, steps: Steps, repeated: Steps | None
) -> None:
    wanted = [] if repeated is None else [[{"repeat": "3", "steps": repeated}, home()]]

    assert edits(request_, "not_so_often", *steps, home(), about=about, wanted=3) == wanted


@pytest.mark.parametrize(
    ("request_", "about", "steps", "wanted"),
    [
        ("fly to the camp at 25 m and come home", "25 m", [fly_to("camp"), home()], [fly_to("camp", "25 m"), home()]),
        ("mira el campamento desde 25 m de altura", "25 m", [fly_to("camp")], [fly_to("camp", "25 m")]),
        ("fly to the camp at 25 m, then to the lake at 35 m", "35 m", [fly_to("camp", "25 m")], None),
        (
            "fly to the camp at 25 m, then to the lake shore at 35 m",
            "35 m",
            [fly_to("camp", "25 m"), fly_to("lake_shore", "25 m")],
            [fly_to("camp", "25 m"), fly_to("lake_shore", "35 m")],
        ),
        ("fly over the camp at 25 m, 9 m apart, and go home at 35 m", "35 m", [fly_to("camp", "25 m")], None),
        ("hover over the camp, 25 m away from the trees", "25 m", [fly_to("camp")], None),
        ("aterrizan en el campamento a 25 m, uno del otro", "25 m", [fly_to("camp")], None),
        ("stay at the camp for 50 s", "50 s", [fly_to("camp"), home()], [fly_to("camp"), {"wait": "50 s"}, home()]),
        ("stay at the camp for 50 s", "50 s", [fly_to("camp"), {"wait": "9 s"}], [fly_to("camp"), {"wait": "50 s"}]),
        (
            "look at the camp and at the lake shore, 50 s each",
            "50 s",
            [fly_to("camp"), fly_to("lake_shore")],
            [fly_to("camp"), {"wait": "50 s"}, fly_to("lake_shore"), {"wait": "50 s"}],
        ),
        ("look at the camp every 50 s", "50 s", [fly_to("camp"), {"wait": "9 s"}], None),
        ("stay at the camp for 50 s, then at the lake shore", "50 s", [fly_to("camp"), fly_to("lake_shore")], None),
    ],
)
def test_heights_and_stays_that_nobody_said_are_those_of_the_request(
    request_: str, about: str, steps: Steps, wanted: Steps | None
) -> None:
    assert edits(request_, "amount_not_used", *steps, about=about) == ([] if wanted is None else [wanted])


def test_steps_of_somebody_without_a_role_are_given_to_the_idle_one_or_left_out() -> None:
    request, there = "Two light drones fly to the camp.", fly_to("camp", agent="one")
    idle = edits(request, "E010", there, fly_to("lake_shore", agent="light"), agents=PAIR)
    done = edits(
        request, "E010", {"parallel": [there, fly_to("camp", agent="other"), fly_to("camp", agent="x")]}, agents=PAIR
    )
    more = edits(request, "E010", there, fly_to("camp", agent="other"), fly_to("lake_shore", agent="x"), agents=PAIR)

    assert idle == [[there, fly_to("lake_shore", agent="other")]]
    assert done == [[{"parallel": [there, fly_to("camp", agent="other")]}]]
    assert more == []


@pytest.mark.parametrize(
    ("request_", "sent"),
    [
        ("Two drones land at the camp and at the lake shore, then both come home.", ["one", "other"]),
        ("Two drones land at the camp and at the lake shore. The second one returns to its port.", ["other"]),
        ("Two drones land at the camp and at the lake shore. One comes home.", None),
        ("Two drones land at the camp. The first one comes home, the second one never comes home.", None),
    ],
)
def test_who_is_sent_home_comes_home_at_the_end(request_: str, sent: list[str] | None) -> None:
    steps = [lands("camp", "one"), lands("lake_shore", "other")]
    wanted = [] if sent is None else [[*steps, *(home(one) for one in sent)]]

    assert edits(request_, "not_home", *steps, agents=PAIR) == wanted


def test_an_edit_that_breaks_something_else_is_not_taken_and_the_search_is_bounded() -> None:
    words = read("fly", world().site, world().catalogue)
    answer = read_answer(tree(fly_to("camp")))
    deepest, judgements = 0, 0

    def longer(case: EditCase) -> Any:
        for number in range(9):
            yield {**case.tree, "steps": [*case.tree["steps"], {"wait": f"{number} s"}]}, f"{number}"

    def worth(done: int, *more: str) -> Judged:
        wrong = [Shortfall("not_home", "", about=str(one)) for one in range(done, 9)]
        return Judged(None, "", (), (*wrong, *(Shortfall(one, one) for one in more)))

    def judging(new: ModelAnswer, told: tuple[str, ...]) -> Judged:
        nonlocal deepest, judgements
        deepest, judgements = max(deepest, len(told)), judgements + 1
        return worth(1, "crash") if told[-1] == "0" else worth(len(told))

    edits_ = {"not_home": (longer,)}
    found = nearest(answer, worth(0), words, world(), {}, judging, edits_)

    assert (deepest, judgements, found.told) == (DEEP, MOST, ("1", "1", "1"))
    assert found.judged.errors == 6
    judgements = 0
    nearest(answer, worth(0, "no_edit_for_this"), words, world(), {}, judging, edits_)
    assert judgements == DEEP
    assert answer == read_answer(tree(fly_to("camp")))


TRIANGLE = (
    "Have three light drones stand as a right-angled triangle, the corner over the camp and both legs 8 m long; "
    "then land them."
)
TEAM = ({"name": "three", "type": "lwd", "count": 3},)


@pytest.mark.parametrize(
    "places",
    [
        "[camp, offset(camp, east=8 m), offset(camp, east=8 m, north=8 m)]",
        "[camp, offset(camp, east=8 m), offset(camp, north=8 m), camp]",
        "line(camp, offset(camp, east=8 m), 3)",
    ],
)
def test_three_that_shall_stand_as_a_triangle_do(places: str) -> None:
    steps = ({"do": "FlyTo", "agent": "three", "to": places, "height": "20 m"}, lands(places, "three"))
    draft_ = made(TRIANGLE, tree(*steps, agents=TEAM))

    assert (draft_.kind, draft_.yaml.count("${triangle(camp, leg)}")) == ("task", 3)
    assert "# Added: three stand as triangle(camp, 8 m), as the request says" in draft_.yaml


@pytest.mark.parametrize(
    ("request_", "agents"),
    [
        (TRIANGLE.replace("camp and", "camp, in front of the lake shore, and"), TEAM),
        (TRIANGLE.replace("both legs 8 m long", "8 m wide"), TEAM),
        (TRIANGLE, ({**TEAM[0], "count": 2},)),
    ],
)
def test_where_a_triangle_stands_or_who_is_not_guessed(request_: str, agents: Any) -> None:
    flight = {"do": "FlyTo", "agent": "three", "to": "[camp, base]", "height": "20 m"}

    assert edits(request_, "figure_not_used", flight, agents=agents, about="triangle") == []


@pytest.mark.parametrize(
    ("said", "legs"),
    [
        ("in a zigzag of 6 legs", 6),
        ("zigzagging (legs: 6, 15 m off the line)", 6),
        ("en zigzag de seis tramos rectos", 6),
        ("weaves in six straight stretches", 6),
        ("in a zigzag of 6 legs, or of 8 legs", 0),
        ("in a zigzag", 0),
        ("as a triangle with 2 legs of 15 m", 0),
    ],
)
def test_of_how_many_legs_a_zigzag_is_to_be(said: str, legs: int) -> None:
    words = read(f"A light drone flies from the camp to the lake shore {said}.", world().site, world().catalogue)
    assert legs_of(words) == legs


def test_a_zigzag_has_the_legs_that_the_request_says() -> None:
    request_ = "Send an LWD zigzagging from the camp to the lake shore (legs: 6, 15 m off the line) and land it there."
    way = {"do": "FlyAlong", "agent": "drone", "way": "zigzag(camp, lake_shore, 15 m, 2)", "height": "30 m"}
    draft_ = made(request_, tree(way, lands("lake_shore", "drone")))

    assert (draft_.kind, "lake_shore, amplitude, 6)" in draft_.yaml) == ("task", True)
    assert "# Added: the zigzag has 6 legs, as the request says" in draft_.yaml
