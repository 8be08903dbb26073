"""Leaves: do, ask, wait, check, set, notify, fail.

Each reads its expressions once, just before acting. A field of an agent that is not known yet fails the step with
`unknown_state`; a value that cannot be computed (division by zero, ...) ends the task `cannot_compute`.
"""

from typing import Any, ClassVar, TypeVar

from py_trees.common import Status

from formiga_bt.base.clock import Micros, micros
from formiga_bt.lang import model
from formiga_bt.lang.model import UnknownState
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.base import RUNNING, SUCCESS, Node
from formiga_bt.nodes.ends import End, GoalEnd
from formiga_bt.nodes.memory import AskMem, DoMem, Mem, WaitMem
from formiga_bt.nodes.run import AgentsRun, AskOrder, Failure, GoalOrder, GoalRun, GoalView, PeopleRun, Run, StepRun

S = TypeVar("S", bound=model.Step)


class Leaf(Node):
    """Common part of leaves."""

    def on_enter(self, run: Run) -> Status:
        """Act."""
        return self.act(run)

    def act(self, run: Run) -> Status:
        """Do what the kind does at its start."""
        raise NotImplementedError

    def env(self, run: StepRun, extra: dict[str, Any] | None = None) -> model.Env:
        """Return what the expressions of this leaf may read."""
        return run.env(self.scope, self.error_here(), extra)


class DoNode(Leaf):
    """`do`: send a goal, wait for its result."""

    kind: ClassVar[str] = "do"

    def __init__(self, step: model.Do) -> None:
        super().__init__(step.title, step)
        self.step = step
        self.goal = ""
        self.sent = 0

    def act(self, run: GoalRun) -> Status:
        """Evaluate the fields and order the goal."""
        self.sent = 0
        return self._send(run)

    def _send(self, run: GoalRun) -> Status:
        self.goal = ""
        self.sent += 1
        assert self.step.who.agent is not None
        agent: AgentRef = self.step.who.agent.run(self.env(run))
        env = self.env(run, {"agent": agent})
        fields = {name: expr.run(env) for name, expr in self.step.fields.items()}
        goal = run.goal_id(self.path if self.sent == 1 else f"{self.path}+{self.sent}")
        self.remember(run, self.memo(goal))
        tracks = self.step.track is not None
        refused = run.order(GoalOrder(goal, agent.id, self.step.action, fields, self.key, self.sent, tracks))
        if refused is not None:
            self.failure = refused
            return Status.FAILURE
        self.goal = goal
        return self.on_proceed(run)

    def memo(self, goal: str) -> DoMem:
        """Return the memory while a goal runs."""
        return DoMem(goal, self.sent)

    def on_proceed(self, run: GoalRun) -> Status:
        """Look at the goal; map its end to a status. One that a person continues is sent anew, under another id."""
        view = run.goal(self.goal)
        if view.state == "again":
            run.drop_goal(self.goal)
            return self._send(run)
        if not view.ended:
            self.feedback_message = view.state if not view.code else f"{view.state}({view.code})"
            return RUNNING
        try:
            return self.conclude(run, view)
        finally:  # also when `expect` cannot be computed
            run.drop_goal(self.goal)

    def is_quiet(self, run: GoalRun) -> bool:
        """Return whether the goal goes on."""
        if not self.goal:
            return False  # it is just being ordered
        view = run.goal(self.goal)
        if view.ended or view.state == "again":
            return False
        self.feedback_message = view.state if not view.code else f"{view.state}({view.code})"
        return True

    def conclude(self, run: GoalRun, view: GoalView) -> Status:
        """Map a goal's end to a status: the one place where results become statuses."""
        again = view.repeatable
        match view.state:
            case "succeeded":
                return self._succeeded(run, view)
            case "rejected":
                return self._fail(view, view.code if view.code == "goal_expired" else "rejected", view.code, again=True)
            case "failed" | "superseded" | "canceled":
                failed = f"failed:{view.code or view.state}"
                return self._fail(view, failed, view.text, again=again, by_another=not again)
            case "gate_refused":
                return self._fail(view, view.code, view.text, again=again, by_another=not again)
            case "lost":
                return self._fail(view, "agent_lost", "the agent is lost", again=False, by_another=True)
            case "taken_over":
                return self._fail(view, "taken_over", "its pilot, or its own failsafe, took over", again=False)
            case "in_doubt":
                return self._fail(
                    view, view.code or "in_doubt", view.text or "nobody knows how the goal ended", again=False
                )
            case _:
                raise AssertionError(f"goal ended as {view.state}")

    def _fail(self, view: GoalView, code: str, reason: str, *, again: bool, by_another: bool = False) -> Status:
        reason = reason or f"{view.agent}: {self.step.action} {view.state}" + (f", {view.code}" if view.code else "")
        return self.fail(code, reason, view.agent, retryable=again, by_another=by_another)

    def _succeeded(self, run: GoalRun, view: GoalView) -> Status:
        result = dict(view.result)
        if self.step.save_as:
            run.set_var(self.scope, self.step.save_as, result)
        if self.step.expect is not None and not self.step.expect.run(self.env(run, {"result": result})):
            return self.fail("expect", f"expected {self.step.expect.source}", view.agent)
        return SUCCESS

    def on_halt(self, run: GoalRun) -> list[End]:
        """Cancel the goal."""
        return [GoalEnd(self.goal)] if self.goal and run.cancel(self.goal) else []

    def on_restore(self, run: GoalRun, mem: Mem) -> None:  # noqa: ARG002
        """Wait for the same goal."""
        assert isinstance(mem, DoMem)
        self.goal, self.sent = mem.goal, mem.sent


class AskNode(Leaf):
    """`ask`: a question to people; every answer is success unless `expect` says otherwise."""

    kind: ClassVar[str] = "ask"

    def __init__(self, step: model.Ask) -> None:
        super().__init__(step.title, step)
        self.step = step
        self.question = ""

    def act(self, run: PeopleRun) -> Status:
        """Open the question."""
        step, env = self.step, self.env(run)
        people = [self._people(run, env, who) for who in step.of]
        escalate = step.escalate_after.run(env) if step.escalate_after else None
        tiers = people if escalate is not None else [tuple(p for group in people for p in group)]
        seen: set[str] = set()
        order = AskOrder(
            id=run.goal_id(self.path),
            text=str(step.question.run(env)),
            note=str(step.note.run(env)) if step.note else "",
            options=step.options,
            tiers=tuple(tuple(p for p in tier if not (p in seen or seen.add(p))) for tier in tiers),  # type: ignore[func-returns-value]
            policy=step.policy,
            escalate_us=None if escalate is None else micros(escalate),
            expires_at=self._expires(run),
            if_no_answer=str(step.if_no_answer.run(env)) if step.if_no_answer else "",
            clears=step.clears.agent.run(env).id if step.clears and step.clears.agent else "",
            clears_on=step.clears_on,
            owner=self.key,
            form=step.form,
        )
        self.question = order.id
        self.remember(run, AskMem(order.id))
        run.ask(order)
        return RUNNING

    def _expires(self, run: PeopleRun) -> Micros | None:
        """Return when the whole step's timeout ends; it counts from the step's start, earlier attempts included."""
        start = self.path.rpartition("@")[0] if self.step.retry else self.path
        return run.deadline(f"{start}:timeout")

    @staticmethod
    def _people(run: PeopleRun, env: model.Env, who: model.Who) -> tuple[str, ...]:
        if who.site_role or who.agent is None:
            return run.people(who.name)
        value = who.agent.run(env)
        return tuple(ref.id for ref in value) if isinstance(value, tuple) else (value.id,)

    def on_proceed(self, run: PeopleRun) -> Status:
        """Look whether it is answered."""
        reply = run.question(self.question).reply
        if reply is None:
            return RUNNING
        answer = dict(reply)
        if self.step.save_as:
            run.set_var(self.scope, self.step.save_as, answer)
        run.close_question(self.question)
        if self.step.expect is not None and not self.step.expect.run(self.env(run, {"result": answer})):
            return self.fail("expect", f"answered {answer['answer']}")
        return SUCCESS

    def is_quiet(self, run: PeopleRun) -> bool:
        """Return whether there is no answer yet."""
        return bool(self.question) and run.question(self.question).reply is None

    def on_halt(self, run: PeopleRun) -> list[End]:
        """Withdraw the question: local, nothing to wait for."""
        if self.question:
            run.close_question(self.question)
        return []

    def on_restore(self, run: PeopleRun, mem: Mem) -> None:  # noqa: ARG002
        """Wait for the same answer."""
        assert isinstance(mem, AskMem)
        self.question = mem.ask


class WaitNode(Leaf):
    """`wait`: a duration."""

    times: ClassVar[bool] = True
    kind: ClassVar[str] = "wait"

    def __init__(self, step: model.Wait) -> None:
        super().__init__(step.title, step)
        self.step = step

    def act(self, run: StepRun) -> Status:
        """Set the deadline; a wait of zero succeeds at once."""
        duration = self.step.duration
        after = micros(duration.const if duration.is_const else duration.run(self.env(run)))
        if after <= 0:
            return SUCCESS
        self.remember(run, WaitMem(run.now))
        run.set_deadline(self.key, run.now + after)
        return RUNNING

    def on_proceed(self, run: StepRun) -> Status:
        """Succeed once the deadline fired."""
        return SUCCESS if run.is_due(self.key) else RUNNING

    def is_quiet(self, run: StepRun) -> bool:
        """Return whether the deadline has not fired."""
        return not run.is_due(self.path)


class ReleaseNode(Leaf):
    """`release`: done when the task no longer holds the agent."""

    kind: ClassVar[str] = "release"

    def __init__(self, step: model.Release) -> None:
        super().__init__(step.title, step)
        self.step = step

    def act(self, run: AgentsRun) -> Status:
        """Ask for the release."""
        assert self.step.who.agent is not None
        self.agent = self.step.who.agent.run(self.env(run)).id
        self.remember(run, DoMem(self.agent))
        run.release(self.agent, self.key)
        return self.on_proceed(run)

    def on_proceed(self, run: AgentsRun) -> Status:
        """Look whether it is done."""
        return SUCCESS if run.is_released(self.agent) else RUNNING

    def is_quiet(self, run: AgentsRun) -> bool:
        """Return whether the agent is still held."""
        return not run.is_released(self.agent)

    def on_restore(self, run: AgentsRun, mem: Mem) -> None:  # noqa: ARG002
        """Wait for the same agent."""
        assert isinstance(mem, DoMem)
        self.agent = mem.goal


class InstantNode(Leaf):
    """`check`, `set`, `notify` and `fail`: done the moment they start."""

    def __init__(self, step: model.Step) -> None:
        super().__init__(step.title, step)


def check_failure(step: model.Check, env: model.Env, path: str) -> Failure:
    """Return the failure of a check that is false."""
    return Failure("check", str(step.message.run(env)) if step.message else f"{step.cond.source} is false", path)


class CheckNode(InstantNode):
    """`check`."""

    kind: ClassVar[str] = "check"
    step_model: model.Check

    def act(self, run: StepRun) -> Status:
        """Read the condition."""
        env = self.env(run)
        if self.step_model.cond.run(env):
            return SUCCESS
        self.failure = check_failure(self.step_model, env, self.path)
        return Status.FAILURE


class SetNode(InstantNode):
    """`set`: all values are read before any is assigned."""

    kind: ClassVar[str] = "set"
    step_model: model.Set

    def act(self, run: StepRun) -> Status:
        """Assign."""
        env = self.env(run)
        values = {name: expr.run(env) for name, expr in self.step_model.assign.items()}
        for name, value in values.items():
            run.set_var(self.scope, name, value)
        return SUCCESS


class NotifyNode(InstantNode):
    """`notify`: it never fails, also when its text cannot be made."""

    kind: ClassVar[str] = "notify"
    step_model: model.Notify

    def act(self, run: PeopleRun) -> Status:
        """Tell."""
        step, env = self.step_model, self.env(run)
        try:
            text = str(step.text.run(env))
        except UnknownState as unknown:
            text = f"{step.text.source} ({unknown.key} is not known)"
        to = [p for who in step.to for p in AskNode._people(run, env, who)] or list(run.people("watchers"))
        run.notify(text, tuple(dict.fromkeys(to)), step.severity, self.path)
        return SUCCESS


class FailNode(InstantNode):
    """`fail`."""

    kind: ClassVar[str] = "fail"
    step_model: model.Fail

    def act(self, run: StepRun) -> Status:
        """Fail."""
        step = self.step_model
        env = self.env(run)
        code = f"failed:{step.code}" if step.code else "failed"
        data = {name: value.run(env) for name, value in step.data.items()}
        return self.fail_as(Failure(code, str(step.message.run(env)), self.path, data=data))
