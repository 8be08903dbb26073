"""From a node's key to the steps around it: rounds, items, attempts, calls, branches, cleanup."""

import pytest

from formiga_bt.lang.places import steps_around
from formiga_bt.rehearsal.testing import packaged_task
from tests.unit.engine.yard import CART, task

TRY = task(
    CART
    + """
steps:
  - wait: 1 s
  - sequence:
      - if: cart.battery > 5 %
        then: [{wait: 2 s}]
        else: [{wait: 3 s}]
      - for: {x: [1, 2]}
        mode: parallel
        steps: [{wait: 4 s, name: item}]
    finally: [{wait: 5 s}]
  - repeat: 3
    steps:
      - wait: 6 s
        retry: {attempts: 2}
on_abort: [{wait: 7 s}]
"""
)


@pytest.mark.parametrize(
    ("key", "kinds"),
    [
        ("steps", []),
        ("steps/steps[0]", ["wait"]),
        ("steps/steps[1].sequence[0].else[0]", ["sequence", "if", "wait"]),
        ("steps/steps[1].sequence[1].for#2.steps[0]", ["sequence", "for", "wait"]),
        ("steps/steps[1].finally[0]", ["sequence", "wait"]),
        ("steps/steps[1]:finally", ["sequence"]),
        ("steps/steps[2].repeat#3.steps[0]@2:timeout", ["repeat", "wait"]),
        ("on_abort/on_abort[0]", ["wait"]),
        ("steps/steps[9]", []),
        ("recover:c1#1/steps[0]", []),
    ],
)
def test_the_steps_from_the_section_down_to_the_node(key: str, kinds: list[str]) -> None:
    assert [step.kind for step in steps_around(TRY, key)] == kinds


def test_the_steps_of_a_called_subtree() -> None:
    around = steps_around(packaged_task("pick_up"), "steps/steps[0].call.steps[1]")

    assert (around[0].kind, len(around)) == ("call", 2)
