"""The watcher of a virtual run: what the safety layer promises, judged from outside the engine.

It sees each `Step` with the state before and after it (folded here, by `engine.state.fold` alone), the messages that came
in, and the drones' own truth (`sky`). It shares no rule with the engine: what an agent was told to be, who handed whom back,
when lockdown was pressed, who said "clear" are all read again from the inputs.

    world = Rehearsal(site, catalogue, tasks, ())
    monitor = Monitor(world)                before any agent is added, so that every motion is seen
    monitor.add(spec); ...; world.run_for(100); monitor.finish(); monitor.violations

Rules are named in `RULES`; docs: safety.
"""

from collections import Counter
from typing import Any, Final

from msgspec import Struct

from agents_sim.drone import Drone
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, StandingOrder, TaskRecord
from formiga_bt.engine.kernel.replies import Done, Refusal
from formiga_bt.engine.kernel.state import EngineState, fold, snapshot
from formiga_bt.engine.kernel.timers import HomeOverdue
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.transport.messages import TERMINAL, AgentStatus, GoalEvent
from tests.safety.sky import AT_PORT_M, WORD_LASTS_US, Sky

RULES: Final = {
    "control": "nothing but queries goes to a machine that a pilot or its failsafe has, or that nobody handed back",
    "clearance": "no rotor start and no landing away from ports without a fresh word for that machine",
    "reboot": "nothing but a landing goes to a machine that was started anew and stands, before a word or a new task",
    "release": "no machine leaves its task in the air, but quarantined or to a system task",
    "reserve": "no goal of a task leaves a machine with less than the way home and the reserve",
    "breach": "a machine below its reserve is ordered home, or its task ends, at once",
    "lockdown": "no admission, no grant, no goal of steps or cleanup while lockdown stands",
    "held": "no goal of the steps of a held task",
    "ordered": "nothing but its own goals goes to a machine on which an order stands",
    "order": "an order on a machine that can be reached leads to what it says",
    "lockdown_order": "lockdown orders every machine in the air",
    "separation": "machines of different tasks in the air stay apart",
    "crash": "the referee saw no crash, no unsafe start, no low flight",
    "left": "no machine stays in the air without a task, an order or a quarantine",
    "twice": "no goal is sent or begun twice",
    "two_tasks": "no machine works for two tasks",
    "keep_in": "no goal of a task leads out of the fence",
    "keep_out": "no goal of a task leads into a closed area",
    "max_height": "no goal of a task leads above the ceiling",
    "hang": "every task ends, or waits for something that has a name",
    "fold": "the folded steps give the live state",
    "rest": "after the calm everything is on the ground, or quarantined with an alarm",
    "exception": "the engine raises nothing, no task ends by an exception or runs away",
}

TASK_SECTIONS: Final = ("steps", "on_failure", "on_abort", "finally")
LOOK_US: Micros = SECOND
LEFT_US: Micros = 10 * SECOND
HANG_US: Micros = 60 * SECOND
ORDER_US: Final[dict[str, Micros]] = {
    "hold": 45 * SECOND, "return": 900 * SECOND, "land": 600 * SECOND, "cut": 20 * SECOND
}  # fmt: skip
"""So long an order may take on a machine that can be reached and is under the engine's control."""
IDLE_US: Micros = 15 * SECOND
"""So long an open order may stand with no goal that carries it out, sent or waiting at the gate."""
PRESSED_US: Micros = 10 * SECOND
BREACH_US: Micros = 2 * SECOND
"""From a status that shows the breach to what is done about it."""
SLACK_PCT: Final = 3.0
"""Charge: simulated drones drain a little differently than the catalogue says."""
WORD_AT_M: Final = 25.0
"""A word is for the place where the machine was when it was given; it is asked for there, 10 m from a landing spot."""


class Violation(Struct, frozen=True):
    """A promise was broken."""

    at: float
    """Seconds since the start of the run."""
    rule: str
    text: str

    def __str__(self) -> str:
        return f"{self.at:9.3f} s  {self.rule}: {self.text}"


class _Mute(Blackboard):
    """Nobody reads the folded state's blackboard."""

    def put(self, key: str, value: Any) -> bool:
        return False

    def touch(self, key: str) -> None:
        pass


class _Told(Struct):
    """What a machine last said of itself."""

    control: str = "unknown"
    boot: str = ""
    seq: int = -1
    stamp: Micros = 0
    taken: bool = False
    anew: bool = False
    """Its process was started anew, and since then it has not said that it flies, nor has anybody cleared it."""


class Monitor:
    """Watches one `Rehearsal` that has no agents yet."""

    def __init__(self, world: Rehearsal, *, at_once: bool = False) -> None:
        self.world = world
        self.site, self.catalogue = world.engine.core.site, world.engine.core.catalogue
        self.start = world.now
        self.violations: list[Violation] = []
        self.at_once = at_once
        """Raise at the first violation."""
        self.counts: Counter[str] = Counter()
        self.disturbed: set[str] = set()
        """Machines whose charge or wind was meddled with: their goals may end below the reserve, if a breach follows."""
        self.state = EngineState()
        self.sky = Sky(world.referee, self.site, self.catalogue, self.tell, lambda: world.now)
        world.sim._recorder = self.sky
        self._board = _Mute()
        self._told: dict[str, _Told] = {}
        self._asked: dict[str, Question] = {}
        """The questions before the step."""
        self._words: list[tuple[str, str, Micros, Place]] = []
        """Who said that people stand clear of which machine, when, and where it was."""
        self._sent: dict[str, str] = {}
        """Goal -> `sent`, or `again` when its agent never had it."""
        self._pressed: Micros | None = None
        self._since: dict[tuple[str, str], Micros] = {}
        """Since when something lasts that may not last long: (what, who)."""
        self._looked: Micros = 0
        self._alarmed: set[str] = set()
        self._silent: dict[str, tuple[Micros, TaskRecord]] = {}
        self._twice: set[tuple[str, str]] = set()
        for step in world.steps:
            fold(self.state, self._board, step)
        world.driver.listeners.append(self.step)

    # -- the world -----------------------------------------------------------------------------------------------------
    def add(self, spec: AgentSpec) -> None:
        """Add an agent to the run."""
        self.sky.watch(self.world.sim.add(spec))

    def tell(self, rule: str, text: str) -> None:
        """Note a violation."""
        assert rule in RULES, rule
        found = Violation((self.world.now - self.start) / SECOND, rule, text)
        self.violations.append(found)
        if self.at_once:
            raise AssertionError(str(found))

    def drone(self, agent: str) -> Drone | None:
        """Return the body of a machine."""
        one = self.world.sim.agents.get(agent)
        return one.body if one is not None and isinstance(one.body, Drone) else None

    # -- each step -----------------------------------------------------------------------------------------------------
    def step(self, step: inp.EngineStep) -> None:
        """Judge one step."""
        state = self.state
        agents, goals, tasks, orders = dict(state.agents), dict(state.goals), dict(state.tasks), dict(state.orders)
        self._asked = dict(state.questions)
        fold(state, self._board, step)
        moved = False
        self._hear(step)
        for change in step.changes:
            if isinstance(change, ch.Granted) and not state.tasks[change.task].system.agent:
                for agent in (one for group in change.roles.values() for one in group):
                    self._told.setdefault(agent, _Told()).anew = False
        for effect in step.effects:
            match effect:
                case inp.SendGoal():
                    self._send(step, effect, tasks, orders)
                case inp.CancelGoal(goal_id, agent):
                    self._command(agent, f"cancel of {goal_id}")
                case inp.Alarm(code, _, _, agent):
                    self.counts[f"alarm {code}"] += 1
                    self._alarmed.add(agent)
        for change in step.changes:
            self._change(change, agents, tasks)
            moved = moved or (
                type(change) is ch.AgentPut and _belongs(change.agent) != _belongs(agents.get(change.agent.id))
            )
        self._ends(step, goals)
        if moved or step.at - self._looked >= LOOK_US:
            self._look(step.at)

    def _change(self, change: ch.Change, agents: dict[str, AgentRecord], tasks: dict[str, TaskRecord]) -> None:
        state = self.state
        match change:
            case ch.AgentPut(agent):
                before, after = agents.get(agent.id), state.agents[agent.id]
                if before is not None and before.task and after.task != before.task and not agent.human:
                    self._released(before, after)
            case ch.Granted(task_id, roles, _) if not state.tasks[task_id].system.agent:
                if self._pressed is not None:
                    self.tell("lockdown", f"{task_id} is granted {sorted(roles)} in lockdown")
            case ch.TaskPut(task):
                if task.id not in tasks and not task.system.agent:
                    if self._pressed is not None:
                        self.tell("lockdown", f"{task.id} is admitted in lockdown")
                    model = self.world.engine.core.models.get(task.name)
                    ceiling = model.envelope.get("max_height_m") if model is not None else None
                    if ceiling is not None:
                        self.sky.ceilings[task.id] = ceiling
                if task.outcome.code in ("cannot_compute", "exception", "runaway") and task.outcome.code != getattr(
                    tasks.get(task.id), "code", ""
                ):
                    self.tell("exception", f"{task.id} ends {task.outcome.code}: {task.outcome.reason}")

    # -- what came in --------------------------------------------------------------------------------------------------
    def _hear(self, step: inp.EngineStep) -> None:
        given = step.input
        match given:
            case inp.AgentSeenInput(card):
                told = self._told.setdefault(card.id, _Told())
                if told.boot and told.boot != card.boot_id:
                    told.boot, told.seq, told.anew = card.boot_id, -1, True
                if card.mobility == "people":  # an app that starts anew has forgotten what it showed
                    forgotten = [goal for goal in self._sent if goal.partition("#")[0].endswith(f"~{card.id}")]
                    self._sent.update(dict.fromkeys(forgotten, "again"))
            case inp.AgentStatusInput(status):
                self._status(status)
            case inp.GoalEventInput(event):
                self._event(step, event)
            case inp.QueryReplyInput(_, _, events):
                for event in events:
                    self._event(step, event)
            case inp.EffectFailed(_, "goal", goal_id, "unreachable") if goal_id in self._sent:
                self._sent[goal_id] = "again"
            case inp.Operator(order, target) if step.reply == Done() and order.startswith("handback"):
                self._told[target].taken = False
            case inp.Operator("clear", target) if step.reply == Done():
                self._told[target].anew = False
            case inp.LockdownOrder(how) if step.reply == Done():
                self._pressed = None if how == "release" else step.at
        if isinstance(given, inp.Operator | inp.LockdownOrder | inp.Abort | inp.Submit):
            kind = getattr(given, "order", None) or getattr(given, "how", "") or type(given).__name__.lower()
            self.counts[f"{'refused' if isinstance(step.reply, Refusal) else 'order'} {kind}"] += 1

    def _status(self, status: AgentStatus) -> None:
        told = self._told.setdefault(status.id, _Told())
        record = self.state.agents.get(status.id)
        if record is None or record.human or record.stamp < status.stamp:
            return  # not a machine of ours, or the engine did not believe it
        if told.boot and status.boot_id != told.boot:
            if status.stamp < told.stamp:
                return
        elif status.seq <= told.seq:
            return
        if told.control == "engine" and status.control != "engine":
            told.taken = True
            self.counts["taken over"] += 1
        told.anew = told.anew or bool(told.boot and status.boot_id != told.boot)
        if status.landed == "airborne" and status.control == "engine":
            told.anew = False
        told.control, told.boot, told.seq, told.stamp = status.control, status.boot_id, status.seq, status.stamp
        self._charge(status, record)

    def _event(self, step: inp.EngineStep, event: GoalEvent) -> None:
        if event.status is not None:
            self._status(event.status)
        if event.state == "unknown" and event.goal_id in self._sent:
            self._sent[event.goal_id] = "again"
        if event.state == "succeeded" and "answer" in event.result:
            self._answer(step, event)

    def _answer(self, step: inp.EngineStep, event: GoalEvent) -> None:
        said = str(event.result["answer"])
        question = event.goal_id.partition("~")[0]
        if question.startswith("clear/"):
            agent, ok = question.split("/")[1], said == "clear"
        else:
            record = self._asked.get(question)
            agent, ok = (record.clears, said in record.clears_on) if record is not None else ("", False)
        where = self.state.agents[agent].position if agent in self.state.agents else None
        if ok and where is not None:
            self._words.append((event.agent, agent, step.at, where.ground))

    # -- what goes out -------------------------------------------------------------------------------------------------
    def _command(self, agent: str, what: str) -> None:
        record = self.state.agents.get(agent)
        if record is None or record.human:
            return
        told = self._told.setdefault(agent, _Told())
        if told.control != "engine":
            self.tell("control", f"{what} to {agent}, which is under the control of {told.control}")
        elif told.taken:
            self.tell("control", f"{what} to {agent}, which nobody has handed back")

    def _send(
        self, step: inp.EngineStep, goal: inp.SendGoal, tasks: dict[str, TaskRecord], orders: dict[str, StandingOrder]
    ) -> None:
        self._command(goal.agent, goal.goal_id)
        if self._sent.get(goal.goal_id) == "sent":
            self.tell("twice", f"{goal.goal_id} is sent again though its agent may have it")
        self._sent[goal.goal_id] = "sent"
        self.counts["goals"] += 1
        section, machine = section_of(goal.goal_id), not self.state.agents[goal.agent].human
        if section in TASK_SECTIONS and self._pressed is not None and goal.action != "Confirm":
            self.tell("lockdown", f"{goal.goal_id} goes to {goal.agent} in lockdown")
        if not machine:
            return
        if self._told.setdefault(goal.agent, _Told()).anew and not self._is_exempt(goal):
            self.tell(
                "reboot", f"{goal.goal_id} ({goal.action}) goes to {goal.agent}, which was started anew and stands"
            )
        before, after = tasks.get(goal.task), self.state.tasks.get(goal.task)
        if section == "steps" and not goal.safety and before is not None and after is not None:
            causes = [c for c in after.hold.words if c in before.hold.words and not c.startswith("clearance:")]
            if causes:
                self.tell(
                    "held", f"{goal.goal_id} goes to {goal.agent} while {goal.task} is held ({', '.join(causes)})"
                )
        self._under_order(goal, orders.get(goal.agent), self.state.orders.get(goal.agent), section)
        self._cleared(step.at, goal)

    def _under_order(
        self, goal: inp.SendGoal, before: StandingOrder | None, after: StandingOrder | None, section: str
    ) -> None:
        if before is None or after is None or goal.safety or goal.task == after.task:
            return
        if after.state == "failed" or (after.stop == "return" and section == "recover"):
            return
        self.tell("ordered", f"{goal.goal_id} goes to {goal.agent} under the order {after.stop} of {after.scope}")

    def _cleared(self, now: Micros, goal: inp.SendGoal) -> None:
        spec, agent = self.catalogue.actions[goal.action], self.state.agents[goal.agent]
        if not (spec.starts_rotors or spec.lands) or self._is_exempt(goal):
            return
        at = goal.fields.get(spec.moves_to) if spec.lands else None
        here = agent.position
        spot = Place(at["east_m"], at["north_m"]) if at else (here.ground if here is not None else None)
        if spot is not None and any(horizontal_m(p.at, spot) < AT_PORT_M for p in self.site.ports.values()):
            return
        fresh = [
            one for one in self._words
            if one[1] == goal.agent and now - one[2] <= WORD_LASTS_US and spot and horizontal_m(one[3], spot) <= WORD_AT_M
        ]  # fmt: skip
        verb = "lands" if spec.lands else "starts"
        if not fresh:
            self.tell("clearance", f"{goal.agent} {verb} away from ports at {spot} with nobody's fresh word")
        elif goal.clearance is None or now - goal.clearance.at > WORD_LASTS_US:
            self.tell("clearance", f"{goal.agent} {verb} away from ports and its goal carries no fresh word")

    def _is_exempt(self, goal: inp.SendGoal) -> bool:
        order, task = self.state.orders.get(goal.agent), self.state.tasks.get(goal.task)
        ordered = order is not None and order.stop in ("land", "cut")
        return goal.safety and (ordered or (task is not None and task.system.stop in ("land", "cut")))

    # -- what changed --------------------------------------------------------------------------------------------------
    def _released(self, before: AgentRecord, after: AgentRecord) -> None:
        if after.pool == "QUARANTINED":
            return
        new = self.state.tasks.get(after.task)
        order = self.state.orders.get(after.id)
        if new is not None and new.system.agent == after.id:
            return
        if order is not None and order.state == "open" and order.stop in ("return", "land"):
            return  # an order brings it down, by a system task
        drone = self.drone(after.id)
        truly = drone is not None and drone.is_airborne and drone.state().control == "engine"
        if after.landed != "grounded" or truly:
            what = f"says {after.landed}" + (", and is in the air" if truly else "")
            self.tell("release", f"{after.id} is released from {before.task} and {what}")

    # -- charge --------------------------------------------------------------------------------------------------------
    def _short(self, agent: AgentRecord, position: Position, battery: float, airborne: bool) -> float:
        """Return by how much the charge is below reserve and straight way home (negative: it is enough)."""
        limits = self.catalogue.types[agent.type].limits
        home = self.site.ports.get(agent.home)
        if home is None or not limits.get("cruise_drain_pct_s"):
            return -100.0
        over_m = horizontal_m(position, home.at)
        up_m = position.up_m if airborne else (agent.layer_m or 0.0) * 2
        seconds = over_m / limits.get("speed_m_s", 10.0) + up_m / limits.get("climb_m_s", 3.0)
        reserve = max(limits.get("reserve_pct", 25.0), self.site.envelope.get("reserve_pct", 0.0))
        return reserve + seconds * limits["cruise_drain_pct_s"] - battery

    def _ends(self, step: inp.EngineStep, goals: dict[str, GoalRecord]) -> None:
        match step.input:
            case inp.GoalEventInput(event) if event.state in TERMINAL and event.state != "rejected":
                goal = goals.get(event.goal_id)
            case _:
                return
        drone = self.drone(goal.agent) if goal is not None else None
        if goal is None or drone is None or goal.safety or goal.section not in TASK_SECTIONS:
            return
        if goal.agent in self.disturbed or goal.cancel_asked or event.state != "succeeded" or not drone.is_airborne:
            return
        short = self._short(self.state.agents[goal.agent], drone.position(), drone.battery(), True)
        if short > SLACK_PCT:
            text = f"{goal.agent} ends {goal.id} with {drone.battery():.1f} %, {short:.1f} % less than home and reserve need"
            self.tell("reserve", text)

    def _charge(self, status: AgentStatus, agent: AgentRecord) -> None:
        low = (
            status.position is not None and status.landed == "airborne" and status.control == "engine"
            and self._short(agent, status.position, status.battery, True) > SLACK_PCT
        )  # fmt: skip
        self._lasts("low", status.id, low)

    # -- from time to time ---------------------------------------------------------------------------------------------
    def _look(self, now: Micros) -> None:
        self._looked = now
        state = self.state
        groups = {}
        for agent in state.agents.values():
            drone = None if agent.human else self.drone(agent.id)
            if drone is not None:
                theirs = drone.state().control != "engine" or agent.control != "engine"
                groups[agent.id] = "-" if theirs else agent.task or agent.id
                self._look_at(now, agent, drone)
        self.sky.regroup(groups)
        self._two_tasks()
        self._hangs(now)

    def _look_at(self, now: Micros, agent: AgentRecord, drone: Drone) -> None:
        told = self._told.setdefault(agent.id, _Told())
        ours = told.control == "engine" and not told.taken and agent.liveness == "ALIVE" and agent.present
        ours = ours and drone.state().control == "engine"
        task, order = self.state.tasks.get(agent.task), self.state.orders.get(agent.id)
        works = task is not None and task.section not in ("", "done")
        idle = drone.is_airborne and ours and not works and order is None and agent.pool != "QUARANTINED"
        if self._lasts("left", agent.id, idle, LEFT_US):
            self.tell("left", f"{agent.id} hovers with no task, no order and no quarantine")
        may = ours and agent.pool != "QUARANTINED" and drone.is_airborne
        mended = order is not None or task is None or task.section != "steps" or task.ending.stopping
        landing = agent.action and self.catalogue.actions[agent.action].lands
        low = ("low", agent.id) in self._since and not mended and not landing
        if self._lasts("breach", agent.id, bool(may and low), BREACH_US):
            self.tell("breach", f"{agent.id} goes on with {agent.task} at {drone.battery():.1f} %")
        recovers = task is not None and task.section == "recover"
        bare = self._pressed is not None and may and order is None and not recovers
        if self._lasts("pressed", agent.id, bare, PRESSED_US):
            self.tell("lockdown_order", f"{agent.id} flies in lockdown, and nothing is ordered of it")
        self._follows(agent, drone, order, ours and agent.pool != "QUARANTINED")

    def _follows(self, agent: AgentRecord, drone: Drone, order: StandingOrder | None, ours: bool) -> None:
        if order is None or order.state == "failed" or not ours:
            for stop in ("idle", *ORDER_US):
                self._lasts(stop, agent.id, False)
            return
        kind = drone.state().kind
        reached = kind == "rest" or (order.stop == "hold" and kind == "hover")
        if order.stop == "return" and order.state != "done":
            reached = reached and self._is_home(agent, drone)
        idle = order.state == "open" and not reached and self._has_no_goal(agent)
        if self._lasts("idle", agent.id, idle, IDLE_US):
            self.tell("order", f"{agent.id} is ordered to {order.stop} by {order.scope}, and nothing is done about it")
        for stop, limit in ORDER_US.items():
            if self._lasts(stop, agent.id, stop == order.stop and not reached, limit):
                self.tell("order", f"{agent.id} does not {stop} ({order.state}, by {order.scope}), but has a {kind}")

    def _has_no_goal(self, agent: AgentRecord) -> bool:
        waits = ("gated", "sent", "accepted", "running", "canceling")
        return not any(g.agent == agent.id and g.state in waits for g in self.state.goals.values())

    def _is_home(self, agent: AgentRecord, drone: Drone) -> bool:
        home = self.site.ports.get(agent.home)
        return home is not None and horizontal_m(home.at, drone.position()) <= AT_PORT_M

    def _lasts(self, what: str, who: str, so: bool, limit: Micros | None = None) -> bool:
        """Note since when something is so; return once whether it is so for too long."""
        key = (what, who)
        if not so:
            self._since.pop(key, None)
            return False
        now = self.world.now
        since = self._since.setdefault(key, now)
        if limit is None or since < 0 or now - since <= limit:
            return False
        self._since[key] = -1
        return True

    def _two_tasks(self) -> None:
        holders: dict[str, str] = {}
        for task in self.state.tasks.values():
            if task.section == "done" or task.system.agent:
                continue
            for agent in (a for group in task.agents.roles.values() for a in group):
                if self.state.agents[agent].human:
                    continue
                first = holders.setdefault(agent, task.id)
                if first != task.id and (agent, task.id) not in self._twice:
                    self._twice.add((agent, task.id))
                    self.tell("two_tasks", f"{agent} is held by {first} and {task.id}")

    def _hangs(self, now: Micros) -> None:
        for task in self.state.tasks.values():
            if task.section == "done" or self.waits_for(task):
                self._silent.pop(task.id, None)
                continue
            since, record = self._silent.get(task.id, (now, task))
            if record != task:
                since = now
            self._silent[task.id] = (since, task)
            if now - since > HANG_US:
                self._silent[task.id] = (now + 10**15, task)
                self.tell("hang", f"{task.id} is {task.status} in {task.section or 'no section'} and waits for nothing")

    def waits_for(self, task: TaskRecord) -> list[str]:
        """Return the names of what a task waits for."""
        state = self.state
        found = [f"held: {cause}" for cause in task.hold.words]
        found += [
            f"goal {g.id} {g.state} {g.code}".strip() for g in state.goals.values() if g.task == task.id and not g.ended
        ]
        found += [f"question {q.number}" for q in state.questions.values() if q.task == task.id]
        found += [
            f"time {due}"
            for due, d in state.deadlines.items()
            if d.task == task.id and not isinstance(due, HomeOverdue)
        ]
        found += [f"order {o.stop} on {o.agent} {o.state}" for o in state.orders.values() if self._is_for(o, task)]
        if task.id in state.requests:
            found.append("agents")
        return found

    def _is_for(self, order: StandingOrder, task: TaskRecord) -> bool:
        return self.state.agents[order.agent].task == task.id and order.state != "failed"

    # -- the end -------------------------------------------------------------------------------------------------------
    def at_rest(self) -> None:
        """After the calm: every task has ended, every machine stands, or is quarantined and somebody was told."""
        for task in self.state.tasks.values():
            if task.section != "done":
                waits = "; ".join(self.waits_for(task)) or "nothing"
                text = f"{task.id} is still {task.status} in {task.section or 'no section'}, {task.agents.recovering}"
                self.tell("rest", f"{text}, and waits for {waits}")
        for agent in self.state.agents.values():
            drone = None if agent.human else self.drone(agent.id)
            if drone is None or not drone.is_airborne:
                continue
            if agent.pool != "QUARANTINED" or agent.id not in self._alarmed:
                self.tell(
                    "rest", f"{agent.id} is in the air: {agent.pool} {agent.task} {agent.liveness} {agent.control}"
                )

    def finish(self) -> None:
        """Judge what is judged at the end: the referee's verdict, and that the fold is the live state."""
        self.sky.judge()
        verdict = self.world.referee.verdict(self.world.now)
        if not verdict.is_clean:
            for crash in verdict.crashes:
                self.tell("crash", f"{crash.a} and {crash.b} within {crash.distance_m} m")
            for start in verdict.unsafe_starts:
                self.tell("crash", f"{start.agent} starts {start.distance_m} m from {start.person}")
            for low in verdict.low_flights:
                self.tell("crash", f"{low.agent} cruises at {low.up_m} m")
        if snapshot(self.state) != snapshot(self.world.engine.state):
            self.tell("fold", "the folded steps give another state than the live one")


def section_of(goal_id: str) -> str:
    """Return the section of a goal of a task, "" for the engine's own."""
    parts = goal_id.split("/", 3)
    if len(parts) < 4 or parts[0] in ("safety", "clear"):
        return ""
    return parts[2].split(":", 1)[0]


def _belongs(agent: AgentRecord | None) -> tuple[str, str]:
    return ("", "") if agent is None else (agent.task, agent.control)
