"""E034: one machine commanded from two places at once. Reading its fields is fine, and so is asking people.

Called once for each body (the task's sections, each subtree) by `checks`.
"""

from collections.abc import Mapping

from formiga_bt.base.diagnostics import CommandedTwice
from formiga_bt.lang.model import Catalogue, For, Parallel, Step
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import Names, children, commands, items_of, overlap


def check_contention(
    steps: tuple[Step, ...], types: Mapping[str, tuple[str, ...]], catalogue: Catalogue, problems: Problems
) -> frozenset[str]:
    """Report E034 for the steps of a body; return the roles or params that it was reported for.

    Args:
        steps: of the body.
        types: agent types by role or agent param; empty = any.
        catalogue: says which types are shared.
        problems: where to report.
    """
    shared = {
        name
        for name, of in types.items()
        if of and all(one in catalogue.types and catalogue.types[one].shared for one in of)
    }
    contention = _Contention(frozenset(shared), problems)
    contention.check(steps, {})
    return frozenset(contention.found)


class _Contention:
    def __init__(self, shared: frozenset[str], problems: Problems) -> None:
        self.shared = shared
        self.problems = problems
        self.found: set[str] = set()

    def check(self, steps: tuple[Step, ...], names: Names) -> None:
        """Check steps and what is inside them; `names`: what loop names stand for."""
        for step in steps:
            with self.problems.within(step.title):
                if isinstance(step, Parallel):
                    self._branches(step, names)
                if isinstance(step, For) and step.parallel and step.max_parallel != 1:
                    self._rounds(step, names)
                inside = {**names, **items_of(step, names)} if isinstance(step, For) else names
                self.check(children(step), inside)

    def _commanded(self, step: Step, names: Names) -> list[tuple[str, Step]]:
        return [
            (agent, at)
            for agents, at in commands(step, names)
            for agent in agents
            if agent.partition("[")[0] not in self.shared
        ]

    def _branches(self, step: Parallel, names: Names) -> None:
        before: list[tuple[str, Step]] = []
        told: set[str] = set()
        for branch in step.steps:
            mine = self._commanded(branch, names)
            for agent, at in mine:
                first = next((other for one, other in before if overlap(one, agent)), None)
                if first is not None and agent not in told:
                    told.add(agent)
                    self.found.add(agent.partition("[")[0])
                    what = f"'{agent}' is commanded by two parallel branches at once"
                    help_ = f"first at {first.mark.said}; command it in one branch, reading its fields is fine"
                    self.problems.add("E034", at.mark, what, help_, about=CommandedTwice(agent))
            before += mine

    def _rounds(self, step: For, names: Names) -> None:
        inside = {**names, **dict.fromkeys(step.lists, ())}
        told: set[str] = set()
        for child in step.steps:
            for agent, at in self._commanded(child, inside):
                if agent not in told:
                    told.add(agent)
                    self.found.add(agent.partition("[")[0])
                    what = f"'{agent}' is commanded by the rounds of a parallel for at once"
                    help_ = "command the loop name, or leave mode: parallel away"
                    self.problems.add("E034", at.mark, what, help_, about=CommandedTwice(agent))
