"""`Over a place at a height` is no landing."""

import pytest

from formiga_bt.llm.shaping.hovering import height_over
from tests.golden import Wording
from tests.unit.llm.scripted import home
from tests.unit.llm.test_teams import errors, judged, land, words

PAIR = [{"name": "drones", "type": "lwd", "count": 2}]


@pytest.mark.parametrize(
    ("request_", "height"),
    [
        ("One drone over the camp, one above the lake shore, both at 35 m, then back.", "35 m"),
        ("Two drones look from 35 m, over the camp and the lake shore.", "35 m"),
        ("Uno sobre el campamento y otro sobre la orilla del lago, a 35 m.", "35 m"),
        ("One over the camp, one over the lake shore, at 35 m; then both land.", ""),
        ("One over the camp, one at the lake shore, at 35 m.", ""),
        ("One over the camp, one over the lake shore, 35 m from each other.", ""),
        ("One over the camp, one over the lake shore, at 35 m, 500 m apart.", ""),
        ("One over the camp, one over the lake shore.", ""),
    ],
)
def test_at_which_height_machines_are_wanted_over_places(request_: str, height: str) -> None:
    assert height_over("[camp, lake_shore]", words(request_)) == height


def test_who_is_wanted_over_a_place_does_not_land_there(wording: Wording) -> None:
    request = "Two light drones at once, one over the camp and one over the lake shore, at 35 m; then home."
    places = "[camp, lake_shore]"
    found = judged(request, land("drones", places), agents=PAIR)
    back = judged(request, land("drones", places), home("drones"), agents=PAIR)

    assert errors(found) == errors(back) == []
    wording(back.mends)
    assert found.flight is not None
    assert set(found.flight.stands.values()) == {"home"}
    assert "FlyAndLand" not in found.yaml


def test_who_brings_something_lands_while_another_one_hovers() -> None:
    agents = [{"name": "heavy", "type": "hwd"}, {"name": "light", "type": "lwd"}]
    for deed in ("brings water to the lake shore", "goes to the lake shore"):
        request = f"A heavy drone {deed} while a light drone watches from 40 m over the lake shore; both come home."
        watch = {"do": "FlyTo", "agent": "light", "to": "lake_shore", "height": "40 m"}
        steps = {"parallel": [land("heavy", "lake_shore"), watch]}
        assert judged(request, steps, home("heavy"), home("light"), agents=agents).mends == ()
    assert height_over("camp", words("A light drone takes a box over the camp at 35 m.")) == ""
