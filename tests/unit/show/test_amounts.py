"""Values of a running task as people read them."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.types import AgentRef, Type, list_of
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.show.amounts import Wording, percent
from tests.golden import Wording as Golden
from tests.unit.engine.yard import CART, Yard, task
from tests.unit.show.scene import source_of

SITE, _ = packaged_world()
NOW = 1_000 * SECOND


@pytest.mark.parametrize(
    ("value", "kind", "words"),
    [
        (60.0, "distance", "60 m"),
        (0.1 + 0.2, "speed", "0.3 m/s"),
        (35.0, "percent", "35 %"),
        (90.0, "duration", "90 s"),
        (150.0, "duration", "150 s"),
        (300.0, "duration", "5 min"),
        (NOW + 41 * SECOND, "time", "in 41 s"),
        (NOW - 41 * SECOND, "time", "41 s ago"),
        (3, "int", "3"),
        (True, "bool", "yes"),
        ("sos", "text", "sos"),
        (Place(30.0, -40.2), "place", "camp"),
        (Place(-12.0, 40.4), "place", "12 W 40 N"),
        (Place(-105.0, 40.0), "place", "port p1"),
        (Position(30.0, -40.0, 60.0), "position", "camp, 60 m up"),
        (SITE.regions["lake"], "region", "lake"),
        (Region((Place(0.0, 0.0), Place(1.0, 0.0), Place(0.0, 1.0))), "region", "a region with 3 corners"),
        (AgentRef("hwd_1"), "agent", "hwd_1"),
        ({"answer": "yes", "by": "eve"}, "record", "answer yes, by eve"),
        (None, "text", "not set"),
        (7.25, "", "7.25"),
    ],
)
def test_a_value_in_words(value: Any, kind: str, words: str) -> None:
    assert Wording(SITE).say(value, Type(kind) if kind else None, NOW) == words


def test_a_list_says_its_items_and_how_many_more(wording: Golden) -> None:
    say = Wording(SITE).say
    wording(say((1.0, 2.0), list_of(Type("distance")), NOW), say(tuple(range(10)), None, NOW))


def test_progress_is_a_share_however_it_is_told() -> None:
    assert [percent(told) for told in (None, 0.4, 1.0, 40.0, 130.0, -1.0)] == [None, 0.4, 1.0, 0.4, 1.0, 0.0]


def test_the_scopes_of_a_task_have_the_units_of_its_file() -> None:
    text = """
params: {height: {type: distance, default: 60 m}}
vars: {patience: 2 min}
steps:
  - for: {pause: [5 s, 7 s]}
    mode: parallel
    steps: [{call: Rest, with: {long: "${pause}"}}]
subtrees:
  Rest:
    params: {long: duration}
    steps: [{wait: "${long}"}]
"""
    bench = Yard(task(CART + text))
    source, one = source_of(bench), bench.start()

    assert source.task(one).values == {
        "": {"height": "60 m", "patience": "2 min", "cart": "c1"},
        "steps/steps[0].for#1": {"pause": "5 s"},
        "steps/steps[0].for#1.steps[0]": {"long": "5 s"},
        "steps/steps[0].for#2": {"pause": "7 s"},
        "steps/steps[0].for#2.steps[0]": {"long": "7 s"},
    }
