"""`TaskRun`: the services of one running task, between its trees and the parts of the engine."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import drains
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.engine.kernel.records import Question, Releasing, TaskRecord, request_id
from formiga_bt.engine.tasks import claims
from formiga_bt.engine.tasks.children import Children
from formiga_bt.engine.tasks.cleanup import Cleanups
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.taskwaits import TaskWaits
from formiga_bt.engine.tasks.treerun import CompiledTrees, TaskTrees, TreesFactory
from formiga_bt.lang.model import Env, Role
from formiga_bt.nodes.ends import Drain, End, FinallyEnd
from formiga_bt.nodes.run import (
    AskOrder,
    CleanupOrder,
    Failure,
    GoalOrder,
    GoalView,
    Served,
    TaskOrder,
)


class TaskRun(TaskWaits):
    """Implements `nodes.run.Run` for one task: what its nodes order."""

    def __init__(
        self,
        core: Core,
        goals: Goals,
        people: People,
        requests: Requests,
        children: Children,
        task_id: str,
        factory: TreesFactory,
    ) -> None:
        super().__init__(core, task_id)
        self._goals = goals
        self._people = people
        self._requests = requests
        self._children = children
        self.trees: TaskTrees = factory(self)
        self.cleanups = Cleanups(core, task_id, self.trees)
        self._compiled = self.trees if isinstance(self.trees, CompiledTrees) else None

    def close(self) -> None:
        """The task has ended: let go of its trees, so that their memory is free at once."""
        if self._compiled is not None:
            self._compiled.close()

    def register(self, path: str, node: Any) -> None:
        """Let wakes reach a node of compiled trees."""
        if self._compiled is not None:
            self._compiled.register(path, node)

    def unregister(self, path: str) -> None:
        """Forget a node of compiled trees."""
        if self._compiled is not None:
            self._compiled.unregister(path)

    # -- goals ---------------------------------------------------------------------------------------------------------
    def goal_id(self, path: str) -> str:
        """Return `<task>/<run>/<instance path>`; the path begins with the section."""
        return f"{self.task_id}/{self._core.task(self.task_id).run}/{path}"

    def order(self, order: GoalOrder) -> Failure | None:
        """Order a goal."""
        return self._goals.order(self.task_id, order)

    def goal(self, goal_id: str) -> GoalView:
        """Return a goal's record."""
        return self._core.state.goals[goal_id]

    def change_goal(self, goal_id: str, fields: dict[str, Any]) -> str:
        """Ask for other fields of a goal that runs; return why that cannot be."""
        try:
            self._goals.updates.order(goal_id, fields, tracked=True)
        except TaskError as refused:
            return f"{refused} ({refused.code})"
        return ""

    def drop_goal(self, goal_id: str) -> None:
        """Forget an ended goal."""
        self._core.emit(ch.GoalDrop(goal_id))

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal; return whether to wait for its end."""
        return self._goals.cancel(goal_id)

    # -- agents of a block ---------------------------------------------------------------------------------------------
    def release(self, agent: str, path: str, after: Drain = ()) -> None:
        """Give an agent back."""
        releasing = {**self._core.task(self.task_id).agents.releasing, agent: Releasing(path, after)}
        self._core.put_part(self.task_id, "agents", releasing=releasing)
        self._core.touch(self.task_id)

    def is_released(self, agent: str) -> bool:
        """Return whether the task no longer holds an agent."""
        return not any(agent in agents for agents in self._core.task(self.task_id).agents.roles.values())

    def is_low(self, agent: str, percent: float) -> bool:
        """Return whether an agent is up, or drives, with so little charge. One that stands on the ground is in no hurry."""
        record = self._core.state.agents[agent]
        return (
            record.battery is not None
            and record.battery <= percent
            and not (record.flies and record.landed == "grounded")
        )

    def why_gone(self, agent: str) -> str:
        """Return why an agent was taken from the task."""
        return self._core.state.agents[agent].quarantine or "lost" if self.is_released(agent) else ""

    def want_agents(self, path: str, roles: Mapping[str, Role], env: Env, but_not: tuple[str, ...]) -> Micros:
        """Ask the allocator."""
        request = self._requests.want(self.task_id, path, roles, env, but_not)
        return min(role.wait_until for role in request.roles if role.wait_until is not None)

    def take_agents(self, path: str) -> Served | None:
        """Return the allocator's answer, once."""
        served = self._core.task(self.task_id).agents.served
        if path in served:
            self._core.put_part(self.task_id, "agents", served={key: one for key, one in served.items() if key != path})
        return served.get(path)

    def withdraw_agents(self, path: str) -> tuple[str, ...]:
        """Ask no more."""
        served = self.take_agents(path)
        key = request_id(self.task_id, path)
        if key in self._core.state.requests:
            self._core.emit(ch.RequestPut(key, None))
        return tuple(agent for group in served.roles.values() for agent in group) if served is not None else ()

    # -- resources of a block --------------------------------------------------------------------------------------------
    def want_resources(self, path: str, units: Mapping[str, int]) -> None:
        """Ask for units of resources."""
        self._requests.want_units(self.task_id, path, units)

    def take_resources(self, path: str) -> str | None:
        """Return whether they are held, or why never."""
        if path in self._core.task(self.task_id).resources.claims:
            return ""
        refused = self.take_agents(path)
        return refused.reason if refused is not None else None

    def withdraw_resources(self, path: str) -> None:
        """Ask no more."""
        self.withdraw_agents(path)
        if path in self._core.task(self.task_id).resources.claims:
            claims.give_back(self._core, self.task_id, path)

    def free_resources(self, path: str, after: Drain, *, well: bool) -> None:
        """The block has ended."""
        if well:
            claims.give_back(self._core, self.task_id, path)
        else:
            claims.leave(self._core, self.task_id, path, after)

    # -- people --------------------------------------------------------------------------------------------------------
    def ask(self, order: AskOrder) -> None:
        """Open a question."""
        self._people.open(self.task_id, order)

    def question(self, ask_id: str) -> Question:
        """Return a question's record; it has the shape of a QuestionView."""
        return self._core.state.questions[ask_id]

    def close_question(self, ask_id: str) -> None:
        """Withdraw or forget a question."""
        self._people.close(ask_id)

    def people(self, site_role: str) -> tuple[str, ...]:
        """Return who has a site role."""
        return self._people.of_role(site_role)

    def notify(self, text: str, to: tuple[str, ...], severity: str, path: str) -> None:  # noqa: ARG002
        """Tell people."""
        self._core.effect(NotifyPeople(text, to, severity, self.task_id))  # type: ignore[arg-type]

    # -- other tasks ---------------------------------------------------------------------------------------------------
    def start_task(self, order: TaskOrder) -> str | Failure:
        """Start another task."""
        return self._children.start(self.task_id, order)

    def child(self, task_id: str) -> TaskRecord:
        """Return a started task's record; it has the shape of a TaskView."""
        return self._core.task(task_id)

    def end_task(self, task_id: str) -> bool:
        """Abort a started task."""
        return self._children.end(task_id)

    # -- drain sets ----------------------------------------------------------------------------------------------------
    def is_over(self, end: End) -> bool:
        """Return whether what a drain set waits for is over."""
        return drains.is_over(self._core.state, self._core.task(self.task_id), end)

    def adopt(self, end: End, owner: str) -> None:
        """Change who is woken at an end."""
        drains.adopt(self._core, self.task_id, end, owner)

    def forget(self, end: End) -> None:
        """Drop what is over."""
        drains.forget(self._core, self.task_id, end)

    def cleanup(self, order: CleanupOrder, tree: Any = None) -> FinallyEnd | None:
        """Take over the `finally` of a stopped sequence."""
        return self.cleanups.take(order, tree)
