"""Planted bugs: each breaks the engine in one place. The simulation must see each of them.

    python -m tests.simulation.planted [name ...] [--seeds 0-40]        find the seeds that show a bug

`test_planted` pins a seed for each; `test_runs` and long runs show that seeds are clean without.
"""

import argparse
import sys
from collections.abc import Callable
from typing import Any, Final

import pytest
from msgspec.structs import replace

from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.allocation import Allocation
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.gateview import GateView
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import holds
from formiga_bt.engine.kernel.causes import HoldCause, ResumeHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.index import DeadlineHeap
from formiga_bt.engine.kernel.timers import AcceptDue, CancelDue, ClearanceDue, GraceDue, LiveDue, NodeDue, WallTimer
from formiga_bt.engine.restart.reconcile import Reconcile
from formiga_bt.engine.tasks.cleanup import Cleanups
from formiga_bt.engine.tasks.recovery import Recovery
from formiga_bt.engine.tasks.system_tasks import SystemTasks
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.nodes import draining
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.nodes.decorators import RetryNode
from formiga_bt.nodes.leaves import WaitNode
from tests.simulation.plan import Deed, Plan, plan
from tests.simulation.planted_ground import GROUND_PLANTS
from tests.simulation.runs import Report, play
from tests.simulation.world import World

Patch = pytest.MonkeyPatch
Where = int | tuple[int, float, int]
"""A seed; or a seed whose engine ends so many steps after a second, and whose disk does not."""


# -- goals and their ends ----------------------------------------------------------------------------------------------
def old_news_counts(patch: Patch) -> None:
    """News of a goal that comes late, or twice, is taken as if it were new."""
    on_event = Goals.on_event

    def takes(self: Goals, event: Any) -> None:
        goal = self._core.state.goals.get(event.goal_id)
        if goal is not None and 0 <= event.n <= goal.n:
            self._core.put_goal(goal.id, n=event.n - 1)
        on_event(self, event)

    patch.setattr(Goals, "on_event", takes)


def an_end_wakes_nobody(patch: Patch) -> None:
    """The step that waits for a goal is not told that it succeeded."""
    _silent(patch, "succeeded")


def a_drained_goal_wakes_nobody(patch: Patch) -> None:
    """Whoever waits for the end of a canceled goal is not told of it."""
    _silent(patch, "canceled")


def _silent(patch: Patch, of: str) -> None:
    end = Goals.end

    def ends(self: Goals, goal_id: str, state: str, *args: Any, **more: Any) -> None:
        wake = self._core.wake
        if state == of:
            self._core.wake = lambda task, key: None  # type: ignore[method-assign]
        try:
            end(self, goal_id, state, *args, **more)
        finally:
            self._core.wake = wake  # type: ignore[method-assign]

    patch.setattr(Goals, "end", ends)


def an_end_leaves_the_agent_busy(patch: Patch) -> None:
    """The agent of a goal that was canceled counts as busy for ever."""
    free = Goals._free_agent
    patch.setattr(
        Goals, "_free_agent", lambda self, goal: None if goal.state in ("canceled", "interrupted") else free(self, goal)
    )


def a_result_is_dropped_without_a_look(patch: Patch) -> None:
    """The end of a goal that was never seen to be accepted is thrown away."""
    on_end = Goals._on_end
    patch.setattr(
        Goals, "_on_end", lambda self, goal, event: None if goal.state == "sent" else on_end(self, goal, event)
    )


def a_cancel_is_not_repeated(patch: Patch) -> None:
    """A cancel is sent once; nobody looks whether it was heard, or how long it takes."""
    set_wall = Core.set_wall

    def sets(self: Core, timer: WallTimer, after_us: Any) -> None:
        if not isinstance(timer, CancelDue | GraceDue):
            set_wall(self, timer, after_us)

    patch.setattr(Core, "set_wall", sets)


def a_cancel_forgets_its_goal(patch: Patch) -> None:
    """A goal that is stopped counts as over at once: nobody waits for its end."""
    patch.setattr(draining, "is_empty", lambda run, drain: True)
    drain = Tasks._drain

    def drains(self: Tasks, task_id: str) -> None:
        if self._core.task(task_id).ending.drain:
            self._core.put_part(task_id, "ending", drain=())
        drain(self, task_id)

    patch.setattr(Tasks, "_drain", drains)


def a_goal_is_sent_again_blindly(patch: Patch) -> None:
    """A goal of a machine whose process was started anew is sent again, under its old id."""

    def rebooted(self: Fleet, agent: Any, boot_id: str, wall: int = 0) -> None:
        self._core.put_agent(agent.id, boot_id=boot_id, seq=-1, boot_wall=wall)
        for goal in self._core.index.goals_of(agent.id):
            if goal.in_flight and not goal.cancel_asked:
                self._goals._gate.resend(goal)

    patch.setattr(Fleet, "_rebooted", rebooted)


# -- time --------------------------------------------------------------------------------------------------------------
def deadlines_are_off_by_one(patch: Patch) -> None:
    """Of two deadlines the later one is taken to be the next."""
    first = DeadlineHeap.first

    def second(self: DeadlineHeap) -> Any:
        found = first(self)
        rest = sorted((d.at, d.seq, timer) for timer, d in self._state.deadlines.items())
        return found if len(rest) < 2 or rest[0][0] == rest[1][0] else (rest[1][0], rest[1][2])

    patch.setattr(DeadlineHeap, "first", second)


def a_timer_is_lost_on_restore(patch: Patch) -> None:
    """An engine that goes on does not set the deadlines of steps again."""
    rebuild = DeadlineHeap._rebuild

    def rebuilds(self: DeadlineHeap) -> None:
        rebuild(self)
        self._heap = [one for one in self._heap if not isinstance(one[2], NodeDue)]

    patch.setattr(DeadlineHeap, "_rebuild", rebuilds)


def held_clocks_run(patch: Patch) -> None:
    """The deadlines of a task that is HELD go on."""
    patch.setattr(Core, "pause_deadlines", lambda self, task_id: None)


def clocks_never_run_again(patch: Patch) -> None:
    """What stood still while a task was HELD stands still for ever."""
    patch.setattr(Core, "resume_deadlines", lambda self, task_id: None)


def a_retry_sets_no_timer(patch: Patch) -> None:
    """The pause before the next attempt has no end."""
    ended = RetryNode.child_ended

    def without(self: RetryNode, run: Any) -> Any:
        status = ended(self, run)
        if self.mem.waiting:
            run.clear_deadline(self.key)
        return status

    patch.setattr(RetryNode, "child_ended", without)


def silence_is_not_noticed(patch: Patch) -> None:
    """Nobody looks again whether a machine that went silent is heard of."""
    due = Fleet.on_live_due

    def once(self: Fleet, agent_id: str, wall: int) -> None:
        due(self, agent_id, wall)
        self._core.set_wall(LiveDue(agent_id), None)

    patch.setattr(Fleet, "on_live_due", once)


# -- tasks and agents --------------------------------------------------------------------------------------------------
def a_released_agent_is_kept(patch: Patch) -> None:
    """A task that ends does not give its machines back."""
    patch.setattr(Fleet, "release", lambda self, agent_id: None)


def a_machine_is_granted_twice(patch: Patch) -> None:
    """The allocator does not see that a machine was granted since it last looked."""
    put = Roster.put

    def stale(self: Roster, candidate: Any) -> None:
        free = {"task": "", "goal": "", "pool": "STANDBY", "word": "STANDBY", "landed": "grounded", "at_port": True}
        busy = candidate.pool in ("ASSIGNED", "EXECUTING ACTION")
        put(self, replace(candidate, **free) if busy else candidate)

    patch.setattr(Roster, "put", stale)


def the_allocator_sleeps(patch: Patch) -> None:
    """A machine that comes free does not have the allocator look again: who waits goes on waiting."""
    patch.setattr(Allocation, "hear", lambda self: self._heard.clear())


def an_aborted_task_still_waits_for_agents(patch: Patch) -> None:
    """A task that is aborted before it began stays in the queue."""
    emit = Core.emit

    def emits(self: Core, change: Any) -> None:
        task = self.state.tasks.get(change.task) if isinstance(change, ch.RequestPut) else None
        if task is not None and change.request is None and task.outcome.status == "CANCELED" and task.section == "":
            return
        emit(self, change)

    patch.setattr(Core, "emit", emits)


def the_way_home_is_skipped(patch: Patch) -> None:
    """Tasks end without bringing their machines home."""
    patch.setattr(Recovery, "_to_bring", lambda self, task: [])


def a_second_try_is_forgotten(patch: Patch) -> None:
    """A way home that failed is said to be tried again, and never is."""
    patch.setattr(Recovery, "try_again", lambda self, task_id, agent_id: None)


def a_quarantined_machine_is_used(patch: Patch) -> None:
    """The allocator takes a quarantined machine for a free one."""
    put = Roster.put

    def trusts(self: Roster, candidate: Any) -> None:
        free = {"pool": "STANDBY", "landed": "grounded", "at_port": True, "liveness": "ALIVE"}
        put(self, replace(candidate, **free) if candidate.pool == "QUARANTINED" else candidate)

    patch.setattr(Roster, "put", trusts)


def a_restart_loses_its_request(patch: Patch) -> None:
    """A task that begins anew is PENDING, and the allocator does not know of it."""
    anew = Tasks._begin_anew

    def begins(self: Tasks, task_id: str) -> None:
        anew(self, task_id)
        self._core.emit(ch.RequestPut(task_id, None))

    patch.setattr(Tasks, "_begin_anew", begins)


def a_lost_machine_stays_with_its_task(patch: Patch) -> None:
    """A machine that is lost is not taken out of its task, and its goals are not ended."""
    patch.setattr(Fleet, "_lost", lambda self, agent_id: self._core.put_agent(agent_id, liveness="LOST"))


# -- holds, orders, lockdown -------------------------------------------------------------------------------------------
def held_tasks_go_on(patch: Patch) -> None:
    """HELD holds no goal back."""
    ask = GateView.ask
    patch.setattr(GateView, "ask", lambda self, goal: replace(ask(self, goal), held=False))


def a_carried_out_order_is_told_nobody(patch: Patch) -> None:
    """A task that waits for the order that brings its machine down is not told that it is down."""
    patch.setattr(SystemTasks, "ordered_home", lambda self, task_id: None)


def lockdown_ends_with_the_engine(patch: Patch) -> None:
    """An engine that is started again knows nothing of the lockdown before."""
    _forgets(patch, lambda state: setattr(state, "lockdown", None))


# -- people ------------------------------------------------------------------------------------------------------------
def a_question_is_asked_twice(patch: Patch) -> None:
    """Who has a question before them is shown it again."""
    show = People._show

    def shows(self: People, question: Any, person: str) -> None:
        show(self, question, person)
        show(self, question, person)

    patch.setattr(People, "_show", shows)


def an_answer_is_not_told(patch: Patch) -> None:
    """A step is not woken when its question is answered."""
    answers = Engine._answers

    def told(self: Engine) -> None:
        wake = self.core.wake
        self.core.wake = lambda task, key: None  # type: ignore[method-assign]
        try:
            answers(self)
        finally:
            self.core.wake = wake  # type: ignore[method-assign]

    patch.setattr(Engine, "_answers", told)


def a_word_is_waited_for_without_end(patch: Patch) -> None:
    """The question whether people stand clear has no end."""
    need = Clearances.need

    def needs(self: Clearances, goal: Any) -> None:
        need(self, goal)
        self._core.clear_deadline(ClearanceDue(goal.agent))

    patch.setattr(Clearances, "need", needs)


# -- wakes -------------------------------------------------------------------------------------------------------------
def an_event_wakes_nobody(patch: Patch) -> None:
    """Who waits for an event of an agent is not woken when the agent tells it."""
    touch = Blackboard.touch
    patch.setattr(Blackboard, "touch", lambda self, key: None if key.startswith("/events/") else touch(self, key))


def a_time_that_has_come_is_missed(patch: Patch) -> None:
    """Who waits for a time is woken, and does not look whether it has come."""
    patch.setattr(WaitNode, "is_quiet", lambda self, run: True)


# -- what is kept, and a restart ---------------------------------------------------------------------------------------
def a_change_is_not_journaled(patch: Patch) -> None:
    """The state is written without a change."""
    look = Allocation.look

    def writes(self: Allocation) -> None:
        self._core.state.counters["looks"] = self._core.state.counters.get("looks", 0) + 1
        look(self)

    patch.setattr(Allocation, "look", writes)


def effects_leave_before_the_commit(patch: Patch) -> None:
    """Effects are carried out before their step is kept."""

    def handle(self: VirtualDriver, now: int, given: Any) -> Any:
        step = self.engine.handle(now, given)
        for effect in step.effects:
            self.switchboard.carry_out(effect, self._beat)
        if self._persist is not None:
            self._persist.keep((step,))
        for change in step.changes:
            if isinstance(change, ch.WallTimerSet):
                self._set_wall(change.timer, change.after_us)
        for listener in self.listeners:
            listener(step)
        return step

    patch.setattr(VirtualDriver, "_handle", handle)


def a_snapshot_lacks_questions(patch: Patch) -> None:
    """An engine that is started again has forgotten which questions are open."""
    _forgets(patch, lambda state: state.questions.clear())


def a_snapshot_lacks_timers(patch: Patch) -> None:
    """An engine that is started again has forgotten its timers of wall time."""
    _forgets(patch, lambda state: state.wall.clear())


def a_snapshot_lacks_orders(patch: Patch) -> None:
    """An engine that is started again has forgotten the orders that stand."""
    _forgets(patch, lambda state: state.orders.clear())


def _forgets(patch: Patch, forget: Callable[[Any], Any]) -> None:
    init = Engine.__init__

    def begins(self: Engine, *args: Any, **more: Any) -> None:
        if more.get("resumes"):
            forget(more["state"])
        init(self, *args, **more)

    patch.setattr(Engine, "__init__", begins)


def a_finally_is_skipped_after_a_kill(patch: Patch) -> None:
    """The cleanup of a stopped sequence that ran when the engine died is not taken up again."""
    patch.setattr(Cleanups, "restore", lambda self: None)


def the_epoch_stays(patch: Patch) -> None:
    """An engine that is started again uses the epoch of the one before."""
    begin = Reconcile.begin
    patch.setattr(Reconcile, "begin", lambda self, given: begin(self, replace(given, epoch=given.epoch - 1)))


def timers_fire_before_results_are_in(patch: Patch) -> None:
    """After a restart overdue timers fire before the machines were asked what they did meanwhile."""
    stands = Core.timers_stand.fget  # type: ignore[attr-defined]
    patch.setattr(Core, "timers_stand", property(lambda self: self.stands_by and stands(self)))


def goals_leave_before_results_are_in(patch: Patch) -> None:
    """After a restart goals are sent before the machines were asked what they did meanwhile."""
    ask = GateView.ask
    patch.setattr(GateView, "ask", lambda self, goal: replace(ask(self, goal), unsettled=False))


def unknown_goals_are_waited_for(patch: Patch) -> None:
    """A goal that its machine never had is neither sent again nor ended."""
    patch.setattr(Goals, "_on_unknown", lambda self, goal: self._core.set_wall(AcceptDue(goal.id), None))


def a_hold_of_an_outage_is_left_out(patch: Patch) -> None:
    """Deadlines of a task that is HELD after an outage are forgotten."""
    hold = holds.hold

    def holding(core: Core, task_id: str, cause: HoldCause) -> None:
        hold(core, task_id, cause)
        if isinstance(cause, ResumeHold) and core.state.tasks[task_id].hold.clock.paused:
            core.put_part(task_id, "hold", clock=replace(core.task(task_id).hold.clock, paused=()))

    from formiga_bt.engine.restart import reconcile

    patch.setattr(reconcile, "hold", holding)


def a_standstill_goes_unnoticed(patch: Patch) -> None:
    """An engine whose process stood still goes on as if no time had passed."""
    patch.setattr(Reconcile, "stood_still", lambda self, given: setattr(self._core, "stands_by", False))


WAKE = ("wait", "wake")
PLANTS: Final[dict[str, tuple[Callable[[Patch], None], Where, frozenset[str]]]] = {
    plant.__name__: (plant, seed, frozenset(rules))
    for plant, seed, *rules in (
        (old_news_counts, 4, "life"),
        (an_end_wakes_nobody, 0, *WAKE),
        (a_drained_goal_wakes_nobody, 1, *WAKE),
        (an_end_leaves_the_agent_busy, 1, "wait", "life"),
        (a_result_is_dropped_without_a_look, 10, "wait", "left", "rest"),
        (a_cancel_is_not_repeated, 0, "wait"),
        (a_cancel_forgets_its_goal, 0, "leak", "exception", *WAKE),
        (a_goal_is_sent_again_blindly, 13, "twice"),
        (deadlines_are_off_by_one, 0, "late"),
        (a_timer_is_lost_on_restore, 1, "late"),
        (held_clocks_run, 1, "clock"),
        (clocks_never_run_again, 2, "clock"),
        (a_retry_sets_no_timer, 0, "wait"),
        (silence_is_not_noticed, 0, "wait"),
        (a_released_agent_is_kept, 0, "leak"),
        (a_machine_is_granted_twice, 0, "two_tasks"),
        (the_allocator_sleeps, 0, "wait"),
        (an_aborted_task_still_waits_for_agents, 0, "leak"),
        (the_way_home_is_skipped, 0, "released", "left", "wait"),
        (a_second_try_is_forgotten, 10, "wait"),
        (a_quarantined_machine_is_used, 0, "life"),
        (a_restart_loses_its_request, 0, "wait"),
        (a_lost_machine_stays_with_its_task, 0, "wait"),
        (held_tasks_go_on, 3, "held_back"),
        (a_carried_out_order_is_told_nobody, 16, "wait"),
        (lockdown_ends_with_the_engine, 30, "wait"),
        (a_question_is_asked_twice, 0, "again"),
        (an_answer_is_not_told, 1, *WAKE),
        (a_word_is_waited_for_without_end, 1, "wait"),
        (an_event_wakes_nobody, 10, "wake"),
        (a_time_that_has_come_is_missed, 0, "wait"),
        (a_change_is_not_journaled, 0, "fold"),
        (effects_leave_before_the_commit, 11, "durable"),
        (a_snapshot_lacks_questions, 1, "exception", "wait"),
        (a_snapshot_lacks_timers, 17, "wait"),
        (a_snapshot_lacks_orders, 23, "wait", "left"),
        (a_finally_is_skipped_after_a_kill, (22, 72.5, 1), "tree"),
        (the_epoch_stays, 1, "epoch"),
        (a_standstill_goes_unnoticed, 30_000, "reconcile"),
        (timers_fire_before_results_are_in, 1, "reconcile"),
        (goals_leave_before_results_are_in, 6, "reconcile"),
        (unknown_goals_are_waited_for, 17, "wait"),
        (a_hold_of_an_outage_is_left_out, 4, "wait"),
        *GROUND_PLANTS,
    )
}
"""Bug -> how to plant it, a seed that shows it, and the rules of which at least one is found broken then."""


class Seen(Exception):  # noqa: N818 - it is no error
    """What was looked for has been found."""


def plan_of(where: Where) -> Plan:
    """Return the plan of a place."""
    if isinstance(where, int):
        return plan(where)
    seed, at, steps = where
    drawn = plan(seed)
    others = [deed for deed in drawn.deeds if not deed.what.startswith(("engine", "disk"))]
    end = Deed(at, "engine", how="kept", much=steps, away_s=3.0)
    return replace(drawn, deeds=tuple(sorted([*others, end], key=lambda deed: deed.at)))


def play_with(name: str, where: Where | None = None, *, on: bool = False) -> Report:
    """Play a place, or the pinned one, with a bug, until it is found (or `on` to the end)."""
    plant, pinned, rules = PLANTS[name]
    found: list[str] = []

    def look(world: World) -> None:
        tell = world.invariants.tell

        def tells(rule: str, text: str, once: str = "") -> None:
            tell(rule, text, once)
            if rule in rules and not on and not found:
                found.append(rule)
                raise Seen

        world.invariants.tell = tells  # type: ignore[method-assign]

    with pytest.MonkeyPatch.context() as patch:
        plant(patch)
        return play(plan_of(pinned if where is None else where), look=look)


def is_caught(name: str, report: Report) -> bool:
    """Return whether the run shows what the bug must lead to."""
    return bool(PLANTS[name][2] & {violation.rule for violation in report.violations})


def _dies_in_lockdown(played: Plan) -> bool:
    """Tell whether an engine may die while the site is locked down."""
    on = False
    for deed in sorted(played.deeds, key=lambda deed: deed.at):
        on = deed.how != "release" if deed.what == "lockdown" else on
        if on and deed.what == "engine":
            return True
    return False


def _has(*words: str) -> Callable[[Plan], bool]:
    return lambda played: set(words) <= {deed.what for deed in played.deeds}


NEEDS: Final[dict[str, Callable[[Plan], bool]]] = {
    "lockdown_ends_with_the_engine": _dies_in_lockdown,
    "held_tasks_go_on": _has("order"),
    **dict.fromkeys(
        ("a_goal_is_sent_again_blindly", "silence_is_not_noticed", "a_lost_machine_stays_with_its_task"), _has("crash")
    ),
    **{
        name: _has("engine")
        for name in PLANTS
        if name.startswith(("a_snapshot", "a_timer_is", "the_epoch", "timers_fire", "goals_leave"))
        or name.endswith(("after_a_kill", "_left_out"))
    },
}
"""What must be in a plan for a bug to show: others are not tried when seeds are looked for."""


def main() -> int:
    """Find seeds that show a bug, and are clean without."""
    parser = argparse.ArgumentParser(description="Find seeds that show planted bugs.")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seeds", default="0-40", help="first-last (last excluded)")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    clean: dict[int, bool] = {}
    missed = 0
    for name in options.names or PLANTS:
        others: set[str] = set()
        for seed in range(int(first), int(last)):
            if clean.get(seed) is False or not NEEDS.get(name, _has())(plan(seed)):
                continue
            report = play_with(name, seed)
            if not is_caught(name, report):
                others |= {str(violation)[:160] for violation in report.violations}
                continue
            if clean.setdefault(seed, not play(seed).violations):
                found = next(one for one in report.violations if one.rule in PLANTS[name][2])
                print(f"{name} {seed} {report.steps} steps, {found}"[:200], flush=True)
                break
        else:
            missed += 1
            print(f"{name}: no seed; {list(others)[:3]}", flush=True)
    return missed


if __name__ == "__main__":
    sys.exit(main())
