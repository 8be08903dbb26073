"""Waits of the short form that say in prose what holds already: `wait_until: everyone is in position`.

A step of a team, and a `parallel`, end when all are there, so that what comes next needs no wait. Where the branches of a
`parallel` wait for each other, what is before and what is after become two of them. What is put right is told.
"""

import re
from collections.abc import Mapping
from typing import Any, Final


def _words(text: str) -> frozenset[str]:
    """Return the words of a text, in small letters; those of `all_ready` are two."""
    return frozenset(re.findall(r"[^\W_]+", text.casefold()))


_INNER: Final = ("steps", "then", "else", "sequence")
_MOVING: Final = ("do", "parallel", "for", "sequence")
_ANYBODY: Final = _words("all everyone everybody they them todos todas")
"""Who may be people, too, where people have a role."""
_WHO: Final = _words(
    "each both other others one two three four five drone drones machine machines lwd lwds hwd hwds uav uavs of the a an "
    "every first second third another team whole ambos los las el dron drones otro otros dos tres cuatro cada"
)
_IS: Final = _words(
    "are is have has been be in at on over above their its own to until when get gets got now "
    "están esta está estén hayan han ha en su sus"
)
_THERE: Final = _words(
    "there position positions place places spot spots formation formed ready together arrived arrive arrives reached reach "
    "reaches assembled posición posiciones sitio sitios lugar lugares puesto puestos formación listo listos allí ahí juntos "
    "llegado"
)


def without_idle_waits(tree: Mapping[str, Any], people: bool, added: list[str]) -> Mapping[str, Any]:
    """Return a tree without waits for machines that are there already.

    Args:
        tree: in the short form; it is not changed.
        people: some of its roles are people.
        added: is told what was put right.
    """
    agents = tree.get("agents")
    names = {str(one.get("name")) for one in agents if isinstance(one, dict)} if isinstance(agents, list) else set()
    words = _words(" ".join(names)) if not people else frozenset()
    known = _WHO | _IS | _THERE | words | (frozenset() if people else _ANYBODY)
    return _Waits(known, added).inside(tree)


class _Waits:
    def __init__(self, known: frozenset[str], added: list[str]) -> None:
        self._known = known
        self._added = added

    def inside(self, node: Mapping[str, Any], *, is_branch: bool = False) -> dict[str, Any]:
        """Return a node with its lists of steps put right; in a branch of a `parallel` a wait may be for another branch."""
        found = dict(node)
        is_branch = is_branch or node.get("mode") == "parallel"
        for key in _INNER:
            if isinstance(node.get(key), list):
                found[key] = self._steps(node[key], is_branch=is_branch)
        branches = node.get("parallel")
        if isinstance(branches, list):
            found["parallel"] = [self.inside(one, is_branch=True) if isinstance(one, dict) else one for one in branches]
        return found

    def _steps(self, steps: list[Any], *, is_branch: bool) -> list[Any]:
        found: list[Any] = []
        has_moved = False
        for step in steps:
            if not isinstance(step, dict):
                found.append(step)
            elif has_moved and not is_branch and self._is_idle(step):
                self._tell("it waits for nobody: a step ends when all of its machines are there")
            else:
                halves = None if is_branch else self._halves(step)
                found += halves or [self.inside(step, is_branch=is_branch)]
                has_moved = has_moved or any(key in step for key in _MOVING)
        return found

    def _halves(self, step: Mapping[str, Any]) -> list[dict[str, Any]] | None:
        """Return what is before and what is after the one wait in each branch of a `parallel`."""
        branches = step.get("parallel")
        if set(step) != {"parallel"} or not isinstance(branches, list) or len(branches) < 2:
            return None
        before: list[Any] = []
        after: list[Any] = []
        for branch in branches:
            steps = branch.get("sequence") if isinstance(branch, dict) and set(branch) == {"sequence"} else None
            if not isinstance(steps, list):
                return None
            waits = [i for i, one in enumerate(steps) if isinstance(one, dict) and self._is_idle(one)]
            if len(waits) != 1 or not 0 < waits[0] < len(steps) - 1:
                return None
            before.append({"sequence": steps[: waits[0]]})
            after.append({"sequence": steps[waits[0] + 1 :]})
        self._tell("they wait for each other: when all are there, all go on")
        return [self.inside({"parallel": before}), self.inside({"parallel": after})]

    def _is_idle(self, step: Mapping[str, Any]) -> bool:
        """Return whether a step waits until the machines are there, in prose."""
        text = step.get("wait_until")
        if set(step) != {"wait_until"} or not isinstance(text, str) or re.search(r"[(=<>\[]|\.\w", text):
            return False
        words = _words(text)
        return bool(words & _THERE) and words <= self._known

    def _tell(self, what: str) -> None:
        if what not in self._added:
            self._added.append(what)
