"""How far engine time is from the wall clock, in words. Every time that people are shown is engine time (ADR 15)."""

from typing import Final

from formiga_bt.base.clock import SECOND, Micros

AHEAD_HEADER: Final = "Formiga-Ahead-S"
"""Header of an answer of the API: engine time less the wall clock, seconds."""
SAID: Final = 5 * SECOND
"""A smaller difference is not worth a word."""


def offset_words(ahead: Micros) -> str:
    """Return how engine time stands to the wall clock, such as `2 h 3 min ahead of the wall clock`; empty: they agree.

    Args:
        ahead: engine time less the wall clock, microseconds.
    """
    if abs(ahead) < SAID:
        return ""
    return f"{span_words(abs(ahead))} {'ahead of' if ahead > 0 else 'behind'} the wall clock"


def span_words(span: Micros) -> str:
    """Return a span of time in its two largest units, such as `2 h 3 min`."""
    s = span // SECOND
    days, hours, minutes = s // 86400, s // 3600 % 24, s // 60 % 60
    for large, small, words in (
        (days, hours, "{} d {} h"),
        (hours, minutes, "{} h {} min"),
        (minutes, s % 60, "{} min {} s"),
    ):
        if large:
            return words.format(large, small)
    return f"{s} s"
