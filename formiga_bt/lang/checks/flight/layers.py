"""W094: a way across that begins or ends outside the machine's layer.

Machines of different tasks cross in layers. A way across that also climbs goes through the layers of others: first straight up
or down to the layer (`at_height(ground(drone.position), drone.transit_height)`), then across in it, then down at the place.
"""

import re
from typing import Final

from formiga_bt.lang.checks.bodies import flat, in_order, is_plain
from formiga_bt.lang.model import Catalogue, Do, Step, Subtree, Task
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import bare, orders

_LAYER: Final = re.compile(r"at_height\((.+),\s*(\w+)\.transit_height\)")


def check_layers(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report W094 for the steps of a task and of the subtrees that it sees."""
    for name, steps in (("steps", task.steps), ("on_failure", task.on_failure), ("finally", task.finally_)):
        with problems.within(name):
            for body in in_order(steps):
                _check(body, catalogue, problems, of=None)
    for subtree in task.subtrees.values():
        with problems.outermost(subtree.name, "steps"):
            for body in in_order(subtree.steps):
                _check(body, catalogue, problems, of=subtree if body is subtree.steps else None)


def _check(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems, of: Subtree | None) -> None:
    """Check what each machine does in steps that run in order; a subtree's machines may be anywhere when it begins."""
    last: dict[str, tuple[str, Do | None]] = {}
    for step in flat(steps):
        if not isinstance(step, Do):
            last.update({name: ("unknown", None) for name, _ in orders(step)})
            continue
        spec = catalogue.actions.get(step.action)
        if spec is None or not (spec.moves_to or spec.effect or spec.requires):
            continue
        who = step.who.name
        how, before = last.get(who, ("somewhere" if of is not None and who in of.params else "unknown", None))
        kind = _kind(step, spec.moves_to)
        if kind == "across" and how == "somewhere":
            what = f"'{who}' climbs to its layer on the way across"
            to = f"${{at_height(ground({who}.position), {who}.transit_height)}}"
            problems.add(
                "W094",
                step.fields[spec.moves_to].mark,
                what,
                f"before it: {who}.{spec.name} with {spec.moves_to}: {to}",
            )
        if kind == "elsewhere" and how == "climb" and before is not None and not spec.lands:
            what = f"'{who}' went to its layer ({before.mark.said}), but does not cross in it"
            help_ = f"first across: at_height(..., {who}.transit_height)"
            problems.add("W094", step.fields[spec.moves_to].mark, what, help_)
        if spec.effect == "airborne":
            kind = "up" if any("transit_height" in bare(expr) for expr in step.fields.values()) else "unknown"
        if not spec.moves_to and not spec.effect:
            kind = "unknown"
        last[who] = (kind if is_plain(step) or kind == how else "somewhere" if how == "somewhere" else "unknown", step)


def _kind(step: Do, moves_to: str) -> str:
    """Return "climb" to the layer, "across" in it, or "elsewhere"."""
    if moves_to not in step.fields:
        return "unknown"
    source = bare(step.fields[moves_to])
    found = _LAYER.fullmatch(source)
    if found is None or found[2] != step.who.name:
        return "unknown" if f"{step.who.name}.position" in source else "elsewhere"
    return "climb" if found[1].replace(" ", "") == f"ground({step.who.name}.position)" else "across"
