"""What of a journal takes how much room, and what its retention would remove now."""

import sqlalchemy as sa
from msgspec import Struct

from formiga_bt.clock import Micros
from formiga_bt.journal import schema
from formiga_bt.journal.database import mapped
from formiga_bt.journal.keep import DAY_US, Removed, Retention
from formiga_bt.journal.reading import Readable


class Kind(Struct, frozen=True):
    """Steps by the kind of their input, or another part of a journal."""

    name: str
    count: int
    bytes: int


def kinds(journal: Readable) -> list[Kind]:
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
    found = [Kind(row[0], row[1], int(row[2] or 0)) for row in rows]
    found += [Kind("(way points)", int(points[0] or 0), int(points[1] or 0))]
    found += [Kind("(snapshots)", shots[0], int(shots[1] or 0))]
    return sorted((one for one in found if one.count), key=lambda one: (-one.bytes, one.name))


def leaving(journal: Readable, now: Micros, retention: Retention | None = None) -> Removed:
    """Return about how much a compaction would remove now.

    Args:
        journal: of the site.
        now: engine time that ages are reckoned from.
        retention: see `keep.compact`.

    Raises:
        JournalError: it cannot be read.
    """
    rule = retention or Retention()
    step, way, shot = schema.steps.c, schema.telemetry.c, schema.snapshots.c
    count = sa.func.count()
    steps = snapshots = points = 0
    with mapped(journal.where), journal.database.engine.connect() as connection:
        if rule.history_days is not None:
            before = now - round(rule.history_days * DAY_US)
            old = (step.site == journal.number) & (step.at_us <= before)
            steps = connection.execute(sa.select(count).where(old)).scalar() or 0
            aged = (shot.site == journal.number) & (shot.at_us <= before)
            snapshots = max(0, (connection.execute(sa.select(count).where(aged)).scalar() or 0) - 1)
        days = [one for one in (rule.history_days, rule.telemetry_days) if one is not None]
        if days:
            before = now - round(min(days) * DAY_US)
            newest = sa.select(sa.func.max(shot.seq)).where(shot.site == journal.number).scalar_subquery()
            gone = (way.site == journal.number) & (way.to_us < before) & (way.to_seq <= newest)
            points = int(connection.execute(sa.select(sa.func.sum(way.points)).where(gone)).scalar() or 0)
    return Removed(steps, snapshots if steps else 0, points)
