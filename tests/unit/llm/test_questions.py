"""What a request says of questions to people: whom, each or any of them, where the machine is by then."""

from functools import cache

import pytest

from formiga_bt.llm.words.questions import AskedQuestion, questions
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of


@cache
def world() -> RequestWorld:
    return world_of()


def asked(request: str) -> list[AskedQuestion]:
    return list(questions(read(request, world().site, world().catalogue), world()))


@pytest.mark.parametrize(
    ("request_", "all_", "people"),
    [
        (
            "Ask picker_2, then watcher_1 if the path is free; on two yes a drone flies to the camp.",
            True,
            "picker_2 watcher_1",
        ),
        ("A drone flies to the camp once the watcher agrees and picker_1 says yes.", True, "watcher picker_1"),
        ("Permission from picker_1 and from a watcher, then a light drone goes to the camp.", True, "picker_1 watcher"),
        ("A drone leaves only if both pickers agree.", True, "picker_1 picker_2"),
        ("Preguntar al vigilante y luego a picker_2 si todo va bien.", True, "watcher picker_2"),
        ("Un dron vuela al campamento cuando picker_1 y picker_2 estén de acuerdo.", True, "picker_1 picker_2"),
        ("The picker there (picker_1) and the watcher must confirm.", True, "picker_1 watcher"),
        ("Have picker_1 confirm and then have the watcher confirm.", True, "picker_1 watcher"),
        ("With the consent of picker_1 as well as of the watcher.", True, "picker_1 watcher"),
        ("picker_2 has to agree, and so does picker_1; then a drone goes.", True, "picker_2 picker_1"),
        ("Pide permiso a picker_1 y al vigilante.", True, "picker_1 watcher"),
        (
            "Tienen que confirmar primero un vigilante y luego picker_2; entonces un dron vuela.",
            True,
            "watcher picker_2",
        ),
        ("Un dron flota sobre el campamento; si picker_1 dice que está libre, aterriza.", True, "picker_1"),
        ("Ask picker_1 or picker_2 if the path is free.", False, "picker_1 picker_2"),
        ("Ask one of picker_1 and picker_2 if the path is free.", False, "picker_1 picker_2"),
        ("Pregunta a picker_1 o a picker_2.", False, "picker_1 picker_2"),
    ],
)
def test_who_is_asked_and_whether_each_must_agree(request_: str, all_: bool, people: str) -> None:
    (found,) = asked(request_)

    assert [one.id or one.type for one in found.people] == people.split()
    assert found.all is all_


@pytest.mark.parametrize(
    "request_",
    [
        "Bring the buckets to picker_1 and picker_2 and tell the watcher.",
        "Do not ask picker_1 and picker_2.",
        "A drone hovers over the camp; if the watcher says that it is not clear, it comes home.",
        "If picker_1 says it's dangerous, the drone comes home.",
        "A drone flies to the camp without asking the watcher.",
        "If picker_1 says no, the drone comes home.",
        "If the battery is low, ask the watcher.",
        "When the watcher, or failing that picker_1, agrees, a drone flies to the camp.",
        "Ask picker_1 or somebody else.",
        'A drone tells "ask picker_1 and picker_2" and comes home.',
    ],
)
def test_people_who_are_only_spoken_of_are_not_asked_for_certain(request_: str) -> None:
    assert asked(request_) == []


@pytest.mark.parametrize(
    ("request_", "after", "then"),
    [
        ("A drone flies to the camp at 20 m; when the watcher agrees, it lands.", ["camp"], "land"),
        ("A drone lands at the camp. Once picker_1 has agreed, it comes home.", ["camp"], "leave"),
        ("A drone lands at the camp and comes home only if picker_1 agrees.", ["camp"], "leave"),
        ("A drone lands at the camp, asks the picker if all is loaded, and flies home.", ["camp"], "leave"),
        ("A drone goes to the camp. Watcher and picker must agree before it comes home.", ["camp"], "leave"),
        ("A drone hovers over the camp until the watcher agrees, then comes home.", ["camp"], "go on"),
        (
            "A drone goes to the camp. Picker_1 and picker_2 both have to agree before it takes off again.",
            ["camp"],
            "leave",
        ),
        ("A drone goes to the camp. After the watcher's ok it lands there.", ["camp"], "land"),
        (
            "A drone goes to the camp. The watcher is asked if all is calm. On yes it flies on to the lake shore.",
            ["camp"],
            "leave",
        ),
        ("A drone waits at the camp for the watcher's yes, then it comes home.", ["camp"], "go on"),
        ("Un dron vuela al campo norte; si picker_1 dice que sí, aterriza.", ["north_field"], "land"),
        # what comes first is not certain
        ("A drone flies to the camp if the watcher agrees.", [], ""),
        ("A drone lands at the camp and stays when the watcher agrees.", [], ""),
        ("A drone flies to the camp and lands when picker_1 agrees.", [], ""),
        ("Before a drone flies to the camp, ask the watcher; then it comes home.", [], ""),
        ("A drone flies to the camp, but ask the watcher first; if the watcher agrees, it lands.", [], ""),
        ("A drone is to land at the camp. When picker_1 agrees, it comes down there.", [], ""),
        ("A drone flies to the camp and comes home. When the watcher agrees, it flies on.", [], ""),
        ("A drone lands at the camp. If picker_1 agrees, it goes.", [], ""),
        ("A drone circles at the camp; if the watcher agrees, it comes home.", [], ""),
        ("Ask the watcher for permission; a drone flies to the camp and on a yes it comes home.", [], ""),
    ],
)
def test_where_the_machine_is_when_people_are_asked(request_: str, after: list[str], then: str) -> None:
    found = asked(request_)[0]

    assert (list(found.after), found.then) == (after, then)
