"""Ways home that are said in a word or two, and numbers of times, are compared with what a task does."""

from typing import Any

import pytest

from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged

DRONE = [{"name": "drone", "type": "lwd"}]
NOT_HOME = "the request wants a machine to come home, and none stands at its port at the end"


@pytest.mark.parametrize(
    ("end", "wants"),
    [
        (" and return.", True),
        (", home.", True),
        ("; luego a casa.", True),
        (" y que luego vuelva.", True),
        (" until the people return.", False),
        (" and does not return.", False),
        (", no need to return.", False),
        (", home of the bees.", False),
    ],
)
def test_a_short_way_home_is_missed(end: str, wants: bool) -> None:
    request = f"An LWD looks at the camp from 40 m{end}"
    land = {"do": "FlyAndLand", "agent": "drone", "at": "camp"}

    assert (NOT_HOME in errors(judged(request, fly_to("camp"), land, agents=DRONE))) == wants


@pytest.mark.parametrize(
    ("said", "rounds", "wrong"),
    [
        ("3 times in all", "5", True),
        ("3 times in all", "3", False),
        ("then again 3 times", "4", False),
        ("dos veces", "4", True),
        ("3 times, each time 2 rounds", "5", False),
    ],
)
def test_more_rounds_than_were_asked_for_are_told(said: str, rounds: str, wrong: bool) -> None:
    request = f"A light drone flies over the camp at 40 m every 10 minutes and goes home, {said}."
    loop: dict[str, Any] = {"repeat": rounds, "every": "10 min", "steps": [fly_to("camp"), home()]}
    found = [one for one in errors(judged(request, loop, agents=DRONE)) if "repeats its steps" in one]

    assert (
        found
        == [f'the request says "{said[:7] if said[0] == "3" else said}", and the task repeats its steps {rounds} times']
        * wrong
    )
