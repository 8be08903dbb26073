"""W099: an endless loop that ends only by failing; W075: a landing elsewhere than where the way just flown ends."""

import re
from collections.abc import Mapping
from itertools import pairwise
from typing import Final

from formiga_bt.lang.checks.bodies import flat, in_order
from formiga_bt.lang.checks.flight.destinations import Meanings, meanings_of, roots_of
from formiga_bt.lang.model import BreakIf, Catalogue, Do, Expr, Fallback, For, Loop, Parallel, Step, Task
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import bare, children

_ENDS: Final = re.compile(r"(?:zigzag|line)\(([^(),]+),([^(),]+)(?:,.*)?\)")


def check_endings(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report W099 and W075 for the steps of a task."""
    sections = (("steps", task.steps), ("on_failure", task.on_failure), ("on_abort", task.on_abort))
    names = meanings_of(task)
    for name, steps in sections:
        with problems.within(name):
            _loops(steps, problems)
            for body in in_order(steps):
                _landings(body, names, task.vars, catalogue, problems)
    for subtree in task.subtrees.values():
        with problems.outermost(subtree.name, "steps"):
            _loops(subtree.steps, problems)


# --- loops -------------------------------------------------------------------------------------------------------


def _loops(steps: tuple[Step, ...], problems: Problems) -> None:
    for step in steps:
        if step.ignore_failure or isinstance(step, Parallel | Fallback):  # what failing means is said there
            continue
        with problems.within(step.title):
            endless = isinstance(step, Loop) and step.forever and step.until is None and step.max is None
            if endless and step.timeout is not None and not is_left(children(step)):
                what = "only its timeout ends this loop, and that is a failure"
                help_ = f"break_if or until; repeat: {bare(step.timeout)} ends with success then"
                problems.add("W099", step.mark, what, help_)
            _loops(children(step), problems)


def is_left(steps: tuple[Step, ...]) -> bool:
    """Return whether a `break_if` leaves the loop of these steps."""
    return any(
        isinstance(step, BreakIf) or (not isinstance(step, Loop | For) and is_left(children(step))) for step in steps
    )


# --- landings ----------------------------------------------------------------------------------------------------


def _landings(
    steps: tuple[Step, ...], names: Meanings, vars_: Mapping[str, Expr], catalogue: Catalogue, problems: Problems
) -> None:
    body = list(flat(steps))
    for before, step in pairwise(body):
        if not isinstance(before, For) or before.parallel or before.when is not None or not isinstance(step, Do):
            continue
        spec = catalogue.actions.get(step.action)
        path = _path(before, step.who.name, catalogue)
        if spec is None or not spec.lands or path is None or spec.moves_to not in step.fields or is_left(before.steps):
            continue
        at = step.fields[spec.moves_to]
        source = bare(vars_[bare(path)]) if bare(path) in vars_ else bare(path)
        ends = _ENDS.fullmatch(source)
        end = ends[2].strip() if ends is not None else ""
        known = names[end].roots if end in names else None
        flown, lands = known or roots_of(path, names), roots_of(at, names)
        if flown and lands and not flown & lands:
            where = end if known else " and ".join(sorted(flown))
            how = f"last flew to '{where}'" if known else f"its way there is made of '{where}'"
            what = f"lands at '{bare(at)}' but {how} ({before.mark.said})"
            problems.add("W075", at.mark, what, f"fly above {bare(at)} first")


def _path(step: For, who: str, catalogue: Catalogue) -> Expr | None:
    """Return the list of places that a machine is sent to, one after another, at the end of each round."""
    last = next(reversed([one for one in flat(step.steps) if isinstance(one, Do) and one.who.name == who]), None)
    spec = catalogue.actions.get(last.action) if last is not None else None
    if last is None or spec is None or not spec.moves_to or spec.moves_to not in last.fields:
        return None
    reads = {read.name for read in last.fields[spec.moves_to].reads}
    lists = [expr for name, expr in step.lists.items() if name in reads]
    return lists[0] if len(lists) == 1 else None
