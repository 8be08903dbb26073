"""The screen of `formiga replay`: keys move the moment, orders are off."""

import asyncio
from collections.abc import Awaitable, Callable

from msgspec.structs import replace

from formiga_bt.base.errors import UnusableFile
from formiga_bt.show.facts import Now
from formiga_bt.show.watch.background import here
from formiga_bt.show.watch.player import Player
from tests.golden import Wording
from tests.unit.show.watch.fake import AT, FakeActor, FakeSource, Room, S


class Moving(FakeSource):
    """A scripted source at a moment."""

    def __init__(self) -> None:
        super().__init__()
        self.plays, self.speed, self.at = False, 1.0, AT
        self.stepped: list[tuple[int, bool]] = []
        self.jumped: list[str] = []

    def go(self, at: int) -> None:
        self.at = at

    def play(self, elapsed_s: float) -> None:
        self.at += round(elapsed_s * self.speed * S)

    def faster(self, steps: int) -> None:
        self.speed *= 2.0**steps

    def step(self, direction: int, failure: bool) -> bool:
        self.stepped.append((direction, failure))
        return not failure

    def jump(self, words: str) -> None:
        if words == "noon":
            raise UnusableFile("'noon' is no moment")
        self.jumped.append(words)

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        return replace(super().now(first=first, count=count, find=find, over=over), engine="past", at=self.at)


def playing(test: Callable[[Room, Moving], Awaitable[None]]) -> None:
    source = Moving()
    rooms: list[Room] = []

    async def run() -> None:
        app = Player(
            source,
            source.step,
            source.jump,
            clock=lambda: rooms[0].clock_s if rooms else 100.0,
            away=here,
            every_s=None,
        )
        async with app.run_test(size=(120, 30)) as pilot:
            rooms.append(Room(source, FakeActor(), app, pilot))
            await pilot.pause()
            await rooms[0].poll(0.0)
            await test(rooms[0], source)

    asyncio.run(run())


def test_it_plays_only_when_it_is_told_to() -> None:
    async def look(room: Room, source: Moving) -> None:
        assert " PAST 1970-01-01" in f" {room.lines[0]}"
        assert "stands, x1" in room.lines[-1]
        await room.tick(5.0)
        assert source.at == AT
        await room.press("space")
        await room.tick(5.0)
        assert source.at == AT + 5 * S
        await room.press("+")
        assert "plays x2" in room.lines[-1]
        await room.press("space")
        at = source.at
        await room.tick(5.0)
        assert at == source.at

    playing(look)


def test_keys_step_and_say_when_there_is_nothing_more() -> None:
    async def look(room: Room, source: Moving) -> None:
        await room.press(".", ",", "]", "[", "[")
        assert source.stepped == [(1, False), (-1, False)]
        assert source.at == AT - 10 * S
        await room.press(">")
        assert source.stepped[-1] == (1, True)
        assert room.shows("there is no later failure")

    playing(look)


def test_a_moment_is_typed(wording: Wording) -> None:
    async def look(room: Room, source: Moving) -> None:
        await room.press("@", "n", "o", "o", "n")
        wording(room.lines[-1])
        await room.press("enter")
        assert room.shows("'noon' is no moment")
        await room.press("@", "8", ":", "1", "5", "x", "backspace", "enter")
        assert source.jumped == ["8:15"]
        await room.press("@", "escape", "q")
        assert source.jumped == ["8:15"]

    playing(look)


def test_its_help_tells_its_keys_first() -> None:
    async def look(room: Room, source: Moving) -> None:
        await room.press("?")
        assert room.text.index("Moving in time") < room.text.index("Looking")
        assert room.shows("> < the next failure, the one before")

    playing(look)


def test_no_key_orders() -> None:
    async def look(room: Room, source: Moving) -> None:
        await room.press("h")
        assert room.shows("read only: orders are off")
        assert room.sent == []

    playing(look)
