"""How the benchmark of a fleet in virtual time judges the passes: the separation, half of it at a take-off or landing."""

import pytest

from agents_sim.referee import Pass, Verdict
from benchmarks.bench_virtual_fleet import passes
from tests.golden import Wording


def verdict(closest_m: float, cruise_m: float | None) -> Verdict:
    cruise = None if cruise_m is None else Pass("c", "d", 0, cruise_m)
    return Verdict((), (), (), Pass("a", "b", 0, closest_m), cruise)


@pytest.mark.parametrize(
    ("closest_m", "cruise_m", "too_near"),
    [
        (11.557, 15.02, False),
        (7.5, None, False),
        (7.4, 15.02, True),
        (14.9, 14.9, True),
        (15.0, 15.0, False),
    ],
)
def test_a_take_off_or_landing_keeps_half_of_the_separation_all_else_keeps_all_of_it(
    closest_m: float, cruise_m: float | None, too_near: bool
) -> None:
    assert passes(verdict(closest_m, cruise_m), 15.0)[1] is too_near


def test_both_passes_are_told_with_what_is_allowed(wording: Wording) -> None:
    wording(passes(verdict(11.557, 15.02), 15.0)[0])
    assert passes(Verdict((), (), (), None), 15.0) == ("closest pass: none", False)
