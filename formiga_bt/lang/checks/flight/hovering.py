"""W096: a machine that waits in the air for longer than a full battery lets it hover.

The wait never ends as it says: at the reserve the machine flies home. Only waits that have a bound of their own are looked at:
questions, `wait_for`, `wait_until` that does not wait for that machine, and endless loops that do not command it.
"""

from collections.abc import Iterable, Mapping

from formiga_bt.base.energy import Power, hover_pct
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.model import Ask, Loop, Step, WaitFor, WaitUntil
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import commands


def longest_hover_s(powers: Mapping[str, Power], reserves: Mapping[str, float]) -> float:
    """Return how long the best of some types can hover with a full battery, down to its reserve."""
    found = [
        (100.0 - reserves[name]) / hover_pct(1.0, power) for name, power in powers.items() if power.hover_pct_s > 0
    ]
    return max(found, default=float("inf"))


def waiting_s(step: Step) -> float | None:
    """Return how long a step may wait, seconds; None if it does something else, or has no bound."""
    waits = isinstance(step, Ask | WaitFor | WaitUntil) or (
        isinstance(step, Loop) and step.times is None and step.duration is None
    )
    bound = step.timeout
    if not waits or bound is None or not bound.is_const or not isinstance(bound.const, int | float):
        return None
    return float(bound.const)


def who_waits(step: Step, roles: Iterable[str], who: Mapping[str, str]) -> list[str]:
    """Return which of the roles in the air a step leaves where they are, and does not wait for."""
    busy = {who.get(one, one) for some, _ in commands(step, {}) for one in some}
    if isinstance(step, WaitUntil):
        busy |= {who.get(read.name, read.name) for read in step.cond.reads}
    if isinstance(step, Loop):
        for cond in (step.cond, step.until):
            busy |= {who.get(read.name, read.name) for read in cond.reads} if cond is not None else set()
    return [role for role in roles if role not in busy]


def report(step: Step, role: str, hover_s: float, problems: Problems) -> None:
    """Report W096 for a role at a step."""
    assert step.timeout is not None
    given, most = (
        format_quantity("duration", float(round(s))) for s in (float(step.timeout.const), hover_s // 60 * 60)
    )
    what = f"'{role}' hovers meanwhile: timeout is {given}, a full battery lasts about {most}"
    problems.add("W096", step.timeout.mark, what, "a shorter timeout, or let it land first")
