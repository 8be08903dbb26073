"""The interpreter behind `flight`: moves a sky of possible states through steps of every kind.

If = union; loop = until nothing new comes back to the start of a round; parallel = each branch by itself; call = the body with
the caller's machines. The items of a list that a `for` goes over are followed as one, then taken apart again.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from formiga_bt.diagnostics import Mark
from formiga_bt.lang.checks.agreeing import Assumed
from formiga_bt.lang.checks.machines import Bound, back, commanded, is_filled, machines_of
from formiga_bt.lang.checks.sky import (
    Air,
    Ends,
    Place,
    Sky,
    States,
    Why,
    failing,
    join,
    keys_of,
    line_of,
    merge,
    narrow,
    same,
    signature,
    start,
)
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
    Parallel,
    Release,
    Request,
    Role,
    Sequence,
    Step,
    Switch,
    WaitFor,
    WaitUntil,
    WithAgents,
)
from formiga_bt.lang.reading import Problems
from formiga_bt.lang.types import agent_type

_MADE_OF_STEPS: Final = (Sequence, Fallback, If, Switch, Call, Parallel, Loop, For, Guard, WithAgents)


class Interpreter:
    """Follows steps; reports E030 and E033.

    Args:
        catalogue: what the actions require and do.
        problems: where to report.
        roles: agent types by role.
    """

    def __init__(self, catalogue: Catalogue, problems: Problems, roles: Mapping[str, tuple[str, ...]]) -> None:
        self.actions = catalogue.actions
        self.types = catalogue.types
        self.problems = problems
        self.roles = roles
        self.broken: set[tuple[str, int]] = set()
        """Subtrees with problems of their own: their callers are not told again."""
        self.has_return_home = False
        """The task sees a subtree ReturnHome: what a help tells."""
        self.told: set[Mark] = set()
        """Roles of blocks of which the end was reported."""
        self.reported: set[str] = set()
        """Roles with an E030: what follows from it is not reported."""
        self.contended: frozenset[str] = frozenset()
        """Roles of which nothing is known, so that nothing is reported."""
        self.assumed: Assumed = {}
        """How conditions of the task turn out."""
        self.owners: dict[str, set[str]] = {}
        """Loop names -> the roles whose list they go over."""
        self.breaks: list[Sky | None] = []
        """For each loop around: where its `break_if`s leave it."""
        self.rounds: dict[tuple[object, ...], tuple[Sky | None, Ends]] = {}
        self.calls: dict[tuple[object, ...], Ends] = {}
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
        each = f"{role.name}" if not role.is_list else "drone} for each drone of ${" + role.name
        how = "bring it home:" if self.has_return_home else "import lib/flying.yaml and"
        self.problems.add("E031", why.mark, what, f"land it, or {how} call: ReturnHome with drone: ${{{each}}}")

    def check_recover(self, role: Role, failure: Sky | None) -> None:
        """Report W032 if a failure may leave a machine of a role in the air whose type has no way home."""
        stranded = [name for name in role.types if name in self.types and self.types[name].recover is None]
        states = merge(failure[key] for key in keys_of(role)) if failure is not None else {}
        why = states.get("airborne") or states.get("unknown")
        if stranded and why is not None:
            mark = why.failed or why.mark
            what = f"a failure at line {mark.line} leaves '{role.name}' airborne: type {stranded[0]} has no recover"
            self.problems.add("W032", mark, what, "give the type a recover subtree in the catalogue")

    def _narrow(self, sky: Sky, cond: Expr, holds: bool) -> Sky | None:
        """Return the sky where a condition of `when` or `if` holds (or does not), which may be assumed."""
        if id(cond) in self.assumed and self.assumed[id(cond)] != holds:
            return None
        return narrow(sky, cond, holds)

    def _steps(self, steps: tuple[Step, ...], sky: Sky, here: Place) -> Ends:
        """Interpret steps one after another."""
        at: Sky | None = sky
        failure: Sky | None = None
        idle: Sky | None = sky if steps else None
        for step in steps:
            if idle is not None:
                idle = self._narrow(idle, step.when, False) if step.when is not None else None
            if at is None:
                break
            ends = self._step(step, at, here)
            failure = join(failure, ends.failure)
            at = join(ends.success, ends.skipped, only_right=f"when {line_of(step.mark, here)} was skipped")
        return Ends(at, failure, idle)

    def _step(self, step: Step, sky: Sky, here: Place) -> Ends:
        """Interpret one step with its modifiers."""
        run: Sky | None = sky
        skipped: Sky | None = None
        if step.when is not None:
            run, skipped = self._narrow(sky, step.when, True), self._narrow(sky, step.when, False)
        if run is None:
            return Ends(None, None, skipped)
        with self.problems.within(step.title):
            ends = self._attempts(step, run, here)
        success, failure = ends.success, ends.failure
        if step.timeout is not None and isinstance(step, _MADE_OF_STEPS):
            failure = join(failure, failing(join(join(success, run), ends.midway), step.mark, here))
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
                return self._sequence(step, sky, here)
            case Fallback():
                return self._fallback(step, sky, here)
            case If():
                return self._if(step, sky, here)
            case Switch():
                return self._switch(step, sky, here)
            case Check():
                return Ends(narrow(sky, step.cond, True), failing(narrow(sky, step.cond, False), step.mark, here))
            case Fail():
                return Ends(None, failing(sky, step.mark, here))
            case Ask() | WaitFor() | Request():
                return Ends(sky, failing(sky, step.mark, here))
            case WaitUntil():
                return Ends(narrow(sky, step.cond, True) or sky, failing(sky, step.mark, here))
            case Parallel():
                return self._parallel(step, sky, here)
            case Loop():
                return self._loop(step, sky, here)
            case For():
                return self._for(step, sky, here)
            case BreakIf():
                return self._break_if(step, sky)
            case Guard():
                return self._guard(step, sky, here)
            case Release():
                return self._release(step, sky, here)
            case WithAgents():
                return self._with_agents(step, sky, here)
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
            if step.reactive:
                success = join(success, join(at, ends.failure))
            at = join(ends.failure, ends.skipped)
        return Ends(success, at)

    def _if(self, step: If, sky: Sky, here: Place) -> Ends:
        yes, no = self._narrow(sky, step.cond, True), self._narrow(sky, step.cond, False)
        dead = Ends(None, None)
        then = self._steps(step.then, yes, here) if yes is not None else dead
        other = self._steps(step.otherwise, no, here) if no is not None else dead
        line = line_of(step.mark, here)
        after_then, after_else = join(then.success, then.skipped), join(other.success, other.skipped)
        success = join(after_then, after_else, f"when {line} was true", f"when {line} was false")
        return Ends(success, join(then.failure, other.failure))

    def _switch(self, step: Switch, sky: Sky, here: Place) -> Ends:
        success: Sky | None = None
        failure: Sky | None = None
        first = ""
        for index, branch in enumerate(step.branches):
            value = f"'{step.cases[index].value}'" if index < len(step.cases) else "none of its cases"
            path = f"when the switch at {line_of(step.mark, here)} was {value}"
            ends = self._steps(branch, sky, here)
            success = join(success, join(ends.success, ends.skipped), first if index == 1 else "", path)
            failure = join(failure, ends.failure)
            first = first or path
        return Ends(success, failure)

    def _call(self, step: Call, sky: Sky, here: Place) -> Ends:
        subtree = step.subtree
        bound: dict[str, Bound] = {}
        for name, arg in step.args.items():
            machines = machines_of(arg, sky)
            if machines.keys and agent_type(subtree.params[name].type).name == "agent":
                bound[name if subtree.params[name].type.name == "agent" else f"{name}[*]"] = machines
        outer = here.outer or {}
        inside = Place(
            here.file,
            silent=here.silent or (subtree.mark.file, subtree.mark.line) in self.broken,
            lenient=here.lenient,
            call=here.call or step.mark,
            called=here.called or subtree.name,
            outer={name: outer.get(one.name, one.name) for name, one in bound.items()},
        )
        local = {name: one.states(sky) for name, one in bound.items()}
        known = (subtree.mark, signature(local), inside)
        if known not in self.calls:
            self.calls[known] = self._steps(subtree.steps, local, inside)
        ends = self.calls[known]
        return Ends(*(back(sky, end, bound) for end in (ends.success, ends.failure, ends.skipped)))

    # --- branches ----------------------------------------------------------------------------------------------

    def _parallel(self, step: Parallel, sky: Sky, here: Place) -> Ends:
        """Interpret each branch by itself; what the others command is unknown to it."""
        mine = [commanded(branch, sky) for branch in step.steps]
        success, failure = dict(sky), dict(sky)
        sure = step.need == "all"
        dead = False
        for index, branch in enumerate(step.steps):
            others = {key for other in mine for key in other if key not in mine[index]}
            at: Sky = {key: {"unknown": Why("", branch.mark)} if key in others else s for key, s in sky.items()}
            ends = self._step(branch, at, here)
            done = join(ends.success, ends.skipped)
            dead = dead or (done is None and sure)
            for key in mine[index]:
                end, broken = (done or ends.failure or sky)[key], (ends.failure or sky)[key]
                anywhere = merge((end, broken, sky[key]))
                success[key] = end if sure else anywhere
                failure[key] = anywhere
        return Ends(None if dead else success, failing(failure, step.mark, here))

    def _guard(self, step: Guard, sky: Sky, here: Place) -> Ends:
        inside = narrow(sky, step.cond, True)
        ends = self._steps(step.steps, inside, here) if inside is not None else Ends(None, None)
        stopped = failing(join(sky, ends.success), step.mark, here)
        return Ends(ends.success, join(ends.failure, stopped), ends.skipped)

    def _sequence(self, step: Sequence, sky: Sky, here: Place) -> Ends:
        ends = self._steps(step.steps, sky, here)
        if step.reactive:
            ends = replace(ends, failure=join(ends.failure, failing(join(sky, ends.success), step.mark, here)))
        if not step.finally_:
            return ends
        tidy = replace(here, lenient=True)
        return Ends(self._tidied(step, ends.success, tidy), self._tidied(step, ends.failure, tidy), ends.skipped)

    def _tidied(self, step: Sequence, sky: Sky | None, here: Place) -> Sky | None:
        """Return what `finally` leaves; as at the end of a task, its own failure is not followed."""
        if sky is None:
            return None
        ends = self._steps(step.finally_, sky, here)
        done = join(ends.success, ends.skipped)
        return done if done is not None else ends.failure

    # --- loops -------------------------------------------------------------------------------------------------

    def _loop(self, step: Loop, sky: Sky, here: Place) -> Ends:
        """Interpret rounds until nothing new comes back to their start."""
        head, broke, ends = self._rounds(step, sky, here, step.cond)
        end = join(ends.success, ends.skipped)
        out = join(broke, narrow(end, step.until, True) if end is not None and step.until is not None else None)
        if step.cond is not None:
            out = join(out, narrow(head, step.cond, False))
        elif step.times is not None and not step.times.is_const:
            out = join(out, sky)
        if step.times is not None or step.duration is not None or step.max is not None:
            out = join(out, end)
        return Ends(out, ends.failure, None, join(head, end))

    def _rounds(self, step: Loop | For, sky: Sky, here: Place, cond: Expr | None) -> tuple[Sky, Sky | None, Ends]:
        """Return where a round may start, where the loop was left by `break_if`, and how a round ends."""
        head, quiet = sky, replace(here, silent=True)
        path = f"after a round of the loop at {line_of(step.mark, here)}"
        until = step.until if isinstance(step, Loop) else None
        while True:
            _, ends = self._round(step, head, quiet, cond)
            end = join(ends.success, ends.skipped)
            if end is not None and until is not None:
                end = narrow(end, until, False)
            onward = join(head, self._next(step, end, sky), only_right=path)
            if onward is None or same(onward, head):
                break
            head = onward
        broke, ends = self._round(step, head, here, cond)
        return head, broke, ends

    def _round(self, step: Loop | For, head: Sky, here: Place, cond: Expr | None) -> tuple[Sky | None, Ends]:
        known = (step.seg, step.mark, signature(head), here)
        if here.silent and known in self.rounds:  # loops in loops would be followed exponentially often
            return self.rounds[known]
        at = narrow(head, cond, True) if cond is not None else head
        self.breaks.append(None)
        ends = self._steps(step.steps, at, here) if at is not None else Ends(None, None)
        self.rounds[known] = self.breaks.pop(), ends
        return self.rounds[known]

    def _next(self, step: Loop | For, end: Sky | None, sky: Sky) -> Sky | None:
        """Return the start of the next round: the items of a `for` are fresh ones."""
        if end is None or isinstance(step, Loop):
            return end
        return {**end, **{name: sky[name] for name in step.lists if name in sky}}

    def _break_if(self, step: BreakIf, sky: Sky) -> Ends:
        if self.breaks:
            self.breaks[-1] = join(self.breaks[-1], narrow(sky, step.cond, True))
        return Ends(narrow(sky, step.cond, False), None)

    def _for(self, step: For, sky: Sky, here: Place) -> Ends:
        """Interpret the body once for all items: what it does to one it does, by the end, to each of the list."""
        bound = {name: one for name, expr in step.lists.items() if (one := machines_of(expr, sky)).keys}
        outer = {**(here.outer or {}), **dict.fromkeys(step.lists, "")}
        for name, one in bound.items():
            outer[name] = name
            self.owners[name] = {one.name.partition("[")[0], *self.owners.get(one.name, ())}
        inside = {**sky, **{name: one.states(sky) for name, one in bound.items()}}
        at = replace(here, outer={name: word for name, word in outer.items() if word})
        _, broke, ends = self._rounds(step, inside, at, None)
        end = join(ends.success, ends.skipped)
        loose = {name: replace(one, all=False) for name, one in bound.items()}
        some = any(one.all and not one.open for one in bound.values()) or is_filled(step)
        failure = back(sky, join(ends.failure, join(end, inside) if ends.failure is not None else None), loose)
        success = back(sky, end, bound if step.need == "all" else loose)
        if not some and success is not None:  # an empty list has no items to be left in another state
            items = {key: success[key] for one in bound.values() if one.all for key in one.keys}
            success = {**(join(success, sky) or {}), **items}
        success = join(success, back(sky, broke, loose))
        if step.need != "all":
            success, failure = join(success, failure), failing(join(success, failure), step.mark, here)
        return Ends(success, failure, None, back(sky, join(inside, end), loose))

    def _with_agents(self, step: WithAgents, sky: Sky, here: Place) -> Ends:
        """Interpret a block with machines of its own, which must be down at its end as those of a task at the task's."""
        flying = [r for r in step.roles.values() if self.flies(r) and not any(key in sky for key in keys_of(r))]
        own = {key: start(role) for role in flying for key in keys_of(role)}
        outer, self.roles = self.roles, {**self.roles, **{role.name: role.types for role in step.roles.values()}}
        if self.breaks:
            self.breaks.append(None)
        ends = self._steps(step.steps, {**sky, **own}, here)
        broke = self.breaks.pop() if self.breaks else None
        if not here.silent:
            done = join(join(ends.success, ends.skipped), broke)
            for role in [role for role in flying if role.mark not in self.told]:
                before = len(self.problems.found)
                self.check_brought_home(role, done, f"at the end of with_agents ({line_of(step.mark, here)})")
                self.check_recover(role, ends.failure)
                if len(self.problems.found) > before:
                    self.told.add(role.mark)
        self.roles = outer
        if self.breaks:
            self.breaks[-1] = join(self.breaks[-1], _without(broke, own))
        nobody = failing(sky, step.mark, here)
        failure = join(_without(ends.failure, own), nobody)
        return Ends(_without(ends.success, own), failure, _without(ends.skipped, own), _without(ends.midway, own))

    def _release(self, step: Release, sky: Sky, here: Place) -> Ends:
        """Check that what may be in the air can be brought home; afterwards the machine is none of the task's."""
        name = step.who.name
        if name not in sky:
            return Ends(sky, None)
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
        return Ends({**sky, name: gone}, None)

    def _types_of(self, name: str, here: Place) -> tuple[str, ...]:
        shown = (here.outer or {}).get(name, name)
        roles = [shown.partition("[")[0], *self.owners.get(shown, ())]
        return tuple(of for role in roles for of in self.roles.get(role, ()))

    # --- do ----------------------------------------------------------------------------------------------------

    def _do(self, step: Do, sky: Sky, here: Place) -> Ends:
        """Check the action's precondition and apply its effect."""
        spec = self.actions.get(step.action)
        role = step.who.name
        if role not in sky or spec is None:
            return Ends(sky, failing(sky, step.mark, here))
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
        return Ends({**sky, role: after}, {**(failing(sky, step.mark, here) or {}), role: broken})

    def _check_requires(self, step: Do, spec: ActionSpec, states: States, here: Place) -> None:
        """Report E030 once for the first state in which the action cannot start."""
        want = spec.requires
        role = (here.outer or {}).get(step.who.name, step.who.name)
        if not want or here.silent or self.contended & {role.partition("[")[0], *self.owners.get(role, ())}:
            return
        other: Air = "grounded" if want == "airborne" else "airborne"
        why, is_ = states.get(other), f"it is {other}"
        if why is None and not here.lenient:
            why, is_ = states.get("unknown"), f"it may be {other}"
        if why is None:
            return
        path = f" {why.path}" if why.path else ""
        action = spec.name if here.call is None else f"{here.called}, which begins with {spec.name},"
        if here.call is not None and step.seg != "steps[0]":
            action = f"{spec.name} in {here.called} ({line_of(step.mark, here)})"
        what = f"{action} needs '{role}' {want}, but {is_} here{path}"
        hint = f"do: {role}.TakeOff first" if want == "airborne" else f"land it first, or add when: not {role}.airborne"
        if "unknown" in states and other not in states:
            hint = f"add when: {'' if want == 'airborne' else 'not '}{role}.airborne"
        self.reported |= {role.partition("[")[0], *self.owners.get(role, ())}
        self.problems.add("E030", here.call or step.mark, what, hint)


def _without(sky: Sky | None, own: Sky) -> Sky | None:
    """Return a sky without the machines of a block that has ended."""
    return None if sky is None else {key: states for key, states in sky.items() if key not in own}
