"""A fleet of simulated agents in this process, with faults on demand: for dry runs and tests.

On any `Scheduler`, over a `MemoryHub`. Nothing here reads a clock or is random: equal calls give equal runs. What one agent is
stands in `spec`.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

from agents_sim.bodies import build_body, build_card, check_spec
from agents_sim.body import Body
from agents_sim.drone import Drone
from agents_sim.faults import FLIGHT_ORDERS, FaultyBody, FaultyLink, Order, obey
from agents_sim.motion import NoRecorder, Recorder
from agents_sim.person import Person
from agents_sim.spec import AgentSpec, is_person
from formiga_bt.base.clock import SECOND, Micros, Scheduler
from formiga_bt.base.geo import Place, Position, mm
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.memory import MemoryHub, MemoryLink

__all__ = [
    "STATUS_EVERY_US",
    "AgentSpec",
    "SimAgent",
    "SimFleet",
    "build_body",
    "build_card",
    "check_spec",
    "grid",
    "grid_fleet",
    "is_person",
]

STATUS_EVERY_US: Final[Micros] = 5 * SECOND
"""In virtual time a status comes on change and this often; that its process lives is heard all the time."""


LOOK_EVERY_US: Final[Micros] = SECOND
"""How often a drone without a link looks whether it is back."""


class SimAgent:
    """One agent of a `SimFleet`: its body, and the process around it as long as it runs (`side` None: killed)."""

    def __init__(self, spec: AgentSpec, body: Body) -> None:
        self.spec = spec
        self.body = body
        self.boots = 0
        self.watches = False
        """Whether it looks at its link now and then: in the air only."""
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
        body = build_body(spec, self._scheduler, recorder=self._recorder, sight=self.flying)
        agent = self.agents[spec.id] = SimAgent(spec, body)
        self._boot(agent)
        return agent

    def close(self) -> None:
        """Stop the regular statuses: nothing of this fleet is scheduled any more but what is under way."""
        self._closed = True

    def statistics(self) -> dict[str, int]:
        """Return counts: agents, those that run, drones in the air."""
        agents = self.agents.values()
        return {
            "agents": len(agents),
            "running": sum(agent.side is not None for agent in agents),
            "airborne": sum(agent.body.is_airborne for agent in agents),
        }

    def flying(self) -> dict[str, Position]:
        """Return where the drones in the air are."""
        bodies = [agent.body for agent in self.agents.values() if agent.body.is_airborne]
        return {body.agent: here for body in bodies if (here := body.position()) is not None}

    # Faults.

    def order(self, agent: str, order: Order) -> None:
        """Play a fault; nothing happens to an agent whose process does not run."""
        one = self.agents[agent]
        if order.kind == "slow":
            self._hub.set_delay(agent, round(order.delay_s * SECOND) or self._hub.delay_us)
        elif order.kind == "lose_result":
            self._hub.lose_results(agent, order.count)
        elif order.kind == "link_loss":
            self._hub.cut(agent, vanishes=order.vanishes) if order.on else self._hub.mend(agent)
        elif one.link is not None or order.kind in FLIGHT_ORDERS:
            obey(order, one.body, one.front, one.link or FaultyLink(self._hub.link(agent)))

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
        if self.agents[agent].side is not None:
            self._hub.freeze(agent)

    def thaw(self, agent: str) -> None:
        """Let a frozen agent go on: all it missed and all it meant to say now passes."""
        if self.agents[agent].side is not None:
            self._hub.thaw(agent)

    def lose_link(self, agent: str, *, vanishes: bool = True) -> None:
        """Cut an agent's wire both ways; `vanishes`: its presence token goes too."""
        self.order(agent, Order(kind="link_loss", vanishes=vanishes))

    def mend_link(self, agent: str) -> None:
        """Join an agent's wire again."""
        self.order(agent, Order(kind="link_loss", on=False))

    def take_over(self, agent: str) -> None:
        """Let the pilot take a drone: it hovers, its goal ends `taken_over`."""
        self.order(agent, Order(kind="take_over"))

    def hand_back(self, agent: str) -> None:
        """Let the pilot give a drone back."""
        self.order(agent, Order(kind="hand_back"))

    def refuse_next(self, agent: str, code: str = "not_now", count: int = 1) -> None:
        """Refuse an agent's next goals with `code`."""
        self.order(agent, Order(kind="refuse", code=code, count=count))

    def nan_status(self, agent: str, count: int = 1) -> None:
        """Spoil an agent's next statuses with a NaN; one is published at once."""
        self.order(agent, Order(kind="nan", count=count))

    def wrong_id_status(self, agent: str, as_id: str, count: int = 1) -> None:
        """Put another's id into an agent's next statuses; one is published at once."""
        self.order(agent, Order(kind="wrong_id", as_id=as_id, count=count))

    def never_confirm_cancel(self, agent: str, never: bool = True) -> None:
        """Let an agent stop when canceled, but never say that it did."""
        self.order(agent, Order(kind="never_confirm", on=never))

    def lose_next_result(self, agent: str, count: int = 1) -> None:
        """Lose an agent's next results; its statuses still tell of them."""
        self.order(agent, Order(kind="lose_result", count=count))

    # Inside.

    def _boot(self, agent: SimAgent) -> None:
        agent.boots += 1
        agent.watches = False
        agent.front.begun = lambda: self._watch_link(agent)
        wire: MemoryLink = self._hub.link(agent.spec.id)
        wire.beats = True
        agent.link = FaultyLink(wire)
        agent.body.link = wire
        card = build_card(agent.spec, agent.body, f"{agent.spec.id}-boot-{agent.boots}")
        side = agent.side = AgentSide(card, agent.front, agent.link, now=self._scheduler.now, beat_us=SECOND)
        agent.body.attach(side)
        wire.serve(side)
        agent.body.resume()
        self._report_later(agent, agent.boots)
        if agent.body.is_alone:
            self._watch_link(agent)  # its process was away while it came home by itself: somebody must give it back

    def _report_later(self, agent: SimAgent, boot: int) -> None:
        def report() -> None:
            if self._closed or agent.side is None or agent.boots != boot:
                return
            agent.body.report()
            self._report_later(agent, boot)

        self._scheduler.call_at(self._scheduler.now() + self._status_every_us, report)

    def _watch_link(self, agent: SimAgent) -> None:
        """Let a machine look at its link, at the end of the silence that it may bear, for as long as it moves."""
        body, boot = agent.body, agent.boots
        if agent.watches or not body.minds_link:
            return
        agent.watches, was_silent = True, False

        def look() -> None:
            nonlocal was_silent
            side = agent.side
            if self._closed or side is None or agent.boots != boot:
                return
            is_silent = side.is_cut_off and not self._hub.is_frozen(agent.spec.id)
            if (is_silent and was_silent) or body.is_alone:
                body.watch_link()
            was_silent = is_silent
            if not body.minds_link:
                agent.watches = False
                return
            again()

        def again() -> None:
            # Virtual beats come with events: a look that finds silence may itself bring the next, so it looks twice.
            now, ends = self._scheduler.now(), agent.side.cut_off_at if agent.side is not None else None
            waits = ends is None or ends < now or body.is_alone
            self._scheduler.call_at(now + LOOK_EVERY_US if waits or ends is None else ends + 1, look)

        self._scheduler.call_at(self._scheduler.now(), look)


# Fleets for tests and benchmarks.


def grid(count: int, spacing_m: float, south_m: float = 0.0, columns: int = 0) -> list[Place]:
    """Return `count` places `spacing_m` apart, row by row northwards from `south_m`, centred on the base's meridian."""
    columns = columns or max(1, math.ceil(math.sqrt(count)))
    west_m = -(columns - 1) * spacing_m / 2.0
    return [Place(mm(west_m + i % columns * spacing_m), mm(south_m + i // columns * spacing_m)) for i in range(count)]


def grid_fleet(
    n_lwd: int,
    n_hwd: int,
    n_pickers: int = 0,
    n_watchers: int = 0,
    *,
    spacing_m: float = 25.0,
    field_spacing_m: float = 60.0,
    script: Iterable[Mapping[str, Any]] = (),
) -> list[AgentSpec]:
    """Return a fleet of any size: drones on ports of their own in a grid north of the base, pickers on a grid of fields.

    The fields begin 100 m north of the last port. Drones charge at home, full in about three minutes. They come first (lwd,
    then hwd), so that the first ports are theirs in that order; `script` is what every person answers.
    """
    ports = grid(n_lwd + n_hwd, spacing_m, 40.0)
    north_m = max((port.north_m for port in ports), default=0.0) + 100.0
    fields = grid(n_pickers, field_spacing_m, north_m)
    names = [*(("lwd", i) for i in range(n_lwd)), *(("hwd", i) for i in range(n_hwd))]
    drones = [
        AgentSpec(id=f"{kind}_{i + 1}", type=kind, at=port, home=port, limits={"charge_percent_s": 0.5})
        for (kind, i), port in zip(names, ports, strict=True)
    ]
    said = tuple(script)
    people = [AgentSpec(id=f"picker_{i + 1}", type="picker", at=at, script=said) for i, at in enumerate(fields)]
    watchers = [
        AgentSpec(id=f"watcher_{i + 1}", type="watcher", at=Place(20.0 * i, -40.0), script=said)
        for i in range(n_watchers)
    ]
    return [*drones, *people, *watchers]
