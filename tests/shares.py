"""What each run of the tests plays of many seeds and positions, and what only CI does (`make test EXTERNAL=1`)."""

import os
from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def in_ci(values: Iterable[object]) -> list[object]:
    """Return the values of a parameter that only CI plays."""
    import pytest  # not for the programs that ask for `some`

    return [pytest.param(value, marks=pytest.mark.external) for value in values]


def some(few: T, all_: T) -> T:
    """Return what each run takes, or in CI the rest too."""
    return all_ if os.environ.get("FORMIGA_EXTERNAL") else few
