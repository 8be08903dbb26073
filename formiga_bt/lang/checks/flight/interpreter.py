"""The interpreter behind `flight`: moves a sky of possible states through steps of every kind.

If = union; loop = until nothing new comes back to the start of a round; parallel = each branch by itself; call = the body with
the caller's machines. The items of a list that a `for` goes over are followed as one, then taken apart again. `doing` has what
one action does.
"""

from typing import Final, assert_never

from msgspec.structs import replace

from formiga_bt.lang.checks.agreeing import MOST
from formiga_bt.lang.checks.filled import walked
from formiga_bt.lang.checks.flight.doing import Doing
from formiga_bt.lang.checks.flight.flight_states import (
    InterpreterPlace,
    Outcomes,
    ReachedStates,
    Sky,
    Why,
    because,
    failing,
    join,
    keys_of,
    line_of,
    merge,
    narrow,
    same,
    signature,
    start,
    without,
)
from formiga_bt.lang.checks.flight.machines import MachineSet, back, both, commanded, is_filled, machines_of, twins_of
from formiga_bt.lang.checks.flight.renaming import renamed
from formiga_bt.lang.model import (
    Ask,
    BreakIf,
    Call,
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
    Switch,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.types import agent_type
from formiga_bt.lang.walk import bare, hands_over, orders

_MADE_OF_STEPS: Final = (Sequence, Fallback, If, Switch, Call, Parallel, Loop, For, Guard, WithAgents, WithResource)


class Interpreter(Doing):
    """Follows steps of every kind."""

    def _narrow(self, sky: Sky, cond: Expr, holds: bool) -> Sky | None:
        """Return the sky where a condition of `when` or `if` holds (or does not), which may be assumed."""
        if id(cond) in self.assumed and self.assumed[id(cond)] != holds:
            return None
        return narrow(sky, cond, holds)

    def _steps(self, steps: tuple[Step, ...], sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Interpret steps one after another."""
        splits = self.splits.get(id(steps), ())
        ways = [ReachedStates({}, sky, sky if steps else None)]
        outer = self.assumed
        failure: Sky | None = None
        for index, step in enumerate(steps):
            for split in splits:
                if split.first == index and len(ways) < 2**MOST:
                    ways = [replace(way, assumed={**way.assumed, **turn}) for way in ways for turn in split.ways]
            after: dict[tuple[tuple[int, bool], ...], ReachedStates] = {}
            over = {cond for split in splits if split.last == index for cond in split.ways[0]}
            for way in ways:
                self.assumed = {**outer, **way.assumed} if way.assumed else outer
                at, broken, idle = self._one_after(step, way, here)
                failure = join(failure, broken)
                assumed = {cond: holds for cond, holds in way.assumed.items() if cond not in over}
                same_ = after.get(tuple(assumed.items()), ReachedStates(assumed, None, None))
                after[tuple(assumed.items())] = ReachedStates(assumed, join(same_.at, at), join(same_.idle, idle))
            self.assumed = outer
            ways = list(after.values())
            if all(way.at is None for way in ways):
                break
        at, idle = None, None
        for way in ways:
            at, idle = join(at, way.at), join(idle, way.idle)
        return Outcomes(at, failure, idle)

    def _one_after(
        self, step: Step, way: ReachedStates, here: InterpreterPlace
    ) -> tuple[Sky | None, Sky | None, Sky | None]:
        """Return where a step leads to after those before it, where it failed, and the sky if none of them did anything."""
        idle = way.idle
        if idle is not None:
            idle = self._narrow(idle, step.when, False) if step.when is not None else None
        if way.at is None:
            return None, None, idle
        ends = self._step(step, way.at, here)
        skipped = f"when {line_of(step.mark, here)} was skipped"
        return join(ends.success, ends.skipped, only_right=skipped), ends.failure, idle

    def _step(self, step: Step, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Interpret one step with its modifiers."""
        run: Sky | None = sky
        skipped: Sky | None = None
        if step.when is not None:
            run, skipped = self._narrow(sky, step.when, True), self._narrow(sky, step.when, False)
        if run is None:
            return Outcomes(None, None, skipped)
        with self.problems.within(step.title):
            ends = self._attempts(step, run, here)
        success, failure = ends.success, ends.failure
        if step.timeout is not None and isinstance(step, _MADE_OF_STEPS):
            failure = join(failure, failing(join(join(success, run), ends.midway), step.mark, here))
        if step.ignore_failure:
            success, failure = join(success, failure), None
        return Outcomes(success, failure, join(ends.skipped, skipped))

    def _attempts(self, step: Step, sky: Sky, here: InterpreterPlace) -> Outcomes:
        first = self._kind(step, sky, here)
        if step.retry is None or first.failure is None:
            return first
        again = self._kind(step, first.failure, replace(here, lenient=True))
        return Outcomes(join(first.success, again.success), join(first.failure, again.failure), first.skipped)

    def _kind(self, step: Step, sky: Sky, here: InterpreterPlace) -> Outcomes:
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
                yes, no = self._narrow(sky, step.cond, True), self._narrow(sky, step.cond, False)
                return Outcomes(yes, failing(no, step.mark, here))
            case Fail():
                return Outcomes(None, failing(sky, step.mark, here))
            case Ask() | WaitFor() | Request():
                return Outcomes(sky, failing(sky, step.mark, here))
            case WaitUntil():
                return Outcomes(narrow(sky, step.cond, True) or sky, failing(sky, step.mark, here))
            case Parallel():
                return self._parallel(step, sky, here)
            case Loop():
                return self._loop(step, sky, here)
            case For():
                return self._for(step, sky, here)
            case BreakIf():
                return self._break_if(step, sky, here)
            case Guard():
                return self._guard(step, sky, here)
            case Release():
                return self._release(step, sky, here)
            case WithAgents():
                return self._with_agents(step, sky, here)
            case WithResource():
                ends = self._steps(step.steps, sky, here)
                return replace(ends, failure=join(ends.failure, failing(sky, step.mark, here)))
            case Wait() | Set() | Notify():
                return Outcomes(sky, None)
            case _:
                assert_never(step)

    def _fallback(self, step: Fallback, sky: Sky, here: InterpreterPlace) -> Outcomes:
        success: Sky | None = None
        at: Sky | None = sky
        for child in step.steps:
            if at is None:
                break
            ends = self._step(child, at, here)
            success = join(success, ends.success)
            if step.reactive:
                success = join(success, failing(join(at, ends.failure), step.mark, here, "stopped it"))
            at = join(ends.failure, ends.skipped)
        return Outcomes(success, at)

    def _if(self, step: If, sky: Sky, here: InterpreterPlace) -> Outcomes:
        yes, no = self._narrow(sky, step.cond, True), self._narrow(sky, step.cond, False)
        dead = Outcomes(None, None)
        then = self._steps(step.then, yes, here) if yes is not None else dead
        other = self._steps(step.otherwise, no, here) if no is not None else dead
        line = line_of(step.mark, here)
        after_then, after_else = join(then.success, then.skipped), join(other.success, other.skipped)
        success = join(after_then, after_else, f"when {line} was true", f"when {line} was false")
        return Outcomes(success, join(then.failure, other.failure))

    def _switch(self, step: Switch, sky: Sky, here: InterpreterPlace) -> Outcomes:
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
        return Outcomes(success, failure)

    def _call(self, step: Call, sky: Sky, here: InterpreterPlace) -> Outcomes:
        subtree = step.subtree
        bound: dict[str, MachineSet] = {}
        for name, arg in step.args.items():
            machines = machines_of(arg, sky)
            if machines.keys and agent_type(subtree.params[name].type).name == "agent":
                bound[name if subtree.params[name].type.name == "agent" else f"{name}[*]"] = machines
        twins = twins_of(bound)
        bound = {name: one for name, one in bound.items() if name not in twins}
        outer = here.outer or {}
        begins = next((do.mark for child in subtree.steps for _, do in orders(child)), None)
        inside = InterpreterPlace(
            here.file,
            silent=here.silent or (subtree.mark.file, subtree.mark.line) in self.broken,
            lenient=here.lenient,
            sure=here.sure,
            call=here.call or step.mark,
            called=here.called or subtree.name,
            first=here.first if here.call is not None else begins,
            both=here.both or both(twins),
            outer={name: outer.get(one.name, one.name) for name, one in bound.items()},
        )
        local = {name: one.states(sky) for name, one in bound.items()}
        known = (subtree.mark, signature(local), inside)
        if known not in self.calls:
            self.calls[known] = self._steps(renamed(subtree.steps, twins) if twins else subtree.steps, local, inside)
        ends = self.calls[known]
        return Outcomes(*(back(sky, end, bound) for end in (ends.success, ends.failure, ends.skipped)))

    # --- branches ----------------------------------------------------------------------------------------------

    def _parallel(self, step: Parallel, sky: Sky, here: InterpreterPlace) -> Outcomes:
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
        return Outcomes(None if dead else success, failing(failure, step.mark, here))

    def _guard(self, step: Guard, sky: Sky, here: InterpreterPlace) -> Outcomes:
        inside = narrow(sky, step.cond, True)
        ends = self._steps(step.steps, inside, here) if inside is not None else Outcomes(None, None)
        stopped = failing(join(sky, ends.success), step.mark, here, "stopped it")
        return Outcomes(ends.success, join(ends.failure, stopped), ends.skipped)

    def _sequence(self, step: Sequence, sky: Sky, here: InterpreterPlace) -> Outcomes:
        ends = self._steps(step.steps, sky, here)
        if step.reactive:
            ends = replace(ends, failure=join(ends.failure, failing(join(sky, ends.success), step.mark, here)))
        if not step.finally_:
            return ends
        cleanup = replace(here, lenient=True)
        return Outcomes(
            self._tidied(step, ends.success, cleanup), self._tidied(step, ends.failure, cleanup), ends.skipped
        )

    def _tidied(self, step: Sequence, sky: Sky | None, here: InterpreterPlace) -> Sky | None:
        """Return what `finally` leaves; as at the end of a task, its own failure is not followed."""
        if sky is None:
            return None
        ends = self._steps(step.finally_, sky, here)
        done = join(ends.success, ends.skipped)
        return done if done is not None else ends.failure

    # --- loops -------------------------------------------------------------------------------------------------

    def _loop(self, step: Loop, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Interpret rounds until nothing new comes back to their start."""
        head, broke, ends = self._rounds(step, sky, here, step.cond)
        end = join(ends.success, ends.skipped)
        out = join(broke, narrow(end, step.until, True) if end is not None and step.until is not None else None)
        none = f"when the loop at {line_of(step.mark, here)} ran no round"
        if step.cond is not None:
            later = narrow(end, step.cond, False) if end is not None else None
            out = join(join(out, later), narrow(sky, step.cond, False), only_right=none)
        elif step.times is not None and not step.times.is_const:
            out = join(join(out, end), sky, only_right=none)
        if step.times is not None or step.duration is not None or step.max is not None:
            out = join(out, end)
        return Outcomes(out, ends.failure, None, join(head, end))

    def _rounds(
        self, step: Loop | For, sky: Sky, here: InterpreterPlace, cond: Expr | None
    ) -> tuple[Sky, Sky | None, Outcomes]:
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

    def _round(
        self, step: Loop | For, head: Sky, here: InterpreterPlace, cond: Expr | None
    ) -> tuple[Sky | None, Outcomes]:
        known = (step.seg, step.mark, signature(head), here, *self.assumed.items())
        if here.silent and known in self.rounds:  # loops in loops would be followed exponentially often
            return self.rounds[known]
        at = narrow(head, cond, True) if cond is not None else head
        self.breaks.append(None)
        ends = self._steps(step.steps, at, here) if at is not None else Outcomes(None, None)
        self.rounds[known] = self.breaks.pop(), ends
        return self.rounds[known]

    def _next(self, step: Loop | For, end: Sky | None, sky: Sky) -> Sky | None:
        """Return the start of the next round: the items of a `for` are fresh ones."""
        if end is None or isinstance(step, Loop):
            return end
        return {**end, **{name: sky[name] for name in step.lists if name in sky and name not in self.again}}

    def _break_if(self, step: BreakIf, sky: Sky, here: InterpreterPlace) -> Outcomes:
        if self.breaks:
            left, path = narrow(sky, step.cond, True), f"when {line_of(step.mark, here)} left the loop"
            self.breaks[-1] = join(self.breaks[-1], because(left, path))
        return Outcomes(narrow(sky, step.cond, False), None)

    def _for(self, step: For, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Interpret the body once for all items: what it does to one it does, by the end, to each of the list."""
        if any(self.assumed.get(id(expr)) is False for expr in step.lists.values()):
            return Outcomes(sky, None)
        bound = {name: one for name, expr in step.lists.items() if (one := machines_of(expr, sky)).keys}
        twins = twins_of(bound, step)
        if twins:
            bound = {name: one for name, one in bound.items() if name not in twins}
            step = replace(step, steps=renamed(step.steps, twins))
        self.again = {*self.again - step.lists.keys(), *(name for name, one in bound.items() if one.twice)}
        outer = {**(here.outer or {}), **dict.fromkeys(step.lists, "")}
        for name, one in bound.items():
            outer[name] = name
            self.owners[name] = {one.name.partition("[")[0], *self.owners.get(one.name, ())}
        inside = {**sky, **{name: one.states(sky) for name, one in bound.items()}}
        at = replace(here, outer={name: word for name, word in outer.items() if word}, both=here.both or both(twins))
        _, broke, ends = self._rounds(step, inside, at, None)
        end = join(ends.success, ends.skipped)
        loose = {name: replace(one, all=False) for name, one in bound.items()}
        some = any(one.all and not one.open for one in bound.values()) or is_filled(step)
        filled = self.filled if here.call is None else ()
        some = some or any(self.assumed.get(id(e)) or walked(bare(e)) in filled for e in step.lists.values())
        failure = back(sky, join(ends.failure, join(end, inside) if ends.failure is not None else None), loose)
        success = back(sky, end, bound if step.needs_all else loose)
        if not some and success is not None:  # an empty list has no items to be left in another state
            items = {key: success[key] for one in bound.values() if one.all for key in one.keys}
            none = f"when the loop at {line_of(step.mark, here)} ran no round"
            success = {**(join(success, sky, only_right=none) or {}), **items}
        success = join(success, back(sky, broke, loose))
        if step.first:  # the others are stopped wherever they are
            success = join(success, back(sky, inside, loose))
        if not step.needs_all:
            success, failure = join(success, failure), failing(join(success, failure), step.mark, here)
        return Outcomes(success, failure, None, back(sky, join(inside, end), loose))

    def _with_agents(self, step: WithAgents, sky: Sky, here: InterpreterPlace) -> Outcomes:
        """Interpret a block with machines of its own, which must be down at its end as those of a task at the task's."""
        flying = [r for r in step.roles.values() if self.flies(r) and not any(key in sky for key in keys_of(r))]
        own = {key: start(role) for role in flying for key in keys_of(role)}
        outer, self.roles = self.roles, {**self.roles, **{role.name: role.types for role in step.roles.values()}}
        if self.breaks:
            self.breaks.append(None)
        ends = self._steps(step.steps, {**sky, **own}, here)
        inside = join(join(ends.success, {**sky, **own}), ends.midway) or {}
        if hands_over(step):
            again = self._steps(step.steps, {**inside, **own}, replace(here, lenient=True))
            ends = Outcomes(
                join(ends.success, again.success), join(ends.failure, again.failure), ends.skipped, ends.midway
            )
        if any(role.if_lost == "fail_block" for role in step.roles.values()):
            ends = replace(ends, failure=join(ends.failure, failing(inside, step.mark, here)))
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
            self.breaks[-1] = join(self.breaks[-1], without(broke, own))
        nobody = failing(sky, step.mark, here)
        failure = join(without(ends.failure, own), nobody)
        return Outcomes(without(ends.success, own), failure, without(ends.skipped, own), without(ends.midway, own))
