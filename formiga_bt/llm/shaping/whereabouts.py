"""Where the machines of a tree may be, step by step: of the two branches of an `if` only one is done.

A machine has one spot, or, after branches in which it went different ways, several; each holds under what was answered. So the
one that lands there on a yes is not in the way of the one that lands there on a no, but both are in the way of a third one.
What is done in a loop is there in the next round, whatever is answered then: in a loop both branches count.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

Answer = tuple[str, str, bool]
"""Which question, which answer, whether it was that one."""
_ASKED: Final = re.compile(
    r"\s*(?:\$\{\s*)?(not\s+)?\(?\s*([A-Za-z_]\w*)\.answer\s*(==|!=)\s*(['\"])([^'\"]*)\4\s*\)?\s*\}?\s*"
)


@dataclass(frozen=True, slots=True)
class PossiblePlace:
    """Where a machine may be."""

    place: str
    """As the model wrote it; "" = it was sent nowhere, or home."""
    height: str
    """"" = on the ground."""
    given: frozenset[Answer] = frozenset()
    """It is there only if all this was answered."""


NOWHERE: Final = PossiblePlace("", "in the air")


@dataclass(slots=True)
class State:
    """What is known of all machines."""

    spots: dict[str, tuple[PossiblePlace, ...]] = field(default_factory=dict)
    """Agent -> where it may be; who was sent nowhere is missing."""
    teams: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Team -> the place that it was told, and the list that its members are at."""
    moved: dict[tuple[str, str], str] = field(default_factory=dict)
    """Agent and place -> the spot beside it that it has instead."""

    def copy(self) -> "State":
        """Return one that changes by itself."""
        return State(dict(self.spots), dict(self.teams), dict(self.moved))


@dataclass(slots=True)
class _Fork:
    before: State
    given: frozenset[Answer]
    yes: frozenset[Answer]
    no: frozenset[Answer]
    first: State


class Whereabouts:
    """Follows the machines of one tree."""

    def __init__(self) -> None:
        self.now = State()
        self._given: frozenset[Answer] = frozenset()
        self._options: dict[str, tuple[str, ...]] = {}
        self._forks: list[_Fork] = []
        self._loops = 0

    def of(self, agent: str) -> tuple[PossiblePlace, ...]:
        """Return where a machine may be, by what is answered here; () = it was sent nowhere."""
        return tuple(spot for spot in self.now.spots.get(agent, ()) if _can_be(spot.given | self._given))

    def only(self, agent: str) -> PossiblePlace:
        """Return where a machine is, if that is certain; else `NOWHERE`."""
        found = {(spot.place, spot.height) for spot in self.of(agent)}
        return PossiblePlace(*found.pop()) if len(found) == 1 else NOWHERE

    def others(self, agent: str) -> set[tuple[str, str]]:
        """Return place and height where any other machine may be."""
        rest = (one for other in self.now.spots if other != agent for one in self.of(other))
        return {(one.place, one.height) for one in rest if one.place}

    def goes(self, agent: str, place: str, height: str) -> None:
        """Keep where a machine is sent."""
        self.now.spots[agent] = (PossiblePlace(place, height, self._given),)

    def leaves(self, agent: str) -> None:
        """Keep that a machine is sent home."""
        self.now.spots.pop(agent, None)

    def asks(self, name: str, options: Iterable[str] = ()) -> None:
        """Keep what can be answered to a question whose answer is kept under a name; `yes` and `no` if nothing is said."""
        self._options[name] = tuple(options) or ("yes", "no")

    def begin_if(self, condition: str) -> None:
        """Begin the branch that is done if a condition holds."""
        known = None if self._loops else self._answer(condition)
        yes, no = (frozenset[Answer](), frozenset[Answer]())
        if known is not None:
            question, answer, is_it = known
            yes, no = frozenset([known]), frozenset([self._plain(question, answer, not is_it)])
        self._forks.append(_Fork(self.now.copy(), self._given, yes, no, self.now))
        self._given |= yes

    def begin_else(self) -> None:
        """Begin the branch that is done if it does not hold."""
        fork = self._forks[-1]
        fork.first = self.now
        self.now = _joined(fork.before, fork.first) if self._loops else fork.before.copy()
        self._given = fork.given | fork.no

    def end_if(self) -> None:
        """End both branches; a branch without steps has been begun, too."""
        fork = self._forks.pop()
        self.now = _joined(fork.first, self.now, fork.yes, fork.no)
        self._given = fork.given

    def begin_loop(self) -> None:
        """Begin what may be done several times."""
        self._loops += 1

    def end_loop(self) -> None:
        """End it."""
        self._loops -= 1

    @property
    def is_in_loop(self) -> bool:
        """Return whether what is done here may have been done before."""
        return self._loops > 0

    def _answer(self, condition: str) -> Answer | None:
        """Return what a condition says of an answer, if it says nothing else."""
        match = _ASKED.fullmatch(condition)
        return self._plain(match[2], match[5], (match[3] == "==") != bool(match[1])) if match is not None else None

    def _plain(self, question: str, answer: str, is_it: bool) -> Answer:
        """Return the one answer that is left of two, if it was not the other."""
        left = [one for one in self._options.get(question, ()) if one != answer]
        return (question, left[0], True) if not is_it and len(left) == 1 else (question, answer, is_it)


def _can_be(answers: Iterable[Answer]) -> bool:
    """Return whether all of this can have been answered."""
    known = set(answers)
    given = {(question, answer) for question, answer, is_it in known if is_it}
    one_each = len({question for question, _ in given}) == len(given)
    return one_each and not any((question, answer, False) in known for question, answer in given)


def _joined(
    one: State, other: State, yes: frozenset[Answer] = frozenset(), no: frozenset[Answer] = frozenset()
) -> State:
    """Return what is known after one of two branches, and nobody knows which."""
    spots: dict[str, tuple[PossiblePlace, ...]] = {}
    for agent in (*one.spots, *other.spots):
        a, b = one.spots.get(agent, (NOWHERE,)), other.spots.get(agent, (NOWHERE,))
        spots[agent] = a if a == b else tuple(dict.fromkeys([*_under(a, yes), *_under(b, no)]))
    teams = {team: told for team, told in one.teams.items() if other.teams.get(team) == told}
    moved = {key: spot for key, spot in one.moved.items() if other.moved.get(key) == spot}
    return State(spots, teams, moved)


def _under(spots: Iterable[PossiblePlace], given: frozenset[Answer]) -> Iterator[PossiblePlace]:
    yield from (replace(spot, given=spot.given | given) for spot in spots)
