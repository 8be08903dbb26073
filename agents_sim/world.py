"""Simulated agents from plain data, and a fleet of them in this process with faults on demand.

`build_body` is used by `SimFleet` (dry runs, tests: any `Scheduler`, over a `MemoryHub`) and by `__main__` (one agent
as an OS process). Nothing here reads a clock or is random: equal calls give equal runs.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec
from msgspec import Struct

from agents_sim.drone import Drone
from agents_sim.limits import DRONE_TYPES, PERSON_TYPES, DroneLimits
from agents_sim.motion import BodyState, MotionKind, NoRecorder, Recorder, Segment
from agents_sim.person import Person, read_rules
from formiga_bt.clock import SECOND, Micros, Scheduler
from formiga_bt.geo import Place, Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.base import AgentLink
from formiga_bt.transport.memory import MemoryHub, MemoryLink
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalEvent, GoalRequest

STATUS_EVERY_US: Final[Micros] = 5 * SECOND
"""In virtual time a status comes on change and this often."""


class AgentSpec(Struct, frozen=True, kw_only=True):
    """One simulated agent as plain data."""

    id: str
    type: str
    at: Place | Position = Place(0.0, 0.0)
    """Where it stands; a drone at a Position with `up_m` above 0 hovers there."""
    battery: float = 100.0
    home: Place | None = None
    limits: Mapping[str, float] = {}
    """Overrides of the type's `DroneLimits`, by name."""
    script: Sequence[Mapping[str, Any]] = ()
    """A person's answers, see `person.read_rules`."""
    kind: str = ""
    """`drone` or `person` for a type that is not known here; else the type says it."""


Body = Drone | Person


def is_person(spec: AgentSpec) -> bool:
    """Return whether the spec is of a person.

    Raises:
        ValueError: the type is unknown and `kind` does not help.
    """
    if spec.kind in ("drone", "person"):
        return spec.kind == "person"
    if spec.type not in DRONE_TYPES and spec.type not in PERSON_TYPES:
        known = ", ".join((*DRONE_TYPES, *PERSON_TYPES))
        raise ValueError(f"unknown type {spec.type!r} of {spec.id}; known: {known} (or say kind: drone or person)")
    return spec.type in PERSON_TYPES


def drone_limits(spec: AgentSpec) -> DroneLimits:
    """Return the limits of a drone: its type's, with the spec's overrides.

    Raises:
        ValueError: an override is wrong.
    """
    return DRONE_TYPES.get(spec.type, DroneLimits()).replaced(spec.limits)


def build_body(
    spec: AgentSpec, scheduler: Scheduler, *, recorder: Recorder | None = None, state: BodyState | None = None
) -> Body:
    """Return the body of an agent; `state` is how a drone's body was found, else it begins as the spec says.

    Raises:
        ValueError: the spec is wrong (type, limits, script, charge).
    """
    place = spec.at if isinstance(spec.at, Place) else spec.at.ground
    if is_person(spec):
        return Person(spec.id, scheduler, place, read_rules(spec.script), recorder)
    if not 0.0 <= spec.battery <= 100.0:
        raise ValueError(f"battery of {spec.id} must be 0..100, got {spec.battery!r}")
    limits = drone_limits(spec)
    if state is None:
        here = spec.at if isinstance(spec.at, Position) else Position(place.east_m, place.north_m, 0.0)
        now = scheduler.now()
        kind: MotionKind = "hover" if here.up_m > 0.0 else "rest"
        state = BodyState(Segment(now, here, now, here), kind, spec.battery, now, 0.0, spec.home)
    return Drone(spec.id, scheduler, limits, state, recorder)


def build_card(spec: AgentSpec, body: Body, boot_id: str) -> AgentCard:
    """Return what the agent announces."""
    limits = body.limits.on_card() if isinstance(body, Drone) else {}
    return AgentCard(
        id=spec.id,
        type=spec.type,
        boot_id=boot_id,
        actions=body.actions,
        human=isinstance(body, Person),
        limits=limits,
        on_link_loss="hold",
    )


class FaultyBody:
    """Stands before a body and refuses its next goals (an `AgentBody`)."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.refusals: list[str] = []

    def start(self, request: GoalRequest) -> str:
        """Refuse with the next code in `refusals`, else let the body begin."""
        return self.refusals.pop(0) if self.refusals else self.body.start(request)

    def cancel(self, goal_id: str) -> bool:
        """Let the body cancel."""
        return self.body.cancel(goal_id)


class FaultyLink:
    """Stands before a link and spoils the next statuses (an `AgentLink`)."""

    def __init__(self, link: AgentLink) -> None:
        self.nan_statuses = 0
        self.wrong_ids: list[str] = []
        self._link = link

    def publish_status(self, status: AgentStatus) -> None:
        """Publish, spoiled if so ordered."""
        if self.nan_statuses > 0:
            self.nan_statuses -= 1
            status = msgspec.structs.replace(status, battery=math.nan)
        if self.wrong_ids:
            status = msgspec.structs.replace(status, id=self.wrong_ids.pop(0))
        self._link.publish_status(status)

    def publish_event(self, event: GoalEvent) -> None:
        """Publish."""
        self._link.publish_event(event)

    def publish_card(self, card: AgentCard) -> None:
        """Publish."""
        self._link.publish_card(card)


class SimAgent:
    """One agent of a `SimFleet`: its body, and the process around it as long as it runs (`side` None: killed)."""

    def __init__(self, spec: AgentSpec, body: Body) -> None:
        self.spec = spec
        self.body = body
        self.boots = 0
        self.front = FaultyBody(body)
        self.link: FaultyLink | None = None
        self.side: AgentSide | None = None

    @property
    def drone(self) -> Drone:
        """Return the body of an agent that is a drone."""
        assert isinstance(self.body, Drone), f"{self.spec.id} is no drone"
        return self.body

    @property
    def person(self) -> Person:
        """Return the body of an agent that is a person."""
        assert isinstance(self.body, Person), f"{self.spec.id} is no person"
        return self.body


class SimFleet:
    """Simulated agents in this process, each with its own rules and link, on one scheduler of engine time.

    Args:
        scheduler: engine time; the hub's too.
        hub: the wire to the engine.
        recorder: told of all motion; usually a `Referee`.
        status_every_us: how often each publishes its status besides changes.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        hub: MemoryHub,
        *,
        recorder: Recorder | None = None,
        status_every_us: Micros = STATUS_EVERY_US,
    ) -> None:
        self.agents: dict[str, SimAgent] = {}
        self._scheduler = scheduler
        self._hub = hub
        self._recorder: Recorder = recorder or NoRecorder()
        self._status_every_us = status_every_us
        self._closed = False

    def __getitem__(self, agent: str) -> SimAgent:
        return self.agents[agent]

    def add(self, spec: AgentSpec) -> SimAgent:
        """Build an agent, start it, and announce it.

        Raises:
            ValueError: the spec is wrong, or the id is in use.
        """
        if spec.id in self.agents:
            raise ValueError(f"there is an agent {spec.id} already")
        body = build_body(spec, self._scheduler, recorder=self._recorder)
        agent = self.agents[spec.id] = SimAgent(spec, body)
        self._boot(agent)
        return agent

    def close(self) -> None:
        """Stop the regular statuses: nothing of this fleet is scheduled any more but what is under way."""
        self._closed = True

    def statistics(self) -> dict[str, int]:
        """Return counts: agents, those that run, drones in the air."""
        drones = [agent.body for agent in self.agents.values() if isinstance(agent.body, Drone)]
        return {
            "agents": len(self.agents),
            "running": sum(agent.side is not None for agent in self.agents.values()),
            "airborne": sum(drone.is_airborne for drone in drones),
        }

    # Faults.

    def kill(self, agent: str) -> None:
        """Kill an agent's process. A drone in the air hovers where it is."""
        one = self.agents[agent]
        self._hub.kill(agent)
        one.side = one.link = None
        one.body.stop()

    def restart(self, agent: str) -> None:
        """Start an agent's process again (killing it first if it runs): same body, new boot_id, no goal remembered."""
        if self.agents[agent].side is not None:
            self.kill(agent)
        self._boot(self.agents[agent])

    def freeze(self, agent: str) -> None:
        """Stop an agent's process: it neither hears nor speaks, and its body goes on with what it does."""
        self._hub.freeze(agent)

    def thaw(self, agent: str) -> None:
        """Let a frozen agent go on: all it missed and all it meant to say now passes."""
        self._hub.thaw(agent)

    def take_over(self, agent: str) -> None:
        """Let the pilot take a drone: it hovers, its goal ends `taken_over`."""
        self.agents[agent].drone.take_over()

    def hand_back(self, agent: str) -> None:
        """Let the pilot give a drone back."""
        self.agents[agent].drone.hand_back()

    def refuse_next(self, agent: str, code: str = "not_now", count: int = 1) -> None:
        """Refuse an agent's next goals with `code`."""
        self.agents[agent].front.refusals += [code] * count

    def nan_status(self, agent: str, count: int = 1) -> None:
        """Spoil an agent's next statuses with a NaN; one is published at once."""
        one = self.agents[agent]
        if one.link is not None:
            one.link.nan_statuses += count
            one.body.report()

    def wrong_id_status(self, agent: str, as_id: str, count: int = 1) -> None:
        """Put another's id into an agent's next statuses; one is published at once."""
        one = self.agents[agent]
        if one.link is not None:
            one.link.wrong_ids += [as_id] * count
            one.body.report()

    def never_confirm_cancel(self, agent: str, never: bool = True) -> None:
        """Let an agent stop when canceled, but never say that it did."""
        self.agents[agent].body.confirms_cancel = not never

    def lose_next_result(self, agent: str, count: int = 1) -> None:
        """Lose an agent's next results; its statuses still tell of them."""
        self._hub.lose_results(agent, count)

    # Inside.

    def _boot(self, agent: SimAgent) -> None:
        agent.boots += 1
        wire: MemoryLink = self._hub.link(agent.spec.id)
        agent.link = FaultyLink(wire)
        card = build_card(agent.spec, agent.body, f"{agent.spec.id}-boot-{agent.boots}")
        side = agent.side = AgentSide(card, agent.front, agent.link, now=self._scheduler.now)
        agent.body.attach(side)
        wire.serve(side)
        agent.body.resume()
        self._report_later(agent, agent.boots)

    def _report_later(self, agent: SimAgent, boot: int) -> None:
        def report() -> None:
            if self._closed or agent.side is None or agent.boots != boot:
                return
            agent.body.report()
            self._report_later(agent, boot)

        self._scheduler.call_at(self._scheduler.now() + self._status_every_us, report)
