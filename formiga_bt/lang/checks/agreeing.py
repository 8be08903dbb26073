"""Conditions that agree: those of a task that are read at several steps and cannot change between them.

What is done `when: twice` at one step and undone `when: twice` at a later one leaves nothing behind on any path, though each of
the two alone does. `flight` therefore follows a task once for each way in which such conditions can turn out. Of many, each is
told apart only between the first and the last step that reads it (`Split`), so that their number does not matter.

What is said of the length of a list agrees with the loops over it: after `check: len(posts) > 1` they run a round (`filled`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import Final

from msgspec import Struct

from formiga_bt.lang.checks.bodies import parts
from formiga_bt.lang.checks.filled import says_filled, walked
from formiga_bt.lang.model import Check, Expr, Fallback, For, If, Loop, Parallel, Set, Step, Task
from formiga_bt.lang.walk import bare, begins_anew, children

Assumed = Mapping[int, bool]
"""`id` of a condition of the task -> how it turns out; of the list of a `for`: whether it has any item."""

MOST: Final = 5
"""So many are told apart at once."""

_Group = list[tuple[Expr, bool | None, bool | None]]
"""Conditions that agree on one word, and how each turns out where it holds, and where it does not; None = either way."""


class Split(Struct, frozen=True):
    """Where in a list of steps conditions that agree are told apart: from one step to another, both included."""

    first: int
    last: int
    ways: tuple[Assumed, Assumed]


Splits = Mapping[int, list[Split]]
"""`id` of a list of steps -> what is told apart in it."""


def ways(task: Task) -> tuple[list[Assumed], Splits]:
    """Return the ways in which conditions that agree can turn out in a whole task, and those told apart in parts of it.

    Both are empty if there are no such conditions.
    """
    sections = (task.steps, task.on_failure, task.on_abort, task.finally_)
    lasting = {"base", "site", *task.params, *(task.vars.keys() - _assigned(task)), *_saved_once(task.steps)}
    groups: dict[str, _Group] = {}
    lists: dict[str, _Group] = {}
    every = [step for section in sections for step in section]
    for cond in _conditions(every):
        if cond.reads and all(read.name in lasting and not read.field for read in cond.reads):
            word, holds = _plain(bare(cond))
            groups.setdefault(word, []).append((cond, holds, not holds))
            for name, filled, empty in says_filled(bare(cond)):
                lists.setdefault(name, []).append((cond, filled, empty))
    for expr in _walked(every):
        if walked(bare(expr)) in lasting:
            lists.setdefault(walked(bare(expr)), []).append((expr, True, False))
    agreeing = [conds for word, conds in groups.items() if len(conds) > 1 and _is_lasting(word, task)]
    agreeing += [conds for conds in lists.values() if len(conds) > 1]
    splits: dict[int, list[Split]] = {}
    whole: list[_Group] = []
    for conds in agreeing:
        own = frozenset(id(cond) for cond, _, _ in conds)
        mine = [section for section in sections if _uses(section, own)]
        if len(agreeing) <= MOST or len(mine) > 1:
            whole.append(conds)
        else:
            steps, first, last = _narrowest(mine[0], own)
            splits.setdefault(id(steps), []).append(Split(first, last, (_turned(conds, True), _turned(conds, False))))
    return list(_of_all(whole[:MOST])) if agreeing else [], splits


def _of_all(groups: Sequence[_Group]) -> Iterator[Assumed]:
    for turned in product((True, False), repeat=len(groups)):
        assumed: dict[int, bool] = {}
        for conds, holds in zip(groups, turned, strict=True):
            assumed |= _turned(conds, holds)
        yield assumed


def _turned(conds: _Group, holds: bool) -> Assumed:
    """Return how conditions turn out where their word holds, or does not."""
    ends = ((cond, if_so if holds else if_not) for cond, if_so, if_not in conds)
    return {id(cond): end for cond, end in ends if end is not None}


def _uses(steps: Iterable[Step], own: frozenset[int]) -> bool:
    return any(id(cond) in own for source in (_conditions, _walked) for cond in source(steps))


def _narrowest(steps: tuple[Step, ...], own: frozenset[int]) -> tuple[tuple[Step, ...], int, int]:
    """Return the innermost list of steps that has all of some conditions, and its first and last step that read one.

    A loop and what is tried again are taken as a whole: what agrees in one round agrees in the next one too.
    """
    using = [index for index, step in enumerate(steps) if _uses((step,), own)]
    inner = _inside(steps[using[0]], own) if len(using) == 1 else None
    return _narrowest(inner, own) if inner is not None else (steps, using[0], using[-1])


def _inside(step: Step, own: frozenset[int]) -> tuple[Step, ...] | None:
    """Return the list inside a step that has all of some conditions, None if there is no such one."""
    here = [cond for cond in (step.when, step.cond if isinstance(step, If) else None) if cond is not None]
    if begins_anew(step) or isinstance(step, Loop | For) or any(id(cond) in own for cond in here):
        return None
    if isinstance(step, Parallel | Fallback):
        mine = [child for child in step.steps if _uses((child,), own)]
        return _inside(mine[0], own) if len(mine) == 1 else None
    bodies = [body for body in parts(step) if _uses(body, own)]
    return bodies[0] if len(bodies) == 1 else None


def _plain(source: str) -> tuple[str, bool]:
    """Return a condition without a `not` before all of it, and whether it is that condition that has to hold."""
    word = " ".join(source.split())
    inner = word.removeprefix("not ").strip()
    single = all(part not in f" {inner} " for part in (" and ", " or ", " if "))
    return (inner, False) if word != inner and single else (word, True)


def _is_lasting(word: str, task: Task) -> bool:
    """Return whether a condition does not ask if something is saved, which changes when it is."""
    return "is_set(" not in word or any(f"is_set({name})" in word for name in task.params)


def _conditions(steps: Iterable[Step]) -> Iterator[Expr]:
    for step in steps:
        if step.when is not None:
            yield step.when
        if isinstance(step, If | Check):
            yield step.cond
        yield from _conditions(children(step))


def _walked(steps: Iterable[Step]) -> Iterator[Expr]:
    """Iterate over the lists that a `for` goes over."""
    for step in steps:
        if isinstance(step, For):
            yield from step.lists.values()
        yield from _walked(children(step))


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
        if begins_anew(step):
            continue
        if isinstance(step, For) and step.gives:
            yield step.gives
        if isinstance(step, Loop | For):
            continue
        name = getattr(step, "save_as", "")
        if name:
            yield name
        yield from _saved_once(children(step))
