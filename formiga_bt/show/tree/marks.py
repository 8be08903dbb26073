"""The one table of how a step's status is shown: glyph, letter, colour, outline, words.

Colours are of the Okabe-Ito palette, which colour-blind people can tell apart; glyph and outline differ too, so that every
picture reads in black and white.
"""

from dataclasses import dataclass
from typing import Final

from formiga_bt.show.facts import Box, StepFact
from formiga_bt.show.tree.phrases import IGNORED


@dataclass(frozen=True, slots=True)
class StatusMark:
    """How one status looks."""

    status: str
    """As in `StepFact.status`; also `waiting` (not begun) and `ignored` (a failure that does not count)."""
    glyph: str
    letter: str
    """The same for terminals that have ASCII only."""
    sgr: str
    """Terminal colour (ISO 6429 select graphic rendition)."""
    colour: str
    """For pictures, `#rrggbb`."""
    line: str
    """Of the outline, as graphviz says it: solid, bold, dashed, dotted."""
    width: float
    """Of the outline, points."""
    words: str


WAITING: Final = StatusMark("waiting", "·", ".", "2", "#8c8c8c", "solid", 0.7, "not begun")
RUNNING: Final = StatusMark("running", "►", ">", "1;34", "#0072b2", "bold", 3.0, "running")
SUCCESS: Final = StatusMark("success", "✓", "+", "32", "#00795a", "solid", 1.4, "success")
FAILURE: Final = StatusMark("failure", "✗", "x", "1;31", "#c44500", "bold", 3.0, "failure")
IGNORED_FAILURE: Final = StatusMark("ignored", "!", "!", "33", "#9a6a00", "dashed", 1.4, "failure, ignored")
SKIPPED: Final = StatusMark("skipped", "»", "-", "2", "#707070", "dotted", 1.0, "skipped")
STOPPED: Final = StatusMark("stopped", "■", "#", "35", "#a3427a", "dashed", 2.0, "stopped")

MARKS: Final = (WAITING, RUNNING, SUCCESS, FAILURE, IGNORED_FAILURE, SKIPPED, STOPPED)
"""In the order of legends."""

_BY_STATUS: Final = {mark.status: mark for mark in MARKS}


def mark_of(box: Box, fact: StepFact | None) -> StatusMark:
    """Return how a step looks; without a fact it has not begun."""
    if fact is None:
        return WAITING
    if fact.status == "failure" and IGNORED in box.modifiers:
        return IGNORED_FAILURE
    return _BY_STATUS[fact.status]


def note_of(fact: StepFact | None) -> str:
    """Return what is to be told of a step beside its status: what it does now, why it failed, how often it ran."""
    if fact is None:
        return ""
    words = [fact.note] if fact.note else []
    if not fact.note and fact.status == "failure":
        words += [fact.code or fact.reason] if fact.code or fact.reason else []
    runs = fact.running + fact.succeeded + fact.failed + fact.skipped + fact.stopped
    if runs > 1:
        words.append(f"{runs} runs, {fact.failed} failed" if fact.failed else f"{runs} runs")
    return ", ".join(words)
