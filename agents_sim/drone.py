"""A simulated drone: motion in straight segments of engine time, charge, and its own mind about what it will not do.

Its place and charge are functions of time, so that they are exact at every speed of the clock. It refuses what a drone
would refuse (`already_airborne`, `not_airborne`, `battery_low`, `too_far`, `too_low`, `bad_field`), does not break off
a landing near the ground, at the end of its charge lands by itself, and without its engine does what its card says
(control `failsafe`). It flies at its airspeed, so that wind changes how long a leg takes.

Called from one thread: by its `AgentSide` (start, cancel), by the scheduler, and by whoever plays the pilot.
"""

from typing import Final

from agents_sim.charge import drain_percent_s
from agents_sim.limits import DroneLimits
from agents_sim.motion import (
    NO_WIND,
    BadFieldError,
    BodyState,
    MotionKind,
    NoRecorder,
    Recorder,
    Segment,
    Wind,
    fall_us,
    leg_us,
)
from agents_sim.planning import CUT_MOTORS, LOWEST_HOVER_M, Flight, Leg, OnLinkLoss, plan, way_down, way_home
from agents_sim.preflight import preflight
from formiga_bt.base.clock import SECOND, Micros, Scheduler, Timer, micros
from formiga_bt.base.geo import Frame, Place, Position, mm
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import Control, GoalRequest, Landed, PreflightCheck

LANDING_FINAL_M: Final = 5.0
"""Below this a landing is not broken off: its cancel is refused."""
CLEAR_OF_GROUND_M: Final = 0.5
"""Between the ground and here a drone cannot tell whether it stands: landed is "unknown"."""


class Drone:
    """The body of one drone (an `AgentBody`). Call `attach` with its side before anything else.

    Args:
        agent: its id.
        scheduler: engine time.
        limits: what it can do.
        state: where and how it begins; on the ground unless `state.kind` says otherwise.
        recorder: told of each segment and rotor start.
        frame: of the base, to report latitude and longitude too.
        wind: that it flies in.
        payload_kg: that it carries.
        can_cut: whether it announces CutMotors.
        on_link_loss: what it does by itself without a link.
    """

    def __init__(
        self,
        agent: str,
        scheduler: Scheduler,
        limits: DroneLimits,
        state: BodyState,
        recorder: Recorder | None = None,
        frame: Frame | None = None,
        *,
        wind: Wind = NO_WIND,
        payload_kg: float = 0.0,
        can_cut: bool = False,
        on_link_loss: OnLinkLoss = "return",
    ) -> None:
        self.agent = agent
        self.actions = ("TakeOff", "GoTo", "LandIn", "Explore", *((CUT_MOTORS,) if can_cut else ()))
        self.limits = limits
        self.wind = wind
        self.payload_kg = payload_kg
        self.on_link_loss = on_link_loss
        self.drift: tuple[float, float] = (0.0, 0.0)
        """How far east and north of the truth its own fix is, in metres."""
        self.is_unsure = False
        """Set True to play a drone whose sensors do not tell whether it stands."""
        self.broken: dict[str, str] = {}
        """Preflight checks that fail, with what the drone says of it."""
        self.home = state.home
        self._control: Control = state.control
        self.confirms_cancel = True
        """Set False to play a drone that stops when canceled but never says so."""
        self._scheduler = scheduler
        self._recorder: Recorder = recorder or NoRecorder()
        self._frame = frame
        self._side: AgentSide | None = None
        self._flight: Flight | None = None
        self._is_alone = state.is_alone
        self._timers: list[Timer] = []
        self._flat_timer: Timer | None = None
        self._segment = state.segment
        self._kind: MotionKind = state.kind
        self._battery, self._battery_at, self._drain = state.battery, state.battery_at, state.drain_percent_s
        self._first_place = state.segment.p1
        self._move(state.segment, state.kind)

    def attach(self, side: AgentSide) -> None:
        """Take the side that speaks for this body; a later one replaces it (its process was started again)."""
        self._side = side
        self._set_status()

    def resume(self) -> None:
        """Say who is in command, after the side was announced: a pilot stays it when the drone's process starts anew."""
        if self._side is not None:
            self._side.take_control(self._control)

    # What is true now.

    @property
    def is_airborne(self) -> bool:
        """Return whether its rotors turn."""
        return self._kind != "rest"

    @property
    def is_alone(self) -> bool:
        """Return whether it acts by itself for want of a link."""
        return self._is_alone

    def position(self) -> Position:
        """Return where it is now, to 1 mm."""
        here = self._segment.at(self._scheduler.now())
        return Position(mm(here.east_m), mm(here.north_m), mm(here.up_m))

    def battery(self) -> float:
        """Return its charge in percent, to a thousandth."""
        return round(self._exact_battery(), 3)

    def landed(self) -> Landed:
        """Return what it knows of standing on the ground."""
        if self.is_unsure:
            return "unknown"
        if not self.is_airborne:
            return "grounded"
        if self._kind in ("climb", "descend", "fall") and self.position().up_m < CLEAR_OF_GROUND_M:
            return "unknown"
        return "airborne"

    def state(self) -> BodyState:
        """Return the whole of it, to be kept."""
        return BodyState(
            self._segment,
            self._kind,
            self._battery,
            self._battery_at,
            self._drain,
            self.home,
            self._control,
            self._is_alone,
        )

    # From the side.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or return why not."""
        is_low = self._exact_battery() <= self.limits.failsafe_percent
        try:
            legs = plan(request, self.position(), is_airborne=self.is_airborne, is_low=is_low)
        except BadFieldError:
            return "bad_field"
        if isinstance(legs, str):
            return legs
        if request.action == "TakeOff":
            here = self.position()
            self._recorder.rotors_started(self.agent, self._scheduler.now(), here.ground, request.clearance)
        self._fly(request.goal_id, request.action, legs)
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Stop here and hover, or return False close to the end of a landing."""
        flight = self._flight
        if flight is None or flight.goal_id != goal_id:
            return True
        here = self.position()
        if flight.action == CUT_MOTORS or self._is_landing_for_good():
            return False
        flight.canceled = True
        if flight.action == "TakeOff" and here.up_m < LOWEST_HOVER_M:
            rise = Position(here.east_m, here.north_m, LOWEST_HOVER_M)
            flight.legs = [Leg(rise, "climb")]
            self._next_leg()
        else:
            self._end_flight()
        return True

    # From the scheduler, the pilot, the process around it.

    def tell(self, event: str) -> None:
        """Tell an event of its own, without fields."""
        if self._side is not None:
            self._side.report_event(event)

    def report(self) -> None:
        """Publish the status and how far the goal is: called now and then, and by itself at each change."""
        side, flight = self._side, self._flight
        if side is None:
            return
        self._set_status()
        side.publish_status()
        if flight is not None and flight.goal_id:
            now = self._scheduler.now()
            whole, left = flight.ends - flight.started, flight.ends - now
            progress = 1.0 if whole <= 0 else round(1.0 - left / whole, 3)
            side.feedback(flight.goal_id, progress=progress, eta_s=round(left / SECOND, 1), phase=self._phase())

    def stop(self) -> None:
        """Drop what it does and hover here (or stand), without a word to anyone."""
        self._flight = None
        self._stand_still()

    def take_over(self) -> None:
        """Play the pilot who takes the controls: it hovers, and its goal ends `taken_over`."""
        self._yield_to("pilot")

    def hand_back(self) -> None:
        """Play the pilot (or the failsafe) that gives the controls back."""
        self._control = "engine"
        self._set_status()
        self.resume()

    def shift(self, by: Micros) -> None:
        """Follow a jump of engine time: everything under way goes on as if the clock had not jumped."""
        self._segment = self._segment.shifted(by)
        self._battery_at += by
        if self._flight is not None:
            self._flight.started += by
            self._flight.ends += by
        self._recorder.moved(self.agent, self._segment, self._kind)

    def carry(self, to: Place) -> None:
        """Play people who carry it to another place: nothing happens while its rotors turn."""
        if not self.is_airborne:
            now, there = self._scheduler.now(), Position(to.east_m, to.north_m, 0.0)
            self._move(Segment(now, there, now, there), "rest")
            self.report()

    def set_battery(self, percent: float) -> None:
        """Change the charge at once (a cell that failed, a wrong gauge)."""
        self._settle_charge(min(100.0, max(0.0, percent)))
        self.report()

    def set_wind(self, wind: Wind) -> None:
        """Change the wind: what is left of the present leg takes as long as it takes in this one."""
        self.wind = wind
        flight = self._flight
        if flight is not None and self._kind == "cruise":
            flight.legs.insert(0, flight.leg)
            self._next_leg()
            self._expect_end(flight)
        self.report()

    def preflight(self) -> tuple[PreflightCheck, ...]:
        """Return what is and is not ready for a flight; nothing in the air."""
        return () if self.is_airborne else preflight(self._control, self.home, self.battery(), self.broken)

    def watch_link(self) -> None:
        """Act by itself if the engine is silent for too long, and yield again when it is heard and the flight is over."""
        side = self._side
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
        if self._flight is not None and self._flight.action == CUT_MOTORS:
            return
        self._yield_to("failsafe")
        if does != "hold":
            here = self.position()
            legs = way_home(here, self.home, self.limits.return_height_m) if does == "return" else way_down(here)
            self._fly("", "link_loss", legs)

    def _is_landing_for_good(self) -> bool:
        flight = self._flight
        is_landing = flight is not None and flight.action == "LandIn"
        return is_landing and self._kind == "descend" and self.position().up_m < LANDING_FINAL_M

    # Inside: flying.

    def _fly(self, goal_id: str, action: str, legs: list[Leg]) -> None:
        now = self._scheduler.now()
        self._flight = flight = Flight(goal_id, action, legs, now)
        self._next_leg()
        self._expect_end(flight)
        # Not now: the side has yet to answer the goal.
        self._timers.append(self._scheduler.call_at(now, self.report))

    def _expect_end(self, flight: Flight) -> None:
        flight.ends, start = self._segment.t1, self._segment.p1
        for leg in flight.legs:
            flight.ends += self._leg_us(start, leg)
            start = leg.to

    def _leg_us(self, start: Position, leg: Leg) -> Micros:
        if leg.kind == "fall":
            return fall_us(start.up_m)
        return leg_us(start, leg.to, self.limits.speed_m_s, self.limits.climb_m_s, self.wind, leg.wanted_m_s)

    def _next_leg(self) -> None:
        flight = self._flight
        assert flight is not None, "no flight has a next leg"
        leg = flight.leg = flight.legs.pop(0)
        now, here = self._scheduler.now(), self._segment.at(self._scheduler.now())
        lasts = self._leg_us(here, leg)
        self._move(Segment(now, here, now + lasts, leg.to), leg.kind)
        self._timers.append(self._scheduler.call_at(now + lasts, self._arrived))
        rise = leg.to.up_m - here.up_m
        if leg.kind in ("climb", "descend") and (here.up_m < CLEAR_OF_GROUND_M) != (leg.to.up_m < CLEAR_OF_GROUND_M):
            passes = now + round((CLEAR_OF_GROUND_M - here.up_m) / rise * lasts) + 1
            self._timers.append(self._scheduler.call_at(passes, self.report))

    def _arrived(self) -> None:
        flight = self._flight
        assert flight is not None, "nobody was on the way"
        if flight.legs:
            self._next_leg()
            self.report()
        else:
            self._end_flight()

    def _end_flight(self) -> None:
        """End the flight where the drone is, and its goal with it."""
        flight, self._flight = self._flight, None
        self._stand_still()
        self._set_status()
        if self._side is None or flight is None:
            return
        if not flight.goal_id:
            self._side.publish_status()
        elif not flight.canceled:
            self._side.finish(flight.goal_id, "succeeded")
        elif self.confirms_cancel:
            self._side.finish(flight.goal_id, "canceled")

    def _stand_still(self) -> None:
        now, here = self._scheduler.now(), self._segment.at(self._scheduler.now())
        down = self._kind == "rest" or (self._kind in ("descend", "fall") and here.up_m <= 0.0)
        self._move(Segment(now, here, now, here), "rest" if down else "hover")

    def _move(self, segment: Segment, kind: MotionKind) -> None:
        """Begin a segment: charge is reckoned up to now and then drains at another rate."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        charge = self._exact_battery()
        self._segment, self._kind = segment, kind
        self._recorder.moved(self.agent, segment, kind)
        self._settle_charge(charge)

    def _settle_charge(self, percent: float) -> None:
        """Reckon the charge from now on, and when it ends."""
        self._battery, self._battery_at = percent, self._scheduler.now()
        self._drain = drain_percent_s(self.limits, self._kind, self._segment, self.home, self.payload_kg)
        if self._flat_timer is not None:
            self._flat_timer.cancel()
        if self._drain > 0.0 and not self._is_failsafe():
            left_s = max(0.0, self._battery - self.limits.failsafe_percent) / self._drain
            self._flat_timer = self._scheduler.call_at(self._battery_at + micros(left_s), self._flat)

    def _flat(self) -> None:
        """Land here by its own failsafe; whoever was in command no longer is."""
        self._is_alone = False  # it does not yield again: there is no charge for more
        self._yield_to("failsafe")
        here = self.position()
        ground = Position(here.east_m, here.north_m, 0.0)
        self._fly("", "failsafe", [Leg(ground, "descend")])

    def _yield_to(self, control: Control) -> None:
        self.stop()
        self._control = control
        self._set_status()
        self.resume()

    def _is_failsafe(self) -> bool:
        return self._flight is not None and self._flight.action == "failsafe"

    def _exact_battery(self) -> float:
        lasted_s = (self._scheduler.now() - self._battery_at) / SECOND
        return min(100.0, max(0.0, self._battery - self._drain * lasted_s))

    def _phase(self) -> str:
        return {"climb": "climbing", "cruise": "flying", "descend": "descending", "fall": "falling"}.get(self._kind, "")

    def _set_status(self) -> None:
        if self._side is not None:
            here, (east_m, north_m) = self.position(), self.drift
            here = Position(mm(here.east_m + east_m), mm(here.north_m + north_m), here.up_m)
            lat, lng = self._frame.lat_lng(here) if self._frame is not None else (None, None)
            self._side.set_status(
                position=here,
                lat=lat,
                lng=lng,
                battery=self.battery(),
                landed=self.landed(),
                payload_kg=self.payload_kg,
                wind_east_m_s=self.wind[0],
                wind_north_m_s=self.wind[1],
                checks=self.preflight(),
                initial_deployment=self._first_place,
            )
