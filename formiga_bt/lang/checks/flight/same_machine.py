"""One machine under two names: E034 where both are commanded at once, W101 where nobody can follow what is done to it.

Names of one body are told apart; two of them are one machine where a call passes it twice (`x: ${a}, y: ${a}`), or a list and
one of its members, and where a `for` goes over it twice, or over two lists that hold it. A subtree that gets one machine as two
agents is followed by `flight`, which knows them as one; what is in two lists, or may be the same, is not followed any further.
"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations, product
from typing import Final

from msgspec import Struct

from formiga_bt.base.diagnostics import CommandedTwice, Mark
from formiga_bt.lang.checks.flight.flight_states import InterpreterPlace, keys_of, line_of
from formiga_bt.lang.checks.known import agents_of
from formiga_bt.lang.model import Call, Catalogue, Do, Expr, For, Parallel, Param, Release, Role, Step, WithAgents
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import AgentRef, Value, agent_type
from formiga_bt.lang.walk import Names, agent_params, bare, called_with, children, commands, item_name, items_of

_SURE: Final = 2
_MAYBE: Final = 1

Words = tuple[str, ...]
"""Machines: `drone`, `drones[0]`; all of a list of unknown length: `drones`; one that may be this or another: `drones?`;
the item of a loop: `@d`."""


def check_same_machine(
    steps: tuple[Step, ...],
    roles: Iterable[Role],
    params: Iterable[Param],
    catalogue: Catalogue,
    problems: Problems,
) -> frozenset[str]:
    """Report E034 and W101 for the steps of a body; return the roles or params of which the flight is not followed.

    Args:
        steps: of the body.
        roles: that it has, those of its blocks too.
        params: of a subtree.
        catalogue: says which types are shared, and which fly.
        problems: where to report.
    """
    types: dict[str, tuple[str, ...]] = {}
    words: dict[str, Words] = {}
    names: dict[str, Value] = {}
    for role in roles:
        types[role.name] = role.types
        words[role.name] = keys = keys_of(role)
        if keys == (f"{role.name}[*]",):
            words[role.name] = (role.name,)
        else:
            names[role.name] = tuple(map(AgentRef, keys)) if role.is_list else AgentRef(role.name)
    for param in params:
        if agent_type(param.type).name == "agent":
            types[param.name] = agent_type(param.type).of
            words[param.name] = (param.name,)
            if param.type.item is None:
                names[param.name] = AgentRef(param.name)
    for name in [name for name in types if _is_shared(types[name], catalogue)]:
        del words[name]
        names.pop(name, None)
    found = _SameMachine(catalogue, problems)
    found.check(steps, _Frame(names, words))
    return frozenset(found.lost)


class _Frame(Struct, frozen=True):
    """What the names of a body stand for in the task, or in the subtree, where the check began."""

    names: Mapping[str, Value]
    """What has one value, for expressions."""
    words: Mapping[str, Words]
    call: Mark | None = None
    """The outermost call that led here."""
    of: str = ""
    """The subtree that was called there."""

    def resolve(self, name: str, item: str = "") -> Words:
        """Return the machines that a name, or an item of it (`[0]`), stands for."""
        words = self.words.get(name, ())
        if not item:
            return words
        if len(words) == 1 and words[0].isidentifier():
            return (words[0] + item,)
        index = int(item[1:-1])
        return (words[index],) if -len(words) <= index < len(words) else tuple(map(_unsure, words))

    def machines(self, expr: Expr) -> Words:
        """Return the machines that an expression stands for."""
        value = agents_of(expr, self.names)
        if value is not None:
            return (value.id,) if isinstance(value, AgentRef) else tuple(one.id for one in value)
        name, item = item_name(expr)
        if name:
            return self.resolve(name, item)
        reads = (read.name for read in expr.reads if not read.field)
        return tuple(dict.fromkeys(_unsure(word) for name in reads for word in self.resolve(name)))


class _SameMachine:
    def __init__(self, catalogue: Catalogue, problems: Problems) -> None:
        self.catalogue = catalogue
        self.problems = problems
        self.lost: set[str] = set()
        self.told: set[tuple[str, Mark]] = set()

    def check(self, steps: tuple[Step, ...], frame: _Frame) -> None:
        """Check steps and what is inside them."""
        for step in steps:
            with self.problems.within(step.title):
                inside = frame
                if isinstance(step, Call):
                    self._call(step, frame)
                elif isinstance(step, Parallel) and frame.call is not None:
                    self._branches(step, frame)
                elif isinstance(step, For):
                    inside = _inside(step, frame, but=self._for(step, frame))
                self.check(children(step), inside)

    def _call(self, step: Call, frame: _Frame) -> None:
        """Follow a call that passes one machine twice."""
        agents = [name for name in agent_params(step.subtree) if name in step.args]
        words = {name: frame.machines(step.args[name]) for name in agents}
        twice = [(one, other) for one, other in combinations(agents, 2) if _best(words[one], words[other])[0]]
        twice += [(name, name) for name in agents if _doubled(words[name])]
        used = self._used(step.subtree.steps) if twice else {}
        twice = [pair for pair in twice if {*pair} <= used.keys()]
        if not twice:
            return
        names = {name: value for name in agents if (value := agents_of(step.args[name], frame.names)) is not None}
        call = frame.call or step.mark
        self.check(step.subtree.steps, _Frame(names, words, call, step.subtree.name))
        for one, other in twice:
            certain, word = _best(words[one], words[other]) if one != other else (_SURE, _doubled(words[one]))
            lists = [name for name in (one, other) if step.subtree.params[name].type.item is not None]
            if (certain == _MAYBE or lists) and _matters(used[one], used[other]):  # else `flight` knows them as one
                self._cannot_follow(one, other, certain, word, call)

    def _branches(self, step: Parallel, frame: _Frame) -> None:
        """Report machines that branches of a called subtree command at once under two names."""
        mine = [[(agent, at) for agents, at in commands(branch, {}) for agent in agents] for branch in step.steps]
        for left, right in combinations(mine, 2):
            for (one, first), (other, second) in product(left, right):
                certain, word = _best(_of(one, frame), _of(other, frame))
                if _base(one) == _base(other) or not certain:
                    continue
                names = _base(one), _base(other)
                if certain == _SURE:
                    mark = frame.call or step.mark
                    where = f"{first.mark.said} and {line_of(second.mark, InterpreterPlace(mark.file))}"
                    self._at_once(
                        word,
                        f"two parallel branches of {frame.of}",
                        f"it is both '{names[0]}' and '{names[1]}' there ({where}): pass two machines",
                        frame.call or step.mark,
                    )
                else:
                    self._cannot_follow(*names, certain, word, frame.call or step.mark)

    def _for(self, step: For, frame: _Frame) -> set[str]:
        """Look for machines that a `for` goes over twice; return the loop names of which that was told."""
        told: set[str] = set()
        used = self._used(step.steps)
        mine = {name: frame.machines(expr) for name, expr in step.lists.items() if name in used}
        mark = frame.call or step.mark
        at_once = step.parallel and step.max_parallel != 1
        for name, words in mine.items():
            if at_once and (twice := _doubled(words)):
                help_ = f"the list of '{name}' has it twice: leave one out"
                self._at_once(twice, "two rounds of a parallel for", help_, mark)
            for other in sorted(used.keys() - step.lists.keys()) if not at_once else ():
                certain, word = _best(words, frame.resolve(other))
                if certain and _matters(used[name], used[other]):
                    told.add(name)
                    self._cannot_follow(name, other, certain, word, mark)
        for one, other in combinations(mine, 2):
            certain, word = _best(mine[one], mine[other])
            if not certain or _is_equal(step.lists[one], step.lists[other]):
                continue
            if at_once and (both := _across(mine[one], mine[other])):
                help_ = f"it is '{one}' in one round and '{other}' in another: leave mode: parallel away"
                self._at_once(both, "two rounds of a parallel for", help_, mark)
            elif at_once or _matters(used[one], used[other]):
                self._cannot_follow(one, other, certain, word, mark)
            else:
                continue
            told |= {one, other}
        return told

    def _at_once(self, word: str, where: str, help_: str, mark: Mark) -> None:
        """Report E034, once at a place."""
        if ("E034", mark) in self.told:
            return
        self.told.add(("E034", mark))
        self.lost.add(_base(word))
        agent = word.removeprefix("@")
        what = f"'{agent}' is commanded by {where} at once"
        self.problems.add("E034", mark, what, help_, about=CommandedTwice(agent))

    def _cannot_follow(self, one: str, other: str, certain: int, word: str, mark: Mark) -> None:
        """Report W101, once at a place."""
        base = _base(word)
        self.lost.add(base)
        if self.told & {("E034", mark), ("W101", mark)}:
            return
        self.told.add(("W101", mark))
        both = f"have '{word}' in common" if certain == _SURE else f"may be the same machine of '{base}'"
        which = f"'{one}' and '{other}' {both}" if one != other else f"'{one}' has '{word}' twice"
        what = f"{which}: what is done to it cannot be followed"
        self.problems.add(
            "W101", mark, what, "pass machines that surely differ, such as drones[0] and drones[1], or the list alone"
        )

    def _used(self, steps: tuple[Step, ...]) -> dict[str, int]:
        """Return the names that steps command, those of loops and of their lists among them, and what that does.

        2: it takes a machine up or down, or gives it back; 1: it needs it to be up, or down; 0: neither.
        """
        found: dict[str, int] = {}
        for step in steps:
            for agents, does in _orders(step, {}):
                spec = self.catalogue.actions.get(does.action) if isinstance(does, Do) else None
                weight = (2 if spec.effect else 1 if spec.requires else 0) if spec is not None else 2
                for name in map(_base, agents):
                    found[name] = max(weight, found.get(name, 0))
        return found


def _orders(step: Step, names: Names) -> Iterator[tuple[Words, Do | Release]]:
    """Iterate over the agents that a step commands or gives back, each with the step that does it, also in what it calls."""
    if isinstance(step, Do | Release):
        yield names.get(step.who.name, (step.who.name,)), step
        return
    inside: dict[str, Words] = dict(names)
    if isinstance(step, Call):
        inside = called_with(step, names)
    elif isinstance(step, For):
        inside |= {name: (name, *of) for name, of in items_of(step, names).items()}
    elif isinstance(step, WithAgents):  # its own agents are nobody else's
        inside |= dict.fromkeys(step.roles, ())
    for child in step.subtree.steps if isinstance(step, Call) else children(step):
        yield from _orders(child, inside)


def _matters(one: int, other: int) -> bool:
    """Return whether what one name does to a machine may be wrong for what the other one does to it."""
    return min(one, other) > 0 and max(one, other) > 1


def _inside(step: For, frame: _Frame, but: set[str]) -> _Frame:
    """Return the names in a loop: its items are one machine each, and may be any of their lists (`but` for some names)."""
    words = dict(frame.words)
    for name, expr in step.lists.items():
        first = next(one for one, other in step.lists.items() if one == name or _is_equal(expr, other))
        of = dict.fromkeys(_unsure(word) for word in frame.machines(expr))
        words[name] = (f"@{first}", *(() if name in but else of)) if of else ()
    names = {name: value for name, value in frame.names.items() if name not in step.lists}
    return _Frame(names, words, frame.call, frame.of)


def _is_equal(one: Expr, other: Expr) -> bool:
    """Return whether two lists are written alike."""
    return bare(one) == bare(other) != ""


def _is_shared(types: Iterable[str], catalogue: Catalogue) -> bool:
    """Return whether an agent may be commanded from two places: a person, or a machine of a shared type."""
    known = [catalogue.types[one] for one in types if one in catalogue.types]
    return bool(known) and all(one.shared or one.human for one in known)


def _of(agent: str, frame: _Frame) -> Words:
    name, bracket, index = agent.partition("[")
    return frame.resolve(name, bracket + index)


def _base(word: str) -> str:
    return word.partition("[")[0].removesuffix("?")


def _unsure(word: str) -> str:
    return word if word.endswith("?") else f"{word}?"


def _same(one: str, other: str) -> int:
    """Return whether two are surely the same, or have a machine in common; 0 = they are not."""
    if _base(one) != _base(other):
        return 0
    these = one.removesuffix("?"), other.removesuffix("?")
    if these[0] == these[1] or not all("[" in word for word in these):
        return _SURE if these == (one, other) else _MAYBE
    return _MAYBE if "[-1]" in one + other else 0


def _best(these: Words, those: Words) -> tuple[int, str]:
    """Return how sure it is that two have a machine in common, and which one."""
    best = max(
        ((_same(one, other), one) for one, other in product(these, those)), key=lambda two: two[0], default=(0, "")
    )
    return (best[0], best[1] if "?" not in best[1] else _base(best[1])) if best[0] else (0, "")


def _doubled(words: Words) -> str:
    """Return a machine that is in a list twice; "" = there is none."""
    return next((one for one, other in combinations(words, 2) if _same(one, other) == _SURE), "")


def _across(these: Words, those: Words) -> str:
    """Return a machine that is surely in one list in another round than in the other one."""
    pairs = product(enumerate(these), enumerate(those))
    return next((one for (at, one), (then, other) in pairs if at != then and _same(one, other) == _SURE), "")
