"""What a checked scenario is made of: agents, requests, faults and orders, each frozen and with runtime values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.model import Catalogue, Site, Task

START: Final[Micros] = 1_000_000 * SECOND
"""Engine time at which a virtual clock begins if nothing else is said: far from zero, which shows a clock read by mistake."""

FaultKind = Literal[
    "kill", "restart", "freeze", "thaw", "nan", "wrong_id", "slow", "refuse", "take_over", "hand_back", "lose_result",
    "never_confirm", "link_loss", "battery", "wind", "preflight", "drift", "unsure", "event",
]  # fmt: skip
OrderWord = Literal[
    "hold", "return", "land", "cut", "continue", "restart", "handback", "clear", "removed", "lockdown", "abort",
]  # fmt: skip
OnLinkLoss = Literal["return", "land", "hold"]
Priority = Literal["low", "medium", "high"]


@dataclass(frozen=True, slots=True)
class ScenarioAgent:
    """One agent: who, where, and for people how they answer."""

    id: str
    type: str
    at: Place | Position
    human: bool
    battery: float = 100.0
    home: Place | None = None
    answers: tuple[Mapping[str, Any], ...] = ()
    """Rules in order: match, options, after (seconds), never."""
    walk: tuple[Place, ...] = ()
    payload_kg: float = 0.0
    cut: bool = False
    """Whether it announces CutMotors."""
    on_link_loss: OnLinkLoss = "return"
    charges: bool = True
    """Whether it charges where there is a charger."""


@dataclass(frozen=True, slots=True)
class ScenarioResult:
    """What is to become of goals of an action."""

    agent: str
    """Whose; "" = of everybody who has the action."""
    action: str
    nth: int = 0
    """Which goal of this action of an agent, from 1; 0 = each."""
    give: Mapping[str, Any] = field(default_factory=dict)
    """Fields of the result, as runtime values."""
    fail: str = ""
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class ScenarioTask:
    """One request: when, which task, with which runtime values."""

    at: Micros
    task: str
    params: Mapping[str, Any]
    priority: Priority | None = None
    texts: Mapping[str, Any] = field(default_factory=dict)
    """The parameters as written: texts, lists and mappings of texts."""
    wait: Micros | None = None
    """How long it waits for its first agents, instead of what its roles say."""
    expires: Micros | None = None
    """The longest time PENDING, instead of the task's own."""


@dataclass(frozen=True, slots=True)
class ScenarioFault:
    """One thing that goes wrong; a fault that lasts for a while is two of these."""

    at: Micros
    agent: str
    kind: FaultKind
    count: int = 1
    as_id: str = "somebody_else"
    code: str = "not_now"
    delay_s: float = 0.0
    on: bool = True
    """False ends one that lasts for a while."""
    vanishes: bool = True
    """Whether the presence token goes with the link (link_loss)."""
    percent: float = 100.0
    """The charge from now on (battery)."""
    east: float = 0.0
    north: float = 0.0
    """Where the wind blows to, m/s (wind); how far the fix is off, metres (drift)."""
    event: str = ""
    """What the agent reports of itself (event)."""
    fields: Mapping[str, Any] = field(default_factory=dict)
    """The fields of the event, as runtime values."""
    check: str = ""
    text: str = "broken"
    """Which check fails, and what the drone says of it (preflight)."""


@dataclass(frozen=True, slots=True)
class ScenarioOrder:
    """One order of a person."""

    at: Micros
    order: OrderWord
    target: str = ""
    """An agent, the name of a task (the newest open one of that name), or empty for all."""
    of: Literal["agent", "task", "all", "site"] = "all"
    how: str = ""
    """Of a handback, a lockdown or an abort."""
    by: str = "operator"


@dataclass(frozen=True, slots=True)
class Scenario:
    """A checked scenario. Tasks, faults and orders are in order of time."""

    name: str
    site: Site
    catalogue: Catalogue
    tasks: Mapping[str, Task]
    """The checked tasks that it names, and those that they request, by name."""
    agents: tuple[ScenarioAgent, ...]
    requests: tuple[ScenarioTask, ...] = ()
    faults: tuple[ScenarioFault, ...] = ()
    orders: tuple[ScenarioOrder, ...] = ()
    results: tuple[ScenarioResult, ...] = ()
    wind: tuple[float, float] = (0.0, 0.0)
    """East and north, m/s, where it blows to."""
    speed: float = 1.0
    seed: int = 0
    file: str = ""
    now: Micros | None = None
    """Engine time at which its clock begins, on the virtual clock; None: as every rehearsal begins."""
