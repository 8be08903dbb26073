"""How a request calls a right triangle: in words that leave no doubt, and in words that may mean one."""

from typing import Final

TRIANGLE: Final = (
    r"\btri[aá]ng\w+|\bright[ -]angle\b"
    r"|^(?=.*\b(?:three|3|two (?:more|others?|further)|tres|otros dos)\b)"
    r".*\bperpendicular\w* (?:directions?|arms?|legs?|lines?|direcciones)\b"
)
"""Whoever says this wants a triangle: a task without one is not what was asked for."""

PERHAPS_TRIANGLE: Final = (
    rf"{TRIANGLE}|\bright[ -]angle\w*"
    r"|\bperpendicular\w* (?:directions?|arms?|legs?|lines?)\b|\b(?:90|ninety)[ -]?(?:degrees?|deg|°)"
)
"""Whoever says this may want one: enough to read how long the legs of a task's triangle are to be, not to ask for one."""
