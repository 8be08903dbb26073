"""Chance that can be replayed: `random(seed)` and `shuffle(list, seed)` draw from the seed, the task and its run alone.

The same task draws the same again after a restart and in a replay; another task, or the next run of the same one, draws anew.
Drawn from BLAKE2b (RFC 7693), so that no version of Python and no machine draws otherwise.
"""

from hashlib import blake2b
from typing import Any, Final

from formiga_bt.lang.model import Env

_BITS: Final = 53
"""As many as a float holds exactly."""


def random(env: Env, seed: int) -> float:
    """Return a number from 0 to below 1, all equally likely."""
    return _drawn(env, seed, "") / (1 << _BITS)


def shuffle(env: Env, items: tuple[Any, ...], seed: int) -> tuple[Any, ...]:
    """Return the items in an order by chance; each order is as likely as any other."""
    keys = [_drawn(env, seed, f"/{index}") for index in range(len(items))]
    return tuple(items[index] for index in sorted(range(len(items)), key=lambda index: (keys[index], index)))


def _drawn(env: Env, seed: int, more: str) -> int:
    task: Any = env.name("task")
    digest = blake2b(f"{task['id']}/{task['run']}/{seed}{more}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "big") >> (64 - _BITS)
