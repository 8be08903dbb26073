"""W170, W171: branches of a `parallel` that nobody notices, or that end all others.

W170: one that can only fail, or only watches. W171: one that takes no time, so that the others never get on. Of the first:

It is written to stop the others, and does not: with `need: any` or a number the others go on, with `need: all` the parallel
waits for this branch even when the others are done. An endless loop that nothing in it can fail runs until the others end;
that is well.
"""

from typing import assert_never

from formiga_bt.lang.checks.busy_loops import waits
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


def _only_waits(step: Step) -> bool:
    """Return whether nothing is done inside a step but waiting."""
    return all(isinstance(child, Wait | WaitUntil) or _only_waits(child) for child in children(step)) and bool(
        children(step)
    )


def check_unheard(steps: tuple[Step, ...], problems: Problems) -> None:
    """Report W170 for the steps of a body and what is inside them."""
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, Parallel):
                _check_at_once(step, problems)
                if step.need != "first":
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


def _check_at_once(step: Parallel, problems: Problems) -> None:
    """Report W171 for branches that end before the others have begun, and end them too."""
    quick = [child for child in step.steps if child.when is None and not waits(child)]
    sure = quick if step.need == "first" else [child for child in quick if not can_fail(child) and can_succeed(child)]
    if len(step.steps) > len(sure) >= step.least and step.need != "all":
        one = sure[step.least - 1]
        what = f"this takes no time, so the {step.kind} is over at once: the other branches never get on"
        problems.add("W171", one.mark, what, f"put it before the {step.kind}, or behind what it waits for")


def _check(step: Parallel, problems: Problems) -> None:
    watch = next((one for one in step.steps if isinstance(one, Guard) and one.when is None and _only_waits(one)), None)
    if watch is not None and step.need != "all" and len(step.steps) > step.least:
        what = f"this branch only watches, and nobody notices when it fails: the others go on, need is {step.need}"
        problems.add("W170", watch.mark, what, "race, which the first to end decides; or guard: round the others")
        return
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
