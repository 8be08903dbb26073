"""W088, W089: which machine a role gets. Without `near` it is any free one; `near` should name where it goes first."""

from collections.abc import Iterable

from formiga_bt.lang.checks.flight.destinations import HOME, Goal, Meaning, Meanings, first_goals, meanings_of, roots_of
from formiga_bt.lang.model import Call, Catalogue, Expr, Role, Step, Task, WithAgents
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import Type
from formiga_bt.lang.walk import bare, children


def check_chosen(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report W088 and W089 for the roles of a task and of its blocks."""
    names = meanings_of(task)
    optional = frozenset(p.name for p in task.params.values() if p.optional and p.default is None)
    with problems.within("agents"):
        for role in task.roles.values():
            _check(role, task.steps, names, optional, catalogue, problems)
    for section in (task.steps, task.on_failure, task.on_abort, task.finally_):
        for block in _blocks(section):
            for role in block.roles.values():
                _check(role, block.steps, names, optional, catalogue, problems)


def _blocks(steps: Iterable[Step]) -> Iterable[WithAgents]:
    for step in steps:
        if isinstance(step, WithAgents):
            yield step
        if not isinstance(step, Call):
            yield from _blocks(children(step))


def _check(
    role: Role,
    steps: tuple[Step, ...],
    names: Meanings,
    optional: frozenset[str],
    catalogue: Catalogue,
    problems: Problems,
) -> None:
    if any(catalogue.types[one].human for one in role.types if one in catalogue.types):
        return
    goals, _ = first_goals(steps, role.name, catalogue, names)
    if not goals:
        return
    if role.near is None:
        _check_missing(role, goals[0], names, optional, problems)
    else:
        _check_elsewhere(role, role.near, goals, names, problems)


def _check_missing(role: Role, goal: Goal, names: Meanings, optional: frozenset[str], problems: Problems) -> None:
    takes_all = role.open is not None and role.open.max is None
    if takes_all or _is_given(role.id, optional) or _is_given(role.prefer, optional):
        return
    place = "base" if role.away and goal.meaning.roots == frozenset({HOME}) else near_for(goal.meaning, role, names)
    if place:
        what = f"any free {' or '.join(role.types)} may become '{role.name}', however far away it is"
        word = f"${{{place}}}"
        fix = role.room.fix("near", word) if role.room is not None and _is_one(goal.meaning, optional, names) else None
        problems.add("W088", role.mark, what, f"say where it is needed first: near: {word}", fix)


def _is_one(meaning: Meaning, optional: frozenset[str], names: Meanings) -> bool:
    """Return whether a place is always there, and is no list whose length the role might not have."""
    words = {meaning.word, *(meaning.roots or ())} - {HOME, ""}
    types = [names[word].type for word in words if word in names]
    return not words & optional and all(type_ is not None and type_.item is None for type_ in types)


def _is_given(expr: Expr | None, optional: frozenset[str]) -> bool:
    return expr is not None and not any(read.name in optional for read in expr.reads)


def _check_elsewhere(role: Role, near: Expr, goals: tuple[Goal, ...], names: Meanings, problems: Problems) -> None:
    chosen = roots_of(near, names)
    if chosen is None or any(goal.is_own or goal.meaning.roots is None for goal in goals):
        return
    if any(chosen & (goal.meaning.roots or set()) for goal in goals):
        return
    to = goals[0]
    where = to.meaning.word or " and ".join(sorted(to.meaning.roots or ()))
    what = f"'{role.name}' is chosen near '{bare(near)}', but goes to '{where}' first ({to.mark.said})"
    place = near_for(to.meaning, role, names)
    problems.add("W089", near.mark, what, f"near: ${{{place}}}" if place else "name the place that it goes to first")


def near_for(meaning: Meaning, role: Role, names: Meanings) -> str:
    """Return what `near` of a role would be for a place of the task, "" if that has no name there."""
    type_, word = meaning.type, meaning.word
    if not word and meaning.roots is not None and len(meaning.roots) == 1 and meaning.roots != {"base"}:
        word = next(iter(meaning.roots))
        type_ = names[word].type if word in names else None
    if not word or word not in names:
        return ""
    return _as_place(word, type_, role)


def _as_place(word: str, type_: Type | None, role: Role) -> str:
    if type_ is None or type_.name == "place":
        return word
    if type_.name == "region":
        return f"centroid({word})"
    if type_.name == "position":
        return f"ground({word})"
    if type_.item is None:
        return ""
    if role.is_list and type_.item.name == "place":
        return word
    return _as_place(f"first({word})", type_.item, role)
