"""Inputs, effects and the Step: what goes into `Engine.handle` and what comes out. All frozen and serialisable.

A driver stamps `now`, feeds inputs one by one, persists the Step, then carries out its effects.
"""

from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.changes import Change
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.engine.kernel.records import Priority, TaskWhen
from formiga_bt.engine.kernel.replies import Reply
from formiga_bt.engine.kernel.rule_records import RuleCause
from formiga_bt.engine.kernel.timers import Timer, WallTimer
from formiga_bt.nodes.memory import NODE_STATE_VERSION
from formiga_bt.safety.drafted import Drafted
from formiga_bt.transport.messages import AgentCard, AgentEvent, AgentStatus, Clearance, GoalEvent, UpdateReply

# -- inputs ------------------------------------------------------------------------------------------------------------


class Submit(Struct, frozen=True, tag=True):
    """Start a task. `params` are runtime values, already bound to the task's types (`engine.submit.bind_params`)."""

    task: str
    params: dict[str, Any] = {}
    priority: Priority | None = None
    by: str = ""
    bundle: str = ""
    """Of the version that is meant; "" = the newest."""
    wait: Micros | None = None
    """How long at most it waits for its first agents, instead of what its roles say."""
    expires: Micros | None = None
    """The longest time PENDING, instead of the task's own."""
    cause: RuleCause | None = None
    """The standing rule that requests it; no caller from outside can say so."""
    key: str = ""
    """Of a request that may be sent again, and whose it is: `services.once` keeps that it starts one task."""
    asked: str = ""
    """A digest of what it asked for."""
    when: TaskWhen = TaskWhen()


class Serve(Struct, frozen=True, tag=True):
    """Serve a version of a task to new requests. Whoever gives this has added its model to the engine's bundles before."""

    task: str
    bundle: str
    by: str = ""
    drafted: Drafted | None = None
    """Who had a model write it, as far as is known; that is never taken back."""


class Abort(Struct, frozen=True, tag=True):
    """End a task: `now` skips the cleanup sections, `abandon` leaves its agents quarantined."""

    task: str
    how: Literal["", "now", "abandon"] = ""
    by: str = ""
    reason: str = "operator"


OperatorOrder = Literal[
    "clear", "removed", "handback_continue", "handback_return", "handback_end",
    "hold", "return", "land", "cut", "continue", "restart",
]  # fmt: skip
"""Orders of a person: `engine.orders.orders` says what each does in each state of task and agent."""


class Operator(Struct, frozen=True, tag=True):
    """An order of a person.

    `clear`, `removed` (it is not heard of, and was taken away) and `handback_...` take an agent; the stops `hold`, `return`,
    `land` and `continue` an agent, a task, or "" for all;
    `cut` an agent; `restart` a task that cannot be continued.
    """

    order: OperatorOrder
    target: str = ""
    by: str = ""


class LockdownOrder(Struct, frozen=True, tag=True):
    """Press lockdown: no admission, no grants, no goals of tasks; what flies under our control does `how`. Or release it."""

    how: Literal["hold", "return", "land", "release"]
    by: str = ""


class Assign(Struct, frozen=True, tag=True):
    """A person gives an agent to a task that waits for agents."""

    task: str
    agent: str
    role: str = ""
    """"" = the only one that it fits."""
    by: str = ""


class Unassign(Struct, frozen=True, tag=True):
    """A person takes an agent back from the task that has it, or for which it is kept."""

    agent: str
    by: str = ""


class Prioritize(Struct, frozen=True, tag=True):
    """A person gives a task that waits another priority; `first`: it is served before all others of that priority."""

    task: str
    priority: Priority
    first: bool = False
    by: str = ""


class CloseRegion(Struct, frozen=True, tag=True):
    """A person closes a region, or a circle around a place, for machines."""

    name: str
    reason: str
    by: str = ""


class OpenRegion(Struct, frozen=True, tag=True):
    """A person opens what was closed."""

    name: str
    by: str = ""


class InService(Struct, frozen=True, tag=True):
    """A person takes a machine out of service: no task is granted it. Or (`reason` "") back."""

    agent: str
    reason: str = ""
    by: str = ""


class RuleOrder(Struct, frozen=True, tag=True):
    """A person's word on what waits for them: the task of a rule is started now, or what happened is dismissed."""

    rule: str
    do: Literal["start", "dismiss"]
    agent: str = ""
    """To whom it happened; "" = the only one."""
    by: str = ""


class AcknowledgeAlarm(Struct, frozen=True, tag=True):
    """A person takes care of an alarm."""

    alarm: str
    by: str = ""
    note: str = ""
    """In their own words."""


class Approve(Struct, frozen=True, tag=True):
    """A person approved a bundle on this site (`revoke`: takes that back)."""

    digest: str
    task: str
    by: str
    revoke: bool = False
    at: Micros = 0
    """When it was given, if that was at an earlier start of the engine; 0 = now."""


class Duty(Struct, frozen=True, tag=True):
    """A pilot goes on duty, or off."""

    pilot: str
    on: bool
    by: str = ""


class AddAgent(Struct, frozen=True, tag=True):
    """A person adds an agent to the fleet, as if the site file listed it; or gives a member another home."""

    agent: str
    kind: str = ""
    """Its type; "" = as it announced itself."""
    home: str = ""
    """Its own port or station; "" = a free port for what flies, else none."""
    by: str = ""
    at: Micros = 0
    """When, if that was at an earlier start of the engine; 0 = now."""


class RemoveAgent(Struct, frozen=True, tag=True):
    """A person takes an agent that was added out of the fleet."""

    agent: str
    by: str = ""


class Learn(Struct, frozen=True, tag=True):
    """A person lets tasks use an action that agents announced and that no catalogue has."""

    action: str
    by: str = ""


class AgentSeenInput(Struct, frozen=True, tag="AgentSeen"):
    """An agent announced itself."""

    card: AgentCard
    wall: Micros = 0
    wire: str = ""
    """The wire that it is on."""
    lacks: tuple[str, ...] = ()
    """What that wire does not guarantee (`base.wires`)."""


class AgentGoneInput(Struct, frozen=True, tag="AgentGone"):
    """An agent's presence token vanished."""

    agent: str


class AgentStatusInput(Struct, frozen=True, tag="AgentStatus"):
    """A status came in at wall time `wall`, when the driver's clock said `clock` (engine time; 0: as `now`).

    Under overload `now` is earlier than the clock, by which agents stamp what they say.
    """

    status: AgentStatus
    wall: Micros = 0
    clock: Micros = 0


class GoalEventInput(Struct, frozen=True, tag="GoalEvent"):
    """News of a goal; `wall` and `clock` as of a status."""

    event: GoalEvent
    wall: Micros = 0
    clock: Micros = 0


class AgentEventInput(Struct, frozen=True, tag="AgentEvent"):
    """An agent told an event of its own."""

    event: AgentEvent


class QueryReplyInput(Struct, frozen=True, tag="QueryReply"):
    """An agent told which goals it knows; `clock` as of a status."""

    agent: str
    boot_id: str
    goals: tuple[GoalEvent, ...] = ()
    clock: Micros = 0


class UpdateGoal(Struct, frozen=True, tag=True):
    """Give a goal that runs other fields: a new target of what follows. Refused, the old ones stand."""

    goal_id: str
    fields: dict[str, Any]
    """Those that change, as runtime values."""
    by: str = ""


class UpdateReplyInput(Struct, frozen=True, tag="UpdateReply"):
    """An agent answered an update of a goal."""

    reply: UpdateReply


class BadStatusInput(Struct, frozen=True, tag="BadStatus"):
    """An agent sent something unreadable, or that lies."""

    agent: str
    text: str


class TimerDue(Struct, frozen=True, tag=True):
    """An engine-time deadline is due."""

    timer: Timer


class WallDue(Struct, frozen=True, tag=True):
    """A wall-time deadline fired at wall time `at`."""

    timer: WallTimer
    at: Micros = 0


class EffectFailed(Struct, frozen=True, tag=True):
    """A goal, cancel, query or update did not get through ("unknown": it may have been executed)."""

    agent: str
    what: Literal["goal", "cancel", "query", "update"]
    goal_id: str
    outcome: Literal["unreachable", "unknown"]
    text: str = ""


class Started(Struct, frozen=True, tag=True):
    """The first input of an engine on its site: the epoch it got."""

    epoch: int


class Resumed(Struct, frozen=True, tag=True, kw_only=True):
    """The first input of an engine that goes on from a journal: what the engine cannot know of itself.

    Its state is that after the last step that was journaled; trees are rebuilt already.
    """

    epoch: int
    at: Micros
    """Engine time when the former engine was last alive."""
    since: Micros
    """Wall time then."""
    wall: Micros
    """Wall time now."""
    heard: Micros = 0
    """Now, on the clock that statuses are stamped with when they come in."""
    speed: float = 1.0
    """Engine seconds per wall second, of the former engine."""
    node_state: int = NODE_STATE_VERSION
    """Of what the former engine's nodes remembered."""
    rebuilt: dict[str, str] = {}
    """Open task -> bundle of the files that its tree was rebuilt from."""
    lost: dict[str, str] = {}
    """Open task -> why its tree could not be rebuilt."""
    poison: tuple[str, ...] = ()
    """Tasks that stopped the engine each time it resumed them: not rebuilt any more."""
    again: "tuple[CancelGoal | NotifyPeople | Alarm, ...]" = ()
    """Effects of the last commit: they may not have left."""
    taken_back: tuple[str, ...] = ()
    """Digests of approvals that were taken back, and the journal does not know it."""
    restored: bool = False
    """The journal was restored from a backup: what was done since nobody here knows, so a person must let everything go on."""


class Outage(Struct, frozen=True, tag=True, kw_only=True):
    """The engine itself stood still: its process was stopped, its machine slept, or one step or commit took long.

    Given by the driver before any deadline that came up and any message that came in meanwhile.
    """

    at: Micros
    """Engine time when the engine was last at work."""
    since: Micros
    """Wall time then."""
    wall: Micros
    """Wall time now."""
    heard: Micros = 0
    """Now, on the clock that statuses are stamped with when they come in."""
    speed: float = 1.0
    """Engine seconds per wall second."""


class JournalState(Struct, frozen=True, tag=True):
    """How the journal stands: `ok`, `slow`, `full`: it cannot be written, or `gone`: its files are missing or others.

    Given by the driver when that changes.
    """

    state: Literal["ok", "slow", "full", "gone"]
    text: str = ""
    """Why, and what to do."""


class NewsDelivered(Struct, frozen=True, tag=True):
    """How far each channel of the site's news has come; given by who delivers them, at most once a second."""

    marks: dict[str, NewsMark]


class Trouble(Struct, frozen=True):
    """Something that is wrong with the engine's own house. The same code and subject is the same trouble, whatever its text."""

    code: str
    subject: str
    """What it is about: `clock`, or a file's name."""
    text: str
    """What is wrong, and what a person can do."""


class HouseState(Struct, frozen=True, tag=True):
    """All that is wrong with the engine's own house now: its clock, its folder, secrets.

    Given at the start, and when that changes.
    """

    troubles: tuple[Trouble, ...]


class Behind(Struct, frozen=True, tag=True):
    """The engine's deadlines are given late, or (`late_us` 0) no longer. Given by the driver when that changes."""

    late_us: Micros
    """How late the earliest one is, engine time."""
    worst_us: Micros = 0
    """How late one was at most since the engine came late."""


Input = (
    Submit | Serve | Abort | Operator | LockdownOrder | Approve | Duty | AddAgent | RemoveAgent | Learn | AgentSeenInput
    | AgentGoneInput | AgentStatusInput | GoalEventInput | AgentEventInput | QueryReplyInput | UpdateGoal | UpdateReplyInput
    | BadStatusInput | TimerDue | WallDue | EffectFailed | Started | JournalState | Resumed | Outage | Behind
    | RuleOrder | Assign | Unassign | Prioritize | InService | AcknowledgeAlarm | HouseState | NewsDelivered
    | CloseRegion | OpenRegion
)  # fmt: skip

# -- effects -----------------------------------------------------------------------------------------------------------


class SendGoal(Struct, frozen=True, tag=True):
    """Send a goal (fields as wire values)."""

    goal_id: str
    agent: str
    action: str
    fields: dict[str, Any]
    epoch: int
    ttl_beats: int
    safety: bool = False
    clearance: Clearance | None = None
    link_silence_s: float | None = None
    task: str = ""


class CancelGoal(Struct, frozen=True, tag=True):
    """Ask for the cancellation of a goal."""

    goal_id: str
    agent: str
    action: str = ""


class QueryGoal(Struct, frozen=True, tag=True):
    """Ask an agent about goals; none named = all that it remembers as running."""

    agent: str
    goal_ids: tuple[str, ...] = ()


class UpdateGoalFields(Struct, frozen=True, tag=True):
    """Send other fields (as wire values) for a goal that runs."""

    goal_id: str
    agent: str
    action: str
    n: int
    fields: dict[str, Any]
    epoch: int
    ttl_beats: int


class NotifyPeople(Struct, frozen=True, tag=True):
    """Tell people."""

    text: str
    to: tuple[str, ...]
    severity: Literal["info", "warning", "alarm"]
    task: str = ""


class Alarm(Struct, frozen=True, tag=True):
    """Something that a person must act on."""

    code: str
    text: str
    task: str = ""
    agent: str = ""
    about: str = ""
    """What of the engine's own house it is about, if it is."""


class PublishState(Struct, frozen=True, tag=True):
    """A task's state changed in a way that people see."""

    task: str
    status: str
    code: str = ""
    reason: str = ""


Effect = SendGoal | CancelGoal | QueryGoal | UpdateGoalFields | NotifyPeople | Alarm | PublishState


class EngineStep(Struct, frozen=True):
    """One input handled at one instant. `reply` answers the caller of an order."""

    seq: int
    at: Micros
    input: Input
    changes: tuple[Change, ...]
    effects: tuple[Effect, ...]
    reply: Reply | None = None
