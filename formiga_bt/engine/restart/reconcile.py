"""After the engine was away: find out what happened meanwhile, before anything goes on.

    Resumed, or Outage -> asking -> overdue -> watching -> over

| phase | ends |
|---|---|
| asking | every agent with a goal in doubt has told of it, or 10 s of wall time have passed |
| overdue | every deadline that passed meanwhile has fired, in the order (deadline, seq) |
| watching | each machine of a task was heard of |

While asking, no timer fires: a result that came while nobody listened counts before a deadline that passed. Until a machine was
heard of, and in the first two phases, nothing but safety goals leaves. A machine that is not as it was left (its control, its
port, on the ground or in the air) lets its task come back HELD, like a long outage does all tasks. Of the engine's own tasks
only those are HELD that would have a drone take off: one that flies, and a machine on the ground, goes on home.

`Resumed` is the first input of an engine that goes on from its journal. `Outage` comes from the driver of an engine whose
process stood still: its trees, and who is connected, are as they were; what it did not hear meanwhile is nobody's silence.

What an agent is asked, and what its reply does, is the same as after any silence: `fleet` and `goals` do it.
"""

from typing import Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import horizontal_m
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.goals.goals import RESEND_US, Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.causes import ResumeHold
from formiga_bt.engine.kernel.core import EVERYTHING, Core
from formiga_bt.engine.kernel.holds import hold
from formiga_bt.engine.kernel.journal_levels import JOURNAL, LEVELS
from formiga_bt.engine.kernel.overload import LATE
from formiga_bt.engine.kernel.records import AgentRecord, Before, FoundMachine, Resuming, TaskRecord
from formiga_bt.engine.kernel.timers import AskDue, CancelDue, LiveDue, ResumeDue
from formiga_bt.engine.orders.continuing import way_on
from formiga_bt.engine.restart.rescue import Rescue
from formiga_bt.engine.rules.standing_rules import StandingRules
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.nodes.memory import NODE_STATE_VERSION
from formiga_bt.safety.gate import AT_PORT_M

ASK_US: Final = 10 * SECOND
"""Wall time that agents have to tell what became of their goals."""
ASK_AGAIN_US: Final = 2 * SECOND
MOVED_M: Final = 30.0
"""A machine that only hovered or stood, and is this far from there now, was moved."""
MARKS: Final = ResumeHold()
"""The cause of HELD."""
RESTORE: Final = "formiga restore"
"""Who locks a site down that was made of a backup."""


class Reconcile:
    """The phases after `Resumed`."""

    def __init__(
        self, core: Core, fleet: Fleet, goals: Goals, authority: Authority, rescue: Rescue, rules: StandingRules
    ) -> None:
        self._core = core
        self._fleet = fleet
        self._goals = goals
        self._authority = authority
        self._rescue = rescue
        self._rules = rules

    # -- the start ---------------------------------------------------------------------------------------------------
    def begin(self, given: inp.Resumed) -> None:
        """The engine is there again."""
        core = self._core
        core.stands_by = False
        core.emit(ch.CounterSet("epoch", given.epoch))
        if core.state.counters.get("deposed"):
            core.emit(ch.CounterSet("deposed", 0))
            core.stale.add(EVERYTHING)  # goals that the other engine held up wait for something else now
        if core.state.counters.get(JOURNAL):
            core.emit(ch.CounterSet(JOURNAL, LEVELS["ok"]))
        if core.state.counters.get(LATE):
            core.emit(ch.CounterSet(LATE, 0))
        self._begin(given, tuple(core.state.agents), _cancels(given))
        self._fleet.read_anew()
        self._rules.read_anew()
        self._rules.came_back()
        self._lose_touch(given.heard)
        for effect in given.again:
            if not isinstance(effect, inp.CancelGoal):
                core.effect(effect)
        long = self._is_long or given.restored
        self._authority.came_back(long=long, taken_back=given.taken_back)
        self._give_up(given)
        if long:
            self._hold_all()
        core.set_wall(ResumeDue(), ASK_US)

    def stood_still(self, given: inp.Outage) -> None:
        """The engine's process stood still, and goes on."""
        core = self._core
        core.stands_by = False
        self._begin(given, (), ())
        self._count_anew(given.heard)
        self._rules.came_back()
        self._authority.came_back(long=self._is_long)
        if self._is_long:
            self._hold_all()
        core.set_wall(ResumeDue(), ASK_US)
        for agent_id in self._resume.waits:
            if core.state.agents[agent_id].present:  # who is not is asked when it is back
                self._fleet.ask_about_goals(agent_id)

    def _begin(
        self, given: inp.Resumed | inp.Outage, unheard: tuple[str, ...], cancels: tuple[tuple[str, str, str], ...]
    ) -> None:
        old = self._core.state.resume
        again = old is not None and old.phase != "watching"  # it went away once more before all was known
        since = old.since if old is not None and again else given.since
        at = old.at if old is not None and again else given.at
        stood = isinstance(given, inp.Outage) and (old is None or old.stood or not again)
        self._core.emit(
            ch.ResumePut(
                Resuming(
                    phase="asking",
                    since=since,
                    at=at,
                    outage_us=max(0, given.wall - since),
                    speed=given.speed,
                    waits=self._in_doubt(),
                    unheard=unheard or (old.unheard if old is not None else ()),
                    before={**self._before(), **(old.before if old is not None else {})},
                    cancels=(*(old.cancels if old is not None else ()), *cancels),
                    stood=stood,
                )
            )
        )

    def _in_doubt(self) -> tuple[str, ...]:
        agents = self._core.state.agents
        busy = dict.fromkeys(goal.agent for goal in self._core.state.goals.values() if goal.in_flight)
        return tuple(
            a for a in busy if (agents[a].present if agents[a].human else agents[a].liveness != "LOST")
        )  # fmt: skip

    def _before(self) -> dict[str, Before]:
        core = self._core
        found: dict[str, Before] = {}
        for agent in core.state.agents.values():
            if agent.human or not self._is_commanded(agent) or agent.liveness == "LOST":
                continue
            goals = [goal for goal in core.index.goals_of(agent.id) if goal.in_flight]
            effects = ["unknown" if goals else "", *(core.action(goal.action).effect for goal in goals)]
            found[agent.id] = Before(
                agent.boot_id,
                agent.seq,
                agent.control,
                tuple(dict.fromkeys((agent.landed, *(effect for effect in effects if effect)))),
                self._port_of(agent),
                None if goals else agent.position,
            )
        return found

    def _is_commanded(self, agent: AgentRecord) -> bool:
        return bool(agent.task) or agent.id in self._core.state.orders

    def _port_of(self, agent: AgentRecord) -> str:
        at = agent.position
        if agent.landed != "grounded" or at is None:
            return ""
        ports = self._core.site.ports.values()
        return next((port.name for port in ports if horizontal_m(port.at, at) <= AT_PORT_M), "")

    def _lose_touch(self, heard: Micros) -> None:
        """Nobody is there until they announce themselves; who never does is lost, as after any silence."""
        core = self._core
        for agent in list(core.state.agents.values()):
            core.put_agent(
                agent.id,
                present=False,
                liveness="SUSPECT" if agent.liveness == "ALIVE" else agent.liveness,
                heard_wall=heard,
                boot_wall=heard,
                twice_wall=0,
                quarantine="lost" if agent.quarantine == "asked" else agent.quarantine,
            )
            if agent.pool == "QUARANTINED" and agent.may_be_airborne and not agent.human:
                self._fleet.warn_of(agent, agent.quarantine or "lost")
        self._set_walls_anew()

    def _count_anew(self, heard: Micros) -> None:
        """The engine heard nobody, whoever spoke: silence is counted from now on."""
        core = self._core
        for agent in list(core.state.agents.values()):
            passed = heard - agent.heard_wall
            if agent.liveness != "LOST" and passed > 0:
                core.put_agent(
                    agent.id, heard_wall=heard, boot_wall=agent.boot_wall + passed,
                    twice_wall=agent.twice_wall + passed if agent.twice_wall else 0,
                )  # fmt: skip
        self._set_walls_anew()

    def _set_walls_anew(self) -> None:
        core = self._core
        for timer, after in list(core.state.wall.items()):
            if not isinstance(timer, LiveDue):
                core.set_wall(timer, min(after, RESEND_US) if isinstance(timer, CancelDue) else after)
        for agent in core.state.agents.values():
            kind = core.catalogue.types.get(agent.type)
            if kind is not None and not agent.human and not agent.refused and agent.liveness != "LOST":
                core.set_wall(LiveDue(agent.id), kind.suspect_after_us)

    def _give_up(self, given: inp.Resumed) -> None:
        core = self._core
        for task_id in list(core.open):
            task = core.task(task_id)
            runs = task.section != ""
            if task_id in given.poison:
                why = "it stopped the engine each time it was resumed; its file or formiga has a mistake"
                self._rescue.give_up(task_id, "exception", why)
            elif runs and given.node_state != NODE_STATE_VERSION:
                self._rescue.give_up(task_id, "upgrade", "it was begun by another version of formiga")
            elif task_id in given.lost:
                self._rescue.give_up(task_id, "upgrade", f"its tree cannot be rebuilt: {given.lost[task_id]}")

    @property
    def _is_long(self) -> bool:
        resume = self._core.state.resume
        return resume is not None and resume.outage_us > self._core.site.resume_hold_after_us

    def _hold_all(self) -> None:
        core = self._core
        held = []
        for task_id in list(core.open):
            if self._may_hold(core.task(task_id)) or self._is_fetched(core.task(task_id)):
                hold(core, task_id, MARKS)
                held.append(task_id)
        resume = core.state.resume
        if held and resume is not None:
            names = ", ".join(held[:5]) + (f" and {len(held) - 5} more" if len(held) > 5 else "")
            away = f"the engine was away for {resume.outage_us / SECOND:.0f} s"
            see = ", ".join(f"formiga why {one}" for one in held[:5])
            core.effect(inp.Alarm("held_by_resume", f"{away}; these wait for a person: {names}; see {see}"))

    @staticmethod
    def _may_hold(task: TaskRecord) -> bool:
        return task.status in ("ASSIGNED", "ACTIVE", "ENDING") and not task.system.agent and task.section != "recover"

    def _is_fetched(self, task: TaskRecord) -> bool:
        """Return whether the engine was about to have a machine take off to come home: what flies or drives goes on home."""
        agent = self._core.state.agents.get(task.system.agent)
        return agent is not None and agent.flies and task.system.stop == "return" and agent.landed == "grounded"

    # -- each step ---------------------------------------------------------------------------------------------------
    def before_input(self, given: inp.Input) -> None:
        """Look at an input before the engine does: a machine whose process is another one has lost what it did."""
        resume = self._core.state.resume
        assert resume is not None
        agent_id, boot_id = _boot_of(given)
        agent = self._core.state.agents.get(agent_id)
        if agent is None or not boot_id or not agent.boot_id or boot_id == agent.boot_id:
            return
        if agent_id not in resume.before:
            return
        for goal in self._core.index.goals_of(agent_id):
            if goal.in_flight and not goal.cancel_asked and goal.section == "steps":
                self._goals.interrupt(goal.id, "in_doubt")
                self._hold(agent, FoundMachine("was started anew"))

    def after_input(self, given: inp.Input) -> None:
        """Look at what an input has changed, before trees see it."""
        core = self._core
        resume = core.state.resume
        assert resume is not None
        for agent_id in [one for one in resume.unheard if core.state.agents[one].present]:
            self._call_off(agent_id)
        for agent_id, was in list(resume.before.items()):
            self._compare(core.state.agents[agent_id], was)
        self._put(waits=tuple(one for one in self._resume.waits if not self._has_reported(one, given)))
        if isinstance(given, inp.EffectFailed) and given.what == "query" and given.agent in self._resume.waits:
            core.set_wall(AskDue(given.agent), ASK_AGAIN_US)
        if self._resume.phase == "asking" and not self._resume.waits:
            self._asked_enough()

    @property
    def _resume(self) -> Resuming:
        resume = self._core.state.resume
        assert resume is not None
        return resume

    def _put(self, **fields: object) -> None:
        new = replace(self._resume, **fields)
        if new != self._resume:
            self._core.emit(ch.ResumePut(new))

    def _has_reported(self, agent_id: str, given: inp.Input) -> bool:
        if isinstance(given, inp.QueryReplyInput) and given.agent == agent_id:
            return True
        agent = self._core.state.agents[agent_id]
        return agent.liveness == "LOST" or not any(g.in_flight for g in self._core.index.goals_of(agent_id))

    def _call_off(self, agent_id: str) -> None:
        """Send cancels again that an agent may never have got."""
        core, resume = self._core, self._resume
        mine = [one for one in resume.cancels if one[0] == agent_id and one[1] not in core.state.goals]
        for _, goal_id, action in mine:
            core.effect(inp.CancelGoal(goal_id, agent_id, action))
        for goal in core.index.goals_of(agent_id):
            if goal.state == "canceling":
                core.effect(inp.CancelGoal(goal.id, agent_id, goal.action))
        self._put(
            unheard=tuple(one for one in resume.unheard if one != agent_id),
            cancels=tuple(one for one in resume.cancels if one[0] != agent_id),
        )

    def _compare(self, agent: AgentRecord, was: Before) -> None:
        """Hold the task of a machine that is not as it was left, once it has told how it is."""
        gone = not self._is_commanded(agent) or agent.liveness == "LOST"
        if not gone and (agent.boot_id, agent.seq) == (was.boot_id, was.seq):
            return  # not heard of yet
        if not gone and agent.seq < 0:
            return  # a new process that has announced itself, and told nothing yet
        self._put(before={one: its for one, its in self._resume.before.items() if one != agent.id})
        self._core.stale.add(agent.id)
        change = "" if gone else self._change(agent, was)
        if change:
            self._hold(agent, FoundMachine(change, flew="airborne" in was.landed and "grounded" not in was.landed))

    def _change(self, agent: AgentRecord, was: Before) -> str:
        if agent.control != was.control:
            return f"came under the control of {agent.control}"
        if agent.landed not in was.landed:
            return "took off" if agent.landed == "airborne" else "landed"
        if was.position is None or agent.position is None:
            return ""
        if self._port_of(agent) != was.port:
            return "was moved to another place"
        return "was moved" if horizontal_m(agent.position, was.position) > MOVED_M else ""

    def _hold(self, agent: AgentRecord, found: FoundMachine) -> None:
        core = self._core
        task = core.state.tasks.get(agent.task)
        if task is None or not self._may_hold(task):
            return
        told = MARKS in task.hold.causes
        hold(core, task.id, MARKS)
        task = core.put_part(task.id, "hold", found={**task.hold.found, agent.id: found})
        if not told:
            text = f"{agent.id} {found.change} while the engine was away; {task.id} waits: {self._way_on(task)}"
            core.effect(inp.Alarm("held_by_resume", text, task.id, agent.id))

    def _way_on(self, task: TaskRecord) -> str:
        core = self._core
        agents = core.state.agents.values()
        machines = [a for a in agents if not a.human and (a.task == task.id or a.id == task.system.agent)]
        return way_on(core.state, task, machines, core.action)

    # -- from phase to phase -----------------------------------------------------------------------------------------
    def on_wall(self, due: ResumeDue | AskDue) -> None:
        """Wait for nobody any longer, or ask anew what did not get through."""
        core = self._core
        core.set_wall(due, None)
        resume = core.state.resume
        if resume is None:
            return
        if isinstance(due, ResumeDue):
            if resume.phase == "asking":
                self._asked_enough()
        elif due.agent in resume.waits:
            goals = tuple(goal.id for goal in core.index.goals_of(due.agent) if goal.in_flight)
            core.effect(inp.QueryGoal(due.agent, goals))

    def _asked_enough(self) -> None:
        self._core.set_wall(ResumeDue(), None)
        self._put(phase="overdue", until=self._core.now)

    def proceed(self) -> bool:
        """At the end of a step: go on to the next phase; return whether something may happen now that could not before."""
        core, resume = self._core, self._resume
        if resume.phase == "overdue":
            due = core.next_deadline()
            if due is not None and due[0] <= resume.until:
                return False
            self._put(phase="watching")
            core.stale.add(EVERYTHING)
            self._tell()
            if not self._is_over:
                return True
            core.emit(ch.ResumePut(None))
            return True
        if resume.phase == "watching" and self._is_over:
            core.emit(ch.ResumePut(None))
        return False

    @property
    def _is_over(self) -> bool:
        resume = self._resume
        return not resume.before and not resume.waits and not resume.cancels

    def _tell(self) -> None:
        core, resume = self._core, self._resume
        mine = [core.task(one) for one in core.open]
        going = [task.id for task in mine if not task.hold.causes]
        held = [task for task in mine if MARKS in task.hold.causes]
        if not mine:
            return
        parts = [f"{', '.join(going)} {'goes' if len(going) == 1 else 'go'} on"] if going else []
        parts += [f"{task.id} HELD ({self._way_on(task)})" for task in held[:5]]
        if len(held) > 5:
            parts.append(f"{len(held) - 5} more HELD (formiga tasks --status held)")
        silent = [one for one in resume.waits if not core.state.agents[one].present]
        quiet = f"; not heard of: {', '.join(silent)}" if silent else ""
        word = "on after a standstill of" if resume.stood else "resumed after"
        text = f"{word} {resume.outage_us / SECOND:.1f} s: {'; '.join(parts) or 'nothing goes on'}{quiet}"
        core.effect(inp.NotifyPeople(text, tuple(core.site.people.get("watchers", ())), "info"))


def _cancels(given: inp.Resumed) -> tuple[tuple[str, str, str], ...]:
    return tuple((one.agent, one.goal_id, one.action) for one in given.again if isinstance(one, inp.CancelGoal))


def _boot_of(given: inp.Input) -> tuple[str, str]:
    match given:
        case inp.AgentSeenInput(card):
            return card.id, card.boot_id
        case inp.AgentStatusInput(status):
            return status.id, status.boot_id
        case inp.GoalEventInput(event) if event.status is not None:
            return event.agent, event.status.boot_id
        case inp.QueryReplyInput(agent, boot_id):
            return agent, boot_id
    return "", ""
