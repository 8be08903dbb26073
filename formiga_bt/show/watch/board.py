"""The whole site on the screen: what needs you, tasks, agents, events; as many panes as there is room for."""

from collections.abc import Sequence
from typing import Final

from textual.app import ComposeResult
from textual.containers import Container

from formiga_bt.show.facts import Now, TaskFact
from formiga_bt.show.watch.needs import needs
from formiga_bt.show.watch.palette import Palette
from formiga_bt.show.watch.pane import Pane
from formiga_bt.show.watch.tables import agent_rows, agents_head, line_rows, task_rows, tasks_head
from formiga_bt.show.watch.text import Glyphs

BESIDE: Final = 150
"""Columns from which agents and events stand beside the tasks."""
WITH_AGENTS, WITH_EVENTS = 22, 36
"""Lines from which agents, and events, stand below them."""
GUTTER: Final = 2
MANY: Final = 8
"""From so many waiting tasks on only the next few are shown, until a person asks for all."""
NEXT: Final = 5
LEAST: Final = 6
"""Lines that tasks have at least; what they do not need, agents and events get."""
"""Columns of the pointer."""


class Board(Container):
    """The panes of the site.

    Attributes:
        active: the pane that keys go to.
        all_waiting: all tasks that wait for agents are shown, however many.
    """

    def __init__(self, palette: Palette, glyphs: Glyphs) -> None:
        super().__init__(id="board")
        self._glyphs = glyphs
        self.needs = Pane(palette, glyphs, name="needs", title="NEEDS YOU", empty="nothing needs you")
        self.tasks = Pane(palette, glyphs, name="tasks", title="TASKS", empty="no tasks")
        self.agents = Pane(palette, glyphs, name="agents", title="AGENTS", empty="no agents")
        self.events = Pane(
            palette, glyphs, name="events", title="EVENTS", empty="nothing has happened yet", is_log=True
        )
        self.panes = (self.needs, self.tasks, self.agents, self.events)
        self.active = self.tasks
        self.all_waiting = False
        self._main = Container(id="main")
        self._side = Container(id="side")
        self._shown_once = False

    def compose(self) -> ComposeResult:
        """Lay the panes out."""
        yield self.needs
        with self._main:
            yield self.tasks
            with self._side:
                yield self.agents
                yield self.events

    def activate(self, pane: Pane) -> None:
        """Let keys go to a pane."""
        self.active = pane
        self.lay_out()
        for one in self.panes:
            one.is_active = one is pane
            one.draw()

    def lay_out(self) -> None:
        """Show as many panes as there is room for; the active one is always there."""
        width, height = self.app.size
        beside = width >= BESIDE
        below = self.active if self.active is not self.needs else self.tasks
        self._main.styles.layout = "horizontal" if beside else "vertical"
        self.tasks.styles.width = "3fr" if beside else "1fr"
        self._side.styles.width = "2fr" if beside else "1fr"
        self._side.styles.height = "1fr" if beside else "2fr"
        several = beside or height >= WITH_AGENTS
        self.tasks.display = several or below is self.tasks
        self.agents.display = several if below is not self.events or beside or height >= WITH_EVENTS else False
        self.agents.display = self.agents.display or below is self.agents
        self.events.display = beside or height >= WITH_EVENTS or below is self.events
        self._side.display = self.agents.display or self.events.display
        room, need = self._main.size.height, 3 + self.tasks.total
        few = not beside and self._side.display and 0 < need < room * 3 // 5
        self.tasks.styles.height = max(LEAST, need) if few else "3fr"

    def fill(
        self, now: Now, urgent: Sequence[TaskFact], *, base: int, find: str, over: bool, is_news: bool = True
    ) -> None:
        """Show a site; `urgent` are the most urgent of all tasks, also when `now` has another page of them."""
        self.lay_out()
        height = self.app.size.height
        width = (self.needs.size.width or self.app.size.width) - GUTTER
        found = needs(now, urgent, width, self._glyphs)
        most, lines = max(4, (height - 4) // 2), 0
        for place in range(min(len(found), most)):
            lines += len(found[place].lines)
        self.needs.styles.height = 1 + max(1, min(lines, most))
        self.needs.show(found)
        width = (self.tasks.size.width or self.app.size.width) - GUTTER
        title = "TASKS" + (" and ended ones" if over else "") + (f" with '{find}'" if find else "")
        failed = now.counts.get("FAILED", 0)
        if failed and not over and not find:
            title += f"  {failed} FAILED (o: ended ones)"
        shown, total = now.tasks, now.total
        if now.waiting >= MANY and not (find or over or self.all_waiting):
            total -= now.waiting - NEXT
            shown = shown[: max(0, total - base)]
            title += f"  {now.waiting - NEXT} more wait (p: all)"
        rows = task_rows(shown, now.at, width, self._glyphs)
        self.tasks.empty = f"no task has '{find}'; Esc shows all" if find else "no tasks"
        self.tasks.show(rows, title=title, head=tasks_head(width, shown), base=base, total=total, is_news=is_news)
        width = (self.agents.size.width or self.app.size.width) - GUTTER
        self.agents.show(agent_rows(now.agents, width, self._glyphs), head=agents_head(width, now.agents))
        width = (self.events.size.width or self.app.size.width) - GUTTER
        self.events.show(line_rows(now.lines, now.at, width))
        if not self._shown_once:
            self._shown_once = True
            for pane in self.panes:
                pane.choose(0)
            self.activate(self.active)
