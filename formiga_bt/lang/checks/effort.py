"""W064, W063: what a task surely takes, against its timeouts and the charge that it asks for.

A walk over the steps, calls included, that adds up the least: the cheaper of two branches, nothing for what may be skipped, one
round of a loop whose rounds nobody knows. Ways count where both ends are known before any run (or the first one is a port of
the site); other actions count with their `typical` duration against a timeout, and not at all against the charge. So what is
reported is too much even on a good day. The formulae of charge are those of the gate (`formiga_bt.energy`).
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from formiga_bt.diagnostics import Mark
from formiga_bt.energy import Power, hover_pct, power_of, way_pct
from formiga_bt.geo import Place, Position, Region
from formiga_bt.lang.binding import BASE, SiteEnv
from formiga_bt.lang.checks import hovering
from formiga_bt.lang.checks.fleet import types_that_fit
from formiga_bt.lang.envelope import key_of
from formiga_bt.lang.expressions import plain_name
from formiga_bt.lang.fence import breaks, enters, leaves
from formiga_bt.lang.model import (
    ActionSpec,
    Ask,
    BreakIf,
    Call,
    Catalogue,
    Do,
    EvalError,
    Expr,
    Fallback,
    For,
    If,
    Loop,
    Parallel,
    Release,
    Role,
    Site,
    Step,
    Switch,
    Task,
    UnknownState,
    Unset,
    Wait,
)
from formiga_bt.lang.reading import Problems
from formiga_bt.lang.types import AgentRef, Value
from formiga_bt.lang.walk import agent_params, children, commands
from formiga_bt.units import format_quantity

_MOST_STEPS: Final = 50_000
"""Steps looked at, rounds and calls written out; a task with more is left alone."""

Names = Mapping[str, Value]


class _TooLong(Exception):  # noqa: N818 - a signal: nothing is reported
    pass


class _Known:
    """What an expression may read before any run: base, site, and names that have one value."""

    def __init__(self, site: Site | None, names: Names) -> None:
        self._site = SiteEnv(site) if site is not None else None
        self._names = names

    def name(self, name: str) -> Value:
        if name in self._names:
            return self._names[name]
        if self._site is not None:
            return self._site.name(name)
        if name == "base":
            return BASE
        raise Unset(name)

    def is_set(self, name: str) -> bool:
        if name in self._names:
            return True
        raise Unset(name)

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        raise UnknownState(f"{agent.id}.{name}")

    def lat_lng(self, point: Any) -> tuple[float, float]:
        return self._of_site().lat_lng(point)

    def place(self, lat: float, lng: float) -> Place:
        return self._of_site().place(lat, lng)

    def ground_up_m(self, place: Any) -> float:
        return self._site.ground_up_m(place) if self._site is not None else 0.0

    def members(self, type_name: str) -> Any:
        raise Unset(type_name)

    def _of_site(self) -> SiteEnv:
        if self._site is None:
            raise Unset("site")
        return self._site


@dataclass(slots=True)
class Sum:
    """What some steps take at least: seconds, and by (role, type) seconds in the air and points of charge."""

    usual_s: float = 0.0
    """With the typical times of actions."""
    air: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)

    def add(self, other: "Sum") -> None:
        """Take what comes after this."""
        self.usual_s += other.usual_s
        for key, (seconds, points) in other.air.items():
            mine = self.air.get(key, (0.0, 0.0))
            self.air[key] = (mine[0] + seconds, mine[1] + points)


def _of_branches(branches: list[Sum], pick: Any) -> Sum:
    keys = {key for one in branches for key in one.air}
    air = {key: pick((one.air.get(key, (0.0, 0.0)) for one in branches), key=lambda two: two[1]) for key in keys}
    return Sum(pick(one.usual_s for one in branches), air)


def check_effort(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report W064 for the timeouts of a task and its steps, and for the charge of its machines."""
    walk = _Walk(task, catalogue, site, problems)
    try:
        with problems.within("steps"):
            spent = walk.steps(task.steps, walk.start(), {}, {})
    except _TooLong:
        return
    walk.check_timeout("the task", spent.usual_s, task.timeout)
    with problems.within("agents"):
        for role in task.roles.values():
            walk.check_charge(role, spent)


class _Walk:
    def __init__(self, task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
        self.task = task
        self.catalogue = catalogue
        self.site = site
        self.problems = problems
        self.told: set[Mark] = set()
        self.left = _MOST_STEPS
        self.bounds: list[float] = []
        """Seconds after which something around the step ends it."""
        answer = catalogue.actions.get("Confirm")
        self.answer_s = answer.typical_us / 1e6 if answer is not None else 0.0
        self.powers: dict[str, dict[str, Power]] = {}
        """Machine types of a role, with what they use."""
        for role in task.roles.values():
            if not role.is_list:  # its items are not told apart
                types = types_that_fit(role, catalogue.types)
                powers = {one.name: power_of(one.limits) for one in types if not one.human}
                self.powers[role.name] = {name: power for name, power in powers.items() if power is not None}

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
        if expr is None or expr.is_const:
            return expr.const if expr is not None else None
        if any(read.field or (read.name not in names and read.name not in ("base", "site")) for read in expr.reads):
            return None
        try:
            return expr.run(_Known(self.site, names))
        except (Unset, UnknownState, EvalError, ArithmeticError, LookupError):
            return None

    # --- steps -------------------------------------------------------------------------------------------------

    def steps(self, steps: Iterable[Step], names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what steps one after another take; `who` says which role an agent param is; `at` is changed."""
        total = Sum()
        for step in steps:
            total.add(self.step(step, names, who, at))
        return total

    def step(self, step: Step, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what a step takes; check its own timeouts."""
        self.left -= 1
        if self.left < 0:
            raise _TooLong
        before = dict(at)
        self.check_hover(step, who, at)
        self.bounds.append(
            min((b for b in (_bound_s(step.timeout), *self.bounds[-1:]) if b is not None), default=math.inf)
        )
        spent = self.kind(step, names, who, at)
        self.bounds.pop()
        if not isinstance(step, Do):
            self.check_timeout(step.title, spent.usual_s, step.timeout)
            if step.retry is not None:
                self.check_timeout(step.title, spent.usual_s, step.retry.attempt_timeout, "attempt_timeout")
        if step.when is not None or step.ignore_failure:
            _forget(at, before)
            return Sum()
        return spent

    def kind(self, step: Step, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what a step takes without its modifiers."""
        match step:
            case Do():
                return self.do(step, names, who, at)
            case Ask():
                self.check_escalation(step)
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
            case _:
                return self.steps(children(step), names, who, at)

    def branches(
        self, branches: tuple[tuple[Step, ...], ...], names: Names, who: Mapping[str, str], at: "Where"
    ) -> Sum:
        """Return the least that any branch takes."""
        ends, sums = [], []
        for branch in branches:
            end = dict(at)
            sums.append(self.steps(branch, names, who, end))
            ends.append(end)
        for end in ends:
            _forget(at, end)
        return _of_branches(sums, min) if sums else Sum()

    def parallel(self, step: Parallel, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
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
            return _of_branches(sums, max)
        self.bounds.pop()
        at.clear()
        return Sum(min((one.usual_s for one in sums), default=0.0))

    def loop(self, step: Loop, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what one round takes; nothing if there may be none. A span of rounds takes that long if nothing leaves it."""
        before = dict(at)
        spent = self.steps(step.steps, names, who, at)
        end = dict(at)
        _forget(at, before)
        if step.cond is not None:
            return Sum()
        if _leaves(step.steps):
            return Sum(spent.usual_s)
        at.update({role: point for role, point in end.items() if point is not None})
        seconds = self.value(step.duration, names)
        if isinstance(seconds, int | float) and step.until is None and step.max is None:
            spent.usual_s = max(spent.usual_s, float(seconds))
        return spent

    def over(self, step: For, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what the rounds over lists take: all of them where the lists are known, else nothing or one."""
        lists = {name: self.value(expr, names) for name, expr in step.lists.items()}
        agents = {name: _role(expr, who) for name, expr in step.lists.items()}
        if not all(isinstance(value, tuple) for value in lists.values()):
            inner = {**who, **agents}
            end = dict(at)
            spent = self.steps(step.steps, {k: v for k, v in names.items() if k not in lists}, inner, end)
            at.clear()
            sure = all(agents[name] for name in lists) and step.need == "all" and not _leaves(step.steps)
            return spent if sure else Sum()
        total = Sum()
        rounds = list(zip(*(value for value in lists.values()), strict=False))
        for items in rounds:
            one = self.steps(step.steps, {**names, **dict(zip(lists, items, strict=True))}, who, at)
            if step.parallel:
                total = _of_branches([total, one], max)
            else:
                total.add(one)
        return total if step.need == "all" and not _leaves(step.steps) else Sum()

    def call(self, step: Call, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
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

    def do(self, step: Do, names: Names, who: Mapping[str, str], at: "Where") -> Sum:
        """Return what a goal takes."""
        spec = self.catalogue.actions.get(step.action)
        if spec is None:
            return Sum()
        role = who.get(step.who.name, step.who.name)
        target = self.value(step.fields.get(spec.moves_to), names) if spec.moves_to else None
        speed = self.value(step.fields.get("speed"), names)
        spent = Sum(spec.typical_us / 1e6)
        if isinstance(target, Position) and spec.effect == "":
            way = self.way(role, at.get(role), target, speed if isinstance(speed, float | int) else None)
            self._check_leg(step.fields[spec.moves_to], at.get(role), target)
            if way:
                spent = Sum(min(seconds for seconds, _ in way.values()), way)
                self._check_way(step, spent.usual_s, spec)
        region = next((v for f in step.fields.values() if isinstance(v := self.value(f, names), Region)), None)
        if region is not None:
            spent.air = {**self.sweep(role, region)}
        if spec.effect == "airborne":
            at.setdefault(role, None)
        elif spec.effect == "grounded":
            at.pop(role, None)
        elif spec.moves_to or region is not None:
            at[role] = target if isinstance(target, Position) else None
        spent.add(self.hover(max((s for s, _ in spent.air.values()), default=0.0), at, role))
        return Sum(max(spent.usual_s, max((s for s, _ in spent.air.values()), default=0.0)), spent.air)

    def pause(self, seconds: float, at: "Where") -> Sum:
        """Return what waiting takes: who is in the air hovers."""
        return Sum(seconds, self.hover(seconds, at, "").air)

    def hover(self, seconds: float, at: "Where", but: str) -> Sum:
        """Return what machines in the air take while something else lasts so long."""
        return Sum(
            0.0,
            {
                (role, name): (seconds, hover_pct(seconds, power))
                for role in at
                if role != but
                for name, power in self.powers.get(role, {}).items()
                if seconds > 0
            },
        )

    def way(
        self, role: str, start: Position | None, end: Position, speed: float | None
    ) -> dict[tuple[str, str], tuple[float, float]]:
        """Return seconds and points by type for a straight way, empty where its start is not known."""
        found = {}
        for name, power in self.powers.get(role, {}).items():
            if start is None:
                continue
            level = math.hypot(end.east_m - start.east_m, end.north_m - start.north_m)
            fast = min(speed, power.speed_m_s) if speed else power.speed_m_s
            seconds = max(level / fast, abs(end.up_m - start.up_m) / power.climb_m_s)
            found[role, name] = (seconds, way_pct(start, end, power, speed_m_s=speed))
        return found

    def sweep(self, role: str, region: Region) -> dict[tuple[str, str], tuple[float, float]]:
        """Return seconds and points by type for covering an area in lanes."""
        found = {}
        for name, power in self.powers.get(role, {}).items():
            seconds = _area_m2(region) / (power.sweep_spacing_m * power.speed_m_s)
            found[role, name] = (seconds, seconds * power.cruise_pct_s)
        return found

    # --- reports -----------------------------------------------------------------------------------------------

    def _check_leg(self, to: Expr, start: Position | None, end: Position) -> None:
        """Report W063 for a way between two known points that goes where nothing may fly; the points are told by themselves."""
        if start is None or any(leaves(one, self.site) or enters(one, self.site) for one in (start, end)):
            return
        what = breaks(start, end, self.site)
        if what and to.mark not in self.told:
            self.told.add(to.mark)
            self.problems.add("W063", to.mark, what, "fly round it, over a place between")

    def _check_way(self, step: Do, seconds: float, spec: ActionSpec) -> None:
        bound = step.timeout
        if bound is not None and bound.is_const and seconds > bound.const >= spec.typical_us / 1e6:
            self._report(bound, f"a way of about {_about(seconds)}, timeout is {_exact(bound.const)}")

    def check_timeout(self, what: str, seconds: float, bound: Expr | None, key: str = "timeout") -> None:
        """Report W064 for a timeout that is shorter than what it bounds takes."""
        if bound is None or not bound.is_const or not isinstance(bound.const, int | float) or seconds <= bound.const:
            return
        self._report(bound, f"{what} takes about {_about(seconds)}, {key} is {_exact(bound.const)}")

    def _report(self, bound: Expr, what: str) -> None:
        if bound.mark not in self.told:
            self.told.add(bound.mark)
            self.problems.add("W064", bound.mark, what, "make it longer, or the path shorter")

    def check_hover(self, step: Step, who: Mapping[str, str], at: "Where") -> None:
        """Report W096 for a wait that lasts longer than a machine in the air can hover."""
        seconds = hovering.waiting_s(step)
        if seconds is None or step.timeout is None or step.timeout.mark in self.told:
            return
        for role in hovering.who_waits(step, at, who):
            powers = self.powers.get(role, {})
            most = hovering.longest_hover_s(powers, {name: self.reserve(name) for name in powers})
            if min([seconds, *self.bounds[-1:]]) > most:
                self.told.add(step.timeout.mark)
                hovering.report(step, role, most, self.problems)
                return

    def check_escalation(self, step: Ask) -> None:
        """Report W064 for who is asked next before the first could answer, or never."""
        after, bound = step.escalate_after, step.timeout
        if after is None or not after.is_const or not isinstance(after.const, int | float) or after.mark in self.told:
            return
        what = ""
        if after.const < self.answer_s:
            what = f"an answer usually takes {_exact(self.answer_s)}, the next one is asked after {_exact(after.const)}"
        elif bound is not None and bound.is_const and after.const >= bound.const:
            what = f"timeout is {_exact(bound.const)}, so that after {_exact(after.const)} nobody is asked any more"
        if what:
            self.told.add(after.mark)
            self.problems.add("W064", after.mark, what, "between the time of an answer and the timeout")

    def check_charge(self, role: Role, spent: Sum) -> None:
        """Report W064 for a role of which no type has the charge for the path, whatever agent it gets."""
        powers = self.powers.get(role.name, {})
        least = role.battery_min
        if not powers or (least is not None and not least.is_const):
            return
        charge = float(least.const) if least is not None else 100.0
        found = []
        for name, power in powers.items():
            seconds, points = spent.air.get((role.name, name), (0.0, 0.0))
            has = charge - self.reserve(name)
            if points <= max(has, 0.0):
                return
            found.append((seconds, max(0.0, has) / power.cruise_pct_s, points + self.reserve(name)))
        seconds, gives, needs = min(found)
        told = f"battery_min {charge:g} %" if least is not None else "a full battery"
        what = f"path of about {_about(seconds)}, {told} gives about {_about(gives)} over the reserve"
        mark = least.mark if least is not None else role.mark
        help_ = (
            f"battery_min: {math.ceil(needs)} %" if needs <= 100 else "shorten the path, or share it between machines"
        )
        self.problems.add("W064", mark, what, help_)

    def reserve(self, type_name: str) -> float:
        """Return the charge that must be left, percent."""
        key = key_of("reserve")
        limits = self.catalogue.types[type_name].limits
        site = self.site.envelope if self.site is not None else {}
        return max(limits.get(key, 0.0), site.get(key, 0.0), self.task.envelope.get(key, 0.0))


Where = dict[str, Position | None]
"""Roles in the air, and where they hover if that is known."""


def _forget(at: Where, other: Where) -> None:
    """Keep what is the same on both paths: who is in the air on both, and where, if it is one point."""
    for role in list(at):
        if role not in other:
            del at[role]
        elif other[role] != at[role]:
            at[role] = None


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


def _area_m2(region: Region) -> float:
    corners = region.corners
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    return abs(sum(a.east_m * b.north_m - b.east_m * a.north_m for a, b in pairs)) / 2


def _bound_s(bound: Expr | None) -> float | None:
    const = bound.const if bound is not None and bound.is_const else None
    return float(const) if isinstance(const, int | float) else None


def _about(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _exact(seconds: float) -> str:
    return format_quantity("duration", float(seconds))
