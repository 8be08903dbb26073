"""Making room: what becomes of machines that wait in the air for each other, for a spot, or for their own port.

* One that waits 60 s for a way, or at once where those that wait form a circle, climbs or sinks at its place to another layer.
* One whose own port is occupied flies to the port's waiting point; after 2 min its `home` becomes the nearest free port, and
  its step sends its next attempt.
* Nobody begins a way across that of a machine which comes home (recover) and waits for it, unless its turn is before that.
* A step that waits for a spot, a way or a port fails when the reserve and 3 min are near; the way home waits on.

Such moves are safety goals of the engine (`safety/<agent>/<n>`) that pass the gate like all others. Called by the gatekeeper
when a goal begins to wait, and by the engine's timers.
"""

from collections.abc import Callable

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, distance_m, horizontal_m
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.climbing import goes_by
from formiga_bt.engine.goals.gateview import GateView
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.records import BUSY, PRIORITIES, AgentRecord, GoalRecord
from formiga_bt.engine.kernel.timers import AsideDue, PortDue, WayDue
from formiga_bt.lang.model import Port
from formiga_bt.safety.gate import Go, Verdict
from formiga_bt.safety.traffic import VERTICAL_M, first_in_the_way, path, traffic_of

ASIDE_US = 60 * SECOND
"""After so long in the air before a way that is not free, a machine goes to another layer."""

PORT_US = 120 * SECOND
"""After so long before its own port, a machine gets another one."""

NO_PORT_US = 60 * SECOND
"""While no port is free, that is looked at, and told, so often."""

SOON_US = 5 * SECOND
"""A port is looked for again so soon when the machine could not be sent there just then."""

THERE_M = 1.0
"""So near to where it should wait a machine stays."""

Send = Callable[[GoalRecord], Verdict]
"""Show a new safety goal to the gate: send it if it may go now, else forget it; return what the gate says."""


class AirHolding:
    """For goals that wait at the gate for other machines."""

    def __init__(self, core: Core, view: GateView, clearances: Clearances, send: Send) -> None:
        self._core = core
        self._clearances = clearances
        self._view = view
        self._send = send

    def waits(self, goal: GoalRecord) -> None:
        """A goal waits for another machine: bound the wait, and do what frees it."""
        core = self._core
        agent = core.state.agents[goal.agent]
        if agent.landed != "airborne":
            return
        due = WayDue(goal.id)
        if goal.section != "recover" and due not in core.state.deadlines:
            core.set_deadline(due, core.now + self._clearances.patience_us(agent), goal.task)
        if goal.code == "port_busy":
            self._port_busy(goal, agent)
        elif goal.code == "leg_busy":
            self._leg_busy(goal)

    def forget(self, goal_id: str) -> None:
        """A goal waits no more."""
        for due in (WayDue(goal_id), AsideDue(goal_id), PortDue(goal_id)):
            self._core.clear_deadline(due)

    def waited_enough(self, goal_id: str) -> None:
        """A goal that waits for a spot, a way or its port may wait no longer."""
        goal = self._waiting(goal_id, *BUSY)
        if goal is None or (goal.code == "port_busy" and self._other_port(goal)):
            return
        core = self._core
        core.put_goal(goal_id, state="gate_refused", text=f"{goal.text} was in the way until the reserve was near")
        core.wake(goal.task, goal.owner)

    def _waiting(self, goal_id: str, *codes: str) -> GoalRecord | None:
        goal = self._core.state.goals.get(goal_id)
        return goal if goal is not None and goal.state == "gated" and goal.code in codes else None

    # -- order -------------------------------------------------------------------------------------------------------
    def rank(self, goal: GoalRecord) -> tuple[bool, int, int]:
        """Return the order of service: safety goals and ways home, then priority, then age; lower first."""
        task = self._core.state.tasks.get(goal.task)
        rescue = goal.safety or goal.section == "recover"
        return not rescue, PRIORITIES[task.request.priority if task else "high"], goal.order

    def claimed(self, goal: GoalRecord, go: Go) -> str:
        """Return the machine on its way home whose wait for its way goes before this one's going, or "".

        Else a long way home may wait for one short way after the other until the battery is empty. A machine that is itself in
        the way may leave. Claims of all who wait, not only of recover, halve what a crowded field carries.
        """
        core = self._core
        here = core.state.agents[goal.agent].position
        if goal.safety or here is None or not core.index.busy:
            return ""
        ways = path(go.leg) if go.leg is not None else ()
        for claim in self._busy():
            if (
                claim.code != "leg_busy"
                or claim.section != "recover"
                or claim.agent == goal.agent
                or claim.task == goal.task
            ):
                continue
            other = core.state.agents[claim.agent]
            target = claim.fields.get(core.action(claim.action).moves_to)
            if other.landed != "airborne" or other.position is None or not isinstance(target, Position):
                continue
            if self.rank(claim) > self.rank(goal):
                continue
            theirs = [traffic_of(claim.agent, claim.task, "airborne", other.position, (other.position, target))]
            keep_m = core.site.separation_m
            if first_in_the_way(goal.agent, goal.task, ((here, here),), None, theirs, keep_m):
                continue
            if first_in_the_way(goal.agent, goal.task, ways, go.area, theirs, keep_m):
                return claim.agent
        return ""

    def _busy(self) -> list[GoalRecord]:
        """Return the goals that wait for another machine, oldest first."""
        goals = self._core.state.goals
        return sorted((goals[goal_id] for goal_id in self._core.index.busy), key=lambda goal: (goal.order, goal.id))

    # -- ways --------------------------------------------------------------------------------------------------------
    def _leg_busy(self, goal: GoalRecord) -> None:
        core = self._core
        aside = AsideDue(goal.id)
        if aside in core.state.deadlines:
            return
        core.set_deadline(aside, core.now + ASIDE_US, goal.task)
        for other in self._circle(goal):
            if self._step_aside(other):
                return

    def _circle(self, goal: GoalRecord) -> list[GoalRecord]:
        """Return the goals that wait for each other in a circle with this one, itself first; none if there is no circle."""
        waiting = {g.agent: g for g in self._busy()}
        found = [goal]
        for _ in waiting:
            following = waiting.get(found[-1].text)
            if following is None:
                return []
            if following.id == goal.id:
                return [one for one in found if one.code == "leg_busy"]
            found.append(following)
        return []

    def step_aside(self, goal_id: str) -> None:
        """A machine in the air has waited for a way: it goes to another layer at its place, if one is clear there.

        Two that wait for each other's way or hover are then at different heights, and one of them can go.
        """
        goal = self._waiting(goal_id, "leg_busy")
        if goal is not None:
            self._core.set_deadline(AsideDue(goal_id), self._core.now + ASIDE_US, goal.task)
            self._step_aside(goal)

    def _step_aside(self, goal: GoalRecord) -> bool:
        core = self._core
        agent = core.state.agents[goal.agent]
        here = agent.position
        if here is None:
            return False
        for layer in core.site.layers_m:
            if abs(layer - here.up_m) < core.site.separation_m:
                continue
            if isinstance(self._move(agent, Position(here.east_m, here.north_m, layer), goal.order), Go):
                core.put_agent(agent.id, layer_m=layer)
                return True
        return False

    # -- ports -------------------------------------------------------------------------------------------------------
    def _port_busy(self, goal: GoalRecord, agent: AgentRecord) -> None:
        core = self._core
        due = PortDue(goal.id)
        if due not in core.state.deadlines:
            core.set_deadline(due, core.now + min(PORT_US, self._clearances.patience_us(agent)), goal.task)
        port = core.site.ports.get(agent.home)
        if port is None or not isinstance(port.waiting, Position) or agent.position is None:
            return
        if distance_m(agent.position, port.waiting) > THERE_M:
            self._move(agent, port.waiting, goal.order)

    def port_waited(self, goal_id: str) -> None:
        """A machine waited 2 min for its own port: it gets the nearest free one; without any, a person must act."""
        core = self._core
        # On its way, not heard of just now, or held up on its way.
        if self._waiting(goal_id, "draining", "suspect", "leg_busy") is not None:
            core.set_deadline(PortDue(goal_id), core.now + SOON_US, core.state.goals[goal_id].task)
            return
        goal = self._waiting(goal_id, "port_busy")
        if goal is None or self._other_port(goal):
            return
        text = f"{goal.agent} has no free port to land at: {goal.text} is on its own"
        core.effect(Alarm("no_free_port", text, goal.task, goal.agent))
        core.set_deadline(PortDue(goal_id), core.now + NO_PORT_US, goal.task)

    def _other_port(self, goal: GoalRecord) -> bool:
        """Bind `home` to the nearest free port and let the goal's step send its next attempt; return whether there is one."""
        core = self._core
        agent = core.state.agents[goal.agent]
        port = self._free_port(agent)
        if port is None:
            return False
        core.put_agent(agent.id, home=port.name)
        here = agent.position
        if core.action(goal.action).lands and here is not None:  # a landing begins above its spot
            self._move(core.state.agents[agent.id], Position(port.at.east_m, port.at.north_m, here.up_m), goal.order)
        self._clearances.withdraw(goal)
        self.forget(goal.id)
        core.put_goal(goal.id, state="again", code="", text="")
        core.wake(goal.task, goal.owner)
        return True

    def _free_port(self, agent: AgentRecord) -> Port | None:
        core = self._core
        here = agent.position
        if here is None:
            return None
        taken = {a.home for a in core.state.agents.values()} | {a.home for a in core.site.agents.values()}
        free = [port for name, port in core.site.ports.items() if name not in taken]
        free.sort(key=lambda port: (round(horizontal_m(port.at, here), 3), port.name))
        for port in free:
            if not self._view.occupant(agent.id, port.at) and self._view.may_land(agent, port.at):
                return port
        return None

    def approach(self, goal: GoalRecord) -> Verdict | None:
        """A landing may go on after a wait for its port: bring the machine back above it first.

        Returns:
            what the gate says of that way; None if the machine is there, or cannot fly it.
        """
        core = self._core
        agent = core.state.agents[goal.agent]
        spec = core.action(goal.action)
        target, here = goal.fields.get(spec.moves_to), agent.position
        if PortDue(goal.id) not in core.state.deadlines or here is None or not isinstance(target, Place):
            return None
        if horizontal_m(here, target) <= VERTICAL_M:
            return None
        layer = agent.layer_m if agent.layer_m is not None else here.up_m
        return self._move(agent, Position(target.east_m, target.north_m, layer), goal.order)

    # -- moves -------------------------------------------------------------------------------------------------------
    def _move(self, agent: AgentRecord, target: Position, order: int) -> Verdict | None:
        core = self._core
        action = goes_by(agent, core.action)
        if agent.goal or agent.landed != "airborne" or not action:
            return None
        number = core.state.counters.get("safety", 0) + 1
        move = GoalRecord(
            id=f"safety/{agent.id}/{number}", agent=agent.id, action=action, owner="!none", section="recover",
            fields={core.action(action).moves_to: target}, safety=True, order=order, at=core.now,
        )  # fmt: skip
        return self._send(move)
