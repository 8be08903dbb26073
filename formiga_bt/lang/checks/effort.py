"""W064, W063: what a task surely takes, against its timeouts and the charge that it asks for.

A walk over the steps, calls included, that adds up the least: the cheaper of two branches, nothing for what may be skipped, one
round of a loop whose rounds nobody knows. Ways count where both ends are known before any run (or the first one is a port of
the site); other actions count with their `typical` duration against a timeout, and not at all against the charge. So what is
reported is too much even on a good day. The formulae of charge are those of the gate
(`formiga_bt.base.energy`). `spending` has what machines take, `known` the values known before a run, `effort_told` the reports.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, assert_never

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.geo import Position, Region
from formiga_bt.lang.checks.effort_findings import OncePerMark
from formiga_bt.lang.checks.known import Names, value_of
from formiga_bt.lang.checks.spending import RoleSpending, Sum, Where, forget, of_branches
from formiga_bt.lang.model import (
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
    Site,
    Step,
    Switch,
    Task,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import Value
from formiga_bt.lang.walk import agent_params, children, commands, plain_name

_MOST_STEPS: Final = 50_000
"""Steps looked at, rounds and calls written out; a task with more is left alone."""


class _TooLong(Exception):  # noqa: N818 - a signal: nothing is reported
    pass


def check_effort(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report W064 for the timeouts of a task and its steps, and for the charge of its machines."""
    walk = _Walk(task, catalogue, site, problems)
    try:
        with problems.within("steps"):
            spent = walk.steps(task.steps, walk.start(), {}, {})
    except _TooLong:
        return
    walk.told.check_timeout("the task", spent.usual_s, task.timeout)
    with problems.within("agents"):
        for role in task.roles.values():
            walk.told.check_charge(role, spent)


class _Walk:
    def __init__(self, task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
        self.task = task
        self.catalogue = catalogue
        self.site = site
        self.left = _MOST_STEPS
        self.bounds: list[float] = []
        """Seconds after which something around the step ends it."""
        answer = catalogue.actions.get(CONFIRM)
        self.answer_s = answer.typical_us / 1e6 if answer is not None else 0.0
        self.spending = RoleSpending(task, catalogue, site)
        self.told = OncePerMark(self.spending, site, self.answer_s, problems)

    # --- values ------------------------------------------------------------------------------------------------

    def start(self) -> dict[str, Value]:
        """Return the names that have one value in every run: vars that no step sets."""
        names: dict[str, Value] = {}
        changed = set(_assigned(self.task.steps))
        for name, expr in self.task.vars.items():
            value = self.value(expr, names)
            if value is not None and name not in changed:
                names[name] = value
        return names

    def value(self, expr: Expr | None, names: Names) -> Any:
        """Return the value of an expression, or None if it is not known before a run."""
        return value_of(expr, names, self.site)

    # --- steps -------------------------------------------------------------------------------------------------

    def steps(self, steps: Iterable[Step], names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what steps one after another take; `who` says which role an agent param is; `at` is changed."""
        total = Sum()
        for step in steps:
            total.add(self.step(step, names, who, at))
        return total

    def step(self, step: Step, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what a step takes; check its own timeouts."""
        self.left -= 1
        if self.left < 0:
            raise _TooLong
        before = dict(at)
        self.told.check_hover(step, who, at, self.bounds[-1:])
        self.bounds.append(
            min((b for b in (_bound_s(step.timeout), *self.bounds[-1:]) if b is not None), default=math.inf)
        )
        spent = self.kind(step, names, who, at)
        self.bounds.pop()
        if not isinstance(step, Do):
            self.told.check_timeout(step.title, spent.usual_s, step.timeout)
            if step.retry is not None:
                self.told.check_timeout(step.title, spent.usual_s, step.retry.attempt_timeout, "attempt_timeout")
        if step.when is not None or step.ignore_failure:
            forget(at, before)
            return Sum()
        return spent

    def kind(self, step: Step, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what a step takes without its modifiers."""
        match step:
            case Do():
                return self.do(step, names, who, at)
            case WithAgents():
                for role in step.roles.values():
                    self.told.check_hand_over(role)
                return self.steps(step.steps, names, who, at)
            case Ask():
                self.told.check_escalation(step)
                return Sum(self.answer_s)
            case Wait():
                seconds = self.value(step.duration, names)
                return self.pause(float(seconds) if isinstance(seconds, int | float) else 0.0, at)
            case Call():
                return self.call(step, names, who, at)
            case Parallel():
                return self.parallel(step, names, who, at)
            case For():
                return self.over(step, names, who, at)
            case Loop():
                return self.loop(step, names, who, at)
            case If():
                return self.branches((step.then, step.otherwise), names, who, at)
            case Switch():
                return self.branches(step.branches, names, who, at)
            case Fallback():
                return self.branches(tuple((child,) for child in step.steps), names, who, at)
            case Release():
                at.pop(who.get(step.who.name, step.who.name), None)
                return Sum()
            case Sequence() | Guard() | WithResource():
                return self.steps(children(step), names, who, at)
            case Check() | Set() | Notify() | Fail() | WaitUntil() | WaitFor() | BreakIf() | Request():
                return Sum()
            case _:
                assert_never(step)

    def branches(self, branches: tuple[tuple[Step, ...], ...], names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return the least that any branch takes."""
        ends, sums = [], []
        for branch in branches:
            end = dict(at)
            sums.append(self.steps(branch, names, who, end))
            ends.append(end)
        for end in ends:
            forget(at, end)
        return of_branches(sums, min) if sums else Sum()

    def parallel(self, step: Parallel, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what all branches together take; of a part of them, nothing is sure."""
        sums = []
        before = dict(at)
        mine = [{who.get(one, one) for some, _ in commands(child, {}) for one in some} for child in step.steps]
        if step.need != "all":  # another branch may end it at any time
            self.bounds.append(0.0)
        for index, child in enumerate(step.steps):
            others = set().union(*(roles for other, roles in enumerate(mine) if other != index))
            end = {role: point for role, point in before.items() if role not in others}
            sums.append(self.step(child, names, who, end))
            for role in mine[index]:
                at.pop(role, None)
                if role in end:
                    at[role] = end[role]
        if step.need == "all":
            return of_branches(sums, max)
        self.bounds.pop()
        at.clear()
        return Sum(min((one.usual_s for one in sums), default=0.0))

    def loop(self, step: Loop, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what one round takes; nothing if there may be none. A span of rounds takes that long if nothing leaves it."""
        before = dict(at)
        spent = self.steps(step.steps, names, who, at)
        end = dict(at)
        forget(at, before)
        if step.cond is not None:
            return Sum()
        if _leaves(step.steps):
            return Sum(spent.usual_s)
        at.update({role: point for role, point in end.items() if point is not None})
        seconds = self.value(step.duration, names)
        if isinstance(seconds, int | float) and step.until is None and step.max is None:
            spent.usual_s = max(spent.usual_s, float(seconds))
        return spent

    def over(self, step: For, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what the rounds over lists take: all of them where the lists are known, else nothing or one."""
        lists = {name: self.value(expr, names) for name, expr in step.lists.items()}
        agents = {name: _role(expr, who) for name, expr in step.lists.items()}
        if not all(isinstance(value, tuple) for value in lists.values()):
            inner = {**who, **agents}
            end = dict(at)
            spent = self.steps(step.steps, {k: v for k, v in names.items() if k not in lists}, inner, end)
            at.clear()
            sure = all(agents[name] for name in lists) and step.needs_all and not _leaves(step.steps)
            return spent if sure else Sum()
        total = Sum()
        rounds = list(zip(*(value for value in lists.values()), strict=False))
        for items in rounds:
            one = self.steps(step.steps, {**names, **dict(zip(lists, items, strict=True))}, who, at)
            if step.parallel:
                total = of_branches([total, one], max)
            else:
                total.add(one)
        return total if step.needs_all and not _leaves(step.steps) else Sum()

    def call(self, step: Call, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what a called subtree takes."""
        agents = agent_params(step.subtree)
        inner_who = {name: _role(step.args[name], who) if name in step.args else "" for name in agents}
        inner: dict[str, Value] = {}
        for name, arg in step.args.items():
            value = self.value(arg, names) if name not in agents else None
            if value is not None:
                inner[name] = value
        spent = self.steps(step.subtree.steps, inner, inner_who, at)
        if "" in inner_who.values():  # nobody knows who moved
            at.clear()
        return spent

    # --- time and charge ---------------------------------------------------------------------------------------

    def do(self, step: Do, names: Names, who: Mapping[str, str], at: Where) -> Sum:
        """Return what a goal takes."""
        spec = self.catalogue.actions.get(step.action)
        if spec is None:
            return Sum()
        role = who.get(step.who.name, step.who.name)
        target = self.value(step.fields.get(spec.moves_to), names) if spec.moves_to else None
        speed = self.value(step.fields.get(spec.speed), names)
        spent = Sum(spec.typical_us / 1e6)
        if isinstance(target, Position) and spec.effect == "":
            way = self.spending.way(role, at.get(role), target, speed if isinstance(speed, float | int) else None)
            self.told.check_leg(step.fields[spec.moves_to], at.get(role), target)
            if way:
                spent = Sum(min(seconds for seconds, _ in way.values()), way)
                self.told.check_way(step, spent.usual_s, spec)
        region = next((v for f in step.fields.values() if isinstance(v := self.value(f, names), Region)), None)
        if region is not None:
            spent.air = {**self.spending.sweep(role, region)}
        if spec.effect == "airborne":
            at.setdefault(role, None)
        elif spec.effect == "grounded":
            at.pop(role, None)
        elif spec.moves_to or region is not None:
            at[role] = target if isinstance(target, Position) else None
        spent.add(self.spending.hover(max((s for s, _ in spent.air.values()), default=0.0), at, role))
        return Sum(max(spent.usual_s, max((s for s, _ in spent.air.values()), default=0.0)), spent.air)

    def pause(self, seconds: float, at: Where) -> Sum:
        """Return what waiting takes: who is in the air hovers."""
        return Sum(seconds, self.spending.hover(seconds, at, "").air)


def _role(expr: Expr, who: Mapping[str, str]) -> str:
    """Return the role that an expression is, "" if it is more than a name."""
    name = plain_name(expr)
    return who.get(name, name)


def _leaves(steps: Iterable[Step]) -> bool:
    """Return whether a `break_if` may leave the loop of these steps."""
    return any(
        isinstance(step, BreakIf) or (not isinstance(step, Loop | For) and _leaves(children(step))) for step in steps
    )


def _assigned(steps: Iterable[Step]) -> Iterator[str]:
    for step in steps:
        yield from getattr(step, "assign", ())
        yield from _assigned(children(step))


def _bound_s(bound: Expr | None) -> float | None:
    const = bound.const if bound is not None and bound.is_const else None
    return float(const) if isinstance(const, int | float) else None
