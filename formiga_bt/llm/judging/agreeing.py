"""Which of several answers is taken: the one that most of them mean, by what they do in the dry run. No oracle is needed.

What is refused by checker, dry run or comparison does not vote. Two trees mean the same when machines of the same types do the
same in the same order with the same pauses, however they are written; questions and refusals are classes of their own.
"""

from collections import Counter
from collections.abc import Hashable, Sequence
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.records import RehearsedFlight

SHORTEST_S: Final = 0.1
"""What takes less is no move: the machine was there already."""
PAUSE_S: Final = 2.0
"""Pauses are compared in steps of so long."""


def meaning(answer: ModelAnswer, flight: RehearsedFlight | None) -> Hashable:
    """Return what an answer means; equal for answers that mean the same."""
    if answer.tree is None:
        return "question" if answer.question else "impossible"
    return ("tree", what_happened(flight) if flight is not None else None)


def what_happened(flight: RehearsedFlight) -> Hashable:
    """Return what machines and people did in a flight, whoever of a type did it."""
    if flight.timeline is None or flight.chart is None:
        return None
    types = {track.agent: track.type for track in flight.chart.tracks}
    rows: dict[str, list[Hashable]] = {}
    until: dict[str, int] = {}
    for one in sorted(flight.timeline.actions, key=lambda row: (row.start, row.agent)):
        end = one.end if one.end is not None else one.start
        if end - one.start < SHORTEST_S * 1e6:
            continue
        pause = round((one.start - until.get(one.agent, one.start)) / 1e6 / PAUSE_S)
        detail = one.detail if one.action != CONFIRM else ""  # questions are worded as one likes
        rows.setdefault(one.agent, []).append((pause, one.action, detail))
        until[one.agent] = end
    return tuple(sorted((types.get(agent, ""), tuple(done)) for agent, done in rows.items()))


def elected(meanings: Sequence[Hashable]) -> int:
    """Return the index of the first answer of the largest class; of equal ones the class that came first."""
    counts = Counter(meanings)
    return max(range(len(meanings)), key=lambda i: (counts[meanings[i]], -i))


def are_at_odds(meanings: Sequence[Hashable]) -> bool:
    """Return whether there are several answers, each of which means something else."""
    return len(meanings) > 1 and len(set(meanings)) == len(meanings)


def is_settled(meanings: Sequence[Hashable], left: int) -> bool:
    """Return whether so many further answers cannot change who is elected."""
    ranked = [count for _, count in Counter(meanings).most_common(2)]
    if not ranked:
        return left == 0
    return ranked[0] - (ranked[1] if len(ranked) > 1 else 0) > left or left == 0
