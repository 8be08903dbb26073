"""A grid of characters with colours, and the lines that it gives: what charts and maps in the terminal are drawn on."""

from collections.abc import Iterator
from typing import Final, Literal

from msgspec import Struct

Ink = Literal["", "bold", "dim", "red", "green", "yellow", "blue", "magenta", "cyan"]
_CODES: Final[dict[Ink, str]] = {
    "": "", "bold": "1", "dim": "2", "red": "31", "green": "32", "yellow": "33", "blue": "34", "magenta": "35",
    "cyan": "36",
}  # fmt: skip


class StyledLine(Struct, frozen=True):
    """One line: pieces, each in one ink."""

    pieces: tuple[tuple[str, Ink], ...]

    @classmethod
    def of(cls, text: str, ink: Ink = "") -> "StyledLine":
        """Return a line of one piece."""
        return cls(((text, ink),))

    @property
    def plain(self) -> str:
        """Return it without colours."""
        return "".join(text for text, _ in self.pieces).rstrip()

    @property
    def coloured(self) -> str:
        """Return it with the escape sequences of a terminal."""
        return "".join(f"\033[{_CODES[ink]}m{text}\033[0m" if ink else text for text, ink in self.pieces)


class Canvas:
    """Rows of cells. What is written outside is dropped.

    Args:
        width: columns.
        height: rows.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width = width
        self.height = height
        self._cells: dict[tuple[int, int], tuple[str, Ink]] = {}

    def write(self, row: int, column: int, text: str, ink: Ink = "") -> None:
        """Write a text to the right of a cell, over what is there."""
        if not 0 <= row < self.height:
            return
        for i, character in enumerate(text):
            if 0 <= column + i < self.width:
                self._cells[row, column + i] = character, ink

    def is_free(self, row: int, column: int, count: int, over: str = "") -> bool:
        """Return whether so many cells are inside, and empty or with a character of `over`."""
        inside = 0 <= row < self.height and column >= 0 and column + count <= self.width
        return inside and all(self._cells.get((row, column + i), (" ", ""))[0] in f" {over}" for i in range(count))

    def is_word(self, row: int, column: int) -> bool:
        """Return whether a letter or a digit is written there."""
        return self._cells.get((row, column), (" ", ""))[0].isalnum()

    def lines(self) -> Iterator[StyledLine]:
        """Yield the rows from the top."""
        for row in range(self.height):
            pieces: list[tuple[str, Ink]] = []
            last = max((column for r, column in self._cells if r == row), default=-1)
            for column in range(last + 1):
                character, ink = self._cells.get((row, column), (" ", ""))
                if pieces and pieces[-1][1] == ink:
                    pieces[-1] = pieces[-1][0] + character, ink
                else:
                    pieces.append((character, ink))
            yield StyledLine(tuple(pieces))
