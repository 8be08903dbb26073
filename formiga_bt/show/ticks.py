"""Marks of an axis at round numbers, with texts in units that suit the span: for time, and for metres."""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros

STEPS_S: Final = (
    0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 10800, 21600, 43200, 86400,
    172800, 604800, 2592000, 31536000,
)  # fmt: skip
"""Distances of marks that people read easily, seconds."""
BY_SECONDS_S: Final = 120
"""Up to this span all is told in seconds."""


class Axis(Struct, frozen=True):
    """Marks at instants, with texts, and what their unit is."""

    marks: tuple[tuple[Micros, str], ...]
    unit: str


def time_axis(
    start: Micros, end: Micros, most: int, *, zero: Micros | None = None, clock: bool = False, zone: tzinfo = UTC
) -> Axis:
    """Return the marks of a span of engine time.

    Args:
        start: where the axis begins.
        end: where it ends.
        most: so many marks at most, at least 2.
        zero: what is counted from; default: `start`.
        clock: tell the time of the day instead.
        zone: of the clock.
    """
    origin = start if zero is None else zero
    span_s = max((end - start) / SECOND, 0.1)
    step_s = next((step for step in STEPS_S if span_s / step <= max(1, most - 1)), STEPS_S[-1])
    step = round(step_s * SECOND)
    base = _midnight(start, zone) if clock else origin
    first = base + -(-(start - base) // step) * step
    instants = list(range(first, end + 1, step))[: max(2, most) + 1]
    if clock:
        offset = datetime.fromtimestamp(start / SECOND, zone)
        form = "%H:%M" if step_s >= 60 else "%H:%M:%S"
        texts = [datetime.fromtimestamp(at // SECOND, zone).strftime(form) for at in instants]
        return Axis(tuple(zip(instants, texts, strict=True)), offset.strftime("%Y-%m-%d %Z").strip())
    end_s = (end - origin) / SECOND
    if end_s <= BY_SECONDS_S:
        form_of, unit = _in_seconds, "s"
    elif step_s >= 3600:
        form_of, unit = _in_hours, "h"
    elif step_s >= 60:
        form_of, unit = (_in_minutes, "min") if end_s < 7200 else (_as_hours, "h:min")
    else:
        form_of, unit = (_as_minutes, "min:s") if end_s < 7200 else (_as_all, "h:min:s")
    return Axis(tuple((at, form_of((at - origin) / SECOND)) for at in instants), unit)


def lasted(us: Micros) -> str:
    """Return a span in words: `8.4 s`, `1 min 40 s`, `2 h 05 min`."""
    seconds = us / SECOND
    if seconds < 99.95:
        return f"{round(seconds, 1):g} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def metre_step(span_m: float, most: int) -> float:
    """Return a round distance of which at most `most` fit into a span."""
    step = 0.1
    while True:
        for factor in (1.0, 2.0, 5.0):
            if span_m / (step * factor) <= most:
                return round(step * factor, 6)
        step *= 10.0


def spread(instants: Iterable[tuple[float, str]], gap: int, width: int) -> list[tuple[int, str]]:
    """Return those texts of an axis that fit on one line of `width` columns with `gap` columns between them."""
    found: list[tuple[int, str]] = []
    free = 0
    for column, text in instants:
        at = max(0, min(round(column), width - len(text)))
        if at >= free and len(text) <= width:
            found.append((at, text))
            free = at + len(text) + gap
    return found


def _midnight(at: Micros, zone: tzinfo) -> Micros:
    day = datetime.fromtimestamp(at / SECOND, zone).replace(hour=0, minute=0, second=0, microsecond=0)
    return round((day - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(microseconds=1))


def _in_seconds(s: float) -> str:
    return f"{round(s, 1):g}"


def _in_minutes(s: float) -> str:
    return f"{round(s / 60, 1):g}"


def _in_hours(s: float) -> str:
    return f"{round(s / 3600, 1):g}"


def _as_minutes(s: float) -> str:
    return f"{_sign(s)}{int(abs(s)) // 60}:{int(abs(s)) % 60:02d}"


def _as_hours(s: float) -> str:
    return f"{_sign(s)}{int(abs(s)) // 3600}:{int(abs(s)) % 3600 // 60:02d}"


def _as_all(s: float) -> str:
    return f"{_sign(s)}{int(abs(s)) // 3600}:{int(abs(s)) % 3600 // 60:02d}:{int(abs(s)) % 60:02d}"


def _sign(s: float) -> str:
    return "-" if s < 0 else ""
