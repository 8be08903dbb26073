"""Amounts of a request: feet and miles, times in two parts, halves; what only looks like an amount."""

import pytest

from formiga_bt.llm.words.plain_words import plainly
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged, words

DRONE = [{"name": "drone", "type": "lwd"}]


@pytest.mark.parametrize(
    ("request_", "amounts"),
    [
        ("at 50 ft", [("50 ft", 15.24)]),
        ("a 100-foot circle, 3 yards off", [("100-foot", 30.48), ("3 yards", 2.7432)]),
        ("2 miles away at 20 mph", [("2 miles", 3218.688), ("20 mph", 8.9408)]),
        ("with 10 knots, 5 m/s or 36 km/h", [("10 knots", 5.14444), ("5 m/s", 5.0), ("36 km/h", 10.0)]),
        ("a 30 pies de altura", [("30 pies", 9.144)]),
        ("the two heavy ones, and tens of birds", []),
        ("five m up, ten seconds", [("five m", 5.0), ("ten seconds", 10.0)]),
        ("for 1 minute and 30 seconds", [("1 minute and 30 seconds", 90.0)]),
        ("for 3 min 20 s", [("3 min 20 s", 200.0)]),
        ("two minutes and ten seconds", [("two minutes and ten seconds", 130.0)]),
        ("1 h 5 min", [("1 h 5 min", 3900.0)]),
        ("dos minutos y diez segundos", [("dos minutos y diez segundos", 130.0)]),
        ("for two and a half minutes", [("two and a half minutes", 150.0)]),
        ("half an hour, dos minutos y medio", [("half an hour", 1800.0), ("dos minutos y medio", 150.0)]),
        ("for 2 min and 30 s later", [("2 min", 120.0), ("30 s", 30.0)]),
        ("for 2 min, 30 s at the lake", [("2 min", 120.0), ("30 s", 30.0)]),
        ("30 s and 2 min", [("30 s", 30.0), ("2 min", 120.0)]),
    ],
)
def test_amounts_are_read(request_: str, amounts: list[tuple[str, float]]) -> None:
    assert [(one.words, round(one.si, 6)) for one in words(request_).amounts] == [
        (w, pytest.approx(v)) for w, v in amounts
    ]


def test_feet_are_compared_in_metres(wording: Wording) -> None:
    request = "A light drone looks at the camp from 50 ft and comes home."

    wording(plainly(request), plainly("It looks at the camp from 50 m at 5 km/h."))
    for height in ("15.24 m", "15 m", "16 m"):
        assert errors(judged(request, fly_to("camp", height), home(), agents=DRONE)) == []
    wording(errors(judged(request, fly_to("camp", "50 m"), home(), agents=DRONE)))


def test_a_unit_that_nobody_knows_is_no_metre() -> None:
    wrong = 'the request says "50 fathoms", which is no unit that is known here, and the task has 50 m'
    request = "A light drone looks at the camp from 50 fathoms above it and comes home."

    assert errors(judged(request, fly_to("camp", "50 m"), home(), agents=DRONE)) == [wrong]
    assert errors(judged(request, fly_to("camp", "91 m"), home(), agents=DRONE)) == []
    both = "A light drone walks 50 paces: it looks at the camp from 50 m and comes home."
    assert errors(judged(both, fly_to("camp", "50 m"), home(), agents=DRONE)) == []


@pytest.mark.parametrize("pauses", [["90 s"], ["1 min", "30 s"]])
def test_a_time_in_two_parts_is_one_pause_or_two(pauses: list[str]) -> None:
    request = "A light drone hovers over the camp for 1 minute and 30 seconds and comes home."
    found = judged(request, fly_to("camp"), *({"wait": one} for one in pauses), home(), agents=DRONE)

    assert errors(found) == []


def test_a_time_in_two_parts_is_used_whole(wording: Wording) -> None:
    request = "A light drone hovers over the camp for 1 minute and 30 seconds and comes home."

    wording(errors(judged(request, fly_to("camp"), {"wait": "1 min"}, home(), agents=DRONE)))


def test_ones_are_no_seconds() -> None:
    found = judged(
        "The two heavy ones land at the camp.",
        {"do": "FlyAndLand", "agent": "drones", "at": "camp"},
        agents=[{"name": "drones", "type": "hwd", "count": 2}],
    )

    assert errors(found) == []
