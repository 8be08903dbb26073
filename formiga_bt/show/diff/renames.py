"""Which names were given to the same thing: a role, param, var, saved name, loop name or subtree that changed its name only.

A name that only the old task has and one that only the new task has are one thing if they are used alike: the fields that
name them, with the name itself left blank, are mostly the same. The old tree is then read with the new names, so that a
rename is one change and not a hundred.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from formiga_bt.lang.model import Task
from formiga_bt.show.diff.outline import OutlineNode
from formiga_bt.show.diff.values import NAME, SUBTREE, Atom, FieldValue

ALIKE: Final = 0.6
"""So much of the use of a name must be the same; of a subtree, of its steps."""
_DEFINING: Final = ("for", "set")


@dataclass(frozen=True, slots=True)
class Rename:
    """One thing with two names."""

    kind: str
    """param, var, role, saved, loop, subtree."""
    scope: str
    """The subtree whose name it is, by its new name; "" = the task's."""
    old: str
    new: str


Names = dict[tuple[str, str], str]
"""Old scope and old name -> new name; of a subtree, its scope is `subtrees`."""
_SUBTREES: Final = "subtrees"


def find_renames(old: OutlineNode, new: OutlineNode) -> tuple[list[Rename], Names]:
    """Return what was renamed, and the new names."""
    found: list[Rename] = []
    names: Names = {}
    olds, news = _bodies(old), _bodies(new)
    alike = _steps_alike(olds, news, _visible(old) & _visible(new))
    for one, other in _pairs(alike):
        found.append(Rename("subtree", "", one, other))
        names[_SUBTREES, one] = other
    for scope, nodes in olds.items():
        in_new = names.get((_SUBTREES, scope), scope) if scope else ""
        if in_new not in news:
            continue
        for kind, one, other in _renamed_in(nodes, news[in_new]):
            found.append(Rename(kind, in_new, one, other))
            names[scope, one] = other
    return found, names


def with_names(old: OutlineNode, names: Names) -> None:
    """Give a tree its new names; the words of its fields stay as they are written."""
    if not names:
        return
    for node in list(old.below()):
        scope = node.scope

        def new(atom: Atom, scope: str = scope) -> Atom:
            where = _SUBTREES if atom[0] == SUBTREE else scope
            return atom[0], names.get((where, atom[1]), atom[1])

        callee = node.sub if node.kind == "call" else None
        node.scope = names.get((_SUBTREES, scope), scope)
        node.fields = {_key(key, scope, names, callee): value.renamed(new) for key, value in node.fields.items()}
        if node.kind in ("param", "var", "role"):
            node.sub = names.get((scope, node.sub), node.sub)
        elif node.kind in ("subtree", "call"):
            node.sub = names.get((_SUBTREES, node.sub), node.sub)


def _key(key: str, scope: str, names: Names, callee: str | None) -> str:
    word, _, rest = key.partition(" ")
    if word in _DEFINING and rest:
        return f"{word} {names.get((scope, rest), rest)}"
    if word == "with" and callee is not None:
        return f"{word} {names.get((callee, rest), rest)}"
    return key


def _bodies(root: OutlineNode) -> dict[str, list[OutlineNode]]:
    found: dict[str, list[OutlineNode]] = {"": []}
    for node in root.below():
        found.setdefault(node.scope, []).append(node)
    return found


# -- subtrees: by their steps ------------------------------------------------------------------------------------------
def _steps_alike(
    olds: Mapping[str, list[OutlineNode]], news: Mapping[str, list[OutlineNode]], twice: set[str]
) -> Iterator[tuple[float, str, str]]:
    gone, come = [one for one in olds if one not in news], [one for one in news if one not in olds]
    gone, come = [one for one in gone if one not in twice], [one for one in come if one not in twice]
    before = {one: _blank_steps(olds[one]) for one in gone}
    after = {one: _blank_steps(news[one]) for one in come}
    for one, steps in before.items():
        for other, others in after.items():
            yield _dice(steps, others), one, other


def _visible(root: OutlineNode) -> set[str]:
    """Return the subtrees that a task could call: one that is still there was not renamed."""
    return set(root.thing.subtrees) if isinstance(root.thing, Task) else set()


def _blank_steps(nodes: list[OutlineNode]) -> Counter[object]:
    steps = (node for node in nodes if node.kind not in ("group", "subtree"))
    return Counter((node.kind, node.sub if node.is_step else "", _blank_fields(node)) for node in steps)


def _blank_fields(node: OutlineNode) -> frozenset[object]:
    return frozenset((key.split()[0], _blank(value)) for key, value in node.fields.items())


def _blank(value: FieldValue) -> tuple[Atom, ...]:
    return tuple([(NAME, "") if atom[0] in (NAME, SUBTREE) else atom for atom in value.atoms])


# -- other names: by their use -----------------------------------------------------------------------------------------
def _renamed_in(olds: list[OutlineNode], news: list[OutlineNode]) -> Iterator[tuple[str, str, str]]:
    before, after = _defined(olds), _defined(news)
    gone = {name: kind for name, kind in before.items() if name not in after}
    come = {name: kind for name, kind in after.items() if name not in before}
    if not gone or not come:
        return
    uses, other_uses = _uses(olds, gone), _uses(news, come)
    scores = (
        (_likeness(uses[one], other_uses[other]), one, other)
        for one, kind in gone.items()
        for other, other_kind in come.items()
        if kind == other_kind
    )
    for one, other in _pairs(scores):
        yield gone[one], one, other


def _defined(nodes: list[OutlineNode]) -> dict[str, str]:
    """Return the names that a body defines, with what they are."""
    found: dict[str, str] = {}
    for node in nodes:
        if node.kind in ("param", "var", "role"):
            found.setdefault(node.sub, node.kind)
        for key, value in node.fields.items():
            if key in ("save_as", "collect", "first"):
                found.setdefault(value.atoms[0][1], "saved")
            elif key.startswith("for ") and node.kind == "for":
                found.setdefault(value.atoms[0][1], "loop")
    return found


Uses = tuple[Counter[object], Counter[object]]
"""Of a name: what its definition says, and the fields that name it."""


def _uses(nodes: list[OutlineNode], wanted: Mapping[str, str]) -> dict[str, Uses]:
    found: dict[str, Uses] = defaultdict(lambda: (Counter(), Counter()))
    for node in nodes:
        if node.kind in ("param", "var", "role") and node.sub in wanted:
            found[node.sub][0].update((key, _hidden(value, node.sub, wanted)) for key, value in node.fields.items())
        for key, value in node.fields.items():
            for name in {atom[1] for atom in value.atoms if atom[0] == NAME} & wanted.keys():
                sub = node.sub if node.is_step else ""
                found[name][1][node.kind, sub, key.split()[0], _hidden(value, name, wanted)] += 1
    return found


def _hidden(value: FieldValue, name: str, wanted: Mapping[str, str]) -> tuple[Atom, ...]:
    """Return a row in which a name, and others that may be renamed too, are blank."""
    return tuple(
        [
            (NAME, "this" if atom[1] == name else "other") if atom[0] == NAME and atom[1] in wanted else atom
            for atom in value.atoms
        ]
    )


def _likeness(one: Uses, other: Uses) -> float:
    definition, use = _dice(one[0], other[0]), _dice(one[1], other[1])
    if not one[1] and not other[1]:  # nothing uses it
        return definition if definition == 1.0 else 0.0
    return 0.3 * definition + 0.7 * use if one[0] or other[0] else use


def _dice(one: Counter[object], other: Counter[object]) -> float:
    both = one.total() + other.total()
    return 2 * (one & other).total() / both if both else 0.0


def _pairs(scores: Iterator[tuple[float, str, str]], least: float = ALIKE) -> Iterator[tuple[str, str]]:
    """Iterate over the likeliest pairs; each name once."""
    taken: set[tuple[bool, str]] = set()
    rank: Callable[[tuple[float, str, str]], tuple[float, str, str]] = lambda one: (-one[0], one[1], one[2])  # noqa: E731
    for score, one, other in sorted(scores, key=rank):
        if score >= least and (False, one) not in taken and (True, other) not in taken:
            taken |= {(False, one), (True, other)}
            yield one, other
