"""A site under test: a scripted source, an actor that keeps what it was sent, and the watch on a screen without a terminal."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from msgspec.structs import replace
from textual import events
from textual.pilot import Pilot

from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.show.facts import (
    AgentFact,
    AlarmFact,
    Because,
    Box,
    Chart,
    Drawing,
    FileSpot,
    GoalFact,
    LineFact,
    Now,
    QuestionFact,
    Stats,
    StepFact,
    StyledSpan,
    TaskFact,
    TaskPicture,
    Timeline,
    Top,
)
from formiga_bt.show.watch.app import Dashboard
from formiga_bt.show.watch.background import here
from formiga_bt.show.watch.orders import WatchOrder, WatchReply

S = 1_000_000
NAMED = {"exclamation_mark": "!", "question_mark": "?", "slash": "/", "minus": "-"}
AT = 10_000 * S


def question(number: str = "Q7", **more: Any) -> QuestionFact:
    facts = {
        "task": "PickUp-3", "text": "Is the box loaded?", "options": ("loaded", "not_yet"), "asked": ("eve",),
        "here": ("eve",), "asked_at": AT - 41 * S, "lapses_at": AT + 259 * S, "if_no_answer": "the task fails",
    }  # fmt: skip
    return QuestionFact(number=number, **{**facts, **more})


def task(number: int, **more: Any) -> TaskFact:
    facts = {"name": "PickUp", "status": "ACTIVE", "doing": f"hwd_{number} flies to camp", "agents": (f"hwd_{number}",)}
    return TaskFact(id=f"PickUp-{number}", **{**facts, **more})


def alarm(number: int, text: str, **more: Any) -> AlarmFact:
    """Return an alarm that was raised half a minute ago."""
    given = {"code": "lost", "severity": "alarm", "state": "raised", "raised_at": AT - 30 * S, "at": AT, **more}
    return AlarmFact(id=f"A{number}", text=text, **given)


def agent(name: str, **more: Any) -> AgentFact:
    facts = {
        "type": "hwd",
        "pool": "ASSIGNED",
        "liveness": "ALIVE",
        "control": "engine",
        "landed": "airborne",
        "battery": 71.0,
    }
    return AgentFact(id=name, **{**facts, **more})


class FakeSource:
    """Answers from what a test put into it; tasks are handed out in the order in which they are."""

    def __init__(self) -> None:
        self.at = AT
        self.top = Top()
        self.tasks: list[TaskFact] = [task(1), task(2), task(3)]
        self.agents: list[AgentFact] = [agent("hwd_1", task="PickUp-1"), agent("hwd_2", task="PickUp-2")]
        self.questions: list[QuestionFact] = []
        self.lines: list[LineFact] = []
        self.alarms: list[AlarmFact] = []
        self.steps: tuple[StepFact, ...] = ()
        self.goals: tuple[GoalFact, ...] = ()
        self.counts: dict[str, int] = {}
        self.speed = 1.0
        self.gone = ""
        """Why it does not answer."""
        self.asked: list[tuple[int, int, str, bool]] = []

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        if self.gone:
            raise FormigaError(self.gone)
        self.asked.append((first, count, find, over))
        fit = [t for t in self.tasks if find in t.id and (over or not t.is_over)]
        return Now(
            site="meadow", at=self.at, top=self.top, counts=self.counts, speed=self.speed,
            tasks=tuple(fit[first : first + count]), total=len(fit),
            waiting=sum(t.status == "PENDING" and not t.needs for t in fit),
            agents=tuple(self.agents), questions=tuple(self.questions), lines=tuple(self.lines),
            alarms=tuple(self.alarms),
        )  # fmt: skip

    def task(self, task_id: str) -> TaskPicture:
        found = next((t for t in self.tasks if t.id == task_id), None)
        if found is None:
            raise TaskError("unknown_task", f"there is no task '{task_id}' (any more)")
        return TaskPicture(
            at=self.at, task=found, drawing=DRAWING, steps=self.steps, goals=self.goals, lines=tuple(self.lines),
            values={"": {"target": "camp", "height": "60 m"}, "each[0]": {"spot": "A"}},
            questions=tuple(q for q in self.questions if q.task == task_id),
            agents=tuple(a for a in self.agents if a.task == task_id),
        )  # fmt: skip

    def why(self, of: str) -> tuple[str, list[Because]]:
        return f"{of} ACTIVE", [Because("gated", "hwd_1.GoTo waits: the way is taken", "formiga why hwd_1")]

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        raise NotImplementedError

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        raise NotImplementedError

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        raise NotImplementedError


def step(path: str, text: str, row: int, *children: Box) -> Box:
    return Box(
        path=path,
        kind="do",
        label=(StyledSpan(text, "agent"),),
        spot=FileSpot("pick_up.yaml", row, 3),
        children=children,
    )


DRAWING = Drawing(
    task="PickUp",
    spot=FileSpot("pick_up.yaml", 2, 1),
    sections=(
        Box(
            path="steps/", kind="section", label=(StyledSpan("steps", "title"),),
            children=(step("steps/steps[0]", "drone.TakeOff", 5), step("steps/steps[1]", "drone.GoTo", 7)),
        ),
    ),
)  # fmt: skip


class FakeActor:
    """Keeps what it was sent; says what the test wants."""

    def __init__(self) -> None:
        self.sent: list[WatchOrder] = []
        self.reply = WatchReply("done")
        self.error: Exception | None = None

    def send(self, order: WatchOrder) -> WatchReply:
        self.sent.append(order)
        if self.error is not None:
            raise self.error
        return self.reply


class Room:
    """A watch under test."""

    def __init__(self, source: FakeSource, actor: FakeActor, app: Dashboard, pilot: Pilot[None]) -> None:
        self.source, self.actor, self.app, self._pilot = source, actor, app, pilot
        self.clock_s = 100.0

    async def press(self, *keys: str) -> None:
        driver = self.app._driver
        assert driver is not None
        for key in keys:
            driver.send_message(events.Key(key, NAMED.get(key, key if len(key) == 1 else None)))
            await self._pilot._wait_for_screen()
        await self._pilot.pause()

    async def poll(self, after_s: float = 5.0) -> None:
        """Let so much time go by, and look again."""
        self.clock_s += after_s
        await self.app.poll()
        await self._pilot._wait_for_screen()
        await self._pilot.pause()

    async def tick(self, after_s: float) -> None:
        self.clock_s += after_s
        self.app.tick()
        await self._pilot.pause()

    async def resize(self, width: int, height: int) -> None:
        await self._pilot.resize_terminal(width, height)
        await self._pilot.pause()
        await self.poll(0.0)

    @property
    def lines(self) -> list[str]:
        """What is on the screen."""
        return [strip.text.rstrip() for strip in self.app.screen._compositor.render_strips()]

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    @property
    def styled(self) -> list[Any]:
        return [segment for strip in self.app.screen._compositor.render_strips() for segment in strip]

    def shows(self, text: str) -> bool:
        return text in " ".join(self.text.split())

    @property
    def said(self) -> str:
        """What is asked or was said, below the view."""
        region = self.app.screen.query_one("#reply").region
        return "\n".join(self.lines[region.y : region.bottom])

    @property
    def sent(self) -> list[str]:
        return [order.words for order in self.actor.sent]


def watching(
    test: Callable[[Room], Awaitable[None]],
    source: FakeSource | None = None,
    *,
    size: tuple[int, int] = (100, 30),
    read_only: bool = False,
    **options: Any,
) -> Room:
    """Run a test with a watch whose time stands still unless the test moves it."""
    source, actor = source or FakeSource(), FakeActor()
    rooms: list[Room] = []

    async def run() -> None:
        app = Dashboard(
            source, None if read_only else actor, clock=lambda: rooms[0].clock_s if rooms else 100.0, away=here,
            every_s=None, **options,
        )  # fmt: skip
        async with app.run_test(size=size) as pilot:
            rooms.append(Room(source, actor, app, pilot))
            await pilot.pause()
            await app.poll()
            await rooms[0].poll(5.0)
            await test(rooms[0])

    asyncio.run(run())
    return rooms[0]


def many(count: int) -> list[TaskFact]:
    return [task(n, urgent_at=AT + n * S, urgent="timeout") for n in range(1, count + 1)]


__all__ = ["AT", "FakeActor", "FakeSource", "Room", "S", "agent", "many", "question", "replace", "task", "watching"]
