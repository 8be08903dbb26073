"""Which bar goes where: a `Timeline` as groups (tasks), rows (agents) and lanes, for `text` and `figure`.

Actions too short to be seen one by one are drawn as one bar with their number; what went wrong in it still shows.
"""

from collections.abc import Iterable, Sequence
from typing import Final, Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import UnusableFile
from formiga_bt.show.facts import ActionFact, TaskFact, Timeline, Waiting
from formiga_bt.show.ticks import lasted

Kind = Literal["rise", "move", "work", "ask", "stop", "mixed"]
KINDS: Final[dict[Kind, str]] = {
    "rise": "take off, land",
    "move": "move",
    "work": "work",
    "ask": "ask a person",
    "stop": "stop",
    "mixed": "several",
}
"""Kinds of actions, and what a legend calls them."""
WAITS: Final[dict[str, str]] = {
    "pending": "waits for agents",
    "question": "waits for an answer",
    "gate": "waits at the gate",
    "held": "held",
}
Sign = Literal["", "failed", "canceled", "running"]
SIGNS: Final[dict[Sign, str]] = {"failed": "failed", "canceled": "canceled", "running": "runs"}
MANY: Final = 40
"""More than so many actions in one bar, and it is told how to see them."""
PAGE: Final = 60
"""Rows of one picture."""

_WELL = frozenset({"succeeded", "answered", "again"})
_CANCELED = frozenset({"canceled", "withdrawn", "superseded", "interrupted"})
_WORST: dict[Sign, int] = {"": 0, "running": 1, "canceled": 2, "failed": 3}


class Bar(Struct, frozen=True, kw_only=True):
    """An action, or several short ones."""

    name: str
    kind: Kind
    start: Micros
    end: Micros
    sign: Sign = ""
    count: int = 1
    tip: str = ""
    lane: int = 0

    @property
    def label(self) -> str:
        """Return what stands on it, if there is room."""
        return self.name if self.count == 1 else f"{self.name} ×{self.count}"


class Rest(Struct, frozen=True, kw_only=True):
    """A span of waiting."""

    kind: str
    start: Micros
    end: Micros
    tip: str = ""


class GanttRow(Struct, frozen=True, kw_only=True):
    """An agent in a task; without a name: what the task itself waits for."""

    name: str
    bars: tuple[Bar, ...]
    rests: tuple[Rest, ...] = ()
    lanes: int = 1


class Group(Struct, frozen=True, kw_only=True):
    """A task with its rows."""

    task: str
    status: str
    title: str
    rows: tuple[GanttRow, ...]


class GanttChart(Struct, frozen=True, kw_only=True):
    """All that is drawn."""

    zero: Micros
    """When the first task was requested: what times are counted from."""
    start: Micros
    end: Micros
    running: bool
    """Something runs, and the end is now."""
    groups: tuple[Group, ...]
    page: int
    pages: int
    note: str = ""
    """What is not shown, and how to see it."""

    @property
    def bars(self) -> list[Bar]:
        """Return all bars."""
        return [bar for group in self.groups for row in group.rows for bar in row.bars]

    @property
    def waits(self) -> list[str]:
        """Return the kinds of waiting that are drawn, in the order of the legend."""
        drawn = {rest.kind for group in self.groups for row in group.rows for rest in row.rests}
        return [kind for kind in WAITS if kind in drawn]


def sign_of(action: ActionFact) -> Sign:
    """Return how an action ended."""
    if action.end is None:
        return "running"
    if action.state in _WELL or not action.state:
        return ""
    return "canceled" if action.state in _CANCELED else "failed"


def planned(
    timeline: Timeline,
    columns: int,
    *,
    from_us: Micros | None = None,
    to_us: Micros | None = None,
    page: int = 1,
    rows: int = PAGE,
) -> GanttChart:
    """Lay a timeline out.

    Args:
        timeline: what happened.
        columns: how many spans of time can be told apart; what is shorter is put together.
        from_us: where the picture begins, counted from the first request.
        to_us: where it ends, likewise.
        page: which page, from 1.
        rows: so many rows on a page.

    Raises:
        UnusableFile: there is no such page, or the span is empty.
    """
    zero, least, most, running = _span(timeline)
    start = least if from_us is None else zero + from_us
    end = most if to_us is None else zero + to_us
    if end <= start and not (from_us is None and to_us is None):
        raise UnusableFile(f"nothing happened in that span: the chart goes from 0 to {lasted(most - zero)}")
    end = max(end, start + 1)
    groups = _groups(timeline, start, end, (end - start) / max(1, columns), most)
    pages = _pages(groups, rows)
    if not 1 <= page <= len(pages):
        raise UnusableFile(f"there is no page {page}; the chart has {len(pages)}")
    notes = []
    if len(pages) > 1:
        agents = sum(len(group.rows) for group in groups)
        notes.append(f"page {page} of {len(pages)} ({agents} rows): --page N shows another, task ids show less")
    if any(bar.count > MANY for group in pages[page - 1] for row in group.rows for bar in row.bars):
        notes.append("short actions are put together: --from and --to show a part")
    note = "; ".join(notes)
    return GanttChart(
        zero=zero, start=start, end=end, running=running and end >= most, groups=tuple(pages[page - 1]), page=page,
        pages=len(pages), note=note,
    )  # fmt: skip


def _span(timeline: Timeline) -> tuple[Micros, Micros, Micros, bool]:
    """Return the zero of the axis, the first and the last instant, and whether something runs."""
    running = any(not task.is_over for task in timeline.tasks) or any(a.end is None for a in timeline.actions)
    begins = [task.submitted_at for task in timeline.tasks] or [a.start for a in timeline.actions]
    begins += [wait.start for wait in timeline.waits] if not begins else []
    zero = min(begins, default=timeline.at)
    ends = [task.ended_at for task in timeline.tasks if task.ended_at is not None]
    ends += [a.end for a in timeline.actions if a.end is not None]
    ends += [wait.end for wait in timeline.waits if wait.end is not None]
    most = timeline.at if running else max(ends, default=timeline.at)
    least = min([zero, *(a.start for a in timeline.actions), *(w.start for w in timeline.waits)])
    return zero, least, max(most, least), running


def _groups(timeline: Timeline, start: Micros, end: Micros, least: float, now: Micros) -> list[Group]:
    known = {task.id: task for task in timeline.tasks}
    others = [*(action.task for action in timeline.actions), *(wait.task for wait in timeline.waits)]
    ids = [*known, *dict.fromkeys(t for t in others if t not in known)]
    actions: dict[str, list[ActionFact]] = {}
    waits: dict[str, list[Waiting]] = {}
    for action in timeline.actions:
        if action.start <= end and (now if action.end is None else action.end) >= start:
            actions.setdefault(action.task, []).append(action)
    for wait in timeline.waits:
        if wait.start < end and (now if wait.end is None else wait.end) > start:
            waits.setdefault(wait.task, []).append(wait)
    groups = []
    for task_id in ids:
        rows = _rows(actions.get(task_id, []), waits.get(task_id, []), start, end, least, now)
        task = known.get(task_id)
        inside = task is None or (task.submitted_at <= end and (task.ended_at or now) >= start)
        if rows or (inside and task is not None):
            title = _title(task, now) if task is not None else task_id or "without a task"
            groups.append(
                Group(task=task_id, status=task.status if task is not None else "", title=title, rows=tuple(rows))
            )
    return groups


def _title(task: TaskFact, now: Micros) -> str:
    held = " HELD" if task.held and not task.is_over else ""
    code = f" ({task.code})" if task.code else ""
    took = lasted((task.ended_at or now) - task.submitted_at)
    words = f" after {took}" if task.is_over else f", requested {took} ago"
    return f"{task.id}  {task.status}{held}{code}{words}"


def _rows(
    actions: Sequence[ActionFact], waits: Sequence[Waiting], start: Micros, end: Micros, least: float, now: Micros
) -> list[GanttRow]:
    """Return the task's own row, if it waited, and one for each agent; a question is the task's wait, whoever is asked."""
    own = _rests((wait for wait in waits if _is_own(wait)), start, end, now, least)
    rows = [GanttRow(name="", bars=(), rests=own)] if own else []
    agents = dict.fromkeys([*(a.agent for a in actions), *(w.agent for w in waits if not _is_own(w))])
    for agent in agents:
        bars = _laned(_merged(_bars((a for a in actions if a.agent == agent), start, end, now), least))
        rests = _rests((wait for wait in waits if wait.agent == agent and not _is_own(wait)), start, end, now, least)
        lanes = 1 + max((bar.lane for bar in bars), default=0)
        rows.append(GanttRow(name=agent, bars=tuple(bars), rests=rests, lanes=lanes))
    return rows


def _is_own(wait: Waiting) -> bool:
    return not wait.agent or wait.kind == "question"


def _bars(actions: Iterable[ActionFact], start: Micros, end: Micros, now: Micros) -> list[Bar]:
    bars = []
    for a in sorted(actions, key=lambda action: action.start):
        stop = now if a.end is None else max(a.end, a.start)
        how = "runs" if a.end is None else " ".join(dict.fromkeys(word for word in (a.state, a.code) if word))
        tip = ", ".join(
            word for word in (f"{a.agent}: {a.action} {a.detail}".rstrip(), how, lasted(stop - a.start)) if word
        )
        sign, kind = sign_of(a), a.does or "work"
        bars.append(Bar(name=a.action, kind=kind, start=max(a.start, start), end=min(stop, end), sign=sign, tip=tip))
    return bars


def _merged(bars: list[Bar], least: float) -> list[Bar]:
    """Put neighbours together of which each is too short to be seen by itself."""
    found: list[Bar] = []
    for bar in bars:
        last = found[-1] if found else None
        if last is None or not (_is_short(bar, least) and _is_run(last, least) and 0 <= bar.start - last.end < least):
            found.append(bar)
            continue
        same = last.name == bar.name
        found[-1] = Bar(
            name=last.name if same else "several",
            kind=last.kind if last.kind == bar.kind else "mixed",
            start=last.start,
            end=max(last.end, bar.end),
            sign=max(last.sign, bar.sign, key=_WORST.__getitem__),
            count=last.count + 1,
            tip=_tip(last, bar),
        )
    return found


def _tip(last: Bar, bar: Bar) -> str:
    lines = [*(last.tip.split("\n") if last.tip else []), bar.tip]
    return "\n".join([*lines[:8], "..."] if len(lines) > 8 else lines)


def _is_short(bar: Bar, least: float) -> bool:
    return bar.end - bar.start < 2 * least


def _is_run(bar: Bar, least: float) -> bool:
    return bar.count > 1 or _is_short(bar, least)


def _laned(bars: list[Bar]) -> list[Bar]:
    """Give each bar the first lane in which it overlaps none."""
    free: list[Micros] = []
    found = []
    for bar in bars:
        lane = next((i for i, at in enumerate(free) if at <= bar.start), len(free))
        free[lane:] = [bar.end, *free[lane + 1 :]]
        found.append(replace(bar, lane=lane))
    return found


def _rests(waits: Iterable[Waiting], start: Micros, end: Micros, now: Micros, least: float) -> tuple[Rest, ...]:
    return tuple(
        Rest(
            kind=wait.kind, start=max(wait.start, start), end=min(stop, end),
            tip=f"{WAITS.get(wait.kind, wait.kind)}{f': {wait.text}' if wait.text else ''}, {lasted(stop - wait.start)}",
        )
        for wait in waits
        if (stop := now if wait.end is None else wait.end) - wait.start > least / 4
    )  # fmt: skip


def _pages(groups: list[Group], rows: int) -> list[list[Group]]:
    """Cut groups into pages of at most so many rows; a task that goes over is continued under its title."""
    pages: list[list[Group]] = [[]]
    room = rows
    for group in groups:
        left = list(group.rows)
        first = True
        while left or first:
            if room < min(2, rows):
                pages.append([])
                room = rows
            take, left = left[: max(1, room - 1)], left[max(1, room - 1) :]
            title = group.title if first else f"{group.title} (continued)"
            pages[-1].append(Group(task=group.task, status=group.status, title=title, rows=tuple(take)))
            room -= len(take) + 1
            first = False
    return pages
