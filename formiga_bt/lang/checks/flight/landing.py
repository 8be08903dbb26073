"""W075: a machine lands somewhere else than where it was last sent.

Follows the places that a task names, in the order of its steps and through calls. Only what is surely so is reported: after
a branch, a retry or a step that may be skipped, and for places that are computed, nothing is known.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import (
    ActionSpec,
    Call,
    Catalogue,
    Do,
    Expr,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Parallel,
    Role,
    Sequence,
    Step,
    Switch,
    Task,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import begins_anew, commands, plain_name

_ABOVE: Final = re.compile(r"(?:above|at_height|ground)\(\s*([^,()]+|(?:above|at_height|ground)\(.*\))\s*(?:,.*)?\)")
_NAME: Final = re.compile(r"([A-Za-z_]\w*)((?:\.[A-Za-z_]\w*)*)")

Where = tuple[str, str]
"""A place as the outermost task names it, and the line that sent the machine there."""


def check_landings(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report W075 for the steps of a task, those of called subtrees included."""
    start = {} if problems.has_errors() else at_home(task.roles.values())  # an error may be why it never left its port
    _Landings(catalogue, problems).follow(task.steps, start, {}, None)


def at_home(roles: Iterable[Role]) -> dict[str, Where]:
    """Return where machines are when they are granted: at their port, unless they may be away or are several."""
    return {role.name: (f"{role.name}.home", "") for role in roles if not role.away and not role.is_list}


class _Landings:
    def __init__(self, catalogue: Catalogue, problems: Problems) -> None:
        self.actions = catalogue.actions
        self.problems = problems

    def follow(
        self, steps: tuple[Step, ...], last: dict[str, Where], names: Mapping[str, str], call: Mark | None
    ) -> None:
        """Follow steps that run one after another; `last` is changed, `names` says what params stand for."""
        for step in steps:
            sure = step.when is None and not begins_anew(step) and not step.ignore_failure
            inner = last if sure else dict(last)
            match step:
                case Do():
                    self._do(step, inner, names, call)
                case Call():
                    self._call(step, inner, names, call)
                case Sequence():
                    self.follow(step.steps, inner, names, call)
                    self.follow(step.finally_, dict(inner), names, call)
                case Guard() | WithResource():
                    self.follow(step.steps, inner, names, call)
                case WithAgents():
                    inner.update(at_home(step.roles.values()))
                    self.follow(step.steps, inner, names, call)
                    for role in step.roles:
                        inner.pop(role, None)
                case Loop() | For():
                    self._rounds(step, inner, names, call)
                case If():
                    self._branches((step.then, step.otherwise), inner, names, call)
                case Switch():
                    self._branches(step.branches, inner, names, call)
                case Parallel():
                    self._parallel(step, inner, names, call)
                case Fallback():
                    self._branches(tuple((child,) for child in step.steps), inner, names, call)
                case _:
                    pass
            if not sure:
                _forget(last, inner)

    def _branches(
        self,
        branches: tuple[tuple[Step, ...], ...],
        last: dict[str, Where],
        names: Mapping[str, str],
        call: Mark | None,
    ) -> None:
        before = dict(last)
        for branch in branches:
            after = dict(before)
            self.follow(branch, after, names, call)
            _forget(last, after)

    def _parallel(self, step: Parallel, last: dict[str, Where], names: Mapping[str, str], call: Mark | None) -> None:
        """Follow each branch by itself; what it sent somewhere is there if all branches are needed."""
        before = dict(last)
        for child in step.steps:
            after = dict(before)
            self.follow((child,), after, names, call)
            if step.need == "all":
                last.update({role: where for role, where in after.items() if before.get(role) != where})
            else:
                _forget(last, after)

    def _rounds(self, step: Loop | For, last: dict[str, Where], names: Mapping[str, str], call: Mark | None) -> None:
        """Follow a round that may come after another one: where that sent the machines is not known."""
        for agents, _ in commands(step, {}):
            last.update(dict.fromkeys((names.get(agent, agent) for agent in agents), ("", "")))
        if isinstance(step, For):
            for name in step.lists:
                last.pop(name, None)
        after = dict(last)
        self.follow(step.steps, after, names, call)
        _forget(last, after)

    def _call(self, step: Call, last: dict[str, Where], names: Mapping[str, str], call: Mark | None) -> None:
        inner: dict[str, str] = {}
        for name, arg in step.args.items():
            place = named(arg, names)
            inner[name] = names.get(plain_name(arg), plain_name(arg)) or place or ""
        self.follow(step.subtree.steps, last, inner, call or step.mark)

    def _do(self, step: Do, last: dict[str, Where], names: Mapping[str, str], call: Mark | None) -> None:
        spec: ActionSpec | None = self.actions.get(step.action)
        role = names.get(step.who.name, step.who.name)
        if spec is None or not spec.moves_to or spec.moves_to not in step.fields:
            if spec is None or not spec.effect:
                last[role] = ("", "")
            return
        place = named(step.fields[spec.moves_to], names)
        mark = call or step.mark
        if place == f"{role}.position":
            return
        before = last.get(role)
        if spec.lands and before is not None and place and before[0] and place != before[0]:
            where = step.fields[spec.moves_to].mark if call is None else mark
            what = f"lands at '{place}' but last flew to '{before[0]}' ({before[1]})"
            if not before[1]:
                what = f"lands at '{place}', but '{role}' was not sent there: it is over its port"
            self.problems.add("W075", where, what, f"fly above {place} first")
        last[role] = (place, mark.said)


def _forget(last: dict[str, Where], after: Mapping[str, Where]) -> None:
    """Drop what is not the same on both paths."""
    for role in list(after):
        if last.get(role) != after[role]:
            last[role] = ("", "")


def named(expr: Expr, names: Mapping[str, str]) -> str:
    """Return the place that an expression names, without its height, in the caller's words; "" if it is computed."""
    if expr.is_const:
        return _shown(expr.const)
    source = expr.source
    while (match := _ABOVE.fullmatch(source)) is not None:
        source = match[1].strip()
    found = _NAME.fullmatch(source)
    if found is None:
        return ""
    outer = names.get(found[1], found[1])
    return outer + found[2] if outer else ""


def _shown(value: Any) -> str:
    east, north = getattr(value, "east_m", None), getattr(value, "north_m", None)
    return f"{east:g} m east, {north:g} m north" if east is not None and north is not None else ""
