"""Who is in the air where: abstract interpretation of a task's steps over what they may leave each machine in.

Per role the state is a set of {grounded, airborne, unknown}, each with the reason why it is possible here. Both the paths
on which a step succeeds and those on which it fails are followed, through calls too. Reports E030 (an action's precondition
fails on some path), E031 (the task can end in the air) and W032 (a failure leaves a machine in the air that has no way home).

A role with `away: true` may be either at the start; other machines are grounded. A failed TakeOff or LandIn leaves the
state unknown. In cleanup sections, in subtrees read for themselves, and in later attempts of a retry, unknown is fine and
only a sure contradiction is reported.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Final, Literal

from formiga_bt.diagnostics import Mark
from formiga_bt.lang.model import (
    ActionSpec,
    Ask,
    Call,
    Catalogue,
    Check,
    Do,
    Expr,
    Fail,
    Fallback,
    If,
    Role,
    Sequence,
    Step,
    Subtree,
    Task,
)
from formiga_bt.lang.reading import Problems
from formiga_bt.lang.types import ANY

Air = Literal["grounded", "airborne", "unknown"]


@dataclass(frozen=True, slots=True)
class Why:
    """How a state came about: the path in words, the step that led to it, and the step that failed, if one did."""

    path: str
    mark: Mark
    failed: Mark | None = None


States = Mapping[Air, Why]
Sky = Mapping[str, States]
"""By role. None in place of a sky = no path leads here."""


@dataclass(frozen=True, slots=True)
class Ends:
    """What a step leaves behind when it succeeds, fails, or is skipped."""

    success: Sky | None
    failure: Sky | None
    skipped: Sky | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """Where the interpreter is: how to report, and what local names are called outside."""

    file: str
    silent: bool = False
    lenient: bool = False
    """Unknown is fine; only sure contradictions are reported."""
    call: Mark | None = None
    """The outermost call that led here."""
    called: str = ""
    outer: Mapping[str, str] | None = None


def check_flight(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report E030, E031 and W032 for a task and for the subtrees that it sees."""
    _Flight(task, catalogue, problems).check()


class _Flight:
    def __init__(self, task: Task, catalogue: Catalogue, problems: Problems) -> None:
        self.task = task
        self.actions = catalogue.actions
        self.types = catalogue.types
        self.problems = problems
        self.broken: set[tuple[str, int]] = set()
        self.reported: set[str] = set()
        """Roles with an E030: what follows from it is not reported."""
        self.file = task.mark.file

    def check(self) -> None:
        """Interpret the subtrees, the steps and the cleanup sections."""
        for subtree in self.task.subtrees.values():
            self._check_subtree(subtree)
        flying = [role for role in self.task.roles.values() if self._flies(role)]
        sky: Sky = {role.name: _start(role) for role in flying}
        here = Place(self.file)
        with self.problems.within("steps"):
            ends = self._steps(self.task.steps, sky, here)
        for name, steps in (("on_failure", self.task.on_failure), ("on_abort", self.task.on_abort)):
            self._check_cleanup(name, steps, flying)
        self._check_cleanup("finally", self.task.finally_, flying)
        self._check_end(ends, flying, here)

    def _flies(self, role: Role) -> bool:
        known = [self.types[name] for name in role.types if name in self.types]
        offered = {action for one in known for action in one.actions}
        return role.count is None and any(self.actions[a].effect == "airborne" for a in offered if a in self.actions)

    def _check_subtree(self, subtree: Subtree) -> None:
        unknown: Sky = {
            param.name: {"unknown": Why("", param.mark)}
            for param in subtree.params.values()
            if param.type.name == "agent"
        }
        before = len(self.problems.found)
        with self.problems.outermost(subtree.name, "steps"):
            self._steps(subtree.steps, unknown, Place(subtree.mark.file, lenient=True))
        if len(self.problems.found) > before:
            self.broken.add((subtree.mark.file, subtree.mark.line))

    def _check_cleanup(self, name: str, steps: tuple[Step, ...], flying: list[Role]) -> None:
        unknown: Sky = {role.name: {"unknown": Why("", role.mark)} for role in flying}
        with self.problems.within(name):
            self._steps(steps, unknown, Place(self.file, lenient=True))

    def _check_end(self, ends: Ends, flying: list[Role], here: Place) -> None:
        final = ends.success
        if final is not None:
            after = self._steps(self.task.finally_, final, replace(here, silent=True))
            final = after.success if after.success is not None else after.failure
        for role in flying:
            states = final[role.name] if final is not None else {}
            why = states.get("airborne") or states.get("unknown")
            if why is not None and role.name not in self.reported:
                path = f" ({why.path})" if why.path else ""
                what = f"'{role.name}' can still be airborne when the task ends{path}"
                help_ = f"land it, or bring it home: call: ReturnHome with drone: ${{{role.name}}}"
                self.problems.add("E031", why.mark, what, help_)
            self._check_recover(role, ends.failure)

    def _check_recover(self, role: Role, failure: Sky | None) -> None:
        stranded = [name for name in role.types if name in self.types and self.types[name].recover is None]
        states = failure[role.name] if failure is not None else {}
        why = states.get("airborne") or states.get("unknown")
        if stranded and why is not None:
            mark = why.failed or why.mark
            what = f"a failure at line {mark.line} leaves '{role.name}' airborne: type {stranded[0]} has no recover"
            self.problems.add("W032", mark, what, "give the type a recover subtree in the catalogue")

    # --- steps -------------------------------------------------------------------------------------------------

    def _steps(self, steps: tuple[Step, ...], sky: Sky, here: Place) -> Ends:
        """Interpret steps one after another."""
        at: Sky | None = sky
        failure: Sky | None = None
        idle: Sky | None = sky if steps else None
        for step in steps:
            if idle is not None:
                idle = narrow(idle, step.when, False) if step.when is not None else None
            if at is None:
                break
            ends = self._step(step, at, here)
            failure = join(failure, ends.failure)
            at = join(ends.success, ends.skipped, only_right=f"when {_line(step.mark, here)} was skipped")
        return Ends(at, failure, idle)

    def _step(self, step: Step, sky: Sky, here: Place) -> Ends:
        """Interpret one step with its modifiers."""
        run: Sky | None = sky
        skipped: Sky | None = None
        if step.when is not None:
            run, skipped = narrow(sky, step.when, True), narrow(sky, step.when, False)
        if run is None:
            return Ends(None, None, skipped)
        with self.problems.within(step.title):
            ends = self._attempts(step, run, here)
        success, failure = ends.success, ends.failure
        if step.timeout is not None and isinstance(step, Sequence | Fallback | If | Call):
            failure = join(failure, _failing(join(success, run), step.mark, here))
        if step.ignore_failure:
            success, failure = join(success, failure), None
        return Ends(success, failure, join(ends.skipped, skipped))

    def _attempts(self, step: Step, sky: Sky, here: Place) -> Ends:
        first = self._kind(step, sky, here)
        if step.retry is None or first.failure is None:
            return first
        again = self._kind(step, first.failure, replace(here, lenient=True))
        return Ends(join(first.success, again.success), join(first.failure, again.failure), first.skipped)

    def _kind(self, step: Step, sky: Sky, here: Place) -> Ends:
        match step:
            case Do():
                return self._do(step, sky, here)
            case Call():
                return self._call(step, sky, here)
            case Sequence():
                return self._steps(step.steps, sky, here)
            case Fallback():
                return self._fallback(step, sky, here)
            case If():
                return self._if(step, sky, here)
            case Check():
                return Ends(narrow(sky, step.cond, True), _failing(narrow(sky, step.cond, False), step.mark, here))
            case Fail():
                return Ends(None, _failing(sky, step.mark, here))
            case Ask():
                return Ends(sky, _failing(sky, step.mark, here))
            case _:
                return Ends(sky, None)

    def _fallback(self, step: Fallback, sky: Sky, here: Place) -> Ends:
        success: Sky | None = None
        at: Sky | None = sky
        for child in step.steps:
            if at is None:
                break
            ends = self._step(child, at, here)
            success = join(success, ends.success)
            at = join(ends.failure, ends.skipped)
        return Ends(success, at)

    def _if(self, step: If, sky: Sky, here: Place) -> Ends:
        yes, no = narrow(sky, step.cond, True), narrow(sky, step.cond, False)
        dead = Ends(None, None)
        then = self._steps(step.then, yes, here) if yes is not None else dead
        other = self._steps(step.otherwise, no, here) if no is not None else dead
        line = _line(step.mark, here)
        after_then, after_else = join(then.success, then.skipped), join(other.success, other.skipped)
        success = join(after_then, after_else, f"when {line} was true", f"when {line} was false")
        return Ends(success, join(then.failure, other.failure))

    def _call(self, step: Call, sky: Sky, here: Place) -> Ends:
        subtree = step.subtree
        bound: dict[str, str] = {}
        for name, arg in step.args.items():
            role = plain_name(arg)
            if role in sky and subtree.params[name].type.name == "agent":
                bound[name] = role
        outer = here.outer or {}
        inside = Place(
            here.file,
            silent=here.silent or (subtree.mark.file, subtree.mark.line) in self.broken,
            lenient=here.lenient,
            call=here.call or step.mark,
            called=here.called or subtree.name,
            outer={name: outer.get(role, role) for name, role in bound.items()},
        )
        ends = self._steps(subtree.steps, {name: sky[role] for name, role in bound.items()}, inside)
        return Ends(*(_back(sky, end, bound) for end in (ends.success, ends.failure, ends.skipped)))

    # --- do ----------------------------------------------------------------------------------------------------

    def _do(self, step: Do, sky: Sky, here: Place) -> Ends:
        """Check the action's precondition and apply its effect."""
        spec = self.actions.get(step.action)
        role = step.who.name
        if role not in sky or spec is None:
            return Ends(sky, _failing(sky, step.mark, here))
        states = sky[role]
        self._check_requires(step, spec, states, here)
        mark = here.call or step.mark
        failed = f"when {_line(step.mark, here)} failed"
        after: States
        if spec.effect:
            after = {spec.effect: Why("", mark)}
            broken: States = {"unknown": Why(failed, mark, mark)}
        else:
            fit = {state: why for state, why in states.items() if not spec.requires or state == spec.requires}
            after = {state: replace(why, mark=mark) for state, why in fit.items()}
            if spec.requires and not after:
                after = {spec.requires: Why("", mark)}
            broken = {state: Why(failed, mark, mark) for state in states}
        failing = _failing(sky, step.mark, here)
        return Ends({**sky, role: after}, {**(failing or {}), role: broken})

    def _check_requires(self, step: Do, spec: ActionSpec, states: States, here: Place) -> None:
        """Report E030 once for the first state in which the action cannot start."""
        want = spec.requires
        if not want or here.silent:
            return
        other: Air = "grounded" if want == "airborne" else "airborne"
        why, is_ = states.get(other), f"it is {other}"
        if why is None and not here.lenient:
            why, is_ = states.get("unknown"), f"it may be {other}"
        if why is None:
            return
        role = (here.outer or {}).get(step.who.name, step.who.name)
        path = f" {why.path}" if why.path else ""
        action = spec.name if here.call is None else f"{here.called}, which begins with {spec.name},"
        if here.call is not None and step.seg != "steps[0]":
            action = f"{spec.name} in {here.called} ({_line(step.mark, here)})"
        what = f"{action} needs '{role}' {want}, but {is_} here{path}"
        hint = f"do: {role}.TakeOff first" if want == "airborne" else f"land it first, or add when: not {role}.airborne"
        if "unknown" in states and other not in states:
            hint = f"add when: {'' if want == 'airborne' else 'not '}{role}.airborne"
        self.reported.add(role)
        self.problems.add("E030", here.call or step.mark, what, hint)


def _start(role: Role) -> States:
    if not role.away:
        return {"grounded": Why("", role.mark)}
    why = Why(f"as role '{role.name}' says away: true", role.mark)
    return {"grounded": why, "airborne": why}


def _line(mark: Mark, here: Place) -> str:
    return f"line {mark.line}" if mark.file == here.file else f"line {mark.line} of {PurePath(mark.file).name}"


def _failing(sky: Sky | None, mark: Mark, here: Place) -> Sky | None:
    """Return the sky after a step failed, with that as the reason of every state."""
    if sky is None:
        return None
    path = f"when {_line(mark, here)} failed"
    return {
        role: {state: Why(path, why.mark, here.call or mark) for state, why in states.items()}
        for role, states in sky.items()
    }


def _back(sky: Sky, end: Sky | None, bound: Mapping[str, str]) -> Sky | None:
    return None if end is None else {**sky, **{role: end[name] for name, role in bound.items()}}


def join(left: Sky | None, right: Sky | None, only_left: str = "", only_right: str = "") -> Sky | None:
    """Return the states of either path; `only_left` and `only_right` name the path of a state that only one side has."""
    if left is None or right is None:
        return left if right is None else right
    joined: dict[str, States] = {}
    for role in left:
        merged: dict[Air, Why] = {}
        for state, why in left[role].items():
            merged[state] = replace(why, path=only_left) if only_left and state not in right[role] else why
        for state, why in right[role].items():
            if state not in merged:
                merged[state] = replace(why, path=only_right) if only_right else why
        joined[role] = merged
    return joined


# --- conditions --------------------------------------------------------------------------------------------------

_AIRBORNE: Final = re.compile(r"(?:(not)\s+)?\(?\s*([A-Za-z]\w*)\.airborne\s*\)?")


def narrow(sky: Sky, cond: Expr, holds: bool) -> Sky | None:
    """Return the sky where a condition holds (or does not); None if it never does.

    Understood: `x.airborne`, `not x.airborne`, joined by `and` (when it holds) or by `or` (when it does not).
    """
    if cond.type == ANY:  # refused already: taken to hold, so that nothing else complains
        return sky if holds else None
    if cond.is_const:
        return sky if bool(cond.const) == holds else None
    narrowed = dict(sky)
    for role, airborne in _facts(cond.source, holds):
        if role not in narrowed:
            continue
        want: Air = "airborne" if airborne else "grounded"
        states = {state: why for state, why in narrowed[role].items() if state == want}
        unknown = narrowed[role].get("unknown")
        if not states and unknown is not None:
            states = {want: replace(unknown, path="")}
        if not states:
            return None
        narrowed[role] = states
    return narrowed


def _facts(source: str, holds: bool) -> list[tuple[str, bool]]:
    """Return (role, airborne) for each part of a condition that must hold, or must fail, for the whole to do so."""
    joint = "and" if holds else "or"
    parts = re.split(rf"\b{joint}\b", source)
    other = "or" if holds else "and"
    if re.search(rf"\b({other}|if|else)\b", source):
        return []
    found = []
    for part in parts:
        match = _AIRBORNE.fullmatch(part.strip())
        if match is not None:
            found.append((match[2], (match[1] is None) == holds))
    return found


def plain_name(expr: Expr) -> str:
    """Return the name that an expression is, when it is nothing but a name; else ""."""
    name = expr.reads[0].name if len(expr.reads) == 1 and not expr.reads[0].field else ""
    return name if expr.source.strip().removeprefix("${").removesuffix("}").strip() == name else ""
