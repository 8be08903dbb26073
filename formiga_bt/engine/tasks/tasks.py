"""The life of a task, from request to terminal status.

    PENDING -> ASSIGNED -> ACTIVE -> ENDING -> SUCCEEDED | FAILED | CANCELED          (HELD is a flag beside it)

The parts run in this order, each after the goals of the former have drained; an empty part is passed over:

| part | after it |
|---|---|
| steps | on_failure (a step failed, timeout, exception, no clearance), on_abort (operator), else finally |
| on_failure, on_abort | finally |
| finally | recover: every machine that may be airborne is brought home |
| recover | done: release, terminal status |
"""

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.allocator.preemption import may_rebind
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import LockdownHold, kind_and_agent, waits_for_word
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.holds import unhold
from formiga_bt.engine.kernel.inputs import Abort, PublishState
from formiga_bt.engine.kernel.news import CarriedOut, Leaves, StepsStopped, TaskEnds
from formiga_bt.engine.kernel.records import (
    Again,
    AgentRequest,
    TaskClock,
    TaskEvents,
    TaskHold,
    TaskRecord,
    TaskResources,
    TaskRestart,
    TaskTimes,
)
from formiga_bt.engine.kernel.timers import TaskDue
from formiga_bt.engine.tasks import claims
from formiga_bt.engine.tasks.children import Children
from formiga_bt.engine.tasks.recovery import Recovery
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.engine.tasks.taskmodel import duration_us, root_values, section_steps
from formiga_bt.engine.tasks.treerun import Ended
from formiga_bt.lang.model import Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.draining import move_on
from formiga_bt.nodes.run import Failure, Served, TaskOutcome

CLEANUP_US = 300 * SECOND
"""Default of cleanup_timeout."""
KEPT_ENDED = 10_000
"""So many ended tasks are kept in memory with their outcomes and explanations; the journal has all of them."""

AFTER: Final[Mapping[str, str]] = {"on_failure": "finally", "on_abort": "finally", "finally": "recover"}
SECTION_AFTER_STEPS: Final[Mapping[str, str]] = {"SUCCEEDED": "finally", "FAILED": "on_failure", "CANCELED": "on_abort"}


class Tasks:
    """All tasks that are not yet ended, and the records of those that are."""

    def __init__(
        self,
        core: Core,
        goals: Goals,
        people: People,
        fleet: Fleet,
        requests: Requests,
        runs: Runs,
        children: Children,
        recovery: Recovery,
    ) -> None:
        self._core = core
        self._goals = goals
        self._people = people
        self._fleet = fleet
        self._requests = requests
        self._runs = runs
        self._children = children
        self._recovery = recovery

    # -- grants --------------------------------------------------------------------------------------------------
    def granted(self, task_id: str, roles: dict[str, tuple[str, ...]], lists: frozenset[str]) -> None:
        """The allocator gave the agents: bind the roles and start the steps."""
        core = self._core
        model = core.model(core.task(task_id))
        for role, agents in roles.items():
            refs = tuple(AgentRef(a) for a in agents)
            core.emit(ch.VarPut(task_id, "", role, refs if role in lists else refs[0]))
        machines = tuple(dict.fromkeys(a for group in roles.values() for a in group))
        for agent in machines:
            self._fleet.trust_again(agent)
        core.clear_deadline(TaskDue(task_id, "wait"))
        task = core.task(task_id)
        had = replace(task.agents, roles=roles, granted=machines)
        times = replace(task.times, assigned_at=core.now)
        core.put_task(task_id, status="ASSIGNED", agents=had, times=times)
        core.put_task(task_id, status="ACTIVE", section="steps", times=replace(times, active_at=core.now))
        self._runs.start(task_id, "steps", model.steps)
        if model.timeout is not None:
            after = duration_us(model.timeout, self._runs.of(task_id).env(""))
            if isinstance(after, str):
                self.fail(task_id, "cannot_compute", f"timeout: {after}")
            else:
                core.set_deadline(TaskDue(task_id, "timeout"), core.now + after, task_id, pausable=True)

    def granted_more(self, request: AgentRequest, roles: dict[str, tuple[str, ...]]) -> None:
        """The allocator gave the agents that a block of a running task asked for: its node takes them."""
        core = self._core
        task = core.task(request.holder)
        held = {
            **task.agents.roles,
            **{role: (*task.agents.roles.get(role, ()), *agents) for role, agents in roles.items()},
        }
        granted = tuple(dict.fromkeys((*task.agents.granted, *(agent for group in roles.values() for agent in group))))
        anew = {agent for group in roles.values() for agent in group}
        for agent in dict.fromkeys(agent for group in roles.values() for agent in group):
            self._fleet.trust_again(agent)
        recovering = tuple(replace(r, first=r.attempt + 1) if r.agent in anew else r for r in task.agents.recovering)
        rebinds = [agent for role in request.roles if role.rebind for agent in roles[role.role]]
        rebinds += [agent for agent in task.agents.rebinds if not any(agent in agents for agents in roles.values())]
        core.put_part(
            task.id,
            "agents",
            roles=held,
            granted=granted,
            rebinds=tuple(rebinds),
            recovering=recovering,
            served={**task.agents.served, request.node: Served(roles)},
        )

    def refuse_request(self, request: AgentRequest, reason: str) -> None:
        """No agent could ever serve a request: its task ends, or its node fails."""
        core = self._core
        if not request.node:
            self.refuse(request.task, "no_agent", reason)
            return
        core.emit(ch.RequestPut(request.task, None))
        task = core.task(request.holder)
        core.put_part(task.id, "agents", served={**task.agents.served, request.node: Served({}, reason)})
        core.wake(task.id, request.node)

    # -- one step --------------------------------------------------------------------------------------------------
    def settle(self, task_id: str) -> None:
        """Run a task's trees until they are quiet, follow ended sections and drained goals to the next part."""
        core = self._core
        self._runs.close_left()
        task = core.state.tasks.get(task_id)
        if task is None or task.section in ("", "done"):
            core.woken.pop(task_id, None)
            return
        run = self._runs.of(task_id)
        if task.ending.cleanups:
            run.cleanups.proceed()
        for key in core.woken.pop(task_id, ()):
            run.trees.wake(key)
        core.running, core.wake_now = task_id, run.trees.wake
        try:
            sections = run.trees.run_passes()
        finally:
            core.running, core.wake_now = "", None
        for ended in sections:
            self._section_ended(task_id, ended)
        task = core.task(task_id)
        if task.resources.claims:
            claims.go_on(core, task_id)
        if task.agents.releasing:
            self._recovery.releases(task_id)
        if task.agents.releasing or task.ending.stopping or sections:
            self._drain(task_id)

    def _section_ended(self, task_id: str, ended: Ended) -> None:
        core = self._core
        task = core.task(task_id)
        if (cleanup := task.cleanup(ended.section)) is not None:
            self._runs.of(task_id).cleanups.on_ended(cleanup, ended)
        elif (home := next((one for one in task.agents.recovering if one.section == ended.section), None)) is not None:
            if ended.fatal:
                self._runs.stop(task_id, ended.section)
            self._recovery.ended(task_id, home, ended)
        elif ended.section != task.section or task.ending.stopping:
            return
        elif ended.fatal and ended.failure is not None:
            self.fail(task_id, ended.failure.code, ended.failure.reason, ended.failure)
        elif task.section == "steps":
            if ended.failure is None:
                self._decide(task_id, "SUCCEEDED")
            else:
                self._decide(task_id, "FAILED", ended.failure.code, ended.failure.reason, ended.failure)
            self._next(task_id)
        else:
            if ended.failure is not None:
                self._note(task_id, f"{task.section}: {ended.failure.code} {ended.failure.reason}".strip())
            self._next(task_id)

    def _decide(
        self, task_id: str, outcome: str, code: str = "", reason: str = "", failure: Failure | None = None
    ) -> None:
        if not self._core.task(task_id).outcome.status:
            self._core.put_part(task_id, "outcome", status=outcome, code=code, reason=reason, failure=failure)

    # -- beginning anew ------------------------------------------------------------------------------------------
    def restart(self, task_id: str, why: Again, reason: str = "") -> None:
        """End a task in order and begin it anew: on_abort, finally, recover, release, then PENDING again with run + 1.

        One that is preempted and says `if_preempted: fail` just ends.
        """
        core = self._core
        task = core.task(task_id)
        anew = why != "preempted" or core.model(task).if_preempted == "restart"
        core.put_task(
            task_id,
            restart=replace(task.restart, why=why if anew else ""),
            ending=replace(task.ending, abort_reason=why),
        )
        self._decide(task_id, "CANCELED", "restarted" if why == "restart" else why, reason)
        if not core.task(task_id).ending.stopping:
            self._runs.stop(task_id, "steps")
        core.report(StepsStopped(task_id))

    def _begin_anew(self, task_id: str) -> None:
        core = self._core
        task = core.task(task_id)
        core.emit(ch.TaskForget(task_id))
        self._runs.leave(task_id)
        locked = core.state.lockdown is not None
        why = f"run {task.run}: {task.restart.why} {task.outcome.reason}".rstrip()
        fresh = TaskRecord(
            id=task.id,
            name=task.name,
            order=task.order,
            run=task.run + 1,
            request=task.request,
            family=replace(task.family, children=()),
            hold=TaskHold(
                causes=(LockdownHold(),) if locked else (), clock=TaskClock(stands_since=core.now if locked else None)
            ),
            events=TaskEvents(since=core.state.counters.get("agent_event", 0)),
            outcome=TaskOutcome(notes=task.outcome.notes),
            restart=TaskRestart(past=(*task.restart.past, why), taken_back=task.restart.taken_back),
            times=TaskTimes(submitted_at=task.times.submitted_at),
        )
        core.emit(ch.TaskPut(fresh))
        core.effect(PublishState(task_id, fresh.status))
        try:
            values = root_values(core, core.model(fresh), fresh)
            wish = self._requests.request(fresh, values)
        except TaskError as error:
            self.refuse(task_id, error.code, str(error))
            return
        core.emit(ch.ScopePut(task_id, "", values))
        self._requests.enqueue(wish)

    def _note(self, task_id: str, text: str) -> None:
        self._core.put_part(task_id, "outcome", notes=(*self._core.task(task_id).outcome.notes, text))

    # -- stopping --------------------------------------------------------------------------------------------------
    def _drain(self, task_id: str) -> None:
        core = self._core
        task = core.task(task_id)
        if not task.ending.stopping:
            return
        left = move_on(self._runs.of(task_id), task.ending.drain)
        if len(left) != len(task.ending.drain):
            core.put_part(task_id, "ending", drain=tuple(left))
        if left:
            return
        core.put_part(task_id, "ending", stopping=False)
        if task.section == "recover":
            self._recovery.proceed(task_id)
        else:
            self._next(task_id)

    def fail(self, task_id: str, code: str, reason: str, failure: Failure | None = None) -> None:
        """End a task by something that no step can catch: its timeout, an exception, a refused clearance."""
        core = self._core
        task = core.task(task_id)
        breach = code.startswith("envelope.")
        if breach:
            self._runs.of(task_id).cleanups.cut()
        if task.section == "steps" and not task.ending.stopping:
            self._decide(task_id, "FAILED", code, reason, failure or Failure(code, reason, retryable=False))
            self._runs.stop(task_id, "steps", cleanup=not breach)
        elif task.section in AFTER and not task.ending.stopping:
            self._note(task_id, f"{task.section}: {code} {reason}")
            self._runs.stop(task_id, task.section, cleanup=not breach)

    def abort(self, order: Abort) -> str:
        """End a task on a person's word; return an error text, or "".

        `already_ending` answers an abort of a task whose cleanup, recover or end is under way.
        """
        core = self._core
        task = core.state.tasks.get(order.task)
        if task is None:
            raise TaskError("unknown_task", f"there is no task '{order.task}'")
        if task.section == "done" or task.status in ("SUCCEEDED", "FAILED", "CANCELED"):
            raise TaskError("already_ended", f"{order.task} has ended: {task.status}")
        if task.restart.why:  # it was being ended to begin anew: now it just ends
            reason = f"by {order.by or 'an operator'}"
            task = core.put_task(
                task.id,
                restart=replace(task.restart, why=""),
                outcome=replace(task.outcome, code="aborted", reason=reason),
            )
            if not order.how:
                return ""
        if task.system.stop:
            return self._abort_order(task, order)
        if order.how == "abandon":
            return self._abandon(task, order)
        if task.status == "PENDING":
            self._decide(task.id, "CANCELED", "aborted", f"by {order.by or 'an operator'}")
            self.end(task.id)
            return ""
        if order.how == "now" and task.section != "recover":
            core.put_part(task.id, "ending", abort_now=True)
            self._runs.of(task.id).cleanups.cut()
        elif task.section in ("on_abort", "finally", "recover"):
            if any(waits_for_word(cause) for cause in task.hold.causes):
                core.report(TaskEnds(task.id))  # it ends already, but somebody had stopped that
                return ""
            raise TaskError("already_ending", f"{order.task} is already ending")
        self._decide(task.id, "CANCELED", "aborted", f"by {order.by or 'an operator'}")
        core.put_part(task.id, "ending", abort_reason=order.reason)
        core.report(TaskEnds(task.id))
        if not task.ending.stopping and task.section != "recover":
            self._runs.stop(task.id, task.section)
        core.report(StepsStopped(task.id))
        if order.how == "now":
            self._children.hurry(task.id)
        return ""

    def _abort_order(self, task: TaskRecord, order: Abort) -> str:
        """A system task that carries out an order: its machine must not hover with nobody's word."""
        agent_id = task.system.agent
        if order.how != "abandon":
            text = f"{task.id} carries out an order on {agent_id}; give that machine another order, or continue it"
            raise TaskError("system_task", text)
        self._goals.lose(agent_id, "in_doubt", "it was abandoned")
        self._core.report(Leaves(agent_id))
        self._fleet.quarantine(agent_id, "abandoned")
        return ""

    def _abandon(self, task: TaskRecord, order: Abort) -> str:
        core = self._core
        self._decide(task.id, "CANCELED", "aborted", f"abandoned by {order.by or 'an operator'}")
        core.put_part(task.id, "ending", abort_now=True, abort_reason="abandoned")
        self._runs.of(task.id).cleanups.cut()
        for section in self._sections(task):
            self._runs.stop(task.id, section)
        for agent_id in task.agents.granted:
            agent = core.state.agents[agent_id]
            if agent.task == task.id and not agent.human:
                self._goals.lose(agent_id, "in_doubt", "it was abandoned")
                self._fleet.quarantine(agent_id, "abandoned")
        if task.section == "":
            self.end(task.id)
        return ""

    def _sections(self, task: TaskRecord) -> list[str]:
        if task.section == "recover":
            return [r.section for r in task.agents.recovering if r.state == "running"]
        return [task.section] if task.section else []

    def on_agent_left(self, task_id: str, agent_id: str) -> None:
        """A machine of the task was quarantined: the task no longer holds it."""
        core = self._core
        task = core.task(task_id)
        if may_rebind(core, task, agent_id):
            self.restart(task_id, "agent_lost", f"{agent_id} was lost")
            task = core.task(task_id)
        roles = {role: tuple(a for a in agents if a != agent_id) for role, agents in task.agents.roles.items()}
        core.put_part(task_id, "agents", roles=roles)
        if agent_id in task.agents.releasing:
            core.wake(task_id, task.agents.releasing[agent_id].owner)
        for cause in task.hold.causes:
            if kind_and_agent(cause)[1] == agent_id:
                unhold(core, task_id, cause)
        if task.section == "recover":
            self._recovery.agent_left(task_id, agent_id)
        core.touch(task_id)

    # -- from part to part -----------------------------------------------------------------------------------------
    def _next(self, task_id: str) -> None:
        task = self._core.task(task_id)
        if task.section == "steps" and (waited := self._children.end_all(task_id)):
            self._core.put_part(task_id, "ending", stopping=True, drain=(*task.ending.drain, *waited))
            return  # what it leaves open ends first
        if task.ending.abort_now:
            self._enter(task_id, "recover")
        elif task.section == "steps":
            self._enter(task_id, SECTION_AFTER_STEPS[task.outcome.status])
        else:
            self._enter(task_id, AFTER[task.section])

    def _enter(self, task_id: str, section: str) -> None:
        """Go to a part of a task; an empty one is passed over."""
        core = self._core
        task = core.task(task_id)
        model = core.library.of(task)
        if task.status != "ENDING":
            core.clear_deadline(TaskDue(task_id, "timeout"))
            task = core.put_task(task_id, status="ENDING")
            if model is not None and any((model.on_failure, model.on_abort, model.finally_)):
                after = self._cleanup_us(task_id, model)
                core.set_deadline(TaskDue(task_id, "cleanup"), core.now + after, task_id, pausable=True)
        if section == "recover":
            self._recovery.enter(task_id)
            return
        core.put_task(task_id, section=section)
        steps = section_steps(model, section)
        if not steps:
            self._next(task_id)
            return
        self._runs.start(task_id, section, steps)

    def _cleanup_us(self, task_id: str, model: Task) -> Micros:
        if model.cleanup_timeout is None:
            return CLEANUP_US
        after = duration_us(model.cleanup_timeout, self._runs.of(task_id).env(""))
        if isinstance(after, str):
            self._note(task_id, f"cleanup_timeout: {after}")
            return CLEANUP_US
        return after

    def on_deadline(self, due: TaskDue) -> None:
        """Handle a task's own deadlines."""
        core, task_id = self._core, due.task
        task = core.task(task_id)
        if due.what == "timeout":
            self.fail(task_id, "timeout", "the task's timeout is over")
        elif due.what == "cleanup" and task.section in AFTER:
            self._note(task_id, f"{task.section}: cleanup_timeout is over")
            core.put_part(task_id, "ending", abort_now=True)
            self._runs.of(task_id).cleanups.cut()
            if not task.ending.stopping:
                self._runs.stop(task_id, task.section)
        elif due.what in ("wait", "expires") and task.status == "PENDING":
            code = "no_agent" if due.what == "wait" else "task_expired"
            self._decide(task_id, "FAILED", code, "no fitting agents in time; see the explanation")
            self.end(task_id)

    def refuse(self, task_id: str, code: str, reason: str) -> None:
        """End a waiting task that can never be served."""
        self._decide(task_id, "FAILED", code, reason)
        self.end(task_id)

    def end(self, task_id: str) -> None:
        """Every machine is home, or quarantined: release and end."""
        core = self._core
        run = core.task(task_id).run
        core.report(TaskEnds(task_id, is_over=True))
        task = core.task(task_id)
        if task.section == "done" or task.run != run:
            return  # an order that ended with it was the last that it waited for: it has ended by that
        for agent_id in task.agents.granted:
            if core.state.agents[agent_id].task == task_id:
                self._fleet.release(agent_id)
        for timer in core.index.deadlines_of(task_id):
            core.clear_deadline(timer)
        for question in core.index.questions_of(task_id):
            self._people.close(question)
        core.emit(ch.RequestPut(task_id, None))
        if task.restart.why:
            self._begin_anew(task_id)
            return
        core.put_task(
            task_id,
            status=task.outcome.status,
            section="done",
            times=replace(task.times, ended_at=core.now),
            hold=TaskHold(clock=replace(task.hold.clock, paused=())),
            agents=replace(task.agents, roles={}),
            resources=TaskResources(),
            ending=replace(task.ending, drain=()),
        )
        self._children.ended(core.task(task_id))
        core.emit(ch.TaskForget(task_id))
        self._runs.leave(task_id)
        if task.system.stop:
            core.report(CarriedOut(core.task(task_id)))
        self._forget_oldest()

    def _forget_oldest(self) -> None:
        """Keep the newest ended tasks only; one that an open task requested stays as long as that."""
        core = self._core
        ended = core.index.ended
        if len(ended) <= KEPT_ENDED:
            return
        oldest = next(iter(ended))
        del ended[oldest]
        parent = core.state.tasks.get(core.task(oldest).family.parent)
        if parent is not None and parent.section != "done":
            ended[oldest] = None  # its turn comes again
        else:
            core.emit(ch.TaskGone(oldest))
