"""Updates: other fields for a goal that runs, such as the target of what follows.

| now | on | next |
|---|---|---|
| none | UpdateGoal, and the gate says go | on its way: sent, again each 2 s (wall) until answered; both ways are reserved |
| none | UpdateGoal, and the gate does not, or wire or action have none | refused to whoever asked; nothing changes |
| on its way | the agent takes it | its fields are the goal's; the former way stays reserved until the next status |
| on its way | the agent refuses it | alarm `update_refused`, unless its own step asked (`track`); the goal goes on as before |
| on its way | the goal ends | over |

The gate judges an update as a goal that begins now, with more room: until the agent has heard of it, it goes on along its
former way, for as long as an update lives. It is judged anew each time it is sent, also after an outage of the engine.
"""

from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position, Region, distance_m
from formiga_bt.engine.goals import epochs
from formiga_bt.engine.goals.gatekeeper import Gatekeeper
from formiga_bt.engine.goals.wire_values import read_value
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm, UpdateGoalFields
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, GoalUpdate
from formiga_bt.engine.kernel.timers import UpdateDue
from formiga_bt.lang.types import Type
from formiga_bt.safety.gate import Go
from formiga_bt.safety.traffic import Way
from formiga_bt.transport.messages import UpdateReply, to_wire

TTL_BEATS: Final = 5
"""An update that reaches its agent later than so many heartbeats (wall seconds) is refused by it."""
RESEND_US: Final = 2 * SECOND
FAST_M_S: Final = 10.0
"""The speed of a machine that does not say it."""


class Updates:
    """Changes goals that run."""

    def __init__(self, core: Core, gatekeeper: Gatekeeper) -> None:
        self._core = core
        self._gate = gatekeeper

    def order(self, goal_id: str, fields: dict[str, Any], *, tracked: bool = False) -> None:
        """Give a goal other fields.

        Args:
            goal_id: of a goal that its agent has.
            fields: those that change, as runtime values.
            tracked: its own step asks.

        Raises:
            TaskError: it cannot be, and the goal goes on as before: no such goal runs (`no_goal`); its wire has no updates, or
                the machine drives along routes (`no_update`); another one is on its way (`update_open`); a field is unknown
                or of another type (`bad_field`); or what the gate says.
        """
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is None or goal.state not in ("sent", "accepted", "running") or goal.cancel_asked:
            raise TaskError("no_goal", f"no goal {goal_id!r} runs", help="formiga tasks shows what runs")
        agent = core.state.agents[goal.agent]
        if "update" in agent.lacks:
            raise TaskError("no_update", f"the wire {agent.wire} of {agent.id} cannot change a goal that runs")
        if goal.path:
            raise TaskError(
                "no_update", f"{agent.id} drives on the routes, edge by edge: abort its step, and send it anew"
            )
        if goal.update is not None:
            raise TaskError("update_open", f"{agent.id} has not answered the last update of {goal_id} yet")
        self._check(goal, fields)
        if self._gate.routing.drives(goal) and self._core.action(goal.action).moves_to in fields:
            text = (
                f"{agent.id} drives along the routes of the site, edge by edge: its target does not change on the way"
            )
            raise TaskError("no_update", text, help="abort the step, or wait for its end")
        merged = {**goal.fields, **fields}
        if merged == goal.fields:
            return
        new = replace(goal, fields=merged)
        verdict = self._gate.may_turn(new, self._ends(agent, goal), self._drift_m(agent, goal))
        if not isinstance(verdict, Go):
            text = getattr(verdict, "text", "") or f"{goal.action} of {agent.id} may not change now: {verdict.code}"
            raise TaskError(verdict.code, text)
        update = GoalUpdate(n=goal.updates + 1, fields=merged, changed=tuple(fields), tracked=tracked)
        core.put_goal(goal_id, updates=update.n, update=update, also=verdict.leg)
        if core.site.resources:
            core.put_agent(agent.id, inside=self._gate.passages.taken(agent, self._gate.view.ask(new)))
        self._look_again(agent.id)
        self._send(core.state.goals[goal_id])

    def on_reply(self, reply: UpdateReply) -> None:
        """Take an agent's answer."""
        core = self._core
        goal = core.state.goals.get(reply.goal_id)
        if goal is None or goal.agent != reply.agent or goal.update is None or goal.update.n != reply.n or goal.ended:
            return
        core.set_wall(UpdateDue(goal.id), None)
        if reply.code:
            said = f"{goal.agent} refuses other fields for {goal.action}: {reply.code}"
            core.put_goal(goal.id, update=None, also=None, no_update=f"{said} {reply.text}".rstrip())
            if not goal.update.tracked:
                text = f"{said}; it goes on as before {reply.text}".rstrip()
                core.effect(Alarm("update_refused", text, goal.task, goal.agent))
            if reply.code == "epoch_old":
                epochs.depose(core, goal.agent, core.state.agents[goal.agent].epoch)
        else:
            turns = goal.also is not None
            core.put_goal(
                goal.id, fields=goal.update.fields, update=None, turned_at=core.now, no_update="",
                leg=goal.also if turns else goal.leg, also=goal.leg if turns else None,
            )  # fmt: skip
        self._look_again(goal.agent)

    def on_status(self, goal_id: str) -> None:
        """The machine that has a goal has said where it is: it is off its former way."""
        goal = self._core.state.goals.get(goal_id)
        if goal is not None and goal.also is not None and goal.update is None:
            self._core.put_goal(goal_id, also=None)
            self._look_again(goal.agent)

    def on_due(self, goal: GoalRecord) -> None:
        """An update was not answered: send it again, if it still may go."""
        update = goal.update
        if update is None or not goal.in_flight or goal.cancel_asked:
            return
        agent = self._core.state.agents[goal.agent]
        new = replace(goal, fields=update.fields)
        if isinstance(self._gate.may_turn(new, self._ends(agent, goal), self._drift_m(agent, goal)), Go):
            self._send(goal)
        else:
            self._core.set_wall(UpdateDue(goal.id), RESEND_US)

    # -- parts -----------------------------------------------------------------------------------------------------
    def _send(self, goal: GoalRecord) -> None:
        core, update = self._core, goal.update
        assert update is not None
        fields = {name: to_wire(update.fields[name]) for name in update.changed}
        core.effect(UpdateGoalFields(goal.id, goal.agent, goal.action, update.n, fields, core.state.epoch, TTL_BEATS))
        core.set_wall(UpdateDue(goal.id), RESEND_US)

    def _check(self, goal: GoalRecord, fields: dict[str, Any]) -> None:
        spec = self._core.action(goal.action)
        if not fields:
            raise TaskError("bad_field", "no field is to change")
        for name, value in fields.items():
            param = spec.fields.get(name)
            if param is None:
                raise TaskError(
                    "bad_field", f"{goal.action} has no field '{name}'", help=f"fields: {', '.join(spec.fields)}"
                )
            if isinstance(value, Region):
                raise TaskError("bad_field", f"'{name}' is a region: what a machine has to itself does not change")
            if not _fits(param.type, value):
                raise TaskError("bad_field", f"'{name}' of {goal.action} is a {param.type}, got {value!r}")

    def _look_again(self, agent_id: str) -> None:
        self._core.stale.add(agent_id)
        self._core.moved[agent_id] = None

    def _drift_m(self, agent: AgentRecord, goal: GoalRecord) -> float:
        """Return how far the machine gets on its former way until the update has reached it, or is too old."""
        known = {**self._core.agent_type(agent).limits, **agent.limits}
        asked = self._core.asked_speed(goal)
        pace = known.get("speed_m_s", FAST_M_S) if asked is None else asked
        rest = distance_m(agent.position, goal.leg[1]) if agent.position is not None and goal.leg is not None else 0.0
        return min(rest, pace * TTL_BEATS)

    def _ends(self, agent: AgentRecord, goal: GoalRecord) -> tuple[Position | None, ...]:
        """Return where the machine may turn: here, or as far on its former way as it gets meanwhile."""
        here, leg = agent.position, goal.leg
        drift = self._drift_m(agent, goal)
        if here is None or leg is None or drift <= 0.0:
            return (here,)
        return here, _towards((here, leg[1]), drift)


def _towards(way: Way, metres: float) -> Position:
    (a, b), share = way, min(1.0, metres / max(distance_m(*way), 1e-9))
    east, north, up = b.east_m - a.east_m, b.north_m - a.north_m, b.up_m - a.up_m
    return Position(a.east_m + share * east, a.north_m + share * north, a.up_m + share * up)


def _fits(kind: Type, value: Any) -> bool:
    """Return whether a runtime value may be of a type: what passes the wire of it can be read as that."""
    try:
        read_value(kind, to_wire(value))
    except (KeyError, TypeError, ValueError, OverflowError):
        return False
    return True
