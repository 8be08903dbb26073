"""The screen of `formiga watch`: asks the source once a second, shows what changed, and turns keys into looks and orders.

All waiting is in `background`; the clock comes in as an argument. Keys are read here and nowhere else, so that an order's
target is fixed before anything else can happen.
"""

import asyncio
from collections.abc import Callable
from typing import ClassVar, Final

from msgspec import MsgspecError
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType

from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.show.facts import Because, Now, TaskFact, TaskPicture
from formiga_bt.show.source import Source
from formiga_bt.show.watch.aim import Aim, order_of
from formiga_bt.show.watch.background import Away, in_a_thread
from formiga_bt.show.watch.board import Board
from formiga_bt.show.watch.closeup import Closeup
from formiga_bt.show.watch.frame import DashboardFrame
from formiga_bt.show.watch.guards import TWICE_S
from formiga_bt.show.watch.keys import help_lines
from formiga_bt.show.watch.ordering import READ_ONLY, Ordering
from formiga_bt.show.watch.orders import Actor, WatchOrder
from formiga_bt.show.watch.palette import Palette
from formiga_bt.show.watch.pane import Pane
from formiga_bt.show.watch.picture import why_rows
from formiga_bt.show.watch.text import ASCII, FULL, PaneRow, Rows, line
from formiga_bt.show.watch.top import Link

CALM_S, BUSY_S = 1.0, 0.5
"""Seconds between two looks, and after a key."""
BUSY_FOR_S: Final = 5.0
LATE_S: Final = 3.0
"""An engine that has not answered for so long is told as gone."""
URGENT: Final = 100
"""So many tasks are looked at for what needs a person while the person looks at others."""
STEPS: Final = {"up": -1, "k": -1, "down": 1, "j": 1}

CSS = """
Screen, Container, Lines, Pane { background: ansi_default; color: ansi_default; }
#top { height: 1; }
#board, #closeup, #help, #explain { height: 1fr; }
#needs { height: 2; }
#main, #close_main { height: 1fr; }
#tasks { height: 3fr; width: 1fr; }
#side { height: 2fr; width: 1fr; }
#agents, #tree, #why, #goals, #crew, #values, #story { height: 1fr; width: 1fr; }
#events { height: 1fr; width: 1fr; }
#close_left { width: 3fr; height: 1fr; }
#close_right { width: 2fr; height: 1fr; }
#head { height: 1; }
#reply { height: 0; }
#foot { height: 1; }
"""


class Dashboard(App[None]):
    """The dashboard.

    Args:
        source: what is shown.
        actor: carries orders; None: read only.
        task: begin with this task.
        clock: seconds, never going back.
        ascii_only, colour: what the terminal can show.
        away: makes calls that may take long.
        every_s: seconds between two looks; None: only when `poll` is called.
    """

    CSS = CSS
    ENABLE_COMMAND_PALETTE = False
    KEYS: ClassVar[tuple[str, ...]] = ()  # of a screen made of this one: lines of its help, shown first
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+c,ctrl+q", "leave", priority=True, show=False),
        Binding("tab", "next(1)", priority=True, show=False),
        Binding("shift+tab", "next(-1)", priority=True, show=False),
    ]

    def __init__(
        self,
        source: Source,
        actor: Actor | None,
        *,
        clock: Callable[[], float],
        task: str = "",
        ascii_only: bool = False,
        colour: bool = True,
        away: Away = in_a_thread,
        every_s: float | None = CALM_S,
    ) -> None:
        super().__init__(ansi_color=True)
        self._source, self._clock, self._away, self._every_s = source, clock, away, every_s
        palette = Palette(colour=colour, ascii_only=ascii_only)
        glyphs = ASCII if ascii_only else FULL
        self._answered_s = self._touched_s = clock()
        self._failed = ""
        self.now: Now | None = None
        self.task_id = task
        """The one that is looked at closely, or empty."""
        self.view = "task" if task else "site"
        """site, task, help or explain."""
        self._before: list[tuple[str, str]] = []
        self._find, self._typing, self._over = "", False, False
        self._explained = ""
        self._page = (0, 0)
        self._urgent: tuple[TaskFact, ...] = ()
        self._soon = asyncio.Event()
        self.ordering = Ordering(actor, away)
        self.frame = DashboardFrame(palette, self.ordering)
        self.board = Board(palette, glyphs)
        self.closeup = Closeup(palette, glyphs, ascii_only=ascii_only)
        self.help = Pane(palette, glyphs, name="help", title="HELP  (Esc: back)")
        self.explain = Pane(palette, glyphs, name="explain", title="WHY", empty="asking ...")

    # -- the screen ------------------------------------------------------------------------------------------------
    def compose(self) -> ComposeResult:
        """Lay out what is always there: the top line, one view, what was said, the keys."""
        yield from self.frame.around(self.board, self.closeup, self.help, self.explain)

    def on_mount(self) -> None:
        """Begin to look."""
        rows = [
            PaneRow(str(n), (line(text),)) for n, text in enumerate([*self.KEYS, *help_lines(self.ordering.is_off)])
        ]
        self.help.show(Rows.of(rows))
        self._show_view()
        if self._every_s is not None:
            self.run_worker(self._look(self._every_s), exclusive=False)

    async def on_resize(self) -> None:
        """Take the new size."""
        self.call_after_refresh(self.redraw)

    def _show_view(self) -> None:
        for name, widget in (
            ("site", self.board), ("task", self.closeup), ("help", self.help), ("explain", self.explain),
        ):  # fmt: skip
            widget.display = self.view == name
        if self.view in ("help", "explain"):
            self.pane.is_active = True
        self.call_after_refresh(self.redraw)

    def redraw(self) -> None:
        """Show what is known, in the size of now."""
        if self.now is not None:
            self.board.fill(self.now, self._urgent, base=self._page[0], find=self._find, over=self._over, is_news=False)
        if self.view == "task" and self.closeup.picture is not None:
            self.closeup.fill(self.closeup.picture)
        if self.view in ("help", "explain"):
            self.pane.draw()
        self.tick()

    def tick(self) -> None:
        """Show what the clock alone changes: how old things are, what lapses."""
        at_s = self._clock()
        self.ordering.lapse(at_s)
        selection = self.pane.selection
        gone = selection.gone if self.view == "site" and selection.ids else ""
        find = self._find if self._typing else None
        self.frame.show(self.now, self.link, (self.size.width, self.size.height), find=find, gone=gone)

    @property
    def link(self) -> Link:
        """Return whether the engine answers."""
        age = self._clock() - self._answered_s
        return Link(age, self._failed) if self._failed or age > LATE_S else Link()

    @property
    def pane(self) -> Pane:
        """Return the pane that keys go to."""
        return {"site": self.board.active, "task": self.closeup.active, "help": self.help}.get(self.view, self.explain)

    # -- looking ---------------------------------------------------------------------------------------------------
    async def _look(self, every_s: float) -> None:
        self.set_interval(BUSY_S, self.tick)
        while True:
            await self.poll()
            busy = self._clock() - self._touched_s < BUSY_FOR_S
            try:
                await asyncio.wait_for(self._soon.wait(), min(BUSY_S, every_s) if busy else every_s)
            except TimeoutError:
                continue
            self._soon.clear()

    async def poll(self) -> None:
        """Ask the source for what is in view, and show it."""
        first, count = self.board.tasks.wanted()
        find, over, view, task = self._find, self._over, self.view, self.task_id
        why = self._explained if view == "explain" else task if self.closeup.active is self.closeup.why else ""
        source = self._source

        def ask() -> tuple[Now, Now, TaskPicture | None, tuple[str, list[Because]] | None]:
            now = source.now(first=first, count=count, find=find, over=over)
            front = source.now(count=URGENT) if first or find else now
            return now, front, source.task(task) if view == "task" else None, source.why(why) if why else None

        try:
            now, front, picture, because = await self._away(ask)
        except TaskError as error:
            self._answered_s, self._failed = self._clock(), ""
            self.ordering.say(str(error), "alarm", self._clock())
            self._back()
        except (FormigaError, OSError, MsgspecError) as error:
            self._failed = str(error) or type(error).__name__
        else:
            self._answered_s, self._failed = self._clock(), ""
            self._page = first, count
            self.now, self._urgent = now, front.tasks
            self.ordering.see(now, self._clock())
            is_news = (find, over) == (self._find, self._over)  # else it was asked for before the last key
            self.board.fill(now, self._urgent, base=first, find=find, over=over, is_news=is_news)
            if picture is not None and self.view == "task" and picture.task.id == self.task_id:
                self.closeup.fill(picture)
            if because is not None and view == self.view:
                self.closeup.explain(because) if view == "task" else self._show_why(because)
        self.tick()

    def _show_why(self, because: tuple[str, list[Because]]) -> None:
        self.explain.show(Rows.of(why_rows(because, self.size.width - 2)), title=f"WHY {self._explained}  (Esc: back)")

    # -- keys ------------------------------------------------------------------------------------------------------
    def action_leave(self) -> None:
        """End the watch; the engine goes on."""
        self.exit()

    async def action_next(self, steps: int) -> None:
        """Go to another pane of this view."""
        if self.ordering.gate.is_open:
            await self._key("tab", "")
        elif self.view in ("site", "task"):
            place = self.board if self.view == "site" else self.closeup
            panes = place.panes
            self._go(panes[(panes.index(self.pane) + steps) % len(panes)])

    async def on_key(self, event: events.Key) -> None:
        """Take a key."""
        event.stop()
        event.prevent_default()
        character = event.character or ""
        await self._key(event.key, character if character.isprintable() else "")

    async def _key(self, key: str, character: str) -> None:
        at_s = self._touched_s = self._clock()
        if self.ordering.gate.is_open:
            order = self.ordering.press(key, character, at_s)
            if order is not None:
                self._send(order)
        elif self._typing:
            self._type(key, character)
        elif not self._looks(key, character):
            self._orders(character, at_s)
        self.tick()

    def _type(self, key: str, character: str) -> None:
        if key in ("enter", "escape"):
            self._typing = False
            self._find = self._find if key == "enter" else ""
        elif key == "backspace":
            self._find = self._find[:-1]
        else:
            self._find += character
        self.board.tasks.goto = 0
        self._soon.set()

    def _looks(self, key: str, character: str) -> bool:
        """Take a key that only looks; return whether it was one."""
        pane, view = self.pane, self.view
        page = max(1, pane.page - 1)
        steps = {**STEPS, "pageup": -page, "pagedown": page}
        if key in steps:
            pane.move(steps[key])
            self._moved(pane)
        elif key in ("home", "end", "g", "G"):
            pane.choose(0 if key in ("home", "g") else max(0, pane.total - 1))
            self._moved(pane)
        elif key == "escape":
            if not self.ordering.forget():
                self._back()
        elif character == "q":
            self.exit()
        elif character == "?":
            self._to("help")
        elif key == "enter" and view == "site":
            self._enter()
        elif character == "w":
            self._why()
        elif character == "/":
            self._before, self.view, self._typing = [], "site", True
            self._show_view()
            self._go(self.board.tasks)
        elif character == "o" and view == "site":
            self._over = not self._over
            self._soon.set()
        elif character == "p" and view == "site":
            self.board.all_waiting = not self.board.all_waiting
            self.board.tasks.goto = 0
            self.redraw()
            self._soon.set()
        elif character in ("n", "t", "a", "v") and character:
            self._shortcut(character)
        else:
            return False
        return True

    def _shortcut(self, character: str) -> None:
        if self.view == "task" and character in ("a", "v", "t"):
            self._go({"a": self.closeup.crew, "v": self.closeup.story, "t": self.closeup.steps}[character])
            return
        if self.view != "site":
            self._before, self.view = [], "site"
            self._show_view()
        board = self.board
        if character == "n":
            board.needs.choose(0)
        self._go({"n": board.needs, "t": board.tasks, "a": board.agents, "v": board.events}[character])

    def _go(self, pane: Pane) -> None:
        (self.closeup if self.view == "task" else self.board).activate(pane)
        if not pane.selection.id:
            pane.move(0)
        if self.view == "task" and pane is not self.closeup.steps:
            self.closeup.touched()
        self.call_after_refresh(self.redraw)
        self._soon.set()

    def _moved(self, pane: Pane) -> None:
        if self.view == "task":
            self.closeup.touched()
        if pane is self.board.tasks and pane.lacks():
            self._soon.set()

    def _enter(self) -> None:
        task = self.aim.task(self.now) if self.now is not None else ""
        if task:
            self._to("task", task)
            self.closeup.open()
        elif self.board.active is self.board.agents:
            self._why()

    def _why(self) -> None:
        if self.view == "task":
            self._go(self.closeup.why if self.closeup.active is not self.closeup.why else self.closeup.steps)
        elif self.view == "site" and self.now is not None:
            target = self.aim.target(self.now)[1]
            if target:
                self._explained = target
                self.explain.show(Rows.of(()), title=f"WHY {target}  (Esc: back)")
                self._to("explain")

    def _to(self, view: str, task: str = "") -> None:
        if view != self.view:
            self._before.append((self.view, self.task_id))
            self.view, self.task_id = view, task or self.task_id
            self._show_view()
            self._soon.set()

    def _back(self) -> None:
        if self._before:
            self.view, self.task_id = self._before.pop()
        elif self.view != "site":
            self.view = "site"
        elif self._find:
            self._find = ""
            self.board.tasks.goto = 0
        self._show_view()
        self._soon.set()

    # -- orders ----------------------------------------------------------------------------------------------------
    @property
    def aim(self) -> Aim:
        """Return what is chosen now."""
        selection, board = self.pane.selection, self.board
        if self.view == "task":
            if self.pane is self.closeup.crew:
                return Aim("agent", selection.id, selection.gone)
            return Aim("task", self.task_id)
        if self.view == "explain":
            is_agent = self.now is not None and any(agent.id == self._explained for agent in self.now.agents)
            return Aim("agent" if is_agent else "task", self._explained)
        if self.view == "site" and self.pane in (board.tasks, board.agents):
            return Aim("task" if self.pane is board.tasks else "agent", selection.id, selection.gone)
        return Aim("need" if self.pane is board.needs else "nothing", selection.id, selection.gone)

    def _orders(self, character: str, at_s: float) -> None:
        """Take a key that orders."""
        if self.now is None:
            return
        order = order_of(character, self.aim, self.now)
        if isinstance(order, str):
            if order:
                self.ordering.say(READ_ONLY if self.ordering.is_off else order, "warn", at_s)
            return
        ready = self.ordering.ask(order, self.now, at_s)
        if self.ordering.gate.is_open and self.ordering.gate.guard.kind == "twice":
            self.set_timer(TWICE_S + 0.1, self.tick)
        if ready is not None:
            self._send(ready)

    def _send(self, order: WatchOrder) -> None:
        async def work() -> None:
            await self.ordering.send(order, self._clock())
            self.tick()
            self._soon.set()

        self.run_worker(work(), exclusive=False)
