"""What the gate sees: goals as `GateInput`, machines as `Traffic`, limits as `Rules`, all made from the engine's records.

Traffic and its grid are kept and made anew only for machines that changed (`Core.moved`). So is what is known of a goal that
waits, while nothing that it is made from has changed. Called by the gatekeeper and by `engine.goals.air_holding`; decides
nothing.
"""

from operator import attrgetter
from typing import Any, Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.energy import Power
from formiga_bt.base.geo import Place, Position, Region, horizontal_m
from formiga_bt.base.machines import MOVING
from formiga_bt.base.wires import unaccepted
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.kernel.causes import ClearanceHold, ResumeHold, TakeOverHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, StandingOrder, TaskRecord
from formiga_bt.safety.driving import Drive, ways_over
from formiga_bt.safety.driving import at_gate as at_gate_driving
from formiga_bt.safety.envelope import Breach, GateFlight, at_gate, ways_of
from formiga_bt.safety.gate import AT_PORT_M, GateInput
from formiga_bt.safety.grid import Box, Grid, grown
from formiga_bt.safety.rules import Rules
from formiga_bt.safety.traffic import GROUND_M, TakenArea, Traffic, Way, area_of, traffic_of

SUN_EVERY_US: Micros = 60 * SECOND
"""Whether the sun is up is asked so often."""

SPARE: Final = 64
"""So many goals that wait no more are never too many to keep in mind."""

_seen = attrgetter(
    "present", "liveness", "pool", "control", "taken", "rebooted", "goal", "position", "landed", "home", "wire", "lacks",
    "avoids"
)  # fmt: skip
"""What a machine's record adds to `GateInput`."""
_flown = attrgetter(
    "position", "landed", "stood_at", "battery", "payload_kg", "wind", "layer_m", "home", "limits"
)  # fmt: skip
"""What it adds to the flight that is held against the envelope."""


class WaitingGoal:
    """What is known of a waiting goal, and what that was made from."""

    __slots__ = ("ask", "breach", "flown", "seen")

    def __init__(self, ask: GateInput, seen: tuple[Any, ...]) -> None:
        self.ask = ask
        self.seen = seen
        self.breach: Breach | None = None
        self.flown: tuple[Any, ...] = ()
        """Empty: its limits were not looked at yet."""


class GateView:
    """The gate's view of the engine's state."""

    def __init__(self, core: Core, clearances: Clearances) -> None:
        self._core = core
        self._clearances = clearances
        self._skies: Grid[Traffic] = Grid()
        self._ports: Grid[Place] = Grid()
        for port in core.site.ports.values():
            box = (port.at.east_m, port.at.east_m, port.at.north_m, port.at.north_m)
            self._ports.put(port.name, grown(box, AT_PORT_M), port.at)
        self._reach_m = max(core.site.separation_m, core.site.min_spacing_m)
        self._sun: tuple[Micros, bool] = (-1, False)
        self._cases: dict[str, WaitingGoal] = {}

    # -- goals -------------------------------------------------------------------------------------------------------
    def ask(self, goal: GoalRecord) -> GateInput:
        """Return a goal as the gate sees it."""
        if not goal.code:
            return self._ask(goal)  # it does not wait yet: most never do
        state = self._core.state
        agent = state.agents[goal.agent]
        seen = (
            *_seen(agent), state.tasks.get(goal.task), state.orders.get(agent.id), state.clearances.get(agent.id),
            state.lockdown, state.resume, state.counters.get("deposed", 0),
        )  # fmt: skip
        case = self._cases.get(goal.id)
        if case is None:
            case = self._cases[goal.id] = WaitingGoal(self._ask(goal), seen)
            self._forget_old()
        elif case.seen != seen:
            case.ask, case.seen = self._ask(goal), seen
        return case.ask

    def _forget_old(self) -> None:
        gated = self._core.index.gated
        if len(self._cases) > 2 * len(gated) + SPARE:
            self._cases = {goal_id: case for goal_id, case in self._cases.items() if goal_id in gated}

    def _ask(self, goal: GoalRecord) -> GateInput:
        core = self._core
        agent = core.state.agents[goal.agent]
        deposed = core.state.counters.get("deposed", 0) > 0
        task = core.state.tasks.get(goal.task)
        if agent.human:
            return GateInput(
                agent=agent.id, task=goal.task, mobility=agent.mobility, reachable=agent.is_reachable, control="engine",
                deposed=deposed, unsettled=self._is_unsettled(agent.id),
                locked=self._locked(goal, task), held=bool(task and _holds(task, agent, goal.section)),
            )  # fmt: skip
        spec = core.action(goal.action)
        target = goal.fields.get(spec.moves_to) if spec.moves_to else None
        region = None
        if not spec.moves_to:
            region = next((value for value in goal.fields.values() if isinstance(value, Region)), None)
        altitude = goal.fields.get(spec.height) if region is not None or spec.effect == "airborne" else None
        home = core.site.ports.get(agent.home)
        near: list[Place] = []
        if spec.starts_rotors or spec.lands:
            places = agent.position, target
            near = [port for place in places if isinstance(place, Place | Position) for port in self.ports_at(place)]
        return GateInput(
            agent=agent.id,
            task=goal.task,
            mobility=agent.mobility,
            reachable=agent.is_reachable,
            quarantined=agent.pool == "QUARANTINED" and not goal.safety,
            control=agent.control,
            safety=goal.safety,
            deposed=deposed,
            taken=agent.taken,
            busy=agent.goal if agent.goal != goal.id else "",
            stopped=self._stopped(goal),
            locked=self._locked(goal, task),
            unsettled=self._is_unsettled(agent.id),
            goes_home=goal.section == "recover",
            rebooted=agent.rebooted,
            lacks=self._lacks(agent, task),
            held=bool(task and _holds(task, agent, goal.section)),
            requires="" if goal.safety else spec.requires,
            position=agent.position,
            landed=agent.landed,
            target=target if isinstance(target, Place | Position) else None,
            rises_to_m=float(altitude) if isinstance(altitude, int | float) else None,
            starts_rotors=spec.starts_rotors,
            climbs_on=bool(goal.rest_of),
            lands=spec.lands,
            region=region,
            clearance=self._clearances.given(agent.id) if agent.id in core.state.clearances else None,
            cleared=self._clearances.place(agent.id) if agent.id in core.state.clearances else None,
            asked=self._is_asked(goal),
            ports=tuple(near),
            home=home.at if home else None,
            on_routes=bool(goal.path) and self._is_on_routes(agent),
            avoids=agent.avoids,
            exempt_clearance=spec.cuts or (task is not None and task.system.stop in ("land", "cut")),
        )

    def _lacks(self, agent: AgentRecord, task: TaskRecord | None) -> str:
        site = self._core.site
        if not agent.lacks or site.mode != "real" or (task is not None and task.system.agent):
            return ""
        return ", ".join(unaccepted(agent.lacks, site.accept_missing.get(agent.wire, ())))

    def _is_unsettled(self, agent_id: str) -> bool:
        resume = self._core.state.resume
        return resume is not None and (resume.phase != "watching" or agent_id in resume.before)

    def _is_asked(self, goal: GoalRecord) -> bool:
        record = self._core.state.clearances.get(goal.agent)
        return record is not None and record.goal == goal.id and record.state in ("asked", "waiting")

    def _carries_out(self, goal: GoalRecord, order: StandingOrder) -> bool:
        """Return whether a goal is an order's own: of its system task, of the recover that does it, or its `cut`."""
        if goal.id == order.goal:
            return True
        task = self._core.state.tasks.get(goal.task)
        return task is not None and goal.task == order.task and (bool(task.system.agent) or goal.section == "recover")

    def _stopped(self, goal: GoalRecord) -> str:
        order = self._core.state.orders.get(goal.agent)
        if order is None or goal.id.startswith("safety/") or self._carries_out(goal, order):
            return ""
        return order.stop

    def _locked(self, goal: GoalRecord, task: TaskRecord | None) -> str:
        lockdown = self._core.state.lockdown
        if lockdown is None or task is None or goal.safety or task.system.stop:
            return ""
        order = self._core.state.orders.get(goal.agent)
        if order is not None and self._carries_out(goal, order):
            return ""
        way_home = goal.section == "recover" or bool(task.system.agent)
        return "" if way_home and lockdown.how == "return" else lockdown.how

    # -- limits ------------------------------------------------------------------------------------------------------
    def breach(self, goal: GoalRecord, ask: GateInput) -> Breach | None:
        """Return the limit that a goal would break."""
        core = self._core
        agent = core.state.agents[goal.agent]
        rescue = goal.safety or goal.section == "recover"
        rules = core.rules(agent, "" if rescue else goal.task)
        case = self._cases.get(goal.id) if goal.code and not rules.daylight_only else None
        if case is None:
            return self._breach(goal, ask, agent, rules, rescue=rescue)
        flown = (core.airspace.closed, *_flown(agent))
        if case.flown != flown:
            case.breach, case.flown = self._breach(goal, ask, agent, rules, rescue=rescue), flown
        return case.breach

    def _breach(
        self, goal: GoalRecord, ask: GateInput, agent: AgentRecord, rules: Rules, *, rescue: bool
    ) -> Breach | None:
        core = self._core
        if not agent.flies:
            return at_gate_driving(self._drive(goal, ask, agent, rescue=rescue), core.airspace, rules)
        spec = core.action(goal.action)
        moves = ask.target is not None or ask.rises_to_m is not None or ask.region is not None
        flight = GateFlight(
            agent=agent.id,
            here=ask.position,
            grounded=agent.landed == "grounded",
            ways=ways_of(ask.position, ask.target, core.airspace, ask.rises_to_m) if ask.region is None else (),
            region=ask.region,
            region_up_m=ask.rises_to_m if ask.region is not None else None,
            lands_at=(ask.target.ground if isinstance(ask.target, Position) else ask.target) if ask.lands else None,
            hover_s=0.0 if moves else spec.typical_us / SECOND,
            speed_m_s=core.asked_speed(goal),
            spots=(agent.stood_at,) if agent.stood_at is not None else (),
            battery=agent.battery,
            payload_kg=agent.payload_kg,
            wind=agent.wind,
            power=self.power(agent),
            home=ask.home,
            layer_m=agent.layer_m,
            sun_up=self._sun_up() if rules.daylight_only else None,
            rescue=rescue,
        )
        return at_gate(flight, core.airspace, rules)

    def _drive(self, goal: GoalRecord, ask: GateInput, agent: AgentRecord, *, rescue: bool) -> Drive:
        kind = self._core.agent_type(agent)
        own = {**kind.limits, **agent.limits}
        target = ask.target
        return Drive(
            agent=agent.id,
            here=ask.position,
            to=target.ground if isinstance(target, Position) else target,
            around=_around(ask.position, ask.region),
            speed_m_s=self._core.asked_speed(goal),
            own_speed_m_s=own.get("speed_m_s", 0.0),
            battery=agent.battery,
            drain_pct_s=own.get("drive_drain_pct_s", 0.0),
            chargers=self._core.airspace.chargers,
            onward_m=self._onward_m(goal),
            rescue=rescue,
        )

    def _onward_m(self, goal: GoalRecord) -> float | None:
        graph = self._core.route_graph
        if graph is None or not goal.path:
            return None
        stations = [one.name for one in self._core.site.stations.values() if one.charges]
        left = [graph.to(one).get(goal.path[-1]) for one in stations]
        return graph.length_m(goal.path) + min((metres for metres in left if metres is not None), default=0.0)

    def may_land(self, agent: AgentRecord, spot: Place) -> bool:
        """Return whether a machine may fly straight to a spot and land there: fence, no-fly regions, ground."""
        ways = ways_of(agent.position, spot, self._core.airspace)
        flight = GateFlight(agent=agent.id, here=agent.position, ways=ways, lands_at=spot, home=spot, rescue=True)
        return at_gate(flight, self._core.airspace, self._core.rules(agent, "")) is None

    def power(self, agent: AgentRecord) -> Power | None:
        """Return what a machine uses."""
        return self._core.power(agent)

    def _sun_up(self) -> bool:
        at, up = self._sun
        if at < 0 or self._core.now - at >= SUN_EVERY_US:
            up = self._core.airspace.sun_is_up(self._core.now)
            self._sun = (self._core.now, up)
        return up

    # -- the others --------------------------------------------------------------------------------------------------
    def traffic(self, ask: GateInput, more_m: float = 0.0) -> list[Traffic]:
        """Return the machines that may be near a goal's way and spots, in the order of their admission.

        `more_m`: so much further away, too.
        """
        self._refresh()
        here, target = ask.position, ask.target
        if here is not None and target is not None and ask.region is None:  # nearly all of them
            west, east = (here.east_m, target.east_m) if here.east_m <= target.east_m else (target.east_m, here.east_m)
            south, north = here.north_m, target.north_m
            if south > north:
                south, north = north, south
            return self._near((west, east, south, north), more_m)
        points: list[Place | Position] = []
        if ask.position is not None:
            points.append(ask.position)
        if ask.target is not None:
            points.append(ask.target)
        if ask.region is not None:
            points += ask.region.corners
        if not points:
            return []
        easts, norths = [p.east_m for p in points], [p.north_m for p in points]
        return self._near((min(easts), max(easts), min(norths), max(norths)), more_m)

    def _near(self, box: Box, more_m: float) -> list[Traffic]:
        found = self._skies.near(grown(box, self._reach_m + more_m))
        if len(found) > 1:
            found.sort(key=_order)
        return found

    def traffic_of(self, agent_id: str) -> Traffic | None:
        """Return one machine as traffic, or None: it takes up nothing."""
        moved = self._core.moved
        if agent_id in moved:
            del moved[agent_id]
            self._look_at(agent_id)
        return self._skies.get(agent_id)

    def _refresh(self) -> None:
        core = self._core
        if core.moved:
            moved, core.moved = core.moved, {}
            for agent_id in moved:
                self._look_at(agent_id)

    def _look_at(self, agent_id: str) -> None:
        agent = self._core.state.agents[agent_id]
        if agent.mobility in MOVING:
            traffic = self._seen(agent)
            self._skies.put(agent_id, traffic.reach, traffic)

    def _seen(self, agent: AgentRecord) -> Traffic:
        goal = self._core.state.goals.get(agent.goal) if agent.goal else None
        leg: Way | None = agent.lost_leg
        area: TakenArea | None = agent.lost_area
        if goal is not None and goal.in_flight and (goal.leg is not None or goal.area is not None):
            leg, area = goal.leg, goal.area
        also = goal.also if goal is not None and goal.in_flight else None
        column = self._column_m(agent, leg)
        return traffic_of(
            agent.id,
            agent.task,
            agent.landed,
            agent.position,
            leg,
            column,
            area,
            agent.order,
            self._landing_spot(agent),
            also,
            on_routes=area is None and self._is_on_routes(agent),
            avoids=agent.avoids and agent.mobility == "ground",
        )

    def _is_on_routes(self, agent: AgentRecord) -> bool:
        graph, here = self._core.route_graph, agent.position
        return graph is not None and here is not None and any(graph.touches(part, here) for part in agent.on_route)

    def _column_m(self, agent: AgentRecord, leg: Way | None) -> float | None:
        spot = leg[1] if leg is not None else agent.position
        if not agent.task or spot is None or spot.up_m > GROUND_M:
            return None
        return None if self.ports_at(spot) else agent.layer_m

    def _landing_spot(self, agent: AgentRecord) -> Place | None:
        # One that waits in the air for people to stand clear of its landing keeps the spot.
        clearance = self._core.state.clearances.get(agent.id)
        if clearance is None or clearance.state not in ("asked", "waiting") or agent.landed != "airborne":
            return None
        return clearance.place

    def ports_at(self, spot: Place | Position) -> list[Place]:
        """Return the ports at a spot."""
        near = self._ports.near((spot.east_m, spot.east_m, spot.north_m, spot.north_m))
        return [port for port in near if horizontal_m(port, spot) <= AT_PORT_M]

    def occupant(self, agent_id: str, spot: Place) -> str:
        """Return another machine that stands on, or lands at, a spot, or ""."""
        self._refresh()
        near_m = self._core.site.min_spacing_m
        box = grown((spot.east_m, spot.east_m, spot.north_m, spot.north_m), near_m)
        for other in sorted(self._skies.near(box), key=_order):
            if other.agent != agent_id and any(horizontal_m(its, spot) < near_m for its in other.spots):
                return other.agent
        return ""


_order = attrgetter("order")


def _holds(task: TaskRecord, agent: AgentRecord, section: str) -> bool:
    held = task.hold.causes
    if section != "steps":  # cleanup and the way home go on; but only a person hands a machine back that was taken over
        stands = bool(task.system.agent) and agent.landed == "grounded"
        return TakeOverHold(agent.id) in held or (ResumeHold() in held and (section != "recover" or stands))
    # The clearance that a goal's own agent waits for is judged by the gate itself.
    return any(cause != ClearanceHold(agent.id) for cause in held)


def _around(here: Position | None, region: Region | None) -> tuple[Way, ...]:
    if here is None or region is None or not region.corners:
        return ()
    start = Position(here.east_m, here.north_m, 0.0)
    return ways_over(start, None, area_of(region.corners, 0.0, start))
