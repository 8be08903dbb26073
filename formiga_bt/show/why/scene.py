"""What an explanation is made from: a state at an instant, and what is known besides it."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.library import model_of
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import NodeDue, TaskDue, TaskTime
from formiga_bt.lang.model import Catalogue, Step, Task
from formiga_bt.show.facts import ActionFact, Because
from formiga_bt.show.why.places import StepPlaces


@dataclass(frozen=True, slots=True)
class WhyScene:
    """A state and its surroundings.

    Args:
        state: of the engine.
        now: engine time.
        models: the checked tasks by name; without one its steps are shown as keys.
        catalogue: tells what an interrupted action requires, and how fast machines are.
        wall: now on the clock of `AgentRecord.heard_wall`; 0: not known, then it is not told how long somebody is silent.
        desk: the people who answer at this engine.
        actions: what was sent for the tasks, oldest first, as far as it is kept; for what was tried before a failure.
    """

    state: EngineState
    now: Micros
    models: Mapping[str, Task] = field(default_factory=dict)
    catalogue: Catalogue | None = None
    wall: Micros = 0
    desk: Collection[str] = ()
    actions: Sequence[ActionFact] = ()

    def model(self, task: TaskRecord) -> Task | None:
        """Return a task's model, if it is known."""
        return model_of(self.models, task)

    def step(self, task: TaskRecord, key: str) -> Step | None:
        """Return the step of a node's key."""
        model = self.model(task)
        return StepPlaces(model).of(key) if model is not None else None

    def place(self, task: TaskRecord, key: str) -> str:
        """Return what people call the node with this key, and where it stands."""
        model = self.model(task)
        return StepPlaces(model).place(key) if model is not None else key

    def node_ends(self, task: TaskRecord, key: str) -> Micros | None:
        """Return when the deadline of a node comes, or None: it has none, or it stands still."""
        found = self.state.deadlines.get(NodeDue(task.id, key))
        return None if found is None else found.at

    def task_ends(self, task: TaskRecord, what: TaskTime) -> Micros | None:
        """Return when a deadline of the task comes (`timeout`, `cleanup`, `wait`, `expires`), or None."""
        found = self.state.deadlines.get(TaskDue(task.id, what))
        return None if found is None else found.at

    def silence(self, agent: AgentRecord) -> Micros | None:
        """Return for how long an agent is silent, in wall time, or None: that is not known."""
        return max(0, self.wall - agent.heard_wall) if self.wall and agent.heard_wall else None

    def lost_after(self, agent: AgentRecord) -> Micros | None:
        """Return the silence after which an agent counts as lost; None for people, who are only unreachable."""
        kind = self.catalogue.types.get(agent.type) if self.catalogue is not None else None
        return None if kind is None or agent.human else kind.lost_after_us

    def speed_m_s(self, agent_id: str) -> float | None:
        """Return how fast a machine flies, if that is known."""
        agent = self.state.agents.get(agent_id)
        if agent is None or agent.human:
            return None
        kind = self.catalogue.types.get(agent.type) if self.catalogue is not None else None
        return agent.limits.get("speed_m_s") or (kind.limits.get("speed_m_s") if kind is not None else None)


def deeper(lines: Iterable[Because], by: int = 1) -> list[Because]:
    """Return lines that explain the one before them."""
    return [replace(line, depth=line.depth + by) for line in lines]
