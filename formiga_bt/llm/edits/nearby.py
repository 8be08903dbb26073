"""The nearest tree that passes: a bounded search by program among trees that are a few edits away from a model's answer.

Each edit is for one thing that is wrong; it is kept only if that is right then and nothing else is wrong that was not before.
The judgement is the ordinary one: checker, dry run, comparison with the request. No model is asked.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from formiga_bt.llm.edits.steps import EditCase
from formiga_bt.llm.edits.table import EDITS, Edit
from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.judge import Judged
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

DEEP: Final = 3
"""Most edits of one tree."""
MOST: Final = 12
"""Most judgements of one search."""
LONG_S: Final = 1800.0
"""Of virtual time; a flight that takes longer is judged a few times only."""
_MOST_LONG: Final = 3
Judging = Callable[[ModelAnswer, tuple[str, ...]], Judged]
"""Judges an answer; is given what was edited in it."""


@dataclass(frozen=True, slots=True)
class Near:
    """An edited answer and what it is worth."""

    answer: ModelAnswer
    judged: Judged
    told: tuple[str, ...] = ()


def nearest(
    answer: ModelAnswer,
    judged: Judged,
    words: Words,
    world: RequestWorld,
    verbs: Mapping[str, AgentVerb],
    judging: Judging,
    edits: Mapping[str, tuple[Edit, ...]] = EDITS,
) -> Near:
    """Return the first tree without errors that is found, else the one with the fewest; the given one, if none is better.

    Args:
        answer: with a tree in short form; it is not changed.
        judged: what it is worth.
        words: the request that it is compared with.
        world: where it is to be flown.
        verbs: the vocabulary.
        judging: see there.
        edits: by the code of what is wrong.
    """
    return _Search(words, world, verbs, judging, edits).run(Near(answer, judged))


class _Search:
    def __init__(
        self,
        words: Words,
        world: RequestWorld,
        verbs: Mapping[str, AgentVerb],
        judging: Judging,
        edits: Mapping[str, tuple[Edit, ...]],
    ) -> None:
        self._words, self._world, self._verbs, self._judging, self._edits = words, world, verbs, judging, edits
        self._left = MOST
        self._seen: list[Mapping[str, Any]] = []
        self._best: Near

    def run(self, start: Near) -> Near:
        self._best = start
        flight = start.judged.flight
        if flight is not None and flight.duration_s > LONG_S:
            self._left = _MOST_LONG
        if any(one.code not in self._edits for one in _errors(start.judged)):
            self._left = min(self._left, DEEP)  # it will hardly become right
        assert start.answer.tree is not None
        self._seen.append(start.answer.tree)
        self._from(start, DEEP)
        return self._best

    def _from(self, near: Near, depth: int) -> None:
        """Try the edits of a tree, and those of each tree that is better."""
        tree = near.answer.tree
        if tree is None or not depth:
            return
        for wrong in _errors(near.judged):
            for edit in self._edits.get(wrong.code, ()):
                for made, told in edit(EditCase(tree, self._words, self._world, self._verbs, wrong)):
                    if not self._left or not self._best.judged.errors:
                        return
                    if made in self._seen:
                        continue
                    self._seen.append(made)
                    self._left -= 1
                    known = (*near.told, told)
                    answer = replace(near.answer, tree=dict(made))
                    found = Near(answer, self._judging(answer, known), known)
                    if _is_better(near.judged, found.judged, wrong):
                        if found.judged.errors < self._best.judged.errors:
                            self._best = found
                        self._from(found, depth - 1)


def _is_better(before: Judged, now: Judged, wrong: Shortfall) -> bool:
    """Return whether something is right now, and nothing became wrong.

    What only a flight can show is not known of a tree that could not be flown before.
    """
    were, are = {_key(one) for one in _errors(before)}, {_key(one) for one in _errors(now)}
    if before.task is None and now.task is not None:
        return True
    return _key(wrong) not in are and are < were


def _errors(judged: Judged) -> list[Shortfall]:
    return [one for one in judged.shortfalls if one.severity == "error"]


def _key(one: Shortfall) -> tuple[str, str]:
    return one.code, one.about or one.text
