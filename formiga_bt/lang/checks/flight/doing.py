"""What single steps do to the machines of a sky: actions and releases; and what is told of machines left in the air.

E030, E031, E033 and W032. `flying` builds on this, and moves a sky through steps made of steps.
"""

from collections.abc import Collection, Mapping

from msgspec.structs import replace

from formiga_bt.base.diagnostics import LeftAirborne, Mark
from formiga_bt.lang.checks.agreeing import Assumed, Splits
from formiga_bt.lang.checks.flight.flight_states import (
    Air,
    InterpreterPlace,
    Outcomes,
    Sky,
    States,
    Why,
    failing,
    keys_of,
    line_of,
    merge,
)
from formiga_bt.lang.model import (
    ActionSpec,
    Catalogue,
    Do,
    Release,
    Role,
)
from formiga_bt.lang.naming import action_that, takes_off
from formiga_bt.lang.text.reading import Problems


class Doing:
    """Follows single steps; reports E030 and E033.

    Args:
        catalogue: what the actions require and do.
        problems: where to report.
        roles: agent types by role.
    """

    def __init__(self, catalogue: Catalogue, problems: Problems, roles: Mapping[str, tuple[str, ...]]) -> None:
        self.catalogue = catalogue
        self.actions = catalogue.actions
        self.types = catalogue.types
        self.problems = problems
        self.roles = roles
        self.broken: set[tuple[str, int]] = set()
        """Subtrees with problems of their own: their callers are not told again."""
        self.seen: Collection[str] = ()
        """Subtrees that the task sees: what a help tells."""
        self.told: set[Mark] = set()
        """Roles of blocks of which the end was reported."""
        self.reported: set[str] = set()
        """Roles with an E030: what follows from it is not reported."""
        self.contended: frozenset[str] = frozenset()
        """Roles of which nothing is known, so that nothing is reported."""
        self.assumed: Assumed = {}
        """How conditions of the task turn out."""
        self.splits: Splits = {}
        """Where conditions that agree are told apart."""
        self.filled: frozenset[str] = frozenset()
        """Lists of the task that surely have an item."""
        self.owners: dict[str, set[str]] = {}
        """Loop names -> the roles whose list they go over."""
        self.breaks: list[Sky | None] = []
        """For each loop around: where its `break_if`s leave it."""
        self.doubled: set[Mark] = set()
        """Calls that pass one machine twice, of which that was told."""
        self.again: set[str] = set()
        """Loop names whose list has a machine twice, so that the next round may begin as the last one ended."""
        self.rounds: dict[tuple[object, ...], tuple[Sky | None, Outcomes]] = {}
        self.calls: dict[tuple[object, ...], Outcomes] = {}
        """What was followed before, by place and states: how it ended."""

    def flies(self, role: Role) -> bool:
        """Return whether machines of a role may leave the ground."""
        known = [self.types[name] for name in role.types if name in self.types]
        offered = {action for one in known for action in one.actions}
        return any(self.actions[a].effect == "airborne" for a in offered if a in self.actions)

    def check_brought_home(self, role: Role, final: Sky | None, when: str) -> None:
        """Report E031 if a machine of a role may still be in the air at the end of what it was granted for."""
        states = merge(final[key] for key in keys_of(role)) if final is not None else {}
        why = states.get("airborne") or states.get("unknown")
        if why is None or role.name in self.reported:
            return
        path = f" ({why.path})" if why.path else ""
        what = f"'{role.name}' can still be airborne {when}{path}"
        self.problems.add("E031", why.mark, what, self._how_home(role), about=LeftAirborne(role.name))

    def _how_home(self, role: Role) -> str:
        """Return how a task brings machines of a role home: by what the first type with a way home calls its own."""
        kind = next((self.types[one] for one in role.types if one in self.types and self.types[one].recover), None)
        if kind is None or kind.recover is None:
            return "land it"
        file, _, _ = kind.recover_ref.partition("#")
        how = "bring it home:" if kind.recover.name in self.seen else f"import {file} and"
        param = next(iter(kind.recover.params))
        each = role.name if not role.is_list else f"{param}}} for each {param} of ${{{role.name}"
        return f"land it, or {how} call: {kind.recover.name} with {param}: ${{{each}}}"

    def check_recover(self, role: Role, failure: Sky | None) -> None:
        """Report W032 if a failure may leave a machine of a role in the air whose type has no way home."""
        stranded = [name for name in role.types if name in self.types and self.types[name].recover is None]
        states = merge(failure[key] for key in keys_of(role)) if failure is not None else {}
        why = states.get("airborne") or states.get("unknown")
        if stranded and why is not None:
            mark = why.failed or why.mark
            what = f"a failure at {mark.said} leaves '{role.name}' airborne: type {stranded[0]} has no recover"
            self.problems.add("W032", mark, what, "give the type a recover subtree in the catalogue")

    def _release(self, step: Release, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Check that what may be in the air can be brought home; afterwards the machine is none of the task's."""
        name = step.who.name
        if name not in sky:
            return Outcomes(sky, None)
        states = sky[name]
        why = states.get("airborne") or (states.get("unknown") if not here.lenient else None)
        stranded = [one for one in self._types_of(name, here) if one in self.types and self.types[one].recover is None]
        if why is not None and stranded and not here.silent:
            path = f" {why.path}" if why.path else ""
            shown = (here.outer or {}).get(name, name)
            what = f"'{shown}' is released in the air{path}: type {stranded[0]} has no recover"
            self.problems.add("E033", here.call or step.mark, what, "land it first")
            self.reported |= {shown, *self.owners.get(shown, ())}
        gone: States = {"grounded": Why("", step.mark)}
        return Outcomes({**sky, name: gone}, None)

    def _types_of(self, name: str, here: InterpreterPlace) -> tuple[str, ...]:
        shown = (here.outer or {}).get(name, name)
        roles = [shown.partition("[")[0], *self.owners.get(shown, ())]
        return tuple(of for role in roles for of in self.roles.get(role, ()))

    def _do(self, step: Do, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Check the action's precondition and apply its effect."""
        spec = self.actions.get(step.action)
        role = step.who.name
        if role not in sky or spec is None:
            return Outcomes(sky, failing(sky, step.mark, here))
        states = sky[role]
        self._check_requires(step, spec, states, here)
        mark = here.call or step.mark
        failed = f"when {line_of(step.mark, here)} failed"
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
        return Outcomes({**sky, role: after}, {**(failing(sky, step.mark, here) or {}), role: broken})

    def _check_requires(self, step: Do, spec: ActionSpec, states: States, here: InterpreterPlace) -> None:
        """Report E030 once for the first state in which the action cannot start."""
        want = spec.requires
        role = (here.outer or {}).get(step.who.name, step.who.name)
        if not want or here.silent or self.contended & {role.partition("[")[0], *self.owners.get(role, ())}:
            return
        other: Air = "grounded" if want == "airborne" else "airborne"
        why, is_ = states.get(other), f"it is {other}"
        if why is None and not here.lenient:
            why, is_ = states.get("unknown"), f"it may be {other}"
        if why is None or (here.sure and states.keys() != {other}):
            return
        if here.both and here.call in self.doubled:
            return
        if here.both and here.call is not None:  # one mistake: what follows from it is not told
            self.doubled.add(here.call)
        path = f" {why.path}" if why.path and not here.sure else ""
        path += f": {here.both}" if here.both else ""
        path += " when the steps succeeded" if here.sure else ""
        action = spec.name if here.call is None else f"{here.called}, which begins with {spec.name},"
        if here.call is not None and step.mark != here.first:
            action = f"{spec.name} in {here.called} ({line_of(step.mark, here)})"
        what = f"{action} needs '{role}' {want}, but {is_} here{path}"
        up = action_that(takes_off, self._types_of(step.who.name, here), self.catalogue) or "AN_ACTION"
        hint = f"do: {role}.{up} first" if want == "airborne" else f"land it first, or add when: not {role}.airborne"
        if "unknown" in states and other not in states:
            hint = f"add when: {'' if want == 'airborne' else 'not '}{role}.airborne"
        self.reported |= {role.partition("[")[0], *self.owners.get(role, ())}
        self.problems.add("E030", here.call or step.mark, what, hint)
