"""Facts of an engine as a service: how it is, which tasks it serves, and an error of its API."""

from typing import Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.show.facts.orders import LockdownFact
from formiga_bt.show.facts.site import LineFact, StandingFact


class ParamFact(Struct, frozen=True, kw_only=True):
    """A parameter of a task, or a field of an action."""

    name: str
    type: str
    required: bool = False
    default: str = ""
    least: str = ""
    most: str = ""
    label: str = ""
    help: str = ""
    aliases: tuple[str, ...] = ()


class VersionFact(Struct, frozen=True):
    """A version of a task."""

    version: int
    bundle: str
    tasks: tuple[str, ...]
    """Open tasks that run it."""


class LibraryTask(Struct, frozen=True, kw_only=True):
    """A task that can be requested."""

    task: str
    aliases: tuple[str, ...] = ()
    """Other names under which it may be requested."""
    description: str
    file: str
    params: tuple[ParamFact, ...]
    bundle: str = ""
    """Of the version that new requests get."""
    version: int = 1
    versions: tuple[VersionFact, ...] = ()
    """Oldest first; those that nobody can ask for any more are left out."""


class LibraryList(Struct, frozen=True):
    """The tasks that this engine serves, and the files that it does not for their errors."""

    tasks: tuple[LibraryTask, ...]
    refused: tuple[str, ...]


class TaskLoaded(Struct, frozen=True, kw_only=True):
    """What became of a bundle that was loaded."""

    task: str
    bundle: str
    """SHA-256 of the task's text, its imports and the catalogue; as `bundle` of POST /v1/tasks it asks for this version."""
    version: int
    what: Literal["new", "changed", "same"]
    text: str
    warnings: tuple[str, ...]


class EngineLoad(Struct, frozen=True, kw_only=True):
    """How far the engine keeps up with what comes in."""

    waiting: dict[str, int]
    """Inputs that wait now, by lane: orders, news of HIGH tasks, news, HIGH requests, requests, telemetry."""
    most_waiting: int
    """The most that ever waited at once."""
    replaced: int
    """Statuses that a newer one of the same agent replaced before they were looked at."""
    behind_s: float
    """How late the earliest deadline is, in seconds of engine time; 0 = the engine keeps up."""


class Alive(Struct, frozen=True, kw_only=True):
    """Whether the engine works: what `/healthz` tells everybody, without a name."""

    alive: bool
    """False: it has ended, or its thread stands still; start it anew."""
    status: str
    causes: tuple[str, ...] = ()
    """Codes of what is wrong, also with an engine that works."""


class EngineHealth(Struct, frozen=True, kw_only=True):
    """How the engine is."""

    status: str
    """ok, overloaded (it is ok, but its deadlines are given late), draining, deposed (another engine commands its agents),
    stopping or failed."""
    site: str
    mode: str
    version: str
    epoch: int
    pid: int
    speed: float
    endpoint: str
    """Where agents connect."""
    at: Micros
    """Engine time, as all times that people are shown."""
    ahead_us: Micros
    """Engine time less the wall clock: a simulation at another speed moves away from it."""
    steps: int
    tasks: dict[str, int]
    """Number by status."""
    agents: dict[str, int]
    """Number by pool; people under `people`."""
    questions: int
    lockdown: LockdownFact
    alarms: tuple[LineFact, ...]
    house: tuple[StandingFact, ...]
    """Alarms of the engine's own house that stand."""
    load: EngineLoad
    journal: Literal["ok", "slow", "full", "gone"] = "ok"
    """Of `full` and `gone` no task is admitted."""
    causes: tuple[str, ...] = ()
    """Codes of what is wrong: a status that is not ok, stands_still, journal_slow, journal_full, journal_gone, lockdown, and
    those of `house`."""
    text: str = ""


class EventFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that happened, as the event stream has it; which fields are there depends on `type`."""

    type: str
    """task, goal, agent, order, lockdown, question, notice, alarm, engine, library, or gap (older events are gone)."""
    at: Micros
    text: str
    task: str = ""
    agent: str = ""
    status: str = ""
    """Of a task; with `held` and `section`, which is `done` when it is over."""
    held: tuple[str, ...] = ()
    section: str = ""
    code: str = ""
    """Reason code of a task, a goal, a refused order; code of an alarm of the engine's own house."""
    reason: str = ""
    goal: str = ""
    action: str = ""
    state: str = ""
    """Of a goal, a question (open, ...) or an order (open, done, failed, ended, refused)."""
    pool: str = ""
    liveness: str = ""
    control: str = ""
    order: str = ""
    """That was refused, for `target`."""
    target: str = ""
    stop: str = ""
    """The order that stands."""
    by: str = ""
    on: bool = False
    """Lockdown stands; machines do `how`."""
    how: str = ""
    name: str = ""
    """Of a task that is served in another version."""
    version: int = 0
    bundle: str = ""
    question: str = ""
    """Its number; it asks `people`."""
    options: tuple[str, ...] = ()
    people: tuple[str, ...] = ()
    severity: str = ""


class Problem(Struct, frozen=True, kw_only=True):
    """An error (application/problem+json)."""

    type: str = "about:blank"
    title: str
    status: int
    code: str
    """A stable word."""
    text: str
    help: str = ""
    """What a person can do."""
    near: tuple[str, ...] = ()
    """Names that may have been meant."""
    problems: tuple[str, ...] = ()
    """All of them, where several are wrong."""
