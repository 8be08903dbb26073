"""The gatekeeper: shows every goal to the safety gate, sends what may go, keeps what must wait and looks at it again.

Waiting goals are looked at when something that one may wait for has changed (a goal ended, a machine moved, an answer came),
in the order safety goal, priority, age.
"""

from formiga_bt.clock import SECOND
from formiga_bt.engine import changes as ch
from formiga_bt.engine.core import EVERYTHING, Core
from formiga_bt.engine.inputs import SendGoal
from formiga_bt.engine.ports import ClearancePort
from formiga_bt.engine.records import PRIORITIES, AgentRecord, GoalRecord, StandingOrder, TaskRecord
from formiga_bt.geo import Place, Position, horizontal_m
from formiga_bt.safety.gate import AT_PORT_M, GROUND_M, Ask, Go, Hold, Refuse, Traffic, judge, traffic_of
from formiga_bt.transport.messages import to_wire

ASIDE_US = 60 * SECOND
"""After so long in the air before a way that is not free, a machine goes to another layer."""

TTL_BEATS = 10
"""A goal that reaches its agent later than so many heartbeats (wall seconds) is refused by it."""

BUSY = ("spot_busy", "leg_busy")
"""Codes of waits for another machine."""


class Gatekeeper:
    """Between goals and transports."""

    clearances: ClearancePort

    def __init__(self, core: Core) -> None:
        self._core = core
        self._known: dict[str, tuple[AgentRecord, GoalRecord | None, Traffic]] = {}

    def try_send(self, goal_id: str) -> None:
        """Show a goal to the gate and act on the verdict."""
        core = self._core
        goal = core.state.goals[goal_id]
        ask = self._ask(goal)
        match judge(ask, self._traffic(goal), core.now, core.site.separation_m):
            case Go(leg):
                self._send(goal, leg)
            case Hold(code, whom):
                goal = core.put_goal(goal_id, code=code, text=whom)
                if code == "clearance":
                    self.clearances.need(goal)
                elif code in BUSY:
                    self._bound(goal)
            case Refuse(code, text):
                core.put_goal(goal_id, state="gate_refused", code=code, text=text)

    def _bound(self, goal: GoalRecord) -> None:
        # One that waits in the air for a spot or a way must still come home: its step fails in time. Recover waits on.
        core = self._core
        agent = core.state.agents[goal.agent]
        key = f"busy|{goal.id}"
        if agent.landed == "airborne" and goal.section != "recover" and key not in core.state.deadlines:
            core.set_deadline(key, core.now + self.clearances.patience_us(agent), goal.task)
        if agent.landed == "airborne" and goal.code == "leg_busy":
            aside = f"aside|{goal.id}"
            if aside not in core.state.deadlines:
                core.set_deadline(aside, core.now + ASIDE_US, goal.task)

    def step_aside(self, goal_id: str) -> None:
        """A machine in the air has waited 60 s for a way: it climbs or sinks at its place to another layer, if one is clear.

        Two that wait for each other's way or hover are then at different heights, and one of them can go.
        """
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is None or goal.state != "gated" or goal.code != "leg_busy":
            return
        core.set_deadline(f"aside|{goal_id}", core.now + ASIDE_US, goal.task)
        agent = core.state.agents[goal.agent]
        action = self._hop(agent)
        here = agent.position
        if agent.goal or agent.landed != "airborne" or not action or here is None:
            return
        for layer in core.site.layers_m:
            if abs(layer - here.up_m) < core.site.separation_m:
                continue
            target = Position(here.east_m, here.north_m, layer)
            hop = GoalRecord(
                id=f"safety/{agent.id}/{core.state.counters.get('safety', 0) + 1}", agent=agent.id, action=action,
                owner="!none", section="recover", fields={core.action(action).moves_to: target}, safety=True,
                order=goal.order, at=core.now,
            )  # fmt: skip
            verdict = judge(self._ask(hop), self._traffic(hop), core.now, core.site.separation_m)
            if isinstance(verdict, Go):
                core.count("safety")
                core.emit(ch.GoalPut(hop))
                core.put_agent(agent.id, layer_m=layer)
                self._send(hop, verdict.leg)
                return

    def _hop(self, agent: AgentRecord) -> str:
        for name in agent.actions:
            spec = self._core.action(name)
            field = spec.fields.get(spec.moves_to)
            if field is not None and field.type.name == "position" and not spec.lands:
                return name
        return ""

    def waited_enough(self, goal_id: str) -> None:
        """A goal that waits for a spot or a way may wait no longer."""
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is not None and goal.state == "gated" and goal.code in BUSY:
            core.put_goal(goal_id, state="gate_refused", text=f"{goal.text} was in the way until the reserve was near")
            core.wake(goal.task, goal.owner)

    def _send(self, goal: GoalRecord, leg: tuple[Position, Position] | None) -> None:
        core = self._core
        clearance = self.clearances.take(goal)
        core.clear_deadline(f"busy|{goal.id}")
        core.clear_deadline(f"aside|{goal.id}")
        goal = core.put_goal(goal.id, state="sent", code="", text="", leg=leg, sent_at=core.now, clearance=clearance)
        agent = core.state.agents[goal.agent]
        if not agent.human:
            kept = agent.lost_leg if leg is None else None
            core.put_agent(agent.id, goal=goal.id, action=goal.action, pool="EXECUTING ACTION", lost_leg=kept)
        if not goal.repeatable and goal.section == "steps" and goal.task in core.state.tasks:
            core.put_task(goal.task, spent=True)
        core.effect(self._effect(goal))
        core.set_wall(f"accept|{goal.id}", core.action(goal.action).accept_timeout_us)

    def _effect(self, goal: GoalRecord) -> SendGoal:
        return SendGoal(
            goal.id,
            goal.agent,
            goal.action,
            {name: to_wire(value) for name, value in goal.fields.items()},
            self._core.state.epoch,
            TTL_BEATS,
            goal.safety,
            goal.clearance,
            link_silence_s=self._core.agent_type(self._core.state.agents[goal.agent]).limits.get("link_silence_s"),
            task=goal.task,
        )

    def resend(self, goal: GoalRecord) -> None:
        """Send a goal again that its agent never had, under the same id."""
        self._core.effect(self._effect(goal))

    def review(self) -> None:
        """Look again at the waiting goals that wait for something that has changed."""
        core = self._core
        stale, core.stale = core.stale, set()
        goals = [core.state.goals[goal_id] for goal_id in core.gated]
        waiting = [g for g in goals if g.code != "taken_over" and _may_go(g, stale)]
        waiting.sort(key=lambda g: (not g.safety, PRIORITIES[self._priority(g)], g.order))
        for goal in waiting:
            if core.state.goals.get(goal.id) is goal:
                self.try_send(goal.id)
                if core.state.goals[goal.id].ended:
                    core.wake(goal.task, goal.owner)

    def forget(self, goal: GoalRecord) -> None:
        """A waiting goal was withdrawn."""
        self.clearances.withdraw(goal)
        self._core.clear_deadline(f"busy|{goal.id}")
        self._core.clear_deadline(f"aside|{goal.id}")
        self._core.stale.add(EVERYTHING)

    def _priority(self, goal: GoalRecord) -> str:
        task = self._core.state.tasks.get(goal.task)
        return task.priority if task else "high"

    def _ask(self, goal: GoalRecord) -> Ask:
        core = self._core
        agent = core.state.agents[goal.agent]
        if agent.human:
            return Ask(
                agent=agent.id, task=goal.task, human=True, reachable=reachable(agent), control="engine",
                deposed=self._deposed,
            )  # fmt: skip
        spec = core.action(goal.action)
        task = core.state.tasks.get(goal.task)
        target = goal.fields.get(spec.moves_to) if spec.moves_to else None
        altitude = goal.fields.get("altitude") if spec.effect == "airborne" else None
        home = core.site.ports.get(agent.home)
        return Ask(
            agent=agent.id,
            task=goal.task,
            human=False,
            reachable=reachable(agent) and (agent.pool != "QUARANTINED" or goal.safety),
            control=agent.control,
            safety=goal.safety,
            deposed=self._deposed,
            taken=agent.taken,
            stopped=self._stopped(goal),
            locked=self._locked(goal, task),
            busy=agent.goal if agent.goal != goal.id else "",
            held=bool(task and _holds(task.held, agent.id, goal.section)),
            position=agent.position,
            landed=agent.landed,
            target=target if isinstance(target, Place | Position) else None,
            rises_to_m=float(altitude) if isinstance(altitude, int | float) else None,
            starts_rotors=spec.starts_rotors,
            lands=spec.lands,
            clearance=self.clearances.given(agent.id),
            ports=tuple(port.at for port in core.site.ports.values()),
            home=home.at if home else None,
        )

    @property
    def _deposed(self) -> bool:
        return self._core.state.counters.get("deposed", 0) > 0

    def _carries_out(self, goal: GoalRecord, order: StandingOrder) -> bool:
        """Return whether a goal is an order's own: of its system task, of the recover that does it, or its `cut`."""
        if goal.id == order.goal:
            return True
        task = self._core.state.tasks.get(goal.task)
        return task is not None and goal.task == order.task and (bool(task.system_agent) or goal.section == "recover")

    def _stopped(self, goal: GoalRecord) -> str:
        order = self._core.state.orders.get(goal.agent)
        if order is None or goal.id.startswith("safety/") or self._carries_out(goal, order):
            return ""
        return order.stop

    def _locked(self, goal: GoalRecord, task: TaskRecord | None) -> str:
        lockdown = self._core.state.lockdown
        if lockdown is None or task is None or goal.safety or task.stop:
            return ""
        order = self._core.state.orders.get(goal.agent)
        if order is not None and self._carries_out(goal, order):
            return ""
        way_home = goal.section == "recover" or bool(task.system_agent)
        return "" if way_home and lockdown.how == "return" else lockdown.how

    def _traffic(self, goal: GoalRecord) -> list[Traffic]:
        core = self._core
        return [self._seen(agent) for agent in core.state.agents.values() if not agent.human and agent.id != goal.agent]

    def _seen(self, agent: AgentRecord) -> Traffic:
        # Records are frozen: as long as they are the same objects, so is what traffic they make.
        goal = self._core.state.goals.get(agent.goal) if agent.goal else None
        known = self._known.get(agent.id)
        if known is not None and known[0] is agent and known[1] is goal:
            return known[2]
        traffic = traffic_of(
            agent.id, agent.task, agent.landed, agent.position, self._leg(agent), self._column_m(agent)
        )
        self._known[agent.id] = (agent, goal, traffic)
        return traffic

    def _column_m(self, agent: AgentRecord) -> float | None:
        leg = self._leg(agent)
        spot = leg[1] if leg is not None else agent.position
        if not agent.task or spot is None or spot.up_m > GROUND_M:
            return None
        ports = self._core.site.ports.values()
        return agent.layer_m if all(horizontal_m(port.at, spot) > AT_PORT_M for port in ports) else None

    def _leg(self, agent: AgentRecord) -> tuple[Position, Position] | None:
        goal = self._core.state.goals.get(agent.goal) if agent.goal else None
        return goal.leg if goal is not None and goal.in_flight and goal.leg is not None else agent.lost_leg


def _may_go(goal: GoalRecord, stale: set[str]) -> bool:
    # A goal that waits for a machine in its way waits on while neither that machine nor its own has changed.
    return EVERYTHING in stale or goal.agent in stale or (goal.code in BUSY and goal.text in stale)


def _holds(held: tuple[str, ...], agent: str, section: str) -> bool:
    if section != "steps":  # cleanup and the way home go on; but only a person hands a machine back that was taken over
        return f"take-over:{agent}" in held
    # The clearance that a goal's own agent waits for is judged by the gate itself.
    return any(cause != f"clearance:{agent}" for cause in held)


def reachable(agent: AgentRecord) -> bool:
    """Return whether a goal can be sent to an agent now."""
    return agent.present and agent.liveness == "ALIVE"
