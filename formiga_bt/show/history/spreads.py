"""How long things took, from a ledger: tasks, waits, actions, the gaps between them, answers; quartiles by numpy."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.show.facts import Spread, Stats
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.history.rows import ActionRow

TAKEN_BACK: Final = frozenset({"withdrawn", "canceled", "superseded", "again", "interrupted"})
"""Ends of actions that are neither good nor bad."""
WELL: Final = frozenset({"succeeded", "answered"})

Key = tuple[str, str]
"""Name and group."""


class Samples:
    """Durations and failures by name and group."""

    def __init__(self) -> None:
        self._took: dict[Key, list[float]] = defaultdict(list)
        self._failed: dict[Key, int] = defaultdict(int)

    def took(self, name: str, span: Micros, group: str = "") -> None:
        """Take something that ended well."""
        self._took[name, group].append(span / SECOND)

    def failed(self, name: str, group: str = "") -> None:
        """Take something that did not."""
        self._failed[name, group] += 1

    def spreads(self) -> tuple[Spread, ...]:
        """Return the spreads by name and group, in that order."""
        keys = sorted({*self._took, *self._failed})
        return tuple(_spread(key, self._took.get(key, ()), self._failed.get(key, 0)) for key in keys)


def _spread(key: Key, took: Iterable[float], failed: int) -> Spread:
    import numpy as np

    values = list(took)
    if not values:
        return Spread(name=key[0], group=key[1], n=0, failed=failed)
    least, q1, median, q3, most = (round(float(v), 3) for v in np.percentile(values, [0, 25, 50, 75, 100]))
    return Spread(
        name=key[0], group=key[1], n=len(values), failed=failed,
        least_s=least, q1_s=q1, median_s=median, q3_s=q3, most_s=most,
    )  # fmt: skip


def stats(ledger: Ledger, now: Micros, *, task: str = "", hours: float = 0.0) -> Stats:
    """Return the durations of what ended in the last hours, or since the start; `task`: of tasks of that name only.

    A task counts from its first step to its end; what it waited before is in `waits`.
    """
    state = ledger.state
    since = ledger.started_at if ledger.started_at is not None else now
    if hours > 0:
        since = max(since, now - round(hours * 3600 * SECOND))
    tasks, waits, actions, gaps, answers = (Samples() for _ in range(5))
    types = {agent.id: agent.type for agent in state.agents.values()}
    for record in state.tasks.values():
        if task and record.name != task:
            continue
        _task(record, since, tasks, waits)
        story = ledger.stories.get(record.id)
        rows = story.rows if story is not None else ()
        for row in rows:
            if row.end is not None and row.end >= since:
                _action(row, row.end, types, answers if row.action == CONFIRM else actions)
        for span in _gaps(rows, since):
            gaps.took(record.name, span)
    return Stats(
        since=since, at=now, tasks=tasks.spreads(), waits=waits.spreads(), actions=actions.spreads(),
        gaps=gaps.spreads(), answers=answers.spreads(),
    )  # fmt: skip


def _task(record: TaskRecord, since: Micros, tasks: Samples, waits: Samples) -> None:
    if record.times.active_at is not None and record.times.active_at >= since:
        waits.took(record.name, record.times.active_at - record.times.submitted_at)
    if record.times.ended_at is None or record.times.ended_at < since:
        return
    if record.status == "SUCCEEDED" and record.times.active_at is not None:
        tasks.took(record.name, record.times.ended_at - record.times.active_at)
    elif record.status == "FAILED":
        tasks.failed(record.name)


def _action(row: ActionRow, end: Micros, types: Mapping[str, str], into: Samples) -> None:
    name, group = (row.agent, "") if row.action == CONFIRM else (row.action, types.get(row.agent, ""))
    if row.state in WELL:
        into.took(name, end - row.start, group)
    elif row.state not in TAKEN_BACK:
        into.failed(name, group)


def _gaps(rows: Iterable[ActionRow], since: Micros) -> Iterator[Micros]:
    """Yield the time between the end of each action and the start of the next one of the same agent."""
    ended: dict[str, Micros] = {}
    for row in rows:
        if row.action == CONFIRM:
            continue
        before = ended.get(row.agent)
        if before is not None and row.start >= max(before, since):
            yield row.start - before
        if row.end is not None:
            ended[row.agent] = row.end
