"""One task on the screen: its live tree, and what belongs to it; on a narrow screen one of them at a time."""

from typing import Final

from textual.app import ComposeResult
from textual.containers import Container

from formiga_bt.show.facts import Because, TaskPicture
from formiga_bt.show.watch.palette import Palette
from formiga_bt.show.watch.pane import LinesPane, Pane
from formiga_bt.show.watch.picture import goal_rows, head_lines, running_row, tree_rows, value_rows, why_rows
from formiga_bt.show.watch.tables import agent_rows, agents_head, line_rows
from formiga_bt.show.watch.text import Glyphs, Rows

BESIDE: Final = 120
GUTTER: Final = 2


class Closeup(Container):
    """The panes of one task."""

    def __init__(self, palette: Palette, glyphs: Glyphs, *, ascii_only: bool) -> None:
        super().__init__(id="closeup")
        self._glyphs, self._ascii = glyphs, ascii_only
        self.head = LinesPane(palette, name="head")
        self.steps = Pane(palette, glyphs, name="tree", title="TREE")
        self.why = Pane(palette, glyphs, name="why", title="WHY", empty="asking ...")
        self.goals = Pane(palette, glyphs, name="goals", title="GOALS", empty="no goal is in flight")
        self.crew = Pane(palette, glyphs, name="crew", title="ITS AGENTS", empty="it has no agents")
        self.values = Pane(palette, glyphs, name="values", title="VALUES", empty="no values")
        self.story = Pane(
            palette, glyphs, name="story", title="ITS EVENTS", empty="nothing has happened yet", is_log=True
        )
        self.panes = (self.steps, self.goals, self.crew, self.values, self.story, self.why)
        self.active = self.steps
        self._main = Container(id="close_main")
        self._left = Container(id="close_left")
        self._right = Container(id="close_right")
        self._follows = True
        self.picture: TaskPicture | None = None

    def compose(self) -> ComposeResult:
        """Lay the panes out."""
        yield self.head
        with self._main:
            with self._left:
                yield self.steps
                yield self.why
            with self._right:
                yield self.goals
                yield self.crew
                yield self.values
                yield self.story

    def open(self) -> None:
        """Begin with another task."""
        self.picture, self._follows = None, True
        for pane in self.panes:
            pane.show(Rows.of(()))
            pane.first = 0
        self.activate(self.steps)

    def activate(self, pane: Pane) -> None:
        """Let keys go to a pane."""
        self.active = pane
        self.lay_out()
        for one in self.panes:
            one.is_active = one is pane
            one.draw()

    def lay_out(self) -> None:
        """Show as many panes as there is room for; the active one is always there."""
        beside = self.app.size.width >= BESIDE
        is_left = self.active in (self.steps, self.why)
        self._main.styles.layout = "horizontal" if beside else "vertical"
        self._left.styles.width = "3fr" if beside else "1fr"
        self._right.styles.width = "2fr" if beside else "1fr"
        self._left.display = beside or is_left
        self._right.display = beside or not is_left
        self.why.display = self.active is self.why
        self.steps.display = not self.why.display
        for pane in (self.goals, self.crew, self.values, self.story):
            pane.display = beside or pane is self.active

    def touched(self) -> None:
        """Stop following what runs: the person moves by themselves."""
        self._follows = False

    def fill(self, picture: TaskPicture) -> None:
        """Show a task."""
        self.picture = picture
        self.lay_out()
        width = self.app.size.width
        head = head_lines(picture, width, self._glyphs)[: max(3, self.app.size.height // 2)]
        self.head.styles.height = len(head)
        self.head.put([(one, False) for one in head])
        rows = tree_rows(picture, self._width(self.steps), ascii_only=self._ascii)
        self.steps.show(Rows.of(rows))
        if self._follows:
            self.steps.choose(running_row(rows, picture))
        self.goals.show(Rows.of(goal_rows(picture, self._glyphs)))
        width = self._width(self.crew)
        self.crew.show(agent_rows(picture.agents, width, self._glyphs), head=agents_head(width, picture.agents))
        self.values.show(Rows.of(value_rows(picture, self._width(self.values), self._glyphs)))
        self.story.show(line_rows(picture.lines, picture.at, self._width(self.story)))

    def explain(self, found: tuple[str, list[Because]]) -> None:
        """Show why the task stands as it does."""
        self.why.show(Rows.of(why_rows(found, self._width(self.why))))

    def _width(self, pane: Pane) -> int:
        return max(20, (pane.size.width or self.app.size.width) - GUTTER)
