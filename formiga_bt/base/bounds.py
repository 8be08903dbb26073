"""How large the numbers, and how deep the values, of a message may be: what is beyond was never measured by anything.

Why: JSON has whole numbers of any length and floats up to 1.8e308 (many a driver says that for "no fix"). Squares of those
overflow, and the journal keeps whole numbers of 64 bits. Asked by the wires' checks (`codec`) and where results are read.
"""

import math
from collections.abc import Iterable
from typing import Any, Final

MOST_INT: Final = 2**61
"""Of whole numbers, either way: the difference of any two has 64 bits, and nanoseconds of this age fit."""
MOST: Final = 1e7
"""Of what a status and a card say, and of metres: a quarter of the way around the earth."""
MOST_RESULT: Final = 1e12
"""Of other numbers in results and events: as seconds, in microseconds, they fit beside the time of day."""
MOST_EPOCH: Final = 2**31 - 1
"""Of an engine's epoch: a start each second for 68 years."""
EPOCH_STEP: Final = 1000
"""An agent follows an engine whose epoch is at most so much above the highest that it accepted since its own start."""
BEAT_STEP: Final = 1000
"""A single heartbeat that is further above the newest is not believed before the next one confirms it."""
MOST_DEPTH: Final = 32
"""Lists and mappings of a result or an event lie within each other at most so deep."""
MOST_FILE_BYTES: Final = 1_000_000
"""Of a file of values that a caller names."""
MOST_CELLS: Final = 20_000
"""Values in such a file."""
ID_LIMIT: Final = 4096
"""The most bytes of a goal's id; the longest that a tree makes is far below."""


def are_within(numbers: Iterable[float], most: float = MOST) -> bool:
    """Return whether all numbers are finite and no further from 0 than `most`."""
    return all(-most <= number <= most for number in numbers)


def fault_of(value: Any, depth: int = 0) -> str:
    """Return what is wrong with a value of any shape out of JSON, or ""."""
    if isinstance(value, bool | str) or value is None:
        return ""
    if isinstance(value, int):
        return "" if -MOST_INT <= value <= MOST_INT else "a whole number beyond 2**61"
    if isinstance(value, float):
        return "" if math.isfinite(value) else "a number that is not finite"
    if depth == MOST_DEPTH:
        return f"values more than {MOST_DEPTH} deep"
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return next((fault for item in items if (fault := fault_of(item, depth + 1))), "")
