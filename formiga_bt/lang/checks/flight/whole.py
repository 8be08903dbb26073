"""Who is in the air where: abstract interpretation of a task's steps over what they may leave each machine in.

Per machine the state is a set of {grounded, airborne, unknown}, each with the reason why it is possible here. Both the paths
on which a step succeeds and those on which it fails are followed, through calls, loops and branches too (`flying`). Reports
E030 (an action's precondition fails on some path), E031 (the task can end in the air), W032 (a failure leaves a machine in the
air that has no way home) and E033 (one is released there).

A role with `away: true` may be either at the start; other machines are grounded. A failed TakeOff or LandIn leaves the
state unknown. In cleanup sections, in subtrees read for themselves, and in later attempts of a retry, unknown is fine and
only a sure contradiction is reported; in `finally` also what is impossible whenever the steps succeed. Conditions that agree
(`agreeing`) are followed together: what no way through them leads to is not reported.
"""

from types import MappingProxyType

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.lang.checks.agreeing import Assumed, Splits, ways
from formiga_bt.lang.checks.filled import filled_at_start
from formiga_bt.lang.checks.flight.flight_states import InterpreterPlace, Outcomes, Sky, Why, keys_of, start
from formiga_bt.lang.checks.flight.interpreter import Interpreter
from formiga_bt.lang.model import Catalogue, Role, Step, Subtree, Task
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import agent_type


def check_flight(task: Task, catalogue: Catalogue, problems: Problems, contended: frozenset[str] = frozenset()) -> None:
    """Report E030, E031, W032 and E033 for a task and for the subtrees that it sees.

    Args:
        task: the task.
        catalogue: what its actions require and do.
        problems: where to report.
        contended: roles commanded from two places at once (reported already), of which nothing is known.
    """
    before = len(problems.found)
    flight = _Flight(task, catalogue, problems, contended, {})
    flight.check()
    first = problems.found[before:]
    agreeing, splits = ways(task) if first else ([], {})
    if agreeing:
        del problems.found[before:]
        for assumed in agreeing:
            _Flight(task, catalogue, problems, contended, assumed, splits).check()
        again = {(one.code, one.mark): one for one in reversed(problems.found[before:])}
        again |= {(one.code, one.mark): one for one in first if (one.code, one.mark) in again}
        problems.found[before:] = again.values()
    known = {(one.code, one.mark) for one in problems.found[before:]}
    problems.found += [one for one in flight.sure if (one.code, one.mark) not in known]


class _Flight(Interpreter):
    def __init__(
        self,
        task: Task,
        catalogue: Catalogue,
        problems: Problems,
        contended: frozenset[str],
        assumed: Assumed,
        splits: Splits = MappingProxyType({}),
    ) -> None:
        roles = {role.name: role.types for role in task.roles.values()}
        super().__init__(catalogue, problems, roles)
        self.contended = contended
        self.reported |= contended
        self.assumed = assumed
        self.splits = splits
        self.task = task
        self.seen = task.subtrees
        self.file = task.mark.file
        self.sure: list[Diagnostic] = []
        """What is wrong in `finally` on every path on which the steps succeed."""

    def check(self) -> None:
        """Interpret the subtrees, the steps and the cleanup sections."""
        for subtree in self.task.subtrees.values():
            self._check_subtree(subtree)
        flying = [role for role in self.task.roles.values() if self.flies(role)]
        sky: Sky = {key: start(role) for role in flying for key in keys_of(role)}
        here = InterpreterPlace(self.file)
        self.filled = filled_at_start(self.task)
        with self.problems.within("steps"):
            ends = self._steps(self.task.steps, sky, here)
        for name, steps in (("on_failure", self.task.on_failure), ("on_abort", self.task.on_abort)):
            self._check_cleanup(name, steps, flying)
        self._check_cleanup("finally", self.task.finally_, flying)
        self._check_end(ends, flying, here)

    def _check_subtree(self, subtree: Subtree) -> None:
        unknown: Sky = {
            (param.name if param.type.name == "agent" else f"{param.name}[*]"): {"unknown": Why("", param.mark)}
            for param in subtree.params.values()
            if agent_type(param.type).name == "agent"
        }
        before = len(self.problems.found)
        with self.problems.outermost(subtree.name, "steps"):
            self._steps(subtree.steps, unknown, InterpreterPlace(subtree.mark.file, lenient=True))
        if len(self.problems.found) > before:
            self.broken.add((subtree.mark.file, subtree.mark.line))

    def _check_cleanup(self, name: str, steps: tuple[Step, ...], flying: list[Role]) -> None:
        unknown: Sky = {key: {"unknown": Why("", role.mark)} for role in flying for key in keys_of(role)}
        with self.problems.within(name):
            self._steps(steps, unknown, InterpreterPlace(self.file, lenient=True))

    def _check_end(self, ends: Outcomes, flying: list[Role], here: InterpreterPlace) -> None:
        final = ends.success
        if final is not None:
            before = len(self.problems.found)
            with self.problems.within("finally"):
                after = self._steps(self.task.finally_, final, replace(here, lenient=True, sure=True))
            self.sure = self.problems.found[before:]
            del self.problems.found[before:]
            final = after.success if after.success is not None else after.failure
        for role in flying:
            self.check_brought_home(role, final, "when the task ends")
            self.check_recover(role, ends.failure)
