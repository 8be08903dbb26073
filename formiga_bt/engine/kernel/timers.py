"""What the engine waits for: each timer is a value that says what is due, and of whom.

Engine-time timers are deadlines of the state (`EngineState.deadlines`, given back as `TimerDue`), wall-time timers are kept by
the driver (`EngineState.wall`, given back as `WallDue`). `Engine` hands each to the part that set it.
"""

from typing import Literal

from msgspec import Struct

TaskTime = Literal["timeout", "cleanup", "wait", "expires", "not_before", "deadline"]

# -- engine time -------------------------------------------------------------------------------------------------------


class NodeDue(Struct, frozen=True, tag="node", array_like=True):
    """A node of a task is woken, or the time of a stopped sequence's `finally` is over (its id is the node)."""

    task: str
    node: str


class TaskDue(Struct, frozen=True, tag="task", array_like=True):
    """A time of the whole task is over."""

    task: str
    what: TaskTime


class HopelessDue(Struct, frozen=True, tag="hopeless", array_like=True):
    """A request of a task, or of a node of it, has waited so long that agents still unknown are counted on no more."""

    task: str
    node: str


class AllocationDue(Struct, frozen=True, tag="alloc", array_like=True):
    """The allocator looks at the requests."""


class TurnDue(Struct, frozen=True, tag="rest", array_like=True):
    """The next part of very many woken tasks has its turn."""


class HomeOverdue(Struct, frozen=True, tag="recover", array_like=True):
    """A machine should be home by now."""

    task: str
    agent: str


class HomeAgain(Struct, frozen=True, tag="tryagain", array_like=True):
    """The pause after a failed way home is over."""

    task: str
    agent: str


class WayDue(Struct, frozen=True, tag="busy", array_like=True):
    """A goal has waited long enough for a spot, a way or a port."""

    goal: str


class AsideDue(Struct, frozen=True, tag="aside", array_like=True):
    """A machine that waits for a way tries another layer."""

    goal: str


class PortDue(Struct, frozen=True, tag="port", array_like=True):
    """A machine has waited long enough for its own port."""

    goal: str


class EscalationDue(Struct, frozen=True, tag="escalate", array_like=True):
    """A question goes to the next people."""

    question: str


class StrayDue(Struct, frozen=True, tag="stray", array_like=True):
    """A machine has flown for nobody long enough."""

    agent: str


class OrderDue(Struct, frozen=True, tag="order", array_like=True):
    """A machine has hovered on a hold as long as it may."""

    agent: str


class ClearanceDue(Struct, frozen=True, tag="clear", array_like=True):
    """A machine may wait no longer for a clearance, or the one it has is too old."""

    agent: str


class ClearanceAgain(Struct, frozen=True, tag="clearwait", array_like=True):
    """People who said that they do not stand clear are asked again."""

    agent: str


class RuleDue(Struct, frozen=True, tag="rule", array_like=True):
    """What a standing rule waits for has lasted long enough, or an agent was silent for so long."""

    rule: str
    agent: str


class AlarmDue(Struct, frozen=True, tag="alarm", array_like=True):
    """An alarm that nobody acknowledged goes to the next channel of the site's news."""

    alarm: str
    channel: str


Timer = (
    NodeDue | TaskDue | HopelessDue | AllocationDue | TurnDue | HomeOverdue | HomeAgain | WayDue | AsideDue | PortDue
    | EscalationDue | StrayDue | OrderDue | ClearanceDue | ClearanceAgain | RuleDue | AlarmDue
)  # fmt: skip
"""An engine-time timer."""

# -- wall time ---------------------------------------------------------------------------------------------------------


class LiveDue(Struct, frozen=True, tag="live", array_like=True):
    """Look whether an agent is still heard of."""

    agent: str


class AcceptDue(Struct, frozen=True, tag="accept", array_like=True):
    """An agent has not said that it accepts a goal."""

    goal: str


class CancelDue(Struct, frozen=True, tag="cancel", array_like=True):
    """A cancel without an end is sent again."""

    goal: str


class GraceDue(Struct, frozen=True, tag="grace", array_like=True):
    """A canceled goal has had all its time to end."""

    goal: str


class ResumeDue(Struct, frozen=True, tag="resume", array_like=True):
    """After an outage nobody is waited for any longer."""


class AskDue(Struct, frozen=True, tag="ask", array_like=True):
    """After an outage an agent is asked once more what became of its goals."""

    agent: str


class UpdateDue(Struct, frozen=True, tag="update", array_like=True):
    """An update of a goal without an answer is sent again."""

    goal: str


GoalTimer = AcceptDue | CancelDue | GraceDue | UpdateDue
WallTimer = LiveDue | GoalTimer | ResumeDue | AskDue
"""A wall-time timer."""
