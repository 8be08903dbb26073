"""The lists of steps that run one after another, whatever step they are in."""

from collections.abc import Iterable, Iterator

from formiga_bt.lang.model import Fallback, If, Parallel, Sequence, Step, Switch
from formiga_bt.lang.walk import children


def in_order(steps: tuple[Step, ...]) -> Iterator[tuple[Step, ...]]:
    """Iterate over a list of steps that run in their order, and over all such lists inside it; called subtrees are left out."""
    if steps:
        yield steps
    for step in steps:
        yield from inside(step)


def inside(step: Step) -> Iterator[tuple[Step, ...]]:
    """Iterate over the lists of steps inside a step that run in their order."""
    if isinstance(step, Parallel | Fallback):
        for child in step.steps:
            yield from inside(child)
        return
    for body in parts(step):
        yield from in_order(body)


def parts(step: Step) -> tuple[tuple[Step, ...], ...]:
    """Return the lists of steps directly inside a step that is no parallel or fallback."""
    match step:
        case Sequence():
            return step.steps, step.finally_
        case If():
            return step.then, step.otherwise
        case Switch():
            return step.branches
        case _:
            return (children(step),)


def is_plain(step: Step) -> bool:
    """Return whether a step has no modifier, so that it surely runs, once."""
    return (
        step.when is None and step.timeout is None and step.retry is None and not (step.ignore_failure or step.critical)
    )


def flat(steps: Iterable[Step]) -> Iterator[Step]:
    """Iterate over steps one after another, the steps of plain sequences among them in their place."""
    for step in steps:
        if isinstance(step, Sequence) and is_plain(step) and not step.reactive:
            yield from flat((*step.steps, *step.finally_))
        else:
            yield step
