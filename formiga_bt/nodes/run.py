"""What a node may know and do: the `Run` of one task, implemented by the engine.

It is cut by role: a node says by the type of its `run` what it needs of it.

Nodes hold no state that matters beyond a step: their memory goes through `remember`, time comes from `now`, everything
that leaves the tree goes through `order`, `ask`, `notify`. No node reads a sibling, a clock or a random number.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, Protocol

from msgspec import Struct, field

from formiga_bt.base.clock import Micros
from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model import Env, Expr, Role
from formiga_bt.nodes.ends import Drain, End, FinallyEnd
from formiga_bt.nodes.memory import Mem

EndLetter = Literal["S", "F", "K", "H"]
"""How a step ended: it succeeded, failed, was skipped, or was stopped."""


class Runaway(Exception):  # noqa: N818 - the reason code is `runaway`
    """A task visited more nodes in one input than any sane tree does."""


class Failure(Struct, frozen=True, omit_defaults=True):
    """Why a node failed, as data (`error` in YAML). `code` is of the closed table of reason codes (docs/reasons.md)."""

    code: str
    reason: str = ""
    step: str = ""
    """Instance path of the step that failed first."""
    agent: str = ""
    retryable: bool = True
    """False: a goal in doubt, or of an action that may not be repeated."""
    by_another: bool = False
    """Another agent may try again what this one may not: the goal has surely ended, or the agent is lost."""
    data: dict[str, Any] = field(default_factory=dict)
    """What a `fail` carries (`error.data` in YAML)."""


class TaskOutcome(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How it ends: decided when its steps end, and never changed after; then only notes are added."""

    status: Literal["", "SUCCEEDED", "FAILED", "CANCELED"] = ""
    code: str = ""
    """Reason code."""
    reason: str = ""
    failure: Failure | None = None
    notes: tuple[str, ...] = ()
    """What went wrong in cleanup, in each of its runs."""


class GoalView(Protocol):
    """What a leaf sees of its goal."""

    @property
    def id(self) -> str:
        """Return the goal id."""
        ...

    @property
    def agent(self) -> str:
        """Return the agent's id."""
        ...

    @property
    def state(self) -> str:
        """Return the state of the goal (`engine.kernel.records.GoalState`)."""
        ...

    @property
    def code(self) -> str:
        """Return the agent's or the gate's code."""
        ...

    @property
    def text(self) -> str:
        """Return the agent's words, if any."""
        ...

    @property
    def result(self) -> Mapping[str, Any]:
        """Return the result as runtime values."""
        ...

    @property
    def fields(self) -> Mapping[str, Any]:
        """Return what it was told, as runtime values: the newest that the agent took."""
        ...

    @property
    def turned_at(self) -> Micros | None:
        """Return when its agent took other fields last."""
        ...

    @property
    def no_update(self) -> str:
        """Return why its agent did not take the last ones; empty = it took them, or was not asked."""
        ...

    @property
    def repeatable(self) -> bool:
        """Return whether the action may be tried again."""
        ...

    @property
    def ended(self) -> bool:
        """Return whether the goal has a terminal state."""
        ...


class QuestionView(Protocol):
    """What an `ask` sees of its question."""

    @property
    def reply(self) -> Mapping[str, Any] | None:
        """Return `{answer, by, at, all}` once decided, else None."""
        ...


class GoalOrder(Struct, frozen=True):
    """A leaf's wish to send a goal."""

    goal_id: str
    agent: str
    action: str
    fields: dict[str, Any]
    owner: str
    """Path of the node to wake when the goal changes."""
    attempt: int = 1
    """The how-manieth goal of its step it is: each `continue` asks for another one."""
    tracks: bool = False
    """Its fields will change while it runs: not for an agent that cannot be told."""


class Served(Struct, frozen=True):
    """The allocator's answer to a block that asked for agents: who they are, by role, or why there never will be any."""

    roles: dict[str, tuple[str, ...]]
    reason: str = ""


class AskOrder(Struct, frozen=True):
    """A leaf's wish to ask people. `tiers`: groups asked one after another; one group when nothing escalates."""

    id: str
    text: str
    note: str
    options: tuple[str, ...]
    tiers: tuple[tuple[str, ...], ...]
    policy: Literal["any", "all"]
    escalate_us: Micros | None
    expires_at: Micros | None
    if_no_answer: str
    clears: str
    """Agent that an answer in `clears_on` also gives clearance to, or empty."""
    clears_on: tuple[str, ...]
    owner: str
    form: tuple[FormField, ...] = ()


AROUND: Final = ".."
"""Among the values of a scope: the scope around it, whose names are visible too."""
THROUGH: Final = ".="
"""Among the values of a scope: what is written in it belongs to the scope around it."""


class TaskView(Protocol):
    """What a `request` sees of its task."""

    @property
    def id(self) -> str:
        """Return the task's id."""
        ...

    @property
    def status(self) -> str:
        """Return its status."""
        ...

    @property
    def outcome(self) -> TaskOutcome:
        """Return how it ends."""
        ...

    @property
    def ended(self) -> bool:
        """Return whether its status is terminal."""
        ...


class TaskOrder(Struct, frozen=True):
    """A leaf's wish to start another task."""

    owner: str
    """Key of the node to wake at its end."""
    task: str
    params: dict[str, Any]
    priority: Literal["", "low", "medium", "high"]
    detached: bool


class CleanupOrder(Struct, frozen=True):
    """A stopped sequence hands its `finally` over to whoever waits for the ends of its goals."""

    path: str
    """Of the sequence."""
    scope: str
    alias: str
    """The scope of the `finally`: for now another name of `scope`."""
    after: Drain
    """What the sequence itself leaves to wait for; with that the `finally` begins."""
    error: Failure | None
    """What `error` is in it."""


class NodeRun(Protocol):
    """What each node needs: its visits are counted, its memory is kept, wakes reach it."""

    @property
    def task_id(self) -> str:
        """Return the task's id, for example `PickUp-12`."""
        ...

    def spend(self) -> None:
        """Count one visited node.

        Raises:
            Runaway: more than 10,000 nodes were visited in this input.
        """
        ...

    def remember(self, path: str, mem: Mem | None) -> None:
        """Set or forget a node's memory."""
        ...

    def memory(self, path: str) -> Mem | None:
        """Return a node's memory."""
        ...

    def ended(self, path: str, how: EndLetter, code: str = "") -> None:
        """Tell how the step at an instance path ended, for who looks on: nothing depends on it."""
        ...

    def register(self, path: str, node: Any) -> None:
        """Let wakes for `path` reach `node`."""
        ...

    def unregister(self, path: str) -> None:
        """Stop wakes for `path`."""
        ...


class NameRun(Protocol):
    """Names: what expressions read, and steps set."""

    def env(self, scope: str, error: Failure | None = None, extra: Mapping[str, Any] | None = None) -> Env:
        """Return the names visible in a scope; `error` and `extra` add the names that the place provides."""
        ...

    def open_scope(self, scope: str, values: Mapping[str, Any]) -> None:
        """Open the scope of a call, or of an item of a parallel `for` (its key `..` names the scope around it)."""
        ...

    def close_scope(self, scope: str) -> None:
        """Forget a scope."""
        ...

    def set_var(self, scope: str, name: str, value: Any) -> None:
        """Set a name in a scope."""
        ...


class TimeRun(Protocol):
    """Clocks and deadlines."""

    @property
    def now(self) -> Micros:
        """Return the instant of the input being handled, engine time."""
        ...

    @property
    def clock(self) -> Micros:
        """Return the task's own time: like `now`, but it stands still while the task is held."""
        ...

    def set_deadline(self, path: str, at: Micros) -> None:
        """Wake the node at `path` at engine time `at`."""
        ...

    def clear_deadline(self, path: str) -> None:
        """Forget the deadline of `path`."""
        ...

    def deadline(self, path: str) -> Micros | None:
        """Return the deadline of the node at `path`, or None if it has none."""
        ...

    def is_due(self, path: str) -> bool:
        """Return whether the deadline of `path` has fired and was not cleared."""
        ...


class WatchRun(Protocol):
    """Live conditions, and events of agents."""

    def watch(self, path: str, conditions: "tuple[Expr, ...]", scope: str) -> None:
        """Wake the node at `path` when what its live conditions read has changed, or a comparison with `now` has."""
        ...

    def unwatch(self, path: str) -> None:
        """Forget the watch of `path`, if there is one."""
        ...

    def watch_event(self, path: str, agent: str, event: str) -> None:
        """Wake the node at `path` at each event of that name that an agent tells; `unwatch` ends it."""
        ...

    def watch_agents(self, path: str, fields: Sequence[tuple[str, str]]) -> None:
        """Wake the node at `path` when one of these (agent, field) changes; `unwatch` ends it."""
        ...

    def newest_event(self) -> int:
        """Return the order of the newest event of anyone."""
        ...

    def events_seen(self, agent: str, event: str) -> int:
        """Return the order of the last event of that name that this task took, or of the last before its admission."""
        ...

    def take_event(self, agent: str, event: str, after: int) -> Mapping[str, Any] | None:
        """Take the next event of that name after an order; return its fields with `at`, or None if there is none yet."""
        ...


class StepRun(NodeRun, NameRun, TimeRun, WatchRun, Protocol):
    """What a step needs that sends nothing."""


class DrainRun(Protocol):
    """What those need that wait for ends."""

    def goal(self, goal_id: str) -> GoalView:
        """Return the present view of an ordered goal."""
        ...

    def is_over(self, end: End) -> bool:
        """Return whether what a drain set waits for is over."""
        ...

    def adopt(self, end: End, owner: str) -> None:
        """Make the node at path `owner` the one that is woken at an end."""
        ...

    def forget(self, end: End) -> None:
        """Drop what is over of a drain set."""
        ...

    def cleanup(self, order: CleanupOrder, tree: Any = None) -> FinallyEnd | None:
        """Hand over a `finally`, with its tree if it runs already; return its end, None = it is skipped (abort --now)."""
        ...


class GoalRun(StepRun, Protocol):
    """What a `do` needs."""

    def goal_id(self, path: str) -> str:
        """Return the goal id that belongs to an instance path."""
        ...

    def order(self, order: GoalOrder) -> Failure | None:
        """Order a goal. It leaves when the gate lets it; a Failure says why it never can."""
        ...

    def goal(self, goal_id: str) -> GoalView:
        """Return the present view of an ordered goal."""
        ...

    def change_goal(self, goal_id: str, fields: dict[str, Any]) -> str:
        """Ask for other fields of a goal that runs; return why that cannot be, "" = the agent is asked."""
        ...

    def drop_goal(self, goal_id: str) -> None:
        """Forget an ended goal whose outcome was taken."""
        ...

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal; return whether its end must be waited for (False: it never left, or has ended)."""
        ...


class AgentsRun(StepRun, Protocol):
    """What `release`, and a block with agents of its own, need."""

    def release(self, agent: str, path: str, after: Drain = ()) -> None:
        """Give an agent back: when goal-free, brought home if airborne. The node at `path` is woken when it is done."""
        ...

    def is_released(self, agent: str) -> bool:
        """Return whether the task no longer holds an agent."""
        ...

    def is_low(self, agent: str, percent: float) -> bool:
        """Return whether an agent that flies, or drives, has come to this charge."""
        ...

    def why_gone(self, agent: str) -> str:
        """Return why an agent was taken from the task (`lost`, ...); "" of one that it holds."""
        ...

    def want_agents(self, path: str, roles: Mapping[str, Role], env: Env, but_not: tuple[str, ...]) -> Micros:
        """Ask the allocator for the agents of a block, none of `but_not`; return until when to wait for them.

        The node at `path` is woken when there is an answer.
        """
        ...

    def take_agents(self, path: str) -> Served | None:
        """Return the answer, once; None = not yet."""
        ...

    def withdraw_agents(self, path: str) -> tuple[str, ...]:
        """Ask no more; return the agents that were granted but not yet taken."""
        ...


class ResourcesRun(StepRun, Protocol):
    """What a block with resources needs."""

    def want_resources(self, path: str, units: Mapping[str, int]) -> None:
        """Ask for units of resources, all at once. The node at `path` is woken when there is an answer."""
        ...

    def take_resources(self, path: str) -> str | None:
        """Return "" once they are held, why they never will be, or None: not yet."""
        ...

    def withdraw_resources(self, path: str) -> None:
        """Ask no more, and give back what was granted meanwhile."""
        ...

    def free_resources(self, path: str, after: Drain, *, well: bool) -> None:
        """The block has ended: give back what it held once `after` is over.

        Not `well`: if the task ends with it, it keeps them until its machines are home.
        """
        ...


class PeopleRun(StepRun, Protocol):
    """What a question and a notice need."""

    def goal_id(self, path: str) -> str:
        """Return the goal id that belongs to an instance path."""
        ...

    def ask(self, order: AskOrder) -> None:
        """Open a question."""
        ...

    def question(self, ask_id: str) -> QuestionView:
        """Return the present view of an open question."""
        ...

    def close_question(self, ask_id: str) -> None:
        """Withdraw a question, or forget an answered one. Local, always succeeds."""
        ...

    def people(self, site_role: str) -> tuple[str, ...]:
        """Return the ids of the people of a site role."""
        ...

    def notify(self, text: str, to: tuple[str, ...], severity: str, path: str) -> None:
        """Tell people something."""
        ...


class ChildRun(StepRun, Protocol):
    """What a `request` needs."""

    def start_task(self, order: TaskOrder) -> str | Failure:
        """Start another task; return its id, or why it cannot be."""
        ...

    def child(self, task_id: str) -> TaskView:
        """Return a started task."""
        ...

    def end_task(self, task_id: str) -> bool:
        """Abort a started task; return whether its end must be waited for."""
        ...


class Run(GoalRun, AgentsRun, ResourcesRun, PeopleRun, ChildRun, DrainRun, Protocol):
    """All services of one running task: for nodes that have others below, and pass it on."""
