"""Flies a tree in every scene of its task and asks the oracles."""

from collections.abc import Callable, Mapping
from typing import Final

from experiments.e2_llm.flown import Flown
from experiments.e2_llm.fly import Scene
from experiments.e2_llm.oracles import ORACLES, Goal
from experiments.e2_llm.verdicts import Fault, Verdict, together

SCENES: Final[Mapping[str, Scene]] = {
    "yes": Scene(),
    "no": Scene(name="no", deny=("watcher_1",)),
}
"""How the people of a flight answer."""

Flyer = Callable[[Scene], Flown]
"""Flies what is judged in a scene."""


def judge(task: str, goal: Goal, flyer: Flyer, scenes: Mapping[str, Scene] | None = None) -> Verdict:
    """Return the faults over all scenes of a task; flights after a wrong one are not flown."""
    found: list[Verdict] = []
    for name, oracle in ORACLES[task].items():
        verdict = oracle(goal, flyer((scenes or SCENES)[name]))
        if name != "yes":
            verdict = Verdict(tuple(Fault(one.code, f"when people say {name}: {one.text}") for one in verdict.faults))
        found.append(verdict)
        if not verdict.ok:
            break
    return together(found)
