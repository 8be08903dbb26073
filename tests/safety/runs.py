"""Random fault runs: a scene is played, then calmed; the monitor watches all of it.

python -m tests.safety.runs --seed 17 -v        play one seed again, with its story
python -m tests.safety.runs --seeds 0-200       many seeds, one line for each that is not clean
"""

import argparse
import contextlib
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from typing import Any

from msgspec import Struct

from agents_sim.drone import Drone
from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.transport.memory import Faults
from formiga_bt.transport.messages import TERMINAL
from tests.safety.monitor import Monitor, Violation
from tests.safety.scenes import Deed, Request, Scene, scene, tasks

CLEAN_WIRE = Faults()
ABORT_AFTER_S = 600.0
"""So long tasks may go on by themselves in the calm; then they are aborted."""
REST_S = 3600.0
STATUS_EVERY_US = 2 * SECOND
PERSON = "watcher_1"


class Report(Struct, frozen=True):
    """What a run showed."""

    seed: int
    violations: tuple[Violation, ...]
    counts: Counter[str]
    story: tuple[str, ...] = ()
    took_s: float = 0.0
    lasted_s: float = 0.0
    """Virtual seconds."""

    @property
    def command(self) -> str:
        """Return the command that plays it again."""
        return f"python -m tests.safety.runs --seed {self.seed} -v"

    def text(self) -> str:
        """Return the violations and how to see them again."""
        return "\n".join([f"seed {self.seed}, again with: {self.command}", *(f"  {v}" for v in self.violations)])


class Run:
    """One scene under way."""

    abort_after_s = ABORT_AFTER_S

    def __init__(self, played: Scene, *, story: bool = False) -> None:
        _, catalogue = packaged_world()
        self.scene = played
        self.world = Rehearsal(
            played.site, catalogue, tasks(played.seed), (), seed=played.seed, status_every_us=STATUS_EVERY_US
        )
        self.monitor = Monitor(self.world)
        self.lines: list[str] = []
        self.dead: set[str] = set()
        self.frozen: set[str] = set()
        self.piloted: set[str] = set()
        self.slow: set[str] = set()
        """Alarms told: each once."""
        self.loud = story
        if story:
            self.world.driver.listeners.append(self._tell_step)
        for spec in played.specs:
            self.monitor.add(spec)
        self.drones = [name for name in self.world.sim.agents if isinstance(self.world.sim[name].body, Drone)]

    # -- the story -----------------------------------------------------------------------------------------------------
    def tell(self, text: str) -> None:
        """Add a line to the story."""
        if self.loud:
            self.lines.append(f"{(self.world.now - self.monitor.start) / SECOND:9.3f}  {text}")

    def _tell_step(self, step: inp.EngineStep) -> None:
        match step.input:
            case inp.GoalEventInput(event) if event.state in TERMINAL:
                self.tell(f"  {event.agent}: {event.goal_id} {event.state} {event.code} {event.result or ''}".rstrip())
            case (
                inp.Operator() | inp.LockdownOrder() | inp.Abort() | inp.Assign() | inp.Unassign() | inp.InService()
                | inp.Prioritize()
            ):  # fmt: skip
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
                case inp.Alarm("recover_slow" | "low_charge", text) if text in self.slow:
                    pass
                case inp.Alarm(code, text):
                    self.slow.add(text)
                    self.tell(f"  ALARM {code}: {text}")
                case inp.PublishState(task, status, code, reason):
                    held = self.world.engine.state.tasks[task].hold.words
                    self.tell(f"  {task} {status} {code} {reason} {held or ''}".rstrip())
        for change in step.changes:
            if type(change).__name__ == "OrderPut":
                order = self.monitor.state.orders.get(change.agent)
                self.tell(
                    f"  order on {change.agent}: " + (f"{order.stop} {order.scope} {order.state}" if order else "none")
                )

    # -- playing -------------------------------------------------------------------------------------------------------
    def play(self) -> None:
        """Play the scene, then calm everything, and judge what is left."""
        world = self.world
        world.run_for(1)
        begin = world.now
        for request in self.scene.requests:
            world.scheduler.call_at(begin + round(request.at * SECOND), lambda r=request: self.submit(r))  # type: ignore[misc]
        for deed in self.scene.deeds:
            if deed.at < self.scene.calm_at:
                world.scheduler.call_at(begin + round(deed.at * SECOND), lambda d=deed: self.do(d))  # type: ignore[misc]
        world.run_for(self.scene.calm_at)
        self.calm()

    def submit(self, request: Request) -> None:
        """Ask for a task."""
        self.tell(f"SUBMIT {request.task} {request.params} {request.priority or ''}")
        with contextlib.suppress(TaskError):
            self.ask(inp.Submit(request.task, dict(request.params), request.priority, PERSON))

    def ask(self, given: inp.Input) -> Accepted | Done:
        """Give an order; raises TaskError if it is refused."""
        return self.world.ask(given)

    def order(self, given: inp.Input) -> bool:
        """Give an order; return whether it was taken."""
        try:
            self.ask(given)
        except TaskError:
            return False
        return True

    def do(self, deed: Deed) -> None:
        """Let one thing happen."""
        self.tell(f"DEED {deed}")
        self.monitor.counts[f"deed {deed.what}"] += 1
        sim, agent = self.world.sim, deed.whom
        target = self._target(deed.whom)
        match deed.what:
            case "order" if target is not None:
                self.order(inp.Operator(deed.how, target, PERSON))  # type: ignore[arg-type]
            case "handback":
                self.order(inp.Operator(f"handback_{deed.how}", agent, PERSON))  # type: ignore[arg-type]
            case "clear":
                self.order(inp.Operator("clear", agent, PERSON))
            case "lockdown":
                self.order(inp.LockdownOrder(deed.how, PERSON))  # type: ignore[arg-type]
            case "assign" if task := self._target(deed.how):
                self.order(inp.Assign(task, agent, by=PERSON))
            case "unassign":
                self.order(inp.Unassign(agent, PERSON))
            case "out" | "in":
                self.order(inp.InService(agent, "rotor" if deed.what == "out" else "", PERSON))
            case "prioritize" if task := self._target("#0"):
                self.order(inp.Prioritize(task, deed.how, deed.how != "high", PERSON))  # type: ignore[arg-type]
            case "abort" if target:
                self.order(inp.Abort(target, deed.how, PERSON))  # type: ignore[arg-type]
            case "pilot":
                self.piloted.add(agent)
                sim.take_over(agent)
            case "pilot_off" if agent in self.piloted:
                self.piloted.discard(agent)
                sim.hand_back(agent)
            case "kill" if agent not in self.dead:
                self.dead.add(agent)
                self.frozen.discard(agent)
                sim.kill(agent)
            case "restart_process" if agent in self.dead:
                self.dead.discard(agent)
                sim.restart(agent)
            case "freeze" if agent not in self.dead:
                self.frozen.add(agent)
                sim.freeze(agent)
            case "thaw" if agent in self.frozen:
                self.frozen.discard(agent)
                sim.thaw(agent)
            case "refuse":
                sim.refuse_next(agent, count=int(deed.much))
            case "lose":
                sim.lose_next_result(agent, int(deed.much))
            case "nan" if agent not in self.dead:
                sim.nan_status(agent, int(deed.much))
            case "mute" | "unmute":
                sim.never_confirm_cancel(agent, deed.what == "mute")
            case "unsure" | "sure":
                sim[agent].drone.is_unsure = deed.what == "unsure"
            case "battery":
                self._lose_charge(agent, deed.much)
            case "wind" | "wind_off":
                self.monitor.disturbed.add(agent)
                sim[agent].drone.set_wind((deed.much, 0.0) if deed.what == "wind" else (0.0, 0.0))
            case "link":
                sim.lose_link(agent)
            case "link_on":
                sim.mend_link(agent)
            case _:
                self._wire(deed)

    def _wire(self, deed: Deed) -> None:
        hub = self.world.hub
        match deed.what:
            case "wire":
                share = deed.much
                names = ("drop", "duplicate", "reorder") if deed.how == "all" else (deed.how,)
                hub.set_faults(deed.whom, Faults(jitter_us=20_000, **dict.fromkeys(names, share)))
            case "wire_off":
                hub.set_faults(deed.whom, CLEAN_WIRE)
            case "slow":
                hub.set_delay(deed.whom, round(deed.much * SECOND))
            case "slow_off":
                hub.set_delay(deed.whom, hub.delay_us)

    def _lose_charge(self, agent: str, percent: float) -> None:
        drone = self.world.sim[agent].drone
        self.monitor.disturbed.add(agent)
        if drone.battery() > percent:
            drone.set_battery(percent)

    def _target(self, whom: str) -> str | None:
        if not whom.startswith("#"):
            return whom
        still_open = list(self.world.engine.open_tasks)
        return still_open[int(whom[1:]) % len(still_open)] if still_open else None

    # -- calming -------------------------------------------------------------------------------------------------------
    def calm(self) -> None:
        """End all faults, give everything back, let tasks end or end them; then judge."""
        world = self.world
        self.tell("CALM")
        self._mend()
        world.run_for(40)
        self.order(inp.LockdownOrder("release", PERSON))
        for agent in self.drones:
            self.order(inp.InService(agent, "", PERSON))
        self._go_on()
        if not self._until_ended(self.abort_after_s):
            for round_ in range(4):
                self._go_on()
                for task in list(world.engine.open_tasks):
                    self.order(inp.Abort(task, "now" if round_ else "", PERSON))
                if self._until_ended(REST_S / 4):
                    break
        self._go_on()
        for agent in self.drones:
            self.order(inp.Operator("clear", agent, PERSON))
        world.run_until(self._is_quiet, REST_S)
        world.run_for(20)
        self.tell("END")
        self.monitor.at_rest()
        self.monitor.finish()

    def _mend(self) -> None:
        sim, hub = self.world.sim, self.world.hub
        for agent in self.drones:
            sim.never_confirm_cancel(agent, False)
            hub.set_faults(agent, CLEAN_WIRE)
            hub.set_delay(agent, hub.delay_us)
            sim[agent].drone.is_unsure = False
            if hasattr(sim, "mend_link"):
                sim.mend_link(agent)
                sim[agent].drone.set_wind((0.0, 0.0))
        for agent in sorted(self.frozen):
            sim.thaw(agent)
        for agent in sorted(self.dead):
            sim.restart(agent)
        for agent in sorted(self.piloted):
            sim.hand_back(agent)
        for agent in self.drones:
            sim[agent].front.refusals.clear()
            hub._lost_results[agent] = 0
            if sim[agent].drone.state().control == "pilot":
                sim.hand_back(agent)

    def _go_on(self) -> None:
        """Give back what a pilot or a failsafe has, and let go on what was stopped."""
        for index, agent in enumerate(self.drones):
            record = self.world.engine.state.agents[agent]
            if record.rebooted and record.pool != "QUARANTINED":
                self.order(inp.Operator("clear", agent, PERSON))
            drone = self.world.sim[agent].drone
            if drone.state().control != "engine" and not drone.is_airborne:
                self.world.sim.hand_back(agent)  # it landed by itself, and somebody went to see it
                self.world.run_for(1)
            ways = ("continue", "return", "end")
            for how in (ways[(self.scene.seed + index) % 3], "end"):
                if self.order(inp.Operator(f"handback_{how}", agent, PERSON)):  # type: ignore[arg-type]
                    break
        self.order(inp.Operator("continue", "", PERSON))
        for agent in self.drones:
            self.order(inp.Operator("continue", agent, PERSON))
        for task in list(self.world.engine.open_tasks):
            self.order(inp.Operator("continue", task, PERSON))

    def _until_ended(self, limit_s: float) -> bool:
        return self.world.run_until_ended(limit_s=limit_s)

    def _is_quiet(self) -> bool:
        return self.world.ended() and not any(self.world.sim[agent].drone.is_airborne for agent in self.drones)


def run(seed: int, *, story: bool = False, make: Callable[[int], Scene] = scene) -> Report:
    """Play the scene of a seed; whatever is raised is a violation too."""
    began = time.perf_counter()
    played = Run(make(seed), story=story)
    monitor = played.monitor
    try:
        played.play()
    except Exception as error:  # noqa: BLE001  (any exception is what is looked for)
        where = traceback.extract_tb(error.__traceback__)[-1]
        monitor.tell(
            "exception", f"{type(error).__name__}: {error} ({where.filename.rsplit('/', 2)[-1]}:{where.lineno})"
        )
        if story:
            played.lines.append(traceback.format_exc())
    lasted_s = (played.world.now - monitor.start) / SECOND
    played.world.close()
    lines = [*played.lines, *(f"{v.at:9.3f}  !!!! {v.rule}: {v.text}" for v in monitor.violations)] if story else []
    lines.sort(key=_time_of)
    took = time.perf_counter() - began
    return Report(seed, tuple(monitor.violations), monitor.counts, tuple(lines), took, lasted_s)


def _time_of(line: str) -> float:
    try:
        return float(line[:9])
    except ValueError:
        return float("inf")


def main() -> int:
    """Play seeds from the command line."""
    parser = argparse.ArgumentParser(description="Random fault runs under the safety monitor.")
    parser.add_argument("--seed", type=int, help="play this one")
    parser.add_argument("--seeds", default="0-100", help="play these, first-last (last excluded)")
    parser.add_argument("-v", "--verbose", action="store_true", help="print the story")
    options = parser.parse_args()
    if options.seed is not None:
        report = run(options.seed, story=options.verbose)
        if options.verbose:
            print(*report.story, sep="\n")
        print(
            report.text()
            if report.violations
            else f"seed {report.seed}: clean, {report.lasted_s:.0f} s in {report.took_s:.1f} s"
        )
        return bool(report.violations)
    first, _, last = options.seeds.partition("-")
    return play_many(int(first), int(last))


def play_many(first: int, last: int) -> int:
    """Play many seeds; print those that are not clean, and a summary."""
    rules: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    failed, took = 0, 0.0
    for seed in range(first, last):
        report = run(seed)
        took += report.took_s
        counts += report.counts
        if report.violations:
            failed += 1
            rules.update({v.rule for v in report.violations})
            first_one: Any = report.violations[0]
            print(f"seed {seed}: {len(report.violations)} violations, first: {first_one}", flush=True)
    print(f"{last - first} runs, {failed} not clean, {took:.0f} s; {dict(rules)}")
    print(dict(sorted(counts.items())))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
