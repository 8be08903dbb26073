"""The oracle: an interpreter of `lang.model` steps that is too simple to be wrong in the way the engine's nodes may be.

It walks the whole tree of a section at every pass, from the root, knows no wakes, and keeps its memory in plain dicts by
instance path. Written from the language's and the engine's rules, not from `formiga_bt.nodes`.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from formiga_bt.base.clock import micros
from formiga_bt.engine.tasks.treerun import Ended, TreeHost
from formiga_bt.lang import model
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.ends import AgentReleased, ChildEnd, End, GoalEnd
from formiga_bt.nodes.run import AskOrder, CleanupOrder, Failure, GoalOrder, GoalView, Runaway, TaskOrder


class Done(NamedTuple):
    """How a step ended: by a failure, skipped, or (neither) well. A step that still runs has no `Done`, but None."""

    failure: Failure | None = None
    skipped: bool = False
    leaves: bool = False
    """A `break_if` was true: everything up to the nearest loop ends with it."""


class BrokenError(Exception):
    """A step raised; nothing in the tree catches it."""

    def __init__(self, path: str, mark: Any, cause: Exception) -> None:
        computes = isinstance(cause, model.EvalError | model.Unset)
        super().__init__(f"{path} ({mark}): {model.why_not_computed(cause)}")
        self.path = path
        self.code = "cannot_compute" if computes else "exception"


@dataclass(frozen=True)
class At:
    """A place in a running tree: a step, the modifiers still to be gone through, and what is visible there."""

    step: model.Step
    words: tuple[str, ...]
    path: str
    scope: str
    error: Failure | None
    bound: str = ""
    """Key of the timeout around this very step."""
    retries: tuple[str, ...] = ()
    """Keys of the retries around it that want other agents each time."""

    @property
    def key(self) -> str:
        return f"{self.path}:{self.words[0]}" if self.words else self.path

    def inner(self, attempt: int = 0) -> "At":
        bound = self.key if self.words[0] == "timeout" else self.bound
        path = f"{self.path}@{attempt}" if attempt else self.path
        retries = self.retries
        if self.words[0] == "retry" and self.step.retry is not None and self.step.retry.agent == "another":
            retries = (*retries, self.key)
        return replace(self, words=self.words[1:], path=path, bound=bound, retries=retries)


def modifiers(step: model.Step) -> tuple[str, ...]:
    words = {
        "when": step.when is not None,
        "ignore_failure": step.ignore_failure,
        "timeout": step.timeout is not None,
        "retry": step.retry is not None,
        "attempt_timeout": step.retry is not None and step.retry.attempt_timeout is not None,
        "finally": isinstance(step, model.Sequence) and bool(step.finally_),
    }
    return tuple(word for word, there in words.items() if there)


def is_own(at: At) -> bool:
    """Return whether the end here is the end of the step: not that of a modifier, but of the `finally` of a sequence."""
    return at.words == ("finally",) or not (at.words or "finally" in modifiers(at.step))


class NaiveTrees:
    """Implements `engine.tasks.treerun.TaskTrees`."""

    looks_at_everything = True
    """Any change of anything leads to a pass (`tests.property.world`), so that no wake can be missing here."""

    def __init__(self, host: TreeHost) -> None:
        self.host = host
        self.live: dict[str, tuple[Sequence[model.Step], str]] = {}
        self.pending: list[tuple[str, Sequence[model.Step], str]] = []
        self.alone: dict[str, tuple[str, Failure | None]] = {}
        """Each `finally` of a stopped sequence that runs: the sequence's path, and what `error` is in it."""
        self.mem: dict[str, dict[str, Any]] = {}
        self.moved = False
        self.broken: set[str] = set()
        """Sections in which a step raised: they stand still until they are stopped."""

    # -- TaskTrees -------------------------------------------------------------------------------------------------
    def start(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        self.pending.append((section, steps, scope))
        if at:
            self.alone[section] = (at, error)

    def take_over(
        self, section: str, tree: Any, steps: Sequence[model.Step], scope: str, at: str, error: Failure | None
    ) -> None:
        self.live[section] = (steps, scope)
        self.alone[section] = (at, error)
        self.mem[at] = tree

    def wake(self, key: str) -> None:
        self.moved = True  # everything is looked at anyway

    def run_passes(self) -> list[Ended]:
        ended: list[Ended] = []
        while True:
            self.moved = False
            if self.pending:
                section, steps, scope = self.pending.pop(0)
                self.live[section] = (steps, scope)
                self._pass(section, ended)
                self.moved = True
            else:
                for section in list(self.live):
                    self._pass(section, ended)
            self.host.flush()
            if not self.moved:
                return ended

    def halt(self, section: str) -> list[End]:
        self.pending = [item for item in self.pending if item[0] != section]
        if section not in self.live:
            return []
        steps, scope = self.live.pop(section)
        self.broken.discard(section)
        key = self._key(section)
        goals = []
        if key in self.mem:
            goals = self._halt_child(self._root(section, steps, scope), self.mem[key])
            del self.mem[key]
            if section not in self.alone:
                self.host.ended(section, "H")
        self.alone.pop(section, None)
        self.host.flush()
        return goals

    def restore(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        raise NotImplementedError("the oracle is never restarted")

    def statuses(self) -> dict[str, str]:
        return dict.fromkeys(self.mem, "RUNNING")

    # -- a section ---------------------------------------------------------------------------------------------------
    def _key(self, section: str) -> str:
        return self.alone[section][0] if section in self.alone else section

    def _root(self, section: str, steps: Sequence[model.Step], scope: str) -> list[At]:
        if section in self.alone:
            path, error = self.alone[section]
            return [At(s, modifiers(s), f"{path}.{s.seg}", scope, error) for s in steps]
        return [At(s, modifiers(s), f"{section}/{s.seg}", scope, None) for s in steps]

    def _pass(self, section: str, ended: list[Ended]) -> None:
        if section in self.broken:
            return
        steps, scope = self.live[section]
        mem = self.mem.setdefault(self._key(section), {"index": 0, "ran": False})
        try:
            done = self._in_order(self._root(section, steps, scope), mem)
        except BrokenError as broken:
            self.broken.add(section)
            failure = Failure(code=broken.code, reason=str(broken), step=broken.path, retryable=False)
            ended.append(Ended(section, failure, fatal=True))
            return
        except Runaway as runaway:
            self.broken.add(section)
            failure = Failure(code="runaway", reason=str(runaway), step=section, retryable=False)
            ended.append(Ended(section, failure, fatal=True))
            return
        if done is not None:
            del self.live[section], self.mem[self._key(section)]
            if section not in self.alone:
                self._tell(section, done)
            self.alone.pop(section, None)
            ended.append(Ended(section, done.failure))

    # -- one place -----------------------------------------------------------------------------------------------------
    def visit(self, at: At) -> Done | None:
        fresh = at.key not in self.mem
        if fresh:
            self.mem[at.key] = {}
            self.moved = True
        kind: Callable[[At, dict[str, Any], bool], Done | None]
        kind = getattr(self, f"_{at.words[0] if at.words else at.step.kind}")
        try:
            done = kind(at, self.mem[at.key], fresh)
            if done is not None and is_own(at):
                self._tell(at.path, done)
        except model.UnknownState as unknown:
            done = failed(at, "unknown_state", f"{unknown.key} is not known yet")
            self._tell(at.path, done)
        except (BrokenError, Runaway):
            raise
        except Exception as cause:
            raise BrokenError(at.path, at.step.mark, cause) from cause
        if done is not None:
            self._leave(at)
        return done

    def _tell(self, path: str, done: Done) -> None:
        if done.failure is not None:
            self.host.ended(path, "F", done.failure.code)
        else:
            self.host.ended(path, "K" if done.skipped else "S")

    def halt_at(self, at: At) -> list[End]:
        mem = self.mem.get(at.key)
        if mem is None:
            return []
        goals: list[End] = []
        for end in mem.get("drain", ()):  # what still drains moves to whoever stops this
            if self.host.is_over(end):
                self.host.forget(end)
            else:
                goals.append(end)
        if "drain" in mem:
            pass  # what is below was stopped then
        elif at.words[:1] == ("finally",):
            goals = self._hand_over(at, mem)
        elif at.words:
            goals = self.halt_at(at.inner(mem.get("attempt", 0)))
        elif at.step.kind == "do":
            goals = [GoalEnd(mem["goal"])] if "goal" in mem and self.host.cancel(mem["goal"]) else []
        elif at.step.kind == "ask":
            if "question" in mem:
                self.host.close_question(mem["question"])
        elif at.step.kind in ("sequence", "fallback", "if", "switch", "call", "guard"):
            goals = self._halt_child(self._children(at, mem), mem)
            if at.step.kind == "call":
                self.host.close_scope(at.path)
        elif isinstance(at.step, model.WithAgents):
            goals = self._stop_block(at, mem)
        elif isinstance(at.step, model.WithResource):
            if "index" not in mem:
                self.host.withdraw_resources(at.key)
            else:
                goals = self._halt_child(self._children(at, mem), mem)
                self.host.free_resources(at.key, tuple(goals), well=False)
        elif isinstance(at.step, model.Request):
            if "child" in mem and not at.step.detached and self.host.end_task(mem["child"]):
                goals = [ChildEnd(mem["child"])]
        elif isinstance(at.step, model.Parallel) or (isinstance(at.step, model.For) and at.step.parallel):
            goals = self._stop_branches(at, mem)
        elif isinstance(at.step, model.Loop | model.For):
            if mem.get("round") and not mem["waiting"]:
                goals = self._halt_child(self._children(at, mem), mem)
            if isinstance(at.step, model.For) and mem.get("items"):
                self._unset(at, at.step.collect)
                self._unset(at, *at.step.lists, always=True)
        if is_own(at):
            self.host.ended(at.path, "H")
        self._leave(at)
        return goals

    def _halt_child(self, children: list[At], mem: dict[str, Any]) -> list[End]:
        index = mem.get("index", 0)
        return self.halt_at(children[index]) if index < len(children) else []

    def _leave(self, at: At) -> None:
        self.host.clear_deadline(at.key)
        self.host.unwatch(at.key)
        del self.mem[at.key]
        self.moved = True

    def _env(self, at: At, extra: dict[str, Any] | None = None) -> model.Env:
        return self.host.env(at.scope, at.error, extra)

    # -- modifiers -----------------------------------------------------------------------------------------------------
    def _when(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        if fresh and not at.step.when.run(self._env(at)):
            self.host.ended(at.path, "K")
            return Done(skipped=True)
        return self.visit(at.inner())

    def _ignore_failure(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        done = self.visit(at.inner())
        return Done() if done is not None and done.failure is not None else done

    def _timeout(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        return self._bounded(at, mem, fresh, at.step.timeout)

    def _attempt_timeout(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        return self._bounded(at, mem, fresh, at.step.retry.attempt_timeout)

    def _bounded(self, at: At, mem: dict[str, Any], fresh: bool, duration: model.Expr) -> Done | None:
        host = self.host
        if fresh:
            host.set_deadline(at.key, host.now + micros(duration.run(self._env(at))))
        if "drain" not in mem:
            done = self.visit(at.inner())
            if done is not None or not host.is_due(at.key):
                return done
            self._order_stop(at, mem, self.halt_at(at.inner()))
        if not all(host.is_over(end) for end in mem["drain"]):
            return None
        goals = [host.goal(end.goal) for end in mem["drain"] if isinstance(end, GoalEnd)]
        late = None
        for goal in goals:  # the work was done after all
            if late is None and goal.state == "succeeded" and isinstance(at.step, model.Do):
                late = self._end_of(replace(at, path="/".join(goal.id.split("/")[2:])), at.step, goal)
        again = all(goal.repeatable for goal in goals)
        for end in mem["drain"]:
            host.forget(end)
        done = late or self._too_late(at, goals, again)
        self._tell(at.path, done)
        return done

    def _too_late(self, at: At, goals: list[GoalView], again: bool) -> Done:
        doubt = [goal for goal in goals if goal.state == "in_doubt"]
        if doubt:
            reason = "the agent never confirmed the cancel"
            return failed(at, "cancel_unconfirmed", reason, doubt[0].agent, again=False)
        reason = f"not done within its {at.words[0].replace('_', ' ')}"
        return failed(at, "timeout", reason, again=again, other=not again)

    def _finally(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        if "tidy" not in mem:
            mem["ended"] = self.visit(at.inner())
            if mem["ended"] is None:
                return None
            mem["tidy"] = {"index": 0, "ran": False}
            self.mem[at.path] = {}  # the steps of `finally` count as one node at the sequence's path
            self.host.open_scope(at.key, {"..": at.scope, ".=": True})
        try:
            if self._in_order(self._cleanup(at, mem), mem["tidy"]) is None:
                return None
        except (BrokenError, Runaway):
            mem["broken"] = True
            raise
        del self.mem[at.path]
        self.host.close_scope(at.key)
        return mem["ended"]  # a failure of `finally` changes nothing

    def _hand_over(self, at: At, mem: dict[str, Any]) -> list[End]:
        """Stop a sequence that has a `finally`, which goes on (or begins) on its own."""
        closing = "tidy" in mem
        goals = [] if closing else self.halt_at(at.inner())
        error = (mem["ended"].failure if closing else None) or at.error
        end = None
        if not mem.get("broken"):
            order = CleanupOrder(at.path, at.scope, at.key, tuple(goals), error)
            end = self.host.cleanup(order, mem["tidy"] if closing else None)
        if closing and end is None:
            goals = self._halt_child(self._cleanup(at, mem), mem["tidy"])
            del self.mem[at.path]
            self.host.close_scope(at.key)
        return goals if end is None else [*goals, end]

    def _cleanup(self, at: At, mem: dict[str, Any]) -> list[At]:
        assert isinstance(at.step, model.Sequence)
        error = mem["ended"].failure or at.error
        return [At(s, modifiers(s), f"{at.path}.{s.seg}", at.key, error, "", at.retries) for s in at.step.finally_]

    # -- stops -----------------------------------------------------------------------------------------------------------
    def _order_stop(self, at: At, mem: dict[str, Any], goals: list[End]) -> None:
        """Wait for the end of these goals from now on."""
        mem["drain"] = goals
        self.moved = True
        for goal in goals:
            self.host.adopt(goal, at.key)
        self.host.unwatch(at.key)
        self.host.clear_deadline(at.key)

    def _drained(self, at: At, mem: dict[str, Any]) -> Done | None:
        """Once all goals have ended, return what was decided when they were stopped."""
        if not all(self.host.is_over(end) for end in mem["drain"]):
            return None
        goals = [self.host.goal(end.goal) for end in mem["drain"] if isinstance(end, GoalEnd)]
        doubt = [goal for goal in goals if goal.state == "in_doubt"]
        for end in mem["drain"]:
            self.host.forget(end)
        decided: Done = mem["decided"]
        if decided.failure is not None and doubt:
            reason = "the agent never confirmed the cancel"
            return failed(at, "cancel_unconfirmed", reason, doubt[0].agent, again=False)
        return decided

    def _retry(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, retry = self.host, at.step.retry
        if fresh:
            env = self._env(at)
            mem["attempts"] = int(retry.attempts.run(env))
            mem["delay"] = micros(retry.delay.run(env)) if retry.delay else 0
            mem["backoff"] = float(retry.backoff.run(env)) if retry.backoff else 1.0
            mem["attempt"], mem["waiting"], mem["begun"] = 1, False, 1
            mem["had"], mem["culprits"] = (), ()
        while True:
            if mem["waiting"]:
                if not host.is_due(at.key):
                    return None
                host.clear_deadline(at.key)
                mem["waiting"] = False
                mem["attempt"] += 1
            if mem["attempt"] > 1 and mem["begun"] < mem["attempt"]:
                self._unset(at, *retry.fresh)
            mem["begun"] = mem["attempt"]
            done = self.visit(at.inner(mem["attempt"]))
            if done is None or done.failure is None:
                return done
            had, named = mem["had"], done.failure.agent in mem["had"]
            someone = named or (had and not done.failure.agent)
            other = retry.agent == "another" and done.failure.by_another and someone
            if mem["attempt"] >= mem["attempts"] or not (done.failure.retryable or other):
                return done
            word = done.failure.code.removeprefix("failed:")
            said = [done.failure.code, word] + (["failed"] if done.failure.code.startswith("failed:") else [])
            if (retry.on and not any(one in retry.on for one in said)) or any(one in retry.unless for one in said):
                return done
            mem["had"] = ()
            mem["culprits"] += (done.failure.agent,) if named else had
            delay = round(mem["delay"] * mem["backoff"] ** (mem["attempt"] - 1))
            if delay > 0:
                mem["waiting"] = True
                host.set_deadline(at.key, host.now + delay)
                return None
            mem["attempt"] += 1

    # -- composites ----------------------------------------------------------------------------------------------------
    def _children(self, at: At, mem: dict[str, Any]) -> list[At]:
        step, mid, scope, error = at.step, "", at.scope, at.error
        if isinstance(step, model.If):
            steps = step.then if mem.get("branch", True) else step.otherwise
        elif isinstance(step, model.Switch):
            steps = mem.get("branch", ())
        elif isinstance(step, model.Call):
            steps, mid, scope, error = step.subtree.steps, ".call", at.path, None
        elif isinstance(step, model.Loop | model.For):
            steps, mid = step.steps, f".{step.kind}#{mem['round']}"
        elif isinstance(step, model.Fallback):
            steps = step.steps
            error = mem.get("failure") or (skipped_before(at) if mem.get("index") else error)
        else:
            assert isinstance(step, model.Sequence | model.Guard | model.WithAgents | model.WithResource)
            steps, mid = step.steps, f".turn#{mem['turn']}" if mem.get("turn") else ""
        return [At(s, modifiers(s), f"{at.path}{mid}.{s.seg}", scope, error, "", at.retries) for s in steps]

    def _in_order(self, children: list[At], mem: dict[str, Any], around: At | None = None) -> Done | None:
        while mem["index"] < len(children):
            if around is not None:
                self._look_at(around, mem)
            done = self.visit(children[mem["index"]])
            if done is None:
                return None
            if done.failure is not None:
                mem["ran"] = True
                return Done(done.failure)
            mem["ran"] = mem["ran"] or not done.skipped
            mem["index"] += 1
            if done.leaves:
                return Done(leaves=True)
        return Done(skipped=not mem["ran"])

    def _sequence(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        if fresh:
            mem.update(index=0, ran=False)
        assert isinstance(at.step, model.Sequence)
        if at.step.reactive:
            return self._watched(at, mem, lambda children, mem: self._in_order(children, mem, at))
        return self._in_order(self._children(at, mem), mem)

    def _if(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        if fresh:
            assert isinstance(at.step, model.If)
            mem.update(branch=bool(at.step.cond.run(self._env(at))), index=0, ran=False)
        return self._in_order(self._children(at, mem), mem)

    def _switch(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        step = at.step
        assert isinstance(step, model.Switch)
        if fresh:
            value = step.on.run(self._env(at))
            branches = {case.value: case.steps for case in step.cases}
            if value not in branches and not step.default:
                raise model.EvalError(f"{step.on.source} is {value!r}, which is none of the cases")
            mem.update(branch=branches.get(value, step.default), index=0, ran=False)
        return self._in_order(self._children(at, mem), mem)

    def _fallback(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        if fresh:
            mem.update(index=0, failure=None)
        assert isinstance(at.step, model.Fallback)
        if at.step.reactive:
            return self._watched(at, mem, lambda _, mem: self._first_of(at, mem))
        return self._first_of(at, mem)

    def _first_of(self, at: At, mem: dict[str, Any]) -> Done | None:
        while mem["index"] < len(self._children(at, mem)):
            self._look_at(at, mem)
            done = self.visit(self._children(at, mem)[mem["index"]])
            if done is None:
                return None
            if done.failure is None and not done.skipped:
                return Done()
            mem["failure"] = done.failure or mem["failure"]
            mem["index"] += 1
        if mem["failure"] is not None:
            return Done(mem["failure"])
        return failed(at, "nothing_applied", "every child of the fallback was skipped")

    # -- live conditions -------------------------------------------------------------------------------------------------
    def _look_at(self, at: At, mem: dict[str, Any]) -> None:
        """Be visited when a comparison with `now` turns. For all else every change of anything leads to a pass (world.py)."""
        step = at.step
        if isinstance(step, model.Guard):
            self.host.watch(at.key, (step.cond,), at.scope)
        elif isinstance(step, model.Sequence | model.Fallback) and step.reactive:
            checks = [s.cond for s in step.steps[: mem["index"]] if isinstance(s, model.Check)]
            self.host.watch(at.key, tuple(checks), at.scope)

    def _watched(
        self, at: At, mem: dict[str, Any], go_on: Callable[[list[At], dict[str, Any]], Done | None]
    ) -> Done | None:
        """Look at the live conditions, then go on."""
        if "drain" in mem:
            return self._drained(at, mem)
        decided = self._verdict(at, mem)
        if decided is None:
            return go_on(self._children(at, mem), mem)
        mem["decided"] = decided
        self._order_stop(at, mem, self._halt_child(self._children(at, mem), mem))
        return self._drained(at, mem)

    def _verdict(self, at: At, mem: dict[str, Any]) -> Done | None:
        step = at.step
        if isinstance(step, model.Guard):
            try:
                return None if step.cond.run(self._env(at)) else failed(at, "guard", f"{step.cond.source} is false")
            except model.UnknownState:
                return None
        assert isinstance(step, model.Sequence | model.Fallback)
        error = at.error
        for check in step.steps[: mem["index"]]:
            place = At(check, (), f"{at.path}.{check.seg}", at.scope, error)
            try:
                done = self._check(place, {}, True)
            except model.UnknownState:
                continue
            if (done.failure is None) == isinstance(step, model.Fallback):
                return done
            error = done.failure or error
        return None

    def _guard(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Guard)
        if fresh:
            if not at.step.cond.run(self._env(at)):
                return failed(at, "guard", f"{at.step.cond.source} is false")
            mem.update(index=0, ran=False)
            return self._in_order(self._children(at, mem), mem, at)
        return self._watched(at, mem, lambda children, mem: self._in_order(children, mem, at))

    def _wait_until(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.WaitUntil)
        try:
            if at.step.cond.run(self._env(at)):
                return Done()
        except model.UnknownState:
            if fresh:
                raise
        self.host.watch(at.key, (at.step.cond,), at.scope)
        return None

    def _wait_for(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.WaitFor)
        if fresh:
            assert step.who.agent is not None
            mem["agent"] = step.who.agent.run(self._env(at)).id
            mem["after"] = host.newest_event()
        after = host.events_seen(mem["agent"], step.event) if step.since_task else mem["after"]
        found = host.take_event(mem["agent"], step.event, after)
        if found is None:
            host.watch_event(at.key, mem["agent"], step.event)
            return None
        if step.save_as:
            host.set_var(at.scope, step.save_as, dict(found))
        return Done()

    # -- parallel --------------------------------------------------------------------------------------------------------
    def _parallel(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Parallel)
        if fresh:
            mem.update(branches=["waits"] * len(at.step.steps), first=None)
        return self._at_once(at, mem)

    _race = _parallel

    def _for(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        step = at.step
        assert isinstance(step, model.For)
        if fresh:
            env = self._env(at)
            lists = {name: tuple(expr.run(env)) for name, expr in step.lists.items()}
            if len({len(values) for values in lists.values()}) > 1:
                told = ", ".join(f"'{name}' has {len(values)}" for name, values in lists.items())
                return failed(at, "zip_length", f"{told} items")
            length = len(next(iter(lists.values())))
            mem["items"] = [{name: lists[name][i] for name in lists} for i in range(length)]
            self._unset(at, step.collect or step.first)  # what an earlier run of this loop gathered
            if step.parallel:
                mem.update(branches=["waits"] * length, first=None, gathered={})
            else:
                mem.update(round=1, running=False, waiting=False, ever=False, good=0, first=None, gathered=[])
        return self._at_once(at, mem) if step.parallel else self._rounds(at, mem)

    def _at_once(self, at: At, mem: dict[str, Any]) -> Done | None:
        step, branches = at.step, mem["branches"]
        assert isinstance(step, model.Parallel | model.For)
        if "drain" in mem:
            return self._end_of_branches(at, mem)
        for index, state in enumerate(branches):
            if state == "runs":
                self._visit_branch(at, mem, index)
        most = step.max_parallel if isinstance(step, model.For) else None
        for index, state in enumerate(branches):
            full = most is not None and branches.count("runs") >= most
            lost = most is not None and step.on_child_failure == "cancel" and self._lost(step, branches)
            won = isinstance(step, model.For) and bool(step.first) and bool(mem["gathered"])
            won = won or (step.need == "first" and ("done" in branches or "failed" in branches))
            if state == "waits" and not full and not lost and not won:
                branches[index] = "runs"
                self._visit_branch(at, mem, index)
        left = branches.count("runs") + branches.count("waits")
        if isinstance(step, model.For) and step.first:
            if branches and not mem["gathered"] and left:
                return None
            nothing = failed(at, "nothing_applied", f"no item saved '{step.first}'")
            mem["decided"] = (
                Done() if mem["gathered"] or not branches else Done(mem["first"]) if mem["first"] else nothing
            )
        elif step.need == "first":
            ends = [index for index, state in enumerate(branches) if state in ("done", "failed")]
            if not ends and left:
                return None
            bad = bool(ends) and branches[ends[0]] == "failed"
            mem["decided"] = Done(mem["first"]) if bad else Done(skipped=not ends)
        elif self._won(step, branches):
            mem["decided"] = Done(skipped=bool(branches) and all(state == "skipped" for state in branches))
        elif self._lost(step, branches) and (left == 0 or step.on_child_failure == "cancel"):
            few = failed(at, "nothing_applied", f"fewer than {step.need} succeeded")
            mem["decided"] = Done(mem["first"]) if mem["first"] else few
            if all(state == "skipped" for state in branches):
                mem["decided"] = Done(skipped=bool(branches))
        else:
            return None
        self._order_stop(at, mem, self._stop_branches(at, mem))
        return self._end_of_branches(at, mem)

    def _won(self, step: model.Parallel | model.For, branches: list[str]) -> bool:
        left = branches.count("runs") + branches.count("waits")
        if step.need == "all":
            return left == 0 and "failed" not in branches
        if isinstance(step, model.For) and left:  # with `need: N` all of them run
            return False
        return branches.count("done") >= (1 if step.need == "any" else int(step.need))

    def _lost(self, step: model.Parallel | model.For, branches: list[str]) -> bool:
        if step.need == "all":
            return "failed" in branches
        at_best = len(branches) - branches.count("failed") - branches.count("skipped")
        return at_best < (1 if step.need == "any" else int(step.need))

    def _end_of_branches(self, at: At, mem: dict[str, Any]) -> Done | None:
        done = self._drained(at, mem)
        if done is None or done.failure is not None or not isinstance(at.step, model.For):
            return done
        if at.step.first and mem["gathered"]:
            self.host.set_var(at.scope, at.step.first, mem["gathered"][min(mem["gathered"])])
        if at.step.collect:
            self.host.set_var(at.scope, at.step.collect, tuple(mem["gathered"][i] for i in sorted(mem["gathered"])))
        return done

    def _branch(self, at: At, index: int) -> tuple[str, list[At]]:
        """Return the key of an item (a branch of `parallel` has none) and its steps."""
        step = at.step
        if isinstance(step, model.Parallel):
            one = step.steps[index]
            return "", [At(one, modifiers(one), f"{at.path}.{one.seg}", at.scope, at.error, "", at.retries)]
        assert isinstance(step, model.For)
        path = f"{at.path}.for#{index + 1}"
        return path, [At(s, modifiers(s), f"{path}.{s.seg}", path, at.error, "", at.retries) for s in step.steps]

    def _visit_branch(self, at: At, mem: dict[str, Any], index: int) -> None:
        key, steps = self._branch(at, index)
        if not key:
            done = self.visit(steps[0])
        else:
            if key not in self.mem:
                self.host.open_scope(key, {**mem["items"][index], "..": at.scope})
                self.mem[key] = {"index": 0, "ran": False}
                self.moved = True
            done = self._in_order(steps, self.mem[key])
        if done is None:
            return
        mem["branches"][index] = "failed" if done.failure else "skipped" if done.skipped else "done"
        mem["first"] = mem["first"] or done.failure
        if key:
            assert isinstance(at.step, model.For)
            del self.mem[key]
            self.moved = True
            env = self.host.env(key)
            name = at.step.collect or at.step.first
            if name and mem["branches"][index] == "done" and env.is_set(name):
                mem["gathered"][index] = env.name(name)
            self.host.close_scope(key)

    def _stop_branches(self, at: At, mem: dict[str, Any]) -> list[End]:
        goals: list[End] = []
        for index, state in enumerate(mem.get("branches", ())):
            if state == "runs":
                key, steps = self._branch(at, index)
                if not key:
                    goals += self.halt_at(steps[0])
                elif key in self.mem:
                    goals += self._halt_child(steps, self.mem.pop(key))
                    self.host.close_scope(key)
        return goals

    # -- loops -----------------------------------------------------------------------------------------------------------
    def _while(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        return self._loop(at, mem, fresh)

    def _repeat(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        return self._loop(at, mem, fresh)

    def _loop(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        step = at.step
        assert isinstance(step, model.Loop)
        if fresh:
            env = self._env(at)
            mem["over"] = self.host.clock + micros(step.duration.run(env)) if step.duration else None
            counts = [int(expr.run(env)) for expr in (step.times, step.max) if expr is not None]
            mem["most"] = min(counts) if counts else None
            mem["every"] = micros(step.every.run(env)) if step.every else 0
            mem.update(round=1, running=False, waiting=False, ever=False)
        return self._rounds(at, mem)

    def _rounds(self, at: At, mem: dict[str, Any]) -> Done | None:
        while True:
            if mem["waiting"]:
                if not self.host.is_due(at.key):
                    return None
                self.host.clear_deadline(at.key)
                mem["waiting"] = False
            if not mem["running"]:
                if not self._another_round(at, mem):
                    return self._end_of_loop(at, mem, left=False)
                mem.update(running=True, began=self.host.clock, index=0, ran=False)
                self.host.spend()
                self._unset(at, *at.step.fresh)
            done = self._in_order(self._children(at, mem), mem)
            if done is None:
                return None
            mem["running"], mem["ever"] = False, mem["ever"] or mem["ran"]
            if isinstance(at.step, model.For):
                if self._take(at, mem, done):
                    return done
                leaves = done.leaves
            else:
                if done.failure is not None:
                    return done
                assert isinstance(at.step, model.Loop)
                leaves = done.leaves or (at.step.until is not None and bool(at.step.until.run(self._env(at))))
            mem["round"] += 1
            if leaves or self._counted_out(at, mem):
                return self._end_of_loop(at, mem, left=leaves)
            start = mem["began"] + mem.get("every", 0)
            if mem.get("over") is not None:
                start = min(start, mem["over"])
            if mem.get("every") and start > self.host.clock:
                mem["waiting"] = True
                self.host.set_deadline(at.key, self.host.now + start - self.host.clock)

    def _counted_out(self, at: At, mem: dict[str, Any]) -> bool:
        most = len(mem["items"]) if isinstance(at.step, model.For) else mem["most"]
        return most is not None and mem["round"] > most

    def _another_round(self, at: At, mem: dict[str, Any]) -> bool:
        if self._counted_out(at, mem):
            return False
        if isinstance(at.step, model.For):
            for name, value in mem["items"][mem["round"] - 1].items():
                self.host.set_var(at.scope, name, value)
            return True
        assert isinstance(at.step, model.Loop)
        if mem["over"] is not None and self.host.clock >= mem["over"]:
            return False
        return at.step.cond is None or bool(at.step.cond.run(self._env(at)))

    def _take(self, at: At, mem: dict[str, Any], done: Done) -> bool:
        """Look at what a round of `for` leaves behind; return whether the loop fails with it."""
        step = at.step
        assert isinstance(step, model.For)
        env = self._env(at)
        if step.collect and env.is_set(step.collect):
            if done.failure is None:
                mem["gathered"].append(env.name(step.collect))
            self._unset(at, step.collect)
        if done.failure is None:
            mem["good"] += mem["ran"]
            return False
        if step.need == "all":
            self._unset(at, *step.lists, always=True)
            return True
        mem["first"] = mem["first"] or done.failure
        return False

    def _end_of_loop(self, at: At, mem: dict[str, Any], *, left: bool) -> Done:
        step = at.step
        if isinstance(step, model.For):
            if mem["items"]:
                self._unset(at, *step.lists, always=True)
            if step.need != "all" and mem["ever"] and not left and mem["good"] < int(step.need):
                few = failed(at, "nothing_applied", f"fewer than {step.need} succeeded")
                return Done(mem["first"]) if mem["first"] else few
            if step.collect:
                self.host.set_var(at.scope, step.collect, tuple(mem["gathered"]))
        return Done(skipped=mem["round"] > 1 and not mem["ever"])

    def _unset(self, at: At, *names: str, always: bool = False) -> None:
        for name in names:
            if name and (always or self.host.env(at.scope).is_set(name)):
                self.host.set_var(at.scope, name, None)

    # -- other tasks -----------------------------------------------------------------------------------------------------
    def _request(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.Request)
        if fresh:
            env = self._env(at)
            params = {}
            for name, expr in step.args.items():
                with suppress(model.Unset):
                    params[name] = expr.run(env)
            child = host.start_task(TaskOrder(at.key, step.task, params, step.priority, step.detached))
            if isinstance(child, Failure):
                return Done(child)
            mem["child"] = child
        view = host.child(mem["child"])
        if step.wait and not view.ended:
            return None
        status = view.status if view.ended else "PENDING"
        if step.save_as:
            told = {"status": status, "reason": view.outcome.reason, "task_id": view.id}
            host.set_var(at.scope, step.save_as, told)
        if status in ("SUCCEEDED", "PENDING"):
            return Done()
        word = status.lower()
        return failed(at, f"request:{view.outcome.code or word}", f"{view.id}: {view.outcome.reason or word}")

    # -- agents of a block -----------------------------------------------------------------------------------------------
    def _with_agents(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.WithAgents)
        if fresh:
            failed_before = [one for key in reversed(at.retries) for one in self.mem[key]["culprits"]]
            without = tuple(dict.fromkeys(failed_before))
            host.set_deadline(at.key, host.want_agents(at.key, step.roles, self._env(at), without))
            return None
        if "agents" not in mem:
            served = host.take_agents(at.key)
            if served is None:
                if not host.is_due(at.key):
                    return None
                host.withdraw_agents(at.key)
                return failed(at, "no_agent", "no fitting agents in time; see the explanation")
            host.clear_deadline(at.key)
            if served.reason:
                return failed(at, "no_agent", served.reason, again=False)
            mem["agents"] = tuple(dict.fromkeys(one for role in step.roles for one in served.roles[role]))
            for name, role in step.roles.items():
                refs = tuple(AgentRef(one) for one in served.roles[name])
                host.set_var(at.scope, name, refs if role.is_list else refs[0])
            for key in at.retries:
                self.mem[key]["had"] = tuple(dict.fromkeys((*self.mem[key]["had"], *mem["agents"])))
            limits = {
                name: role.hand_over_at.run(self._env(at)) for name, role in step.roles.items() if role.hand_over_at
            }
            mem["limits"] = {one: limit for name, limit in limits.items() for one in served.roles[name]}
            mem["stay"] = [
                one for name, role in step.roles.items() if role.if_lost == "fail_block" for one in served.roles[name]
            ]
            mem.update(index=0, ran=False)
        if "result" not in mem and "ends" not in mem:
            lost = next((one for one in mem["stay"] if host.why_gone(one)), "")
            if lost or any(host.is_low(one, limit) for one, limit in mem["limits"].items()):
                self._stop_within(at, mem, lost)
        if "ends" in mem:
            return self._stopped_within(at, mem)
        if "result" not in mem:
            done = self._in_order(self._children(at, mem), mem)
            if done is None:
                return None
            mem["result"] = done
            self._unset(at, *step.roles, always=True)
            self._give_back(at, mem["agents"])
        return mem["result"] if all(host.is_released(one) for one in mem["agents"]) else None

    def _stop_within(self, at: At, mem: dict[str, Any], lost: str) -> None:
        """The block has lost an agent, or one of its agents has come to the charge of its hand-over."""
        assert isinstance(at.step, model.WithAgents)
        mem["lost"] = (lost, self.host.why_gone(lost) if lost else "")
        mem["ends"] = self._halt_child(self._children(at, mem), mem)
        self.moved = True
        for end in mem["ends"]:
            self.host.adopt(end, at.key)
        self.host.unwatch(at.key)
        self._unset(at, *at.step.roles, always=True)
        self._give_back(at, mem["agents"], mem["ends"])

    def _stopped_within(self, at: At, mem: dict[str, Any]) -> Done | None:
        """Once all is over and given back, fail or begin anew."""
        host, ends, (lost, why) = self.host, mem["ends"], mem["lost"]
        assert isinstance(at.step, model.WithAgents)
        if not all(host.is_over(end) for end in ends) or not all(host.is_released(one) for one in mem["agents"]):
            return None
        doubt = [goal for end in ends if isinstance(end, GoalEnd) and (goal := host.goal(end.goal)).state == "in_doubt"]
        for end in ends:
            host.forget(end)
        if doubt:
            reason = "the agent never confirmed the cancel"
            return failed(at, "cancel_unconfirmed", reason, doubt[0].agent, again=False)
        if lost:
            reason = f"{lost} was lost" if why == "lost" else f"{lost} is quarantined: {why}"
            return failed(at, "agent_lost", reason, lost, again=False, other=why == "lost")
        self._unset(at, *at.step.fresh)
        for key in at.retries:
            self.mem[key]["had"] = tuple(one for one in self.mem[key]["had"] if one not in mem["agents"])
        turn = mem.get("turn", 0) + 1
        mem.clear()
        mem["turn"] = turn
        self.moved = True
        return self._with_agents(at, mem, fresh=True)

    def _give_back(self, at: At, agents: Sequence[str], after: Sequence[End] = ()) -> list[End]:
        held = [one for one in agents if not self.host.is_released(one)]
        for one in held:
            self.host.release(one, at.key, tuple(after))
        return [AgentReleased(one) for one in held]

    def _stop_block(self, at: At, mem: dict[str, Any]) -> list[End]:
        assert isinstance(at.step, model.WithAgents)
        if "agents" not in mem:
            return self._give_back(at, self.host.withdraw_agents(at.key))
        goals: list[End] = []
        if "ends" in mem:
            goals = [end for end in mem["ends"] if not self.host.is_over(end)]
            for end in mem["ends"]:
                if end not in goals:
                    self.host.forget(end)
        elif "result" not in mem:
            goals = self._halt_child(self._children(at, mem), mem)
            self._unset(at, *at.step.roles, always=True)
        return goals + self._give_back(at, mem["agents"], goals)

    # -- resources of a block --------------------------------------------------------------------------------------------
    def _with_resource(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.WithResource)
        if fresh:
            wait = 900.0 if step.wait is None else step.wait.run(self._env(at))
            host.want_resources(at.key, step.units)
            host.set_deadline(at.key, host.now + micros(wait))
            return None
        if "index" not in mem:
            refused = host.take_resources(at.key)
            if refused is None:
                if not host.is_due(at.key):
                    return None
                host.withdraw_resources(at.key)
                return failed(at, "resource_timeout", f"{step.said} not free in time; see the explanation")
            host.clear_deadline(at.key)
            if refused:
                return failed(at, "no_resource", refused, again=False)
            mem.update(index=0, ran=False)
        done = self._in_order(self._children(at, mem), mem)
        if done is not None:
            host.free_resources(at.key, (), well=done.failure is None)
        return done

    def _call(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.Call)
        if fresh:
            env = self._env(at)
            values = {name: expr.run(env) for name, expr in step.args.items()}
            host.open_scope(at.path, values)
            for name, param in step.subtree.params.items():
                if name not in values and param.default is not None:
                    host.set_var(at.path, name, param.default.run(host.env(at.path)))
            mem.update(index=0, ran=False)
        done = self._in_order(self._children(at, mem), mem)
        if done is None:
            return None
        try:
            if done.failure is None and step.save_as and step.subtree.returns is not None:
                host.set_var(at.scope, step.save_as, step.subtree.returns.run(host.env(at.path)))
        finally:
            host.close_scope(at.path)
        return done

    # -- leaves --------------------------------------------------------------------------------------------------------
    def _do(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.Do)
        if not fresh and host.goal(mem["goal"]).state == "again":
            host.drop_goal(mem.pop("goal"))
        if "goal" not in mem:
            mem["sent"] = mem.get("sent", 0) + 1
            assert step.who.agent is not None
            agent = step.who.agent.run(self._env(at))
            env = self._env(at, {"agent": agent})
            fields = {name: expr.run(env) for name, expr in step.fields.items()}
            goal_id = host.goal_id(at.path if mem["sent"] == 1 else f"{at.path}+{mem['sent']}")
            tracks = step.track is not None
            refused = host.order(GoalOrder(goal_id, agent.id, step.action, fields, at.key, mem["sent"], tracks))
            if refused is not None:
                return Done(refused)
            mem["goal"] = goal_id
            mem.pop("gives_up", None)
            if step.track is not None:
                mem.update(turned=None, behind=None, why="", every=micros(step.track.every.run(self._env(at))))
                host.clear_deadline(at.key)
                if not host.goal(goal_id).ended:
                    host.set_deadline(at.key, host.now + mem["every"])
        goal = host.goal(mem["goal"])
        if not goal.ended:
            if step.track is None or "gives_up" in mem or not host.is_due(at.key):
                return None
            return self._follow(at, mem, step, goal)
        if goal.state == "canceled" and "gives_up" in mem:
            host.drop_goal(goal.id)
            return Done(mem["gives_up"])
        try:
            return self._end_of(at, step, goal)
        finally:
            host.drop_goal(goal.id)

    def _follow(self, at: At, mem: dict[str, Any], step: model.Do, goal: GoalView) -> Done | None:
        """Compare what the agent was told with what is true now; after 10 s without a new target taken, give up."""
        host, track = self.host, step.track
        assert track is not None
        host.clear_deadline(at.key)
        if goal.state in ("sent", "accepted", "running"):
            if goal.turned_at != mem["turned"]:
                mem.update(turned=goal.turned_at, behind=None, why="")
            try:
                env = self._env(at, {"agent": AgentRef(goal.agent)})
                new = {name: step.fields[name].run(env) for name in track.fields}
                new = {name: value for name, value in new.items() if value != goal.fields[name]}
                ask = host.change_goal(goal.id, new) if new else ""
                why = ask or goal.no_update
            except (model.UnknownState, model.Unset, model.EvalError) as unknown:
                new, why = {"?": unknown}, f"where to cannot be computed ({unknown})"
            mem["behind"] = (host.clock if mem["behind"] is None else mem["behind"]) if new else None
            mem["why"] = why if new else ""
        late = 0 if mem["behind"] is None else host.clock - mem["behind"]
        if late < micros(10.0):
            host.set_deadline(at.key, host.now + min(mem["every"], micros(10.0) - late))
            return None
        reason = f"{goal.agent} took no new target for 10 s" + (f": {mem['why']}" if mem["why"] else "")
        gives_up = failed(at, "no_update", reason, goal.agent, again=goal.repeatable, other=not goal.repeatable).failure
        assert gives_up is not None
        if not host.cancel(goal.id):
            return Done(gives_up)
        mem["gives_up"] = gives_up
        return None

    def _end_of(self, at: At, step: model.Do, goal: GoalView) -> Done:
        again = goal.repeatable
        told = f"{goal.agent}: {step.action} {goal.state}" + (f", {goal.code}" if goal.code else "")
        if goal.state == "succeeded":
            result = dict(goal.result)
            if step.save_as:
                self.host.set_var(at.scope, step.save_as, result)
            if step.expect is not None and not step.expect.run(self._env(at, {"result": result})):
                return failed(at, "expect", f"expected {step.expect.source}", goal.agent)
            return Done()
        if goal.state == "rejected":  # it never began: always worth another try
            code = "goal_expired" if goal.code == "goal_expired" else "rejected"
            return failed(at, code, goal.code or told, goal.agent)
        if goal.state == "gate_refused":
            return failed(at, goal.code, goal.text or told, goal.agent, again=again, other=not again)
        code, reason = {
            "lost": ("agent_lost", "the agent is lost"),
            "taken_over": ("taken_over", "its pilot, or its own failsafe, took over"),
            "in_doubt": (goal.code or "in_doubt", goal.text or "nobody knows how the goal ended"),
        }.get(goal.state, ("", ""))
        if code:
            return failed(at, code, reason, goal.agent, again=False, other=goal.state == "lost")
        code = f"failed:{goal.code or goal.state}"
        return failed(at, code, goal.text or told, goal.agent, again=again, other=not again)

    def _people(self, env: model.Env, who: model.Who) -> tuple[str, ...]:
        if who.site_role or who.agent is None:
            return self.host.people(who.name)
        value = who.agent.run(env)
        return tuple(one.id for one in value) if isinstance(value, tuple) else (value.id,)

    def _ask(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        host, step = self.host, at.step
        assert isinstance(step, model.Ask)
        if fresh:
            env = self._env(at)
            groups = [self._people(env, who) for who in step.of]
            escalate = step.escalate_after.run(env) if step.escalate_after else None
            if escalate is None:
                groups = [tuple(person for group in groups for person in group)]
            tiers: list[tuple[str, ...]] = []
            for group in groups:
                before = [person for tier in tiers for person in tier]
                tiers.append(tuple(dict.fromkeys(p for p in group if p not in before)))
            order = AskOrder(
                id=host.goal_id(at.path),
                text=str(step.question.run(env)),
                note=str(step.note.run(env)) if step.note else "",
                options=step.options,
                tiers=tuple(tiers),
                policy=step.policy,
                escalate_us=None if escalate is None else micros(escalate),
                expires_at=host.deadline(at.bound) if at.bound else None,
                if_no_answer=str(step.if_no_answer.run(env)) if step.if_no_answer else "",
                clears=step.clears.agent.run(env).id if step.clears and step.clears.agent else "",
                clears_on=step.clears_on,
                owner=at.key,
                form=step.form,
            )
            host.ask(order)
            mem["question"] = order.id
        reply = host.question(mem["question"]).reply
        if reply is None:
            return None
        answer = dict(reply)
        if step.save_as:
            host.set_var(at.scope, step.save_as, answer)
        host.close_question(mem.pop("question"))
        if step.expect is not None and not step.expect.run(self._env(at, {"result": answer})):
            return failed(at, "expect", f"answered {answer['answer']}")
        return Done()

    def _break_if(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.BreakIf)
        return Done(leaves=bool(at.step.cond.run(self._env(at))))

    def _release(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Release)
        if fresh:
            assert at.step.who.agent is not None
            mem["agent"] = at.step.who.agent.run(self._env(at)).id
            self.host.release(mem["agent"], at.key)
        return Done() if self.host.is_released(mem["agent"]) else None

    def _wait(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Wait)
        if fresh:
            after = micros(at.step.duration.run(self._env(at)))
            if after <= 0:
                return Done()
            self.host.set_deadline(at.key, self.host.now + after)
        return Done() if self.host.is_due(at.key) else None

    def _check(self, at: At, mem: dict[str, Any], fresh: bool) -> Done:
        step, env = at.step, self._env(at)
        assert isinstance(step, model.Check)
        if step.cond.run(env):
            return Done()
        return failed(at, "check", str(step.message.run(env)) if step.message else f"{step.cond.source} is false")

    def _set(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Set)
        env = self._env(at)
        for name, value in [(name, expr.run(env)) for name, expr in at.step.assign.items()]:
            self.host.set_var(at.scope, name, value)
        return Done()

    def _notify(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        step, env = at.step, self._env(at)
        assert isinstance(step, model.Notify)
        try:
            text = str(step.text.run(env))
        except model.UnknownState as unknown:
            text = f"{step.text.source} ({unknown.key} is not known)"
        to = [person for who in step.to for person in self._people(env, who)] or list(self.host.people("watchers"))
        self.host.notify(text, tuple(dict.fromkeys(to)), step.severity, at.path)
        return Done()

    def _fail(self, at: At, mem: dict[str, Any], fresh: bool) -> Done | None:
        assert isinstance(at.step, model.Fail)
        code = f"failed:{at.step.code}" if at.step.code else "failed"
        env = self._env(at)
        data = {name: value.run(env) for name, value in at.step.data.items()}
        return Done(Failure(code=code, reason=str(at.step.message.run(env)), step=at.path, data=data))


def skipped_before(at: At) -> Failure:
    return Failure(code="nothing_applied", reason="every child before was skipped", step=at.path)


def failed(at: At, code: str, reason: str, agent: str = "", *, again: bool = True, other: bool = False) -> Done:
    return Done(Failure(code=code, reason=reason, step=at.path, agent=agent, retryable=again, by_another=other))
