"""Hostile files, a few of each kind: check, fmt and fix answer in time and with places. Many more: `benchmarks/fuzz.py`."""

from random import Random

import pytest

from tests.property.hostile import EXPRESSIONS, MAKERS, hostile_text, try_all


@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_a_hostile_file_is_read_or_refused_with_a_place(maker: object) -> None:
    assert callable(maker)
    for seed in range(12):
        try_all(maker(Random(seed)))


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_a_hostile_expression_is_refused_or_harmless(expression: str) -> None:
    head = "formiga: 1\ntask: Bomb\nagents:\n  drone: {type: lwd}\nvars:\n  a: |\n"
    text = head + f"    ${{{expression}}}\nsteps:\n  - do: drone.TakeOff\n    when: {expression}\n"
    assert try_all(text) < 10.0  # seconds: it raises when one of its promises is broken


def test_a_seed_is_a_case() -> None:
    assert hostile_text(Random(7)) == hostile_text(Random(7))
