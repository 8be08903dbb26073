"""What each step must hold, whatever the others do: retries, time-outs, ignored failures, loops that wait, tidying up.

E042 (`busy_loops`), W104 (`quick_rounds`), W102 (`haste`), E046, E065, E074 of an order that asks, W049 and W069. Called by
`whole`.
"""

from typing import assert_never

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.busy_loops import check_spin
from formiga_bt.lang.checks.deadlock import check_blocks
from formiga_bt.lang.checks.endings import is_left
from formiga_bt.lang.checks.flight.contention import check_contention
from formiga_bt.lang.checks.flight.same_machine import check_same_machine
from formiga_bt.lang.checks.haste import check_haste
from formiga_bt.lang.checks.quick_rounds import check_quick_rounds
from formiga_bt.lang.model import (
    ActionSpec,
    Ask,
    BreakIf,
    Call,
    Catalogue,
    Check,
    Do,
    Expr,
    Fail,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Notify,
    Parallel,
    Release,
    Request,
    Sequence,
    Set,
    Step,
    Subtree,
    Switch,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import Problems, shorten
from formiga_bt.lang.types import agent_type
from formiga_bt.lang.walk import (
    begins_anew,
    children,
    claims_inside,
    lasting_orders,
    orders,
    requests_inside,
    roles_inside,
)


def can_succeed(step: Step) -> bool:
    """Return whether some path through a step succeeds."""
    if step.ignore_failure:
        return True
    match step:
        case Fail():
            return False
        case Sequence():
            return all(can_succeed(child) or child.when is not None for child in step.steps)
        case Fallback():
            return any(can_succeed(child) for child in step.steps)
        case If():
            return not step.otherwise or any(_all_can(branch) for branch in (step.then, step.otherwise))
        case Switch():
            return any(_all_can(branch) for branch in step.branches)
        case Guard() | WithAgents() | WithResource():
            return _all_can(step.steps)
        case Parallel():
            can = [can_succeed(child) or child.when is not None for child in step.steps]
            return all(can) if step.need == "all" else any(can)
        case (
            Do()
            | Ask()
            | Call()
            | Wait()
            | Check()
            | Set()
            | Notify()
            | WaitUntil()
            | WaitFor()
            | Release()
            | Request()
        ):
            return True
        case Loop():
            return not step.forever or step.until is not None or step.max is not None or is_left(step.steps)
        case For() | BreakIf():
            return True
        case _:
            assert_never(step)


def _all_can(steps: tuple[Step, ...]) -> bool:
    return all(can_succeed(step) or step.when is not None for step in steps)


def _may_never_end(step: Step) -> str:
    """Return why a step that waits for others may never end, "" of any other."""
    match step:
        case Ask():
            return "nobody may ever answer"
        case Do() if step.action == CONFIRM:
            return "nobody may ever answer"
        case Do() if step.track is not None:
            return "who moves may never be reached"
        case WaitUntil():
            return "this may never become true"
        case WaitFor():
            return "this may never happen"
        case _:
            return ""


class StepChecks:
    """Checks of each step of one task and of its subtrees."""

    def __init__(self, catalogue: Catalogue, problems: Problems) -> None:
        self.catalogue = catalogue
        self.actions = catalogue.actions
        self.problems = problems

    def check_subtree(self, subtree: Subtree) -> None:
        """Check the body of a subtree; a question in it may be bounded by its caller."""
        types = {param.name: agent_type(param.type).of for param in subtree.params.values()}
        types |= {role.name: role.types for role in roles_inside(subtree.steps)}
        with self.problems.outermost(subtree.name, "steps"):
            self.check(subtree.steps, bounded=False)
            check_contention(subtree.steps, types, self.catalogue, self.problems)
            roles = roles_inside(subtree.steps)
            check_same_machine(subtree.steps, roles, subtree.params.values(), self.catalogue, self.problems)
            check_blocks(subtree.steps, self.catalogue, self.problems)

    def check(self, steps: tuple[Step, ...], *, bounded: bool, cleanup: bool = False) -> None:
        """Check steps and what is inside them.

        Args:
            steps: the steps.
            bounded: a step around them has a time-out.
            cleanup: they are part of what follows the end of something.
        """
        for step in steps:
            with self.problems.within(step.title):
                self._check_step(step, bounded)
                if cleanup and isinstance(step, Loop) and step.forever:
                    what = "a section that tidies up cannot repeat forever"
                    self.problems.add("E065", step.mark, what, "such as: repeat: 3")
                if cleanup and isinstance(step, WithAgents):
                    what = "a section that tidies up cannot use with_agents"
                    self.problems.add("E065", step.mark, what, "it has the agents that the task still holds")
                if cleanup and isinstance(step, WithResource):
                    what = "a section that tidies up cannot use with_resource"
                    self.problems.add("E065", step.mark, what, "it has the resources that the task still holds")
                if cleanup and isinstance(step, Request):
                    what = "a section that tidies up cannot request a task"
                    self.problems.add(
                        "E065", step.mark, what, "request it in steps, with detached: true to outlive this one"
                    )
                if cleanup and isinstance(step, Call) and any(requests_inside(step.subtree.steps)):
                    what = f"a section that tidies up cannot request a task, as {step.subtree.name} does"
                    self.problems.add("E065", step.mark, what, "request it in steps")
                if cleanup and isinstance(step, Call) and any(claims_inside(step.subtree.steps)):
                    what = f"a section that tidies up cannot use with_resource, as {step.subtree.name} does"
                    self.problems.add("E065", step.mark, what, "it has the resources that the task still holds")
                if cleanup and isinstance(step, Call) and any(roles_inside(step.subtree.steps)):
                    what = f"a section that tidies up cannot use with_agents, as {step.subtree.name} does"
                    self.problems.add("E065", step.mark, what, "it has the agents that the task still holds")
                inner = bounded or step.timeout is not None or (step.retry is not None and step.retry.attempt_timeout)
                last = step.finally_ if isinstance(step, Sequence) else ()
                inside = children(step)[: -len(last) or None]
                if isinstance(step, Parallel) and step.need == "first":
                    for child in inside:
                        ended = any(_ends(other) for other in inside if other is not child)
                        self.check((child,), bounded=bool(inner or ended), cleanup=cleanup)
                else:
                    self.check(inside, bounded=bool(inner), cleanup=cleanup)
                self.check(last, bounded=False, cleanup=True)

    def _check_step(self, step: Step, bounded: bool) -> None:
        if begins_anew(step):
            self._check_again(step)
        if isinstance(step, Do):
            self._check_options(step)
            self._check_typical(step, step.timeout, "timeout")
            if step.retry is not None:
                self._check_typical(step, step.retry.attempt_timeout, "attempt_timeout")
        endless = _may_never_end(step)
        if (
            endless
            and step.timeout is None
            and not bounded
            and (step.retry is None or step.retry.attempt_timeout is None)
        ):
            self.problems.add("W049", step.mark, f"{endless}: add timeout:", "such as: timeout: 10 min")
        if isinstance(step, Loop):
            check_spin(step, self.problems)
            check_quick_rounds(step, self.problems)
        check_haste(step, self.problems)
        if step.ignore_failure:
            self._check_ignored(step)
        if isinstance(step, Fallback):
            self._check_fallback(step)

    def _check_options(self, step: Do) -> None:
        """Report E074 for a question that is put by `do`."""
        options = step.fields.get("options") if step.action == CONFIRM else None
        if options is None or not isinstance(options.const, tuple):
            return
        twice = next((one for index, one in enumerate(options.const) if one in options.const[:index]), None)
        if twice is not None:
            what = f"the option '{shorten(str(twice))}' is given twice"
            self.problems.add("E074", options.mark, what, "remove one")
        elif len(options.const) < 2:
            what = "a question needs at least two options"
            self.problems.add("E074", options.mark, what, "such as: options: [yes, no]")

    def _check_again(self, step: Step) -> None:
        repeated = lasting_orders(step) if step.retry is None or step.retry.agent == "another" else orders(step)
        for name, do in repeated:
            spec = self.actions.get(do.action)
            if spec is None or spec.repeatable:
                continue
            if step.retry is not None:
                what = f"{spec.name} cannot be repeated, so it cannot be retried"
                self.problems.add("E046", step.retry.mark, what, "remove retry, or put it around the other steps only")
            else:
                what = f"{spec.name} cannot be repeated, and '{name}' would do it again when the block is handed over"
                self.problems.add(
                    "E046", step.mark, what, "put it behind the block, or let an agent of the block do it"
                )
            return

    def _check_typical(self, step: Do, bound: Expr | None, key: str) -> None:
        spec = self.actions.get(step.action)
        if spec is None or bound is None or not bound.is_const or not isinstance(bound.const, int | float):
            return
        typical = spec.typical_us / 1e6
        if 0 < bound.const < typical:
            usual, given = format_quantity("duration", typical), format_quantity("duration", float(bound.const))
            what = f"{spec.name} usually takes {usual}, {key} is {given}"
            self.problems.add("E046", bound.mark, what, f"give it at least {usual}")

    def _moves(self, spec: ActionSpec | None) -> bool:
        return spec is not None and bool(spec.moves_to or spec.effect)

    def _check_ignored(self, step: Step) -> None:
        for name, do in lasting_orders(step):
            if self._moves(self.actions.get(do.action)):
                where = "in another state" if self.actions[do.action].effect else "somewhere else"
                what = f"if {do.action} fails, the next steps run with '{name}' {where}"
                self.problems.add("W069", step.mark, what, "let it fail, or use retry or fallback")
                return

    def _check_fallback(self, step: Fallback) -> None:
        moved: dict[str, str] = {}
        for child in step.steps:
            commanded = {name for name, _ in lasting_orders(child)}
            for name, action in moved.items():
                if name not in commanded and can_succeed(child):
                    what = f"if {action} fails, this counts as success with '{name}' somewhere else"
                    self.problems.add("W069", child.mark, what, f"command '{name}' here too, or end with fail:")
                    break
            for name, do in lasting_orders(child):
                if self._moves(self.actions.get(do.action)):
                    moved.setdefault(name, do.action)


def _ends(step: Step) -> bool:
    """Return whether a step ends by itself some time, so that another branch of a race need not."""
    if step.timeout is not None:
        return True
    if isinstance(step, Ask | WaitUntil | WaitFor) or (isinstance(step, Loop) and step.forever):
        return False
    return all(_ends(child) for child in (step.subtree.steps if isinstance(step, Call) else children(step)))
