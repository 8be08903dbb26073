"""The simulation would find it: each planted bug shows in a run that is clean without it."""

import pytest

from tests.simulation.planted import PLANTS, is_caught, plan_of, play_with
from tests.simulation.runs import play
from tests.simulation.test_seeds import FEW

ELSEWHERE = [where for where in dict.fromkeys(pin for _, pin, _ in PLANTS.values()) if where not in range(FEW)]
"""Places that `test_seeds` does not play."""
LATE = ("a_result_is_dropped_without_a_look",)
"""Bugs that only the end of a long run shows."""


@pytest.mark.parametrize("bug", [pytest.param(b, marks=[pytest.mark.external] if b in LATE else []) for b in PLANTS])
def test_a_planted_bug_is_caught(bug: str) -> None:
    report = play_with(bug)

    assert is_caught(bug, report), [str(violation) for violation in report.violations]


@pytest.mark.parametrize("where", ELSEWHERE, ids=str)
def test_without_the_bug_it_is_clean(where: int | tuple[int, float, int]) -> None:
    assert play(plan_of(where)).violations == ()


def test_every_bug_says_in_a_line_what_it_is() -> None:
    assert len(PLANTS) >= 24
    for plant, _, rules in PLANTS.values():
        assert plant.__doc__ is not None
        assert "\n" not in plant.__doc__
        assert rules
