"""When a scenario or a test file plays: `now`, the instant at which its clock begins, and `timezone`, instead of the site's.

A rehearsal begins always at the same instant, so that it comes out the same each time; of a time without a date it is the day.
"""

from typing import Final

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.lang.expr.scope import OUTSIDE
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import Site
from formiga_bt.lang.request.binding import run_outside
from formiga_bt.lang.scenario.entries import START
from formiga_bt.lang.site.zone import read_timezone
from formiga_bt.lang.types import TIME

NOW: Final = Option("now", "value", "The instant of the request, in the site's time zone: 14:00, or 2026-06-21T14:00.")
CLOCK: Final = (
    Option("now", "value", "When its clock begins: 14:00, or 2026-06-21T14:00; on the virtual clock."),
    Option("timezone", "word", "An IANA time zone instead of the site's, such as Europe/Helsinki."),
)


def in_zone(keys: Keys, site: Site) -> Site:
    """Return a site with the time zone that a file says instead of its own."""
    return replace(site, timezone=read_timezone(keys, site.timezone)) if "timezone" in keys else site


def read_now(keys: Keys, site: Site, today: Micros | None = None) -> Micros | None:
    """Return the instant that `now` is, or None if nothing is said; what is wrong was reported.

    Args:
        keys: of the file, or of a case.
        site: its time zone says what a time without one is.
        today: the day of a time without a date; None: that of every rehearsal.
    """
    if "now" not in keys:
        return None
    node = keys["now"].value
    expr, found = compile_value(node, Scope({}, site=site, built_ins=OUTSIDE), TIME)
    at: Micros | None = None
    if not found:
        at, found = run_outside(expr, site, node.mark, "now", START if today is None else today)
    keys.problems.extend(found)
    return at
