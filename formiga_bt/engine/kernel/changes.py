"""Changes: the only way in which the state changes. A Step lists them in order; folding them rebuilds the state.

Records are replaced whole (they are small and frozen), so a change is "this record is now so".
"""

from typing import Any

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.alarm_records import AlarmRecord
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.engine.kernel.records import (
    AgentEventRecord,
    AgentRecord,
    AgentRequest,
    Approval,
    ClearanceRecord,
    Closure,
    Deadline,
    Discovered,
    GoalRecord,
    Lockdown,
    Member,
    Question,
    Resuming,
    StandingOrder,
    TaskRecord,
    Verdict,
    Version,
    Wakes,
)
from formiga_bt.engine.kernel.rule_records import RuleRecord, RuleWatch
from formiga_bt.engine.kernel.timers import Timer, WallTimer
from formiga_bt.nodes.memory import Mem
from formiga_bt.safety.drafted import Drafted


class TaskPut(Struct, frozen=True, tag=True):
    """A task's record is now this."""

    task: TaskRecord


class AgentPut(Struct, frozen=True, tag=True):
    """An agent's record is now this."""

    agent: AgentRecord


class GoalPut(Struct, frozen=True, tag=True):
    """A goal's record is now this."""

    goal: GoalRecord


class GoalDrop(Struct, frozen=True, tag=True):
    """An ended goal's outcome was taken."""

    goal: str


class QuestionPut(Struct, frozen=True, tag=True):
    """A question's record is now this."""

    question: Question


class QuestionDrop(Struct, frozen=True, tag=True):
    """A question was answered and taken, or withdrawn."""

    question: str


class ClearancePut(Struct, frozen=True, tag=True):
    """The clearance of an agent now stands so; None = no clearance is under way."""

    agent: str
    clearance: ClearanceRecord | None


class AgentEventNoted(Struct, frozen=True, tag=True):
    """An agent told an event of its own."""

    event: AgentEventRecord


class OrderPut(Struct, frozen=True, tag=True):
    """The order that stands on an agent; None = none stands any more."""

    agent: str
    order: StandingOrder | None


class LockdownPut(Struct, frozen=True, tag=True):
    """Lockdown was pressed, or (None) released."""

    lockdown: Lockdown | None


class ApprovalPut(Struct, frozen=True, tag=True):
    """A bundle on this site was approved, or (None) its approval was taken back."""

    digest: str
    approval: Approval | None


class ClosurePut(Struct, frozen=True, tag=True):
    """A region is closed for machines, or (None) open again."""

    name: str
    closure: Closure | None


class DutyPut(Struct, frozen=True, tag=True):
    """A pilot is on duty since then, or (None) no longer."""

    pilot: str
    since: Micros | None


class MemberPut(Struct, frozen=True, tag=True):
    """An agent was added to the fleet, or (None) is in it no more."""

    agent: str
    member: Member | None


class DiscoveredPut(Struct, frozen=True, tag=True):
    """An action that no catalogue has stands so."""

    action: str
    discovered: Discovered


class DraftedPut(Struct, frozen=True, tag=True):
    """A model wrote this version of a task."""

    bundle: str
    drafted: Drafted


class LibraryPut(Struct, frozen=True, tag=True):
    """The versions of a task, oldest first, are now these; new requests get the last."""

    task: str
    versions: tuple[Version, ...]


class ScopePut(Struct, frozen=True, tag=True):
    """A scope of a task was opened with these names, or (None) closed."""

    task: str
    scope: str
    values: dict[str, Any] | None


class VarPut(Struct, frozen=True, tag=True):
    """A name in a scope of a task has this value."""

    task: str
    scope: str
    name: str
    value: Any


class NodeMem(Struct, frozen=True, tag=True):
    """The memory of one node, after a pass; None = it ended."""

    task: str
    path: str
    mem: Mem | None


class NodesEnded(Struct, frozen=True, tag=True):
    """Steps of a task ended in a pass, or were stopped. History only: the state does not change by it."""

    task: str
    ended: tuple[tuple[str, str, str], ...]
    """Instance path, how (S succeeded, F failed, K skipped, H stopped), reason code of a failure."""


class DeadlineSet(Struct, frozen=True, tag=True):
    """An engine-time deadline is set, or (None) forgotten."""

    timer: Timer
    deadline: Deadline | None


class WakesPut(Struct, frozen=True, tag=True):
    """A task's budget of wakes now stands so."""

    task: str
    wakes: Wakes


class WallTimerSet(Struct, frozen=True, tag=True):
    """The driver shall give `WallDue` after so much wall time; None = forget it."""

    timer: WallTimer
    after_us: Micros | None


class RequestPut(Struct, frozen=True, tag=True):
    """A task waits for agents, or (None) no longer."""

    task: str
    request: AgentRequest | None


class Granted(Struct, frozen=True, tag=True):
    """The allocator gave agents to a task."""

    task: str
    roles: dict[str, tuple[str, ...]]
    layers: dict[str, float]


class Explained(Struct, frozen=True, tag=True):
    """Why the allocator did what it did for a task; only when much of it differs from the last time."""

    task: str
    at: Micros
    verdicts: tuple[Verdict, ...]


class Reexplained(Struct, frozen=True, tag=True):
    """Of some agents the allocator thinks otherwise than the last time; the rest of the task's explanation stands."""

    task: str
    at: Micros
    changed: tuple[tuple[int, Verdict], ...]
    """Place in the explanation, and the verdict that stands there now."""


class CounterSet(Struct, frozen=True, tag=True):
    """A counter (task, question, clearance, goal order, deadline) has this value."""

    name: str
    value: int


class TaskForget(Struct, frozen=True, tag=True):
    """A task's working state (memory, scopes) is dropped; its record stays."""

    task: str


class TaskGone(Struct, frozen=True, tag=True):
    """A task that ended long ago is forgotten: its record and its explanation. The journal still has them."""

    task: str


class ResumePut(Struct, frozen=True, tag=True):
    """The engine was away, and stands so in finding out what happened meanwhile; None = all is known."""

    resume: Resuming | None


class RulePut(Struct, frozen=True, tag=True):
    """A standing rule's record is now this; None: the site has no such rule any more."""

    name: str
    rule: RuleRecord | None


class RuleWatchPut(Struct, frozen=True, tag=True):
    """What a standing rule has seen of an agent is now this; None: nothing."""

    rule: str
    agent: str
    watch: RuleWatch | None


class AlarmPut(Struct, frozen=True, tag=True):
    """An alarm's record is now this; the last `new` turns of its history came with this change."""

    alarm: AlarmRecord
    new: int = 0


class AlarmDrop(Struct, frozen=True, tag=True):
    """An alarm is forgotten: there are too many. The journal still has it."""

    alarm: str


class NewsMarksPut(Struct, frozen=True, tag=True):
    """The channels of the site's news have come so far; a channel that is not among them is no more."""

    marks: dict[str, NewsMark]


Change = (
    TaskPut | AgentPut | GoalPut | GoalDrop | QuestionPut | QuestionDrop | ClearancePut | ScopePut | VarPut | NodeMem
    | DeadlineSet | WallTimerSet | RequestPut | Granted | Explained | CounterSet | TaskForget | OrderPut | LockdownPut
    | ApprovalPut | DutyPut | AgentEventNoted | NodesEnded | LibraryPut | DraftedPut | TaskGone | ResumePut | Reexplained
    | WakesPut | MemberPut | DiscoveredPut | RulePut | RuleWatchPut | AlarmPut | AlarmDrop
    | NewsMarksPut | ClosurePut
)  # fmt: skip
