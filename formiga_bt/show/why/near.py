"""An id that nobody has: how it is shown, and which look like it. What a person typed may be anything."""

from collections.abc import Collection
from difflib import get_close_matches
from typing import Final

SHOWN: Final = 60
LOOKED_AT: Final = 5000
"""So many ids are compared, the newest: it is done while others wait."""


def shortened(word: str) -> str:
    """Return a word as it may be shown: no control characters, not too long."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in word[: SHOWN + 1])
    return plain if len(word) <= SHOWN else f"{plain[:SHOWN]}..."


def nearest(word: str, known: Collection[str]) -> list[str]:
    """Return the ids that look like a word, the likest first; none for a word that is far longer than an id."""
    if not word or len(word) > 2 * SHOWN:
        return []
    lower = {one.lower(): one for one in list(known)[-LOOKED_AT:]}
    return [lower[one] for one in get_close_matches(word.lower(), lower, n=3, cutoff=0.6)]
