"""Conditions that agree: those of a task that are read at several steps and cannot change between them.

What is done `when: twice` at one step and undone `when: twice` at a later one leaves nothing behind on any path, though each of
the two alone does. `flight` therefore follows a task once for each way in which such conditions can turn out.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Final

from formiga_bt.lang.model import Expr, For, If, Loop, Set, Step, Task
from formiga_bt.lang.walk import bare, children

Assumed = Mapping[int, bool]
"""`id` of a condition of the task -> how it turns out."""

_MOST: Final = 5


def ways(task: Task) -> Iterator[Assumed]:
    """Iterate over the ways in which conditions that agree can turn out; none if there are no such conditions."""
    conditions = list(_conditions((*task.steps, *task.on_failure, *task.on_abort, *task.finally_)))
    lasting = {"base", "site", *task.params, *(task.vars.keys() - _assigned(task)), *_saved_once(task.steps)}
    groups: dict[str, list[tuple[Expr, bool]]] = {}
    for cond in conditions:
        if cond.reads and all(read.name in lasting and not read.field for read in cond.reads):
            word, holds = _plain(bare(cond))
            groups.setdefault(word, []).append((cond, holds))
    agreeing = [conds for word, conds in groups.items() if len(conds) > 1 and _is_lasting(word, task)][:_MOST]
    for turned in product((True, False), repeat=len(agreeing)) if agreeing else ():
        pairs = zip(agreeing, turned, strict=True)
        yield {id(cond): holds == true for conds, true in pairs for cond, holds in conds}


def _plain(source: str) -> tuple[str, bool]:
    """Return a condition without a `not` before all of it, and whether it is that condition that has to hold."""
    word = " ".join(source.split())
    inner = word.removeprefix("not ").strip()
    single = all(part not in f" {inner} " for part in (" and ", " or ", " if "))
    return (inner, False) if word != inner and single else (word, True)


def _is_lasting(word: str, task: Task) -> bool:
    """Return whether a condition does not ask if something is saved, which changes when it is."""
    return "is_set(" not in word or any(f"is_set({name})" in word for name in task.params)


def _conditions(steps: Sequence[Step]) -> Iterator[Expr]:
    for step in steps:
        if step.when is not None:
            yield step.when
        if isinstance(step, If):
            yield step.cond
        yield from _conditions(children(step))


def _assigned(task: Task) -> set[str]:
    found: set[str] = set()
    queue = [*task.steps, *task.on_failure, *task.on_abort, *task.finally_]
    while queue:
        step = queue.pop()
        queue += children(step)
        if isinstance(step, Set):
            found |= step.assign.keys()
    return found


def _saved_once(steps: Sequence[Step]) -> Iterator[str]:
    """Iterate over the names that steps save which are done once at most: not in a loop, not tried again."""
    for step in steps:
        if isinstance(step, Loop | For) or step.retry is not None:
            continue
        name = getattr(step, "save_as", "")
        if name:
            yield name
        yield from _saved_once(children(step))
