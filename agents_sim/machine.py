"""A simulated machine of any type: what the catalogue says of its actions is what it does.

An action that `moves_to` a place goes there at the machine's speed; any other lasts what is typical. Its place and charge are
functions of time, so that they are exact at every speed of the clock. `Machine` is what drives, stands or has no place at all;
`drone.Drone` flies. Without its engine, and at the end of its charge, a machine on the ground stands still.
"""

from collections.abc import Mapping
from typing import Any, Final

from msgspec.structs import replace

from agents_sim.body import Body, Setup
from agents_sim.charge import drain_percent_s
from agents_sim.kinds import Outcome, SimAction, lasts_us
from agents_sim.limits import MachineLimits
from agents_sim.motion import BadFieldError, BodyState, MotionKind, Segment, leg_us, read_place
from agents_sim.planning import Flight, Leg, Product, speed_of
from formiga_bt.base.clock import SECOND, Micros, Timer, micros
from formiga_bt.base.geo import Frame, Place, Position, mm
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import Attachment, attachment_of
from formiga_bt.transport.base import SendsFiles
from formiga_bt.transport.messages import Control, GoalRequest, Landed

NO_ACTION: Final = SimAction()


class Machine(Body):
    """The body of one machine. Call `attach` with its side before anything else.

    Args:
        setup: what it is made of.
    """

    limits: MachineLimits

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        spec, state = setup.spec, setup.state
        self.payload_kg = spec.payload_kg
        self.drift: tuple[float, float] = (0.0, 0.0)
        """How far east and north of the truth its own fix is, in metres."""
        self.limits = self._limits(setup)
        if not isinstance(state, BodyState):
            state = _beginning(setup, self.scheduler.now())
        self.home = state.home
        self._chargers = (*([self.home] if self.home is not None else []), *spec.chargers)
        self._seed = spec.seed
        self._control: Control = state.control
        self._recorder = setup.recorder
        self._moves = setup.kind.mobility in ("air", "ground")
        self._has_place = setup.kind.mobility != "none"
        self._frame = Frame(*spec.base) if spec.base is not None else None
        self._flight: Flight | None = None
        self._is_alone = state.is_alone
        self._timers: list[Timer] = []
        self._flat_timer: Timer | None = None
        self._segment = state.segment
        self._kind: MotionKind = state.kind
        self._battery, self._battery_at, self._drain = state.battery, state.battery_at, state.drain_percent_s
        self._first_place = state.segment.p1
        self._move(state.segment, state.kind)

    def _limits(self, setup: Setup) -> MachineLimits:
        """Return what it can do: the type's numbers, with those of the spec in their place."""
        return MachineLimits().of_type(setup.kind.limits).replaced(setup.spec.limits)

    def resume(self) -> None:
        """Say who is in command, after the side was announced: a pilot stays it when the process starts anew."""
        if self.side is not None:
            self.side.take_control(self._control)

    # What is true now.

    @property
    def is_alone(self) -> bool:
        """Return whether it acts by itself for want of a link."""
        return self._is_alone

    @property
    def minds_link(self) -> bool:
        """Return whether it would stop by itself if the engine fell silent now."""
        return self._is_alone or (self._moves and self._flight is not None)

    def position(self) -> Position:
        """Return where it is now, to 1 mm."""
        here = self._segment.at(self.scheduler.now())
        return Position(mm(here.east_m), mm(here.north_m), mm(here.up_m))

    def battery(self) -> float:
        """Return its charge in percent, to a thousandth."""
        return round(self._exact_battery(), 3)

    def landed(self) -> Landed:
        """Return what it knows of standing on the ground."""
        return "grounded"

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

    def on_card(self) -> dict[str, Any]:
        """Return its limits, and that it stands still without a link."""
        return {"limits": self.limits.on_card(), "on_link_loss": "hold"}

    # From the side.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or return why not."""
        action = self.kind.actions.get(request.action)
        if action is None:
            return "unknown_action"
        is_low = self._exact_battery() <= self.limits.failsafe_percent
        try:
            legs = self._plan(request, action, is_low=is_low)
        except BadFieldError:
            return "bad_field"
        if isinstance(legs, str):
            return legs
        product = self._product(request, legs)
        outcome = self.outcomes.next(request.action)
        if outcome is not None and outcome.delay_s > 0.0:
            legs = [Leg(self.position(), self._still(), lasts_us=micros(outcome.delay_s)), *legs]
        self._begun(request, action)
        self._fly(request.goal_id, request.action, legs, outcome).product = product
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Stop here, or return False if it cannot now."""
        flight = self._flight
        if flight is None or flight.goal_id != goal_id:
            return True
        flight.canceled = True
        self._end_flight()
        return True

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        """Turn to another target of the goal under way."""
        flight, side = self._flight, self.side
        request = next((one for one in side.active if one.goal_id == goal_id), None) if side is not None else None
        if flight is None or flight.goal_id != goal_id or flight.canceled or request is None:
            return "goal_ended"
        action = self.kind.actions.get(flight.action)
        if action is None or not self._moves or action.effect or not action.moves_to or action.moves_to not in fields:
            return "no_update"
        try:
            legs = self._plan(
                replace(request, fields={**request.fields, **fields}), action,
                is_low=self._exact_battery() <= self.limits.failsafe_percent,
            )  # fmt: skip
        except BadFieldError:
            return "bad_field"
        if isinstance(legs, str):
            return legs
        self._fly(goal_id, flight.action, legs, flight.outcome)
        return ""

    # What kinds of machines do each in their way.

    def _plan(self, request: GoalRequest, action: SimAction, *, is_low: bool) -> list[Leg] | str:
        """Return the legs of a goal, or the code of its refusal.

        Raises:
            BadFieldError: a field is missing or not what the action needs.
        """
        here = self.position()
        if action.moves_to and self._moves:
            if is_low:
                return "battery_low"
            to = read_place(request.fields.get(action.moves_to))
            return [Leg(point, "drive", speed_of(request, action.speed)) for point in self._way(here, to)]
        return [Leg(here, self._still(), lasts_us=lasts_us(action, self._seed, request.goal_id))]

    def _way(self, here: Position, to: Place) -> list[Position]:  # noqa: ARG002  (straight ways begin anywhere)
        """Return the points of the way over ground: straight. Whoever knows ways plans them here."""
        return [Position(to.east_m, to.north_m, 0.0)]

    def _product(self, request: GoalRequest, legs: list[Leg]) -> Product:  # noqa: ARG002  (who makes none)
        """Return what a goal makes that is carried out as planned."""
        return Product()

    def _begun(self, request: GoalRequest, action: SimAction) -> None:
        """Take note that a goal begins."""

    def _still(self) -> MotionKind:
        """Return what it does where it stays as it is."""
        return "rest"

    def _leg_us(self, start: Position, leg: Leg) -> Micros:
        if leg.lasts_us is not None:
            return leg.lasts_us
        return leg_us(start, leg.to, self.limits.speed_m_s, self.limits.speed_m_s, wanted_m_s=leg.wanted_m_s)

    def _flat(self) -> None:
        """Stand still at the end of its charge; whoever was in command no longer is."""
        self._is_alone = False
        self._yield_to("failsafe")

    def watch_link(self) -> None:
        """Stand still if the engine is silent for too long, and yield again when it is heard."""
        if self.side is None:
            return
        if self._is_alone:
            if not self.side.is_cut_off:
                self._is_alone = False
                if self._control == "failsafe":
                    self.hand_back()
        elif self.side.is_cut_off and self.minds_link and self._control == "engine":
            self._is_alone = True
            self._yield_to("failsafe")

    # From the scheduler, the pilot, the process around it.

    def report(self) -> None:
        """Publish the status and how far the goal is: called now and then, and by itself at each change."""
        super().report()
        flight = self._flight
        if self.side is not None and flight is not None and flight.goal_id:
            now = self.scheduler.now()
            whole, left = flight.ends - flight.started, flight.ends - now
            progress = 1.0 if whole <= 0 else round(1.0 - left / whole, 3)
            self.side.feedback(flight.goal_id, progress=progress, eta_s=round(left / SECOND, 1), phase=self._phase())

    def stop(self) -> None:
        """Drop what it does and stay here, without a word to anyone."""
        self._flight = None
        self._stand_still()

    def take_over(self) -> None:
        """Play the pilot who takes the controls: it stays here, and its goal ends `taken_over`."""
        self._yield_to("pilot")

    def hand_back(self) -> None:
        """Play the pilot (or the failsafe) that gives the controls back."""
        self._control = "engine"
        self.set_status()
        self.resume()

    def shift(self, by: Micros) -> None:
        """Follow a jump of engine time: everything under way goes on as if the clock had not jumped."""
        self._segment = self._segment.shifted(by)
        self._battery_at += by
        if self._flight is not None:
            self._flight.started += by
            self._flight.ends += by
        self._record()

    def carry(self, to: Place) -> None:
        """Play people who carry it to another place: nothing happens while its rotors turn."""
        if not self.is_airborne:
            now, there = self.scheduler.now(), Position(to.east_m, to.north_m, 0.0)
            self._move(Segment(now, there, now, there), "rest")
            self.report()

    def set_battery(self, percent: float) -> None:
        """Change the charge at once (a cell that failed, a wrong gauge)."""
        self._settle_charge(min(100.0, max(0.0, percent)))
        self.report()

    def set_drift(self, east_m: float, north_m: float) -> None:
        """Let its own fix be so far off the truth."""
        self.drift = (east_m, north_m)
        self.report()

    # Inside: on the way.

    def _fly(self, goal_id: str, action: str, legs: list[Leg], outcome: Outcome | None = None) -> Flight:
        now = self.scheduler.now()
        self._flight = flight = Flight(goal_id, action, legs, now, outcome)
        self._next_leg()
        self._expect_end(flight)
        # Not now: the side has yet to answer the goal.
        self._timers.append(self.scheduler.call_at(now, self.report))
        return flight

    def _expect_end(self, flight: Flight) -> None:
        flight.ends, start = self._segment.t1, self._segment.p1
        for leg in flight.legs:
            flight.ends += self._leg_us(start, leg)
            start = leg.to

    def _next_leg(self) -> None:
        flight = self._flight
        assert flight is not None, "no flight has a next leg"
        leg = flight.leg = flight.legs.pop(0)
        now, here = self.scheduler.now(), self._segment.at(self.scheduler.now())
        lasts = self._leg_us(here, leg)
        self._move(Segment(now, here, now + lasts, leg.to), leg.kind)
        self._timers.append(self.scheduler.call_at(now + lasts, self._arrived))

    def _arrived(self) -> None:
        flight = self._flight
        assert flight is not None, "nobody was on the way"
        if flight.legs:
            self._next_leg()
            self.report()
        else:
            self._end_flight()

    def _end_flight(self) -> None:
        """End the flight where the machine is, and its goal with it."""
        flight, self._flight = self._flight, None
        self._stand_still()
        self.set_status()
        if self.side is None or flight is None:
            return
        if not flight.goal_id:
            self.side.publish_status()
        elif not flight.canceled:
            self._finish(self.side, flight)
        elif self.confirms_cancel:
            self.side.finish(flight.goal_id, "canceled")

    def _finish(self, side: AgentSide, flight: Flight) -> None:
        outcome = flight.outcome
        if outcome is not None and outcome.fail:
            side.finish(flight.goal_id, "failed", code=outcome.fail)
            return
        said = self.kind.actions.get(flight.action, NO_ACTION).result
        made = {name: value for name, value in flight.product.result.items() if name in said}
        give = outcome.give if outcome is not None else {}
        files = self._sent(flight.product)
        side.finish(flight.goal_id, "succeeded", result={**said, **made, **give}, attachments=files)

    def _sent(self, product: Product) -> list[Attachment]:
        """Send the files of a goal once; return what names those that were not refused at once."""
        link = self.link
        named: list[Attachment] = []
        if not isinstance(link, SendsFiles):
            return []
        for file in product.files:
            one = attachment_of(file.name, file.data, file.media_type)
            answers: list[str] = []
            link.send_file(one.sha256, file.data, answers.append)
            if not any(answers):
                named.append(one)
        return named

    def _stand_still(self) -> None:
        now, here = self.scheduler.now(), self._segment.at(self.scheduler.now())
        self._move(Segment(now, here, now, here), "rest")

    def _move(self, segment: Segment, kind: MotionKind) -> None:
        """Begin a segment: charge is reckoned up to now and then drains at another rate."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        charge = self._exact_battery()
        self._segment, self._kind = segment, kind
        self._record()
        self._settle_charge(charge)

    def _record(self) -> None:
        if self._moves:
            self._recorder.moved(self.agent, self._segment, self._kind)

    def _settle_charge(self, percent: float) -> None:
        """Reckon the charge from now on, and when it ends."""
        self._battery, self._battery_at = percent, self.scheduler.now()
        self._drain = drain_percent_s(self.limits, self._kind, self._segment, self._chargers, self.payload_kg)
        if self._flat_timer is not None:
            self._flat_timer.cancel()
        if self._drain > 0.0 and not self._is_failsafe():
            left_s = max(0.0, self._battery - self.limits.failsafe_percent) / self._drain
            self._flat_timer = self.scheduler.call_at(self._battery_at + micros(left_s), self._flat)

    def _yield_to(self, control: Control) -> None:
        self.stop()
        self._control = control
        self.set_status()
        self.resume()

    def _is_failsafe(self) -> bool:
        return self._flight is not None and self._flight.action == "failsafe"

    def _exact_battery(self) -> float:
        lasted_s = (self.scheduler.now() - self._battery_at) / SECOND
        return min(100.0, max(0.0, self._battery - self._drain * lasted_s))

    def _phase(self) -> str:
        return {
            "climb": "climbing",
            "cruise": "flying",
            "descend": "descending",
            "fall": "falling",
            "drive": "driving",
        }.get(self._kind, "")

    def status(self) -> dict[str, Any]:
        """Return what it says of itself."""
        if not self._has_place:
            return {"landed": self.landed()}
        here, (east_m, north_m) = self.position(), self.drift
        here = Position(mm(here.east_m + east_m), mm(here.north_m + north_m), here.up_m)
        lat, lng = self._frame.lat_lng(here) if self._frame is not None else (None, None)
        return {
            "position": here,
            "lat": lat,
            "lng": lng,
            "battery": self.battery(),
            "landed": self.landed(),
            "payload_kg": self.payload_kg,
            "initial_deployment": self._first_place,
        }


def _beginning(setup: Setup, now: Micros) -> BodyState:
    spec = setup.spec
    here = spec.at if isinstance(spec.at, Position) else Position(spec.at.east_m, spec.at.north_m, 0.0)
    kind: MotionKind = "hover" if here.up_m > 0.0 and setup.kind.mobility == "air" else "rest"
    return BodyState(Segment(now, here, now, here), kind, spec.battery, now, 0.0, spec.home)
