"""A simulated drone: motion in straight segments of engine time, charge, and its own mind about what it will not do.

Its place and charge are functions of time, so that they are exact at every speed of the clock. It refuses what a drone
would refuse (`already_airborne`, `not_airborne`, `battery_low`, `too_far`, `too_low`, `bad_field`), does not break off
a landing near the ground, and at the end of its charge lands by itself (control `failsafe`).

Called from one thread: by its `AgentSide` (start, cancel), by the scheduler, and by whoever plays the pilot.
"""

from typing import Final

from msgspec import Struct

from agents_sim.limits import DroneLimits
from agents_sim.motion import (
    BadFieldError,
    BodyState,
    MotionKind,
    NoRecorder,
    Recorder,
    Segment,
    leg_us,
    read_number,
    read_place,
    read_position,
)
from agents_sim.sweep import sweep
from formiga_bt.clock import SECOND, Micros, Scheduler, Timer, micros
from formiga_bt.geo import Frame, Position, horizontal_m, mm
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import Control, GoalRequest, Landed

LAND_WITHIN_M: Final = 10.0
"""LandIn is refused (`too_far`) when the place is farther than this, over ground."""
LANDING_FINAL_M: Final = 5.0
"""Below this a landing is not broken off: its cancel is refused."""
CLEAR_OF_GROUND_M: Final = 0.5
"""Between the ground and here a drone cannot tell whether it stands: landed is "unknown"."""
LOWEST_HOVER_M: Final = 2.0
"""A canceled take-off first rises to here; GoTo to less is refused (`too_low`)."""
SWEEP_SPACING_M: Final = 20.0


class Leg(Struct, frozen=True):
    """One straight part of a flight."""

    to: Position
    kind: MotionKind
    speed_m_s: float


class _Flight:
    """The motion under way: for a goal, or by the drone's own failsafe (`goal_id` empty)."""

    __slots__ = ("action", "canceled", "ends", "goal_id", "legs", "started")

    def __init__(self, goal_id: str, action: str, legs: list[Leg], started: Micros) -> None:
        self.goal_id = goal_id
        self.action = action
        self.legs = legs
        self.started = started
        self.ends = started
        self.canceled = False


class Drone:
    """The body of one drone (an `AgentBody`). Call `attach` with its side before anything else.

    Args:
        agent: its id.
        scheduler: engine time.
        limits: what it can do.
        state: where and how it begins; on the ground unless `state.kind` says otherwise.
        recorder: told of each segment and rotor start.
        frame: of the base, to report latitude and longitude too.
    """

    actions: Final = ("TakeOff", "GoTo", "LandIn", "Explore")

    def __init__(
        self,
        agent: str,
        scheduler: Scheduler,
        limits: DroneLimits,
        state: BodyState,
        recorder: Recorder | None = None,
        frame: Frame | None = None,
    ) -> None:
        self.agent = agent
        self.limits = limits
        self.home = state.home
        self._control: Control = state.control
        self.confirms_cancel = True
        """Set False to play a drone that stops when canceled but never says so."""
        self._scheduler = scheduler
        self._recorder: Recorder = recorder or NoRecorder()
        self._frame = frame
        self._side: AgentSide | None = None
        self._flight: _Flight | None = None
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

    def position(self) -> Position:
        """Return where it is now, to 1 mm."""
        here = self._segment.at(self._scheduler.now())
        return Position(mm(here.east_m), mm(here.north_m), mm(here.up_m))

    def battery(self) -> float:
        """Return its charge in percent, to a thousandth."""
        return round(self._exact_battery(), 3)

    def landed(self) -> Landed:
        """Return what it knows of standing on the ground."""
        if not self.is_airborne:
            return "grounded"
        if self._kind in ("climb", "descend") and self.position().up_m < CLEAR_OF_GROUND_M:
            return "unknown"
        return "airborne"

    def state(self) -> BodyState:
        """Return the whole of it, to be kept."""
        return BodyState(
            self._segment, self._kind, self._battery, self._battery_at, self._drain, self.home, self._control
        )

    # From the side.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or return why not."""
        try:
            legs = self._plan(request)
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
        if flight.action == "LandIn" and self._kind == "descend" and here.up_m < LANDING_FINAL_M:
            return False
        flight.canceled = True
        if flight.action == "TakeOff" and here.up_m < LOWEST_HOVER_M:
            rise = Position(here.east_m, here.north_m, LOWEST_HOVER_M)
            flight.legs = [Leg(rise, "climb", self.limits.speed_m_s)]
            self._next_leg()
        else:
            self._end_flight()
        return True

    # From the scheduler, the pilot, the process around it.

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

    # Inside: what a goal means.

    def _plan(self, request: GoalRequest) -> list[Leg] | str:
        """Return the legs of a goal, or the code of its refusal."""
        low = self._exact_battery() <= self.limits.failsafe_percent
        if request.action == "TakeOff":
            if self.is_airborne:
                return "already_airborne"
            return "battery_low" if low else self._plan_take_off(request)
        if not self.is_airborne:
            return "not_airborne"
        if request.action == "LandIn":
            return self._plan_landing(request)
        if low:
            return "battery_low"
        if request.action == "GoTo":
            return self._plan_leg(request)
        if request.action == "Explore":
            return self._plan_sweep(request)
        return "unknown_action"

    def _plan_take_off(self, request: GoalRequest) -> list[Leg] | str:
        here, up = self.position(), read_number(request.fields.get("altitude"))
        if up < LOWEST_HOVER_M:
            return "too_low"
        return [Leg(Position(here.east_m, here.north_m, up), "climb", self.limits.speed_m_s)]

    def _plan_leg(self, request: GoalRequest) -> list[Leg] | str:
        to = read_position(request.fields.get("to"))
        return "too_low" if to.up_m < LOWEST_HOVER_M else [Leg(to, "cruise", self._speed(request))]

    def _plan_landing(self, request: GoalRequest) -> list[Leg] | str:
        here, at = self.position(), read_place(request.fields.get("at"))
        if horizontal_m(here, at) > LAND_WITHIN_M:
            return "too_far"
        legs = [Leg(Position(at.east_m, at.north_m, 0.0), "descend", self.limits.speed_m_s)]
        if horizontal_m(here, at) > 0.0:
            legs.insert(0, Leg(Position(at.east_m, at.north_m, here.up_m), "cruise", self.limits.speed_m_s))
        return legs

    def _plan_sweep(self, request: GoalRequest) -> list[Leg] | str:
        corners = request.fields.get("region")
        if not isinstance(corners, list | tuple) or len(corners) < 3:
            return "bad_field"
        up = read_number(request.fields.get("altitude", self.position().up_m))
        if up < LOWEST_HOVER_M:
            return "too_low"
        places = sweep([read_place(corner) for corner in corners], SWEEP_SPACING_M)
        return [Leg(Position(place.east_m, place.north_m, up), "cruise", self._speed(request)) for place in places]

    def _speed(self, request: GoalRequest) -> float:
        wanted = request.fields.get("speed")
        if wanted is None:
            return self.limits.speed_m_s
        speed = read_number(wanted)
        if speed <= 0.0:
            raise BadFieldError(f"no speed: {wanted!r}")
        return min(speed, self.limits.speed_m_s)

    # Inside: flying.

    def _fly(self, goal_id: str, action: str, legs: list[Leg]) -> None:
        now = self._scheduler.now()
        self._flight = flight = _Flight(goal_id, action, legs, now)
        self._next_leg()
        flight.ends = self._segment.t1
        start = self._segment.p1
        for leg in flight.legs:
            flight.ends += leg_us(start, leg.to, leg.speed_m_s, self.limits.climb_m_s)
            start = leg.to
        # Not now: the side has yet to answer the goal.
        self._timers.append(self._scheduler.call_at(now, self.report))

    def _next_leg(self) -> None:
        flight = self._flight
        assert flight is not None, "no flight has a next leg"
        leg = flight.legs.pop(0)
        now, here = self._scheduler.now(), self._segment.at(self._scheduler.now())
        lasts = leg_us(here, leg.to, leg.speed_m_s, self.limits.climb_m_s)
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
        down = self._kind == "rest" or (self._kind == "descend" and here.up_m <= 0.0)
        self._move(Segment(now, here, now, here), "rest" if down else "hover")

    def _move(self, segment: Segment, kind: MotionKind) -> None:
        """Begin a segment: charge is reckoned up to now and then drains at another rate."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        self._battery, self._battery_at = self._exact_battery(), self._scheduler.now()
        self._segment, self._kind = segment, kind
        self._drain = self._drain_of(kind)
        self._recorder.moved(self.agent, segment, kind)
        if self._flat_timer is not None:
            self._flat_timer.cancel()
        if self._drain > 0.0 and not self._is_failsafe():
            left_s = max(0.0, self._battery - self.limits.failsafe_percent) / self._drain
            self._flat_timer = self._scheduler.call_at(self._battery_at + micros(left_s), self._flat)

    def _flat(self) -> None:
        """Land here by its own failsafe; whoever was in command no longer is."""
        self._yield_to("failsafe")
        here = self.position()
        ground = Position(here.east_m, here.north_m, 0.0)
        self._fly("", "failsafe", [Leg(ground, "descend", self.limits.speed_m_s)])

    def _yield_to(self, control: Control) -> None:
        self.stop()
        self._control = control
        self._set_status()
        self.resume()

    def _is_failsafe(self) -> bool:
        return self._flight is not None and self._flight.action == "failsafe"

    def _drain_of(self, kind: MotionKind) -> float:
        if kind == "hover":
            return self.limits.drain_hover_percent_s
        if kind != "rest":
            return self.limits.drain_cruise_percent_s
        at_home = self.home is not None and horizontal_m(self.home, self._segment.p1) <= 2.0
        return -self.limits.charge_percent_s if at_home else 0.0

    def _exact_battery(self) -> float:
        lasted_s = (self._scheduler.now() - self._battery_at) / SECOND
        return min(100.0, max(0.0, self._battery - self._drain * lasted_s))

    def _phase(self) -> str:
        return {"climb": "climbing", "cruise": "flying", "descend": "descending"}.get(self._kind, "")

    def _set_status(self) -> None:
        if self._side is not None:
            here = self.position()
            lat, lng = self._frame.lat_lng(here) if self._frame is not None else (None, None)
            self._side.set_status(
                position=here,
                lat=lat,
                lng=lng,
                battery=self.battery(),
                landed=self.landed(),
                initial_deployment=self._first_place,
            )
