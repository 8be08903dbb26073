"""What a part of the engine reports to a part that is built after it.

A part calls those that were built before it. What concerns a later one goes up as one of these values, through `Core.report`,
and `Engine` hands it on at once, within the same step. There is no other way up.
"""

from msgspec import Struct

from formiga_bt.engine.kernel.inputs import Abort
from formiga_bt.engine.kernel.records import AgentEventRecord, GoalRecord, TaskRecord

# -- of machines -------------------------------------------------------------------------------------------------------


class UnreadableMessage(Struct, frozen=True):
    """An agent sent what cannot be read, or is not so."""

    agent: str
    text: str


class GoalUnreachable(Struct, frozen=True):
    """A goal surely did not reach its agent."""

    agent: str


class MustLeave(Struct, frozen=True):
    """A machine cannot stay in its task nor in the pool: it is to be quarantined."""

    agent: str
    why: str


class Leaves(Struct, frozen=True):
    """A machine is about to be quarantined."""

    agent: str


class Left(Struct, frozen=True):
    """A machine of a task was quarantined."""

    task: str
    agent: str


class StatusTaken(Struct, frozen=True):
    """A status of a machine was taken; by it this goal of the machine has ended, though its end may not be handled yet."""

    agent: str
    ended: str


class Landed(Struct, frozen=True):
    """A machine of a task stands on the ground now."""

    task: str
    agent: str


class Flies(Struct, frozen=True):
    """A machine is in the air now."""

    agent: str


class CameBack(Struct, frozen=True):
    """A machine has come back from quarantine, and may be in the air."""

    agent: str


class Idle(Struct, frozen=True):
    """A machine may belong to nobody any more: one in the air comes home."""

    agent: str


class NoWayHome(Struct, frozen=True):
    """No legal leg leads a machine home."""

    agent: str
    why: str


# -- of goals ----------------------------------------------------------------------------------------------------------


class TakenOver(Struct, frozen=True):
    """A pilot, or its own failsafe, ended a machine's goal."""

    goal: GoalRecord


class Stopped(Struct, frozen=True):
    """What an order canceled has ended, and a person has said continue already."""

    agent: str


class ClearanceDenied(Struct, frozen=True):
    """A machine on the ground got no clearance."""

    task: str
    why: str


# -- of tasks ----------------------------------------------------------------------------------------------------------


class Unwanted(Struct, frozen=True):
    """A task that another one requested is to end with it."""

    order: Abort


class AllHome(Struct, frozen=True):
    """Every machine of a task is home, or quarantined."""

    task: str


class TaskEnds(Struct, frozen=True):
    """A task ends, or a person ends it: it is held no more."""

    task: str
    is_over: bool = False
    """Nothing of it is left to do, also no way home."""


class StepsStopped(Struct, frozen=True):
    """The steps of a task were stopped: each `finally` of them that an order had stopped goes on."""

    task: str


class CarriedOut(Struct, frozen=True):
    """A system task that carried out an order ended, well or not."""

    task: TaskRecord


class EventKept(Struct, frozen=True):
    """An agent reported an event of its own, for the first time."""

    event: AgentEventRecord


News = (
    UnreadableMessage | GoalUnreachable | MustLeave | Leaves | Left | StatusTaken | Landed | Flies | CameBack | Idle | NoWayHome
    | TakenOver | Stopped | ClearanceDenied | Unwanted | AllHome | TaskEnds | StepsStopped | CarriedOut | EventKept
)  # fmt: skip
