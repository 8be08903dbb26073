"""The engine under test: the production engine over simulated agents, killed and resumed, on a disk that fails.

    world = World(plan); world.play(); world.invariants.violations

A world outlives its engines. Whoever asks while there is none asks again later, as a client does.
"""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random
from typing import Any, Final

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from agents_sim.drone import Drone
from agents_sim.machine import Machine
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.drivers.persist import Outcome
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal, Reply
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.transport.memory import NO_FAULTS, Faults
from formiga_bt.transport.messages import GoalRequest
from tests.reloading import reloaded
from tests.simulation.ahead import AheadDriver
from tests.simulation.disk import Disk, Killed, When, bare
from tests.simulation.ground import Ground
from tests.simulation.invariants import Invariants
from tests.simulation.more import MORE_FROM
from tests.simulation.plan import Ask, Deed, Plan
from tests.simulation.rarer import Rarer
from tests.simulation.trees import task_of

PERSON: Final = "watcher_1"
STATUS_EVERY_US: Final[Micros] = 4 * SECOND
SUSPECT_US: Final[Micros] = 7 * SECOND
"""Machines tell their status less often than the shipped catalogue expects: most steps would be statuses."""
ASK_AGAIN_S: Final = 4.0
CALM_S: Final = 120.0
"""So long tasks may go on by themselves in the calm; then they are aborted."""
REST_S: Final = 1200.0
SWAPPED_PERCENT: Final = 60.0
"""In the calm people swap the batteries of machines on the ground: one that is flat stands in the way of others."""
REFUSED_FOR_NOW: Final = ("journal_full", "lockdown", "busy", "not_approved")
BACKLOG: Final = 60_000


def _patient(known: Catalogue) -> Catalogue:
    types = {
        name: kind if kind.human else replace(kind, suspect_after_us=max(kind.suspect_after_us, SUSPECT_US))
        for name, kind in known.types.items()
    }
    return replace(known, types=types)


def _unheard(given: inp.Input) -> inp.EngineStep:
    """An engine that is dead hears nothing."""
    return inp.EngineStep(0, 0, given, (), ())


class Sign(Struct, frozen=True):
    """A sign of life, as an engine gives one each second."""

    wall: Micros = 0
    at: Micros = 0
    seq: int = 0


class Keeper:
    """The `Persist` of one engine: looks at each step, keeps it, and ends the engine when it is to die."""

    def __init__(self, world: "World") -> None:
        self.world = world
        self.left = 0
        """Steps until the engine dies; 0 = it does not."""
        self.when: When = "kept"
        self.durable = True
        self.unkept: list[str] = []
        """Goals that were sent by steps that wait for room on the disk."""
        self.sign = Sign()

    def take(self, step: inp.EngineStep) -> None:
        """Take a step that is kept later (`AheadDriver`), or die."""
        self.left -= 1
        if self.left == 0 and self.when == "lost":
            raise Killed
        self.world.invariants.step(step)
        if self.left == 0:
            raise Killed

    def kept(self, steps: Sequence[inp.EngineStep], kept: Outcome) -> None:
        """Steps that were taken are kept."""
        self.durable = kept.durable
        sent = [effect.goal_id for step in steps for effect in step.effects if isinstance(effect, inp.SendGoal)]
        if kept.durable:
            self.unkept.clear()
        else:
            self.unkept += sent
        self.world.invariants.kept(sent)
        last = steps[-1]
        if last.at // SECOND != self.sign.at // SECOND:
            self.sign = Sign(self.world.wall(), last.at, last.seq)

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        """Keep a step, or die."""
        (step,) = steps
        world = self.world
        self.left -= 1
        dies = self.left == 0
        if dies and self.when == "lost":
            raise Killed
        world.invariants.step(step)
        kept = world.disk.keep(step)
        self.durable = kept.durable
        if kept.durable:
            self.unkept.clear()
        else:
            self.unkept += [effect.goal_id for effect in step.effects if isinstance(effect, inp.SendGoal)]
        if step.at // SECOND != self.sign.at // SECOND:
            self.sign = Sign(world.wall(), step.at, step.seq)
        if dies:
            raise Killed
        return kept


class World:
    """One run of a plan.

    Args:
        plan: what happens.
        story: whether `lines` tells it.
    """

    def __init__(self, plan: Plan, *, story: bool = False) -> None:
        self.plan = plan
        self.lines: list[str] = []
        self._loud = story
        models = plan.models()
        tasks = {task.name: task for task in models.values()}
        self.names = {asked: task.name for asked, task in models.items()}
        self.flight = Rehearsal(
            plan.site, _patient(plan.catalogue), tasks.values(), (), seed=plan.seed, status_every_us=STATUS_EVERY_US,
            keep_steps=False,
        )  # fmt: skip
        self.sim, self.hub, self.scheduler = self.flight.sim, self.flight.hub, self.flight.scheduler
        self._folder = tempfile.TemporaryDirectory() if plan.on_file else None
        file = Path(self._folder.name) / "ten.db" if self._folder is not None else None
        self.wall_off: Micros = 0
        backlog = BACKLOG if plan.seed % 4 == 0 else 64_000_000
        self.disk = Disk(file, lambda: self.now / SECOND, self.wall, backlog, plan.ahead)
        self.disk.take(lambda: self.flight.engine.state)
        self.invariants = Invariants(self)
        self.invariants.begin(reloaded(self.engine.state))
        self.keeper = Keeper(self)
        self.alive = True
        self._epoch = 0
        self.machines: dict[str, Machine] = {}
        self.rarer = Rarer(self)
        self.stood_until: Micros | None = None
        """When the engine's process went on after it had stood still last."""
        self._begin = self.now
        self._down: set[str] = set()
        self._frozen: set[str] = set()
        self._piloted: set[str] = set()
        self._cut: set[str] = set()
        self._death = Deed(0.0, "engine")
        self._deaths: list[int] = []
        """After how many steps each of the next engines dies."""
        self._acked: list[str] = []
        self._ahead_dice = Random(f"simulation/ahead/{plan.seed}")
        self._unanswered: dict[str, Ask] = {}
        """Tasks that were requested, until that is on disk."""
        self.blamed: set[str] = set()
        """Tasks that were said to have ended an engine."""
        self._again: tuple[Any, ...] = ()
        self._calm = False
        self._begin_driver(self.flight.driver)
        for spec in plan.specs():
            agent = self.sim.add(spec)
            if isinstance(agent.body, Machine):
                self.machines[spec.id] = agent.body
                self._watch(agent.front)
                self.rarer.watch(spec.id)
        self.ground = Ground(self) if plan.site.routes.nodes else None
        self._send = self.hub.transport.send_goal
        self.hub.transport.send_goal = self._sends  # type: ignore[method-assign]

    # -- what is told and looked at ------------------------------------------------------------------------------------
    @property
    def now(self) -> Micros:
        """Return the virtual time."""
        return self.flight.scheduler.now()

    @property
    def engine(self) -> Engine:
        """Return the engine that runs, or ran last."""
        return self.flight.engine

    def wall(self) -> Micros:
        """Return the time of day, which may jump."""
        return self.now + self.wall_off

    def name_of(self, task: str) -> str:
        """Return the name that a task has in its file."""
        return self.names.get(task) or task_of(task).name

    def tell(self, text: str) -> None:
        """Add a line to the story."""
        if self._loud:
            self.lines.append(f"{(self.now - self._begin) / SECOND:9.3f} s, step {self.invariants.steps}: {text}")

    def _tell_step(self, step: inp.EngineStep) -> None:
        match step.input:
            case inp.GoalEventInput(event) if event.state not in ("running", "accepted"):
                self.tell(f"  {event.agent}: {event.goal_id} {event.state} {event.code}".rstrip())
            case inp.Operator() | inp.LockdownOrder() | inp.Abort():
                self.tell(f"ORDER {step.input} -> {step.reply}")
            case inp.AgentGoneInput(agent):
                self.tell(f"  {agent} is gone")
        for effect in step.effects:
            match effect:
                case inp.SendGoal(goal_id, agent, action, fields):
                    self.tell(f"  -> {agent} {action} {fields} {goal_id}{' SAFETY' if effect.safety else ''}")
                case inp.CancelGoal(goal_id, agent):
                    self.tell(f"  -> {agent} cancel {goal_id}")
                case inp.QueryGoal(agent, goals):
                    self.tell(f"  -> {agent} query {goals}")
                case inp.Alarm(code, text):
                    self.tell(f"  ALARM {code}: {text}")
                case inp.PublishState(task, status, code, reason):
                    held = self.engine.state.tasks[task].hold.words
                    self.tell(f"  {task} {status} {code} {reason} {held or ''}".rstrip())

    def _watch(self, front: Any) -> None:
        start: Callable[[GoalRequest], str] = front.start

        def begin(request: GoalRequest) -> str:
            code = start(request)
            if not code:
                self.invariants.begins(request, self.sim[request.agent].boots)
                if self.ground is not None:
                    self.ground.begins(request)
            return code

        front.start = begin

    def _sends(self, request: GoalRequest) -> None:
        if not (self.keeper.durable or self.disk.level == "full"):
            self.invariants.tell("durable", f"{request.goal_id} leaves before its step is kept")
        self._send(request)

    # -- the engine's lives --------------------------------------------------------------------------------------------
    def _begin_driver(self, driver: VirtualDriver) -> None:
        driver._persist = self.keeper
        if self.plan.ahead:
            AheadDriver.begin(driver, self, self._ahead_dice)
        if self._loud:
            driver.listeners.append(self._tell_step)

    def run_until(self, done: Callable[[], bool], limit_s: float) -> bool:
        """Run, over all deaths of engines, until something is so, or so long."""
        limit = self.now + round(limit_s * SECOND)
        while True:
            try:
                return self.flight.driver.run_until(done, limit)
            except Killed:
                self._live_again()

    def run_for(self, seconds: float) -> None:
        """Let time pass."""
        limit = self.now + round(seconds * SECOND)
        self.run_until(lambda: False, seconds)
        if self.now < limit:
            self.scheduler.advance_to(limit)

    def _live_again(self) -> None:
        """The engine is dead: after a while there is another one, which may die again."""
        deaths = self._deaths
        while True:
            self._die()
            self._be_away(self._death.away_s)
            self.keeper.left = deaths.pop(0) if deaths else 0
            try:
                self._resume()
            except Killed:
                continue
            return

    def _die(self) -> None:
        self.invariants.counts["engine killed"] += 1
        self.tell(f"ENGINE KILLED, the last step is {self.keeper.when}")
        disk = self.disk
        driver = self.flight.driver
        if self.keeper.when == "kept":
            self.invariants.fold()
        if isinstance(driver, AheadDriver):
            driver.die(kept=self.keeper.when == "kept")
        elif self.keeper.when == "kept":
            self._compare()
        lost, self._unanswered = list(self._unanswered.values()), {}
        for ask in lost:
            self.scheduler.call_at(self.now + round(ASK_AGAIN_S * SECOND), lambda ask=ask: self.ask(ask))  # type: ignore[misc]
        if disk.waits:
            self.invariants.counts["killed with unkept steps"] += 1
        self.invariants.forgotten.update(self.keeper.unkept)
        self.keeper.unkept.clear()
        self.alive = False
        self.flight.driver.feed = _unheard  # type: ignore[method-assign]  # nothing that it meant to do comes about
        self.flight.driver.close()
        disk.close()

    def _compare(self) -> None:
        """Read the journal, as somebody would that the engine does not know of."""
        if self.disk.waits or not self.keeper.durable:
            return
        found, _ = self.disk.found()
        if bare(found) != bare(self.disk.expected(self.engine.state)):
            self.invariants.tell("journal", "what is read from the journal is not the state that was kept", "journal")

    def _be_away(self, seconds: float) -> None:
        limit = self.now + round(seconds * SECOND)
        while (at := self.scheduler.next_time()) is not None and at <= limit:
            self.scheduler.run_next()
        self.scheduler.advance_to(limit)

    def _resume(self) -> None:
        disk, now, sign = self.disk, self.now, self.keeper.sign
        state, tail = disk.found()
        last = disk.journal.last() if disk.memory is not None else (state.seq, state.now)
        wall = tail[-1].wall if tail else 0
        heard = max((agent.heard_at for agent in state.agents.values()), default=0)
        if sign.wall < wall:
            sign = Sign(wall, max(last[1], heard, sign.at + wall - sign.wall), sign.seq)
        state.seq = max(state.seq, last[0], sign.seq) + 1
        state.now = min(max(state.now, last[1], heard), now)
        at = min(max(sign.at, state.now), now)
        again = [
            e
            for kept in tail
            for e in kept.step.effects
            if isinstance(e, inp.CancelGoal | inp.NotifyPeople | inp.Alarm)
        ]
        self._check_known(state)
        flight, old = self.flight, self.flight.engine.core
        flight.engine = Engine(old.site, old.catalogue, dict(old.models), state=state, resumes=True)
        disk.take(lambda: flight.engine.state)
        self.keeper.durable = True
        self.invariants.begin(reloaded(state))
        flight.driver = VirtualDriver(flight.engine, [self.hub.transport], self.scheduler)
        self._begin_driver(flight.driver)
        self.alive = True
        self.tell(f"ENGINE RESUMES from step {state.seq}")
        # The journal has the epoch when the engine takes it, also if the first step of that engine is lost.
        self._epoch = max(self._epoch, state.epoch, self.rarer.rival) + 1
        flight.driver.feed(
            inp.Resumed(
                epoch=self._epoch, at=at, since=sign.wall, wall=self.wall(), heard=now,
                again=tuple(again),
                rebuilt={
                    t.id: t.request.bundle
                    for t in state.tasks.values() if t.section != "done" and t.request.bundle != "system"
                },
                lost=flight.engine.unbuilt, poison=self._blamed(state),
            )
        )  # fmt: skip
        self.rarer.rival = 0
        flight.driver._publish_clock()

    def _blamed(self, state: EngineState) -> tuple[str, ...]:
        """Return the task that is said to have ended the engine."""
        runs = [task.id for task in state.tasks.values() if task.section not in ("", "done")]
        which, self._death = self._death.blames, msgspec.structs.replace(self._death, blames=0)
        cleanups = [task for task in runs if any(not one.ended for one in state.tasks[task].ending.cleanups)]
        runs = cleanups or runs
        found = (runs[which % len(runs)],) if which and runs else ()
        self.blamed.update(found)
        return found

    def die_now(self) -> None:
        """Let the engine die with its next step."""
        self._death, self._deaths = Deed(0.0, "engine", how="kept", away_s=3.0), []
        self.keeper.left, self.keeper.when = 1, "kept"

    def _check_known(self, state: EngineState) -> None:
        missing = [task for task in self._acked if task not in state.tasks]
        if missing:
            self.invariants.tell(
                "forgotten", f"{', '.join(missing)} was promised to a client, and is not known any more"
            )

    # -- people --------------------------------------------------------------------------------------------------------
    def order(self, given: inp.Input) -> Reply | None:
        """Give an order; return the reply, None if there is no engine."""
        return self.flight.driver.feed(given).reply if self.alive else None

    def ask(self, ask: Ask) -> None:
        """Request a task; ask again if nobody is there, or not now."""
        self.tell(f"SUBMIT {ask.task} {ask.params} {ask.priority or ''}")
        reply = self.order(inp.Submit(self.name_of(ask.task), dict(ask.params), ask.priority, PERSON))
        if isinstance(reply, Accepted):
            if self.plan.ahead:
                self._unanswered[reply.task] = ask
            elif self.keeper.durable:
                self._acked.append(reply.task)
            else:  # as the driver does it: the request is taken back
                self.order(inp.Abort(reply.task, "", "engine", "journal_full"))
            return
        code = reply.code if isinstance(reply, Refusal) else "nobody"
        self.invariants.counts[f"refused {code}"] += 1
        if not reply or code in REFUSED_FOR_NOW:
            self.scheduler.call_at(self.now + round(ASK_AGAIN_S * SECOND), lambda: self.ask(ask))

    def release(self, step: inp.EngineStep) -> None:
        """Answer who requested a task by a step that is kept, or not (`AheadDriver`)."""
        reply = step.reply
        if not isinstance(reply, Accepted) or self._unanswered.pop(reply.task, None) is None:
            return
        if self.keeper.durable:
            self._acked.append(reply.task)
        else:
            self.scheduler.call_at(self.now + 1, lambda: self._take_back(reply.task))

    def _take_back(self, task: str) -> None:
        if self.alive:
            self.order(inp.Abort(task, "", "engine", "journal_full"))

    def do(self, deed: Deed) -> None:
        """Let one thing happen."""
        if self._calm:
            return
        self.tell(f"DEED {deed}")
        self.invariants.counts[f"deed {deed.what}"] += 1
        who, sim = deed.whom, self.sim
        match deed.what:
            case "order":
                target = self._target(who)
                if target is not None:
                    self.order(inp.Operator(deed.how, target, PERSON))  # type: ignore[arg-type]
            case "handback":
                self.order(inp.Operator(f"handback_{deed.how}", who, PERSON))  # type: ignore[arg-type]
            case "clear":
                self.order(inp.Operator("clear", who, PERSON))
            case "lockdown":
                self.order(inp.LockdownOrder(deed.how, PERSON))  # type: ignore[arg-type]
            case "abort":
                target = self._target(who)
                if target:
                    self.order(inp.Abort(target, deed.how, PERSON))  # type: ignore[arg-type]
            case "engine" if self.alive:
                self._death, self._deaths = deed, list(deed.again)
                self.keeper.left, self.keeper.when = round(deed.much), deed.how  # type: ignore[assignment]
            case "disk_full" | "disk_slow" | "disk_ok":
                self._disk(deed.what)
            case "wall":
                self.wall_off += round(deed.much * SECOND)
            case "wire" | "wire_off" | "slow" | "slow_off":
                self._wire(deed)
            case "standstill" if self.alive:
                self._stand_still(deed.much)
            case "crash" if who not in self._down:
                self._down.add(who)
                self._frozen.discard(who)
                sim.kill(who)
            case "rejoin" if who in self._down:
                self._down.discard(who)
                sim.restart(who)
            case "freeze" if who not in self._down:
                self._frozen.add(who)
                sim.freeze(who)
            case "thaw" if who in self._frozen:
                self._frozen.discard(who)
                sim.thaw(who)
            case _:
                self._trouble(deed)
        self.rarer.do(deed)

    def is_troubled(self, agent: str) -> bool:
        """Return whether the engine may not hear an agent now, or not do anything for it."""
        hub = self.hub
        late = hub._own_faults.get(agent, NO_FAULTS) != NO_FAULTS or hub._delay(agent) != hub.delay_us
        return not self.alive or late or agent in self._down | self._frozen | self._cut

    def _stand_still(self, seconds: float) -> None:
        """The engine's process does nothing for so long; orders come when it goes on."""
        self.alive = False
        try:
            self.stood_until = self.now + round(seconds * SECOND)
            self.flight.driver.stand_still(round(seconds * SECOND), self.wall)
        finally:
            self.alive = True

    def _trouble(self, deed: Deed) -> None:
        who, sim = deed.whom, self.sim
        match deed.what:
            case "cut_off":
                self._cut.add(who)
                sim.lose_link(who)
            case "join":
                self._cut.discard(who)
                sim.mend_link(who)
            case "pilot":
                self._piloted.add(who)
                sim.take_over(who)
            case "pilot_off" if who in self._piloted:
                self._piloted.discard(who)
                sim.hand_back(who)
            case "refuse" if who not in self._down:
                sim.refuse_next(who, count=int(deed.much))
            case "lose":
                sim.lose_next_result(who, int(deed.much))
            case "nan" if who not in self._down:
                sim.nan_status(who, int(deed.much))
            case "mute" | "unmute":
                sim.never_confirm_cancel(who, deed.what == "mute")
            case "unsure" | "sure":
                self.sim[who].drone.is_unsure = deed.what == "unsure"
                self.sim[who].drone.report()
            case "battery" if self.machines[who].battery() > deed.much:
                self.machines[who].set_battery(deed.much)
            case "event":
                sim[who].body.tell(deed.how, {})

    def _disk(self, what: str) -> None:
        if what == "disk_slow":
            self.disk.slow = True
        elif self.alive:
            self.disk.fill(what == "disk_full")
        if what == "disk_ok":
            self.disk.slow = False

    def _wire(self, deed: Deed) -> None:
        hub, who = self.hub, deed.whom
        match deed.what:
            case "wire":
                names = ("drop", "duplicate", "reorder") if deed.how == "all" else (deed.how,)
                hub.set_faults(who, Faults(jitter_us=20_000, **dict.fromkeys(names, deed.much)))
            case "wire_off":
                hub.set_faults(who, NO_FAULTS)
            case "slow":
                hub.set_delay(who, round(deed.much * SECOND))
            case _:
                hub.set_delay(who, hub.delay_us)

    def _target(self, whom: str) -> str | None:
        if whom.startswith("@"):
            agent = self.engine.state.agents.get(whom[1:])
            return agent.task or None if agent is not None else None
        if not whom.startswith(("#", "~")):
            return whom
        still_open = list(self.engine.open_tasks)
        if whom.startswith("~"):
            still_open = [task for task in still_open if self.engine.state.tasks[task].status == "ENDING"]
        return still_open[int(whom[1:]) % len(still_open)] if still_open else None

    # -- playing -------------------------------------------------------------------------------------------------------
    def play(self) -> None:
        """Play the plan, then calm everything, and look at what is left."""
        self.run_for(1)
        self.rarer.let_fly()
        if self.ground is not None:
            self.ground.begin()
        begin = self.now
        for ask in self.plan.asks:
            self.scheduler.call_at(begin + round(ask.at * SECOND), lambda ask=ask: self.ask(ask))  # type: ignore[misc]
        for deed in self.plan.deeds:
            self.scheduler.call_at(begin + round(deed.at * SECOND), lambda deed=deed: self.do(deed))  # type: ignore[misc]
        self.run_until(lambda: False, self.plan.calm_at)
        self.calm()
        if self.ground is not None:
            self.ground.finish()

    def calm(self) -> None:
        """End all faults, let go on what was stopped; tasks end, or are ended; then look."""
        self.tell("CALM")
        self._calm = True
        self.keeper.left = 0
        if self.rarer.rival and self.alive:
            self.keeper.when, self._death, self._deaths = "kept", Deed(0.0, "engine", away_s=3.0), []
            self._live_again()
        self._mend()
        self.run_for(15)
        self.order(inp.LockdownOrder("release", PERSON))
        self._go_on()
        self.run_for(2 * ASK_AGAIN_S)
        if not self.run_until(self.flight.ended, CALM_S):
            for round_ in range(4):
                self._go_on()
                for task in list(self.engine.open_tasks):
                    self.order(inp.Abort(task, "now" if round_ else "", PERSON))
                if self.run_until(self.flight.ended, REST_S / 4):
                    break
        self._go_on()
        for agent in self.machines:
            self.order(inp.Operator("clear", agent, PERSON))
        self.run_until(self._is_quiet, REST_S)
        self.run_for(5)
        self.tell("END")
        if isinstance(self.flight.driver, AheadDriver):
            self.flight.driver.flush()
        self._compare()
        self.invariants.finish()

    def _mend(self) -> None:
        sim, hub = self.sim, self.hub
        self.disk.fill(False)
        self.disk.slow = False
        hub._own_faults.clear()
        hub._own_delay.clear()
        if self.plan.seed >= MORE_FROM:
            self.rarer.mend()
        for agent in sorted(self._frozen):
            sim.thaw(agent)
        for agent in sorted(self._down):
            sim.restart(agent)
        self._cut.clear()
        for agent, body in self.machines.items():
            sim.never_confirm_cancel(agent, False)
            if isinstance(body, Drone):
                body.is_unsure = False
            sim.mend_link(agent)
            sim[agent].front.refusals.clear()
            hub._lost_results[agent] = 0
            if body.kind.mobility == "ground":
                body.set_battery(max(body.battery(), SWAPPED_PERCENT))
            if body.state().control == "pilot":
                sim.hand_back(agent)

    def _go_on(self) -> None:
        """Give back what a pilot or a failsafe has, and let go on what was stopped."""
        self.rarer.let_fly()
        for index, (agent, body) in enumerate(self.machines.items()):
            if body.state().control != "engine" and not body.is_airborne:
                self.sim.hand_back(agent)  # it landed or stopped by itself, and somebody went to see it
                self.run_for(1)
            ways = ("continue", "return", "end")
            for how in (ways[(self.plan.seed + index) % 3], "end"):
                if self.order(inp.Operator(f"handback_{how}", agent, PERSON)) == Done():  # type: ignore[arg-type]
                    break
            record = self.engine.state.agents.get(agent)
            if record is not None and record.rebooted and record.pool != "QUARANTINED":
                self.order(inp.Operator("clear", agent, PERSON))  # somebody has looked at it
        self.order(inp.Operator("continue", "", PERSON))
        for agent in self.machines:
            self.order(inp.Operator("continue", agent, PERSON))
        for task in list(self.engine.open_tasks):
            self.order(inp.Operator("continue", task, PERSON))
        for agent, body in self.machines.items():
            if body.kind.mobility == "ground":
                self._free_the_lanes(agent)

    def _free_the_lanes(self, agent: str) -> None:
        """Look at a machine that nobody commands, and have one that stands in the way of others leave."""
        record = self.engine.state.agents.get(agent)
        if record is not None and record.pool == "QUARANTINED":
            if record.quarantine == "cancel_unconfirmed":  # its process hangs
                self.sim.kill(agent)
                self.run_for(1)
                self.sim.restart(agent)
                self.run_for(1)
            self.order(inp.Operator("clear", agent, PERSON))
            self.run_for(1)
            record = self.engine.state.agents.get(agent)
        blocks = any(goal.code == "leg_busy" and goal.text == agent for goal in self.engine.state.goals.values())
        if record is not None and (record.pool == "PARKED_AWAY" or (record.pool == "STANDBY" and blocks)):
            self.order(inp.Operator("return", agent, PERSON))

    def _is_quiet(self) -> bool:
        return self.flight.ended() and not any(body.is_airborne for body in self.machines.values())

    def close(self) -> None:
        """Let everything go."""
        self.flight.close()
        self.disk.close()
        if self._folder is not None:
            self._folder.cleanup()
