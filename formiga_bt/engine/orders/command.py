"""What a person may order: the stops, continue, handback, restart, clear, removed; each on an agent, a task, or all.

An order for a task is one for its family: also for the tasks that it requested and that end with it.
Called by the engine with each `Operator` input. A refusal is a TaskError with a code, and then nothing was changed.
"""

from collections.abc import Sequence

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.agents.process_identity import DOUBLE
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel.causes import OperatorHold, ResumeHold, TakeOverHold, kind_and_agent, waits_for_word
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.holds import hold, unhold
from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.engine.kernel.records import AgentRecord, Stop, TaskRecord, family
from formiga_bt.engine.orders.continuing import cannot, obstacle, waiting
from formiga_bt.engine.orders.orders import StandingOrders
from formiga_bt.engine.tasks.tasks import Tasks


class Command:
    """A person's word."""

    def __init__(self, core: Core, fleet: Fleet, goals: Goals, tasks: Tasks, orders: StandingOrders) -> None:
        self._core = core
        self._fleet = fleet
        self._goals = goals
        self._tasks = tasks
        self._orders = orders

    # -- a person's word -----------------------------------------------------------------------------------------
    def give(self, given: Operator) -> None:
        """Carry out an order of a person.

        Raises:
            TaskError: it cannot be, and nothing was changed.
        """
        match given.order:
            case "clear":
                self._clear(self._machine(given.target))
            case "removed":
                self._removed(self._machine(given.target), given.by)
            case "handback_continue" | "handback_return" | "handback_end":
                self._hand_back(self._machine(given.target), given.order.removeprefix("handback_"), given.by)
            case "continue":
                self._continue(given.target)
            case "restart":
                self._restart(given.target, given.by)
            case "cut":
                self._orders.stop(self._machine(given.target), "cut", given.by, "agent")
            case "hold" | "return" | "land":
                self._stops(given.target, given.order, given.by)

    def _machine(self, name: str) -> AgentRecord:
        agent = self._core.state.agents.get(name)
        if agent is None:
            raise TaskError("unknown_agent", f"there is no agent '{name}'" if name else "this order is for one agent")
        if agent.human:
            raise TaskError("human", f"{name} is a person; orders are for machines")
        return agent

    def _task(self, name: str) -> TaskRecord:
        task = self._core.state.tasks.get(name)
        if task is None:
            raise TaskError("unknown_target", f"there is no agent and no task '{name}'")
        if task.section == "done":
            raise TaskError("already_ended", f"{name} has ended: {task.status}")
        if task.status == "PENDING":
            raise TaskError(
                "not_started", f"{name} waits for its agents and has started nothing; abort it if it shall not"
            )
        return task

    def _stops(self, target: str, stop: Stop, by: str) -> None:
        core = self._core
        if target in core.state.agents:
            self._orders.stop(self._machine(target), stop, by, "agent")
        elif target:
            for one in family(core.state.tasks, self._task(target).id):
                task = core.task(one)
                if not task.system.agent:
                    hold(core, task.id, OperatorHold())
                for agent in self._orders.machines_of(task):
                    self._orders.stop(agent, stop, by, "task", strict=False)
        else:
            for agent in [a for a in core.state.agents.values() if not a.human]:
                self._orders.stop(agent, stop, by, "all", strict=False)

    # -- continue ------------------------------------------------------------------------------------------------
    def _continue(self, target: str) -> None:
        core = self._core
        if core.state.lockdown is not None:
            raise TaskError("lockdown", "lockdown is on; formiga lockdown release comes first")
        if target in core.state.agents:
            agent = self._machine(target)
            self._continue_machines([agent], target)
        elif target:
            tasks = [core.task(one) for one in family(core.state.tasks, self._task(target).id)]
            machines = [agent for task in tasks for agent in self._orders.machines_of(task)]
            if tasks[0].system.agent and ResumeHold() in tasks[0].hold.causes:
                self._check_can_continue(machines[0], steps=False)
                unhold(core, target, ResumeHold())  # the order that it carries out stands
            else:
                self._continue_machines(machines, target, tasks)
        else:
            for task_id in list(core.open):
                if any(waits_for_word(cause) for cause in core.task(task_id).hold.causes):
                    self._try_continue(task_id)
            for name in list(core.state.orders):
                self._try_continue(name)

    def _try_continue(self, target: str) -> None:
        """Let go on what waits, of everything: a machine that an order brings home, or down, is named by whoever ends that."""
        core = self._core
        named = [target]
        if target not in core.state.agents and not core.task(target).system.agent:
            tasks = [core.task(one) for one in family(core.state.tasks, target)]
            named = [agent.id for task in tasks for agent in self._orders.machines_of(task)]
        orders = core.state.orders
        if any(orders[one].brings_down for one in named if one in orders):
            return
        try:
            self._continue(target)
        except TaskError:
            return  # it stays held, which `why` explains

    def _continue_machines(self, machines: list[AgentRecord], target: str, named: Sequence[TaskRecord] = ()) -> None:
        core = self._core
        tasks = {t.id: t for t in (core.state.tasks.get(a.task) for a in machines) if t is not None}
        tasks |= {task.id: task for task in named}
        held = any(waits_for_word(c) for t in tasks.values() for c in t.hold.causes)
        ordered = [core.state.orders[a.id] for a in machines if a.id in core.state.orders]
        if not held and not ordered:
            raise TaskError("not_held", f"{target} was not stopped, there is nothing to continue")
        for agent in machines:
            self._check_can_continue(agent)
        for order in ordered:
            self._orders.withdraw(order)
        for task in tasks.values():
            self._keep_stopped(task, machines)
            for cause in task.hold.causes:
                agent_id = kind_and_agent(cause)[1]
                mine = not agent_id or agent_id in [a.id for a in machines]
                if waits_for_word(cause) and (mine or task.id in [one.id for one in named]):
                    unhold(core, task.id, cause)
        for agent in machines:
            self._orders.resume(agent)

    def _keep_stopped(self, task: TaskRecord, machines: list[AgentRecord]) -> None:
        """A task's other machines that only its hold stopped wait on, and say so: their steps need a word of their own."""
        for agent in self._orders.machines_of(task):
            order = self._core.state.orders.get(agent.id)
            if any(agent.id == one.id for one in machines) or (order is not None and order.scope != "engine"):
                continue  # one of the engine ends by itself, and holds nothing any more then
            if any(
                goal.state == "interrupted" and goal.section == "steps" for goal in waiting(self._core.state, agent)
            ):
                hold(self._core, task.id, OperatorHold(agent.id))

    def _check_can_continue(self, agent: AgentRecord, *, steps: bool = True) -> None:
        core = self._core
        if agent.control != "engine" or agent.taken:
            raise TaskError(*(self._orders.refusal(agent, "") or ("not_in_command", "")))
        problem = obstacle(core.state, agent, core.action, steps=steps)
        if problem is not None:
            raise TaskError(*problem)

    # -- restart, abort ------------------------------------------------------------------------------------------
    def _restart(self, target: str, by: str) -> None:
        task = self._task(target)
        if task.system.agent:
            raise TaskError("system_task", f"{target} is the engine's own; nothing of it can be restarted")
        if task.section != "steps" or task.ending.stopping:
            raise TaskError("already_ending", f"{target} is already ending")
        if self._core.state.lockdown is not None:
            raise TaskError("lockdown", "lockdown is on; formiga lockdown release comes first")
        for agent in self._orders.machines_of(task):
            if agent.taken or agent.control != "engine":
                raise TaskError(*(self._orders.refusal(agent, "") or ("not_in_command", "")))
        self._orders.ended_by_word(task.id)
        self._tasks.restart(task.id, "restart", f"by {by or 'an operator'}")

    # -- a pilot gives back ----------------------------------------------------------------------------------------
    def _hand_back(self, agent: AgentRecord, how: str, by: str) -> None:
        core = self._core
        if not agent.taken:
            raise TaskError("not_taken_over", f"{agent.id} was not taken over")
        if agent.control != "engine":
            raise TaskError("not_in_command", f"{agent.id} is still under the control of its {agent.control}")
        order = core.state.orders.get(agent.id)
        if how == "return" and order is not None and order.stop == "cut" and order.state != "failed":
            raise TaskError("cut", f"the motors of {agent.id} were ordered to be cut")
        if how == "continue":
            for goal in waiting(self._core.state, agent):
                text = cannot(core.state, goal, agent, core.action)
                if text and goal.section == "steps":
                    raise TaskError(
                        "cannot_continue",
                        f"{text}; formiga handback {agent.id} --return or --end, or formiga abort {goal.task}",
                    )
        agent = core.put_agent(agent.id, taken=False)
        core.stale.add(agent.id)
        if how == "end":
            for goal in waiting(self._core.state, agent):
                if goal.state == "interrupted" and goal.section != "recover":
                    self._goals.end(goal.id, "taken_over")
        if how == "return":
            self._orders.stop(agent, "return", by, "agent")
        for task_id in list(core.open):
            unhold(core, task_id, TakeOverHold(agent.id))
        self._orders.resume(agent, steps=how != "return" and agent.id not in core.state.orders)
        self._orders.bring_home_if_idle(agent.id, by)

    def _clear(self, agent: AgentRecord) -> None:
        if agent.pool != "QUARANTINED" and not agent.rebooted:
            raise TaskError("not_quarantined", f"{agent.id} is not quarantined, and was not started anew")
        if agent.refused:
            raise TaskError("not_admitted", f"{agent.id} is not admitted: {agent.refused}")
        if agent.liveness != "ALIVE":
            text = f"{agent.id} cannot be reached; it comes back by itself when it can"
            away = f"; if you have taken it away: formiga agents removed {agent.id}" if agent.liveness == "LOST" else ""
            raise TaskError("not_alive", text + away)
        if agent.quarantine == DOUBLE:
            text = f"two processes say that they are {agent.id}: end one of them; it comes back by itself then"
            raise TaskError("double", text)
        self._fleet.trust_again(agent.id)
        if agent.pool == "QUARANTINED":
            self._fleet.begin_return(agent.id)

    def _removed(self, agent: AgentRecord, by: str) -> None:
        if agent.liveness != "LOST":
            where = {"airborne": ", in the air", "grounded": ", on the ground"}.get(agent.landed, "")
            told = (
                f"is heard of and says itself where it is{where}" if agent.liveness == "ALIVE" else "was heard just now"
            )
            raise TaskError("still_heard", f"{agent.id} {told}; only what counts as lost can be said to be removed")
        self._fleet.removed(agent.id, by)
