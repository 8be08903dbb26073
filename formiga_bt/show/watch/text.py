"""Lines of styled pieces, and the few ways in which times and words become such pieces. Nothing here knows a screen.

Everything that comes from outside (notes of agents, questions, reasons) passes `clean`, so that no text can steer a terminal.
"""

import unicodedata
from collections.abc import Callable, Sequence
from typing import Final, Literal

from msgspec import Struct
from rich.cells import cell_len, set_cell_size

from formiga_bt.base.clock import Micros

Tone = Literal[
    "plain", "dim", "bold", "title", "kind", "agent", "good", "warn", "alarm", "alarm_bar", "warn_bar", "calm_bar",
    "note", "waiting", "running", "success", "failure", "ignored", "skipped", "stopped",
]  # fmt: skip
"""The last ones are those of drawn trees (`show.tree.terminal`)."""


class TonedText(Struct, frozen=True):
    """Some text in one tone."""

    text: str
    tone: Tone = "plain"


Line = tuple[TonedText, ...]
"""One line on the screen."""


class PaneRow(Struct, frozen=True):
    """What can be chosen in a pane: an id, and one or more lines."""

    id: str
    lines: tuple[Line, ...]


class Rows:
    """Rows of which each is made when it is first seen: a table of thousands costs what is in view.

    Args:
        ids: of all rows, in order.
        make: makes the row at a place.
    """

    def __init__(self, ids: Sequence[str], make: Callable[[int], PaneRow]) -> None:
        self.ids = ids
        self._make = make
        self._made: dict[int, PaneRow] = {}

    @classmethod
    def of(cls, rows: Sequence[PaneRow]) -> "Rows":
        """Return rows that are made already."""
        return cls([row.id for row in rows], rows.__getitem__)

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, place: int) -> PaneRow:
        if place not in self._made:
            self._made[place] = self._make(place)
        return self._made[place]


class Glyphs(Struct, frozen=True):
    """The characters that are not words."""

    marks: dict[str, str]
    """Of statuses."""
    pointer: str
    cut: str
    rule: str
    """Behind the title of a pane."""


FULL: Final = Glyphs(
    {
        "PENDING": "○", "ASSIGNED": "◔", "ACTIVE": "●", "ENDING": "◑", "SUCCEEDED": "✓", "FAILED": "✗", "CANCELED": "–",
        "HELD": "‖", "running": "●", "success": "✓", "failure": "✗", "skipped": "·", "stopped": "–", "": " ",
    },
    "▶", "…", "─",
)  # fmt: skip
ASCII: Final = Glyphs(
    {
        "PENDING": "o", "ASSIGNED": "@", "ACTIVE": "*", "ENDING": "%", "SUCCEEDED": "+", "FAILED": "x", "CANCELED": "-",
        "HELD": "=", "running": "*", "success": "+", "failure": "x", "skipped": ".", "stopped": "-", "": " ",
    },
    ">", "~", "-",
)  # fmt: skip
TONES: Final[dict[str, Tone]] = {
    "ACTIVE": "good", "ENDING": "warn", "FAILED": "alarm", "HELD": "warn", "CANCELED": "dim", "SUCCEEDED": "dim",
    "PENDING": "plain", "ASSIGNED": "plain", "running": "good", "success": "dim", "failure": "alarm", "skipped": "dim",
    "stopped": "dim",
}  # fmt: skip


def clean(text: str) -> str:
    """Return a text on one line without anything that a terminal would obey."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if not unicodedata.category(c).startswith(("C", "Z")) else " " for c in text)


def line(*pieces: TonedText | str) -> Line:
    """Return a line; a plain text is a plain piece."""
    return tuple(TonedText(p) if isinstance(p, str) else p for p in pieces)


def plain(pieces: Line) -> str:
    """Return a line's text."""
    return "".join(p.text for p in pieces)


def width_of(text: str) -> int:
    """Return how many columns a text takes."""
    return cell_len(text)


def fit(text: str, width: int, glyphs: Glyphs = FULL) -> str:
    """Return a text of exactly so many columns: filled with spaces, or cut with a mark."""
    if width <= 0:
        return ""
    if cell_len(text) <= width:
        return set_cell_size(text, width)
    return set_cell_size(text, width - 1) + glyphs.cut


def wrap(text: str, width: int) -> list[str]:
    """Return a text in lines of at most so many columns, broken between words where that is possible."""
    lines, now = [], ""
    for word in text.split():
        while cell_len(word) > width:
            if now:
                lines.append(now)
                now = ""
            head = set_cell_size(word, width).rstrip()
            lines.append(head)
            word = word[len(head) :]
        if now and cell_len(now) + 1 + cell_len(word) > width:
            lines.append(now)
            now = word
        else:
            now = f"{now} {word}" if now else word
    return [*lines, now] if now or not lines else lines


def span(us: Micros) -> str:
    """Return a length of time as people read a clock: `0:41`, `12:05`, `3:20:00`."""
    seconds = max(0, us) // 1_000_000
    hours, rest = divmod(seconds, 3600)
    return f"{hours}:{rest // 60:02}:{rest % 60:02}" if hours else f"{rest // 60}:{rest % 60:02}"


def left(at: Micros | None, now: Micros) -> str:
    """Return how long until an instant: `0:41`, or `now` when it has come."""
    if at is None:
        return ""
    return "now" if at <= now else span(at - now + 999_999)
