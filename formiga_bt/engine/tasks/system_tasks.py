"""The engine's own tasks, each of one machine. They bring it home, or carry out an order on it.

`Recover` owns its machine, which belonged to nobody. `Return` and `Land` borrow it: it stays its task's, which waits. All three
consist of the part `recover` alone.
"""

from typing import Final, Literal

from formiga_bt.engine.agents.grants import assign, free_layer
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ResumeHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.holds import unhold
from formiga_bt.engine.kernel.records import (
    Stop,
    SystemOrder,
    TaskAgents,
    TaskRecord,
    TaskRequest,
    TaskTimes,
)
from formiga_bt.engine.tasks.recovery import UNDER_WAY, Recovery
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.run import TaskOutcome

RECOVER_TASK = "Recover"
_ROLE: Final = "machine"
"""What such a task calls it."""


class SystemTasks:
    """The engine's own tasks."""

    def __init__(self, core: Core, goals: Goals, runs: Runs, recovery: Recovery) -> None:
        self._core = core
        self._goals = goals
        self._runs = runs
        self._recovery = recovery

    def next_id(self, name: str) -> str:
        """Return the id that the next system task will have."""
        return f"{name}-{self._core.state.counters.get('task', 0) + 1}"

    def start_order(self, name: str, agent_id: str, stop: Stop, by: str) -> None:
        """Start the system task that carries out an order. It borrows the machine, which stays its task's."""
        core = self._core
        task_id = self._admit(name, agent_id, by or "engine", stop)
        if core.state.agents[agent_id].layer_m is None:
            core.put_agent(agent_id, layer_m=free_layer(core, agent_id, ""))
        self._begin(task_id)

    def _admit(self, name: str, agent_id: str, by: str, stop: Stop | Literal[""] = "") -> str:
        core = self._core
        order = core.count("task")
        task_id = f"{name}-{order}"
        core.emit(
            ch.TaskPut(
                TaskRecord(
                    id=task_id,
                    name=name,
                    order=order,
                    status="ACTIVE",
                    section="finally",
                    request=TaskRequest(bundle="system", priority="high", by=by),
                    agents=TaskAgents(roles={_ROLE: (agent_id,)}, granted=(agent_id,)),
                    outcome=TaskOutcome(status="SUCCEEDED"),
                    times=TaskTimes(submitted_at=core.now, assigned_at=core.now, active_at=core.now),
                    system=SystemOrder(agent=agent_id, stop=stop),
                )
            )
        )
        core.emit(ch.ScopePut(task_id, "", {_ROLE: AgentRef(agent_id)}))
        return task_id

    def _begin(self, task_id: str) -> None:
        self._core.put_task(task_id, status="ENDING")
        self._recovery.enter(task_id)

    def end(self, task_id: str) -> None:
        """End a system task: its order was withdrawn or replaced. Its machine hovers where it is."""
        core = self._core
        task = core.task(task_id)
        core.put_part(task_id, "outcome", status="CANCELED", code="aborted", reason="another order replaced it")
        for one in task.agents.recovering:
            if one.state == "running":
                self._runs.stop(task_id, one.section)
            if one.state in UNDER_WAY:
                self._recovery.abandon(task_id, one)
        core.touch(task_id)
        self._recovery.proceed(task_id)  # if it was between two tries, nothing has to drain

    def ordered_home(self, task_id: str) -> None:
        """An order on a machine of a task was carried out: its way home may go on."""
        task = self._core.state.tasks.get(task_id)
        if task is not None and task.section == "recover" and not task.system.stop:
            self._recovery.begin(task_id)

    def grounded(self, task_id: str, agent_id: str) -> None:
        """A machine of a task stands on the ground now: what waits to bring it home has nothing left to do."""
        core = self._core
        if core.task(task_id).section != "recover":
            return
        for goal in [g for g in core.index.goals_of(agent_id) if g.task == task_id]:
            if goal.state in ("gated", "interrupted") and core.action(goal.action).requires == "airborne":
                self._goals.end(goal.id, "canceled", "requires", f"{agent_id} stands on the ground")

    def flies(self, agent_id: str) -> None:
        """A machine is in the air: what brings it home waits for no word of a person any more, whatever outage there was."""
        core = self._core
        order, agent = core.state.orders.get(agent_id), core.state.agents[agent_id]
        for task_id in (order.task if order is not None else "", agent.task):
            task = core.state.tasks.get(task_id)
            if task is not None and task.system.agent == agent_id:
                unhold(core, task_id, ResumeHold())

    def start_recover(self, agent_id: str) -> None:
        """Start the system task that brings a machine home, unless an order does."""
        core = self._core
        standing = core.state.orders.get(agent_id)
        if standing is not None and standing.state == "open":
            return
        task_id = self._admit(RECOVER_TASK, agent_id, "engine")
        assign(core, task_id, {_ROLE: (agent_id,)})
        self._begin(task_id)
