"""Reason codes that a failure can have: which codes no step of some can end with, and which words are no code at all."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from formiga_bt.lang.codes import FAILED, known_codes
from formiga_bt.lang.model import (
    Ask,
    Check,
    Do,
    Fallback,
    For,
    Guard,
    Parallel,
    Sequence,
    Step,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import did_you_mean
from formiga_bt.lang.walk import steps_once

_ONLY_FROM: Final[Mapping[str, Callable[[Step], bool]]] = MappingProxyType(
    {
        "expect": lambda step: isinstance(step, Ask | Do) and step.expect is not None,
        "check": lambda step: isinstance(step, Check) or (isinstance(step, Sequence) and step.reactive),
        "guard": lambda step: isinstance(step, Guard),
        "no_agent": lambda step: isinstance(step, WithAgents),
        "resource_timeout": lambda step: isinstance(step, WithResource),
        "zip_length": lambda step: isinstance(step, For),
        "nothing_applied": lambda step: isinstance(step, Fallback | Parallel | For),
    }
)
"""Codes that only steps of some kinds end with."""


def never_ends_with(steps: Iterable[Step], code: str) -> bool:
    """Return whether nothing in these steps, nor in what they call, can end with a code."""
    ends = _ONLY_FROM.get(code)
    return ends is not None and not any(ends(step) for step in steps_once(steps))


def no_code(word: str) -> str:
    """Return what helps if a word is the code of no failure, "" of one that may be."""
    if word in known_codes() or ":" in word or not word:
        return ""
    guess = did_you_mean(word, known_codes()).removeprefix("; ")
    return f"an agent's own word, or that of a fail step, shows as '{FAILED}{word}'" + (f"; {guess}" if guess else "")
