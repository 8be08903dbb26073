"""Moments as people write them."""

from datetime import UTC, datetime

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import UnusableFile
from formiga_bt.engine.kernel.records import TaskRecord, TaskRequest, TaskTimes
from formiga_bt.show.replay.when import MomentWords, in_words, meant, moment
from tests.golden import Wording


def us(text: str) -> int:
    return round(datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp() * SECOND)


TASK = TaskRecord(
    id="PickUp-3",
    name="PickUp",
    order=3,
    request=TaskRequest(bundle=""),
    times=TaskTimes(submitted_at=us("2026-07-01T09:00"), ended_at=us("2026-07-01T09:05")),
)
TIMES = MomentWords(us("2026-06-30T08:00"), us("2026-07-01T10:30"), {"PickUp-3": TASK}.get)


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ("10:15", "2026-07-01T10:15:00"),
        ("10:15:30.5", "2026-07-01T10:15:30.5"),
        ("11:00", "2026-06-30T11:00:00"),
        ("2026-06-30 12:00", "2026-06-30T12:00:00"),
        ("2026-06-30T12:00Z", "2026-06-30T12:00:00"),
        ("2026-06-30T12:00+03:00", "2026-06-30T09:00:00"),
        ("-5 min", "2026-07-01T10:25:00"),
        ("-90 s", "2026-07-01T10:28:30"),
        ("PickUp-3", "2026-07-01T09:05:00"),
        ("PickUp-3 end", "2026-07-01T09:05:00"),
        ("PickUp-3 end -5 s", "2026-07-01T09:04:55"),
        ("PickUp-3 start +1 min", "2026-07-01T09:01:00"),
        ("PickUp-3 active", "2026-07-01T09:00:00"),
        ("start", "2026-06-30T08:00:00"),
        ("end", "2026-07-01T10:30:00"),
        ("2030-01-01 10:00", "2026-07-01T10:30:00"),
    ],
)
def test_a_moment(text: str, at: str) -> None:
    """What is after the end is the end; a time of the day is the last one before it."""
    assert us(at) == moment(text, TIMES)


@pytest.mark.parametrize("text", ["", "noon", "25:00", "PickUp-9 end", "-5 m", "PickUp-3 soon"])
def test_what_is_none_is_told_with_what_is(text: str, wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        moment(text, TIMES)
    wording(refused.value)


def test_before_the_beginning_is_told(wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        moment("-3 h", MomentWords(us("2026-07-01T08:00"), TIMES.last, TIMES.task))
    wording(refused.value)
    assert in_words(TIMES.last, UTC) == "2026-07-01 10:30:00"


def test_a_moment_after_the_end_is_known() -> None:
    """A time of the day is the one after the end if the history has not the one before."""
    assert us("2030-01-01T10:00") == meant("2030-01-01 10:00", TIMES)
    assert us("2026-06-30T11:00") == meant("11:00", TIMES)
    times = MomentWords(us("2026-07-01T08:00"), TIMES.last, TIMES.task)
    assert us("2026-07-01T11:00") == meant("11:00", times)
    assert TIMES.last == moment("11:00", times)


def test_a_lower_limit_before_the_beginning_is_the_beginning() -> None:
    times = MomentWords(us("2026-07-01T08:00"), TIMES.last, TIMES.task)
    assert moment("-7 d", times, or_first=True) == us("2026-07-01T08:00")
    assert moment("-1 h", times, or_first=True) == us("2026-07-01T09:30")
