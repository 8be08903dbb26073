"""A map as a matplotlib figure, 8 inches wide: north is up, metres from the base, heights over time below.

Agents differ by colour and line style; their names and heights stand at their ways where there is room (`labels`), and the
legend has them all.
"""

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from formiga_bt.base.clock import SECOND
from formiga_bt.base.machines import Mobility
from formiga_bt.show.clean import cleaned, cut
from formiga_bt.show.facts import Chart, MapLane, MapMark, MapShape, Point, Track
from formiga_bt.show.map.labels import Rect, TakenSpace, along
from formiga_bt.show.map.view import AgentWalk, MapScene, outside_in_words, scene_of, turns_of
from formiga_bt.show.picture import INKS, Tips, agg, extent
from formiga_bt.show.ticks import metre_step, time_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN: Final = 8.0
SIDE_IN: Final = 0.62
LOW, HIGH = 0.5, 0.8
"""Height of the map by its width, at least and at most."""
STRIP_IN: Final = 1.05
MARKS: Final[dict[Mobility, str]] = {"air": "D", "ground": "s", "fixed": "p", "none": "p", "people": "h"}
"""Where agents stand."""
LINES: Final = ("-", "--", "-.", ":", (0, (8, 2)), (0, (5, 1, 1, 1, 1, 1)))
_MARKS: Final[dict[str, tuple[str, float, str, str]]] = {
    "base": ("P", 9, "#000000", "base"),
    "port": ("s", 5, "#ffffff", "port"),
    "station": ("s", 4, "#dddddd", "station"),
    "park": ("s", 3, "#ffffff", "parking"),
    "place": ("o", 4, "#777777", "place"),
    "landing": ("v", 6, "#ffffff", "landing"),
    "event": ("*", 9, "#ffd700", "event"),
    "find": ("X", 8, "#e4572e", "find"),
}
"""Kind -> shape, size, filling, what a legend calls it."""
_SHAPES: Final[dict[str, tuple[str, str, str]]] = {
    "fence": ("#555555", "none", ""),
    "zone": ("#555555", "#f4f4f4", ""),
    "region": ("#3a7d44", "#e8f3e8", ""),
    "searched": ("#2b6cb0", "#cfe3f7", ""),
}
LANE: Final = "#cfcfcf"
COLUMNS: Final = 6
LABELS: Final = 60
"""So many labels at most are put on a map."""


def figure(chart: Chart, tips: Tips, *, whole: bool = False, ids: tuple[str, ...] = ()) -> "Figure":
    """Return a map; call it within `picture.fixed_style`.

    Args:
        chart: the site and the ways.
        tips: takes what is told when something is pointed at.
        whole: show all of the site.
        ids: the tasks whose agents are shown, for the title.
    """
    return _Map(scene_of(chart, whole=whole, ratio=(LOW, HIGH)), tips).draw(chart, ids)


class _Map:
    def __init__(self, scene: MapScene, tips: Tips) -> None:
        from matplotlib.figure import Figure

        self.scene = scene
        self.tips = tips
        self.flyers = [walk for walk in scene.walks if walk.mobility == "air" and walk.span is not None]
        self.said = [t for t in (outside_in_words(scene.outside, "--whole"), *scene.notes) if t]
        self.entries = _entries(scene)
        self.strip = STRIP_IN + 0.45 if self.flyers else 0.0
        self.foot = 0.12 + 0.17 * -(-len(self.entries) // COLUMNS) + 0.17 * len(self.said)
        map_in = (WIDTH_IN - SIDE_IN - 0.15) * scene.view.height / scene.view.width
        self.height = 0.32 + map_in + 0.5 + self.strip + self.foot
        self.figure = Figure(figsize=(WIDTH_IN, self.height))
        self.canvas = agg(self.figure)
        bottom = self.foot + self.strip + 0.5
        self.axes: Axes = self.figure.add_axes(
            (SIDE_IN / WIDTH_IN, bottom / self.height, 1 - (SIDE_IN + 0.15) / WIDTH_IN, map_in / self.height)
        )
        view = scene.view
        self.axes.set_xlim(view.west, view.east)
        self.axes.set_ylim(view.south, view.north)
        box = self.axes.get_window_extent()
        self.places = TakenSpace(Rect(box.x0 + 2, box.y0 + 2, box.x1 - 2, box.y1 - 2))
        self.labels = 0

    def draw(self, chart: Chart, ids: tuple[str, ...]) -> "Figure":
        axes = self.axes
        title = cleaned(chart.site) + (f": {cut(cleaned(', '.join(ids)), 80, '…')}" if ids else "")
        axes.set_title(title, loc="left", fontsize=9, weight="bold", pad=5)
        step = metre_step(self.scene.view.width, 10)
        for axis, low, high in ((axes.xaxis, *axes.get_xlim()), (axes.yaxis, *axes.get_ylim())):
            first = math.ceil(low / step)
            axis.set_ticks([n * step for n in range(first, math.floor(high / step) + 1)])
        axes.set_xlabel("m east of the base", labelpad=1)
        axes.set_ylabel("m north of the base", labelpad=1)
        axes.grid(color="#e4e4e4", linewidth=0.5)
        axes.set_axisbelow(True)
        self._compass(step)
        for shape in self.scene.shapes:
            self._shape(shape)
        for lane in self.scene.lanes:
            self._lane(lane)
        for walk in self.scene.walks:
            for piece in walk.pieces:
                self.places.avoid(along(self._pixels(piece), 4.0))
        for shape in self.scene.shapes:
            corners = [self._pixel(c.east_m, c.north_m) for c in (*shape.corners, shape.corners[0])]
            self.places.avoid(along(corners, 6.0))
        for mark in self.scene.marks:
            self._mark(mark)
        for number, walk in enumerate(self.scene.walks):
            self._walk(number, walk)
        self._names()
        for shape in self.scene.shapes:
            self._shape_name(shape)
        for number, walk in enumerate(self.scene.walks):
            self._heights(number, walk)
        if self.flyers:
            self._strip()
        self._legend()
        return self.figure

    # -- the ground ----------------------------------------------------------------------------------------------
    def _compass(self, step: float) -> None:
        box = self.axes.get_window_extent()
        dx, dy = 1 / box.width, 1 / box.height
        across = self.axes.transAxes
        x, y = 1 - 22 * dx, 1 - 16 * dy
        self.axes.annotate(
            "", xy=(x, y), xytext=(x, y - 36 * dy), xycoords=across, textcoords=across, zorder=9,
            arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.4},
        )  # fmt: skip
        self.axes.text(x, y - 46 * dy, "N", transform=across, ha="center", va="center", weight="bold", zorder=9)
        self.places.take(Rect(box.x1 - 38, box.y1 - 72, box.x1, box.y1))
        pixels = step / self.scene.view.width * box.width
        left, low = box.x1 - pixels - 16, box.y0 + 12
        self.axes.plot(
            [1 - (pixels + 16) * dx, 1 - 16 * dx], [12 * dy, 12 * dy], transform=across, color="black", linewidth=3,
            solid_capstyle="butt", zorder=9,
        )  # fmt: skip
        self.axes.text(
            1 - (pixels / 2 + 16) * dx, 17 * dy, f"{step:g} m", transform=across, ha="center", va="bottom", zorder=9,
            fontsize=7, bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 0.5},
        )  # fmt: skip
        self.places.take(Rect(left - 4, low - 6, box.x1, low + 26))

    def _shape(self, shape: MapShape) -> None:
        from matplotlib.patches import Polygon

        edge, face, hatch = _SHAPES[shape.kind]
        if shape.forbidden:
            edge, face, hatch = "#a00000", "#fbeaea", "xxx"
        patch = Polygon(
            [(c.east_m, c.north_m) for c in shape.corners], closed=True, facecolor=face, edgecolor=edge, hatch=hatch,
            linewidth=1.6 if shape.kind == "fence" else 1.0, linestyle="--" if shape.kind == "fence" else "-", zorder=1,
        )  # fmt: skip
        kind = "no-fly zone" if shape.forbidden else shape.kind
        patch.set_gid(self.tips.add(f"{kind} {shape.name}" if shape.name != kind else kind))
        self.axes.add_patch(patch)

    def _lane(self, lane: MapLane) -> None:
        """Draw an edge of the routes, with an arrow head where it is driven one way only."""
        (line,) = self.axes.plot(
            [lane.start.east_m, lane.end.east_m], [lane.start.north_m, lane.end.north_m], color=LANE, linewidth=3.0,
            solid_capstyle="round", zorder=2,
        )  # fmt: skip
        line.set_gid(self.tips.add(f"route {lane.name}" + (", one way" if lane.one_way else "")))
        if lane.one_way:
            self._head((lane.start, lane.end))

    def _head(self, way: tuple[Point, Point]) -> None:
        (ax, ay), (bx, by) = (self._pixel(p.east_m, p.north_m) for p in way)
        length = math.dist((ax, ay), (bx, by))
        if length < 14:
            return
        x, y = (ax + bx) / 2, (ay + by) / 2
        back = (x - (bx - ax) / length * 5, y - (by - ay) / length * 5)
        self.axes.annotate(
            "", xy=self._ground(x, y), xytext=self._ground(*back), zorder=3,
            arrowprops={"arrowstyle": "-|>", "color": "#8a8a8a", "linewidth": 0.8, "mutation_scale": 9},
        )  # fmt: skip

    def _shape_name(self, shape: MapShape) -> None:
        if shape.kind == "fence":
            return
        view = self.scene.view
        easts = [min(max(c.east_m, view.west), view.east) for c in shape.corners]
        norths = [min(max(c.north_m, view.south), view.north) for c in shape.corners]
        edge = "#a00000" if shape.forbidden else _SHAPES[shape.kind][0]
        at = sum(easts) / len(easts), sum(norths) / len(norths)
        self._label(cleaned(shape.name), *at, color=edge, style="italic", on=True)

    def _mark(self, mark: MapMark) -> None:
        shape, size, face, _ = _MARKS[mark.kind]
        (drawn,) = self.axes.plot(
            [mark.at.east_m], [mark.at.north_m], shape, markersize=size, color=face, markeredgecolor="black",
            markeredgewidth=0.8, zorder=5 if mark.kind != "landing" else 7,
        )  # fmt: skip
        drawn.set_gid(
            self.tips.add(f"{mark.kind} {mark.name}\n{mark.at.east_m:.0f} m east, {mark.at.north_m:.0f} m north")
        )
        x, y = self._pixel(mark.at.east_m, mark.at.north_m)
        half = size * 0.75 + 1.5
        self.places.take(Rect(x - half, y - half, x + half, y + half))

    def _names(self) -> None:
        order = {"base": 0, "event": 1, "find": 1, "place": 2, "port": 3, "station": 3, "park": 3}
        named = [mark for mark in self.scene.marks if mark.kind in order]
        taken: set[tuple[str, int, int]] = set()
        for mark in sorted(named, key=lambda one: order[one.kind]):
            spot = mark.name, round(mark.at.east_m), round(mark.at.north_m)
            if spot not in taken:
                taken.add(spot)
                self._label(
                    cut(cleaned(mark.name), 26, "…"), mark.at.east_m, mark.at.north_m, color="#222222", around=5.0
                )

    # -- ways ----------------------------------------------------------------------------------------------------
    def _walk(self, number: int, walk: AgentWalk) -> None:
        ink, style = look_of(number)
        who = f"{walk.agent} ({walk.type})" + (f", {', '.join(walk.tasks)}" if walk.tasks else "")
        for piece in walk.pieces if not walk.stands else ():
            (line,) = self.axes.plot(
                [p.east_m for p in piece.points], [p.north_m for p in piece.points], linestyle=style, color=ink,
                linewidth=1.1 if walk.human else 1.6, zorder=4,
            )  # fmt: skip
            line.set_gid(self.tips.add(f"{who}\n{walk.length_m:.0f} m over ground", walk.agent))
            self._arrows(piece, ink)
        if walk.human or walk.stands:
            east, north = walk.end.east_m, walk.end.north_m
            (dot,) = self.axes.plot(
                [east], [north], MARKS[walk.mobility], markersize=8, color=ink, markeredgecolor="black",
                markeredgewidth=0.8, zorder=6,
            )  # fmt: skip
            dot.set_gid(self.tips.add(f"{who}\nat {east:.0f} m east, {north:.0f} m north", walk.agent))
            x, y = self._pixel(east, north)
            self.places.take(Rect(x - 7.5, y - 7.5, x + 7.5, y + 7.5))
        self._walk_name(walk, ink)

    def _arrows(self, piece: Track, ink: str) -> None:
        """Put an arrow head on the longest legs, none nearer than 40 pixels to another of this way."""
        pixels = self._pixels(piece)
        legs = [(math.dist(a, b), a, b) for a, b in pairwise(pixels)]
        drawn: list[tuple[float, float]] = []
        for length, a, b in sorted(legs, key=lambda leg: -leg[0])[:40]:
            share = 0.56
            x, y = a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share
            if length < 14 or any(math.dist((x, y), other) < 40 for other in drawn):
                continue
            drawn.append((x, y))
            back = (x - (b[0] - a[0]) / length * 5, y - (b[1] - a[1]) / length * 5)
            arrow = self.axes.annotate(
                "", xy=self._ground(x, y), xytext=self._ground(*back), zorder=6,
                arrowprops={"arrowstyle": "-|>", "color": ink, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0,
                            "mutation_scale": 11},
            )  # fmt: skip
            if arrow.arrow_patch is not None:
                arrow.arrow_patch.set_gid(self.tips.add("", piece.agent))

    def _walk_name(self, walk: AgentWalk, ink: str) -> None:
        """Write the agent's name at its way: at its farthest point from its begin, else at its middle or ends."""
        points = walk.points
        a = points[0]
        far = max(points, key=lambda p: math.hypot(p.east_m - a.east_m, p.north_m - a.north_m))
        middle, quarter = points[len(points) // 2], points[len(points) // 4]
        for at in (walk.end,) if walk.human else (far, middle, quarter, a, points[-1]):
            if self._label(
                cut(cleaned(walk.agent), 24, "…"), at.east_m, at.north_m, color=ink, weight="bold",
                of=walk.agent, around=4.0 if walk.human or walk.stands else 0.0,
            ):  # fmt: skip
                return

    def _heights(self, number: int, walk: AgentWalk) -> None:
        """Write heights where a machine turns, each only once near by."""
        if walk.human:
            return
        ink, _ = look_of(number)
        told: list[tuple[float, float, float]] = []
        for p in (piece.points[i] for piece in walk.pieces for i in turns_of(piece)):
            x, y = self._pixel(p.east_m, p.north_m)
            near = [up for a, b, up in told if math.dist((a, b), (x, y)) < 70]
            if p.up_m >= 1.0 and not any(abs(up - p.up_m) < 3.0 for up in near) and self._label(
                f"{p.up_m:.0f} m", p.east_m, p.north_m, color=ink, fontsize=6.5, of=walk.agent, must=False
            ):  # fmt: skip
                told.append((x, y, p.up_m))

    def _label(
        self,
        text: str,
        east: float,
        north: float,
        *,
        must: bool = True,
        around: float = 0.0,
        of: str = "",
        on: bool = False,
        **style: Any,
    ) -> bool:
        if self.labels >= LABELS or not text:
            return False
        x, y = self._pixel(east, north)
        drawn = self.axes.text(0, 0, text, ha="center", zorder=8, **{"fontsize": 7.5, **style})
        box = extent(drawn, self.canvas)
        found = self.places.place(x, y, box.width * 1.05 + 4, box.height + 2, must=must, around=around, on=on)
        if found is None:
            drawn.remove()
            return False
        rect, distance = found
        drawn.set_position(self._ground((rect.left + rect.right) / 2, rect.low + 1 - (box.y0 - self._pixel(0, 0)[1])))
        drawn.set_bbox({"facecolor": "white", "alpha": 0.75, "linewidth": 0, "pad": 0.4})
        if of:
            drawn.set_gid(self.tips.add("", of))
        if distance > 10 and not on:
            near = min(max(x, rect.left), rect.right), min(max(y, rect.low), rect.high)
            (line,) = self.axes.plot(
                *zip((east, north), self._ground(*near), strict=True), color="#888888", linewidth=0.5, zorder=3.5
            )
            if of:
                line.set_gid(self.tips.add("", of))
        self.labels += 1
        return True

    # -- below ---------------------------------------------------------------------------------------------------
    def _strip(self) -> None:
        spans = [walk.span for walk in self.flyers if walk.span is not None]
        start = min(first for first, _ in spans)
        end = max(*(last for _, last in spans), start + SECOND)
        axes = self.figure.add_axes(
            (
                SIDE_IN / WIDTH_IN, (self.foot + 0.4) / self.height, 1 - (SIDE_IN + 0.15) / WIDTH_IN,
                STRIP_IN / self.height,
            )
        )  # fmt: skip
        for number, walk in enumerate(self.scene.walks):
            if walk.human:
                continue
            ink, style = look_of(number)
            for piece in walk.pieces:
                (line,) = axes.plot(
                    [at - start for at in piece.times], [p.up_m for p in piece.points], linestyle=style, color=ink,
                    linewidth=1.2,
                )  # fmt: skip
                line.set_gid(self.tips.add(f"{walk.agent}: height", walk.agent))
        axis = time_axis(start, end, 11)
        axes.set_xlim(0, end - start)
        axes.set_xticks([at - start for at, _ in axis.marks], [text for _, text in axis.marks])
        axes.set_ylim(min(0.0, axes.get_ylim()[0]), axes.get_ylim()[1])
        axes.set_xlabel(f"{axis.unit} since the first position", labelpad=1)
        axes.set_ylabel("height, m", labelpad=1)
        axes.grid(color="#e4e4e4", linewidth=0.5)

    def _legend(self) -> None:
        if self.entries:
            self.figure.legend(
                handles=self.entries, loc="upper left", bbox_to_anchor=(0.01, (self.foot - 0.02) / self.height),
                ncols=COLUMNS, fontsize=7, frameon=False, handlelength=2.6, columnspacing=1.2, borderaxespad=0,
            )  # fmt: skip
        for i, text in enumerate(reversed(self.said)):
            words = cut(cleaned(text), 130, "…")
            self.figure.text(0.012, (0.05 + 0.17 * i) / self.height, words, fontsize=7, color="#444444", va="bottom")

    # -- pixels --------------------------------------------------------------------------------------------------
    def _pixel(self, east: float, north: float) -> tuple[float, float]:
        x, y = self.axes.transData.transform((east, north))
        return float(x), float(y)

    def _ground(self, x: float, y: float) -> tuple[float, float]:
        east, north = self.axes.transData.inverted().transform((x, y))
        return float(east), float(north)

    def _pixels(self, piece: Track) -> list[tuple[float, float]]:
        return [self._pixel(p.east_m, p.north_m) for p in piece.points]


def look_of(number: int) -> tuple[str, Any]:
    """Return the colour and line style of an agent by its place in the list."""
    return INKS[number % len(INKS)], LINES[(number + number // len(INKS)) % len(LINES)]


def _entries(scene: MapScene) -> list[Any]:
    """Return what the legend lists."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = []
    for number, walk in enumerate(scene.walks):
        ink, style = look_of(number)
        stands = walk.stands
        shape = MARKS[walk.mobility] if stands or walk.human else None
        entries.append(
            Line2D(
                [], [], color=ink, linestyle="" if stands else style, marker=shape, linewidth=1.6,
                label=cut(cleaned(walk.agent), 18, "…"), markeredgecolor="black",
            )
        )  # fmt: skip
    for kind, (shape, size, face, word) in _MARKS.items():
        if any(mark.kind == kind for mark in scene.marks):
            entries.append(
                Line2D([], [], marker=shape, markersize=min(size, 7), color=face, markeredgecolor="black", linestyle="",
                       label=word)
            )  # fmt: skip
    if scene.lanes:
        entries.append(Line2D([], [], color=LANE, linewidth=3.0, label="route"))
    for kind, (edge, face, _) in _SHAPES.items():
        if any(shape.kind == kind and not shape.forbidden for shape in scene.shapes):
            entries.append(
                Patch(facecolor=face, edgecolor=edge, linestyle="--" if kind == "fence" else "-", label=kind)
            )
    if any(shape.forbidden for shape in scene.shapes):
        entries.append(Patch(facecolor="#fbeaea", edgecolor="#a00000", hatch="xxx", label="no-fly zone"))
    return entries
