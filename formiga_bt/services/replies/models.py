"""What crosses the HTTP API, as pydantic models: they validate requests and make the OpenAPI document.

Words and units as everywhere: percent 0..100, metres, seconds in `_s`, instants of engine time in `unix_millis_*`.
"""

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from formiga_bt.services.replies.order_models import LockdownOut, StandingOrderOut

Id = Annotated[str, Field(min_length=1, max_length=200)]
Name = Annotated[str, Field(max_length=200)]

LONGEST_S: Final = 30 * 86400.0
"""That a request may say it waits."""


class RequestBody(BaseModel):
    """A request; a key that nobody reads is a mistake of its writer."""

    model_config = ConfigDict(extra="forbid")


class SubmitBody(RequestBody):
    """Start a task. Each parameter is a text as on the command line ("60 m", "camp", "66.501,25.703") or JSON."""

    task: Id
    params: dict[str, Any] = {}
    priority: Literal["low", "medium", "high"] | None = None
    by: Name = ""
    """Who requests it."""
    bundle: Annotated[str, Field(max_length=64)] = ""
    """Of the version that is meant, as GET /v1/library lists it; empty: the newest."""
    wait_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = None
    """How long at most it waits for its first agents, instead of what its roles say; then it ends FAILED `no_agent`."""
    expires_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = None
    """The longest time PENDING, instead of the task's own; then it ends FAILED `task_expired`."""


class AbortBody(RequestBody):
    """End a task. `now` skips its cleanup; `abandon` leaves its agents quarantined where they are, and must be confirmed."""

    how: Literal["", "now", "abandon"] = ""
    confirmed: bool = False
    by: Name = ""


class ByBody(RequestBody):
    """Who gives the order."""

    by: Name = ""


class RemovedBody(RequestBody):
    """A person took a lost machine away, and says so: `confirmed` must repeat its id."""

    confirmed: Name = ""
    by: Name = ""


class AnswerBody(RequestBody):
    """An answer to a question; `by` is the person's agent id, needed if several people of this desk are asked."""

    option: Id
    by: Name = ""


class EventBody(RequestBody):
    """An event that a person at this desk tells; the fields as text ("60 m", "camp") or JSON."""

    event: Id
    fields: dict[str, Any] = {}


class Problem(BaseModel):
    """An error (application/problem+json)."""

    type: str = "about:blank"
    title: str
    status: int
    code: str
    text: str
    hint: str = ""
    problems: list[str] = []


class Reply(BaseModel):
    """An order was taken."""

    ok: Literal[True] = True
    text: str = ""


class Submitted(BaseModel):
    """A task was taken; follow it at `/v1/tasks/{id}`."""

    id: str


class FailureOut(BaseModel):
    """The step that failed first, and why."""

    code: str
    reason: str
    step: str
    place: str
    agent: str


class TaskOut(BaseModel):
    """A task."""

    id: str
    task: str
    bundle: str = ""
    """Of the version that it runs."""
    version: int = 1
    newest: int = 1
    """The version of its name that new requests get."""
    status: Literal["PENDING", "ASSIGNED", "ACTIVE", "ENDING", "SUCCEEDED", "FAILED", "CANCELED"]
    held: list[str]
    """Causes of HELD: operator, operator:<agent>, clearance:<agent>, take-over:<agent>, lockdown, resume. Empty: not held."""
    orders: list[StandingOrderOut]
    """Orders that stand on its machines."""
    throttled: bool = False
    """Its clocks would wake it more often than one task may be woken: its waits are made longer."""
    section: str
    priority: str
    by: str
    """Who requested it."""
    parent: str = ""
    """The task that requested it; empty: a person did."""
    children: list[str] = []
    """Tasks that it requested in this run."""
    run: int
    outcome: str
    code: str
    reason: str
    roles: dict[str, list[str]]
    agents: list[str]
    """Every agent it was granted, in order."""
    unix_millis_submitted: int
    unix_millis_active: int | None
    unix_millis_ended: int | None
    duration_s: float
    """Since its request, engine time."""


class NodeOut(BaseModel):
    """A step that runs now."""

    node: str
    title: str
    place: str


class GoalOut(BaseModel):
    """A goal under way, or waiting at the gate (`gated`, with a code)."""

    id: str
    agent: str
    action: str
    state: str
    code: str
    text: str
    progress: float | None
    phase: str
    since_s: float


class ActionOut(BaseModel):
    """A goal that was sent."""

    agent: str
    action: str
    state: str
    code: str
    unix_millis_start: int
    unix_millis_end: int | None
    duration_s: float


class LineOut(BaseModel):
    """A notice or an alarm."""

    unix_millis: int
    severity: str
    text: str


class TaskDetail(TaskOut):
    """A task with what it does and did."""

    failure: FailureOut | None
    notes: list[str]
    running: list[NodeOut]
    goals: list[GoalOut]
    questions: list[str]
    actions: list[ActionOut]
    lines: list[LineOut]


class TasksOut(BaseModel):
    """Tasks: those under way (ASSIGNED, ACTIVE, ENDING), then all others, each newest first."""

    tasks: list[TaskOut]
    total: int
    """So many fit the filter."""
    lockdown: LockdownOut


class BecauseOut(BaseModel):
    """One line of an explanation."""

    code: str
    text: str
    hint: str = ""
    agent: str = ""
    role: str = ""
    depth: int = 0
    """How deep it stands below the line that it explains."""


class WhyOut(BaseModel):
    """Why a task waits, is held, chose its agents, or failed; or why an agent does what it does."""

    task: str
    """Or the agent."""
    status: str
    """Or the agent's pool."""
    held: list[str]
    because: list[BecauseOut]
    waits: list[str] = []
    """What an open task waits for, as codes of the closed list of causes."""


class PointOut(BaseModel):
    """Where an agent is: metres from the base station, and degrees."""

    east_m: float
    north_m: float
    up_m: float
    lat: float
    lng: float


class AgentOut(BaseModel):
    """An agent: a machine or a person."""

    id: str
    type: str
    human: bool
    pool: str
    liveness: str
    control: str
    landed: str
    battery: float | None
    position: PointOut | None
    port: str
    """The port at which it stands on the ground, its own or another; empty: at none."""
    task: str
    role: str
    action: str
    home: str
    layer_m: float | None
    at_desk: bool
    word: str
    """Its own status word."""
    order: StandingOrderOut | None
    """The order that stands on it."""
    next: list[str]
    """If one does: commands of which a person should give one; none of them would be refused now."""
    taken: bool
    """A pilot or its own failsafe took it over, and no person has handed it back yet."""
    breach: str
    """The limit of its envelope that it breaks now; a `!` before it: its landing is finished first."""
    on_link_loss: str
    """What it does by itself when it hears nothing of the engine."""
    quarantine: str
    rebooted: bool
    """Started anew, and it stands: nothing makes it start before a person cleared it or a task is granted anew."""
    refused: str
    bad: int
    """Unreadable or untrue messages in a row."""


class AgentsOut(BaseModel):
    """All agents: machines, then people, each by name (hwd_2 before hwd_10)."""

    agents: list[AgentOut]
    lockdown: LockdownOut


class QuestionOut(BaseModel):
    """An open question."""

    number: str
    task: str
    kind: str
    text: str
    note: str
    options: list[str]
    asked: list[str]
    """People who may answer now."""
    shown: list[str]
    """People to whom it is shown."""
    here: list[str]
    """People who answer by `formiga answer` or POST /v1/inbox/{number}/answer."""
    answers: dict[str, str]
    waiting_s: float
    lapses_in_s: float | None
    if_no_answer: str


class InboxOut(BaseModel):
    """Open questions, oldest first."""

    questions: list[QuestionOut]


class ParamOut(BaseModel):
    """A parameter of a task."""

    name: str
    type: str
    required: bool
    default: str
    label: str
    help: str
    aliases: list[str] = []


class Load(BaseModel):
    """How far the engine keeps up with what comes in."""

    waiting: dict[str, int]
    """Inputs that wait now, by lane: orders, news of HIGH tasks, news, HIGH requests, requests, telemetry."""
    most_waiting: int
    """The most that ever waited at once."""
    replaced: int
    """Statuses that a newer one of the same agent replaced before they were looked at."""
    behind_s: float
    """How late the earliest deadline is, in seconds of engine time; 0 = the engine keeps up."""


class StandingAlarm(BaseModel):
    """Something that is wrong with the engine's own house, as long as it is: its clock, its runtime folder, its journal."""

    code: str
    subject: str
    """What it is about: `clock`, or a file's name."""
    text: str
    unix_millis_since: int
    """Of the wall clock."""


class Health(BaseModel):
    """How the engine is."""

    status: Literal["ok", "overloaded", "draining", "deposed", "stopping", "failed"]
    """`overloaded`: it is `ok`, but its deadlines are given late. `deposed`: another engine commands its agents."""
    site: str
    mode: str
    version: str
    epoch: int
    pid: int
    speed: float
    endpoint: str
    """Where agents connect."""
    unix_millis_now: int
    """Engine time, as all times that people are shown."""
    ahead_s: float
    """Engine time less the wall clock, seconds: a simulation at another speed moves away from it."""
    steps: int
    tasks: dict[str, int]
    """Number by status."""
    agents: dict[str, int]
    """Number by pool; people under `people`."""
    questions: int
    lockdown: LockdownOut
    alarms: list[LineOut]
    standing: list[StandingAlarm]
    load: Load
    journal: Literal["ok", "slow", "full", "gone"] = "ok"
    """Of `full` and `gone` no task is admitted."""
    text: str = ""
