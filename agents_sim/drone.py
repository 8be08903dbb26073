"""A simulated drone: a machine that flies in straight segments of engine time, with its own mind about what it will not do.

It refuses what a drone would refuse (`already_airborne`, `not_airborne`, `battery_low`, `too_far`, `too_low`, `bad_field`),
does not break off a landing near the ground, at the end of its charge lands by itself, and without its engine does what its
card says (control `failsafe`). It flies at its airspeed, so that wind changes how long a leg takes.
"""

from typing import Any, Final

from agents_sim.body import Setup
from agents_sim.kinds import SimAction, lasts_us
from agents_sim.limits import DroneLimits
from agents_sim.machine import Machine
from agents_sim.motion import MotionKind, Segment, Wind, fall_us, leg_us
from agents_sim.planning import CUT_MOTORS, LOWEST_HOVER_M, Leg, Product, plan, product, way_down, way_home
from agents_sim.preflight import preflight
from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Frame, Position
from formiga_bt.transport.messages import GoalRequest, Landed, PreflightCheck

LANDING_FINAL_M: Final = 5.0
"""Below this a landing is not broken off: its cancel is refused."""
CLEAR_OF_GROUND_M: Final = 0.5
"""Between the ground and here a drone cannot tell whether it stands: landed is "unknown"."""


class Drone(Machine):
    """The body of one drone.

    Args:
        setup: what it is made of; on the ground unless its spec, or how it was found, says otherwise.
    """

    limits: DroneLimits

    def __init__(self, setup: Setup) -> None:
        spec = setup.spec
        self.wind = spec.wind
        self.on_link_loss = spec.on_link_loss
        self.is_unsure = False
        """Set True to play a drone whose sensors do not tell whether it stands."""
        self.broken: dict[str, str] = {}
        """Preflight checks that fail, with what the drone says of it."""
        super().__init__(setup)
        self.actions = tuple(name for name, action in setup.kind.actions.items() if spec.cut or not action.cuts)

    def _limits(self, setup: Setup) -> DroneLimits:
        return DroneLimits().of_type(setup.kind.limits).replaced(setup.spec.limits)

    # What is true now.

    @property
    def is_airborne(self) -> bool:
        """Return whether its rotors turn."""
        return self._kind != "rest"

    @property
    def minds_link(self) -> bool:
        """Return whether it would do something by itself if the engine fell silent now."""
        return self.is_airborne or self._is_alone

    def landed(self) -> Landed:
        """Return what it knows of standing on the ground."""
        if self.is_unsure:
            return "unknown"
        if not self.is_airborne:
            return "grounded"
        if self._kind in ("climb", "descend", "fall") and self.position().up_m < CLEAR_OF_GROUND_M:
            return "unknown"
        return "airborne"

    def on_card(self) -> dict[str, Any]:
        """Return its limits, and what it does without a link."""
        return {"limits": self.limits.on_card(), "on_link_loss": self.on_link_loss}

    def status(self) -> dict[str, Any]:
        """Return what it says of itself."""
        east, north = self.wind
        return {**super().status(), "wind_east_m_s": east, "wind_north_m_s": north, "checks": self.preflight()}

    def preflight(self) -> tuple[PreflightCheck, ...]:
        """Return what is and is not ready for a flight; nothing in the air."""
        return () if self.is_airborne else preflight(self._control, self.home, self.battery(), self.broken)

    # From the side.

    def _plan(self, request: GoalRequest, action: SimAction, *, is_low: bool) -> list[Leg] | str:
        lasts = lasts_us(action, self._seed, request.goal_id)
        return plan(request, action, self.position(), is_airborne=self.is_airborne, is_low=is_low, lasts_us=lasts)

    def _product(self, request: GoalRequest, legs: list[Leg]) -> Product:
        told = self.side.site if self.side is not None else None
        return product(request, legs, Frame(told.base.lat, told.base.lng) if told is not None else self._frame)

    def _begun(self, request: GoalRequest, action: SimAction) -> None:
        if not self.is_airborne and action.effect == "airborne":
            here = self.position()
            self._recorder.rotors_started(self.agent, self.scheduler.now(), here.ground, request.clearance)

    def cancel(self, goal_id: str) -> bool:
        """Stop here and hover, or return False close to the end of a landing."""
        flight = self._flight
        if flight is None or flight.goal_id != goal_id:
            return True
        here = self.position()
        if self._is_falling() or self._is_landing_for_good():
            return False
        if flight.leg.kind == "climb" and here.up_m < LOWEST_HOVER_M:
            flight.canceled = True
            flight.legs = [Leg(Position(here.east_m, here.north_m, LOWEST_HOVER_M), "climb")]
            self._next_leg()
            return True
        return super().cancel(goal_id)

    # From the scheduler, the pilot, the process around it.

    def set_wind(self, wind: Wind) -> None:
        """Change the wind: what is left of the present leg takes as long as it takes in this one."""
        self.wind = wind
        flight = self._flight
        if flight is not None and self._kind == "cruise":
            flight.legs.insert(0, flight.leg)
            self._next_leg()
            self._expect_end(flight)
        self.report()

    def set_unsure(self, unsure: bool) -> None:
        """Let it not know whether it stands."""
        self.is_unsure = unsure
        self.report()

    def set_broken(self, check: str, text: str | None) -> None:
        """Let a preflight check fail with a text; None = it is ok again."""
        self.broken.pop(check, None)
        if text is not None:
            self.broken[check] = text
        self.report()

    def watch_link(self) -> None:
        """Act by itself if the engine is silent for too long, and yield again when it is heard and the flight is over."""
        side = self.side
        if side is None:
            return
        if self._is_alone:
            if not side.is_cut_off and self._flight is None:
                self._is_alone = False
                if self._control == "failsafe":
                    self.hand_back()
        elif side.is_cut_off and self.is_airborne and self._control == "engine":
            self._is_alone = True
            self._carry_on_alone()

    # Inside: alone.

    def _carry_on_alone(self) -> None:
        does = "land" if self._is_landing_for_good() else self.on_link_loss
        if self._is_falling():
            return
        self._yield_to("failsafe")
        if does != "hold":
            here = self.position()
            legs = way_home(here, self.home, self.limits.return_height_m) if does == "return" else way_down(here)
            self._fly("", "link_loss", legs)

    def _is_falling(self) -> bool:
        return self._flight is not None and self._flight.leg.kind == "fall"

    def _is_landing_for_good(self) -> bool:
        flight = self._flight
        is_landing = flight is not None and bool(flight.goal_id) and not flight.legs
        return is_landing and self._kind == "descend" and self.position().up_m < LANDING_FINAL_M

    # Inside: flying.

    def _still(self) -> MotionKind:
        return "hover" if self.is_airborne else "rest"

    def _leg_us(self, start: Position, leg: Leg) -> Micros:
        if leg.lasts_us is not None:
            return leg.lasts_us
        if leg.kind == "fall":
            return fall_us(start.up_m)
        return leg_us(start, leg.to, self.limits.speed_m_s, self.limits.climb_m_s, self.wind, leg.wanted_m_s)

    def _next_leg(self) -> None:
        here = self._segment.at(self.scheduler.now())
        super()._next_leg()
        segment, kind = self._segment, self._kind
        rise = segment.p1.up_m - here.up_m
        if kind in ("climb", "descend") and (here.up_m < CLEAR_OF_GROUND_M) != (segment.p1.up_m < CLEAR_OF_GROUND_M):
            passes = segment.t0 + round((CLEAR_OF_GROUND_M - here.up_m) / rise * (segment.t1 - segment.t0)) + 1
            self._timers.append(self.scheduler.call_at(passes, self.report))

    def _stand_still(self) -> None:
        now, here = self.scheduler.now(), self._segment.at(self.scheduler.now())
        down = self._kind == "rest" or (self._kind in ("descend", "fall") and here.up_m <= 0.0)
        self._move(Segment(now, here, now, here), "rest" if down else "hover")

    def _flat(self) -> None:
        """Land here by its own failsafe; whoever was in command no longer is."""
        self._is_alone = False  # it does not yield again: there is no charge for more
        self._yield_to("failsafe")
        here = self.position()
        ground = Position(here.east_m, here.north_m, 0.0)
        self._fly("", "failsafe", [Leg(ground, "descend")])


__all__ = ["CUT_MOTORS", "Drone"]
