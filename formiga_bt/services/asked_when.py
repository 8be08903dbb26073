"""The times of a request, as people write them: `14:00`, `2026-08-20T14:00`, `2026-08-20T14:00+03:00`."""

from datetime import datetime
from typing import NamedTuple

from formiga_bt.base.clock import Micros, micros
from formiga_bt.engine.kernel.records import IfLate, TaskWhen
from formiga_bt.lang.expr.daytime import at_site, time_of_day, today
from formiga_bt.lang.model import EvalError, Site
from formiga_bt.lang.request.binding import SiteEnv


class AskedWhen(NamedTuple):
    """When a request says that it may be served, and by when it is to have ended; empty: it does not say."""

    not_before: str = ""
    deadline: str = ""
    if_late: IfLate = "run"
    after: tuple[str, ...] = ()


def when_of(asked: AskedWhen, site: Site, now: Micros) -> TaskWhen:
    """Return the same as engine time.

    Raises:
        EvalError: one is no time, or is past; a time without a zone does not exist at the site, or happens twice.
    """
    return TaskWhen(
        not_before=_coming("not_before", asked.not_before, site, now),
        deadline=_coming("deadline", asked.deadline, site, now),
        if_late=asked.if_late,
        after=tuple(dict.fromkeys(asked.after)),
    )


def _coming(what: str, text: str, site: Site, now: Micros) -> Micros | None:
    if not text.strip():
        return None
    at = _instant(what, text.strip(), site, now)
    if at <= now:
        day = "; that time of today: write the date" if time_of_day(text) is not None else ""
        raise EvalError(f"{what}: {text.strip()} is past{day}")
    return at


def _instant(what: str, text: str, site: Site, now: Micros) -> Micros:
    if time_of_day(text) is not None:
        return today(SiteEnv(site, now), text)
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise EvalError(f"{what}: '{text}' is no time") from None
    if len(text) <= len("2026-08-20"):
        raise EvalError(f"{what}: '{text}' is a day, not a time")
    try:
        return at_site(found, site.timezone) if found.tzinfo is None else micros(found.timestamp())
    except (OverflowError, OSError, ValueError):
        raise EvalError(f"{what}: '{text}' is out of range") from None
