"""A yard per test; at the end, what must hold always is checked."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.unit.engine.yard import Yard

Make = Callable[..., Yard]


@pytest.fixture
def make() -> Iterator[Make]:
    made: list[Yard] = []

    def build(*args: Any, **options: Any) -> Yard:
        made.append(Yard(*args, **options))
        return made[-1]

    yield build
    for yard in made:
        yard.check()
        yard.close()
