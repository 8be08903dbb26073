"""W100: what bounds, repeats or preempts nothing: a time-out after another one, one attempt, a code never tried again.

Only what is written as a constant, in one body: a subtree may be called from a place with more time, and what tidies up has
time of its own. `wait: 0 s` of a role is something else (it does not queue), and so is one attempt with a time-out of its own.
"""

from collections.abc import Iterable
from itertools import chain
from typing import Final

from msgspec import Struct

from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.busy_loops import waits
from formiga_bt.lang.checks.reasons import never_ends_with
from formiga_bt.lang.model import Expr, Loop, Retry, Sequence, Set, Step, Task, Wait, WithAgents
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import all_steps, children, steps_once

_NEVER: Final = ("in_doubt", "cancel_unconfirmed", "taken_over", "no_agent", "no_resource", "cannot_compute", "runaway")
_BY_ANOTHER: Final = ("agent_lost",)
"""Reason codes of failures that a retry never repeats, and that only another machine does."""


class _Bound(Struct, frozen=True):
    """What ends a step from outside."""

    seconds: float
    who: str


def check_no_effect(task: Task, problems: Problems) -> None:
    """Report W100 in all bodies of a task."""
    _check_preempt(task, problems)
    with problems.within("steps"):
        seconds = _seconds(task.timeout)
        _walk(task.steps, _Bound(seconds, "the task") if seconds is not None else None, problems)
    sections = (("on_failure", task.on_failure), ("on_abort", task.on_abort), ("finally", task.finally_))
    for name, steps in sections:
        with problems.within(name):
            _walk(steps, None, problems)
    for subtree in task.subtrees.values():
        with problems.outermost(subtree.name, "steps"):
            _walk(subtree.steps, None, problems)


def _walk(steps: Iterable[Step], bound: _Bound | None, problems: Problems) -> None:
    for step in steps:
        with problems.within(step.title):
            inner = _narrower(step.timeout, "timeout", bound, f"'{step.title}' ({step.mark.said})", problems)
            if step.retry is not None:
                _check_retry(step, step.retry, inner, problems)
            if isinstance(step, Loop) and step.every is not None:
                _never_again(step.every, "every", "there is one round", inner, problems)
            if isinstance(step, Wait) and step.duration.is_const and step.duration.const == 0:
                problems.add("W100", step.mark, "a wait of 0 s waits for nothing", "say how long, or take it away")
            last = step.finally_ if isinstance(step, Sequence) else ()
            _walk(children(step)[: -len(last) or None], inner, problems)
            _walk(last, None, problems)


def _check_preempt(task: Task, problems: Problems) -> None:
    """Report roles that take machines from others, in a task that others do not step aside for."""
    if task.priority == "high":
        return
    blocks = [step for step in all_steps(task) if isinstance(step, WithAgents)]
    for role in chain(task.roles.values(), *(block.roles.values() for block in blocks)):
        if role.preempt:
            what = f"'{role.name}' takes nothing from others: they step aside for tasks of priority high only"
            problems.add("W100", role.mark, what, "write priority: high at the head of the task, or take preempt away")


def _check_retry(step: Step, retry: Retry, bound: _Bound | None, problems: Problems) -> None:
    _narrower(retry.attempt_timeout, "attempt_timeout", bound, "", problems)
    if retry.delay is not None:
        _never_again(retry.delay, "delay", "nothing is retried", bound, problems)
    is_pause = retry.delay is not None and _seconds(retry.delay) != 0
    if not is_pause and not waits(step) and not _changes(step):
        what = "each attempt comes at the same moment, and finds the same: nothing in it takes time"
        problems.add(
            "W100", retry.mark, what, "a delay, such as: delay: 15 s; or wait_until, which waits for a condition"
        )
    if retry.attempts.is_const and retry.attempts.const == 1 and retry.attempt_timeout is None:
        what = "attempts counts the first one: with 1 nothing is retried"
        problems.add("W100", retry.attempts.mark, what, "such as: attempts: 3; or take retry away")
    _check_codes(step, retry, problems)


def _check_codes(step: Step, retry: Retry, problems: Problems) -> None:
    """Report codes that are named in `on`, and after which nothing is ever tried again."""
    alone = _BY_ANOTHER if retry.agent == "same" else ()
    for code in retry.on:
        if code in _NEVER or code in alone:
            fix = "'agent: another' lets another machine do it" if code in alone else "a fallback can go on after it"
            problems.add("W100", retry.mark, f"after '{code}' the same is never tried again", fix)
        elif never_ends_with((step,), code):
            what = f"nothing here ends with '{code}', so after it nothing is tried again"
            problems.add("W100", retry.mark, what, "name a code of a step that this retry is round")


def _narrower(expr: Expr | None, key: str, bound: _Bound | None, who: str, problems: Problems) -> _Bound | None:
    """Return what bounds the inside of a step; report a time-out that is beyond what is around it."""
    seconds = _seconds(expr)
    if expr is None or seconds is None:
        return bound
    if bound is None or seconds <= bound.seconds:
        return _Bound(seconds, who)
    mine, theirs = (format_quantity("duration", one) for one in (seconds, bound.seconds))
    what = f"{key} is {mine}, but {bound.who} ends after {theirs} at the latest"
    problems.add("W100", expr.mark, what, f"make it shorter than {theirs}, or take it away")
    return bound


def _never_again(expr: Expr, key: str, so: str, bound: _Bound | None, problems: Problems) -> None:
    """Report a pause that is no shorter than what ends it."""
    seconds = _seconds(expr)
    if seconds is not None and bound is not None and seconds >= bound.seconds:
        mine, theirs = (format_quantity("duration", one) for one in (seconds, bound.seconds))
        what = f"{key} is {mine}, but {bound.who} ends after {theirs} at the latest: {so}"
        problems.add("W100", expr.mark, what, f"make it shorter than {theirs}")


def _changes(step: Step) -> bool:
    """Return whether a step sets a var, so that the next attempt may find another value."""
    return any(isinstance(one, Set) for one in steps_once((step,)))


def _seconds(expr: Expr | None) -> float | None:
    const = expr.const if expr is not None and expr.is_const else None
    return float(const) if isinstance(const, int | float) else None
