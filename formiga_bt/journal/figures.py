"""What of a journal takes how much room, and what its retention would remove now."""

from typing import Any

import sqlalchemy as sa
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.journal import schema
from formiga_bt.journal.database import mapped
from formiga_bt.journal.keep import DAY_US, Retention
from formiga_bt.journal.reading import Readable


class StepCount(Struct, frozen=True):
    """Steps by the kind of their input, or another part of a journal."""

    name: str
    count: int
    bytes: int


def kinds(journal: Readable) -> list[StepCount]:
    """Return steps by kind, then way points and snapshots; the largest first. Without indices.

    Raises:
        JournalError: it cannot be read.
    """
    step, way, shot = schema.steps.c, schema.telemetry.c, schema.snapshots.c
    count = sa.func.count()
    with mapped(journal.where), journal.database.engine.connect() as connection:
        rows = connection.execute(
            sa.select(step.kind, count, sa.func.sum(sa.func.length(step.blob)))
            .where(step.site == journal.number).group_by(step.kind)
        ).all()  # fmt: skip
        points = connection.execute(
            sa.select(sa.func.sum(way.points), sa.func.sum(sa.func.length(way.blob))).where(way.site == journal.number)
        ).one()
        shots = connection.execute(
            sa.select(count, sa.func.sum(sa.func.length(shot.blob))).where(shot.site == journal.number)
        ).one()
    found = [StepCount(row[0], row[1], int(row[2] or 0)) for row in rows]
    found += [StepCount("(way points)", int(points[0] or 0), int(points[1] or 0))]
    found += [StepCount("(snapshots)", shots[0], int(shots[1] or 0))]
    return sorted((one for one in found if one.count), key=lambda one: (-one.bytes, one.name))


class Leaving(Struct, frozen=True):
    """What a compaction would remove."""

    steps: int = 0
    snapshots: int = 0
    points: int = 0
    bytes: int = 0
    """Of these, without indices."""
    tasks: frozenset[str] = frozenset()
    """Of which steps would go."""
    first: Micros | None = None
    """Engine time of the first step that would go; None: none would."""
    until: Micros | None = None
    """Engine time of the last."""

    @property
    def is_nothing(self) -> bool:
        """Return whether nothing would be removed."""
        return not (self.steps or self.points)


def leaving(journal: Readable, now: Micros, retention: Retention | None = None) -> Leaving:
    """Return what a compaction would remove now, and change nothing.

    Args:
        journal: of the site.
        now: engine time that ages are reckoned from.
        retention: see `keep.compact`.

    Raises:
        JournalError: it cannot be read.
    """
    rule = retention or Retention()
    step, way, shot = schema.steps.c, schema.telemetry.c, schema.snapshots.c
    cut = _cut(journal, now - round(rule.history_days * DAY_US)) if rule.history_days is not None else None
    gone: list[sa.ColumnElement[bool]] = []
    found = Leaving()
    with mapped(journal.where), journal.database.engine.connect() as connection:

        def one(query: sa.Select[Any]) -> Any:
            return connection.execute(query).one()

        if cut is not None:
            epoch, seq, _ = cut
            old = (step.site == journal.number) & (step.seq <= seq)
            steps, bytes_, first, until = one(
                sa.select(sa.func.count(), _length(step.blob), sa.func.min(step.at_us), sa.func.max(step.at_us)).where(
                    old
                )
            )
            older = (shot.site == journal.number) & ((shot.epoch < epoch) | ((shot.epoch == epoch) & (shot.seq < seq)))
            shots, more = one(sa.select(sa.func.count(), _length(shot.blob)).where(older))
            index = schema.step_tasks.c
            mine = sa.select(index.task).distinct().where(index.site == journal.number, index.seq <= seq)
            tasks = frozenset(connection.execute(mine).scalars())
            found = Leaving(steps, shots, 0, int(bytes_ + more), tasks, first, until)
            gone.append(way.to_seq <= seq)
        if rule.telemetry_days is not None:
            before = now - round(rule.telemetry_days * DAY_US)
            newest = one(sa.select(sa.func.max(shot.seq)).where(shot.site == journal.number, shot.at_us <= before))[0]
            if cut is not None and cut[2] <= before:  # the state of that moment will be a snapshot
                newest = max(newest or 0, cut[1])
            if newest is not None:
                gone.append((way.to_us < before) & (way.to_seq <= newest))
        if gone:
            points, bytes_ = one(
                sa.select(sa.func.coalesce(sa.func.sum(way.points), 0), _length(way.blob))
                .where(way.site == journal.number, sa.or_(*gone))
            )  # fmt: skip
            found = replace(found, points=int(points), bytes=found.bytes + int(bytes_))
    return found


def _length(blob: Any) -> Any:
    return sa.func.coalesce(sa.func.sum(sa.func.length(blob)), 0)


def _cut(journal: Readable, before: Micros) -> tuple[int, int, Micros] | None:
    """Return epoch, `seq` and time of the snapshot that takes the place of what is older; None: nothing is."""
    step, shot = schema.steps.c, schema.snapshots.c
    with mapped(journal.where), journal.database.engine.connect() as connection:
        base = connection.execute(
            sa.select(shot.epoch, shot.seq).where(shot.site == journal.number, shot.at_us <= before)
            .order_by(shot.epoch.desc(), shot.seq.desc()).limit(1)
        ).first()  # fmt: skip
        oldest = connection.execute(sa.select(sa.func.min(step.at_us)).where(step.site == journal.number)).scalar()
    if base is None or oldest is None or oldest > before:
        return None
    return base.epoch, max(base.seq, journal.seq_at(before)), before
