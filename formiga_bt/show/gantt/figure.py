"""A Gantt chart as a matplotlib figure, 8 inches wide: a row for each agent, grouped by task.

Kinds of actions differ by colour and hatch; waiting is a thin bar in a texture of its own. What does not fit is cut by
measure, never by chance: a name that is wider than its bar gives way to its letter, and that to nothing (pointing tells).
"""

from datetime import UTC, tzinfo
from typing import TYPE_CHECKING, Any, Final

from formiga_bt.base.clock import Micros
from formiga_bt.show.clean import cleaned, cut
from formiga_bt.show.facts import Timeline
from formiga_bt.show.gantt.plan import KINDS, SIGNS, WAITS, Bar, GanttChart, GanttRow, Group, Kind, Rest, Sign, planned
from formiga_bt.show.gantt.text import letters_of
from formiga_bt.show.picture import INKS, Tips, agg, extent
from formiga_bt.show.ticks import time_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN: Final = 8.0
LANE_IN: Final = 0.24
TOP_IN, RIGHT_IN, AXIS_IN = 0.1, 0.2, 0.42
LEGEND_COLUMNS: Final = 5
LABEL_MOST: Final = 24
COLUMNS: Final = 400
"""So many spans of time can be told apart."""
_FACES: Final[dict[Kind, tuple[str, str]]] = {
    "rise": ("#bcdff5", "////"),
    "move": ("#ffffff", ""),
    "work": ("#9fd9c5", "----"),
    "ask": ("#fff0b3", "\\\\\\\\"),
    "stop": ("#f2b8a0", "xxxx"),
    "mixed": ("#d9d9d9", "||||"),
}
_RESTS: Final[dict[str, tuple[str, str]]] = {
    "pending": ("#ffffff", "////"),
    "question": ("#ffffff", "++++"),
    "gate": ("#ffffff", "||||||"),
    "held": ("#bbbbbb", "xxxxxx"),
}
_MARKS: Final[dict[Sign, tuple[str, str]]] = {
    "failed": ("X", "#c00000"),
    "canceled": ("D", "#ffffff"),
    "running": (">", "#000000"),
}


def figure(
    timeline: Timeline,
    tips: Tips,
    *,
    clock: bool = False,
    zone: tzinfo = UTC,
    from_us: Micros | None = None,
    to_us: Micros | None = None,
    page: int = 1,
) -> "Figure":
    """Return a chart; call it within `picture.fixed_style`.

    Args:
        timeline: what happened.
        tips: takes what is told when something is pointed at.
        clock: the time of the day instead of the time since the first request.
        zone: of the clock.
        from_us: where it begins, counted from the first request.
        to_us: where it ends, likewise.
        page: which page, from 1.
    """
    plan = planned(timeline, COLUMNS, from_us=from_us, to_us=to_us, page=page)
    return _Chart(plan, tips).draw(clock, zone)


class _Chart:
    def __init__(self, plan: GanttChart, tips: Tips) -> None:
        from matplotlib.figure import Figure

        self.plan = plan
        self.tips = tips
        self.letters = letters_of(bar.name for bar in plan.bars)
        self.used: dict[str, str] = {}
        self.written: set[str] = set()
        """Actions whose name or letter stands somewhere."""
        self.lanes = max(1, sum(1 + sum(row.lanes for row in group.rows) for group in plan.groups))
        names = [self._name(row.name) for group in plan.groups for row in group.rows]
        self.left_in = 0.35 + 0.068 * max([7, *map(len, names)])
        self.figure = Figure(figsize=(WIDTH_IN, 1.0))
        self.canvas = agg(self.figure)
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.height = 1.0
        self._fit(0.0)

    def _fit(self, foot: float) -> None:
        """Give the chart its height and a foot of so many inches below; nothing in it changes its size."""
        inches = self.lanes * LANE_IN
        self.height = inches + TOP_IN + foot
        self.figure.set_size_inches(WIDTH_IN, self.height)
        width = 1 - (self.left_in + RIGHT_IN) / WIDTH_IN
        self.axes.set_position((self.left_in / WIDTH_IN, foot / self.height, width, inches / self.height))

    def draw(self, clock: bool, zone: tzinfo) -> "Figure":
        axes, plan = self.axes, self.plan
        axes.set_xlim(0, plan.end - plan.start)
        axes.set_ylim(self.lanes, 0)
        axes.set_yticks([])
        for side in ("top", "right", "left"):
            axes.spines[side].set_visible(False)
        axis = time_axis(plan.start, plan.end, 11, zero=plan.zero, clock=clock, zone=zone)
        axes.set_xticks([at - plan.start for at, _ in axis.marks], [text for _, text in axis.marks])
        axes.set_xlabel(axis.unit, labelpad=1)
        axes.grid(axis="x", color="#dddddd", linewidth=0.5)
        axes.set_axisbelow(True)
        y = 0
        for number, group in enumerate(plan.groups):
            y = self._group(number, group, y)
        if not plan.groups:
            self._say(0.02, 0.5, "nothing has happened yet")
        if plan.running:
            axes.axvline(plan.end - plan.start, color="#c00000", linewidth=1.5, clip_on=False)
            axes.text(1.0, 1.0, "now", transform=axes.transAxes, color="#c00000", ha="right", va="bottom", fontsize=7)
        self._foot()
        return self.figure

    def _foot(self) -> None:
        """Write what is below the axis: legend and note."""
        entries = self._entries()
        legend = 0.17 * -(-len(entries) // LEGEND_COLUMNS)
        foot = AXIS_IN + legend + (0.22 if self.plan.note else 0.08)
        self._fit(foot)
        if entries:
            self.figure.legend(
                handles=entries, loc="upper left", bbox_to_anchor=(0.01, (foot - AXIS_IN) / self.height),
                ncols=LEGEND_COLUMNS, fontsize=7, frameon=False, handlelength=1.8, handleheight=1.0,
                columnspacing=1.2, borderaxespad=0,
            )  # fmt: skip
        if self.plan.note:
            self.figure.text(
                0.012, 0.05 / self.height, cleaned(self.plan.note), fontsize=7, color="#444444", va="bottom"
            )

    def _group(self, number: int, group: Group, y: int) -> int:
        from matplotlib.patches import Rectangle

        axes, ink = self.axes, INKS[number % len(INKS)]
        rows = sum(row.lanes for row in group.rows)
        edge = -(self.left_in - 0.08) / (WIDTH_IN - self.left_in - RIGHT_IN)
        across = axes.get_yaxis_transform()
        axes.add_patch(
            Rectangle((edge, y), 1 - edge, 1, transform=across, color="#eeeeee", linewidth=0, clip_on=False, zorder=0.5)
        )
        axes.add_patch(
            Rectangle((edge, y), 0.008, 1 + rows, transform=across, color=ink, linewidth=0, clip_on=False, zorder=0.6)
        )
        axes.text(
            edge + 0.018, y + 0.5, cut(cleaned(group.title), 96, "…"), transform=across, va="center", weight="bold"
        )
        y += 1
        for row in group.rows:
            self._row(group, row, y)
            y += row.lanes
        return y

    def _row(self, group: Group, row: GanttRow, y: int) -> None:
        style: dict[str, Any] = {} if row.name else {"style": "italic", "color": "#555555"}
        self.axes.text(
            -0.008, y + row.lanes / 2, self._name(row.name), transform=self.axes.get_yaxis_transform(),
            ha="right", va="center", **style,
        )  # fmt: skip
        self.axes.axhline(y + row.lanes, color="#e8e8e8", linewidth=0.4, zorder=0.4)
        for rest in sorted(row.rests, key=lambda one: one.start - one.end):
            self._rest(group, rest, y)
        for bar in row.bars:
            self._bar(group, bar, y + bar.lane)

    def _rest(self, group: Group, rest: Rest, y: int) -> None:
        face, hatch = _RESTS.get(rest.kind, _RESTS["pending"])
        (bar,) = self.axes.barh(
            y + 0.5, rest.end - rest.start, 0.36, left=rest.start - self.plan.start,
            facecolor=face, edgecolor="#666666", linewidth=0.5, hatch=hatch, zorder=2,
        )  # fmt: skip
        bar.set_gid(self.tips.add(rest.tip, group.task))

    def _bar(self, group: Group, bar: Bar, y: int) -> None:
        face, hatch = _FACES[bar.kind]
        start = bar.start - self.plan.start
        width = max(bar.end - bar.start, (self.plan.end - self.plan.start) / 600)
        bad = bar.sign == "failed"
        (patch,) = self.axes.barh(
            y + 0.5, width, 0.78, left=start, facecolor=face, hatch=hatch, zorder=3,
            edgecolor="#c00000" if bad else "#333333", linewidth=1.4 if bad else 0.6,
        )  # fmt: skip
        patch.set_gid(self.tips.add(bar.tip, group.task))
        end = start + width
        if bar.sign:
            shape, inner = _MARKS[bar.sign]
            self.axes.plot(
                [end], [y + 0.5], shape, markersize=5, color=inner, markeredgecolor="#c00000" if bad else "#000000",
                markeredgewidth=0.8, zorder=5, clip_on=False,
            )  # fmt: skip
        letter = self.letters.get(bar.name, "") if bar.kind != "mixed" else ""
        room = self._pixels(width) - (8 if bar.sign else 5)
        for label in (bar.label, letter):
            if label and self._write(cleaned(label), start + width / 2, y, room, bool(hatch)):
                self.written.add(cleaned(bar.name))
                if label == letter != bar.label:
                    self.used[bar.name] = letter
                return

    def _write(self, label: str, x: float, y: int, room: float, hatched: bool) -> bool:
        text = self.axes.text(x, y + 0.52, label, ha="center", va="center", fontsize=7, zorder=4)
        if hatched:
            text.set_bbox({"facecolor": "white", "alpha": 0.85, "linewidth": 0, "pad": 0.8})
        if extent(text, self.canvas).width <= room:
            return True
        text.remove()
        return False

    def _pixels(self, us: float) -> float:
        return float(us / (self.plan.end - self.plan.start) * self.axes.get_window_extent().width)

    def _entries(self) -> list[Any]:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        bars = self.plan.bars
        entries: list[Any] = []
        for kind, word in KINDS.items():
            names = dict.fromkeys(cleaned(bar.name) for bar in bars if bar.kind == kind)
            untold = [name for name in names if name not in self.written] if kind != "mixed" else []
            if names:
                face, hatch = _FACES[kind]
                label = cut(f"{word} ({', '.join(untold)})" if untold else word, 34, "…")
                entries.append(Patch(facecolor=face, hatch=hatch, edgecolor="#333333", linewidth=0.6, label=label))
        for wait in self.plan.waits:
            face, hatch = _RESTS[wait]
            entries.append(Patch(facecolor=face, hatch=hatch, edgecolor="#666666", linewidth=0.5, label=WAITS[wait]))
        for sign, word in SIGNS.items():
            if any(bar.sign == sign for bar in bars):
                shape, ink = _MARKS[sign]
                entries.append(
                    Line2D([], [], marker=shape, color=ink, markeredgecolor="#000000", linestyle="", label=word)
                )
        letters = sorted(self.used.items(), key=lambda one: one[1])
        entries += [
            Line2D([], [], linestyle="", label=f"{letter}  {cut(cleaned(name), 20, '…')}") for name, letter in letters
        ]
        return entries

    def _say(self, x: float, y: float, text: str) -> None:
        self.axes.text(x, y, text, transform=self.axes.transAxes, va="center")

    @staticmethod
    def _name(name: str) -> str:
        return cut(cleaned(name), LABEL_MOST, "…") if name else "(waits)"
