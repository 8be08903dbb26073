"""Steps, one record for each kind, without logic. `StepBase` is what every kind may have; children stand in lists of their own.

Every step knows its source mark. Static paths: the steps of a section, branch or subtree body are numbered in their list
(`steps[1]`, `then[0]`, `sequence[2]`); `compile` joins them.
"""

from collections.abc import Mapping
from typing import Final, Literal

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model.expr import Expr
from formiga_bt.lang.model.needs import Param, Role


class Who(Struct, frozen=True):
    """Whom a key such as `of`, `to` or `do` names: a role, loop name or agent param; or a site role (`watchers`)."""

    name: str
    agent: Expr | None
    """Evaluates to an AgentRef; None when `site_role`."""
    site_role: bool
    mark: Mark


class Retry(Struct, frozen=True):
    """The retry modifier. `attempts` counts the first one; delays in seconds."""

    attempts: Expr
    delay: Expr | None
    backoff: Expr | None
    attempt_timeout: Expr | None
    agent: Literal["same", "another"]
    mark: Mark
    on: tuple[str, ...] = ()
    """Reason codes after which it tries again; none: after each."""
    unless: tuple[str, ...] = ()
    """Reason codes after which it does not."""
    fresh: tuple[str, ...] = ()
    """Names that an attempt saves: they have no value when the next one begins."""

    def covers(self, code: str) -> bool:
        """Return whether it is meant for failures with this reason code; `failed` names each `failed:<code>`, too."""
        names = {code, code.replace("failed:", ""), code.partition(":")[0] if code.startswith("failed:") else code}
        return (not self.on or not names.isdisjoint(self.on)) and names.isdisjoint(self.unless)


class Track(Struct, frozen=True):
    """Follow what moves: how often to look (seconds), and from how many metres on the agent is told."""

    every: Expr
    mark: Mark
    within: Expr | None = None
    fields: tuple[str, ...] = ()
    """Those of the action whose values may change while it runs."""


class StepBase(Struct, frozen=True, kw_only=True):
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


class Do(StepBase, frozen=True, kw_only=True):
    """Send a goal to an agent and wait for its result."""

    who: Who
    action: str
    fields: Mapping[str, Expr]
    """Every field that is given or has a default, in the catalogue's order. Defaults may read `agent.<field>`: in such an
    expression the name `agent` is this step's agent."""
    track: Track | None = None
    save_as: str = ""
    expect: Expr | None = None

    @property
    def title(self) -> str:
        """Return the step's name, or `role.Action`."""
        return self.name or f"{self.who.name}.{self.action}"


class Ask(StepBase, frozen=True, kw_only=True):
    """Ask people; `{answer, by, at}` and what the form holds."""

    question: Expr
    of: tuple[Who, ...]
    options: tuple[str, ...]
    policy: Literal["any", "all"] = "any"
    escalate_after: Expr | None = None
    form: tuple[FormField, ...] = ()
    clears: Who | None = None
    clears_on: tuple[str, ...] = ()
    if_no_answer: Expr | None = None
    save_as: str = ""
    expect: Expr | None = None


class Call(StepBase, frozen=True, kw_only=True):
    """Run a subtree in its own scope."""

    subtree: "Subtree"
    args: Mapping[str, Expr]
    save_as: str = ""

    @property
    def title(self) -> str:
        """Return the step's name, or the subtree's."""
        return self.name or self.subtree.name


class Wait(StepBase, frozen=True, kw_only=True):
    """Wait a duration (seconds)."""

    duration: Expr


class Check(StepBase, frozen=True, kw_only=True):
    """Succeed or fail now."""

    cond: Expr
    message: Expr | None = None


class Set(StepBase, frozen=True, kw_only=True):
    """Assign vars, in file order."""

    assign: Mapping[str, Expr]


class Notify(StepBase, frozen=True, kw_only=True):
    """Tell people; never fails. Empty `to` = the site's watchers."""

    text: Expr
    to: tuple[Who, ...] = ()
    severity: Literal["info", "warning", "alarm"] = "info"


class Fail(StepBase, frozen=True, kw_only=True):
    """Fail with a message and, optionally, a snake_case code and values, which are read as `error.data`."""

    message: Expr
    code: str = ""
    data: Mapping[str, Expr] = field(default_factory=dict)


class Sequence(StepBase, frozen=True, kw_only=True):
    """Steps one after another, with memory. `reactive`: earlier children, pure checks, are re-checked live."""

    steps: tuple["Step", ...]
    reactive: bool = False
    finally_: tuple["Step", ...] = ()
    """Runs in place after success and failure; segments `finally[i]`."""


class Fallback(StepBase, frozen=True, kw_only=True):
    """The first child that succeeds; while a later child runs, `error` is the former one's failure."""

    steps: tuple["Step", ...]
    reactive: bool = False


class WaitUntil(StepBase, frozen=True, kw_only=True):
    """Wait until a live condition is true."""

    cond: Expr


class WaitFor(StepBase, frozen=True, kw_only=True):
    """Wait for the next event of an agent. `since_task`: also one that came since the task's admission and none took yet."""

    who: Who
    event: str
    since_task: bool = False
    save_as: str = ""

    @property
    def title(self) -> str:
        """Return the step's name, or `role.event`."""
        return self.name or f"{self.who.name}.{self.event}"


class Release(StepBase, frozen=True, kw_only=True):
    """Give an agent back before the task ends: goal-free, recovered if airborne, then freed."""

    who: Who


class Parallel(StepBase, frozen=True, kw_only=True):
    """`parallel` and `race`: children at once; segments `parallel[i]` or `race[i]`.

    `need`: "all", "any" or a number must succeed; "first" is a race: the child that ends first decides, well or badly.
    """

    steps: tuple["Step", ...]
    need: int | Literal["all", "any", "first"] = "all"
    on_child_failure: Literal["finish", "cancel"] = "finish"

    @property
    def least(self) -> int:
        """Return how many children must succeed: 1 of a race, too."""
        words = {"all": len(self.steps), "any": 1, "first": 1}
        return self.need if isinstance(self.need, int) else words[self.need]


class Loop(StepBase, frozen=True, kw_only=True):
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
    steps: tuple["Step", ...]
    until: Expr | None = None
    every: Expr | None = None
    max: Expr | None = None
    fresh: tuple[str, ...] = ()
    """Names that a round saves: they have no value when the next one begins."""


class For(StepBase, frozen=True, kw_only=True):
    """`for`: a round per item of lists of equal lengths, in order or at once; segments `steps[i]`."""

    lists: Mapping[str, Expr]
    """Loop name -> list."""
    steps: tuple["Step", ...]
    parallel: bool = False
    said_mode: bool = False
    """Whether the file says `mode`."""
    max_parallel: int | None = None
    need: int | Literal["all"] = "all"
    on_child_failure: Literal["finish", "cancel"] = "finish"
    collect: str = ""
    first: str = ""
    """The name that an item saves to win: the others are stopped then, and the loop ends well with that value."""
    fresh: tuple[str, ...] = ()
    """Names that a round saves: they have no value when the next one begins. Of items at once each has its own."""

    @property
    def gives(self) -> str:
        """Return the name that has a value after the loop: a list of `collect`, or the value of `first`."""
        return self.collect or self.first

    @property
    def needs_all(self) -> bool:
        """Return whether its success says that the steps of every item have succeeded."""
        return self.need == "all" and not self.first


class BreakIf(StepBase, frozen=True, kw_only=True):
    """Leave the nearest loop with success."""

    cond: Expr


class Guard(StepBase, frozen=True, kw_only=True):
    """Stop the steps and fail as soon as a live condition is false; segments `steps[i]`."""

    cond: Expr
    steps: tuple["Step", ...]


class If(StepBase, frozen=True, kw_only=True):
    """Branch on a condition, read once at entry."""

    cond: Expr
    then: tuple["Step", ...]
    otherwise: tuple["Step", ...] = ()


class SwitchCase(Struct, frozen=True):
    """One value of a `switch`, and its steps (segments `case0[i]`, `case1[i]` for the next one)."""

    value: str | int
    mark: Mark
    steps: tuple["Step", ...]


class Switch(StepBase, frozen=True, kw_only=True):
    """Branch on a value, read once at entry; segments of the default `default[i]`.

    Without a default the cases name every value that the expression can have.
    """

    on: Expr
    cases: tuple[SwitchCase, ...]
    default: tuple["Step", ...] = ()

    @property
    def branches(self) -> tuple[tuple["Step", ...], ...]:
        """Return the steps of each way through it."""
        return (*(case.steps for case in self.cases), *((self.default,) if self.default else ()))


class Request(StepBase, frozen=True, kw_only=True):
    """Start another task and, unless `wait` is false, wait for its end; it ends with its parent unless `detached`."""

    task: str
    args: Mapping[str, Expr]
    priority: Literal["", "low", "medium", "high"] = ""
    """Empty = as its own file says."""
    wait: bool = True
    detached: bool = False
    save_as: str = ""
    needs: tuple[Role, ...] = ()
    """What the other task is granted before its first step: names, types and counts only."""

    @property
    def title(self) -> str:
        """Return the step's name, or the task's."""
        return self.name or self.task


class WithAgents(StepBase, frozen=True, kw_only=True):
    """Extra agents for its steps (segments `steps[i]`), given back at their end; the expressions of roles are read at entry."""

    roles: Mapping[str, Role]
    steps: tuple["Step", ...]
    fresh: tuple[str, ...] = ()
    """Names that its steps save: they have no value when it begins anew."""


class WithResource(StepBase, frozen=True, kw_only=True):
    """Units of resources of the site for its steps (segments `steps[i]`), all at once, given back at their end."""

    units: Mapping[str, int]
    """Resource -> units of it, from 1 on."""
    steps: tuple["Step", ...]
    wait: Expr | None = None
    """How long to wait for them; None = `RESOURCE_WAIT_S`."""

    @property
    def said(self) -> str:
        """Return what it asks for as authors write it: `lift_1, dock_bay: 2`."""
        return ", ".join(name if units == 1 else f"{name}: {units}" for name, units in self.units.items())


RESOURCE_WAIT_S: Final = 900.0
"""How long a block waits for its resources that does not say it, seconds."""


class Subtree(Struct, frozen=True):
    """A reusable body with its own scope."""

    name: str
    params: Mapping[str, Param]
    steps: tuple["Step", ...]
    mark: Mark
    returns: Expr | None = None


Step = (
    Do
    | Ask
    | Call
    | Wait
    | Check
    | Set
    | Notify
    | Fail
    | Sequence
    | Fallback
    | WaitUntil
    | WaitFor
    | Release
    | Parallel
    | Loop
    | For
    | BreakIf
    | Guard
    | If
    | Switch
    | Request
    | WithAgents
    | WithResource
)
"""A step of any kind: a closed union, so that who handles each kind hears of a new one from the type checker."""
