"""What every picture is drawn from: plain values, the same from a file, a dry run, a running engine or a stored history.

`Source` in `show.source` hands them out. Drawings never look into an engine; what they show is here, and travels as JSON.
Instants are engine time in microseconds (`Micros`), places metres east, north and up of the base station, angles degrees.
"""

from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros

# -- the tree of a task ------------------------------------------------------------------------------------------------
Style = Literal["plain", "title", "kind", "agent", "dim", "warn"]


class StyledSpan(Struct, frozen=True, omit_defaults=True):
    """A piece of a line in one style."""

    text: str
    style: Style = "plain"


class FileSpot(Struct, frozen=True):
    """A place in a file; lines and columns count from 1."""

    file: str
    line: int
    column: int


class Box(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A step, a section, a branch of a step, or a row about a param, a var or a role."""

    path: str = ""
    """`lang.places.static_path` of a step, for example `steps/steps[1].then[0]`; "" = no step."""
    kind: str
    """A step kind of the language (`do`, `ask`, `sequence`, ...), or `section`, `branch`, `param`, `var`, `role`."""
    label: tuple[StyledSpan, ...]
    modifiers: tuple[str, ...] = ()
    """In words: `when ...`, `timeout 2 min`, `3 attempts`."""
    role: str = ""
    task_role: str = ""
    """The role of the task that `role` (the first of several) stands for in a called subtree or a loop, where it is one."""
    action: str = ""
    guard: str = ""
    """The condition that lets it run: of `when`, `if`, `guard`."""
    spot: FileSpot | None = None
    children: tuple["Box", ...] = ()
    hidden: int = 0
    """So many steps below are not drawn (`--depth`, `--collapse`)."""


class Drawing(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A task as a tree."""

    task: str
    version: str = ""
    description: str = ""
    facts: tuple[str, ...] = ()
    """Priority, timeout and the like, in words."""
    spot: FileSpot
    params: tuple[Box, ...] = ()
    vars: tuple[Box, ...] = ()
    roles: tuple[Box, ...] = ()
    sections: tuple[Box, ...] = ()
    """`steps`, `on_failure`, `on_abort`, `finally`: each a box of kind `section` with path `<section>/`."""
    sources: dict[str, str] = {}
    """File -> its text, where a drawing links to lines."""


# -- how its steps stand -----------------------------------------------------------------------------------------------
StepStatus = Literal["running", "success", "failure", "skipped", "stopped"]


class StepFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How one step of a task stands, over all rounds, items and attempts that it ran in. A step never begun has none."""

    path: str
    """As `Box.path`."""
    status: StepStatus
    """`running` if any instance runs, else how the newest ended."""
    running: int = 0
    succeeded: int = 0
    failed: int = 0
    skipped: int = 0
    stopped: int = 0
    began_at: Micros | None = None
    """Of the newest instance; None: it ended in the instant in which it began."""
    ended_at: Micros | None = None
    code: str = ""
    """Reason code of the newest failure."""
    reason: str = ""
    note: str = ""
    """What it does now, in words: `hwd_1 40 %`, `Q7 asks eve`, `round 3`, `attempt 2 of 3`, `12 s left`."""


# -- who and what ------------------------------------------------------------------------------------------------------
class Point(Struct, frozen=True):
    """Where something is, metres from the base station."""

    east_m: float
    north_m: float
    up_m: float = 0.0


class TaskFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A task in a list."""

    id: str
    name: str
    status: str
    """PENDING, ASSIGNED, ACTIVE, ENDING, SUCCEEDED, FAILED or CANCELED."""
    held: tuple[str, ...] = ()
    section: str = ""
    priority: str = "medium"
    by: str = ""
    """Who requested it."""
    version: str = ""
    """Which version of the task it runs, in words, if others were served: `version 1, newest 2`."""
    parent: str = ""
    agents: tuple[str, ...] = ()
    """It holds these now."""
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


class AgentFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A machine or a person."""

    id: str
    type: str
    human: bool = False
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
    """The port at which it stands on the ground."""
    order: str = ""
    """The order that stands on it, in words, or empty."""
    taken: bool = False
    breach: str = ""
    quarantine: str = ""
    rebooted: bool = False
    """Started anew, and it stands: nothing makes it start before a person cleared it or a task is granted anew."""
    refused: str = ""
    word: str = ""


class GoalFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
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


class QuestionFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An open question."""

    number: str
    task: str
    text: str
    kind: str = "ask"
    options: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    here: tuple[str, ...] = ()
    """Of those asked: who answers at this engine's desk."""
    asked_at: Micros = 0
    lapses_at: Micros | None = None
    if_no_answer: str = ""
    clears: str = ""
    """The machine for which an answer of `clears_on` says that people stand clear of it."""
    clears_on: tuple[str, ...] = ()


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
    text: str


class Top(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What a person must see first."""

    airborne: int = 0
    needs_you: int = 0
    """Questions that wait for a person, machines that a person must look at or hand back."""
    longest_wait_us: Micros = 0
    """Of those."""
    alarms: int = 0
    """That happened in the last ten minutes, or still stand: a breach, a quarantine, a lost machine, the engine's own house."""
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
    house: tuple[StandingFact, ...] = ()
    """Alarms of the engine's own house that stand: its clock, its runtime folder, its journal."""


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


class Because(Struct, frozen=True, omit_defaults=True):
    """One line of an explanation."""

    code: str
    text: str
    hint: str = ""
    agent: str = ""
    role: str = ""
    depth: int = 0
    """How deep it stands below the line that it explains; 0 = the first level."""


# -- time and space ----------------------------------------------------------------------------------------------------
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


class Waiting(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A span of a task without an action: it waits for agents, for a person, at the gate; or it is held."""

    task: str
    kind: Literal["pending", "question", "gate", "held"]
    start: Micros
    end: Micros | None = None
    agent: str = ""
    text: str = ""


class Timeline(Struct, frozen=True, kw_only=True):
    """What a Gantt chart shows."""

    at: Micros
    """Until here it is known."""
    tasks: tuple[TaskFact, ...]
    actions: tuple[ActionFact, ...]
    waits: tuple[Waiting, ...] = ()


class Track(Struct, frozen=True, kw_only=True):
    """The way an agent went, thinned: nobody was further than about 1 m from the line through its points."""

    agent: str
    type: str
    task: str = ""
    human: bool = False
    times: tuple[Micros, ...] = ()
    points: tuple[Point, ...] = ()


class MapMark(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A named point of the site, or where something happened."""

    name: str
    kind: Literal["base", "port", "place", "landing", "event"]
    at: Point


class MapShape(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An area of the site."""

    name: str
    kind: Literal["fence", "zone", "region"]
    corners: tuple[Point, ...]
    forbidden: bool = False


class Chart(Struct, frozen=True, kw_only=True):
    """What a map shows."""

    site: str
    at: Micros
    marks: tuple[MapMark, ...]
    shapes: tuple[MapShape, ...]
    tracks: tuple[Track, ...]
    origin_lat: float = 0.0
    origin_lng: float = 0.0


class Spread(Struct, frozen=True, kw_only=True):
    """How long something took: `n` times that ended well; seconds."""

    name: str
    group: str = ""
    """Agent type of an action."""
    n: int
    failed: int = 0
    least_s: float = 0.0
    q1_s: float = 0.0
    median_s: float = 0.0
    q3_s: float = 0.0
    most_s: float = 0.0


class Stats(Struct, frozen=True, kw_only=True):
    """Durations of actions, gaps between them, tasks, and answers of people."""

    since: Micros
    at: Micros
    tasks: tuple[Spread, ...] = ()
    waits: tuple[Spread, ...] = ()
    """From request to the first step, by task."""
    actions: tuple[Spread, ...] = ()
    gaps: tuple[Spread, ...] = ()
    """From the end of one action of a task to the start of its next, by task."""
    answers: tuple[Spread, ...] = ()
