"""Times of the day: `06:30`, `today('06:30')`, `sunrise(base)`, `sunset(base)`, on the civil day of `now` in the site's zone.

Pure functions of the environment; registered as helpers in `helpers`. Their value jumps at midnight, so a live condition that
reads one is looked at then (`instants`); between two midnights it is constant.
"""

import re
from datetime import UTC, datetime, time, timedelta
from typing import TYPE_CHECKING, Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place
from formiga_bt.base.sun import daylight
from formiga_bt.lang.model import Dependency, Env, EvalError, Unset

if TYPE_CHECKING:
    from zoneinfo import ZoneInfo

TODAY: Final = Dependency("today")
"""What an expression reads that depends on the day of `now`, and on nothing else of it."""

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_CLOCK: Final = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}))?", re.ASCII)


def time_of_day(text: str) -> time | None:
    """Return the time that a text such as `6:30` or `21:05:30` is, or None."""
    found = _CLOCK.fullmatch(text.strip())
    if found is None:
        return None
    hour, minute, second = (int(part or 0) for part in found.groups())
    return time(hour, minute, second) if hour < 24 and minute < 60 and second < 60 else None


def why_no_time_of_day(text: object) -> str:
    """Return why a text is no time of the day, or ""."""
    return "" if time_of_day(str(text)) is not None else f"'{text}' is no time of the day, such as '06:30'"


def today(env: Env, text: str) -> Micros:
    """Return this time of the day, on the day of `now`."""
    at = time_of_day(text)
    if at is None:
        raise EvalError(why_no_time_of_day(text))
    noon = _noon(env)
    return _micros(noon.replace(hour=at.hour, minute=at.minute, second=at.second))


def sunrise(env: Env, place: Place) -> Micros:
    """Return when the sun rises at a place: midnight where it stays up, its highest point where it stays down."""
    return _light(env, place)[0]


def sunset(env: Env, place: Place) -> Micros:
    """Return when the sun sets at a place: the next midnight where it stays up, its highest point where it stays down."""
    return _light(env, place)[1]


def next_midnight(env: Env) -> Micros:
    """Return when the day of `now` is over."""
    return _micros(_start(_noon(env) + timedelta(days=1)))


def at_site(local: datetime, zone: str) -> Micros:
    """Return the instant of a date and time of day without a zone, in a time zone.

    Raises:
        EvalError: a change of the clocks leaves this time out, or makes it happen twice.
    """
    first, second = (local.replace(tzinfo=_zone(zone), fold=fold) for fold in (0, 1))
    if first.utcoffset() == second.utcoffset():
        return (first - _EPOCH) // timedelta(microseconds=1)
    text = local.isoformat(timespec="minutes")
    if first.astimezone(UTC).astimezone(_zone(zone)).replace(tzinfo=None) != local:
        raise EvalError(
            f"{text} does not exist in {zone}: the clocks go forward over it; write another time, or its offset"
        )
    ways = " or ".join(f"{text}{at.isoformat()[-6:]}" for at in (first, second))
    raise EvalError(f"{text} happens twice in {zone}: the clocks go back over it; write {ways}")


def at_site_of(env: Env, local: datetime) -> Micros:
    """Return the same in the site's time zone."""
    return at_site(local, _zone_of(env).key)


def _light(env: Env, place: Place) -> tuple[Micros, Micros]:
    noon = _noon(env)
    day = _micros(_start(noon)), _micros(_start(noon + timedelta(days=1)))
    return daylight(*env.lat_lng(place), _micros(noon), day)


def _noon(env: Env) -> datetime:
    """Return twelve o'clock of the day of `now` in the site's time zone."""
    try:
        now = env.name("now")
    except Unset:
        raise EvalError("which day today is will only be known when it runs; write the date, too") from None
    assert isinstance(now, int), "`now` is an integer of microseconds"
    here = (_EPOCH + timedelta(microseconds=now)).astimezone(_zone_of(env))
    return here.replace(hour=12, minute=0, second=0, microsecond=0, fold=0)


def _zone_of(env: Env) -> "ZoneInfo":
    try:
        site = env.name("site")
    except Unset:
        site = {}
    name = site.get("timezone", "UTC") if isinstance(site, dict) else "UTC"
    return _zone(str(name))


def _zone(name: str) -> "ZoneInfo":
    from zoneinfo import ZoneInfo  # slow to import, and few tasks need it

    return ZoneInfo(name)


def _start(noon: datetime) -> datetime:
    return noon.replace(hour=0)


def _micros(at: datetime) -> Micros:
    return round((at - _EPOCH).total_seconds()) * SECOND
