"""A person gives agents to tasks, takes them back, and says which of the tasks that wait goes first.

assign: the agent passes every filter of the allocator now, or the order is refused with the filter's code. The request keeps
it, and is granted once all of its roles are filled: one of a single agent in the same step.

unassign: what waits keeps it no more. What runs begins anew, as after a preemption: its machines come home first, and it gets
this one again only by a person's word.

in service: a machine that is taken out ends what it does and comes home; then no task is granted it until it is back. Orders,
its pilot and its way home are no matter of that.

prioritize: a task that waits gets another priority, or the first place in it.

What a person gave is kept from all but more urgent requests, and until its agent is quarantined. Called by the engine with each
such input; a refusal is a TaskError with a code. It keeps nothing itself: all stands in the requests.
"""

from typing import Final, assert_never

from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.allocation import Allocation
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.filters import refusal
from formiga_bt.engine.allocator.preemption import what_is_lost
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Assign, InService, NotifyPeople, Prioritize, Unassign
from formiga_bt.engine.kernel.records import AgentRecord, AgentRequest, RoleRequest, TaskRecord
from formiga_bt.engine.orders.orders import StandingOrders
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.engine.tasks.tasks import Tasks

LOST: Final = {
    "spent": "it has done something that may not be done twice",
    "loaded": "a machine of it carries a load",
    "critical": "it is in a step marked critical",
}
"""Why a task cannot begin anew, by the code of `allocator.preemption`."""


class ByHand:
    """Carries out what persons say of who works for whom."""

    def __init__(
        self, core: Core, tasks: Tasks, orders: StandingOrders, authority: Authority, allocation: Allocation
    ) -> None:
        self._core = core
        self._tasks = tasks
        self._orders = orders
        self._authority = authority
        self._allocation = allocation

    def take(self, given: Assign | Unassign | Prioritize | InService) -> None:
        """Carry out an order.

        Raises:
            TaskError: it cannot be.
        """
        match given:
            case Assign():
                self._assign(given)
            case Unassign():
                self._unassign(given)
            case Prioritize():
                self._prioritize(given)
            case InService():
                self._in_service(given)
            case _:
                assert_never(given)

    def forget(self, agent_id: str) -> None:
        """An agent is quarantined, or out of service: nobody waits for it because of a person's word."""
        for request, role in self._keeping(agent_id):
            self._put(request, replace(role, by_hand=tuple(a for a in role.by_hand if a != agent_id)))
            text = f"{agent_id} was given to {request.holder} by hand; it gets another one"
            self._core.effect(NotifyPeople(text, (), "warning", request.holder))

    # -- give ------------------------------------------------------------------------------------------------------
    def _assign(self, given: Assign) -> None:
        core = self._core
        task, agent = self._open_task(given.task), self._agent(given.agent)
        if agent.task == task.id or any(request.holder == task.id for request, _ in self._keeping(agent.id)):
            return  # said twice
        request, role = self._role_for(task, agent, given.role)
        blocked = self._authority.blocked(request)
        if blocked is not None:
            raise TaskError(blocked[0], f"{task.id} gets nobody now: {blocked[1]}")
        for other, _ in self._keeping(agent.id) if not role.shared else ():
            raise TaskError("busy", f"{agent.id} is kept for {other.holder} by a person's word")
        back = tuple(one for one in task.restart.taken_back if one != agent.id)
        if back != task.restart.taken_back:
            core.put_part(task.id, "restart", taken_back=back)
        roles = tuple(
            replace(one, taken_back=tuple(a for a in one.taken_back if a != agent.id)) for one in request.roles
        )
        request = replace(request, roles=roles)
        role = next(one for one in roles if one.role == role.role)
        self._put(request, replace(role, by_hand=(*role.by_hand, agent.id)))
        self._allocation.look()
        now = core.state.agents[agent.id]
        if now.task not in ("", task.id):  # it was free for a moment, and a more urgent task took it in this look
            self.forget(agent.id)
            raise TaskError("busy", f"{agent.id} is with {now.task}, which is more urgent")

    def _role_for(self, task: TaskRecord, agent: AgentRecord, name: str) -> tuple[AgentRequest, RoleRequest]:
        """Return the one role of what a task waits for that takes an agent.

        Raises:
            TaskError: none does, and why; or several do.
        """
        state = self._core.state
        waiting = [(r, role) for r in state.requests.values() if r.holder == task.id for role in r.roles]
        if not waiting:
            has = ", ".join(a for agents in task.agents.roles.values() for a in agents) or "none"
            raise TaskError("needs_nobody", f"{task.id} waits for no agents (it has {has})")
        if name and all(role.role != name for _, role in waiting):
            known = [role.role for _, role in waiting]
            raise TaskError(
                "unknown_role", f"{task.id} waits for {', '.join(known)}, and for no '{name}'", near=tuple(known)
            )
        asked = [(r, role) for r, role in waiting if not name or role.role == name]
        suits = [(r, role) for r, role in asked if agent.type in role.types] or asked
        candidate = self._allocation.candidate(agent.id)
        looked = [(r, role, self._why_not(candidate, role)) for r, role in suits]
        fits = [(r, role) for r, role, why in looked if why is None]
        if not fits:
            _, role, why = looked[0]
            assert why is not None
            said = why[0].replace("_", " ") + (f": {why[1]}" if why[1] else "")
            raise TaskError(why[0], f"{agent.id} cannot be '{role.role}' of {task.id}: {said}")
        if len(fits) > 1:
            names = ", ".join(role.role for _, role in fits)
            raise TaskError("which_role", f"{agent.id} could be any of {names} of {task.id}: say which")
        return fits[0]

    @staticmethod
    def _why_not(candidate: Candidate, role: RoleRequest) -> tuple[str, str] | None:
        """Return (code, detail) of the filter that refuses an agent that a person names, or None."""
        if role.is_full_by_hand:
            return "by_hand", ", ".join(role.by_hand)
        return refusal(candidate, replace(role, taken_back=()))

    # -- take back ---------------------------------------------------------------------------------------------------
    def _unassign(self, given: Unassign) -> None:
        core = self._core
        agent = self._agent(given.agent)
        kept = self._keeping(agent.id)
        if not agent.task:
            if not kept:
                raise TaskError("not_assigned", f"{agent.id} has no task, and is kept for none")
            for request, role in kept:
                self._put(request, replace(role, by_hand=tuple(a for a in role.by_hand if a != agent.id)))
            return
        task = core.task(agent.task)
        self._check_can_begin_anew(task, agent)
        core.put_part(task.id, "restart", taken_back=tuple(dict.fromkeys((*task.restart.taken_back, agent.id))))
        self._orders.ended_by_word(task.id)
        self._tasks.restart(task.id, "restart", f"{agent.id} was taken back by {given.by or 'an operator'}")

    def _check_can_begin_anew(self, task: TaskRecord, agent: AgentRecord) -> None:
        core = self._core
        if task.system.agent:
            raise TaskError("system_task", f"{task.id} is the engine's own, it brings {agent.id} home")
        if task.section != "steps" or task.ending.stopping:
            raise TaskError("already_ending", f"{task.id} is already ending, and gives {agent.id} back")
        if core.state.lockdown is not None:
            raise TaskError("lockdown", "lockdown is on; formiga lockdown release comes first")
        for machine in self._orders.machines_of(task):
            if machine.taken or machine.control != "engine":
                raise TaskError(*(self._orders.refusal(machine, "") or ("not_in_command", "")))
        lost = what_is_lost(core, task)
        if lost:
            raise TaskError(
                "cannot_begin_anew", f"{task.id} would begin anew without {agent.id}, and cannot: {LOST[lost]}"
            )

    # -- what goes first ---------------------------------------------------------------------------------------------
    def _prioritize(self, given: Prioritize) -> None:
        core = self._core
        task = self._open_task(given.task)
        request = core.state.requests.get(task.id)
        if request is None:
            raise TaskError(
                "already_started", f"{task.id} is {task.status}: only what waits for its first agents is moved"
            )
        others = [r.pin for r in core.state.requests.values() if r.priority == given.priority and r.task != task.id]
        pin = max(1, request.pin, *(one + 1 for one in others)) if given.first else request.pin
        if (given.priority, pin) != (request.priority, request.pin):
            core.put_part(task.id, "request", priority=given.priority)
            core.emit(ch.RequestPut(request.task, replace(request, priority=given.priority, pin=pin)))

    # -- out of service ----------------------------------------------------------------------------------------------
    def _in_service(self, given: InService) -> None:
        core = self._core
        agent = self._agent(given.agent)
        if agent.human:
            raise TaskError("human", f"{agent.id} is a person; machines are taken out of service")
        if not given.reason:
            if not agent.out:
                raise TaskError("not_out", f"{agent.id} is in service")
            core.put_agent(agent.id, out="", out_by="")
            return
        core.put_agent(agent.id, out=given.reason, out_by=given.by)
        if agent.out:
            return
        self.forget(agent.id)
        for request in core.state.requests.values():
            if any(role.id == agent.id for role in request.roles):
                text = f"{agent.id} is out of service ({given.reason}): {request.holder} asks for it and waits"
                core.effect(NotifyPeople(text, (), "warning", request.holder))

    # -- what there is ---------------------------------------------------------------------------------------------
    def _open_task(self, name: str) -> TaskRecord:
        task = self._core.state.tasks.get(name)
        if task is None:
            raise TaskError("unknown_task", f"there is no task '{name}'")
        if task.section == "done":
            raise TaskError("already_ended", f"{name} has ended: {task.status}")
        return task

    def _agent(self, name: str) -> AgentRecord:
        agent = self._core.state.agents.get(name)
        if agent is None:
            raise TaskError("unknown_agent", f"there is no agent '{name}'")
        return agent

    def _keeping(self, agent_id: str) -> list[tuple[AgentRequest, RoleRequest]]:
        """Return the requests, and their roles, to which a person gave an agent and that have not got it yet."""
        requests = self._core.state.requests.values()
        return [(request, role) for request in requests for role in request.roles if agent_id in role.by_hand]

    def _put(self, request: AgentRequest, role: RoleRequest) -> None:
        roles = tuple(role if one.role == role.role else one for one in request.roles)
        self._core.emit(ch.RequestPut(request.task, replace(request, roles=roles)))
