"""When a request may be served: checked as it comes in, read as it waits."""

from datetime import UTC, datetime, timedelta

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Submit
from formiga_bt.engine.kernel.records import AgentRequest

MOST_AHEAD_US: Micros = 366 * 86_400 * SECOND
"""So far ahead a request may say when it is served, and when its end is wanted."""
MOST_AFTER = 100
"""Tasks that one request may wait for."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def check_when(core: Core, request: Submit) -> None:
    """Return if a request can begin, and be in time.

    Raises:
        TaskError: `bad_time`: it names a time more than a year ahead; `late`: its deadline is past, or no later than its
            `not_before`; `unknown_task`, `after_failed`: a task that it is to begin after is not known, or has ended without
            success; `too_many`: it names more than 100.
    """
    when = request.when
    if max(when.not_before or 0, when.deadline or 0) > core.now + MOST_AHEAD_US:
        raise TaskError("bad_time", "it names a time more than a year ahead")
    if when.deadline is not None and when.deadline <= max(core.now, when.not_before or 0):
        past = when.deadline <= core.now
        raise TaskError("late", f"its deadline is {'past' if past else 'no later than when it may begin'}")
    if len(when.after) > MOST_AFTER:
        raise TaskError("too_many", f"it may begin after at most {MOST_AFTER} tasks, not {len(when.after)}")
    for name in when.after:
        if name not in core.state.tasks:
            raise TaskError("unknown_task", f"there is no task '{name}' to begin after")
    if why := why_never(core, when.after):
        raise TaskError("after_failed", why)


def why_never(core: Core, after: tuple[str, ...]) -> str:
    """Return why what comes after these tasks can never begin, or ""."""
    for name in after:
        task = core.state.tasks.get(name)
        if task is None:
            return f"it was to begin after {name}, of which nothing is known any more"
        if task.section == "done" and task.status != "SUCCEEDED":
            return f"it was to begin after {name}, which has ended: {task.status}"
    return ""


def local_time(at: Micros, zone: str) -> str:
    """Return an instant as the clocks of the site show it."""
    from zoneinfo import ZoneInfo  # slow to import, and few sites need it

    return f"{(_EPOCH + timedelta(microseconds=at)).astimezone(ZoneInfo(zone)):%Y-%m-%d %H:%M:%S}"


def why_not_yet(request: AgentRequest, zone: str) -> tuple[str, str] | None:
    """Return (code, detail) of what a request waits for before it may be served, or None."""
    if request.not_before is not None:
        return "not_before", local_time(request.not_before, zone)
    return ("after", ", ".join(request.after)) if request.after else None
