"""The effective envelope: the strictest of type, site and task."""

from typing import Any

import pytest

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import AgentType
from formiga_bt.safety.rules import RuleBook, Rules, rules_of
from tests.unit.safety.grounds import site


def drone(**limits: float) -> AgentType:
    return AgentType("drone", Mark("a.yaml", 1, 1), limits=limits)


def test_without_a_word_the_defaults_hold_and_the_sites_zones_bind() -> None:
    assert rules_of(drone(), site()) == Rules(keep_in=True, keep_out=True)
    assert rules_of(drone(), site(fence=None, no_fly=())) == Rules()
    assert Rules().reserve_pct == 25.0


@pytest.mark.parametrize(
    ("name", "loose", "strict", "field"),
    [
        ("reserve_pct", 20.0, 35.0, "reserve_pct"),
        ("max_height_m", 150.0, 60.0, "max_height_m"),
        ("terrain_clearance_m", 3.0, 12.0, "terrain_clearance_m"),
        ("people_clearance_m", 10.0, 30.0, "people_clearance_m"),
        ("link_silence_s", 30.0, 4.0, "link_silence_s"),
        ("wind_max_m_s", 14.0, 6.0, "wind_max_m_s"),
        ("daylight_only", 0.0, 1.0, "daylight_only"),
    ],
)
def test_whoever_is_strictest_wins_wherever_it_is_written(name: str, loose: float, strict: float, field: str) -> None:
    places: list[tuple[dict[str, float], dict[str, float], dict[str, float]]] = [
        ({name: strict}, {name: loose}, {name: loose}),
        ({name: loose}, {name: strict}, {name: loose}),
        ({name: loose}, {name: loose}, {name: strict}),
    ]

    for in_type, in_site, in_task in places:
        rules = rules_of(drone(**in_type), site(envelope=in_site), in_task)

        assert getattr(rules, field) == strict
    assert getattr(rules_of(drone(**{name: loose}), site()), field) == loose


def test_reactions_of_the_site_rank_above_the_types_and_those_above_the_defaults() -> None:
    agent_type = AgentType("drone", Mark("a.yaml", 1, 1), on_breach={"max_height": "return", "keep_out": "return"})

    rules = rules_of(agent_type, site(on_breach={"keep_out": "hold", "reserve": "hold"}))

    reactions = {name: rules.reaction(name) for name in ("max_height", "keep_out", "reserve", "keep_in", "wind_max")}
    assert reactions == {
        "max_height": "return",
        "keep_out": "hold",
        "reserve": "hold",
        "keep_in": "return",
        "wind_max": "return",
    }


def test_the_book_works_each_out_once_and_tells_tasks_apart() -> None:
    book, agent_type = RuleBook(site()), drone(reserve_pct=20.0)
    tight: dict[str, Any] = {"reserve_pct": 40.0}

    assert book.of(agent_type) is book.of(agent_type)
    assert book.of(agent_type, tight) is book.of(agent_type, dict(tight))
    assert (book.of(agent_type).reserve_pct, book.of(agent_type, tight).reserve_pct) == (20.0, 40.0)
