"""Moments as people write them: `10:15`, `-5 min`, `PickUp-3 end`, `2026-07-01 10:15`, `start`."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros, micros
from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.units import parse_quantity
from formiga_bt.engine.kernel.records import TaskRecord

FORMS: Final = (
    '10:15, 10:15:30, "2026-07-01 10:15", "-5 min" (before the end), "PickUp-3 end", "PickUp-3 start +30 s", start, end'
)
_TIME: Final = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:\.\d+)?))?")
_SHIFT: Final = re.compile(r"\s*([+-])\s*(\d[\w. ]*[a-z%]+)\s*$")
_OF_TASK: Final = re.compile(r"(\S+?)(?:\s+(start|active|end))?")
_DAY: Final[Micros] = 86_400 * SECOND
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


class MomentWords(Struct, frozen=True):
    """What words for moments are reckoned from."""

    first: Micros
    last: Micros
    task: Callable[[str], TaskRecord | None]
    """Returns a task as it stood last."""
    zone: tzinfo = UTC


def moment(text: str, times: MomentWords, *, or_first: bool = False) -> Micros:
    """Return the moment that a text means, in engine time; after the end of the history it is its end.

    Args:
        text: see `FORMS`.
        times: what it is reckoned from.
        or_first: a moment before the history is its beginning, as the lower limit of a look has it.

    Raises:
        UnusableFile: it means none, or one before the history begins.
    """
    return min(meant(text, times, or_first=or_first), times.last)


def meant(text: str, times: MomentWords, *, or_first: bool = False) -> Micros:
    """Return the moment that a text means, also one after the end; see `moment`."""
    words, shift = text.strip(), 0
    cut = _SHIFT.search(words)
    if cut is not None:
        found = parse_quantity(cut[2].strip())
        if found is not None and found[0] == "duration":
            shift = micros(found[1]) * (1 if cut[1] == "+" else -1)
            words = words[: cut.start()].strip()
    base = times.last if not words and shift else _base(words, times)
    if base is None:
        raise UnusableFile(f"'{text}' is no moment that the journal knows", help=f"say for example {FORMS}")
    at = base + shift
    if at < times.first and not or_first:
        raise UnusableFile(
            f"'{text}' is {in_words(at, times.zone)}; the journal begins at {in_words(times.first, times.zone)}"
        )
    return max(times.first, at)


def _base(words: str, times: MomentWords) -> Micros | None:
    if words in ("start", "end"):
        return times.first if words == "start" else times.last
    clock = _TIME.fullmatch(words)
    if clock is not None:
        return _of_the_day(int(clock[1]), int(clock[2]), float(clock[3] or 0.0), times)
    try:
        day = datetime.fromisoformat(words)
    except ValueError:
        of_task = _OF_TASK.fullmatch(words)
        task = times.task(of_task[1]) if of_task is not None else None
        return _of_task(task, of_task[2] or "end", times) if of_task is not None and task is not None else None
    day = day if day.tzinfo is not None else day.replace(tzinfo=times.zone)
    return _us(day)


def _of_the_day(hour: int, minute: int, second: float, times: MomentWords) -> Micros | None:
    """Return the last such time of the day before the end; or the one after it, if the history has not the one before."""
    if hour > 23 or minute > 59 or second >= 60:
        return None
    end = _date(times.last, times.zone)
    day = end.replace(hour=hour, minute=minute, second=0, microsecond=0)
    at = _us(day) + micros(second)
    return at if at <= times.last or at - _DAY < times.first else at - _DAY


def _of_task(task: TaskRecord, which: str, times: MomentWords) -> Micros:
    if which == "start":
        return task.times.submitted_at
    if which == "active":
        return task.times.active_at if task.times.active_at is not None else task.times.submitted_at
    return task.times.ended_at if task.times.ended_at is not None else times.last


def _date(at: Micros, zone: tzinfo) -> datetime:
    return (_EPOCH + timedelta(microseconds=at)).astimezone(zone)


def _us(day: datetime) -> Micros:
    return round((day - _EPOCH) / timedelta(microseconds=1))


def in_words(at: Micros, zone: tzinfo) -> str:
    """Return a moment for people: `2026-07-01 10:15:30`."""
    return f"{_date(at, zone):%Y-%m-%d %H:%M:%S}"
