"""What tones look like on a screen: the sixteen colours of the terminal itself, or none.

Every tone differs by more than colour where it matters: the words say it too.
"""

from collections.abc import Mapping
from typing import Final

from rich.segment import Segment
from rich.style import Style

from formiga_bt.show.watch.text import ASCII, FULL, Line, Tone, width_of

COLOURS: Final[Mapping[Tone, str]] = {
    "plain": "", "dim": "dim", "bold": "bold", "title": "bold", "kind": "cyan", "agent": "green", "good": "green",
    "warn": "yellow", "alarm": "bold red", "alarm_bar": "bold bright_white on red", "warn_bar": "bold black on yellow",
    "calm_bar": "bold reverse", "note": "bold", "waiting": "dim", "running": "bold blue", "success": "green",
    "failure": "bold red", "ignored": "yellow", "skipped": "dim", "stopped": "magenta",
}  # fmt: skip
PLAIN: Final[Mapping[Tone, str]] = {
    "plain": "", "dim": "", "bold": "bold", "title": "bold", "kind": "", "agent": "", "good": "", "warn": "bold",
    "alarm": "bold", "alarm_bar": "bold underline reverse", "warn_bar": "bold reverse", "calm_bar": "reverse",
    "note": "bold", "waiting": "", "running": "bold", "success": "", "failure": "bold", "ignored": "", "skipped": "",
    "stopped": "",
}  # fmt: skip


class Palette:
    """Turns lines into what a screen takes.

    Args:
        colour: False: only bold, underlined and reversed.
        ascii_only: nothing beyond ASCII leaves.
    """

    def __init__(self, *, colour: bool = True, ascii_only: bool = False) -> None:
        self._ascii = ascii_only
        table = COLOURS if colour else PLAIN
        self._styles = {tone: Style.parse(text) if text else Style.null() for tone, text in table.items()}
        self._chosen = {tone: Style(reverse=True, bold=style.bold) for tone, style in self._styles.items()}

    def segments(self, pieces: Line, width: int, *, chosen: bool = False, fill: Tone = "plain") -> list[Segment]:
        """Return a line in at most `width` columns, filled up; `chosen`: as the row that is chosen."""
        styles = self._chosen if chosen else self._styles
        found, used = [], 0
        for piece in pieces:
            text = piece.text.encode("ascii", "backslashreplace").decode() if self._ascii else piece.text
            room = width - used
            if room <= 0:
                break
            taken = width_of(text)
            if taken > room:
                text = self._short(text, room)
                taken = width_of(text)
            found.append(Segment(text, styles[piece.tone]))
            used += taken
        if used < width:
            found.append(Segment(" " * (width - used), styles[fill]))
        return found

    def _short(self, text: str, room: int) -> str:
        if width_of(text.rstrip()) <= room:
            return _cut(text, room)
        return _cut(text, room - 1) + (ASCII if self._ascii else FULL).cut


def _cut(text: str, room: int) -> str:
    while width_of(text) > room:
        text = text[: max(0, min(len(text) - 1, room))]
    return text
