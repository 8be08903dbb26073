"""W102: loops whose own waits would wake their task more often than the engine lets one task be woken.

An estimate from what is written: constant waits and `every`. What waits for machines, people or a condition counts as slow, and
live conditions count as nothing: they are woken by what changes, not by a clock.
"""

from typing import Final, assert_never

from formiga_bt.lang.model import (
    WAKES_A_SECOND,
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

SLOW_S: Final = 1.0
"""So long takes, for the estimate, what waits for somebody."""


def check_haste(step: Step, problems: Problems) -> None:
    """Report W102 for the innermost step that alone is in too much haste."""
    if not isinstance(step, Loop | Parallel | For):
        return
    rate = _rate(step)
    if rate <= WAKES_A_SECOND or any(_rate(child) > WAKES_A_SECOND for child in _inside(step)):
        return
    what = f"its waits wake the task about {rate:,.0f} times a second; beyond {WAKES_A_SECOND} the engine makes them longer"
    problems.add("W102", step.mark, what, "wait longer, or wait for what should happen: wait_until, wait_for")


def _inside(step: Step) -> tuple[Step, ...]:
    return step.subtree.steps if isinstance(step, Call) else children(step)


def _rate(step: Step) -> float:
    """Return how often a second the loops in a step wake their task."""
    inner = [_rate(child) for child in _inside(step)]
    match step:
        case Parallel():
            return sum(inner)
        case For() if step.parallel:
            return sum(inner) * _items(step)
        case Loop():
            return max(_of_rounds(step), max(inner, default=0.0))
        case _:
            return max(inner, default=0.0)


def _items(step: For) -> int:
    """Return how many rounds run at once, as far as that is written."""
    known = [len(one.const) for one in step.lists.values() if one.is_const and isinstance(one.const, tuple)]
    most = min(known, default=1)
    return most if step.max_parallel is None else min(most, step.max_parallel)


def _of_rounds(step: Loop) -> float:
    lasts = sum(map(_lasts, step.steps))
    wakes = sum(map(_wakes, step.steps))
    every = _const(step.every) if step.every is not None else None
    if every is not None and every > lasts:
        lasts, wakes = every, wakes + 1
    rounds = _const(step.times) if step.times is not None else None
    if not lasts or (rounds is not None and rounds * wakes <= WAKES_A_SECOND):
        return 0.0  # E042 is about loops that never wait; a few short waits are within what is saved up
    return wakes / lasts


def _const(expr: object) -> float | None:
    value = getattr(expr, "const", None) if getattr(expr, "is_const", False) else None
    return float(value) if isinstance(value, int | float) else None


def _lasts(step: Step) -> float:
    """Return how many seconds a step takes at least, for the estimate."""
    match step:
        case Wait():
            known = _const(step.duration)
            return SLOW_S if known is None else known
        case Do() | Ask() | Release() | WithAgents() | WithResource() | Request() | WaitUntil() | WaitFor():
            return SLOW_S
        case Parallel():
            return (min if step.need == "first" else max)(map(_lasts, step.steps), default=0.0)
        case If() | Switch():
            return max(map(_lasts, _inside(step)), default=0.0)
        case Call() | Sequence() | Fallback() | Loop() | For() | Guard():
            return sum(map(_lasts, _inside(step)))
        case Check() | Set() | Notify() | Fail() | BreakIf():
            return 0.0
        case _:
            assert_never(step)


def _wakes(step: Step) -> int:
    """Return how often the waits of one round wake the task."""
    return 1 if isinstance(step, Wait) else sum(map(_wakes, _inside(step)))
