"""The checked model of a task: what the loader makes of a YAML file and what `compile` turns into nodes.

Frozen, free of py_trees and of any run. Every step knows its source mark. Static paths: the steps of a section, branch or
subtree body are numbered in their list (`steps[1]`, `then[0]`, `sequence[2]`); `compile` joins them.
Who builds it: `lang.loader`. Who reads it: `lang.checks`, `compile`, `show`, the naive interpreter of the tests.
One file on purpose, though long: it is one list of frozen records without logic, read as a whole.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, Protocol

from formiga_bt.clock import Micros
from formiga_bt.diagnostics import Mark
from formiga_bt.lang.types import AgentRef, Type, Value


class Unset(Exception):  # noqa: N818 - a signal of the expression: an absent optional key, else the task ends with `exception`
    """A name was read that has no value (the checker refuses such trees; at run time it is an `exception`)."""


class EvalError(Exception):
    """An expression has no result: division by zero, an index beyond the list, a number that is too large.

    At run time the task ends with `exception`; the checker reports it where the expression is constant.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class UnknownState(Exception):  # noqa: N818
    """A field of an agent was read that is not known yet; `key` is its blackboard key."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.key = key


class Env(Protocol):
    """What an expression may read. The engine, the checker's constant folder and tests each have one."""

    def name(self, name: str) -> Value:
        """Return a param, var, role, saved or loop name, or a built-in (`base`, `task`, `now`, `site`, `error`, ...).

        A role is an `AgentRef`, or a tuple of them when it has a count; `site` and `task` are dicts.

        Raises:
            Unset: the name has no value here.
        """
        ...

    def is_set(self, name: str) -> bool:
        """Return whether the name has a value."""
        ...

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        """Return an agent's field as last known.

        Raises:
            UnknownState: never reported yet.
        """
        ...

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Return the agents of a type, and of those that extend it, that are admitted and not lost, in order of admission.

        Raises:
            Unset: read where there is no task.
        """
        ...

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return latitude and longitude (degrees) of a place or position, for `.lat` and `.lng`."""
        ...

    def place(self, lat: float, lng: float) -> Any:
        """Return the place at a latitude and longitude (degrees)."""
        ...

    def ground_up_m(self, place: Any) -> float:
        """Return the height of the ground at a place over the base's ground, metres (0 on flat sites)."""
        ...


@dataclass(frozen=True, slots=True)
class Read:
    """Something an expression depends on: a name, or a field of the agent that a name stands for."""

    name: str
    field: str = ""
    """Field of an agent (battery, position, ...), else empty."""


NOT_CONST: Any = object()
"""`Expr.const` of an expression that must be evaluated."""


@dataclass(frozen=True, slots=True)
class Expr:
    """A typed, compiled expression or literal.

    `run(env)` evaluates it; a literal has `const` set and `run` returns it. Equality and hash ignore the code.
    """

    source: str
    type: Type
    mark: Mark
    run: Callable[[Env], Any] = field(compare=False)
    reads: tuple[Read, ...] = ()
    deadlines: "tuple[Callable[[Env], Micros], ...]" = field(default=(), compare=False)
    """Of a live condition that uses `now`: the instants (engine time) at which a comparison with `now` changes."""
    const: Any = field(default=NOT_CONST, compare=False)

    @property
    def is_const(self) -> bool:
        """Return whether the value is known before any run."""
        return self.const is not NOT_CONST


@dataclass(frozen=True, slots=True)
class Who:
    """Whom a key such as `of`, `to` or `do` names: a role, loop name or agent param; or a site role (`watchers`)."""

    name: str
    agent: Expr | None
    """Evaluates to an AgentRef; None when `site_role`."""
    site_role: bool
    mark: Mark


@dataclass(frozen=True, slots=True)
class Retry:
    """The retry modifier. `attempts` counts the first one; delays in seconds."""

    attempts: Expr
    delay: Expr | None
    backoff: Expr | None
    attempt_timeout: Expr | None
    agent: Literal["same", "another"]
    mark: Mark


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What every step has. Nesting of the modifiers: when( ignore_failure( timeout( retry( step)))).

    `seg` is the step's place in its list, for example `steps[1]`.
    """

    kind: str
    seg: str
    mark: Mark
    """Of the kind's key."""
    name: str = ""
    note: Expr | None = None
    when: Expr | None = None
    timeout: Expr | None = None
    retry: Retry | None = None
    ignore_failure: bool = False
    critical: bool = False

    @property
    def title(self) -> str:
        """Return the step's name as people see it."""
        return self.name or self.kind


@dataclass(frozen=True, slots=True, kw_only=True)
class Do(Step):
    """Send a goal to an agent and wait for its result."""

    who: Who
    action: str
    fields: Mapping[str, Expr]
    """Every field that is given or has a default, in the catalogue's order. Defaults may read `agent.<field>`: in such an
    expression the name `agent` is this step's agent."""
    save_as: str = ""
    expect: Expr | None = None

    @property
    def title(self) -> str:
        """Return the step's name, or `role.Action`."""
        return self.name or f"{self.who.name}.{self.action}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ask(Step):
    """Ask people; `{answer, by, at}`."""

    question: Expr
    of: tuple[Who, ...]
    options: tuple[str, ...]
    policy: Literal["any", "all"] = "any"
    escalate_after: Expr | None = None
    clears: Who | None = None
    clears_on: tuple[str, ...] = ()
    if_no_answer: Expr | None = None
    save_as: str = ""
    expect: Expr | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Call(Step):
    """Run a subtree in its own scope."""

    subtree: "Subtree"
    args: Mapping[str, Expr]
    save_as: str = ""

    @property
    def title(self) -> str:
        """Return the step's name, or the subtree's."""
        return self.name or self.subtree.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait(Step):
    """Wait a duration (seconds)."""

    duration: Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Check(Step):
    """Succeed or fail now."""

    cond: Expr
    message: Expr | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Set(Step):
    """Assign vars, in file order."""

    assign: Mapping[str, Expr]


@dataclass(frozen=True, slots=True, kw_only=True)
class Notify(Step):
    """Tell people; never fails. Empty `to` = the site's watchers."""

    text: Expr
    to: tuple[Who, ...] = ()
    severity: Literal["info", "warning", "alarm"] = "info"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fail(Step):
    """Fail with a message and, optionally, a snake_case code."""

    message: Expr
    code: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence(Step):
    """Steps one after another, with memory. `reactive`: earlier children, pure checks, are re-checked live."""

    steps: tuple[Step, ...]
    reactive: bool = False
    finally_: tuple[Step, ...] = ()
    """Runs in place after success and failure; segments `finally[i]`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fallback(Step):
    """The first child that succeeds; while a later child runs, `error` is the former one's failure."""

    steps: tuple[Step, ...]
    reactive: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitUntil(Step):
    """Wait until a live condition is true."""

    cond: Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitFor(Step):
    """Wait for the next event of an agent. `since_task`: also one that came since the task's admission and none took yet."""

    who: Who
    event: str
    since_task: bool = False
    save_as: str = ""

    @property
    def title(self) -> str:
        """Return the step's name, or `role.event`."""
        return self.name or f"{self.who.name}.{self.event}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Release(Step):
    """Give an agent back before the task ends: goal-free, recovered if airborne, then freed."""

    who: Who


@dataclass(frozen=True, slots=True, kw_only=True)
class Parallel(Step):
    """Children at once. `need`: "all", "any" or a number; segments `parallel[i]`."""

    steps: tuple[Step, ...]
    need: int | Literal["all", "any"] = "all"
    on_child_failure: Literal["finish", "cancel"] = "finish"


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop(Step):
    """`while` and `repeat`: rounds of `steps` (segments `steps[i]`). Exactly one of the first four is set.

    `until` is read after each round; `every`: start of a round to the start of the next, seconds; `max`: no more rounds.
    """

    cond: Expr | None = None
    """`while`: read before each round."""
    times: Expr | None = None
    """`repeat: N`."""
    duration: Expr | None = None
    """`repeat: 30 min`, seconds: no round starts after it is over, then success."""
    forever: bool = False
    steps: tuple[Step, ...]
    until: Expr | None = None
    every: Expr | None = None
    max: Expr | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class For(Step):
    """`for`: a round per item of lists of equal lengths, in order or at once; segments `steps[i]`."""

    lists: Mapping[str, Expr]
    """Loop name -> list."""
    steps: tuple[Step, ...]
    parallel: bool = False
    said_mode: bool = False
    """Whether the file says `mode`."""
    max_parallel: int | None = None
    need: int | Literal["all"] = "all"
    on_child_failure: Literal["finish", "cancel"] = "finish"
    collect: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class BreakIf(Step):
    """Leave the nearest loop with success."""

    cond: Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Guard(Step):
    """Stop the steps and fail as soon as a live condition is false; segments `steps[i]`."""

    cond: Expr
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class If(Step):
    """Branch on a condition, read once at entry."""

    cond: Expr
    then: tuple[Step, ...]
    otherwise: tuple[Step, ...] = ()


@dataclass(frozen=True, slots=True)
class Case:
    """One value of a `switch`, and its steps (segments `case0[i]`, `case1[i]` for the next one)."""

    value: str | int
    mark: Mark
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch(Step):
    """Branch on a value, read once at entry; segments of the default `default[i]`.

    Without a default the cases name every value that the expression can have.
    """

    on: Expr
    cases: tuple[Case, ...]
    default: tuple[Step, ...] = ()

    @property
    def branches(self) -> tuple[tuple[Step, ...], ...]:
        """Return the steps of each way through it."""
        return (*(case.steps for case in self.cases), *((self.default,) if self.default else ()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Request(Step):
    """Start another task and, unless `wait` is false, wait for its end; it ends with its parent unless `detached`."""

    task: str
    args: Mapping[str, Expr]
    priority: Literal["", "low", "medium", "high"] = ""
    """Empty = as its own file says."""
    wait: bool = True
    detached: bool = False
    save_as: str = ""
    needs: "tuple[Role, ...]" = ()
    """What the other task is granted before its first step: names, types and counts only."""

    @property
    def title(self) -> str:
        """Return the step's name, or the task's."""
        return self.name or self.task


@dataclass(frozen=True, slots=True, kw_only=True)
class WithAgents(Step):
    """Extra agents for its steps (segments `steps[i]`), given back at their end; the expressions of roles are read at entry."""

    roles: "Mapping[str, Role]"
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter of a task or subtree."""

    name: str
    type: Type
    mark: Mark
    default: Expr | None = None
    optional: bool = False
    min: Expr | None = None
    max: Expr | None = None
    label: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Some:
    """How many agents a role without a fixed count takes: at least `min`, and `max` if as many are free (None = all)."""

    min: int = 1
    max: int | None = None


@dataclass(frozen=True, slots=True)
class Role:
    """A role of a task: which agent (or agents) it needs. Expressions are read once, at admission."""

    name: str
    types: tuple[str, ...]
    mark: Mark
    id: Expr | None = None
    near: Expr | None = None
    prefer: Expr | None = None
    count: int | None = None
    """None = exactly one agent, unless `open`: then the role is a list, as it is with a count."""
    open: "Some | None" = None
    """As many agents as are free, between two bounds."""
    battery_min: Expr | None = None
    capabilities: tuple[str, ...] = ()
    wait: Expr | None = None
    """How long to queue, seconds; None = 15 min."""
    if_lost: Literal["fail", "rebind"] = "fail"
    away: bool = False
    actions: tuple[str, ...] = ()
    """Actions that the task orders of this role (subtrees included)."""

    @property
    def is_list(self) -> bool:
        """Return whether the role is a list of agents."""
        return self.count is not None or self.open is not None


@dataclass(frozen=True, slots=True)
class Subtree:
    """A reusable body with its own scope."""

    name: str
    params: Mapping[str, Param]
    steps: tuple[Step, ...]
    mark: Mark
    returns: Expr | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """A checked task file. Sections are lists of steps; an empty one is absent."""

    name: str
    mark: Mark
    steps: tuple[Step, ...]
    aliases: tuple[str, ...] = ()
    """Other names under which callers may request it."""
    version: str = ""
    description: str = ""
    priority: Literal["low", "medium", "high"] = "medium"
    params: Mapping[str, Param] = field(default_factory=dict)
    vars: Mapping[str, Expr] = field(default_factory=dict)
    """In an order in which each reads only earlier ones."""
    roles: Mapping[str, Role] = field(default_factory=dict)
    timeout: Expr | None = None
    expires: Expr | None = None
    if_preempted: Literal["restart", "fail"] = "restart"
    preemptible: bool = True
    on_failure: tuple[Step, ...] = ()
    on_abort: tuple[Step, ...] = ()
    finally_: tuple[Step, ...] = ()
    cleanup_timeout: Expr | None = None
    envelope: Mapping[str, float] = field(default_factory=dict)
    """What the task tightens of its machines' envelope, named as in `AgentType.limits`; it can loosen nothing."""
    subtrees: Mapping[str, Subtree] = field(default_factory=dict)
    bundle: str = ""
    """SHA-256 (hex) of the task's file, its imports and the catalogue: what a run is pinned to."""
    files: tuple[str, ...] = ()
    requests: Mapping[str, str] = field(default_factory=dict)
    """Tasks that it requests -> their files."""


@dataclass(frozen=True, slots=True)
class FieldSpec:
    """A field of an action."""

    name: str
    type: Type
    optional: bool = False
    default: Expr | None = None
    """May read `agent.<field>`: the agent that gets the goal."""
    min: float | None = None
    max: float | None = None
    """In the type's SI unit."""
    help: str = ""


@dataclass(frozen=True, slots=True)
class ActionSpec:
    """An action of the catalogue."""

    name: str
    mark: Mark
    fields: Mapping[str, FieldSpec] = field(default_factory=dict)
    result: Mapping[str, Type] = field(default_factory=dict)
    requires: Literal["", "airborne", "grounded"] = ""
    effect: Literal["", "airborne", "grounded"] = ""
    moves_to: str = ""
    """The field that says where the agent will be (a place or position)."""
    starts_rotors: bool = False
    lands: bool = False
    repeatable: bool = False
    typical_us: Micros = 60_000_000
    accept_timeout_us: Micros = 5_000_000
    cancel_grace_us: Micros = 30_000_000
    concurrency: int = 1
    cuts: bool = False
    """It stops the motors at once, also in the air: only for a person's order `cut`, never for a tree."""
    help: str = ""


@dataclass(frozen=True, slots=True)
class AgentType:
    """An agent type of the catalogue, with what it extends already merged in."""

    name: str
    mark: Mark
    label: str = ""
    actions: tuple[str, ...] = ()
    extends: tuple[str, ...] = ()
    """All ancestors, nearest first."""
    rest: Literal["", "grounded_at_port"] = ""
    recover: Subtree | None = None
    """A subtree with one agent param; None = this type needs or has no way home."""
    recover_ref: str = ""
    fetch: Subtree | None = None
    """A subtree with one agent param that brings it home from the ground elsewhere (order `return`)."""
    fetch_ref: str = ""
    land: Subtree | None = None
    """A subtree with an agent and a place param that lands it there (order `land`)."""
    land_ref: str = ""
    events: Mapping[str, Mapping[str, Type]] = field(default_factory=dict)
    """What it tells of itself, apart from any goal: event -> its fields."""
    human: bool = False
    shared: bool = False
    limits: Mapping[str, float] = field(default_factory=dict)
    """SI by name, envelope included: speed_m_s, climb_m_s, hover_drain_pct_s, reserve_pct, max_height_m, ..."""
    on_breach: Mapping[str, str] = field(default_factory=dict)
    """Limit of the envelope (reserve, max_height, keep_in, keep_out, ...) -> return or hold."""
    suspect_after_us: Micros = 3_000_000
    lost_after_us: Micros = 30_000_000


@dataclass(frozen=True, slots=True)
class Catalogue:
    """Agent types and actions that trees may use."""

    types: Mapping[str, AgentType] = field(default_factory=dict)
    actions: Mapping[str, ActionSpec] = field(default_factory=dict)
    digest: str = ""
    """SHA-256 (hex) over the files."""


MIN_SPACING_M: Final = 3.0
"""`min_spacing` of a site that does not say it."""


@dataclass(frozen=True, slots=True)
class Port:
    """A landing port: its place and where to wait when it is taken."""

    name: str
    at: Any
    waiting: Any = None


@dataclass(frozen=True, slots=True)
class SiteAgent:
    """An agent that the site lists: its type and its own port."""

    id: str
    type: str
    home: str = ""


@dataclass(frozen=True, slots=True)
class Site:
    """A checked site file (`formiga_site: 1`)."""

    name: str
    lat: float
    lng: float
    ground_msl_m: float = 0.0
    timezone: str = "UTC"
    """IANA name: what `06:30` and the day of `today('06:30')` are reckoned in."""
    ports: Mapping[str, Port] = field(default_factory=dict)
    places: Mapping[str, Any] = field(default_factory=dict)
    regions: Mapping[str, Any] = field(default_factory=dict)
    fence: Any = None
    no_fly: tuple[Any, ...] = ()
    relief_m: float = 0.0
    """How much flat ground may rise above the base's ground, metres; with a height file, what that file may be wrong by."""
    heights: Any = None
    """The ground as a `heights.HeightGrid` (None = flat), read from `terrain: {file: ...}`."""
    layers_m: tuple[float, ...] = (60.0, 75.0, 90.0)
    separation_m: float = 15.0
    min_spacing_m: float = MIN_SPACING_M
    """No two machines use ground spots closer than this."""
    envelope: Mapping[str, float] = field(default_factory=dict)
    """What the site tightens of every machine's envelope, named as in `AgentType.limits`."""
    on_breach: Mapping[str, str] = field(default_factory=dict)
    """Like `AgentType.on_breach`; the site's word ranks above the type's."""
    preflight: bool = False
    """Whether a machine is granted only when its preflight checks are all ok."""
    pilots: Mapping[str, int] = field(default_factory=dict)
    """Pilots and how many machines each may have in the air at once (`mode: real`)."""
    people: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Site roles (watchers, ...) and the ids of those who have them."""
    agents: Mapping[str, SiteAgent] = field(default_factory=dict)
    transports: Mapping[str, Any] = field(default_factory=dict)
    mode: Literal["simulation", "real"] = "simulation"
    file: str = ""
    digest: str = ""
