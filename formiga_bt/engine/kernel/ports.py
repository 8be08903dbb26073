"""What parts of the engine need of parts that are built after them.

The parts stand in this order: fleet, people, gatekeeper, clearances, goals, tasks (with recovery), allocation. Each may call
those before it directly; back up it calls through one of these protocols, which `Engine` connects. So each part can be read,
and tested, without the ones above it.
"""

from collections.abc import Mapping
from typing import Any, Protocol

from formiga_bt.base.geo import Place
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Request, TaskRecord
from formiga_bt.lang.model import Env, Role, Step
from formiga_bt.nodes.run import Failure, GoalOrder
from formiga_bt.transport.messages import Clearance, GoalEvent


class GoalPort(Protocol):
    """`Goals`, for the fleet and for the runs of tasks."""

    def order(self, task_id: str, order: GoalOrder) -> Failure | None:
        """Make a goal and show it to the gate."""
        ...

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal; return whether its end must be waited for."""
        ...

    def on_event(self, event: GoalEvent, wall: int) -> None:
        """Take news of a goal."""
        ...

    def end(
        self, goal_id: str, state: str, code: str = "", text: str = "", result: dict[str, Any] | None = None
    ) -> None:
        """Give a goal its end."""
        ...

    def interrupt(self, goal_id: str, code: str) -> None:
        """Let a goal's step wait for a person's word."""
        ...

    def lose(self, agent_id: str, state: str, code: str = "") -> None:
        """End every goal that an agent has or waits for."""
        ...

    def give_up(self, agent_id: str) -> None:
        """End what waits for a machine that leaves its task."""
        ...


class PeoplePort(Protocol):
    """`People`, for the fleet."""

    def invalidate(self, person: str) -> None:
        """Somebody came or went: look at the queues again."""
        ...


class ClearancePort(Protocol):
    """`Clearances`, for the gatekeeper and the fleet."""

    def given(self, agent_id: str) -> Clearance | None:
        """Return the word that stands for a machine."""
        ...

    def place(self, agent_id: str) -> Place | None:
        """Return the spot that it is for."""
        ...

    def take(self, goal: GoalRecord) -> Clearance | None:
        """Return the word that goes along with a goal, and use it up."""
        ...

    def need(self, goal: GoalRecord) -> None:
        """Ask for the word, unless it is being asked for."""
        ...

    def withdraw(self, goal: GoalRecord) -> None:
        """The goal that waits for a word is gone."""
        ...

    def patience_us(self, agent: AgentRecord) -> int:
        """Return how long a machine may wait where it is."""
        ...

    def review(self, agent_id: str) -> None:
        """A machine has told how it is."""
        ...

    def forget(self, agent_id: str) -> None:
        """The process of a machine was started anew."""
        ...


class TaskPort(Protocol):
    """`Tasks`, for the fleet, the clearances and the recovery."""

    orders: "OrderPort"

    @property
    def errands(self) -> "ErrandPort":
        """Return the engine's own tasks."""
        ...

    def fail(self, task_id: str, code: str, reason: str) -> None:
        """End a task by something that no step can catch."""
        ...

    def on_agent_left(self, task_id: str, agent_id: str) -> None:
        """A machine of the task was quarantined."""
        ...

    def poke_allocator(self) -> None:
        """Agents or requests changed."""
        ...

    def alarm(self, code: str, text: str, task_id: str, agent_id: str) -> None:
        """Raise an alarm."""
        ...

    def start_section(self, task_id: str, section: str, steps: tuple[Step, ...], scope: str) -> None:
        """Start a recover section."""
        ...

    def stop(self, task_id: str, section: str) -> None:
        """Stop a section."""
        ...

    def recovered(self, task_id: str) -> None:
        """Every machine is home, or quarantined."""
        ...


class ErrandPort(Protocol):
    """`Errands`, for the fleet."""

    def grounded(self, task_id: str, agent_id: str) -> None:
        """A machine of a task stands on the ground now."""
        ...

    def flies(self, agent_id: str) -> None:
        """A machine is in the air."""
        ...

    def start_recover(self, agent_id: str) -> None:
        """Start the system task that brings a machine home."""
        ...


class AllocationPort(Protocol):
    """`Allocation`, for the tasks."""

    def free_layer(self, agent_id: str, task_id: str) -> float:
        """Return the cruise layer that fewest machines have, metres."""
        ...

    def request(self, task: TaskRecord, values: Mapping[str, Any]) -> Request:
        """Return a task's request."""
        ...

    def enqueue(self, request: Request) -> None:
        """Let a request wait for agents."""
        ...

    def want(
        self, task_id: str, node: str, roles: Mapping[str, Role], env: Env, but_not: tuple[str, ...] = ()
    ) -> Request:
        """Let a block of a running task wait for agents."""
        ...

    def poke(self) -> None:
        """Look at the requests soon."""
        ...

    def look(self) -> None:
        """Look at the requests now."""
        ...

    def assign(self, task_id: str, roles: Mapping[str, tuple[str, ...]]) -> None:
        """Mark agents as a task's."""
        ...


class OrderPort(Protocol):
    """`Orders`, for the fleet and the tasks."""

    def forget(self, agent_id: str) -> None:
        """A machine was quarantined."""
        ...

    def bring_home_if_idle(self, agent_id: str, by: str) -> None:
        """A machine in the air that belongs to nobody comes home."""
        ...

    def carried_out(self, task: TaskRecord) -> None:
        """A system task that carried out an order ended."""
        ...

    def go_on(self, agent_id: str) -> None:
        """A machine has stopped after a person said continue."""
        ...

    def has_no_port(self, agent: AgentRecord) -> bool:
        """Return whether a machine has no home to come to, and can land where it is."""
        ...

    def no_way_home(self, agent_id: str, why: str) -> None:
        """No legal leg leads home."""
        ...

    def ended_by_word(self, task_id: str) -> None:
        """A person ends a task."""
        ...

    def tidy_goes_on(self, task_id: str) -> None:
        """The steps of a task were stopped on a person's word."""
        ...


class BreachPort(Protocol):
    """`Breaches`, for the fleet."""

    def look(self, agent_id: str, ended: str) -> None:
        """A status of a machine came in."""
        ...
