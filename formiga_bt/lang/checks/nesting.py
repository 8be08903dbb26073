"""W092: a step around others that changes nothing; W093: a loop over machines that does not say how they go.

A sequence in a list of steps runs as the list does, and a parallel of one step is that step: most often the other word was
meant, or a branch was lost. Machines in a `for` go one after another unless it says otherwise, and those in the air wait there.
"""

from collections.abc import Iterator

from formiga_bt.lang.checks.bodies import in_order, is_plain
from formiga_bt.lang.model import Catalogue, Do, Fallback, For, Parallel, Sequence, Step
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import children, orders


def check_nesting(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    """Report W092 and W093 for the steps of a body and what is inside them."""
    for body in in_order(steps):
        for step in body:
            if isinstance(step, Sequence) and is_plain(step) and not (step.reactive or step.finally_ or step.name):
                what = "this sequence changes nothing: the steps around it run one after another too"
                problems.add("W092", step.mark, what, "parallel, if they are meant to run at once; else take it away")
    _walk(steps, catalogue, problems)


def _walk(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, Parallel | Fallback) and len(step.steps) == 1:
                what = f"a {step.kind} of one step is just that step"
                problems.add("W092", step.mark, what, "add what is missing beside it, or take it away")
            if isinstance(step, For) and not step.said_mode and _leaves_waiting(step, catalogue):
                first = next(iter(step.lists))
                what = f"'{first}' goes through this one machine after another, while the others wait in the air"
                problems.add("W093", step.mark, what, "mode: parallel for all at once; mode: each if this is meant")
            _walk(children(step), catalogue, problems)


def _leaves_waiting(step: For, catalogue: Catalogue) -> bool:
    """Return whether the machines that a loop goes over are in the air before or after their rounds."""
    machines = {
        name for name, expr in step.lists.items() if expr.type.item is not None and expr.type.item.name == "agent"
    }
    for machine in machines:
        done = [catalogue.actions[do.action] for do in _of(step, machine) if do.action in catalogue.actions]
        flights = [spec for spec in done if spec.effect or spec.requires]
        if flights and (flights[0].effect != "airborne" or flights[-1].effect != "grounded"):
            return True
    return False


def _of(step: For, machine: str) -> Iterator[Do]:
    for child in step.steps:
        yield from (do for name, do in orders(child) if name == machine)
