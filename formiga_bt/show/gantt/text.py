"""A Gantt chart for the terminal: lines of styled spans, never wider than asked for.

Each kind of action has a filling of its own besides its colour. A bar with too little room for its name has a letter, which
the legend tells.
"""

from collections.abc import Iterable, Iterator
from datetime import UTC, tzinfo
from typing import Final

from msgspec import Struct

from formiga_bt.show.clean import cleaned, cut
from formiga_bt.show.facts import Timeline
from formiga_bt.show.gantt.plan import KINDS, SIGNS, WAITS, Bar, GanttChart, GanttRow, Kind, Sign, planned
from formiga_bt.show.styled import Canvas, Ink, StyledLine
from formiga_bt.show.ticks import Axis, spread, time_axis

LEAST: Final = 40
TEXT_ROWS: Final = 400


class GanttSigns(Struct, frozen=True):
    """The characters of a chart."""

    fill: dict[Kind, str]
    rest: dict[str, str]
    sign: dict[Sign, str]
    left: str
    right: str
    times: str
    cut: str
    tick: str
    line: str


PLAIN: Final = GanttSigns(
    fill={"rise": "^", "move": "-", "work": "#", "ask": "~", "stop": "X", "mixed": "+"},
    rest={"pending": ".", "question": "?", "gate": ":", "held": "="},
    sign={"": "]", "failed": "!", "canceled": "/", "running": ">"},
    left="[",
    right="]",
    times="x",
    cut="~",
    tick="+",
    line="-",
)
FINE: Final = GanttSigns(
    fill={"rise": "▒", "move": "━", "work": "▓", "ask": "╌", "stop": "╳", "mixed": "▚"},
    rest={"pending": "·", "question": "?", "gate": ":", "held": "‖"},
    sign={"": "]", "failed": "✗", "canceled": "⊘", "running": "▶"},
    left="[",
    right="]",
    times="×",
    cut="…",
    tick="┬",
    line="─",
)
_INKS: Final[dict[str, Ink]] = {
    "rise": "cyan", "move": "blue", "work": "green", "ask": "yellow", "stop": "red", "mixed": "magenta",
}  # fmt: skip


def drawn(
    timeline: Timeline,
    width: int = 100,
    *,
    ascii_only: bool = False,
    clock: bool = False,
    zone: tzinfo = UTC,
    from_us: int | None = None,
    to_us: int | None = None,
    page: int = 1,
) -> list[StyledLine]:
    """Return a chart as lines.

    Args:
        timeline: what happened.
        width: columns to fit into; less than 40 is taken as 40.
        ascii_only: plain characters.
        clock: the time of the day instead of the time since the first request.
        zone: of the clock.
        from_us: where it begins, counted from the first request.
        to_us: where it ends, likewise.
        page: which page, from 1; one has 400 rows.
    """
    width = max(LEAST, width)
    names = [cleaned(a.agent, ascii_only=ascii_only) for a in timeline.actions]
    names += [cleaned(w.agent, ascii_only=ascii_only) for w in timeline.waits if w.kind != "question"]
    label = min(max([5, *map(len, names)]), width // 3) + 3
    room = width - label
    plan = planned(timeline, room, from_us=from_us, to_us=to_us, page=page, rows=TEXT_ROWS)
    return list(_Chart(plan, label, room, PLAIN if ascii_only else FINE, ascii_only=ascii_only).lines(clock, zone))


class _Chart:
    def __init__(self, plan: GanttChart, label: int, room: int, look: GanttSigns, *, ascii_only: bool) -> None:
        self.plan = plan
        self.label = label
        self.room = room
        self.look = look
        self.ascii_only = ascii_only
        self.letters = letters_of(bar.name for bar in plan.bars)
        self.used: dict[str, str] = {}
        """Action -> letter, of those that are drawn by their letters."""

    def lines(self, clock: bool, zone: tzinfo) -> Iterator[StyledLine]:
        plan, width = self.plan, self.label + self.room
        if not plan.groups:
            yield StyledLine.of("nothing has happened yet")
            return
        for group in plan.groups:
            yield StyledLine.of(cut(self._clean(group.title), width, self.look.cut), "bold")
            if not group.rows:
                yield StyledLine.of("   no action")
            for row in group.rows:
                yield from self._row(row)
        axis = time_axis(plan.start, plan.end, max(2, self.room // 8), zero=plan.zero, clock=clock, zone=zone)
        yield from self._axis(axis)
        yield StyledLine.of("")
        yield from self._legend()
        if plan.note:
            yield StyledLine.of(cut(plan.note, width, self.look.cut), "dim")

    def _row(self, row: GanttRow) -> Iterator[StyledLine]:
        canvas = Canvas(self.label + self.room, row.lanes)
        name = self._clean(row.name) if row.name else "(waits)"
        canvas.write(0, 2, cut(name, self.label - 3, self.look.cut), "" if row.name else "dim")
        for rest in sorted(row.rests, key=lambda one: one.start - one.end):  # short ones last, over the others
            first, last = self._cells(rest.start, rest.end)
            canvas.write(0, self.label + first, self.look.rest.get(rest.kind, ".") * (last - first), "dim")
        for lane in range(row.lanes):
            self._lane(canvas, lane, [bar for bar in row.bars if bar.lane == lane])
        yield from canvas.lines()

    def _lane(self, canvas: Canvas, lane: int, bars: list[Bar]) -> None:
        taken = 0
        for i, bar in enumerate(bars):
            first, last = self._cells(bar.start, bar.end)
            first = max(first, min(taken, self.room - 1))
            last = max(last, first + 1)
            if i + 1 < len(bars):  # it leaves the next one its place
                following, _ = self._cells(bars[i + 1].start, bars[i + 1].end)
                last = min(last, max(following, first + 1))
            canvas.write(lane, self.label + first, self._bar(bar, last - first), _INKS[bar.kind])
            taken = last

    def _bar(self, bar: Bar, cells: int) -> str:
        look = self.look
        close = look.sign[bar.sign]
        if cells == 1:
            return self._letter(bar) if not bar.sign else close
        name = self._clean(bar.name) + (f" {look.times}{bar.count}" if bar.count > 1 else "")
        if cells == 2:
            return self._letter(bar) + close if bar.sign else look.left + self._letter(bar)
        inner = cells - 2
        text = name if len(name) <= inner else self._letter(bar)
        return look.left + text + look.fill[bar.kind] * (inner - len(text)) + close

    def _letter(self, bar: Bar) -> str:
        if bar.kind == "mixed" or bar.name not in self.letters:
            return self.look.fill["mixed"]
        letter = self.letters[bar.name]
        self.used[bar.name] = letter
        return letter

    def _cells(self, start: int, end: int) -> tuple[int, int]:
        span = self.plan.end - self.plan.start
        first = round((start - self.plan.start) / span * self.room)
        last = round((end - self.plan.start) / span * self.room)
        return min(first, self.room - 1), min(max(last, first + 1), self.room)

    def _axis(self, axis: Axis) -> Iterator[StyledLine]:
        span = self.plan.end - self.plan.start
        canvas = Canvas(self.label + self.room, 2)
        canvas.write(0, self.label, self.look.line * self.room, "dim")
        fits = len(axis.unit) <= self.label - 3
        canvas.write(1, 2, axis.unit if fits else "", "dim")
        shown = [((at - self.plan.start) / span * (self.room - 1), text) for at, text in axis.marks]
        for column, _ in shown:
            canvas.write(0, self.label + round(column), self.look.tick, "dim")
        room = self.room - (5 if self.plan.running else 0)
        for column, text in spread(shown, 2, room):
            canvas.write(1, self.label + column, text)
        if self.plan.running:
            canvas.write(0, self.label + self.room - 1, "|" if self.ascii_only else "┤", "bold")
            canvas.write(1, self.label + self.room - 3, "now", "bold")
        yield from canvas.lines()
        if not fits:
            yield StyledLine.of(f"  {cut(axis.unit, self.label + self.room - 2, self.look.cut)}", "dim")

    def _legend(self) -> Iterator[StyledLine]:
        look, bars = self.look, self.plan.bars
        letters = [f"{letter} {self._clean(name)}" for name, letter in sorted(self.used.items(), key=lambda x: x[1])]
        kinds = [f"{look.fill[kind] * 2} {word}" for kind, word in KINDS.items() if any(b.kind == kind for b in bars)]
        rests = [f"{look.rest[kind] * 2} {WAITS[kind]}" for kind in self.plan.waits]
        signs = [f"{look.sign[sign]} {word}" for sign, word in SIGNS.items() if any(b.sign == sign for b in bars)]
        for entries in (letters, kinds, [*rests, *signs]):
            for line in wrapped(entries, self.label + self.room):
                yield StyledLine.of(cut(line, self.label + self.room, look.cut), "dim")

    def _clean(self, text: str) -> str:
        return cleaned(text.replace("×", self.look.times), ascii_only=self.ascii_only)


def letters_of(names: Iterable[str]) -> dict[str, str]:
    """Return a letter for each name, all different: one of its own, else any other that is free."""
    spare = "ABCDEFGHIJKLMNOPQRSTUVWYZabcdefghijklmnopqrstuvwyz0123456789"
    found: dict[str, str] = {}
    for name in sorted(set(names)):
        capitals = [c for c in name if c.isupper()]
        wanted = [*capitals, *name.upper(), *name.lower(), *spare]
        taken = set(found.values())
        letter = next((c for c in wanted if c.isascii() and c.isalnum() and c not in "Xx" and c not in taken), "")
        if letter:
            found[name] = letter
    return found


def wrapped(entries: Iterable[str], width: int, gap: str = "   ") -> Iterator[str]:
    """Yield entries in lines of at most so many columns; one entry is never broken."""
    line = ""
    for entry in entries:
        if line and len(line) + len(gap) + len(entry) > width:
            yield line
            line = ""
        line = f"{line}{gap}{entry}" if line else entry
    if line:
        yield line
