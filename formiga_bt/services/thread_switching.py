"""Turns of threads in a process in which one must never wait long: the engine's.

Python lets a thread that computes keep the interpreter for 5 ms when another one asks for it, and the engine's thread asks anew
after each call of the database and of the wire. While a snapshot is made, or a page, that adds up to tens of milliseconds
between a result and the next goal. Used by `formiga up`; a process with other aims decides itself.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

SWITCH_S: Final = 0.0005
"""So long a thread keeps the interpreter when another one asks for it."""


@contextmanager
def short_turns() -> Iterator[None]:
    """Have all threads of this process take short turns inside."""
    former = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(former)
