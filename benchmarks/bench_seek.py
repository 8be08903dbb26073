"""How long a look at any moment of a week takes: 50 agents that report each second, 500 tasks a day.

    python benchmarks/bench_seek.py [--days 7] [--minutes 60] [--seeks 40] [--folder DIR]

One hour is worked really, on the virtual clock, and journaled as `formiga up` does it. What was kept of it (steps, way points)
is then repeated with shifted times, numbers and names of tasks until the week is full, with snapshots where the writer makes
them. Then the site is looked at, at moments spread over the week, each time with nothing remembered: the state that a snapshot
and the steps after it fold to, the whole of `formiga watch`, and one task. Beside them stands a bare SQLite read of as many
bytes of the same file.
"""

import argparse
import random
import re
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.bench_journal import site_at_work, writer_of
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.engine.kernel.inputs import EngineStep, Submit
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.engine.kernel.state import EngineState, fold
from formiga_bt.journal.keep import stats
from formiga_bt.journal.records import KeptStep, StepRow
from formiga_bt.journal.store import Journal
from formiga_bt.journal.thin import Block, TrackPoint
from formiga_bt.journal.writer import tasks_of
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.show.replay.machine import TimeMachine
from formiga_bt.show.replay.source import JournalSource

A_DAY = 500
SNAPSHOT_STEPS = 2000
SNAPSHOT_US = 3600 * SECOND
BATCH = 500
OLD = 900_000_000_000
"""Numbers above are instants: engine time of a rehearsal begins there."""
ID = re.compile(r"\b(PickUp|MoveTask)-(\d+)")
SITE = "bench"


def really(path: Path, minutes: float) -> tuple[list[KeptStep], list[tuple[str, TrackPoint]], EngineState, int, float]:
    """Work for so long; return what was kept, the state before, how many tasks there were, and the seconds that it took."""
    world, specs = site_at_work()
    world.run_for(30.0)
    pickers = [spec for spec in specs if spec.type == "picker"]
    light = [spec for spec in specs if spec.type == "lwd"]
    count = max(1, round(A_DAY * minutes / (24 * 60)))
    every_us = round(minutes * 60 * SECOND / count)
    for n in range(count):
        target = pickers[n % len(pickers)]
        assert isinstance(target.at, Place)
        given = Submit("PickUp", {"target": target.at, "user": AgentRef(target.id)})
        if n % 2:
            given = Submit("MoveTask", {"robot": AgentRef(light[n % len(light)].id)})
        world.scheduler.call_at(world.now + n * every_us, partial(_feed, world, given))
    with Journal(path, SITE, durability="normal") as journal:
        journal.take()
        state = world.engine.state
        writer = writer_of(journal, state)
        writer.begin()
        batch: list[EngineStep] = []

        def keep(step: EngineStep) -> None:
            batch.append(step)
            if len(batch) >= 50:
                writer.keep(batch)
                batch.clear()

        world.driver.listeners.append(keep)
        began = time.perf_counter()
        world.run_for(minutes * 60)
        writer.keep(batch)
        writer.end()
        took = time.perf_counter() - began
        before = journal.snapshot_at(journal.first_snapshot_at())
        assert before is not None
        return list(journal.read()), sorted(journal.way(), key=lambda one: one[1].seq), before, count, took


def _feed(world: Rehearsal, given: Submit) -> None:
    world.driver.feed(given)


def shifted(value: Any, us: int, tasks: int) -> Any:
    """Return a value of plain data with instants and numbers of tasks that much later."""
    if type(value) is int:
        return value + us if value > OLD else value
    if type(value) is str:
        if "-" not in value:
            return value
        return ID.sub(lambda found: f"{found[1]}-{int(found[2]) + tasks}", value)
    if type(value) is dict:
        return {shifted(key, us, tasks): shifted(one, us, tasks) for key, one in value.items()}
    if type(value) in (list, tuple):
        return [shifted(one, us, tasks) for one in value]
    return value


def week(path: Path, hours: int, minutes: float) -> tuple[str, list[str]]:
    """Fill a journal; return how that was done, and the ids of its tasks."""
    began = time.perf_counter()
    kept, points, state, count, took = really(path.with_name("hour.db"), minutes)
    journal = Journal(path, SITE, durability="normal")
    journal.take()
    journal.teach([one.step for one in kept[:1000]])
    journal.begin(state, 0)
    board, span, first = Blackboard(), round(minutes * 60 * SECOND), kept[0].seq - 1
    width = kept[-1].seq - first + 1
    snap_at, since = state.now, 0
    ids: list[str] = []
    for turn in range(hours):
        us, seqs = turn * span, turn * width
        stored: Iterator[StepRow] = iter(_rows(journal, kept, us, seqs, turn * count, state, board, ids))
        while batch := list(islice(stored, BATCH)):
            journal.append(batch)
            since += len(batch)
            if since >= SNAPSHOT_STEPS or state.now - snap_at >= SNAPSHOT_US:
                journal.snapshot(state, state.now)
                snap_at, since = state.now, 0
        journal.append((), list(_blocks(points, us, seqs)))
    journal.close()
    whole = time.perf_counter() - began
    text = (
        f"{minutes:.0f} minutes were worked really ({took:.0f} s), with {count} tasks; what was kept of them was repeated "
        f"{hours} times with shifted times ({whole:.0f} s in all)"
    )
    return text, ids


def _rows(
    journal: Journal,
    kept: list[KeptStep],
    us: int,
    seqs: int,
    tasks: int,
    state: EngineState,
    board: Blackboard,
    ids: list[str],
) -> Iterator[StepRow]:
    for one in kept:
        plain = shifted(msgspec.to_builtins(one.step, builtin_types=()), us, tasks)
        step = msgspec.convert(plain, EngineStep)
        step = msgspec.structs.replace(step, seq=one.seq + seqs)
        blob = journal.codec.encode(step)
        step = journal.codec.decode(blob)  # what is of any type comes back as it was
        fold(state, board, step)
        if isinstance(step.reply, Accepted):
            ids.append(step.reply.task)
        yield StepRow(step.seq, step.at, step.at, one.kind, tasks_of(step), blob)


def _blocks(points: list[tuple[str, TrackPoint]], us: int, seqs: int) -> Iterator[Block]:
    """Return the way points in blocks of ten seconds, as the writer makes them."""
    open_: dict[str, list[TrackPoint]] = {}
    for agent, point in points:
        moved = msgspec.structs.replace(
            point, seq=point.seq + seqs, at=point.at + us, stamp=point.stamp + us, wall=point.wall + us
        )
        mine = open_.setdefault(agent, [])
        if mine and moved.at - mine[0].at >= 10 * SECOND:
            yield Block(agent, tuple(mine))
            mine.clear()
        mine.append(moved)
    yield from (Block(agent, tuple(mine)) for agent, mine in open_.items() if mine)


# -- measuring ---------------------------------------------------------------------------------------------------------
def bare(machine: TimeMachine, at: int) -> float:
    """Return the seconds of a plain SQLite read of the snapshot and the steps that a look at a moment needs."""
    connection = machine.journal.database.engine.connect()
    raw: Any = connection.connection.dbapi_connection
    number = machine.journal.number
    began = time.perf_counter()
    seq = raw.execute(
        "SELECT seq, blob FROM formiga_snapshots WHERE site = ? AND at_us <= ? ORDER BY epoch DESC, seq DESC LIMIT 1",
        (number, at),
    ).fetchone()[0]
    last = machine.journal.seq_at(at)
    raw.execute(
        "SELECT seq, at_us, kind, blob FROM formiga_steps WHERE site = ? AND seq > ? AND seq <= ?", (number, seq, last)
    ).fetchall()
    took = time.perf_counter() - began
    connection.close()
    return took


def timed(look: Callable[[], object]) -> float:
    """Return the seconds that a look takes."""
    began = time.perf_counter()
    look()
    return time.perf_counter() - began


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=float, default=7.0)
    parser.add_argument("--minutes", type=float, default=60.0, help="worked really")
    parser.add_argument("--seeks", type=int, default=40)
    parser.add_argument("--folder", type=Path, default=None, help="on the disk that is to be measured")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        path = Path(name) / "journal.db"
        how, ids = week(path, max(1, round(options.days * 24 * 60 / options.minutes)), options.minutes)
        print(how)
        with TimeMachine(path, SITE) as machine:
            found = stats(machine.journal)
            days = (machine.last - machine.first) / (86_400 * SECOND)
            whole = (found.bytes_file or 0) / 1e6
            print(
                f"{days:.1f} days: {len(ids)} tasks, {found.steps} steps, {found.points} way points, "
                f"{found.snapshots} snapshots"
            )
            print(f"{whole:.0f} MB, {whole / days:.0f} MB a day")
            choose = random.Random(1)
            moments = [choose.randrange(machine.first, machine.last) for _ in range(options.seeks)]
            looks: dict[str, Callable[[int], object]] = {
                "the state": machine.state,
                "the whole site, as formiga watch shows it": lambda at: JournalSource(machine, at).now(over=True),
            }
            for what, look in looks.items():
                mine = [timed(partial(look, at)) for at in moments]
                plain = [bare(machine, at) for at in moments]
                tell(what, mine, plain)
            tasks = choose.sample(ids, min(len(ids), options.seeks))
            tell(
                "one task of any day, at the end",
                [timed(partial(JournalSource(machine).task, one)) for one in tasks],
                None,
            )
    return 0


def tell(what: str, mine: list[float], plain: list[float] | None) -> None:
    """Print the times of a kind of look."""
    text = f"{what}: median {statistics.median(mine) * 1e3:.0f} ms, worst {max(mine) * 1e3:.0f} ms"
    if plain is not None:
        text += f"; a bare read of as many bytes: median {statistics.median(plain) * 1e3:.1f} ms"
        text += f", so {statistics.median(mine) / statistics.median(plain):.0f} times that"
    print(text)


if __name__ == "__main__":
    sys.exit(main())
