"""W095: a landing for nothing: a machine lands away from home and takes off again, and nothing happens in between.

A subtree that leaves the ground itself needs its machine there, so who calls it must land first: only a take-off of the body
itself counts.
"""

from collections.abc import Iterable, Iterator, Mapping

from formiga_bt.lang.checks.bodies import in_order
from formiga_bt.lang.model import Ask, Call, Catalogue, Do, Parallel, Sequence, Step, Wait, WaitFor, WaitUntil
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import bare, children, item_name, orders

Event = tuple[str, Step]
"""Of one machine: "lands", "rises" or "other", and the step of the body."""


def check_system_tasks(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    """Report W095 for the steps of a body and what is inside them."""
    told: set[int] = set()
    for body in in_order(steps):
        for name in dict.fromkeys(name for step in body for name, _ in orders(step) if name):
            before: Event = ("other", body[0])
            for now in _events(body, frozenset({name}), catalogue, {}):
                if before[0] == "lands" and now[0] == "rises" and now[1].mark.line not in told:
                    told.add(now[1].mark.line)
                    what = f"'{name}' has just landed ({before[1].mark.said}) and takes off again for nothing"
                    help_ = "put between them what it landed for, a question or a wait; or leave both away"
                    problems.add("W095", now[1].mark, what, help_)
                before = now


def _events(
    steps: Iterable[Step], mine: frozenset[str], catalogue: Catalogue, args: Mapping[str, str]
) -> Iterator[Event]:
    """Iterate over what happens to a machine, `mine` by its names here; `args` is what the params here stand for."""
    for step in steps:
        if step.when is not None or step.retry is not None or step.ignore_failure:
            yield "other", step
            continue
        match step:
            case Do():
                yield _event(step, mine, catalogue, args), step
            case Sequence():
                yield from _events((*step.steps, *step.finally_), mine, catalogue, args)
            case Parallel() if step.need == "all":
                yield from _of_branch(step, mine, catalogue, args)
            case Call():
                inside = frozenset(name for name, arg in step.args.items() if "".join(item_name(arg)) in mine)
                given = {name: args.get(bare(arg), bare(arg)) for name, arg in step.args.items()}
                for what, _ in _events(step.subtree.steps, inside, catalogue, given):
                    yield "other" if what == "rises" else what, step
            case _:
                yield "other", step


def _event(step: Do, mine: frozenset[str], catalogue: Catalogue, args: Mapping[str, str]) -> str:
    spec = catalogue.actions.get(step.action)
    if spec is None or step.who.name not in mine:
        return "other"
    if spec.lands:
        at = step.fields.get(spec.moves_to)
        return "other" if at is None or args.get(bare(at), bare(at)).endswith(".home") else "lands"
    return "rises" if spec.effect == "airborne" else "other"


def _of_branch(step: Parallel, mine: frozenset[str], catalogue: Catalogue, args: Mapping[str, str]) -> Iterator[Event]:
    """Iterate over what a machine does in its branch; where another branch waits for something, so does the machine."""
    own = [child for child in step.steps if any(name in mine for name, _ in orders(child))]
    if len(own) != 1 or any(_waits(child) for child in step.steps if child is not own[0]):
        yield "other", step
        return
    yield from _events(own, mine, catalogue, args)


def _waits(step: Step) -> bool:
    return isinstance(step, Ask | Wait | WaitFor | WaitUntil) or any(_waits(child) for child in children(step))
