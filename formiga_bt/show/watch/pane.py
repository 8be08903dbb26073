"""A pane: a title and rows, of which those in view are drawn, and only those lines again that changed."""

from collections.abc import Sequence

from rich.segment import Segment
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from formiga_bt.show.watch.palette import Palette
from formiga_bt.show.watch.selection import Selection
from formiga_bt.show.watch.text import Glyphs, Line, Rows, Tone, TonedText, line, width_of


class LinesPane(Widget):
    """Lines from the top, of which only the changed ones are drawn again. It decides nothing."""

    def __init__(self, palette: Palette, *, fill: Tone = "plain", name: str) -> None:
        super().__init__(id=name)
        self._palette = palette
        self._fill: Tone = fill
        self._shown: list[tuple[Line, bool]] = []

    def put(self, lines: Sequence[tuple[Line, bool]]) -> None:
        """Show these; the second says whether a line is of the chosen row."""
        before, self._shown = self._shown, list(lines)
        changed = [
            Region(0, y, self.size.width, 1)
            for y in range(max(len(before), len(self._shown)))
            if (before[y] if y < len(before) else None) != (self._shown[y] if y < len(self._shown) else None)
        ]
        if changed:
            self.refresh(*changed)

    def render_line(self, y: int) -> Strip:
        """Return a line, as the screen asks for it."""
        width = self.size.width
        if y >= len(self._shown):
            return Strip([Segment(" " * width)], width)
        pieces, chosen = self._shown[y]
        return Strip(self._palette.segments(pieces, width, chosen=chosen, fill=self._fill), width)


class Pane(LinesPane):
    """Rows that can be chosen from.

    Attributes:
        selection: which row is chosen.
        title: what stands above the rows.
        empty: what is said where there are no rows.
        is_log: the newest is on top; who looks at that goes on seeing what is newest.
    """

    def __init__(
        self, palette: Palette, glyphs: Glyphs, *, name: str, title: str, empty: str = "", is_log: bool = False
    ) -> None:
        super().__init__(palette, name=name)
        self.selection = Selection()
        self.title = title
        self.head = ""
        self.empty = empty
        self.is_log = is_log
        self.is_active = False
        self.rows = Rows.of(())
        self.first = 0
        """The row at the top, of those that are here."""
        self.base = 0
        """Number of the first row that is here, among `total`."""
        self.total = 0
        self.goto: int | None = None
        """Number of the row to choose as soon as it is here."""
        self._glyphs = glyphs

    def show(
        self,
        rows: Rows,
        *,
        title: str = "",
        head: str = "",
        base: int = 0,
        total: int | None = None,
        is_news: bool = True,
    ) -> None:
        """Take new rows; what is chosen stays chosen, and where it was on the screen if it was in view.

        Args:
            rows: the rows.
            title: what stands above them now.
            head: the heads of columns.
            base: number of the first row among `total`, where these are a page of more.
            total: so many there are in all.
            is_news: False: the same rows as before, laid out anew.
        """
        at_newest = self.is_log and self.selection.index == 0 and self.first == 0
        was_in_view = bool(self.selection.id) and self.first <= self.selection.index < self.first + self.page
        offset, top = self.selection.index - self.first, self.base + self.first
        if not self.selection.id:
            self.selection.index += self.base - base
        self.rows, self.base, self.total = rows, base, len(rows) if total is None else total
        self.title = title or self.title
        self.head = head
        self.selection.see(rows.ids)
        if at_newest:
            self.selection.choose(0)
        goes = is_news and self.goto is not None
        if is_news and self.goto is not None:
            place = min(self.goto, self.total - 1) - base
            if self.total and not 0 <= place < len(rows):
                goes = False  # this page was asked for before the key
            else:
                self.selection.choose(place)
                self.goto = None
        self.first = top - base
        if at_newest:
            self.first = 0
        elif was_in_view and self.selection.id:
            self.first = self.selection.index - offset
        self._settle()
        if (was_in_view or goes) and self.selection.id:
            self.into_view()
        else:
            self.draw()

    @property
    def page(self) -> int:
        """Return how many rows are in view, at least one."""
        room, count = self.room, 0
        for place in range(self.first, len(self.rows)):
            room -= len(self.rows[place].lines)
            if room < 0:
                break
            count += 1
        return max(1, count)

    @property
    def room(self) -> int:
        """Return the lines for rows."""
        return max(1, self.size.height - (2 if self.head else 1))

    def move(self, steps: int) -> None:
        """Choose another row; a person's key did that."""
        self.selection.move(steps)
        self.into_view()

    def choose(self, index: int) -> None:
        """Choose a row by its place among all; if it is not here, as soon as its page has come."""
        if 0 <= index - self.base < len(self.rows) or self.total <= len(self.rows):
            self.selection.choose(index - self.base)
            self.into_view()
        else:
            self.goto, self.selection.id, self.selection.gone = index, "", ""
            self.draw()

    def wanted(self) -> tuple[int, int]:
        """Return number and count of the rows to ask for: those in view, and as many before and behind."""
        room = self.room
        top = self.base + self.first
        if self.goto is not None:
            top = max(0, self.goto - room + 1) if self.goto > top else self.goto
        return max(0, top - room), 3 * room

    def lacks(self) -> bool:
        """Return whether rows that one more key could show are not here."""
        first, count = self.wanted()
        ends = min(self.total, first + count - self.room // 2)
        return self.goto is not None or first + self.room // 2 < self.base or ends > self.base + len(self.rows)

    def on_resize(self) -> None:
        """Fill the room that there is now."""
        self._settle()
        self.draw()

    def into_view(self) -> None:
        """Scroll as little as it takes to see the chosen row."""
        index = self.selection.index
        self.first = max(0, min(self.first, index))
        while self.first < index and index >= self.first + self.page:
            self.first += 1
        self.draw()

    def _settle(self) -> None:
        last, room = len(self.rows), self.room
        while last > 0 and room >= len(self.rows[last - 1].lines):
            room -= len(self.rows[last - 1].lines)
            last -= 1
        self.first = max(0, min(self.first, last))

    def draw(self) -> None:
        """Put the lines in view on the screen."""
        height = self.size.height
        if not height:
            return  # it is drawn as soon as there is room for it
        lines: list[tuple[Line, bool]] = [(self._title(), False)]
        if self.head:
            lines.append((line("  ", TonedText(self.head, "dim")), False))
        if not len(self.rows) and self.empty:
            lines.append((line("  ", TonedText(self.empty, "dim")), False))
        for place in range(self.first, len(self.rows)):
            if len(lines) >= height:
                break
            row = self.rows[place]
            chosen = row.id == self.selection.id
            for number, pieces in enumerate(row.lines):
                lead = f"{self._glyphs.pointer} " if chosen and number == 0 else "  "
                lines.append(((TonedText(lead, "bold"), *pieces), chosen and self.is_active))
        self.put(lines[:height])

    def _title(self) -> Line:
        seen = self.page if len(self.rows) else 0
        from_ = self.base + self.first
        more = f"  {from_ + 1}-{from_ + seen} of {self.total}" if self.total > seen else ""
        title = f" {self.title}{more} "
        rule = self._glyphs.rule * max(0, self.size.width - width_of(title) - 1)
        return line(TonedText(title, "calm_bar" if self.is_active else "title"), TonedText(rule, "dim"))
