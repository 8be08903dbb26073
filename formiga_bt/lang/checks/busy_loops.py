"""E042: a loop that never waits, and has no end, or so many rounds that a task may not run them at one moment."""

from typing import assert_never

from formiga_bt.lang.checks.endings import is_left
from formiga_bt.lang.model import (
    MOST_VISITS,
    Ask,
    BreakIf,
    Call,
    Check,
    Do,
    Fail,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Notify,
    Parallel,
    Release,
    Request,
    Sequence,
    Set,
    Step,
    Switch,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import children

_HELP = "add every: 15 s, or wait for something in it"


def check_spin(step: Loop, problems: Problems) -> None:
    """Report E042 for a loop in which nothing takes time."""
    if not step.steps or step.every is not None or any(waits(child) for child in step.steps):
        return
    if step.times is None and step.max is None:
        problems.add("E042", step.mark, "this loop never waits", _HELP)
    elif _of_loop(step) > MOST_VISITS and not any(_visits(child) > MOST_VISITS for child in step.steps):
        what = f"this loop never waits: all its rounds at one moment are more than {MOST_VISITS:,} steps"
        problems.add("E042", step.mark, what, f"{_HELP}, or fewer rounds")


def waits(step: Step) -> bool:
    """Return whether some path through a step takes time."""
    match step:
        case Do() | Ask() | WaitUntil() | WaitFor() | Release() | WithAgents() | Request() | WithResource():
            return True
        case Wait():
            return not step.duration.is_const or bool(step.duration.const)
        case Call():
            return any(waits(child) for child in step.subtree.steps)
        case Loop() if step.every is not None:
            return True
        case Parallel() if step.need == "first":
            return all(waits(child) or child.when is not None for child in step.steps) and any(map(waits, step.steps))
        case Parallel():
            return sum(_is_sure(child) for child in step.steps) < step.least and any(map(waits, step.steps))
        case Sequence() | Fallback() | Loop() | For() | Guard() | If() | Switch():
            return any(waits(child) for child in children(step))
        case Check() | Set() | Notify() | Fail() | BreakIf():
            return False
        case _:
            assert_never(step)


def _is_sure(step: Step) -> bool:
    """Return whether a step surely succeeds, at once."""
    if step.when is not None:
        return False
    if isinstance(step, Sequence):
        return all(_is_sure(child) for child in children(step))
    return isinstance(step, Set | Notify) or (step.ignore_failure and isinstance(step, Check | Fail))


def _visits(step: Step) -> int:
    """Return how many steps the engine visits at least for one in which nothing waits, if nothing in it fails."""
    if step.when is not None:
        return 0
    match step:
        case Loop():
            return _of_loop(step)
        case Sequence():
            return 1 + sum(map(_visits, children(step)))
        case Call():
            return 1 + sum(map(_visits, step.subtree.steps))
        case _:
            return 1


def _of_loop(step: Loop) -> int:
    return 1 + _rounds(step) * (1 + sum(map(_visits, step.steps)))


def _rounds(step: Loop) -> int:
    """Return how many rounds a loop surely has; 0 if that is not known, or something may leave it before."""
    if step.cond is not None or step.duration is not None or step.until is not None or is_left(step.steps):
        return 0
    known = [one.const for one in (step.times, step.max) if one is not None and one.is_const]
    some = step.times is None or step.times.is_const
    numbers = [one for one in known if isinstance(one, int)]
    return min(numbers) if numbers and some and (step.max is None or step.max.is_const) else 0
