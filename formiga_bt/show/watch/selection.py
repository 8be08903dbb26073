"""Which row is chosen: an id, never a place. Rows may come, go and change places; the choice follows its id.

When the chosen row is gone, nothing is chosen until the person presses a key that moves: no order can fall on the row that
took its place.
"""

from collections.abc import Sequence


class Selection:
    """The choice in one pane."""

    def __init__(self) -> None:
        self.id = ""
        """The chosen one, or empty."""
        self.gone = ""
        """The one that was chosen, and is no longer there."""
        self.index = 0
        """Where it is, or was."""
        self.ids: tuple[str, ...] = ()

    def see(self, ids: Sequence[str]) -> None:
        """Take the rows as they are now."""
        self.ids = tuple(ids)
        if not self.id:
            return
        if self.id in self.ids:
            self.index = self.ids.index(self.id)
        else:
            self.id, self.gone = "", self.id

    def choose(self, index: int) -> None:
        """Choose the row at a place, or the nearest; a person's key did that."""
        self.gone = ""
        if not self.ids:
            self.id, self.index = "", 0
            return
        self.index = max(0, min(index, len(self.ids) - 1))
        self.id = self.ids[self.index]

    def move(self, steps: int) -> None:
        """Choose the row so many further down; where nothing is chosen, the one at the place of the last choice."""
        self.choose(self.index + steps if self.id else self.index)
