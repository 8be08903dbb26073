"""Where a role is sent first, and which places of the task an expression is made of.

A place is known by its roots: the params, `base` and the agents' own places that it is computed from, vars and the arguments of
calls written out. What comes of a step, or is a constant, has no roots: it is not understood, and nothing is said of it.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.checks.flight.landing import named
from formiga_bt.lang.model import Call, Catalogue, Do, Expr, Fallback, For, If, Parallel, Step, Switch, Task
from formiga_bt.lang.types import Type
from formiga_bt.lang.walk import children, item_name

HERE: Final = "its position"
HOME: Final = "its home"
_POINTS: Final = ("place", "position", "region")


class Meaning(Struct, frozen=True):
    """What a name stands for in the words of the task."""

    roots: frozenset[str] | None
    """None = not understood."""
    word: str = ""
    """Its name in the task; "" = it has none."""
    type: Type | None = None


Meanings = Mapping[str, Meaning]
_PLAIN: Final = Meaning(frozenset())


class Goal(Struct, frozen=True):
    """A place that a role is sent to."""

    meaning: Meaning
    mark: Mark
    """Of the outermost step."""

    @property
    def is_own(self) -> bool:
        """Return whether it is where the machine is, or its own port."""
        return bool(self.meaning.roots) and (self.meaning.roots or set()) <= {HERE, HOME}


def meanings_of(task: Task) -> dict[str, Meaning]:
    """Return what the names of a task stand for: params, vars and `base`."""
    names: dict[str, Meaning] = {"base": Meaning(frozenset({"base"}), "base", Type("place"))}
    for param in task.params.values():
        is_point = _point(param.type)
        names[param.name] = Meaning(frozenset({param.name}), param.name, param.type) if is_point else _PLAIN
    for role in task.roles:
        names[role] = _PLAIN
    for name, expr in task.vars.items():
        names[name] = Meaning(roots_of(expr, names), name, expr.type) if _point(expr.type) else _PLAIN
    return names


def _point(type_: Type) -> bool:
    of = type_.item if type_.name == "list" and type_.item is not None else type_
    return of.name in _POINTS


def roots_of(expr: Expr, names: Meanings, mine: frozenset[str] = frozenset()) -> frozenset[str] | None:
    """Return the roots of a place or of several; `mine` are local names of the machine whose own places are meant."""
    found: set[str] = set()
    for read in expr.reads:
        if read.field:
            own = {"position": HERE, "home": HOME}.get(read.field)
            if own is None:
                continue
            if read.name not in mine:
                return None
            found.add(own)
        elif read.name in mine or read.name in ("task", "now"):
            continue
        elif read.name not in names or names[read.name].roots is None:
            return None
        else:
            found |= names[read.name].roots or set()
    return frozenset(found) or None


def meaning_of(expr: Expr, names: Meanings, mine: frozenset[str] = frozenset()) -> Meaning:
    """Return what an expression stands for, with its name in the task if it is one place of it."""
    word = named(expr, {name: one.word for name, one in names.items()})
    known = next((one for one in names.values() if one.word and one.word == word), None)
    return Meaning(roots_of(expr, names, mine), word if known else "", known.type if known else None)


def first_goals(
    steps: Iterable[Step], role: str, catalogue: Catalogue, names: Meanings
) -> tuple[tuple[Goal, ...], bool]:
    """Return where a role may be sent first, and whether it surely is sent somewhere. Straight up and down is nowhere."""
    return _First(catalogue).of(steps, frozenset({role}), names, None)


class _First:
    def __init__(self, catalogue: Catalogue) -> None:
        self.catalogue = catalogue

    def of(
        self, steps: Iterable[Step], mine: frozenset[str], names: Meanings, mark: Mark | None
    ) -> tuple[tuple[Goal, ...], bool]:
        found: list[Goal] = []
        for step in steps:
            goals, sure = self._step(step, mine, names, mark)
            found += goals
            if sure and step.when is None and not step.ignore_failure:
                return tuple(found), True
        return tuple(found), False

    def _step(
        self, step: Step, mine: frozenset[str], names: Meanings, mark: Mark | None
    ) -> tuple[tuple[Goal, ...], bool]:
        match step:
            case Do():
                goals = tuple(self._do(step, mine, names, mark)) if step.who.name in mine else ()
                return goals, bool(goals)
            case Call():
                return self._call(step, mine, names, mark)
            case If():
                return self._branches((step.then, step.otherwise), mine, names, mark)
            case Switch():
                return self._branches(step.branches, mine, names, mark)
            case Fallback() | Parallel():
                ways = [self._step(child, mine, names, mark) for child in step.steps]
                goals = tuple(goal for some, _ in ways for goal in some)
                return goals, any(sure for _, sure in ways)
            case For():  # an item is named as its list
                inner = {**names, **{name: meaning_of(expr, names, mine) for name, expr in step.lists.items()}}
                also = frozenset(name for name, expr in step.lists.items() if item_name(expr)[0] in mine)
                return self.of(step.steps, mine | also, inner, mark)
            case _:
                return self.of(children(step), mine, names, mark)

    def _branches(
        self, branches: Iterable[tuple[Step, ...]], mine: frozenset[str], names: Meanings, mark: Mark | None
    ) -> tuple[tuple[Goal, ...], bool]:
        ways = [self.of(branch, mine, names, mark) for branch in branches]
        return tuple(goal for some, _ in ways for goal in some), all(sure for _, sure in ways)

    def _call(
        self, step: Call, mine: frozenset[str], names: Meanings, mark: Mark | None
    ) -> tuple[tuple[Goal, ...], bool]:
        inside = frozenset(name for name, arg in step.args.items() if item_name(arg)[0] in mine)
        if not inside:
            return (), False
        inner = {"base": names["base"]}
        for name, param in step.subtree.params.items():
            arg = step.args.get(name)
            inner[name] = meaning_of(arg, names, mine) if arg is not None and _point(param.type) else _PLAIN
        return self.of(step.subtree.steps, inside, inner, mark or step.mark)

    def _do(self, step: Do, mine: frozenset[str], names: Meanings, mark: Mark | None) -> Iterator[Goal]:
        spec = self.catalogue.actions.get(step.action)
        if spec is None:
            return
        for name, expr in step.fields.items():
            if name == spec.moves_to or expr.type.name == "region":
                meaning = meaning_of(expr, names, mine)
                if meaning.roots != frozenset({HERE}):
                    yield Goal(meaning, mark or step.mark)
