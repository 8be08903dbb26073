"""What every simulated agent has: goals begin and are canceled, statuses go out, and what may befall it is played.

A body of one's own extends this class, is registered under the entry point `formiga_bt.bodies`, and is made with a `Setup`.
Called from one thread: by its `AgentSide` (start, cancel), by the scheduler, and by whoever plays a fault.
"""

from collections.abc import Mapping
from typing import Any, Protocol

from msgspec import Struct

from agents_sim.finder import Sight, sees_nothing
from agents_sim.kinds import Kind, Outcomes
from agents_sim.motion import BodyState, PersonState, Recorder
from agents_sim.spec import AgentSpec
from formiga_bt.base.clock import Micros, Scheduler
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import GoalRequest


class Setup(Struct, frozen=True, kw_only=True):
    """What a body is made of."""

    spec: AgentSpec
    kind: Kind
    """Its type, as the catalogue says it."""
    scheduler: Scheduler
    """Engine time."""
    recorder: Recorder
    """Told of all motion."""
    state: BodyState | PersonState | None = None
    """How it was found; None = it begins as the spec says."""
    sight: Sight = sees_nothing
    """Where drones fly: what a person may see."""


class Body:
    """One simulated agent (an `AgentBody`).

    Args:
        setup: what it is made of.
    """

    def __init__(self, setup: Setup) -> None:
        self.agent = setup.spec.id
        self.kind = setup.kind
        self.actions: tuple[str, ...] = tuple(setup.kind.actions)
        """What its card offers."""
        self.confirms_cancel = True
        """Set False to play one that stops when canceled but never says so."""
        self.outcomes = Outcomes(setup.spec.outcomes)
        self.scheduler = setup.scheduler
        self.side: AgentSide | None = None
        self.link: object = None
        """What carries its words; files too, if it is a `SendsFiles`."""

    def attach(self, side: AgentSide) -> None:
        """Take the side that speaks for this body; a later one replaces it (its process was started again)."""
        self.side = side
        self.set_status()

    def resume(self) -> None:
        """Go on after the side was announced, at the start and after a new one."""

    # A body says how it does these.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or return the code of its refusal."""
        raise NotImplementedError

    def cancel(self, goal_id: str) -> bool:
        """Stop a goal and end it `canceled`, or return False: it then goes on to its end."""
        raise NotImplementedError

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:  # noqa: ARG002
        """Follow other fields of a goal that runs, or return the code of the refusal."""
        return "no_update"

    def position(self) -> Position | None:
        """Return where it is; None = it has no place."""
        return None

    def status(self) -> dict[str, Any]:
        """Return the fields of its status that differ from those of a machine that does nothing."""
        return {"position": self.position()}

    def state(self) -> BodyState | PersonState | None:
        """Return what is kept while its process is dead; None = nothing."""
        return None

    def on_card(self) -> dict[str, Any]:
        """Return the fields of its card besides id, type, mobility and actions."""
        return {}

    def stop(self) -> None:
        """Drop what it does, without a word to anyone."""

    def shift(self, by: Micros) -> None:
        """Follow a jump of engine time."""

    # What all do alike.

    def set_status(self) -> None:
        """Bring what the side says of it up to date."""
        if self.side is not None:
            self.side.set_status(**self.status())

    def report(self) -> None:
        """Publish the status: called now and then, and by itself at each change."""
        if self.side is not None:
            self.set_status()
            self.side.publish_status()

    def tell(self, event: str, fields: Mapping[str, Any]) -> None:
        """Report an event of its own; `fields` as wire values."""
        if self.side is not None:
            self.side.report_event(event, **fields)

    @property
    def is_airborne(self) -> bool:
        """Return whether its rotors turn."""
        return False

    @property
    def is_alone(self) -> bool:
        """Return whether it acts by itself for want of a link."""
        return False

    @property
    def minds_link(self) -> bool:
        """Return whether it would do something by itself if the engine fell silent now."""
        return False

    def watch_link(self) -> None:
        """Act by itself if the engine is silent for too long, and yield again when it is heard."""

    # What befalls machines; on others it has no effect.

    def take_over(self) -> None:
        """Play the pilot who takes the controls."""

    def hand_back(self) -> None:
        """Play the pilot who gives the controls back."""

    def set_battery(self, percent: float) -> None:
        """Change the charge at once."""

    def set_wind(self, wind: tuple[float, float]) -> None:
        """Change the wind."""

    def set_drift(self, east_m: float, north_m: float) -> None:
        """Let its own fix be so far off the truth."""

    def set_unsure(self, unsure: bool) -> None:
        """Let it not know whether it stands."""

    def set_broken(self, check: str, text: str | None) -> None:
        """Let a preflight check fail with a text; None = it is ok again."""


class BodyMaker(Protocol):
    """A class of bodies."""

    def __call__(self, setup: Setup) -> Body:
        """Return a body."""
        ...
