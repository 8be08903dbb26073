"""The engine's state as frozen records: tasks, agents, goals, questions, clearances.

Written only by `state.apply`; everything here is data that a journal can keep and a new process can load.
"""

from collections.abc import Mapping
from typing import Any, Final, Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.machines import Mobility
from formiga_bt.engine.kernel.causes import HoldCause, in_words
from formiga_bt.engine.kernel.rule_records import RuleCause
from formiga_bt.engine.kernel.timers import Timer
from formiga_bt.lang.forms import FormField
from formiga_bt.nodes.ends import Drain
from formiga_bt.nodes.run import Failure, Served, TaskOutcome
from formiga_bt.safety.traffic import TakenArea
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.messages import AgentError, Clearance, Control, Landed, PreflightCheck

TaskStatus = Literal["PENDING", "ASSIGNED", "ACTIVE", "ENDING", "SUCCEEDED", "FAILED", "CANCELED"]
Priority = Literal["low", "medium", "high"]
IfLate = Literal["run", "drop", "fail"]
"""What becomes of a task at its deadline: it goes on, it ends if it has not begun, it ends in any case."""
PRIORITIES: Final[dict[str, int]] = {"high": 0, "medium": 1, "low": 2}
"""Order of service: lower first."""
LOW_AGES_US: Final[Micros] = 3600 * SECOND
"""A LOW request that has waited so long is served as MEDIUM."""
UNSAID_US: Final[Micros] = 3600 * SECOND
"""A task of which nobody said by when it is to end stands in the queue as if so long after its request."""

Again = Literal["", "preempted", "agent_lost", "restart"]
"""Why a task is ended to begin anew."""

Liveness = Literal["ALIVE", "SUSPECT", "LOST"]
Pool = Literal["STANDBY", "ASSIGNED", "EXECUTING ACTION", "PARKED_AWAY", "QUARANTINED"]

GoalState = Literal[
    "gated", "sent", "accepted", "running", "canceling", "interrupted",
    "rejected", "succeeded", "failed", "canceled", "taken_over", "superseded", "lost", "in_doubt", "gate_refused", "again",
]  # fmt: skip
ENDED: Final[frozenset[str]] = frozenset(
    {
        "rejected",
        "succeeded",
        "failed",
        "canceled",
        "superseded",
        "taken_over",
        "lost",
        "in_doubt",
        "gate_refused",
        "again",
    }
)
"""Goal states after which nothing more is waited for. `again`: a person said continue, the step sends its next attempt."""
IN_FLIGHT: Final[frozenset[str]] = frozenset({"sent", "accepted", "running", "canceling"})
"""Goal states in which the agent has, or may have, the goal. `interrupted` (by a pilot or a stop) waits for a person's word."""

BUSY: Final = ("spot_busy", "leg_busy", "port_busy", "route_busy")
"""Codes of waits at the gate for another machine."""

STOPPED: Final = "stopped"
"""Why a goal is canceled, and then interrupted: an order stands on its machine."""
GO_ON: Final = "go_on"
"""The same, but a person said continue before the machine had stopped: then its step sends its next attempt at once."""

Stop = Literal["hold", "return", "land", "cut"]
"""The four stops."""


class StandingOrder(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An order on one machine that ranks above its task: of a person, of lockdown, or of the engine after a breach.

    While it stands, nothing but its own safety goals goes to the machine, and no task is granted it.
    """

    agent: str
    stop: Stop
    by: str
    scope: Literal["agent", "task", "all", "lockdown", "engine"]
    """What it was given for: it stands until `continue` of that, the end of that task, the release, or (engine) it is done."""
    why: str = ""
    """`envelope.<name>` for the engine's own."""
    at: Micros
    state: Literal["open", "done", "failed"] = "open"
    task: str = ""
    """The system task that carries it out, or the task whose recover does."""
    goal: str = ""
    """The safety goal of a `cut`."""

    @property
    def brings_down(self) -> bool:
        """Return whether it brings its machine home, or down, and has not done so yet."""
        return self.stop in ("return", "land") and self.state == "open"


class Lockdown(Struct, frozen=True):
    """Nothing starts and nothing goes on; what flies does `how`."""

    how: Literal["hold", "return", "land"]
    by: str
    at: Micros


class Closure(Struct, frozen=True):
    """A region that a person closed: no machine enters it."""

    region: Region
    reason: str
    by: str
    at: Micros


class Approval(Struct, frozen=True, kw_only=True):
    """A person approved a task as it is: its texts, what it uses of the catalogue, and the site with its fences."""

    task: str
    by: str
    at: Micros


class Member(Struct, frozen=True, kw_only=True):
    """A person added this agent to the fleet: it is listed as those of the site file are."""

    type: str
    home: str = ""
    """Its own port or station; "" = it has none."""
    by: str = ""
    at: Micros = 0
    """When, engine time."""


class Discovered(Struct, frozen=True, kw_only=True):
    """An action that agents announce and that no catalogue of the site has."""

    text: str
    """As a catalogue would write it."""
    types: tuple[str, ...]
    """Of the agents that announce it."""
    agents: tuple[str, ...]
    fault: str = ""
    """Why it cannot be used, or empty."""
    known: bool = False
    """Tasks may use it."""
    by: str = ""
    """Who said so; "" = the site is in mode simulation."""
    at: Micros = 0


class Recovering(Struct, frozen=True):
    """The way home of one agent at its release: the number of the try, and how it stands."""

    agent: str
    attempt: int
    state: Literal["running", "waiting", "done", "failed"]
    """`waiting`: the next try comes after a pause."""
    way: Literal["recover", "fetch", "land"] = "recover"
    """Which subtree of its type flies it."""
    first: int = 1
    """The number of the first try since it was last granted: blocks of one task may get a machine more than once."""

    @property
    def section(self) -> str:
        """Return the section of its task that it is, which is also the scope of its names."""
        return f"recover:{self.agent}#{self.attempt}"

    @property
    def tries(self) -> int:
        """Return the how-manieth try since then this is."""
        return self.attempt - self.first + 1


class Cleanup(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The `finally` of a stopped sequence."""

    id: str
    path: str
    """Of its sequence."""
    scope: str
    owner: str = ""
    """Node key to wake at its end; `!task` = the task's drain."""
    state: Literal["waiting", "running", "stopping", "ended"]
    after: Drain = ()
    """What it begins after, or (stopping) ends after."""
    error: Failure | None = None

    @property
    def ended(self) -> bool:
        """Return whether nobody needs to wait for it any more."""
        return self.state == "ended"


class AgentEventRecord(Struct, frozen=True):
    """An event that an agent told of itself."""

    agent: str
    event: str
    order: int
    """Counts all of them."""
    boot_id: str
    n: int
    at: Micros
    """Engine time of its arrival."""
    fields: dict[str, Any]
    attachments: tuple[Attachment, ...] = ()


class Version(Struct, frozen=True):
    """A version of a task that is served, or was."""

    order: int
    """When it came, among those of all names; 0: it was there from the start."""
    n: int
    """Which of its name it is, from 1; what people are told."""
    bundle: str


class FoundMachine(Struct, frozen=True):
    """How a machine was found that is not as it was left when the engine went away."""

    change: str
    """In words, after its id: `landed`."""
    flew: bool = False
    """It was in the air, and did nothing that lands."""


class Paused(Struct, frozen=True, array_like=True):
    """A deadline that stands still: what is left of it."""

    timer: Timer
    left_us: Micros


class TaskClock(Struct, frozen=True, omit_defaults=True):
    """A task's own clock. While the task is HELD for more than clearances it stands still, and so do its deadlines."""

    stood_us: Micros = 0
    """For how long it has stood still by now, without the present stand."""
    stands_since: Micros | None = None
    paused: tuple[Paused, ...] = ()

    def at(self, now: Micros) -> Micros:
        """Return what it shows."""
        return (now if self.stands_since is None else self.stands_since) - self.stood_us

    def left_of(self, timer: Timer) -> Micros | None:
        """Return what is left of a deadline that stands still, or None."""
        return next((one.left_us for one in self.paused if one.timer == timer), None) if self.paused else None

    def without(self, timer: Timer) -> "TaskClock":
        """Return the clock without a deadline that stands still."""
        return replace(self, paused=tuple(one for one in self.paused if one.timer != timer)) if self.paused else self

    def resumed(self, now: Micros) -> "TaskClock":
        """Return the clock as it runs again."""
        since = now if self.stands_since is None else self.stands_since
        return replace(self, stood_us=self.stood_us + now - since, stands_since=None)


class Releasing(Struct, frozen=True, omit_defaults=True):
    """An agent is given back: the node that waits for it, and what must end before the agent goes home."""

    owner: str
    after: Drain = ()


class TaskWhen(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """When a request may be served, and by when its task is to have ended; engine time, microseconds."""

    not_before: Micros | None = None
    after: tuple[str, ...] = ()
    """Tasks that must have SUCCEEDED first."""
    deadline: Micros | None = None
    if_late: IfLate = "run"


class TaskRequest(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What was requested, and by whom; only its priority may change, while it waits."""

    bundle: str
    version: int = 1
    """Which version of its name it runs (`Version.n`)."""
    library: int = 0
    """`Version.order` of the newest version of any name when a person requested it, or the first task of its family."""
    priority: Priority = "medium"
    by: str = ""
    wait: Micros | None = None
    """How long each run waits for its first agents, if its request said so."""
    expires: Micros | None = None
    """The longest time PENDING of each run, likewise."""
    when: TaskWhen = TaskWhen()
    params: dict[str, Any] = {}
    """A restart begins with them."""
    cause: RuleCause | None = None
    """The standing rule that requested it, or the first task of its family."""
    key: str = ""
    """With which it was requested: the same request once more is answered with this task, also after a start."""
    asked: str = ""
    """A digest of that request."""


class TaskFamily(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The task that requested it, if no person did, and those that it requested."""

    parent: str = ""
    node: str = ""
    """Of the parent: it waits for the end of this task."""
    depth: int = 0
    """How many tasks requested each other before it."""
    detached: bool = False
    """It outlives its parent."""
    children: tuple[str, ...] = ()
    """Tasks that it requested in this run."""


class TaskAgents(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The agents that it has, had, and gives back."""

    roles: dict[str, tuple[str, ...]] = {}
    """Role -> agents that it holds now."""
    granted: tuple[str, ...] = ()
    """Every agent the task was granted, in order of grant."""
    served: dict[str, Served] = {}
    """Node of a `with_agents` -> the allocator's answer to it, until the node takes it."""
    rebinds: tuple[str, ...] = ()
    """Agents that blocks got in roles with `if_lost: rebind`."""
    releasing: dict[str, Releasing] = {}
    """Agents on their way back to the pool before the task ends."""
    recovering: tuple[Recovering, ...] = ()
    pilot: str = ""
    """The pilot on duty for it (`mode: real`)."""


class ResourceClaim(Struct, frozen=True, omit_defaults=True):
    """Units of resources that a block of a task holds."""

    units: dict[str, int]
    """By resource."""
    at: Micros
    """Since when."""
    left: bool = False
    """Its block failed or was stopped: the claim goes once `after` is over, or with a task that ends so, with its machines."""
    after: Drain = ()


class TaskResources(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The resources of the site that it holds."""

    claims: dict[str, ResourceClaim] = {}
    """Node of a `with_resource` -> what it holds."""

    @property
    def units(self) -> dict[str, int]:
        """Return the units that it holds in all, by resource."""
        found: dict[str, int] = {}
        for claim in self.claims.values():
            for name, units in claim.units.items():
                found[name] = found.get(name, 0) + units
        return found


class TaskHold(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """HELD: why, and the task's clock, which stands still meanwhile."""

    causes: tuple[HoldCause, ...] = ()
    """None: it is not held."""
    found: dict[str, FoundMachine] = {}
    """While HELD (resume): its agents that were not as the engine had left them."""
    clock: TaskClock = TaskClock()

    @property
    def words(self) -> tuple[str, ...]:
        """Return the causes as they are shown."""
        return tuple(in_words(cause) for cause in self.causes)


class TaskEvents(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Which events of agents it has not taken yet."""

    since: int = 0
    """`AgentEventRecord.order` of the last event before its run was admitted."""
    taken: dict[str, int] = {}
    """`<agent>|<event>` -> order of the last one that a step took."""


class TaskEnding(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What of it was stopped and is not over yet, and how a person wants it to end."""

    stopping: bool = False
    """The section was stopped and its goals drain."""
    drain: Drain = ()
    """What the next part waits for."""
    cleanups: tuple[Cleanup, ...] = ()
    """Each `finally` of a stopped sequence that is not over."""
    abort_now: bool = False
    """The parts before `recover` are passed over."""
    abort_reason: str = ""


class TaskRestart(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Beginning anew: why it is done now, why it was done before, and whether it may be."""

    why: Again = ""
    """It is being ended to begin anew: after its release it is PENDING with run + 1."""
    spent: bool = False
    """An action that may not be repeated was sent in this run: no preemption, no rebinding."""
    past: tuple[str, ...] = ()
    """Why each earlier run was ended to begin anew, in words."""
    taken_back: tuple[str, ...] = ()
    """Agents that a person took back: it gets them again only by a person's word."""


class TaskFile(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A file that an agent named for a task."""

    agent: str
    what: str
    """The action, or the event of the agent's own."""
    goal: str = ""
    """Of the action."""
    at: Micros
    """When it was named."""
    file: Attachment


class TaskFiles(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The files that belong to it; their bytes are elsewhere."""

    found: tuple[TaskFile, ...] = ()
    """Oldest first."""


class TaskTimes(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Engine times of its life; None: not yet, in this run."""

    submitted_at: Micros = 0
    assigned_at: Micros | None = None
    active_at: Micros | None = None
    ended_at: Micros | None = None


class SystemOrder(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What makes a task one of the engine's own; empty: it is none."""

    agent: str = ""
    """The machine that it commands."""
    stop: Literal["", "hold", "return", "land", "cut"] = ""
    """The order that it carries out: it borrows the machine, which stays its task's."""


class TaskRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A task: what changes together is one part of it. `section` is the part of the tree that runs."""

    id: str
    name: str
    order: int
    """Of admission; tasks are visited in it."""
    status: TaskStatus = "PENDING"
    section: Literal["", "steps", "on_failure", "on_abort", "finally", "recover", "done"] = ""
    run: int = 1
    """The how-manieth: each restart is another one."""
    request: TaskRequest
    family: TaskFamily = TaskFamily()
    agents: TaskAgents = TaskAgents()
    resources: TaskResources = TaskResources()
    hold: TaskHold = TaskHold()
    events: TaskEvents = TaskEvents()
    ending: TaskEnding = TaskEnding()
    outcome: TaskOutcome = TaskOutcome()
    restart: TaskRestart = TaskRestart()
    times: TaskTimes = TaskTimes()
    files: TaskFiles = TaskFiles()
    system: SystemOrder = SystemOrder()

    @property
    def ended(self) -> bool:
        """Return whether it has its terminal status."""
        return self.section == "done"

    @property
    def attached(self) -> bool:
        """Return whether it will end with the task that requested it."""
        return bool(self.family.parent) and not self.family.detached and not self.ended

    def cleanup(self, cleanup_id: str) -> Cleanup | None:
        """Return the `finally` with this id that is not forgotten."""
        return next((cleanup for cleanup in self.ending.cleanups if cleanup.id == cleanup_id), None)


TaskPart = Literal[
    "request",
    "family",
    "agents",
    "resources",
    "hold",
    "events",
    "ending",
    "outcome",
    "restart",
    "times",
    "files",
    "system",
]
"""The fields of a `TaskRecord` that are parts."""


def family(tasks: Mapping[str, TaskRecord], task_id: str) -> tuple[str, ...]:
    """Return a task, then those that it requested and that end with it, and theirs: what has not ended.

    A copy of the state may have forgotten children that ended long ago (`show.history.ledger`).
    """
    mine = [child for child in tasks[task_id].family.children if child in tasks and tasks[child].attached]
    return (task_id, *(one for child in mine for one in family(tasks, child)))


class AgentRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An agent as the fleet knows it."""

    id: str
    type: str
    mobility: Mobility = "air"
    shared: bool = False
    actions: tuple[str, ...] = ()
    refused_actions: dict[str, str] = {}
    """What of its card cannot be used (actions by name), and why (`engine.agents.announced`)."""
    present: bool = False
    """Its presence token stands."""
    wire: str = ""
    """The wire that it is on."""
    lacks: tuple[str, ...] = ()
    """What that wire does not guarantee (`base.wires`)."""
    liveness: Liveness = "LOST"
    pool: Pool = "STANDBY"
    task: str = ""
    role: str = ""
    goal: str = ""
    """The goal in flight."""
    action: str = ""
    home: str = ""
    """Its own port's name."""
    layer_m: float | None = None
    lost_leg: tuple[Position, Position] | None = None
    """The way that it was on when it was lost, or did not confirm that it stopped: it may have gone on, so all of it stays
    reserved until it says that it stands on the ground, is asked what it still does, or flies another."""
    lost_area: TakenArea | None = None
    """The area that it explored then, likewise."""
    battery: float | None = None
    position: Position | None = None
    initial: Position | None = None
    landed: Landed = "unknown"
    stood_at: Place | None = None
    """Where it was last known to stand on the ground: near it, it may be low."""
    control: Control = "unknown"
    avoids: bool = False
    """It says that it keeps away from obstacles by itself."""
    on_route: tuple[str, ...] = ()
    """Nodes and edges of the site's routes that it takes up: it was sent there, or stands there, and has not said since that it
    is out of them."""
    aside: str = ""
    """An end of the routes that it is to come to first, out of the way of others."""
    inside: tuple[str, ...] = ()
    """Resources with a region that it takes up: it was on its way in, or inside, and has not said since that it is out."""
    word: str = ""
    """The agent's own status word."""
    payload_kg: float = 0.0
    wind: tuple[float, float] | None = None
    """East and north, m/s, where it blows to, as the machine feels it."""
    checks: tuple[PreflightCheck, ...] = ()
    heading_deg: float | None = None
    speed_m_s: float | None = None
    floor: str = ""
    charging: bool | None = None
    errors: tuple[AgentError, ...] = ()
    """What is wrong with it, in its own words."""
    fields: dict[str, Any] = {}
    """What its type says besides, as runtime values of the catalogue's types."""
    refused_fields: dict[str, str] = {}
    """Fields of its newest status that are not of their types, and why."""
    on_link_loss: str = ""
    limits: dict[str, float] = {}
    """What it announces of itself, SI by name; its type's numbers hold for the rest."""
    out: str = ""
    """Why a person took it out of service, or empty: no task is granted it."""
    out_by: str = ""
    taken: bool = False
    """A pilot or its own failsafe took it over, and no person has handed it back yet."""
    breach: str = ""
    """The limit of its envelope that it breaks now; a `!` before it: its landing is finished first, then its task ends."""
    boot_id: str = ""
    former: tuple[str, ...] = ()
    """Processes of it that were heard before this one (`engine.agents.process_identity`)."""
    boot_wall: Micros = 0
    """Wall time since which this one is, or since which it and another speak in turn."""
    rebooted: bool = False
    """Its process was started anew, and it has not said since that it flies: nothing but stops is sent to it until a person
    clears it or a task is granted it. One that flies keeps its way home."""
    twice_wall: Micros = 0
    """Wall time at which a second one was last heard beside it, to a second."""
    seq: int = -1
    stamp: Micros = 0
    """Engine time of the newest status as stamped by the agent; it may be ahead by some minutes."""
    stray_stamp: Micros = 0
    """Stamp of a status that does not count up but is newer, since the last one that did (`process_identity`); 0: none."""
    stray_wall: Micros = 0
    """Wall time of its arrival."""
    epoch: int = 0
    """The engine's epoch that it follows, as it says; 0: it does not say."""
    epoch_ignored: int = 0
    """The newest epoch that it ignored because it is out of bounds."""
    engine_id: str = ""
    """The engine that it follows, as it says."""
    site: str = ""
    """The version of the site message that it has, as it says."""
    heard_at: Micros = 0
    """Engine time of arrival of the newest status."""
    heard_wall: Micros = 0
    bad: int = 0
    """Bad messages counted."""
    quarantine: str = ""
    """Why it is quarantined."""
    refused: str = ""
    """Why this agent is not admitted (`engine.agents.admission`), or empty."""
    refused_at_rest: str = ""
    """Why it will not be, once it rests and nothing holds it: until then it can be stopped, and gets no new task."""
    told_late: str = ""
    """The question of which a person was last told that the answer came too late."""
    order: int = 0

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        return self.mobility == "people"

    @property
    def flies(self) -> bool:
        """Return whether the rules of flight hold for it."""
        return self.mobility == "air"

    @property
    def said_at(self) -> Micros:
        """Return the engine time of the newest status: its stamp, but not later than its arrival."""
        return min(self.stamp, self.heard_at)

    @property
    def is_reachable(self) -> bool:
        """Return whether a goal would reach it now."""
        return self.present and self.liveness == "ALIVE"

    @property
    def may_be_airborne(self) -> bool:
        """Return whether it flies for all that is known: one that was lost on its way up from the ground, too."""
        return self.flies and (self.landed != "grounded" or self.lost_leg is not None or self.lost_area is not None)


class GoalUpdate(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Other fields of a goal that runs, on their way: until its agent answers it may follow the old ones or these."""

    n: int
    fields: dict[str, Any]
    """All fields as they will be."""
    changed: tuple[str, ...]
    """Which of them differ."""
    tracked: bool = False
    """Its own step asks for it: a refusal is the step's matter, and no alarm."""


class GoalRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A goal, from the leaf's wish to its end. `ended` goals go when their owner has taken the outcome."""

    id: str
    agent: str
    action: str
    rest_of: str = ""
    """The action of its step, if this one does what is left of it (the climb of a TakeOff that was broken off in the air), or
    an edge of the way to it."""
    task: str = ""
    owner: str = ""
    """Node key to wake; `!task` = the task's drain, `!question` = the queue of questions, `!none` = nobody."""
    section: str = ""
    fields: dict[str, Any] = {}
    state: GoalState = "gated"
    code: str = ""
    """Gate's or agent's code."""
    text: str = ""
    breach: float | None = None
    """Of a limit that the gate refused it for: how far it would have gone, SI, percent 0..100."""
    n: int = -1
    result: dict[str, Any] = {}
    safety: bool = False
    repeatable: bool = True
    cancel_asked: bool = False
    cancel_why: str = ""
    order: int = 0
    at: Micros = 0
    """When it was ordered."""
    sent_at: Micros | None = None
    progress: float | None = None
    phase: str = ""
    leg: tuple[Position, Position] | None = None
    """The straight way that the gate granted."""
    area: TakenArea | None = None
    """The area at one height that it explores: nobody else may come near while it does."""
    updates: int = 0
    """The highest number of an update of its fields."""
    update: GoalUpdate | None = None
    """The newest one, until its agent has answered it."""
    no_update: str = ""
    """Why its agent did not take the newest one; empty = it took it, or has not answered."""
    also: tuple[Position, Position] | None = None
    """Another way that it may be on: that of its update until it is answered, then the one before until the next status."""
    turned_at: Micros | None = None
    """When its agent took the newest update."""
    path: tuple[str, ...] = ()
    """Of a drive on the site's routes: the nodes that are still ahead, the last one where it ends."""
    released: int = 0
    """So many of them the machine may drive to; 0 while it waits."""
    clearance: Clearance | None = None
    cleared: Place | None = None
    """The spot that the clearance is for."""

    @property
    def goes_on(self) -> bool:
        """Return whether its success is only a part of its way: its step sends another one then."""
        return bool(self.path and self.rest_of)

    @property
    def ended(self) -> bool:
        """Return whether the goal has a terminal state."""
        return self.state in ENDED

    @property
    def in_flight(self) -> bool:
        """Return whether the agent has, or may have, the goal."""
        return self.state in IN_FLIGHT

    @property
    def ends(self) -> tuple[Position, ...]:
        """Return where its way may end."""
        return tuple(way[1] for way in (self.leg, self.also) if way is not None)

    @property
    def stopping(self) -> bool:
        """Return whether an order cancels it now: it will be interrupted."""
        return self.state == "canceling" and self.cancel_why == STOPPED


class Answer(Struct, frozen=True, omit_defaults=True):
    """One person's answer."""

    by: str
    answer: str
    at: Micros
    form: dict[str, Any] = {}
    """What was filled in."""


class Question(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A question to people; shown to each person as a Confirm goal `<id>~<person>`."""

    id: str
    number: str
    """`Q7`, for people."""
    task: str
    priority: Priority
    kind: Literal["ask", "clearance"]
    text: str
    note: str = ""
    options: tuple[str, ...]
    tiers: tuple[tuple[str, ...], ...]
    tier: int = 0
    policy: Literal["any", "all"] = "any"
    escalate_us: Micros | None = None
    expires_at: Micros | None = None
    if_no_answer: str = ""
    clears: str = ""
    clears_on: tuple[str, ...] = ()
    form: tuple[FormField, ...] = ()
    owner: str = ""
    asked_at: Micros = 0
    answers: tuple[Answer, ...] = ()
    declined: tuple[str, ...] = ()
    """People whose app refused or failed to show it; they are not asked again."""
    again: tuple[str, ...] = ()
    """Whose app slept until the prompt was too old; each entry is one more showing, under a goal id of its own."""
    reply: dict[str, Any] | None = None
    order: int = 0

    def showing(self, person: str) -> str:
        """Return the id of the Confirm goal that shows it to a person now."""
        times = self.again.count(person)
        return f"{self.id}~{person}" + (f"#{times + 1}" if times else "")

    @property
    def asked(self) -> tuple[str, ...]:
        """Return the people asked so far, each once."""
        return tuple(dict.fromkeys(p for tier in self.tiers[: self.tier + 1] for p in tier))


class ClearanceRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The engine's own question whether people stand clear of one machine's start or landing."""

    agent: str
    task: str
    goal: str
    n: int
    state: Literal["asked", "waiting", "given"]
    opened_at: Micros
    by: str = ""
    given_at: Micros | None = None
    place: Place | None = None
    """The spot that the word is for."""
    here: Place | None = None
    """Where the machine was when it was asked for, or given."""
    landed: Landed = "unknown"
    """Whether it stood there."""


class Before(Struct, frozen=True):
    """A machine of a task as it was last known before the engine was away."""

    boot_id: str
    seq: int
    control: str
    landed: tuple[str, ...]
    """What it may be now, by what it was doing."""
    port: str
    """On whose port it stood; "" = in the air, or elsewhere."""
    position: Position | None
    """Where it stood or hovered; None: it was on its way."""


class Resuming(Struct, frozen=True, kw_only=True):
    """The engine was away, and not all is known again of what happened meanwhile.

    | phase | what |
    |---|---|
    | asking | machines tell what became of their goals; no timer fires, no goal leaves |
    | overdue | deadlines that passed meanwhile fire, in order; no goal leaves yet |
    | watching | all goes on; only some machines were not heard of yet |
    """

    phase: Literal["asking", "overdue", "watching"]
    since: Micros
    """Wall time when the engine was last alive."""
    at: Micros
    """Engine time then."""
    outage_us: Micros
    """Wall time until it was there again."""
    speed: float = 1.0
    """Engine seconds per wall second then."""
    until: Micros = 0
    """Deadlines up to this instant are overdue."""
    waits: tuple[str, ...] = ()
    """Agents with a goal in doubt that have not told of it."""
    unheard: tuple[str, ...] = ()
    """Agents that have not announced themselves again."""
    before: dict[str, Before] = {}
    cancels: tuple[tuple[str, str, str], ...] = ()
    """Agent, goal and action of cancels that may not have left, of goals that are forgotten here."""
    stood: bool = False
    """The engine's process stood still; it did not end, so what its agents do not know of surely never left it."""

    def is_expired(self, sent_at: Micros | None, life_s: float) -> bool:
        """Return whether a goal that was sent before the engine was away is older than its life, the outage counted."""
        if sent_at is None or sent_at > self.at:
            return False
        return self.outage_us + (self.at - sent_at) / self.speed > life_s * SECOND


class Wakes(Struct, frozen=True, omit_defaults=True):
    """What a task has used of its budget of wakes (`engine.kernel.pace`)."""

    spent: Micros = 0
    """Its budget is spent up to this instant; up to a second before now is saved up."""
    since: Micros | None = None
    """Its deadlines are rounded up since then."""
    rounded: Micros | None = None
    """When one was last."""
    path: str = ""
    """Of which node."""


class Deadline(Struct, frozen=True):
    """An engine-time deadline; `seq` breaks ties in the order of setting. `task` owns it, if any."""

    at: Micros
    seq: int
    task: str = ""
    pausable: bool = False


def request_id(task: str, node: str) -> str:
    """Return the id of the request of a task, or of a block of it."""
    return f"{task}|{node}" if node else task


def holder_of(request: str) -> str:
    """Return the task that a request is of, by its id."""
    return request.partition("|")[0]


class AgentRequest(Struct, frozen=True, kw_only=True):
    """A waiting task as the allocator sees it (`/allocation/requests/<id>`): expressions are already values."""

    holder: str
    """The task that will hold the agents."""
    node: str = ""
    """Key of the block that asks, of a task that runs already; "" = the task itself, before its first step."""
    priority: Priority
    order: int
    due: Micros = 0
    """By when its task is to end, said or not; of one priority the earliest is served first."""
    pin: int = 0
    """Above 0: a person put it first, before those with less."""
    at: Micros
    roles: tuple["RoleRequest", ...]
    expires: Micros | None = None
    reserves: bool = False
    """It waits long enough, or others step aside for it: it keeps fitting agents from requests after it."""
    preempting: dict[str, int] = {}
    """Tasks that step aside for it now -> the run that they end."""
    wait_left: Micros | None = None
    """What is left of the roles' `wait`, which stands still meanwhile."""
    units: dict[str, int] = {}
    """Of a `with_resource`, which has no roles: what it asks for, by resource."""
    not_before: Micros | None = None
    """It is not served before then; None: that time has come, or there is none."""
    after: tuple[str, ...] = ()
    """Tasks that must have SUCCEEDED before it is served, and have not yet."""

    @property
    def is_ripe(self) -> bool:
        """Return whether it may be served now."""
        return self.not_before is None and not self.after

    def served_as(self, now: Micros) -> Priority:
        """Return its priority as it counts now."""
        return "medium" if self.priority == "low" and now - self.at >= LOW_AGES_US else self.priority

    def rank(self, now: Micros) -> tuple[int, int, Micros, int]:
        """Return its place in the queue: lower is served first."""
        return PRIORITIES[self.served_as(now)], -self.pin, self.due, self.order

    @property
    def task(self) -> str:
        """Return its id."""
        return request_id(self.holder, self.node)


class RoleRequest(Struct, frozen=True, kw_only=True):
    """One role of a request."""

    role: str
    types: tuple[str, ...]
    shared: bool
    """Several tasks may address who has it (people, devices): it is granted to each, and held by none."""
    count: int = 1
    more: int = 0
    """So many beyond `count` are taken too, if they fit and are free."""
    is_list: bool = False
    id: str = ""
    near: tuple[Any, ...] = ()
    """Places; one, or one per agent."""
    prefer: str = ""
    battery_min: float = 0.0
    away: bool = False
    actions: tuple[str, ...] = ()
    wait_until: Micros | None = None
    but_not: tuple[str, ...] = ()
    """Agents that failed in an earlier attempt."""
    preempt: bool | None = None
    """Of a HIGH task: true = others step aside also for what it takes beyond `count`; false = for nothing."""
    rebind: bool = False
    """Whether the task begins anew if the agent is lost (of a block; the model tells it of a task's own roles)."""
    by_hand: tuple[str, ...] = ()
    """Agents that a person gave it, while others are lacking: they are kept for it."""
    taken_back: tuple[str, ...] = ()
    """Agents that a person took back from its task."""

    @property
    def is_full_by_hand(self) -> bool:
        """Return whether persons have given it all that it takes."""
        return len(self.by_hand) >= self.count + self.more


class Verdict(Struct, frozen=True):
    """What the allocator thought of one agent for one role: a filter's code, or its cost."""

    role: str
    agent: str
    code: str
    """`chosen`, `fits` (another cost less, or the team is not complete), or the filter that refused it.

    For a HIGH request also `preempting` (its task, the detail, steps aside) and `kept` (its task, the detail, may not be
    preempted now: see `why`).
    """
    cost: float | None = None
    """Metres."""
    detail: str = ""
    """Of one that is short of charge the numbers; of a busy one its task."""
    short: int = 0
    """Points of charge that the job leaves less than a comfortable margin: counted in its cost (`allocator.cost`)."""
    why: str = ""
    """Of `kept`: the code of `allocator.preemption`."""
