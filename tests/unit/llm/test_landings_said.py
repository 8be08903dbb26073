"""A way home becomes a landing below only where the request wants a landing there, and rules none out."""

import pytest

from formiga_bt.llm.judging.landings import landings
from formiga_bt.llm.records import RehearsedFlight
from formiga_bt.llm.words.landings import lands_only, rules_out_landing
from tests.golden import Wording
from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import TWO, errors, judged, land, words

DRONE = [{"name": "drone", "type": "lwd"}]


@pytest.mark.parametrize(
    ("request_", "place"),
    [
        ("A light drone flies over the camp at 30 m without landing.", "camp"),
        ("A light drone flies over the camp at 30 m and does not land.", "camp"),
        ("Under no circumstances land: a light drone flies over the camp at 30 m.", "camp"),
        ("Un dron ligero pasa por encima del campamento a 30 m y no aterriza.", "camp"),
        ("A light drone inspects the landing lights at the east field from 30 m.", "east_field"),
        ("A light drone maps the land around the camp from 30 m.", "camp"),
        ("A light drone looks at the camp from 30 m and lands where it lifted off.", "camp"),
        ("A light drone looks at the camp from 30 m and lands at the place it came from.", "camp"),
        ("A light drone looks at the camp from 30 m and lands in its hangar.", "camp"),
        ("A light drone looks at the camp from 30 m and lands on its own pad.", "camp"),
        ("A light drone looks at the camp from 30 m and lands at its dock.", "camp"),
        ("A light drone looks at the camp from 30 m and lands on a charging plate.", "camp"),
        ("A light drone hovers 30 m over the lake, then lands on its charger.", "lake"),
        ("A light drone hovers 30 m over the lake, then lands.", "lake"),
    ],
)
def test_who_comes_home_is_not_made_to_land(request_: str, place: str) -> None:
    found = judged(request_, fly_to(place, "30 m"), home(), agents=DRONE)

    assert errors(found) == []
    assert found.flight is not None
    assert set(found.flight.stands.values()) == {"home"}


@pytest.mark.parametrize(
    "end",
    ["then lands there", "then lands", "and lands at the camp", "and lands on the ground", "and lands at its destination",
     "and does not land until a minute is over", "and lands on its own"],
)  # fmt: skip
def test_who_shall_land_there_does(end: str, wording: Wording) -> None:
    found = judged(f"A light drone hovers 30 m over the camp {end}.", fly_to("camp", "30 m"), home(), agents=DRONE)

    wording(found.mends)
    assert found.flight is not None
    assert set(found.flight.stands.values()) == {"camp"}


def test_the_landing_of_one_is_not_that_of_the_other() -> None:
    found = judged(
        "One light drone lands at the camp; another one watches from 30 m over the lake shore.",
        {"parallel": [land("one", "camp"), fly_to("lake_shore", "30 m", "other")]},
        home("other"),
        agents=TWO,
    )

    assert found.mends == ()
    assert found.flight is not None
    assert sorted(found.flight.stands.values()) == ["camp", "home"]


def test_what_rules_a_landing_out() -> None:
    assert rules_out_landing(words("It flies over the camp without landing."))
    assert not rules_out_landing(words("It does not come home but lands at the camp."))
    assert not rules_out_landing(words("It crosses the north field and lands at the camp."))
    assert lands_only(words("A light drone takes the camp as its landing place."))
    assert lands_only(words('It lands at the camp and says "I am on my way home".'))


def test_a_landing_at_the_lake_shore_is_none_at_the_lake() -> None:
    request = words("A light drone explores the lake at 40 m and lands at the lake shore.")
    flight = RehearsedFlight(task="T", status="SUCCEEDED", landed={"lwd_1": ("lake_shore",)})

    assert [one.text for one in landings(request, flight)] == []
    assert [one.about for one in landings(request, RehearsedFlight(task="T", status="SUCCEEDED"))] == ["lake_shore"]
