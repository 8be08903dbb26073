"""A map for the terminal: lines of styled spans, never wider than asked for. North is up.

Ways are dots of braille (in ASCII: the agent's letter). Each has its agent's letter and an arrow here and there, so that
several are told apart without colours.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from msgspec import Struct

from formiga_bt.show.clean import cleaned, cut
from formiga_bt.show.facts import Chart, MapLane, MapMark, MapShape, Point, Track
from formiga_bt.show.gantt.text import wrapped
from formiga_bt.show.map.labels import along
from formiga_bt.show.map.view import AgentWalk, MapScene, outside_in_words, scene_of, turns_of
from formiga_bt.show.styled import Canvas, Ink, StyledLine
from formiga_bt.show.ticks import lasted, metre_step

LEAST: Final = 40
MARGIN: Final = 6
"""Columns left of the map: metres north."""
EVERY: Final = 12
"""Cells from one letter on a way to the next."""
LETTERS: Final = "abcdefghijklmnopqrstuvwyzACDEFGHIJKLMNOPQRSTUVWYZ"
_INKS: Final[tuple[Ink, ...]] = ("blue", "red", "green", "magenta", "yellow", "cyan")
_ARROWS: Final = ("↑", "↗", "→", "↘", "↓", "↙", "←", "↖")
_PLAIN_ARROWS: Final = ("^", "^", ">", "v", "v", "v", "<", "^")
_DOTS: Final = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))


KINDS: Final = ("base", "port", "station", "park", "place", "landing", "event", "find")


class MapSigns(Struct, frozen=True):
    """The characters of a map."""

    base: str
    port: str
    station: str
    park: str
    place: str
    landing: str
    event: str
    find: str
    person: str
    fence: str
    border: str
    lane: str
    forbidden: str
    arrows: tuple[str, ...]
    cut: str
    corner: str
    across: str
    up: str


PLAIN: Final = MapSigns(
    base="B", port="o", station="o", park="p", place="x", landing="v", event="*", find="!", person="@", fence="=", border=".",
    lane=":",
    forbidden="/", arrows=_PLAIN_ARROWS, cut="~", corner="+", across="-", up="|",
)  # fmt: skip
FINE: Final = MapSigns(
    base="⊕", port="□", station="▫", park="▪", place="•", landing="▽", event="★", find="◆", person="☻", fence="═", border="·",
    lane="┊",
    forbidden="╱", arrows=_ARROWS, cut="…", corner="┼", across="─", up="│",
)  # fmt: skip


def drawn(
    chart: Chart, width: int = 100, *, ascii_only: bool = False, whole: bool = False, ids: Sequence[str] = ()
) -> list[StyledLine]:
    """Return a map as lines.

    Args:
        chart: the site and the ways.
        width: columns to fit into; less than 40 is taken as 40.
        ascii_only: plain characters.
        whole: show all of the site.
        ids: the tasks whose agents are shown, for the title.
    """
    width = max(LEAST, width)
    scene = scene_of(chart, whole=whole, ratio=(0.4, 0.9))
    return list(_Map(scene, width, PLAIN if ascii_only else FINE, ascii_only=ascii_only).lines(chart.site, ids))


class _Map:
    def __init__(self, scene: MapScene, width: int, look: MapSigns, *, ascii_only: bool) -> None:
        self.scene = scene
        self.look = look
        self.ascii_only = ascii_only
        self.width = width
        self.across = width - MARGIN - 1
        self.down = max(6, round(self.across / 2 * scene.view.height / scene.view.width))
        self.canvas = Canvas(width, self.down)

    def lines(self, site: str, ids: Sequence[str]) -> Iterator[StyledLine]:
        title = self._clean(f"{site}: {', '.join(ids)}" if ids else site)
        yield StyledLine.of(cut(title, self.width, self.look.cut), "bold")
        step = metre_step(self.scene.view.width, max(3, self.across // 12))
        self._grid(step)
        for shape in self.scene.shapes:
            self._shape(shape)
        for lane in self.scene.lanes:
            self._lane(lane)
        for number, walk in enumerate(self.scene.walks):
            self._walk(number, walk)
        self._marks()
        for number, walk in enumerate(self.scene.walks):
            self._person(number, walk)
        self._names()
        yield from self.canvas.lines()
        yield from self._axis(step)
        yield StyledLine.of("")
        yield from self._legend(step)

    # -- the ground ----------------------------------------------------------------------------------------------
    def _grid(self, step: float) -> None:
        view, look = self.scene.view, self.look
        for row in range(self.down):
            self.canvas.write(row, MARGIN, look.up, "dim")
        for n in range(math.ceil(view.south / step), math.floor(view.north / step) + 1):
            row, _ = self._cell(Point(view.west, n * step))
            self.canvas.write(row, 0, f"{n * step:>{MARGIN - 1}g}"[: MARGIN - 1], "dim")
            self.canvas.write(row, MARGIN, look.corner, "dim")
        self.canvas.write(0, self.width - 3, f"N {look.arrows[0]}", "bold")

    def _axis(self, step: float) -> Iterator[StyledLine]:
        view, look = self.scene.view, self.look
        canvas = Canvas(self.width, 2)
        canvas.write(0, MARGIN, look.corner + look.across * self.across, "dim")
        canvas.write(1, 0, "m", "dim")
        free = MARGIN
        for n in range(math.ceil(view.west / step), math.floor(view.east / step) + 1):
            _, column = self._cell(Point(n * step, view.south))
            text = f"{n * step:g}"
            canvas.write(0, column, look.corner, "dim")
            at = min(column - (len(text) - 1) // 2, self.width - len(text))
            if at >= free:
                canvas.write(1, at, text, "dim")
                free = at + len(text) + 2
        yield from canvas.lines()

    def _shape(self, shape: MapShape) -> None:
        sign = self.look.fence if shape.kind == "fence" else self.look.border
        corners = [self._fine(c) for c in (*shape.corners, shape.corners[0])]
        ink: Ink = "red" if shape.forbidden else "green" if shape.kind == "region" else "dim"
        if shape.forbidden:
            self._fill(shape)
        for x, y in along(corners, 0.5):
            self._put(int(y), int(x), sign, ink)

    def _lane(self, lane: MapLane) -> None:
        """Draw an edge of the routes, and where it is driven one way only an arrow in its middle."""
        ends = [self._fine(lane.start), self._fine(lane.end)]
        for x, y in along(ends, 0.5):
            self._put(int(y), int(x), self.look.lane, "dim")
        if lane.one_way:
            (ax, ay), (bx, by) = ends
            arrow = self._arrow((round(ay * 9), round(ax * 9)), (round(by * 9), round(bx * 9)))
            self._put(int((ay + by) / 2), int((ax + bx) / 2), arrow, "dim")

    def _fill(self, shape: MapShape) -> None:
        corners = [self._fine(c) for c in shape.corners]
        for row in range(self.down):
            for column in range(MARGIN + 1, self.width):
                if _is_inside(column + 0.5, row + 0.5, corners):
                    self._put(row, column, self.look.forbidden, "red")

    def _marks(self) -> None:
        rank = {"place": 0, "park": 0, "port": 1, "station": 1, "landing": 2, "base": 3, "event": 4, "find": 4}
        for mark in sorted(self.scene.marks, key=lambda one: rank[one.kind]):
            row, column = self._cell(mark.at)
            self._put(row, column, self._sign(mark), "bold")

    def _sign(self, mark: MapMark) -> str:
        return str(getattr(self.look, mark.kind))

    # -- ways ----------------------------------------------------------------------------------------------------
    def _walk(self, number: int, walk: AgentWalk) -> None:
        for piece in walk.pieces:
            self._piece(piece, letter_of(number), _INKS[number % len(_INKS)])

    def _piece(self, piece: Track, letter: str, ink: Ink) -> None:
        cells: dict[tuple[int, int], int] = {}
        way: list[tuple[int, int]] = []
        for x, y in along([self._fine(p) for p in piece.points], 0.2):
            cell = int(y), int(x)
            cells[cell] = cells.get(cell, 0) | _DOTS[int(y * 4) % 4][int(x * 2) % 2]
            if not way or way[-1] != cell:
                way.append(cell)
        for (row, column), dots in cells.items():
            self._put(row, column, letter if self.ascii_only else chr(0x2800 + dots), ink)
        for i in range(min(EVERY // 3, len(way) // 2), len(way) - 1, EVERY):
            self._put(*way[i], letter, ink)
            ahead = min(i + 1, len(way) - 1)
            if ahead > i:
                behind, front = way[max(0, i - 1)], way[min(i + 3, len(way) - 1)]
                self._put(*way[ahead], self._arrow(behind, front), ink)

    def _arrow(self, a: tuple[int, int], b: tuple[int, int]) -> str:
        angle = math.atan2(b[1] - a[1], -(b[0] - a[0]) * 2)
        return self.look.arrows[round(angle / (math.pi / 4)) % 8]

    def _person(self, number: int, walk: AgentWalk) -> None:
        row, column = self._cell(walk.end)
        if walk.human:
            self._put(row, column, self.look.person, "bold")
        elif walk.stands:
            self._put(row, column, letter_of(number), "bold")

    # -- names ---------------------------------------------------------------------------------------------------
    def _names(self) -> None:
        people = [(walk.end, walk.agent) for walk in self.scene.walks if walk.human]
        order = {"base": 0, "event": 1, "find": 1, "place": 3, "port": 4, "station": 4, "park": 4}
        marks = sorted((m for m in self.scene.marks if m.kind in order), key=lambda one: order[one.kind])
        first = [(m.at, m.name) for m in marks if m.kind in ("base", "event", "find")]
        rest = [(m.at, m.name) for m in marks if m.kind not in ("base", "event", "find")]
        areas = [(_middle(s), s.name) for s in self.scene.shapes if s.kind in ("zone", "region")]
        for at, name in dict.fromkeys([*first, *people, *rest, *areas]):
            self._name(at, cut(self._clean(name), 16, self.look.cut))

    def _name(self, at: Point, name: str) -> None:
        row, column = self._cell(at)
        n = len(name)
        for r, c in (
            (row, column + 2), (row, column - n - 1), (row - 1, column - n // 2), (row + 1, column - n // 2),
            (row - 1, column + 2), (row + 1, column + 2), (row - 1, column - n - 1), (row + 1, column - n - 1),
        ):  # fmt: skip
            left = c - 1 if c - 1 != column else c
            free = self.canvas.is_free(r, left, n + c - left, self.look.forbidden)
            if left > MARGIN and free and not self._letter_at(r, c + n):
                self.canvas.write(r, c, name)
                return

    def _letter_at(self, row: int, column: int) -> bool:
        return column < self.width and self.canvas.is_word(row, column)

    def _legend(self, step: float) -> Iterator[StyledLine]:
        look, width = self.look, self.width
        cells = step / self.scene.view.width * self.across
        yield StyledLine.of(cut(f"{look.across * max(1, round(cells))} {step:g} m", width, look.cut), "dim")
        for number, walk in enumerate(self.scene.walks):
            yield StyledLine.of(cut(self._told(number, walk), width, look.cut), _INKS[number % len(_INKS)])
        for shape in self.scene.shapes:
            if shape.kind == "searched":
                yield StyledLine.of(cut(self._clean(f"{look.border * 2} {shape.name}"), width, look.cut), "dim")
        drawn = {mark.kind for mark in self.scene.marks}
        kinds = [f"{getattr(look, kind)} {kind}" for kind in KINDS if kind in drawn]
        kinds += [f"{look.lane * 2} route"] if self.scene.lanes else []
        kinds += [f"{look.person} person"] if any(walk.human for walk in self.scene.walks) else []
        kinds += [f"{look.fence * 2} fence"] if any(shape.kind == "fence" for shape in self.scene.shapes) else []
        if any(shape.kind != "fence" for shape in self.scene.shapes):
            kinds.append(f"{look.border * 2} region or zone")
        kinds += [f"{look.forbidden * 2} no entry"] if any(shape.forbidden for shape in self.scene.shapes) else []
        for line in wrapped(kinds, width):
            yield StyledLine.of(line, "dim")
        for text in (outside_in_words(self.scene.outside, "--whole"), *self.scene.notes):
            if text:
                yield StyledLine.of(cut(self._clean(text), width, look.cut), "dim")

    def _told(self, number: int, walk: AgentWalk) -> str:
        """Return an agent's line of the legend: how far it went, how high, for how long."""
        who = self._clean(f"{letter_of(number)} {walk.agent}")
        if walk.human or walk.stands:
            where = f"{who}  at {walk.end.east_m:.0f} E {walk.end.north_m:.0f} N"
            return f"{where}{_heights(walk)}" if walk.mobility == "air" else where
        span = walk.span
        took = f" in {lasted(span[1] - span[0])}" if span is not None else ""
        return f"{who}  {walk.length_m:.0f} m over ground{took}{_heights(walk) if walk.mobility == 'air' else ''}"

    # -- cells ---------------------------------------------------------------------------------------------------
    def _fine(self, p: Point) -> tuple[float, float]:
        view = self.scene.view
        x = MARGIN + 1 + (p.east_m - view.west) / view.width * (self.across - 1) + 0.5
        y = (view.north - p.north_m) / view.height * (self.down - 1) + 0.5
        return x, y

    def _cell(self, p: Point) -> tuple[int, int]:
        x, y = self._fine(p)
        return int(y), int(x)

    def _put(self, row: int, column: int, sign: str, ink: Ink) -> None:
        if column > MARGIN:
            self.canvas.write(row, column, sign, ink)

    def _clean(self, text: str) -> str:
        return cleaned(text, ascii_only=self.ascii_only)


def letter_of(number: int) -> str:
    """Return the letter of an agent by its place in the list."""
    return LETTERS[number % len(LETTERS)]


def _heights(walk: AgentWalk) -> str:
    """Return the heights at which a way turns, in order."""
    ups = [round(piece.points[i].up_m) for piece in walk.pieces for i in turns_of(piece)]
    ups = [up for i, up in enumerate(ups) if not i or up != ups[i - 1]]
    if max(ups, default=0) < 1:
        return ""
    shown = [*map(str, ups[:9]), *(["..."] if len(ups) > 9 else [])]
    return f", heights {' '.join(shown)} m"


def _middle(shape: MapShape) -> Point:
    n = len(shape.corners)
    return Point(sum(c.east_m for c in shape.corners) / n, sum(c.north_m for c in shape.corners) / n)


def _is_inside(x: float, y: float, corners: Sequence[tuple[float, float]]) -> bool:
    inside = False
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside
