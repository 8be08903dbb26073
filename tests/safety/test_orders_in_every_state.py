"""Every order in every state of a task and of a machine, twice, then calm: nothing is broken, hangs or is raised."""

import os

import pytest

from tests.safety.states import ORDERS, STATES, give
from tests.shares import some


def chosen(state: str) -> list[str]:
    """Return the orders that are tried in a state: each eighth (in CI each fourth), other ones in each state.

    All, if FORMIGA_EXAMPLES is set.
    """
    first = list(STATES).index(state)
    every = 1 if os.environ.get("FORMIGA_EXAMPLES") else some(8, 4)
    return [order for index, order in enumerate(ORDERS) if (index + first) % every == 0]


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_every_order_twice_then_calm(state: str) -> None:
    wrong = {order: found for order in chosen(state) if (found := give(state, order))}

    assert wrong == {}, "\n".join(f"{state}, {order}: {line}" for order, found in wrong.items() for line in found)
