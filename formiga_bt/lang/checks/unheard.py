"""W170: a branch of a `parallel` that can only fail: nobody notices it, or the whole can never succeed.

It is written to stop the others, and does not: with `need: any` or a number the others go on, with `need: all` the parallel
waits for this branch even when the others are done. An endless loop that nothing in it can fail runs until the others end;
that is well.
"""

from typing import assert_never

from formiga_bt.lang.checks.each_step import can_succeed
from formiga_bt.lang.model import (
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


def check_unheard(steps: tuple[Step, ...], problems: Problems) -> None:
    """Report W170 for the steps of a body and what is inside them."""
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, Parallel) and step.need != "first":
                _check(step, problems)
            check_unheard(children(step), problems)


def can_fail(step: Step) -> bool:
    """Return whether a step may end by failing, its agents' and people's doing included."""
    if step.ignore_failure:
        return False
    if step.timeout is not None and not isinstance(step, Set | Notify | BreakIf):
        return True
    match step:
        case Do() | Check() | Fail() | Guard() | Request() | WithAgents() | WithResource() | WaitUntil() | WaitFor():
            return True
        case Ask():
            return step.expect is not None
        case Call():
            return any(can_fail(child) for child in step.subtree.steps)
        case Fallback():
            return all(can_fail(child) or child.when is not None for child in step.steps)
        case For() if step.first:
            return True
        case Sequence() | Parallel() | Loop() | For() | If() | Switch():
            return any(can_fail(child) for child in children(step))
        case Wait() | Set() | Notify() | BreakIf() | Release():
            return False
        case _:
            assert_never(step)


def _check(step: Parallel, problems: Problems) -> None:
    lost = [child for child in step.steps if child.when is None and not can_succeed(child) and can_fail(child)]
    if not lost or len(lost) == len(step.steps):  # all of them fail: that is meant, or told as E043
        return
    if len(step.steps) - len(lost) >= step.least:
        what = f"this branch can only fail, and nobody notices it: the others go on, need is {step.need}"
        help_ = "let it succeed where it is to end the parallel, and look afterwards which branch it was"
    else:
        what = "this branch can only fail, so the parallel never succeeds, even if the others are done"
        help_ = "guard: round the others stops them when a condition fails; or race, which the first to end decides"
    problems.add("W170", lost[0].mark, what, help_)
