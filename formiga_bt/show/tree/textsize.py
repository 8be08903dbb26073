"""How wide a text is in a picture, and where its lines break: the widths of DejaVu Sans, which Verdana shares.

Pictures name both fonts, so that what fits here fits in a browser too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

FONT: Final = "DejaVu Sans,Verdana,sans-serif"

# Thousandths of the font's size, of the characters from space to ~.
_PLAIN: Final = (
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636, 636, 636, 636, 636, 636,
    636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557, 863, 748, 787,
    603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352, 635,
    634, 278, 278, 579, 278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
)  # fmt: skip
_BOLD: Final = 1.14
"""A bold text is wider by this at most."""
_OTHER: Final = 700
"""Of a character that is not in the table; wide ones count 1000."""


@dataclass(frozen=True, slots=True)
class TextRun:
    """A piece of a line: `bold`, `plain`, `italic`, `mark` or `note`."""

    text: str
    style: str = "plain"


Lines = list[list[TextRun]]


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Return the width of a text in points."""
    total = 0
    for char in text:
        code = ord(char)
        total += _PLAIN[code - 32] if 32 <= code < 127 else _OTHER if code < 0x1100 else 1000
    return total * size / 1000 * (_BOLD if bold else 1.0)


def run_width(run: TextRun, size: float) -> float:
    """Return the width of a piece in points."""
    return text_width(run.text, size, run.style in ("bold", "note", "mark"))


def printable(text: str) -> str:
    """Return a text without the characters that XML has no place for."""
    return text if text.isprintable() else "".join(c if c.isprintable() else " " for c in text)


def flow(runs: Sequence[TextRun], room: float, size: float, most: int = 4) -> Lines:
    """Return pieces broken into lines at spaces; the last of `most` lines ends in an ellipsis if there is more."""
    lines: Lines = [[]]
    used = 0.0
    for run in runs:
        words = run.text.split(" ")
        for at, word in enumerate(words):
            text = word if at == len(words) - 1 else word + " "
            for part in _parts(text, run.style, room, size):
                width = run_width(TextRun(part.rstrip(), run.style), size)
                if used + width > room and lines[-1]:
                    lines.append([])
                    used = 0.0
                if part.strip() or lines[-1]:
                    _add(lines[-1], TextRun(part, run.style))
                    used += run_width(TextRun(part, run.style), size)
    if len(lines) > most:
        lines = lines[:most]
        _add(lines[-1], TextRun(" …", "plain"))
    return lines


def _add(line: list[TextRun], run: TextRun) -> None:
    if line and line[-1].style == run.style:
        line[-1] = TextRun(line[-1].text + run.text, run.style)
    else:
        line.append(run)


def _parts(word: str, style: str, room: float, size: float) -> list[str]:
    """Return a word, or its pieces if it is longer than a line."""
    if run_width(TextRun(word.rstrip(), style), size) <= room:
        return [word]
    each = max(4, int(len(word) * room / run_width(TextRun(word, style), size)) - 1)
    return [word[at : at + each] for at in range(0, len(word), each)]
