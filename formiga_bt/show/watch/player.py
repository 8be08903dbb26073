"""The screen of `formiga replay`: the watch over a moment of the past, with keys that move it."""

from collections.abc import Callable
from typing import Any, ClassVar, Final, Protocol

from formiga_bt.base.errors import FormigaError
from formiga_bt.show.source import Source
from formiga_bt.show.watch.app import Dashboard
from formiga_bt.show.watch.text import TonedText, line
from formiga_bt.show.watch.top import clock as written

HELP: Final = "space:play  . ,:event  > <:failure  + -:speed  @:jump  [ ]:10 s  ?:keys  q:quit"


class Moving(Source, Protocol):
    """A source at a moment that moves (`replay.cursor.Cursor`)."""

    plays: bool
    speed: float

    @property
    def at(self) -> int:
        """Return the moment, microseconds."""
        ...

    def go(self, at: int) -> None:
        """Go to a moment."""
        ...

    def play(self, elapsed_s: float) -> None:
        """Let time pass."""
        ...

    def faster(self, steps: int) -> None:
        """Change the speed."""
        ...


class Player(Dashboard):
    """The player.

    Args:
        moving: the moment.
        step: goes to the next (1) or former (-1) event, or (True) failure; returns whether there is one.
        jump: goes to a moment as people write it; raises FormigaError.
        options: of `Dashboard`.
    """

    KEYS: ClassVar[tuple[str, ...]] = (
        "Moving in time",
        "  space    play, and stand",
        "  . ,      the next event, the one before",
        "  > <      the next failure, the one before",
        "  ] [      ten seconds on, or back",
        "  + -      faster, slower",
        "  @        jump: type a moment, 10:15, -5 min, PickUp-3 end",
        "",
    )

    def __init__(
        self, moving: Moving, step: Callable[[int, bool], bool], jump: Callable[[str], None], **options: Any
    ) -> None:
        super().__init__(moving, None, **options)
        self._moving, self._step, self._jump = moving, step, jump
        self._played_s = self._clock()
        self._to_where: str | None = None
        """What is typed of a moment to jump to."""

    def tick(self) -> None:
        """Let the moment move, and tell where it is."""
        at_s = self._clock()
        elapsed, self._played_s = at_s - self._played_s, at_s
        if self._moving.plays:
            self._moving.play(elapsed)
            self._soon.set()
        self._answered_s = at_s  # history always answers
        super().tick()
        self.frame.foot.put([(line(TonedText(f" {self.status} ", "calm_bar"), TonedText(f"  {HELP}", "dim")), False)])

    @property
    def status(self) -> str:
        """Return where the moment is and how it moves, or what is typed."""
        if self._to_where is not None:
            return f"to which moment? {self._to_where}_   10:15, -5 min, PickUp-3 end; Enter, Esc"
        how = "plays" if self._moving.plays else "stands,"
        return f"{written(self._moving.at)} {how} x{self._moving.speed:g}"

    async def _key(self, key: str, character: str) -> None:
        if self._to_where is not None:
            self._type_moment(key, character)
            self.tick()
        elif not self._moves(key, character):
            await super()._key(key, character)
        else:
            self._touched_s = self._clock()
            self._soon.set()
            self.tick()

    def _type_moment(self, key: str, character: str) -> None:
        words = self._to_where or ""
        if key == "escape":
            self._to_where = None
        elif key == "backspace":
            self._to_where = words[:-1]
        elif key == "enter":
            self._to_where = None
            try:
                self._jump(words)
            except FormigaError as error:
                self.ordering.say(str(error), "warn", self._clock())
            self._soon.set()
        else:
            self._to_where = words + character

    def _moves(self, key: str, character: str) -> bool:
        moving = self._moving
        if self._typing:
            return False
        match character or key:
            case " " | "space":
                moving.plays = not moving.plays
                self._played_s = self._clock()
            case "." | ",":
                self._stepped(1 if character == "." else -1, False)
            case ">" | "<":
                self._stepped(1 if character == ">" else -1, True)
            case "+" | "=" | "-":
                moving.faster(-1 if character == "-" else 1)
            case "]" | "[":
                moving.go(moving.at + (10_000_000 if character == "]" else -10_000_000))
            case "@" | ":":
                self._to_where = ""
            case _:
                return False
        return True

    def _stepped(self, direction: int, failure: bool) -> None:
        if not self._step(direction, failure):
            what = "failure" if failure else "event"
            self.ordering.say(f"there is no {'later' if direction > 0 else 'earlier'} {what}", "warn", self._clock())
