"""What persons say of who works for whom: agents given to tasks and taken back, and which task goes first."""

from collections.abc import Callable, Iterable
from typing import Final

from formiga_bt.engine.kernel.inputs import Assign, Input, InService, Prioritize, Unassign
from formiga_bt.engine.kernel.records import Priority
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import AssignedFact, OrderDone
from formiga_bt.show.why.near import nearest
from formiga_bt.show.why.words import VERDICT_HINTS

OF_AGENTS: Final = {**VERDICT_HINTS, "busy": "formiga why {agent}"}
"""Code of a refused agent -> what helps; of other refusals `services.words` knows it."""


class HandDesk:
    """Takes these orders.

    Args:
        ask: hands an input to the engine and returns its reply; raises `Refused`.
        view: the copy of the engine's state.
    """

    def __init__(self, ask: Callable[[Input], Accepted | Done], view: EngineView) -> None:
        self._ask = ask
        self._view = view

    def assign(self, task: str, agent: str, role: str = "", by: str = "") -> AssignedFact:
        """Give an agent to a task that waits for agents. The same once more changes nothing.

        Raises:
            Refused: unknown task, agent or role; the task waits for nobody; a filter of the allocator refuses the agent.
        """
        try:
            reply = self._ask(Assign(task, agent, role, by))
        except Refused as refused:
            raise self._explained(refused, task, agent) from refused
        self._view.catch_up()
        with self._view.reading() as state:
            record = state.tasks[task]
            mine = next((name for name, agents in record.agents.roles.items() if agent in agents), "")
            kept = _kept_as(state, task, agent)
        text = f"{agent} is '{mine}' of {task}"
        if not mine:
            text = f"{agent} is kept for {task} as '{kept}', which waits for the others: formiga why {task}"
        return AssignedFact(
            task=task, agent=agent, role=mine or kept, granted=bool(mine), text=with_keeping(text, reply)
        )

    def unassign(self, agent: str, by: str = "") -> AssignedFact:
        """Take an agent back from its task, which begins anew, or from the one for which it is kept.

        Raises:
            Refused: it has no task; or its task cannot begin anew.
        """
        self._view.catch_up()
        with self._view.reading() as state:
            record = state.agents.get(agent)
            task = had = record.task if record is not None else ""
            if record is not None and not task:
                task = next((r.holder for r in state.requests.values() if _kept_as(state, r.holder, agent)), "")
        reply = self._ask(Unassign(agent, by))
        self._view.catch_up()
        with self._view.reading() as state:
            has = state.agents[agent].task
        text = f"{agent} comes home, then it is free" if has == task else f"{agent} is free"
        text += f"; {task} begins anew without it" if had else f", {task} keeps it no more"
        return AssignedFact(task=task, agent=agent, role="", granted=has == task, text=with_keeping(text, reply))

    def prioritize(self, task: str, priority: Priority, *, first: bool = False, by: str = "") -> OrderDone:
        """Give a task that waits another priority, or the first place in it.

        Raises:
            Refused: unknown, ended, or it waits no more.
        """
        reply = self._ask(Prioritize(task, priority, first, by))
        self._view.catch_up()
        place = ", before all others of it" if first else ""
        return OrderDone(with_keeping(f"{task} has priority {priority}{place}", reply))

    def out(self, agent: str, reason: str, by: str = "") -> OrderDone:
        """Take a machine out of service: it ends what it does, then no task is granted it.

        Raises:
            Refused: unknown, or a person.
        """
        reply = self._ask(InService(agent, reason, by))
        self._view.catch_up()
        with self._view.reading() as state:
            record = state.agents[agent]
        then = f"; it ends {record.task} first" if record.task else ""
        if not record.task and record.landed == "airborne":
            then = f"; it is in the air: formiga return {agent}"
        return OrderDone(with_keeping(f"{agent} is out of service: {reason}{then}", reply))

    def back(self, agent: str, by: str = "") -> OrderDone:
        """Take a machine back into service.

        Raises:
            Refused: unknown, or it is in service.
        """
        reply = self._ask(InService(agent, "", by))
        self._view.catch_up()
        return OrderDone(with_keeping(f"{agent} is in service", reply))

    def _explained(self, refused: Refused, task: str, agent: str) -> Refused:
        near: Iterable[str] = refused.near
        if refused.code == "unknown_agent":
            with self._view.reading() as state:
                near = nearest(agent, list(state.agents))
        hint = OF_AGENTS.get(refused.code, "").replace("TASK", task).format(agent=agent) or refused.help
        return Refused(refused.code, refused.text, hint or f"formiga why {task} tells of all agents", near=near)


def _kept_as(state: EngineState, task: str, agent: str) -> str:
    """Return the role of a task for which an agent is kept, or ""."""
    requests = [request for request in state.requests.values() if request.holder == task]
    return next((role.role for request in requests for role in request.roles if agent in role.by_hand), "")
