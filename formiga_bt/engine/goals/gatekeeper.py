"""The gatekeeper: shows every goal to the safety gate, sends what may go, keeps what must wait and looks at it again.

Waiting goals are looked at when something that one may wait for has changed (a goal ended, a machine moved, an answer came),
in the order safety goal or way home, priority, age. What the gate sees is `engine.goals.gateview`; what becomes of machines
that wait for each other is `engine.goals.air_holding`.
"""

from collections.abc import Sequence
from functools import partial

from msgspec.structs import replace

from formiga_bt.base.geo import Position
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.goals.air_holding import AirHolding
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.gateview import GateView
from formiga_bt.engine.goals.passages import Passages
from formiga_bt.engine.goals.routing import Routing
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import EVERYTHING, Core
from formiga_bt.engine.kernel.inputs import Alarm, SendGoal
from formiga_bt.engine.kernel.records import BUSY, GoalRecord
from formiga_bt.engine.kernel.timers import AcceptDue
from formiga_bt.safety.gate import GateInput, Go, Hold, Refuse, Verdict, judge, may_go_again
from formiga_bt.safety.traffic import Traffic
from formiga_bt.transport.messages import to_wire

TTL_BEATS = 10
"""A goal that reaches its agent later than so many heartbeats (wall seconds) is refused by it."""


class Gatekeeper:
    """Between goals and transports."""

    def __init__(self, core: Core, clearances: Clearances) -> None:
        self._core = core
        self._clearances = clearances
        self.view = GateView(core, clearances)
        self.passages = Passages(core)
        self.routing = Routing(core)
        self.room = AirHolding(core, self.view, clearances, self._send_at_once)

    def verdict(self, goal: GoalRecord) -> Verdict:
        """Return what the gate says of a goal now."""
        return self._look(goal)[1]

    def _look(self, goal: GoalRecord, *, patient: bool = False) -> tuple[GoalRecord, Verdict]:
        """Return what the gate says of a goal now, and the goal as it would leave: on routes, an edge of its way."""
        if not self.routing.drives(goal):
            return goal, self._verdict(goal)
        still = None if patient else self.routing.still_waits(goal)
        if still is not None:
            return goal, still
        first: Hold | None = None
        for hop in self.routing.hops(goal, patient=patient):
            if isinstance(hop, Refuse):
                return goal, hop
            found = self._verdict(hop)
            if isinstance(found, Go):
                found = self.routing.may_go(hop) or found
            if not isinstance(found, Hold) or found.code not in ("route_busy", "route_order"):
                return hop, found
            first = first or found
        assert first is not None, f"{goal.id} has no way"
        return goal, first

    def _verdict(self, goal: GoalRecord) -> Verdict:
        core = self._core
        ask = self.view.ask(goal)
        if ask.mobility == "people":
            return judge(ask, (), core.now, 0.0)
        if goal.code in BUSY:  # while the machine that held it up still does, the others need not be looked at
            former = self.view.traffic_of(goal.text)
            if former is not None:
                still = self._judge(goal, ask, (former,))
                if isinstance(still, Hold) and (still.code, still.whom) == (goal.code, goal.text):
                    return still
        found = self._judge(goal, ask, self.view.traffic(ask))
        if isinstance(found, Go) and (found.leg is not None or found.area is not None) and not ask.lands:
            claimant = self.room.claimed(goal, found)
            if claimant:
                return Hold("leg_busy", claimant)
        if isinstance(found, Go) or found.code == "clearance":
            return self.passages.verdict(goal, ask) or found
        return found

    def _judge(self, goal: GoalRecord, ask: GateInput, traffic: Sequence[Traffic]) -> Verdict:
        core, view = self._core, self.view
        site = core.site
        return judge(ask, traffic, core.now, site.separation_m, site.min_spacing_m, lambda: view.breach(goal, ask))

    def may_turn(self, goal: GoalRecord, ends: Sequence[Position | None], drift_m: float) -> Verdict:
        """Return what the gate says of a goal that runs, with other fields.

        Args:
            goal: with the fields that it would have.
            ends: where its machine may be when it turns.
            drift_m: how far apart these lie: so much more room is kept.
        """
        core, view = self._core, self.view
        site, first = core.site, view.ask(goal)
        traffic = view.traffic(first, drift_m)
        verdict: Verdict = Go()
        for here in ends:
            ask = replace(first, position=here)
            found = judge(
                ask,
                traffic,
                core.now,
                site.separation_m + drift_m,
                site.min_spacing_m + drift_m,
                partial(view.breach, goal, ask),
            )
            if isinstance(found, Go) and (found.leg is not None or found.area is not None) and not ask.lands:
                claimant = self.room.claimed(goal, found)
                found = Hold("leg_busy", claimant) if claimant else found
            no = self.passages.verdict(goal, ask) if isinstance(found, Go) else found
            if no is not None:
                return no
            if here is ends[0]:
                verdict = found
        return verdict

    def try_send(self, goal_id: str) -> None:
        """Show a goal to the gate and act on the verdict."""
        self._act(*self._look(self._core.state.goals[goal_id]))

    def _act(self, goal: GoalRecord, verdict: Verdict) -> None:
        core = self._core
        match verdict:
            case Go() as go:
                back = self.room.approach(goal) if core.action(goal.action).lands else None
                if back is None:
                    self._send(goal, go)
                elif isinstance(back, Go):
                    core.put_goal(goal.id, code="draining", text=core.state.agents[goal.agent].goal)
                else:
                    self._waits(core.state.goals[goal.id], back)
            case Hold() | Refuse() as no:
                self._waits(core.state.goals[goal.id], no)

    def _waits(self, goal: GoalRecord, no: Hold | Refuse) -> None:
        """A goal may not go now, or never."""
        if isinstance(no, Refuse):
            self.forget(goal)
            self._core.put_goal(goal.id, state="gate_refused", code=no.code, text=no.text, breach=no.value)
            return
        if goal.code != no.code or goal.text != no.whom:
            goal = self._core.put_goal(goal.id, code=no.code, text=no.whom)
            if no.code == "rebooted":
                self._report_rebooted(goal)
        if no.code == "clearance":
            self._clearances.need(goal)
        elif goal.path and no.code in ("route_busy", "route_order"):
            self.routing.waits(goal)
        elif no.code in BUSY:
            self.room.waits(goal)

    def _report_rebooted(self, goal: GoalRecord) -> None:
        knows = self._core.state.agents[goal.agent].landed == "grounded"
        stands = "stands" if knows else "does not know whether it stands"
        text = f"{goal.agent} was started anew and {stands}; {goal.action} waits until you have looked at it"
        self._core.effect(Alarm("rebooted", f"{text}: formiga agents clear {goal.agent}", goal.task, goal.agent))

    def _send_at_once(self, goal: GoalRecord) -> Verdict:
        verdict = self.verdict(goal)
        if isinstance(verdict, Go):
            self._core.count("safety")
            self._core.emit(ch.GoalPut(goal))
            self._send(goal, verdict)
        return verdict

    def _send(self, goal: GoalRecord, go: Go) -> None:
        core = self._core
        place = self._clearances.place(goal.agent)
        clearance = self._clearances.take(goal)
        self.room.forget(goal.id)
        goal = core.put_goal(
            goal.id, state="sent", code="", text="", leg=go.leg, area=go.area, sent_at=core.now, clearance=clearance,
            cleared=place if clearance is not None else None,
            action=goal.action, fields=goal.fields, rest_of=goal.rest_of, path=goal.path, released=min(1, len(goal.path)),
        )  # fmt: skip
        agent = core.state.agents[goal.agent]
        if not agent.human:
            inside = self.passages.taken(agent, self.view.ask(goal)) if core.site.resources else agent.inside
            moves = go.leg is not None or go.area is not None
            core.put_agent(
                agent.id, goal=goal.id, action=goal.action,
                pool="QUARANTINED" if agent.pool == "QUARANTINED" else "EXECUTING ACTION",
                inside=inside, on_route=self.routing.taken(agent, goal),
                lost_leg=None if moves else agent.lost_leg, lost_area=None if moves else agent.lost_area,
            )  # fmt: skip
        if not goal.repeatable and not goal.goes_on and goal.section == "steps" and goal.task in core.state.tasks:
            core.put_part(goal.task, "restart", spent=True)
        core.effect(self._effect(goal))
        core.set_wall(AcceptDue(goal.id), core.action(goal.action).accept_timeout_us)

    def _effect(self, goal: GoalRecord) -> SendGoal:
        agent = self._core.state.agents[goal.agent]
        return SendGoal(
            goal.id,
            goal.agent,
            goal.action,
            {name: to_wire(value) for name, value in goal.fields.items()},
            self._core.state.epoch,
            TTL_BEATS,
            goal.safety,
            goal.clearance,
            link_silence_s=None if agent.mobility not in MOVING else self._core.rules(agent, goal.task).link_silence_s,
            task=goal.task,
        )

    def may_resend(self, goal: GoalRecord) -> bool:
        """Return whether a goal that its agent never had may go now as it is: who commands, and the word it carries."""
        return may_go_again(self.view.ask(goal), goal.clearance, goal.cleared, self._core.now)

    def resend(self, goal: GoalRecord) -> None:
        """Send a goal again that its agent never had, under the same id."""
        self._core.effect(self._effect(goal))

    def waited(self, goal_id: str) -> None:
        """A goal has waited for its way: what drives takes another one or steps aside, what flies goes to another layer."""
        goal = self._core.state.goals.get(goal_id)
        if goal is None or not goal.path:
            self.room.step_aside(goal_id)
        elif self.routing.has_waited(goal):
            if goal.section == "recover" and self.routing.leads_elsewhere(goal):
                self.forget(goal)
                self._core.put_goal(goal_id, state="again", code="", text="")
                self._wake(goal_id)
                return
            found = self._look(goal, patient=True)
            if not isinstance(found[1], Go) and self.routing.step_aside(goal):
                found = self._look(goal, patient=True)
            self._act(*found)
            self._wake(goal_id)

    # -- time and changes --------------------------------------------------------------------------------------------
    def review(self) -> None:
        """Look again at the waiting goals that wait for something that has changed."""
        core = self._core
        stale, core.stale = core.stale, set()
        index = core.index
        if not index.gated:
            return
        # A goal that waits for a machine in its way waits on while neither that machine nor its own has changed.
        names = (
            index.gated
            if EVERYTHING in stale
            else dict.fromkeys(goal_id for agent in stale for goal_id in index.held_up_by(agent))
        )
        waiting = [core.state.goals[goal_id] for goal_id in names]
        waiting.sort(key=lambda goal: (*self.room.rank(goal), goal.id))
        for goal in waiting:
            if core.state.goals.get(goal.id) is goal:
                self.try_send(goal.id)
                self._wake(goal.id)

    def _wake(self, goal_id: str) -> None:
        """Tell the step of a goal that was looked at again, if it will never go as it is."""
        goal = self._core.state.goals[goal_id]
        if goal.ended:
            self._core.wake(goal.task, goal.owner)

    def forget(self, goal: GoalRecord) -> None:
        """A waiting goal was withdrawn, or will never go."""
        self._clearances.withdraw(goal)
        self.room.forget(goal.id)
        self._core.stale.add(goal.agent)
