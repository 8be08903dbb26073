"""Facts of a site: its tasks, agents, goals, questions and lines, and the whole of it at one instant."""

from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.machines import MOVING, Mobility
from formiga_bt.lang.forms import FormField
from formiga_bt.show.facts.alarms import AlarmFact
from formiga_bt.show.facts.tree import Drawing, StepFact


class Point(Struct, frozen=True):
    """Where something is, metres from the base station."""

    east_m: float
    north_m: float
    up_m: float = 0.0


class TaskFact(Struct, frozen=True, kw_only=True):
    """A task in a list."""

    id: str
    name: str
    status: str
    """PENDING, ASSIGNED, ACTIVE, ENDING, SUCCEEDED, FAILED or CANCELED."""
    held: tuple[str, ...] = ()
    """Causes of HELD: operator, operator:<agent>, clearance:<agent>, take-over:<agent>, lockdown, resume. Empty: not held."""
    section: str = ""
    """Of its file, that it is in; empty: it is over."""
    priority: str = "medium"
    by: str = ""
    """Who requested it."""
    version: int = 1
    """Of its task, that it runs."""
    newest: int = 1
    """The version of its task that new requests get."""
    parent: str = ""
    """The task that requested it; empty: a person did."""
    children: tuple[str, ...] = ()
    """Tasks that it requested in this run."""
    agents: tuple[str, ...] = ()
    """It holds these now, or had them if it is over."""
    code: str = ""
    reason: str = ""
    doing: str = ""
    """What it does or waits for, in words."""
    throttled_since: Micros | None = None
    """Its waits are made longer since then: its clocks would wake it more often than one task may be woken."""
    needs: str = ""
    """The number of a question that waits for a person (`Q7`), or another reason why a person must act."""
    urgent_at: Micros | None = None
    """When the next thing happens that cannot be taken back; rows are sorted by it."""
    urgent: str = ""
    """What that is: `Q7 lapses`, `timeout`, `hwd_1 returns by itself`."""
    submitted_at: Micros = 0
    ended_at: Micros | None = None

    @property
    def is_over(self) -> bool:
        """Return whether it ended."""
        return self.ended_at is not None

    @property
    def versions(self) -> str:
        """Return which version it runs, in words, if there were several; else ""."""
        return f"version {self.version}, newest {self.newest}" if self.newest > 1 else ""


class AgentFact(Struct, frozen=True, kw_only=True):
    """A machine or a person."""

    id: str
    type: str
    mobility: Mobility = "air"
    pool: str = ""
    liveness: str = ""
    control: str = ""
    landed: str = ""
    task: str = ""
    role: str = ""
    action: str = ""
    home: str = ""
    battery: float | None = None
    """Percent, 0..100."""
    at: Point | None = None
    port: str = ""
    """The port at which it stands on the ground, its own or another."""
    lat: float | None = None
    lng: float | None = None
    layer_m: float | None = None
    """The height layer that it has for its flights."""
    at_desk: bool = False
    """A person who works at this engine's desk."""
    on_link_loss: str = ""
    """What it does by itself when it hears nothing of the engine."""
    bad: int = 0
    """Unreadable or untrue messages in a row."""
    order: str = ""
    """The order that stands on it, in words, or empty."""
    taken: bool = False
    """A pilot or its own failsafe took it over, and no person has handed it back yet."""
    breach: str = ""
    """The limit of its envelope that it breaks now."""
    quarantine: str = ""
    out: str = ""
    """Why a person took it out of service, and who."""
    rebooted: bool = False
    """Started anew, and it stands: nothing makes it start before a person cleared it or a task is granted anew."""
    refused: str = ""
    word: str = ""
    """Its own status word."""
    heading_deg: float | None = None
    """True, clockwise from north."""
    speed_m_s: float | None = None
    floor: str = ""
    charging: bool | None = None
    fields: dict[str, Any] = {}
    """What its type says besides, as wire values."""
    errors: tuple[str, ...] = ()
    """What is wrong with it, in its own words."""
    refused_actions: dict[str, str] = {}
    """What of its card cannot be used, and why."""
    refused_fields: dict[str, str] = {}
    """Fields of its status that are not of their types, and why."""
    engine_id: str = ""
    """The engine that it follows, as it says."""
    wire: str = ""
    """The wire that it is on."""
    lacks: tuple[str, ...] = ()
    """What that wire does not guarantee."""

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        return self.mobility == "people"

    @property
    def charge(self) -> str:
        """Return the charge of a machine that goes about on it, in words, or ""."""
        return f"{self.battery:.0f} %" if self.battery is not None and self.mobility in MOVING else ""


class GoalFact(Struct, frozen=True, kw_only=True):
    """A goal under way, or one that waits at the gate."""

    id: str
    agent: str
    action: str
    state: str
    code: str = ""
    text: str = ""
    progress: float | None = None
    """0..1."""
    phase: str = ""
    since: Micros = 0
    path: str = ""
    """Of its step."""
    target: str = ""
    """Where it goes, in words."""


Deed = Literal["", "rise", "move", "ask", "stop"]
"""What an action does to its agent, as pictures tell them apart: up or down, to a place, asked, stopped; "" = it works."""


class ActionFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A goal of an agent, from its sending to its end."""

    task: str
    agent: str
    action: str
    start: Micros
    end: Micros | None = None
    """None: it runs."""
    state: str = ""
    code: str = ""
    goal: str = ""
    path: str = ""
    """Of its step; "" for what the engine sends itself."""
    detail: str = ""
    does: Deed = ""

    @property
    def ended_well(self) -> bool:
        """Return whether it came to its end: an answer is one, too."""
        return self.state in ("succeeded", "answered")


class FileFact(Struct, frozen=True, kw_only=True):
    """A file that an agent named for a task: a photo, a log."""

    agent: str
    what: str
    """The action, or the event of the agent's own, that it came with."""
    path: str = ""
    """Of the step; empty: it came with an event."""
    at: Micros
    name: str
    media_type: str
    size: int
    """Bytes."""
    sha256: str
    uri: str = ""
    """Where else it is to be had."""
    url: str
    """Of this engine's API; its bytes may not have come yet."""


class AttachmentKept(Struct, frozen=True):
    """The bytes of an attachment are kept."""

    sha256: str
    size: int


class QuestionFact(Struct, frozen=True, kw_only=True):
    """An open question."""

    number: str
    task: str
    text: str
    kind: str = "ask"
    note: str = ""
    options: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    """People who may answer now."""
    shown: tuple[str, ...] = ()
    """Of those: to whom it is shown."""
    here: tuple[str, ...] = ()
    """Of those asked: who answers at this engine's desk, and has not yet."""
    answers: dict[str, str] = {}
    """What was answered, by person."""
    asked_at: Micros = 0
    lapses_at: Micros | None = None
    if_no_answer: str = ""
    clears: str = ""
    """The machine for which an answer of `clears_on` says that people stand clear of it."""
    clears_on: tuple[str, ...] = ()
    files: tuple[FileFact, ...] = ()
    """The newest files of its task."""
    form: tuple[FormField, ...] = ()
    """What is filled in with the answer."""


class LineFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A line of the log: a notice, an alarm, a change of state."""

    at: Micros
    text: str
    severity: str = "info"
    """info, warning or alarm."""
    task: str = ""
    agent: str = ""


class StandingFact(Struct, frozen=True, kw_only=True):
    """Something that is wrong with the engine's own house, as long as it is: its clock, its runtime folder, its journal."""

    code: str
    subject: str
    """What it is about: `clock`, or a file's name."""
    text: str
    since: Micros
    """Of the wall clock."""


class HeldUnits(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Units of a resource that a task holds."""

    task: str
    units: int = 1
    since: Micros = 0


class ResourceFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A resource of the site: who holds it, which machines are in it, and who waits."""

    name: str
    capacity: int = 1
    held: tuple[HeldUnits, ...] = ()
    inside: tuple[str, ...] = ()
    """Machines in its region, or on their way in."""
    waiting: tuple[str, ...] = ()
    """Tasks, in the order in which they are served."""


class Top(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What a person must see first."""

    airborne: int = 0
    needs_you: int = 0
    """Questions that wait for a person, machines that a person must look at or hand back."""
    longest_wait_us: Micros = 0
    """Of those."""
    alarms: int = 0
    """That nobody acknowledged; and machines that break a limit, are in quarantine or lost, of which there is none."""
    held: int = 0
    taken: tuple[tuple[str, str], ...] = ()
    """(`PILOT` or `FAILSAFE`, machine)."""
    lockdown: str = ""


class Now(Struct, frozen=True, kw_only=True):
    """The whole site at one instant; of the tasks a page."""

    site: str
    at: Micros
    engine: str = "ok"
    """ok, overloaded, draining, deposed, stopping or failed; past: of a journal, as it stood at `at`."""
    mode: str = ""
    speed: float = 1.0
    """Engine seconds per wall second; all spans and instants are of the engine's clock."""
    ahead_us: Micros = 0
    """The engine's clock less the wall clock; 0 in a picture of the past."""
    top: Top
    counts: dict[str, int]
    """Tasks by status."""
    tasks: tuple[TaskFact, ...]
    total: int
    """So many tasks match; `tasks` is the page asked for."""
    waiting: int = 0
    """Of these, so many only wait for agents; they stand behind all others that are open."""
    agents: tuple[AgentFact, ...]
    questions: tuple[QuestionFact, ...]
    lines: tuple[LineFact, ...] = ()
    """The newest, oldest first."""
    alarms: tuple[AlarmFact, ...] = ()
    """Those that are open, as `AlarmList` has them."""
    resources: tuple[ResourceFact, ...] = ()
    """Of the site, in the order of its file."""


class TaskPicture(Struct, frozen=True, kw_only=True):
    """One task with its tree, as far as it has come."""

    at: Micros
    task: TaskFact
    drawing: Drawing
    steps: tuple[StepFact, ...]
    values: dict[str, dict[str, Any]] = {}
    """Scope -> name -> value in words (`60 m`, `camp`); "" = the task's own."""
    goals: tuple[GoalFact, ...] = ()
    questions: tuple[QuestionFact, ...] = ()
    agents: tuple[AgentFact, ...] = ()
    lines: tuple[LineFact, ...] = ()


class Because(Struct, frozen=True):
    """One line of an explanation."""

    code: str
    text: str
    hint: str = ""
    agent: str = ""
    role: str = ""
    depth: int = 0
    """How deep it stands below the line that it explains; 0 = the first level."""


class PastTask(Struct, frozen=True, kw_only=True):
    """A task as it stood at a moment: its tree with statuses, the values on its blackboard, and why it stood so."""

    picture: TaskPicture
    because: tuple[Because, ...]
    """What it waited for or why it ended, and why the allocator chose its agents."""


class Explanation(Struct, frozen=True, kw_only=True):
    """Why a task waits, is held, chose its agents, or failed; or why an agent does what it does."""

    of: str
    """The task, or the agent."""
    status: str
    """Of the task, or the agent's pool."""
    held: tuple[str, ...] = ()
    because: tuple[Because, ...]
    waits: tuple[str, ...] = ()
    """What an open task waits for, as codes of the closed list of causes."""

    @property
    def headline(self) -> str:
        """Return how it stands, in one line."""
        return f"{self.of} {self.status}".rstrip() + (" HELD" if self.held else "")


class FailureFact(Struct, frozen=True):
    """The step that failed first, and why."""

    code: str
    reason: str
    step: str
    place: str
    """File and line."""
    agent: str


class RunningStep(Struct, frozen=True):
    """A step that runs now."""

    node: str
    title: str
    place: str
    """File and line."""


class TaskDetail(Struct, frozen=True, kw_only=True):
    """A task with what it does and did; all instants as in the facts."""

    at: Micros
    task: TaskFact
    bundle: str
    """Of the version that it runs."""
    run: int
    """How many times it has begun."""
    outcome: str
    """SUCCEEDED, FAILED or CANCELED, before its cleanup has ended."""
    roles: dict[str, tuple[str, ...]]
    granted: tuple[str, ...]
    """Every agent it was granted, in order."""
    active_at: Micros | None
    failure: FailureFact | None
    notes: tuple[str, ...]
    running: tuple[RunningStep, ...]
    goals: tuple[GoalFact, ...]
    questions: tuple[str, ...]
    """Numbers of its open questions."""
    actions: tuple[ActionFact, ...]
    lines: tuple[LineFact, ...]
    """Its notices and alarms."""
    files: tuple[FileFact, ...] = ()
    """Files that agents named for it, oldest first."""


class QuestionList(Struct, frozen=True):
    """Open questions, oldest first."""

    at: Micros
    questions: tuple[QuestionFact, ...]
