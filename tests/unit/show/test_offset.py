"""How far engine time is from the wall clock, in words."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.show.offset import offset_words


@pytest.mark.parametrize(
    ("ahead_s", "words"),
    [
        (4, ""),
        (-4, ""),
        (42, "42 s ahead of the wall clock"),
        (-61, "1 min 1 s behind the wall clock"),
        (2 * 3600 + 185, "2 h 3 min ahead of the wall clock"),
        (90_000, "1 d 1 h ahead of the wall clock"),
    ],
)
def test_the_difference_in_its_two_largest_units(ahead_s: int, words: str) -> None:
    assert offset_words(ahead_s * SECOND) == words
