"""What passes between an engine and an agent, whatever the wire.

Frozen msgspec structs; JSON on the wire (`formats.md` of the docs: docs/wire.md). Numbers are SI with the unit in the
name, percent is 0..100, times are integer microseconds. Stamps come from the sender's idea of engine time and are data,
never compared across machines.
"""

from typing import Any, Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.cards import WIRE, AgentCard, CardAction, CardField

__all__ = [
    "TERMINAL", "WIRE", "AgentCard", "AgentError", "AgentEvent", "AgentGone", "AgentLinkState", "AgentSeen", "AgentStatus",
    "Attachment",
    "BadMessage", "CardAction", "CardField", "Clearance", "ClockBeat", "Control", "EventArrived", "GoalEvent", "GoalReported",
    "GoalRequest", "GoalState", "Landed", "PreflightCheck", "QueryReplied", "SendFailed", "SiteBase", "SiteMessage",
    "SitePoint", "SiteStation", "StatusArrived", "TransportEvent",
    "UpdateAnswered", "UpdateReply", "UpdateRequest", "to_wire",
]  # fmt: skip

Control = Literal["engine", "pilot", "failsafe", "unknown"]
"""Who is in command of an agent. Unless "engine", the engine sends that agent nothing but queries."""

Landed = Literal["grounded", "airborne", "unknown"]

GoalState = Literal[
    "accepted",
    "rejected",
    "running",
    "canceling",
    "succeeded",
    "failed",
    "canceled",
    "taken_over",
    "superseded",
    "unknown",
]
"""States of a goal as an agent reports them. "unknown" only answers a query: the agent never had this goal."""

TERMINAL: Final[frozenset[str]] = frozenset({"rejected", "succeeded", "failed", "canceled", "taken_over", "superseded"})
"""Goal states after which an agent sends no further event for the goal."""


class PreflightCheck(Struct, frozen=True):
    """One thing that an agent looks at before it flies: armable, home, gnss, control, storage, battery, ..."""

    check: str
    ok: bool
    text: str = ""


class AgentError(Struct, frozen=True):
    """Something that is wrong with an agent now, in its own words."""

    code: str
    """A snake_case word."""
    text: str = ""
    severity: Literal["info", "warning", "error"] = "error"


class AgentLinkState(Struct, frozen=True):
    """How good the agent finds its way to the engine."""

    rtt_ms: float | None = None
    loss: float | None = None
    """Share of what is lost, 0..1."""


class AgentStatus(Struct, frozen=True, kw_only=True, rename={"position": "pose"}):
    """The paper's RobotStatus / HumanStatus, and what a safe engine needs besides (`pose` on the wire)."""

    id: str
    type: str
    status: str = "STANDBY"
    """The agent's own word: STANDBY when idle, EXECUTING ACTION while a goal runs."""
    battery: float = 100.0
    position: Position | None = None
    lat: float | None = None
    lng: float | None = None
    task_id: str = "None"
    action_name: str = ""
    initial_deployment: Position | None = None
    control: Control = "engine"
    landed: Landed = "unknown"
    payload_kg: float = 0.0
    wind_east_m_s: float | None = None
    """The wind as the machine feels it: where it blows to. None = it cannot tell."""
    wind_north_m_s: float | None = None
    checks: tuple[PreflightCheck, ...] = ()
    """What is and is not ready for a flight; a machine tells it while it stands on the ground."""
    heading_deg: float | None = None
    """Where it looks: true, clockwise from north."""
    speed_m_s: float | None = None
    altitude_m: float | None = None
    """Its own height, by the `datum` of its card; `pose` counts from the ground at the base."""
    floor: str = ""
    """Of a building, for people: a site is one plane."""
    charging: bool | None = None
    link: AgentLinkState | None = None
    errors: tuple[AgentError, ...] = ()
    """What is wrong with it now."""
    fields: dict[str, Any] = {}
    """What its type says besides (`fields` of the catalogue), as wire values."""
    quality: float = 1.0
    """Trust in the pose, 0..1."""
    age_us: Micros = 0
    """Age of the pose when the status was made."""
    boot_id: str
    """As in the card."""
    seq: int
    """Counts the statuses of this start: one that is not above the newest is late."""
    stamp: Micros
    """Engine time when it was made."""
    beat: int = 0
    """The newest engine heartbeat heard: an echo that dates this status without a common clock."""
    epoch: int = 0
    """The highest epoch that the agent accepted since its start; 0 = none yet, or an agent that does not report it."""
    epoch_ignored: int = 0
    """The newest epoch that it ignored because it was out of bounds; 0 = none."""
    engine_id: str = ""
    """The engine that it follows; empty: none yet."""
    site: str = ""
    """The version of the site message that it has; empty: none yet."""
    last_goal: str = ""
    last_goal_state: str = ""
    """Last ended goal and its state: a lost result is found here."""


class Clearance(Struct, frozen=True):
    """A person's word that people stand clear of a start or landing: who gave it and when (engine time)."""

    by: str
    at: Micros


class GoalRequest(Struct, frozen=True, kw_only=True):
    """An order to one agent. A repeated `goal_id` starts nothing and answers with the recorded state."""

    goal_id: str
    agent: str
    action: str
    fields: dict[str, Any] = {}
    """Action fields as wire values: SI numbers, text, `{east_m, north_m}` places, `{.., up_m}` positions."""
    engine_id: str = ""
    """Which engine sent it; the same after its restart."""
    epoch: int = 0
    """Which start of that engine."""
    beat: int = 0
    """The engine's heartbeat when the goal was sent."""
    ttl_beats: int = 10
    """The goal is refused (`goal_expired`) by an agent whose newest heartbeat is beyond `beat + ttl_beats`."""
    safety: bool = False
    """A safety goal replaces whatever runs (which then ends `superseded`)."""
    clearance: Clearance | None = None
    link_silence_s: float | None = None
    """After so long without the engine's heartbeat the agent does by itself what its card calls `on_link_loss`."""
    task_id: str = "None"


class UpdateRequest(Struct, frozen=True, kw_only=True):
    """Other fields for a goal that runs: a new target of what follows. The highest `n` wins; a repeated one changes nothing."""

    goal_id: str
    agent: str
    action: str
    n: int
    """Counts the updates of this goal from 1."""
    fields: dict[str, Any]
    """The fields that change, as wire values; the others stay."""
    engine_id: str = ""
    epoch: int = 0
    beat: int = 0
    ttl_beats: int = 10


class UpdateReply(Struct, frozen=True, kw_only=True):
    """What became of an update. Refused, the goal goes on as before."""

    goal_id: str
    agent: str
    n: int
    """Of the update that is answered."""
    stands: int = 0
    """The highest that the goal follows now; 0 = none, its first fields."""
    code: str = ""
    """Empty: taken, or an equal or higher one was before. Else why not, a snake_case word: no_update, bad_field, ..."""
    text: str = ""


class GoalEvent(Struct, frozen=True, kw_only=True):
    """What an agent says about one goal: the reply to a goal, to a cancel, to a query, or news of it.

    A terminal event carries the agent's full status, to be applied before the event (else the next expression reads a
    stale position).
    """

    goal_id: str
    agent: str
    state: GoalState
    n: int = 0
    """Counts the events of this goal, so that a late or repeated one is told apart."""
    code: str = ""
    """Why rejected or failed: a snake_case word, for example busy, unknown_action, epoch_old, epoch_far,
    goal_expired, battery_low."""
    text: str = ""
    progress: float | None = None
    """0..1"""
    eta_s: float | None = None
    phase: str = ""
    """The part of an action that runs now, for example `descending`."""
    cancel_refused: bool = False
    """Answers a cancel that will not be followed; the goal goes on to its natural end."""
    result: dict[str, Any] = {}
    attachments: tuple[Attachment, ...] = ()
    """Files that belong to it."""
    status: AgentStatus | None = None


class AgentEvent(Struct, frozen=True, kw_only=True):
    """Something that an agent tells of itself, apart from any goal: an alarm button, a fence that was crossed."""

    agent: str
    event: str
    """Its name, as in the catalogue's `events` of the agent's type."""
    boot_id: str
    n: int
    """Counts the events of this start of the agent from 1, so that a repeated one is told apart."""
    stamp: Micros = 0
    fields: dict[str, Any] = {}
    """As wire values, by the names that the catalogue gives them."""
    attachments: tuple[Attachment, ...] = ()
    """Files that belong to it."""


class ClockBeat(Struct, frozen=True, kw_only=True):
    """The engine's clock, published each wall second and at each change of speed; agents extrapolate."""

    wall_us: Micros
    engine_us: Micros
    speed: float
    epoch: int
    beat: int
    engine_id: str = ""


class SitePoint(Struct, frozen=True):
    """A point of the site's frame, metres."""

    east_m: float
    north_m: float


class SiteBase(Struct, frozen=True):
    """Where the site's frame begins: degrees WGS84, and the height of the ground there over the sea."""

    lat: float
    lng: float
    ground_msl_m: float = 0.0


class SiteStation(Struct, frozen=True, kw_only=True):
    """A place of ground machines."""

    at: SitePoint
    heading_deg: float | None = None
    charges: bool = False
    kinds: tuple[str, ...] = ()
    """Types that may use it; empty: all."""


class SiteMessage(Struct, frozen=True, kw_only=True):
    """What agents should know of the site, for when they must act by themselves."""

    site: str
    """The site's name."""
    version: str
    """Tells this content from any other; an agent says in its status which it has."""
    engine_id: str = ""
    epoch: int = 0
    base: SiteBase
    datum: Literal["local"] = "local"
    """All heights count from the ground at the base."""
    fence: tuple[SitePoint, ...] = ()
    no_fly: tuple[tuple[SitePoint, ...], ...] = ()
    no_go: tuple[tuple[SitePoint, ...], ...] = ()
    transit_m: tuple[float, ...] = ()
    """Heights at which machines cross."""
    return_m: float | None = None
    """The height of a way home of a machine's own."""
    stations: dict[str, SiteStation] = {}
    ports: dict[str, SitePoint] = {}


# What a transport hands to the engine's inbox.


class AgentSeen(Struct, frozen=True, tag=True):
    """An agent is present (also: again, or with a changed card)."""

    card: AgentCard


class AgentGone(Struct, frozen=True, tag=True):
    """The presence token of an agent vanished: its process or link is gone."""

    agent: str


class StatusArrived(Struct, frozen=True, tag=True):
    """A status message came in."""

    status: AgentStatus


class GoalReported(Struct, frozen=True, tag=True):
    """A goal event came in."""

    event: GoalEvent


class EventArrived(Struct, frozen=True, tag=True):
    """An agent told an event of its own."""

    event: AgentEvent


class QueryReplied(Struct, frozen=True, tag=True):
    """An agent answered which of the asked goals it knows, one event each; `boot_id` is its present one."""

    agent: str
    boot_id: str
    goals: tuple[GoalEvent, ...]


class UpdateAnswered(Struct, frozen=True, tag=True):
    """An agent answered an update of a goal."""

    reply: UpdateReply


class SendFailed(Struct, frozen=True, tag=True):
    """A goal, cancel, query or update did not get through.

    `outcome` "unreachable": it surely did not arrive; "unknown": it may have been executed.
    """

    agent: str
    what: Literal["goal", "cancel", "query", "update"]
    goal_id: str
    outcome: Literal["unreachable", "unknown"]
    text: str = ""


class BadMessage(Struct, frozen=True, tag=True):
    """An agent sent something that cannot be read or that lies (NaN, another's id)."""

    agent: str
    text: str


TransportEvent = (
    AgentSeen
    | AgentGone
    | StatusArrived
    | GoalReported
    | EventArrived
    | QueryReplied
    | UpdateAnswered
    | SendFailed
    | BadMessage
)


def to_wire(value: Any) -> Any:
    """Return a runtime value as a wire value: places and positions as plain `{east_m, north_m[, up_m]}` mappings."""
    if isinstance(value, Position):
        return {"east_m": value.east_m, "north_m": value.north_m, "up_m": value.up_m}
    if isinstance(value, Place):
        return {"east_m": value.east_m, "north_m": value.north_m}
    if isinstance(value, Region):
        return [to_wire(corner) for corner in value.corners]
    if isinstance(value, tuple | list):
        return [to_wire(item) for item in value]
    if isinstance(value, dict):
        return {key: to_wire(item) for key, item in value.items()}
    return value
