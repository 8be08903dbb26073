"""Breaches of the envelope in flight: looked for at each status of a machine in the air.

| it flies | what happens |
|---|---|
| for a task's steps or cleanup | alarm, the task ends `envelope.<name>`, it is ordered to return (or hold 5 s first) |
| the last phase of a landing, and the limit is reserve, wind or daylight | alarm; the landing is finished, then the task ends |
| for nobody | alarm, and it is ordered to return |
| home already: recover, an order | alarm; a rescue is never refused; at half the reserve without a free way home it lands |

What drives is looked at while a task has it or a goal runs: the fence, no-go regions, charge while it drives, progress. It is
ordered to return (to a station), or to hold: then it stands until a person decides.
"""

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.overload import lag_since
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.orders.orders import StandingOrders
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.safety.driving import off_the_way, while_driving
from formiga_bt.safety.envelope import Breach, FlightState, in_flight
from formiga_bt.safety.rules import Rules

DESCENDING = "descending"
"""The phase of a landing that is not broken off."""
SLACK, SPARE_S = 3.0, 60.0
"""A way that lasts more than three times what it should, and a minute, is no progress."""
LATER = "!"
"""In `AgentRecord.breach`: its landing is finished first, then its task ends."""


class Breaches:
    """What the engine does when a machine leaves its envelope."""

    def __init__(self, core: Core, tasks: Tasks, orders: StandingOrders) -> None:
        self._core = core
        self._tasks = tasks
        self._orders = orders

    def look(self, agent_id: str, ended: str) -> None:
        """A status of a machine came in; by it this goal of the machine has ended, though its end may not be handled yet."""
        core = self._core
        agent = core.state.agents[agent_id]
        if agent.mobility not in MOVING:
            return
        if agent.flies and agent.landed == "grounded":
            self._on_ground(agent)
            return
        if agent.refused or agent.pool == "QUARANTINED" or agent.control != "engine" or agent.taken:
            return
        rules = core.rules(agent, agent.task)
        broken = self._broken if agent.flies else self._driving
        found = broken(agent, rules) or (self._stuck(agent) or self._strays(agent) if agent.goal != ended else ())
        if agent.flies:
            self._waits_too_long(agent)
        if not found:
            if agent.breach and not agent.breach.startswith(LATER):
                core.put_agent(agent_id, breach="")
        elif agent.breach.removeprefix(LATER) != found[0].name:
            self._breached(agent, found[0])

    def _broken(self, agent: AgentRecord, rules: Rules) -> tuple[Breach, ...]:
        core = self._core
        state = self._state(agent, rules)
        found = in_flight(state, core.airspace, rules)
        if found and not agent.goal:
            spots = self._lands_later(agent)
            if spots:
                return in_flight(replace(state, spots=(*state.spots, *spots)), core.airspace, rules)
        return found

    def _driving(self, agent: AgentRecord, rules: Rules) -> tuple[Breach, ...]:
        core = self._core
        goal = core.state.goals.get(agent.goal)
        if goal is None and not agent.task:
            return ()
        drives = goal is not None and goal.in_flight and goal.leg is not None
        return while_driving(agent.id, agent.position, agent.battery if drives else None, core.airspace, rules)

    def _lands_later(self, agent: AgentRecord) -> tuple[Place, ...]:
        """Return where it was landing when it was stopped, or waits to land: it may be low there."""
        goals = [g for g in self._core.index.goals_of(agent.id) if g.state in ("interrupted", "gated")]
        specs = [(goal, self._core.action(goal.action)) for goal in goals]
        targets = [goal.fields.get(spec.moves_to) for goal, spec in specs if spec.lands]
        return tuple(target for target in targets if isinstance(target, Place))

    def _state(self, agent: AgentRecord, rules: Rules) -> FlightState:
        core = self._core
        goal = core.state.goals.get(agent.goal)
        spec = core.action(goal.action) if goal is not None else None
        target = goal.fields.get(spec.moves_to) if goal is not None and spec is not None and spec.lands else None
        home = core.site.ports.get(agent.home)
        return FlightState(
            agent=agent.id,
            here=agent.position,
            spots=(agent.stood_at,) if agent.stood_at is not None else (),
            lands_at=target if isinstance(target, Place) else None,
            descending=_descends(goal),
            battery=agent.battery,
            payload_kg=agent.payload_kg,
            wind=agent.wind,
            power=core.power(agent),
            home=home.at if home else None,
            layer_m=agent.layer_m,
            sun_up=core.airspace.sun_is_up(core.now) if rules.daylight_only else None,
        )

    def _waits_too_long(self, agent: AgentRecord) -> None:
        """It waits for a way home until half its reserve is gone: better a landing that is ordered than one by its failsafe."""
        core = self._core
        if agent.goal or agent.battery is None or core.power(agent) is None or not self._comes_home(agent):
            return
        half = core.rules(agent, "").reserve_pct / 2
        order = core.state.orders.get(agent.id)
        if agent.battery < half and (order is None or order.stop == "return"):
            self._orders.no_way_home(
                agent.id, f"envelope.reserve: the way home stayed taken until {agent.battery:.0f} % were left"
            )

    def _stuck(self, agent: AgentRecord) -> tuple[Breach, ...]:
        """A way takes far longer than it should: the machine does not get on."""
        core = self._core
        goal, (speed_m_s, climb_m_s) = core.state.goals.get(agent.goal), self._pace(agent)
        if goal is None or speed_m_s <= 0.0 or goal.leg is None or goal.sent_at is None or goal.state != "running":
            return ()
        resume = core.state.resume
        if resume is not None and agent.id in resume.waits:
            return ()  # it may have ended while the engine was away
        since = goal.sent_at if goal.turned_at is None else goal.turned_at
        lag = lag_since(core.state, since)
        if lag is None:
            return ()  # the engine comes late, not the machine
        (start, end), asked = goal.leg, core.asked_speed(goal)
        pace = speed_m_s if asked is None else min(speed_m_s, asked)
        least = 0.5 if agent.flies else 0.05
        typical_s = horizontal_m(start, end) / max(pace, least) + abs(end.up_m - start.up_m) / max(climb_m_s, 0.2)
        most_s, lasts_s = SLACK * typical_s + SPARE_S + lag / SECOND, (core.now - since) / SECOND
        if lasts_s <= most_s:
            return ()
        text = f"{goal.action} should take about {typical_s:.0f} s and runs for {lasts_s:.0f} s: it does not get on"
        return (Breach("progress", text, round(lasts_s, 1), round(most_s, 1)),)

    def _strays(self, agent: AgentRecord) -> tuple[Breach, ...]:
        """A machine on the ground is off the way that it was given: others were let go because it keeps to it."""
        goal, here = self._core.state.goals.get(agent.goal), agent.position
        if agent.flies or agent.avoids or here is None or goal is None or goal.leg is None or not goal.in_flight:
            return ()
        ways = (goal.leg,) if goal.also is None else (goal.leg, goal.also)
        found = off_the_way(here, ways, self._core.site.min_spacing_m)
        return (found,) if found is not None else ()

    def _pace(self, agent: AgentRecord) -> tuple[float, float]:
        """Return its speed and climb, m/s; 0 = not known, and its progress is not watched."""
        power = self._core.power(agent)
        if agent.flies:
            return (power.speed_m_s, power.climb_m_s) if power is not None else (0.0, 0.0)
        limits = {**self._core.agent_type(agent).limits, **agent.limits}
        return limits.get("speed_m_s", 0.0), 0.0

    def _breached(self, agent: AgentRecord, breach: Breach) -> None:
        core = self._core
        core.put_agent(agent.id, breach=f"{LATER if breach.only_alarm else ''}{breach.name}")
        core.effect(Alarm(breach.code, f"{agent.id}: {breach.text}", agent.task, agent.id))
        if breach.only_alarm or self._comes_home(agent):
            return
        if agent.task:
            self._tasks.fail(agent.task, breach.code, f"{agent.id}: {breach.text}")
        reaction = core.rules(agent, agent.task).reaction(breach.name)
        self._orders.breached(agent.id, breach.name, reaction)

    def way_is_closed(self, agent: AgentRecord, text: str) -> None:
        """The way of a machine leads into a region that people closed now."""
        if agent.breach.removeprefix(LATER) != "keep_out":
            self._breached(agent, Breach("keep_out", text))

    def _comes_home(self, agent: AgentRecord) -> bool:
        order = self._core.state.orders.get(agent.id)
        task = self._core.state.tasks.get(agent.task)
        if order is not None and (order.stop != "hold" or order.scope == "engine"):
            return True
        return task is not None and (task.section == "recover" or bool(task.system.agent))

    def _on_ground(self, agent: AgentRecord) -> None:
        if not agent.breach:
            return
        self._core.put_agent(agent.id, breach="")
        name = agent.breach.removeprefix(LATER)
        if agent.breach.startswith(LATER) and agent.task and not self._comes_home(agent):
            text = f"{agent.id} broke its limit while it landed; it stands now"
            self._tasks.fail(agent.task, f"envelope.{name}", text)


def _descends(goal: GoalRecord | None) -> bool:
    return goal is not None and goal.in_flight and goal.phase == DESCENDING
