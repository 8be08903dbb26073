"""A journal as tables for other programs: CSV always, Parquet with the extra `parquet`.

| table | a row is |
|---|---|
| `steps` | a step: what came in, which tasks it touched, what was answered |
| `tasks` | a task as it stood when the export ends, or at its end |
| `goals` | a goal of a task at its end, or as it stood last |
| `tracks` | a way point of an agent |
| `questions` | a question to people, with its answer |

Times are `unix_millis_...` of engine time.
"""

import csv
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Literal, assert_never

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError
from formiga_bt.base.extras import install
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.records import GoalRecord, Question
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal, Reply
from formiga_bt.journal.past import Past
from formiga_bt.journal.reading import Readable
from formiga_bt.journal.writer import tasks_of

Format = Literal["csv", "parquet"]
Cell = str | int | float | None
Row = Sequence[Cell]
BATCH: Final = 10_000
COLUMNS: Final[dict[str, dict[str, str]]] = {
    "steps": {
        "seq": "int", "unix_millis": "int", "input": "text", "tasks": "text", "changes": "int", "effects": "int",
        "reply": "text",
    },
    "tasks": {
        "task": "text", "name": "text", "version": "int", "bundle": "text", "status": "text", "code": "text",
        "reason": "text", "priority": "text", "requester": "text", "run": "int", "unix_millis_submitted": "int",
        "unix_millis_assigned": "int", "unix_millis_active": "int", "unix_millis_ended": "int",
    },
    "goals": {
        "goal": "text", "task": "text", "agent": "text", "action": "text", "state": "text", "code": "text",
        "unix_millis_ordered": "int", "unix_millis_sent": "int", "unix_millis_last": "int",
    },
    "tracks": {
        "agent": "text", "unix_millis": "int", "east_m": "float", "north_m": "float", "up_m": "float", "battery": "int",
    },
    "questions": {
        "number": "text", "task": "text", "kind": "text", "text": "text", "options": "text", "asked": "text",
        "answer": "text", "by": "text", "unix_millis_asked": "int", "unix_millis_answered": "int",
    },
}  # fmt: skip


def export(
    journal: Readable,
    folder: Path,
    *,
    form: Format = "csv",
    since: Micros = 0,
    until: Micros | None = None,
    what: Collection[str] = (),
) -> list[Path]:
    """Write tables of a journal into a folder; return the files.

    Args:
        journal: of the site.
        folder: is made; files of these names in it are replaced.
        form: of the files.
        since: engine time of the first row.
        until: engine time of the last; None = to the end.
        what: names of tables; none = all.

    Raises:
        JournalError: the journal cannot be read, or a file cannot be written.
    """
    rows: dict[str, Callable[[], Iterable[Row]]] = {
        "steps": lambda: _steps(journal, since, until),
        "tasks": lambda: _tasks(journal, since, until),
        "goals": lambda: _goals(journal, since, until),
        "tracks": lambda: _tracks(journal, since, until),
        "questions": lambda: _questions(journal, since, until),
    }
    write = _write_csv if form == "csv" else _parquet()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return [write(path, COLUMNS[path.stem], rows[path.stem]()) for path in paths(folder, form, what)]
    except OSError as error:
        raise JournalError(f"cannot write into {folder}: {error.strerror or error}") from error


def paths(folder: Path, form: Format = "csv", what: Collection[str] = ()) -> list[Path]:
    """Return the files that `export` writes."""
    return [folder / f"{name}.{form}" for name in COLUMNS if not what or name in what]


def _reply(reply: Reply | None) -> str:
    """Return a task's id, `done`, or the code and the text of a refusal."""
    match reply:
        case Accepted(task):
            return task
        case Done():
            return "done"
        case Refusal(code, text):
            return f"{code}: {text}"
        case None:
            return ""
        case _:
            assert_never(reply)


def _millis(at: Micros | None) -> int | None:
    return None if at is None else at // 1000


def _steps(journal: Readable, since: Micros, until: Micros | None) -> Iterator[Row]:
    for kept in journal.read(until=until):
        if kept.at >= since:
            step = kept.step
            touched = " ".join(tasks_of(step))
            yield (
                kept.seq,
                _millis(kept.at),
                kept.kind,
                touched,
                len(step.changes),
                len(step.effects),
                _reply(step.reply),
            )


def _tasks(journal: Readable, since: Micros, until: Micros | None) -> Iterator[Row]:
    tasks = dict(Past(journal).state(journal.first_snapshot_at()).tasks)
    for kept in journal.read(until=until):
        tasks.update({change.task.id: change.task for change in kept.step.changes if isinstance(change, ch.TaskPut)})
    for task in tasks.values():
        if task.times.ended_at is None or task.times.ended_at >= since:
            request, outcome, times = task.request, task.outcome, task.times
            yield (
                task.id, task.name, request.version, request.bundle, task.status, outcome.code, outcome.reason,
                request.priority, request.by, task.run, _millis(times.submitted_at), _millis(times.assigned_at),
                _millis(times.active_at), _millis(times.ended_at),
            )  # fmt: skip


def _goals(journal: Readable, since: Micros, until: Micros | None) -> Iterator[Row]:
    open_: dict[str, tuple[GoalRecord, Micros]] = {}
    for kept in journal.read(until=until):
        for change in kept.step.changes:
            if isinstance(change, ch.GoalPut):
                open_[change.goal.id] = (change.goal, kept.at)
            elif isinstance(change, ch.GoalDrop) and change.goal in open_:
                goal, last = open_.pop(change.goal)
                if last >= since:
                    yield _goal(goal, last)
    for goal, last in open_.values():
        if last >= since:
            yield _goal(goal, last)


def _goal(goal: GoalRecord, last: Micros) -> Row:
    return (
        goal.id, goal.task, goal.agent, goal.action, goal.state, goal.code,
        _millis(goal.at), _millis(goal.sent_at), _millis(last),
    )  # fmt: skip


def _questions(journal: Readable, since: Micros, until: Micros | None) -> Iterator[Row]:
    found: dict[str, tuple[Question, Micros | None]] = {}
    for kept in journal.read(until=until):
        for change in kept.step.changes:
            if isinstance(change, ch.QuestionPut):
                one = change.question
                was = found.get(one.id)
                answered = kept.at if one.reply is not None and (was is None or was[0].reply is None) else None
                found[one.id] = (one, answered if answered is not None or was is None else was[1])
    for one, at in found.values():
        if one.asked_at >= since or (at or 0) >= since:
            reply = one.reply or {}
            yield (
                one.number, one.task, one.kind, one.text, " ".join(one.options), " ".join(one.asked),
                str(reply.get("answer", "")), str(reply.get("by", "")), _millis(one.asked_at),
                _millis(at) if one.reply is not None else None,
            )  # fmt: skip


def _tracks(journal: Readable, since: Micros, until: Micros | None) -> Iterator[Row]:
    for agent, point in journal.way(since=since, until=until):
        at = point.position
        where = (None, None, None) if at is None else (at.east_m, at.north_m, at.up_m)
        yield (agent, _millis(point.at), *where, point.battery)


# -- files -------------------------------------------------------------------------------------------------------------
def _write_csv(path: Path, columns: dict[str, str], rows: Iterable[Row]) -> Path:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)
    return path


def _parquet() -> Callable[[Path, dict[str, str], Iterable[Row]], Path]:
    try:
        pa: Any = import_module("pyarrow")
        pq: Any = import_module("pyarrow.parquet")
    except ModuleNotFoundError as error:
        raise JournalError(
            "Parquet needs pyarrow, which is not installed", help=f"{install('parquet')}\n        or export CSV"
        ) from error
    kinds: dict[str, Any] = {"int": pa.int64(), "float": pa.float64(), "text": pa.string()}

    def write(path: Path, columns: dict[str, str], rows: Iterable[Row]) -> Path:
        schema = pa.schema([(name, kinds[kind]) for name, kind in columns.items()])
        with pq.ParquetWriter(path, schema) as file:
            for batch in _batches(rows):
                arrays = [list(column) for column in zip(*batch, strict=True)]
                file.write_table(pa.table(dict(zip(columns, arrays, strict=True)), schema=schema))
        return path

    return write


def _batches(rows: Iterable[Row]) -> Iterator[list[Row]]:
    batch: list[Row] = []
    for row in rows:
        batch.append(row)
        if len(batch) >= BATCH:
            yield batch
            batch = []
    if batch:
        yield batch
