"""What stands around every view: the top line above, below what is asked or was said, and the keys."""

from textual.app import ComposeResult
from textual.widget import Widget

from formiga_bt.show.facts import Now
from formiga_bt.show.watch.needs import name_of
from formiga_bt.show.watch.ordering import Ordering
from formiga_bt.show.watch.palette import Palette
from formiga_bt.show.watch.pane import LinesPane
from formiga_bt.show.watch.text import Line, TonedText, clean, line, wrap
from formiga_bt.show.watch.top import Link, about, resource_line, top_lines


class DashboardFrame:
    """The top line, the reply and the keys.

    Args:
        palette: what tones look like.
        ordering: what is asked and was said.
    """

    def __init__(self, palette: Palette, ordering: Ordering) -> None:
        self.top = LinesPane(palette, fill="calm_bar", name="top")
        self.reply = LinesPane(palette, name="reply")
        self.foot = LinesPane(palette, name="foot")
        self._ordering = ordering

    def around(self, *views: Widget) -> ComposeResult:
        """Lay it out around the views."""
        yield self.top
        yield from views
        yield self.reply
        yield self.foot

    def show(self, now: Now | None, link: Link, size: tuple[int, int], *, find: str | None, gone: str) -> None:
        """Show how the whole stands.

        Args:
            now: what is known.
            link: whether the engine answers.
            size: of the screen.
            find: what is typed to be found; None: nothing is typed.
            gone: a row that was chosen, and is no longer there.
        """
        width, height = size
        lines = top_lines(now, link, width, about(now) if now is not None else "")
        held = resource_line(now, width)
        _put(self.top, [*lines, held] if held is not None else lines)
        _put(self.reply, self._said(width)[: max(3, height // 3)])
        _put(self.foot, [self._keys(link, find, gone)])

    def _said(self, width: int) -> list[Line]:
        shown, tone = self._ordering.shown
        told: list[Line] = []
        for text in shown:
            indent = " " * (len(text) - len(text.lstrip()))
            told += [line(TonedText(f" {indent}{part}", tone)) for part in wrap(text, max(10, width - 2 - len(indent)))]
        return told

    def _keys(self, link: Link, find: str | None, gone: str) -> Line:
        if find is not None:
            return line(TonedText(f" find: {find}_   Enter: done   Esc: all ", "calm_bar"))
        if link.lost_s is not None and link.why:
            return line(TonedText(f" {clean(link.why.splitlines()[0])}; trying again ", "warn_bar"))
        is_off = self._ordering.is_off
        looks, orders = "n:needs t:tasks a:agents v:events Enter:into w:why /:find q:quit", "h:hold r:return l:land"
        keys = f"?:help  {looks}" if is_off else f"?:help  {orders} A:abort x:cut !:lockdown  {looks}"
        if gone:
            return line(
                TonedText(f" {clean(name_of(gone))} is no longer here; choose again ", "warn_bar"),
                TonedText(f"  {keys}", "dim"),
            )
        return line(TonedText(f" {keys}" + ("  READ ONLY" if is_off else ""), "dim"))


def _put(widget: LinesPane, lines: list[Line]) -> None:
    if widget.styles.height is None or widget.styles.height.value != len(lines):
        widget.styles.height = len(lines)
    widget.put([(one, False) for one in lines])
