"""The fleet: which agents there are, how they are, and who of them can be trusted.

    ALIVE -> SUSPECT (no token, or status older than suspect_after) -> LOST (lost_after)      wall time
    pool: STANDBY, ASSIGNED, EXECUTING ACTION, PARKED_AWAY, QUARANTINED

A lost machine leaves its task QUARANTINED; it comes back by reappearing or by `formiga agents clear`: it is asked what it
still does, that is canceled, and if it may be airborne a system task `Recover` brings it home. Of one that is never heard of
again a person may say that it was removed (`formiga agents removed`): its way and its place are free then. People are never
lost.
"""

import math

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import distance_m
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.agents.admission import COMES_BACK, Admission
from formiga_bt.engine.agents.discovery import Discovery
from formiga_bt.engine.agents.membership import Membership
from formiga_bt.engine.agents.own_fields import take_fields
from formiga_bt.engine.agents.process_identity import BAD_LIMIT, DOUBLE, ProcessIdentity
from formiga_bt.engine.agents.repeats import Repeats
from formiga_bt.engine.goals import epochs
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.passages import Passages
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.goals.routing import Routing
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import TakeOverHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.holds import hold
from formiga_bt.engine.kernel.inputs import Alarm, CancelGoal, EffectFailed, NotifyPeople, QueryGoal
from formiga_bt.engine.kernel.news import CameBack, Flies, Idle, Landed, Leaves, Left, StatusTaken
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.timers import CancelDue, GraceDue, LiveDue, StrayDue
from formiga_bt.engine.resting import is_in_its_place
from formiga_bt.safety.site_message import with_site
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalEvent

MOST_ID = 10**9
"""No number of an id is as high: what an agent says of higher ones is not believed."""

REMOVED = "removed"
"""Why a machine is quarantined that was lost, and that a person took away: it comes back by `clear` only."""

STRAY_US = 5 * SECOND
"""For so long (engine time) a machine may fly for nobody, or not know whether it does."""

TELEPORT_FREE_M = 30.0
"""A jump smaller than this is never called a teleport: fixes get better and worse."""


class Fleet:
    """All agents."""

    def __init__(self, core: Core, goals: Goals, people: People, clearances: Clearances) -> None:
        self._core = core
        self._goals = goals
        self._people = people
        self._clearances = clearances
        self._admission = Admission(core, goals)
        self.discovery = Discovery(core)
        self.membership = Membership(core, self._admission)
        self._process_identity = ProcessIdentity(core, goals)
        self._repeats = Repeats(core)
        self._passages = Passages(core)
        self._routing = Routing(core)

    # -- presence ------------------------------------------------------------------------------------------------
    def on_seen(self, card: AgentCard, wall: int, wire: str = "", lacks: tuple[str, ...] = ()) -> None:
        """An agent announced itself: admit it, or take it back. Each card is judged, not its first one only.

        Args:
            card: its card.
            wall: wall time of its arrival, or 0.
            wire: that it is on.
            lacks: what that wire does not guarantee.
        """
        core = self._core
        self.discovery.hear(card)
        old = core.state.agents.get(card.id)
        if old is None:
            self._admission.admit(card, wall, wire, lacks)
        else:
            if old.boot_id and old.boot_id != card.boot_id:
                self._rebooted(old, card.boot_id, wall)
            core.put_agent(card.id, wire=wire, lacks=lacks)
            self._admission.judge_anew(card)
            self._admission.take_refusals(card)
            core.put_agent(
                card.id,
                present=True,
                actions=self._admission.known(card),
                on_link_loss=card.on_link_loss,
                limits=dict(card.limits),
                avoids=card.avoids,
                heard_wall=wall or old.heard_wall,
            )
            if old.liveness != "ALIVE" and old.mobility in MOVING:  # where it is now its next status tells
                self._watch_liveness(core.state.agents[card.id], wall)
                return
        self._mark_alive(card.id, wall)

    def read_anew(self) -> None:
        """The engine was started anew: who is admitted, and each machine's port, are as the site file says now."""
        self._admission.read_anew()

    def on_gone(self, agent_id: str) -> None:
        """The presence token vanished: SUSPECT at once, LOST after `lost_after`."""
        agent = self._core.state.agents.get(agent_id)
        if agent is None:
            return
        self._core.put_agent(
            agent_id, present=False, liveness="SUSPECT" if agent.liveness == "ALIVE" else agent.liveness
        )

    # -- status --------------------------------------------------------------------------------------------------
    def on_status(self, status: AgentStatus, wall: int, told_of: str = "") -> None:
        """Take a status, unless it is old, lies, or comes from an unknown agent.

        Args:
            status: the status.
            wall: wall time of its arrival, or 0.
            told_of: the goal whose end brought this status along, if any.
        """
        core = self._core
        agent = core.state.agents.get(status.id)
        if agent is None or agent.refused in ("unknown_type", "other_type", "unlisted", "wire_version"):
            return
        before = agent
        if not agent.flies and status.landed != "grounded":  # it knows nothing of flight
            status = replace(status, landed="grounded")
        if self._repeats.take(agent, status, wall):
            self._heard_again(agent, status, wall, told_of)
            return
        if agent.refused == "datum":
            if agent.pool != "QUARANTINED":
                return
            # What it says of heights is none of ours.
            status = replace(status, position=agent.position, initial_deployment=None)
        if self._process_identity.passes_over(agent, status, wall):
            return
        epochs.heard(core, agent, status)
        if agent.boot_id and status.boot_id and status.boot_id != agent.boot_id:
            self._rebooted(agent, status.boot_id, wall)
            agent = core.state.agents[status.id]
        lie = self._lie(agent, status)
        if lie:
            self.on_bad(agent.id, lie)
            return
        took_over = status.control != "engine" and not agent.human and not agent.taken and self._takes(agent, status)
        core.put_agent(
            agent.id,
            battery=status.battery,
            position=status.position,
            initial=status.initial_deployment or agent.initial or status.position,
            landed=status.landed,
            stood_at=status.position.ground if status.landed == "grounded" and status.position else agent.stood_at,
            inside=self._passages.seen(agent, status.position),
            on_route=self._routing.seen(agent, status.position, stands=_stands(agent, status)),
            lost_leg=None if _stands(agent, status) else agent.lost_leg,
            lost_area=None if _stands(agent, status) else agent.lost_area,
            control=status.control,
            word=status.status,
            payload_kg=status.payload_kg,
            wind=_wind(status),
            checks=with_site(status.checks, status.site, core.site_message.version) if agent.flies else status.checks,
            heading_deg=status.heading_deg,
            speed_m_s=status.speed_m_s,
            floor=status.floor,
            charging=status.charging,
            errors=status.errors,
            boot_id=status.boot_id or agent.boot_id,
            seq=status.seq,
            stamp=status.stamp,
            stray_stamp=0,
            stray_wall=0,
            epoch=status.epoch,
            epoch_ignored=status.epoch_ignored,
            engine_id=status.engine_id,
            site=status.site,
            heard_at=core.now,
            heard_wall=wall or agent.heard_wall,
            rebooted=agent.rebooted and not (status.landed == "airborne" and status.control == "engine"),
            bad=0,
        )
        if agent.goal:
            self._goals.updates.on_status(agent.goal)
        if status.fields or agent.fields or agent.refused_fields:
            take_fields(core, agent, status)
        self._mark_alive(agent.id, wall)
        self._clearances.review(agent.id)
        self._take_back(agent.id, wall)
        if agent.quarantine == REMOVED and status.landed == "airborne":
            text = f"{agent.id} is in the air, although a person said that it was removed"
            core.effect(Alarm("found_airborne", text, "", agent.id))
        if took_over:
            self._pilot_has(agent)
        self._look_for_stray(agent.id)
        if not agent.human:
            core.report(StatusTaken(agent.id, status.last_goal))
            if status.landed == "grounded" and agent.landed != "grounded" and agent.task:
                core.report(Landed(agent.task, agent.id))
            if status.landed == "airborne" and agent.landed != "airborne":
                core.report(Flies(agent.id))
        if status.last_goal and status.last_goal != told_of:
            self._find_lost_result(status)
        if agent.pool in ("STANDBY", "PARKED_AWAY") and not agent.task:
            self._rest(agent.id)
        self._admission.let_go(agent.id)
        self._repeats.note(before, status)

    def _heard_again(self, agent: AgentRecord, status: AgentStatus, wall: int, told_of: str) -> None:
        """A status repeated the one before: do what does not depend on what it says."""
        if agent.human:
            self._people.invalidate(agent.id)
        self._watch_liveness(agent, wall)
        if status.last_goal and status.last_goal != told_of:
            self._find_lost_result(status)

    def on_goal_event(self, event: GoalEvent, wall: int) -> None:
        """Take news of a goal: first the status that came with it, then the news."""
        if event.status is not None and event.status.id == event.agent:
            self.on_status(event.status, wall, told_of=event.goal_id)
        self._goals.on_event(event)

    def on_effect_failed(self, failed: EffectFailed) -> None:
        """What left for an agent did not get through."""
        if failed.what == "query":
            self._on_query_failed(failed.agent)
        self._goals.on_effect_failed(failed)

    @staticmethod
    def _takes(agent: AgentRecord, status: AgentStatus) -> bool:
        # What joins under its pilot's or its failsafe's command in the air was taken over, too.
        return agent.control == "engine" or (status.control in ("pilot", "failsafe") and status.landed != "grounded")

    def _look_for_stray(self, agent_id: str) -> None:
        """Look whether a machine flies, or may, under our command and for nobody, whatever it was before.

        An engine that forgot it has sent it, or it joins in the air. It is waited for a little: a task may be granted it, and
        many do not know for a moment whether they stand.
        """
        core = self._core
        due = StrayDue(agent_id)
        if self._is_stray(core.state.agents[agent_id]):
            if due not in core.state.deadlines:
                core.set_deadline(due, core.now + STRAY_US)
        else:
            core.clear_deadline(due)

    def on_stray_due(self, agent_id: str) -> None:
        """A machine has flown for nobody, or may have, for long enough: people are told, and it comes home."""
        agent = self._core.state.agents[agent_id]
        if self._is_stray(agent):
            how = "is in the air" if agent.landed == "airborne" else "does not know whether it stands"
            text = f"{agent_id} {how} and belongs to no task; it is brought home"
            self._core.effect(Alarm("found_airborne", text, "", agent_id))
            self._core.report(Idle(agent_id))

    def _is_stray(self, agent: AgentRecord) -> bool:
        free = agent.flies and not (agent.task or agent.goal or agent.taken or agent.refused)
        ours = free and agent.control == "engine" and agent.pool != "QUARANTINED" and agent.liveness != "LOST"
        may_fly = agent.landed == "airborne" or (
            agent.landed == "unknown" and self._core.agent_type(agent).recover is not None
        )
        return ours and may_fly and agent.id not in self._core.state.orders

    def _lie(self, agent: AgentRecord, status: AgentStatus) -> str:
        if status.type != agent.type:
            return f"status says type {status.type}, its card said {agent.type}"
        at, wind = status.position, _wind(status)
        total = status.battery
        if at is not None:
            total += at.east_m + at.north_m + at.up_m
        if wind is not None:
            total += wind[0] + wind[1]
        if not math.isfinite(total) and not all(map(math.isfinite, _numbers(status))):
            return "status holds a number that is not finite"
        if not 0.0 <= status.battery <= 100.0:
            return f"battery {status.battery} is no percentage"
        if at is not None and agent.position is not None and not agent.human and agent.seq >= 0:  # of this process
            jump = distance_m(at, agent.position)
            if jump <= TELEPORT_FREE_M:
                return ""
            limits = self._core.catalogue.types[agent.type].limits
            top = 3 * (limits.get("speed_m_s", 20.0) + limits.get("climb_m_s", 5.0))
            seconds = max(0, min(status.stamp, self._core.clock) - agent.said_at) / 1e6
            if jump > TELEPORT_FREE_M + top * seconds:
                return f"jumped {jump:.0f} m in {seconds:.1f} s"
        return ""

    def on_bad(self, agent_id: str, text: str) -> None:
        """Count a bad message; too many in a row quarantine a machine."""
        core = self._core
        agent = core.state.agents.get(agent_id)
        if agent is None:
            return
        agent = core.put_agent(agent_id, bad=agent.bad + 1)
        if agent.bad == BAD_LIMIT and not agent.human:
            core.effect(Alarm("bad_status", f"{agent_id}: {text}", agent.task, agent_id))
            self._goals.lose(agent_id, "lost")
            self.quarantine(agent_id, "bad_status")

    def _find_lost_result(self, status: AgentStatus) -> None:
        goal = self._core.state.goals.get(status.last_goal)
        if goal is not None and goal.agent == status.id and goal.in_flight and not goal.cancel_asked:
            # The result message may be under way; the agent tells it again when asked.
            self._core.effect(QueryGoal(status.id, (goal.id,)))

    def _rest(self, agent_id: str) -> None:
        agent = self._core.state.agents[agent_id]
        away = agent.landed == "grounded" and not self.at_port(agent)
        pool = "PARKED_AWAY" if away else "STANDBY"
        if pool != agent.pool:
            self._core.put_agent(agent_id, pool=pool)

    def at_port(self, agent: AgentRecord) -> bool:
        """Return whether a machine that stands is where it belongs: at its own port, or as its type's `rest` says."""
        return is_in_its_place(self._core, agent)

    # -- liveness ------------------------------------------------------------------------------------------------
    def _mark_alive(self, agent_id: str, wall: int) -> None:
        core = self._core
        agent = core.state.agents[agent_id]
        if not agent.present:
            return
        if agent.liveness != "ALIVE":
            was = agent.liveness
            core.put_agent(agent_id, liveness="ALIVE")
            if was == "SUSPECT":
                self.ask_about_goals(agent_id)
        if agent.human:
            self._people.invalidate(agent_id)
        self._watch_liveness(agent, wall)

    def _watch_liveness(self, agent: AgentRecord, wall: int) -> None:
        """An agent was heard of at a wall time (0: not known): have it looked at when it has been silent for too long."""
        core = self._core
        kind = core.catalogue.types.get(agent.type)  # None: not admitted
        if kind is None or not wall:
            return
        due = LiveDue(agent.id)
        # After a silence it is set up to `lost_after`: the next one is looked for as soon as the first.
        if core.state.wall.get(due, math.inf) > kind.suspect_after_us:
            core.set_wall(due, kind.suspect_after_us)

    def _take_back(self, agent_id: str, wall: int) -> None:
        # On a status, not on a card: what it says of itself must be fresh before it is decided whether it may be airborne.
        # One that a person must look at first (abandoned, recover_failed, cancel_unconfirmed) comes back by `clear` only.
        agent = self._core.state.agents[agent_id]
        # One that was removed does too, unless it flies after all.
        if agent.pool != "QUARANTINED" or agent.liveness != "ALIVE" or agent.refused:
            return
        alone = agent.quarantine == DOUBLE and wall > 0 and not self._process_identity.are_two(agent, wall)
        if alone or agent.quarantine in COMES_BACK or (agent.quarantine == REMOVED and agent.landed == "airborne"):
            self.begin_return(agent_id)

    def on_unreachable(self, agent_id: str) -> None:
        """A goal surely did not arrive: trust the agent again when it is heard of."""
        if self._core.state.agents[agent_id].liveness == "ALIVE":
            self._core.put_agent(agent_id, liveness="SUSPECT")

    def _on_query_failed(self, agent_id: str) -> None:
        """The question what a returning machine still does got no answer: it is asked again at its next status."""
        agent = self._core.state.agents.get(agent_id)
        if agent is not None and agent.quarantine == "asked":
            self._core.put_agent(agent_id, quarantine="lost")

    def ask_about_goals(self, agent_id: str) -> None:
        """Ask an agent what became of the goals that it was sent."""
        goals = tuple(g.id for g in self._core.index.goals_of(agent_id) if g.in_flight)
        if goals:
            self._core.effect(QueryGoal(agent_id, goals))

    def heard_for(self, agent_id: str, wall: int, heard: int = 0) -> int | None:
        """Return for how much longer an agent counts as heard of; None: it must be judged now (`on_live_due`).

        Args:
            agent_id: whose.
            wall: now.
            heard: when its wire last heard it, if it knows of later than the newest status.
        """
        agent = self._core.state.agents.get(agent_id)
        kind = self._core.catalogue.types.get(agent.type) if agent is not None and agent.present else None
        left = 0 if agent is None or kind is None else kind.suspect_after_us - (wall - max(agent.heard_wall, heard))
        return left if left > 0 else None

    def on_live_due(self, agent_id: str, wall: int) -> None:
        """Judge by the age of the newest status, then look again when it would next be too old."""
        core = self._core
        core.set_wall(LiveDue(agent_id), None)
        agent = core.state.agents.get(agent_id)
        if agent is None or agent.type not in core.catalogue.types:
            return
        kind = core.agent_type(agent)
        silent = wall - agent.heard_wall
        if silent < kind.suspect_after_us and agent.present:
            core.set_wall(LiveDue(agent_id), kind.suspect_after_us - silent)
            return
        if agent.liveness == "ALIVE":
            core.put_agent(agent_id, liveness="SUSPECT")
        if agent.human:
            return  # people are only unreachable; the next sign of life sets the timer again
        if silent < kind.lost_after_us:
            core.set_wall(LiveDue(agent_id), kind.lost_after_us - silent)
        else:
            self._lost(agent_id)

    def _lost(self, agent_id: str) -> None:
        core = self._core
        core.put_agent(agent_id, liveness="LOST")
        self._goals.lose(agent_id, "lost")
        self.quarantine(agent_id, "lost")

    def _rebooted(self, agent: AgentRecord, boot_id: str, wall: int = 0) -> None:
        """Its process is another one: what it did before ended unknown."""
        self._process_identity.begin(agent, boot_id, wall)
        self._goals.lose(agent.id, "in_doubt", f"the process of {agent.id} was started anew")
        if agent.mobility not in MOVING:
            return
        # A machine whose process starts anew hovers where it says, or stands: it has yet to tell.
        self._core.put_agent(agent.id, lost_leg=None, lost_area=None, rebooted=True)
        self._clearances.forget(agent.id)

    def trust_again(self, agent_id: str) -> None:
        """A person has looked at a machine whose process was started anew, or a task is granted it."""
        self._core.put_agent(agent_id, rebooted=False)

    # -- quarantine ----------------------------------------------------------------------------------------------
    def quarantine(self, agent_id: str, why: str) -> None:
        """Take a machine out of its task and out of the pool; it gets nothing but queries."""
        core = self._core
        agent = core.state.agents[agent_id]
        if agent.pool == "QUARANTINED" or agent.refused:
            return
        task_id = agent.task
        core.report(Leaves(agent_id))
        core.put_agent(agent_id, pool="QUARANTINED", quarantine=why, task="", role="", breach="", aside="")
        if agent.may_be_airborne:
            self.warn_of(agent, why, task_id)
        elif why == "cancel_unconfirmed":
            core.effect(Alarm(why, f"{agent_id} never confirmed that it stopped", task_id, agent_id))
        self._goals.give_up(agent_id)
        if task_id:
            core.report(Left(task_id, agent_id))

    def warn_of(self, agent: AgentRecord, why: str, task_id: str = "") -> None:
        """Tell people that a quarantined machine may be in the air; after a restart, anew."""
        text = f"{agent.id} may be airborne and is out of control: {why}"
        self._core.effect(Alarm("quarantined_airborne", text, task_id, agent.id))

    def removed(self, agent_id: str, by: str) -> None:
        """A person has taken a machine away that is not heard of: it is nowhere here, and takes up nothing any more."""
        core = self._core
        agent = core.state.agents[agent_id]
        if agent.quarantine == REMOVED:
            return
        core.put_agent(
            agent_id, landed="grounded", position=None, stood_at=None, layer_m=None, lost_leg=None, lost_area=None,
            inside=(), on_route=(), aside="",
            quarantine=REMOVED if agent.pool == "QUARANTINED" else agent.quarantine,
        )  # fmt: skip
        core.effect(
            NotifyPeople(f"{agent_id} was removed, says {by or 'somebody'}: its way and its place are free", (), "info")
        )

    def begin_return(self, agent_id: str) -> None:
        """A quarantined machine is back, or a person cleared it: ask what it still does."""
        core = self._core
        core.put_agent(agent_id, quarantine="asked", bad=0)
        core.effect(QueryGoal(agent_id))

    def on_query_reply(self, agent_id: str, boot_id: str, events: tuple[GoalEvent, ...]) -> None:
        """Take what an agent knows of its goals; end the return from quarantine."""
        core = self._core
        agent = core.state.agents.get(agent_id)
        if agent is None:
            return
        if boot_id and agent.boot_id and boot_id != agent.boot_id:
            self._rebooted(agent, boot_id)
        returning = agent.pool == "QUARANTINED" and agent.quarantine == "asked"
        if returning:
            core.put_agent(agent_id, pool="STANDBY", quarantine="")
        for event in events:
            if event.goal_id in core.state.goals:
                self.on_goal_event(event, 0)
                continue
            self._pass_over(event.goal_id)
            if event.state in ("accepted", "running", "canceling"):
                self._cancel_foreign(agent_id, event.goal_id)
        if returning:
            self._returned(agent_id)

    def _pass_over(self, goal_id: str) -> None:
        """An agent knows a goal of steps that were not kept: its number is not given again."""
        core = self._core
        first, _, rest = goal_id.partition("/")
        counter = {"safety": "safety", "clear": "clearance"}.get(first, "task")
        number = (first.rpartition("-") if counter == "task" else rest.partition("~")[0].rpartition("/"))[2]
        if not number.isdecimal() or len(number) > len(str(MOST_ID)):
            return
        if core.state.counters.get(counter, 0) < int(number) < MOST_ID:
            core.emit(ch.CounterSet(counter, int(number)))

    def _cancel_foreign(self, agent_id: str, goal_id: str) -> None:
        core = self._core
        core.emit(
            ch.GoalPut(
                GoalRecord(
                    id=goal_id, agent=agent_id, action=next(iter(core.catalogue.actions)), owner="!none",
                    state="canceling", cancel_asked=True, order=core.count("goal"), at=core.now, sent_at=core.now,
                )
            )
        )  # fmt: skip
        core.put_agent(agent_id, goal=goal_id)
        core.effect(CancelGoal(goal_id, agent_id))
        core.set_wall(CancelDue(goal_id), 2 * SECOND)
        core.set_wall(GraceDue(goal_id), 30 * SECOND)

    def _returned(self, agent_id: str) -> None:
        agent = self._core.state.agents[agent_id]
        if agent.landed == "grounded":
            self._core.put_agent(agent_id, layer_m=None, lost_leg=None, lost_area=None)
            self._rest(agent_id)
        else:
            # It is where it says; what it did is canceled.
            self._core.put_agent(agent_id, lost_leg=None, lost_area=None)
            self._core.report(CameBack(agent_id))

    # -- command -------------------------------------------------------------------------------------------------
    def on_taken_over(self, goal: GoalRecord) -> None:
        """A pilot (or its own failsafe) ended a machine's goal: a person must hand it back."""
        agent = self._core.put_agent(goal.agent, taken=True)
        if goal.task:
            hold(self._core, goal.task, TakeOverHold(goal.agent))
        if agent.task and agent.task != goal.task:
            hold(self._core, agent.task, TakeOverHold(goal.agent))

    def _pilot_has(self, agent: AgentRecord) -> None:
        core = self._core
        core.put_agent(agent.id, taken=True)
        if agent.task:
            hold(core, agent.task, TakeOverHold(agent.id))
        if agent.task or agent.landed != "grounded":
            core.effect(Alarm("taken_over", f"{agent.id} is not under the engine's control", agent.task, agent.id))

    # -- release -------------------------------------------------------------------------------------------------
    def release(self, agent_id: str) -> None:
        """Give a machine back to the pool."""
        core = self._core
        agent = core.state.agents[agent_id]
        if agent.shared or agent.pool == "QUARANTINED":
            return
        task_id = agent.task
        agent = core.put_agent(agent_id, task="", role="", pool="STANDBY", aside="")
        if agent.landed == "grounded":
            core.put_agent(agent_id, layer_m=None)
            if not self.at_port(agent):
                core.put_agent(agent_id, pool="PARKED_AWAY")
                core.effect(Alarm("parked_away", f"{agent_id} stands away from its port", task_id, agent_id))
        elif agent.landed == "airborne" and core.agent_type(agent).recover is not None:
            # It landed, and was sent up again by an engine that could not keep that.
            self._core.report(Idle(agent_id))


def _stands(agent: AgentRecord, status: AgentStatus) -> bool:
    """Return whether a machine surely goes nowhere: one that drives stands when it says that it does nothing."""
    return status.landed == "grounded" and (agent.mobility != "ground" or status.status == "STANDBY")


def _wind(status: AgentStatus) -> tuple[float, float] | None:
    if status.wind_east_m_s is None or status.wind_north_m_s is None:
        return None
    return status.wind_east_m_s, status.wind_north_m_s


def _numbers(status: AgentStatus) -> tuple[float, ...]:
    at = status.position
    return (status.battery, *((at.east_m, at.north_m, at.up_m) if at is not None else ()), *(_wind(status) or ()))
