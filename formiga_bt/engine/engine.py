"""The engine: a deterministic function from inputs to steps. No clock, no random number, no I/O.

    step = engine.handle(now, input)          next deadline: engine.next_deadline()

A driver feeds inputs one at a time, with `TimerDue` for each deadline that lies before an input, persists the step, and only
then carries out its effects. The same engine runs in production, dry runs, tests and fault injection.
"""

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import assert_never

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.allocation import Allocation
from formiga_bt.engine.allocator.policy import POLICIES
from formiga_bt.engine.by_hand import ByHand
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.gatekeeper import Gatekeeper
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.goals.updates import Updates
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel import news as nw
from formiga_bt.engine.kernel import timers as tm
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.overload import note_behind
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal, Reply
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.orders.alarms import Alarms
from formiga_bt.engine.orders.breaches import Breaches
from formiga_bt.engine.orders.closures import Closures
from formiga_bt.engine.orders.command import Command
from formiga_bt.engine.orders.lockdown import Lockdowns
from formiga_bt.engine.orders.orders import StandingOrders
from formiga_bt.engine.restart.journal_backpressure import note_journal, refuse_if_full
from formiga_bt.engine.restart.reconcile import RESTORE, Reconcile
from formiga_bt.engine.restart.rescue import Rescue
from formiga_bt.engine.restart.resume import restore_trees
from formiga_bt.engine.rules.standing_rules import StandingRules
from formiga_bt.engine.tasks.agent_events import AgentEvents
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.engine.tasks.children import Children
from formiga_bt.engine.tasks.intake import Intake
from formiga_bt.engine.tasks.recovery import Recovery
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.engine.tasks.system_tasks import SystemTasks
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.engine.tasks.timing import Timing
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreesFactory
from formiga_bt.engine.tasks.wake_queue import WakeQueue
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.transport.messages import GoalEvent

SETTLE_LIMIT = 1000
"""Rounds of one step; beyond this two parts wake each other for ever, which is a bug."""


class Engine:
    """One engine of one site.

    Args:
        site: the checked site.
        catalogue: agent types and actions.
        tasks: checked tasks by name; as `Bundles`, further versions may be added while it runs.
        trees: how trees are run; the tests' naive interpreter is another.
        state: a loaded state to go on from.
        resumes: the first input will be `Resumed`; until then no timer fires, and a tree that cannot be rebuilt is told in
            `unbuilt` and stops nothing else.
        without: tasks whose trees are not rebuilt.
        look: told of each task before its tree is rebuilt, and of "" at the end.
    """

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        tasks: Mapping[str, Task],
        *,
        trees: TreesFactory = CompiledTrees,
        state: EngineState | None = None,
        resumes: bool = False,
        without: Collection[str] = (),
        look: Callable[[str], None] | None = None,
    ) -> None:
        self.core = core = Core(site, catalogue, tasks, state or EngineState(), self._hear)
        self.authority = Authority(core)
        self.people = People(core)
        self.clearances = Clearances(core, self.people)
        self.gatekeeper = Gatekeeper(core, self.clearances)
        self.updates = Updates(core, self.gatekeeper)
        self.goals = Goals(core, self.gatekeeper, self.updates)
        self.fleet = Fleet(core, self.goals, self.people, self.clearances)
        self.agent_events = AgentEvents(core, self.fleet)
        requests = Requests(core)
        self.intake = Intake(core, self.authority, requests)
        children = Children(core, self.intake)
        self.runs = Runs(core, self.goals, self.people, requests, children, trees)
        self.recovery = Recovery(core, self.fleet, self.runs)
        self.system_tasks = SystemTasks(core, self.goals, self.runs, self.recovery)
        self.tasks = Tasks(core, self.goals, self.people, self.fleet, requests, self.runs, children, self.recovery)
        self.wake_queue = WakeQueue(core, self.runs)
        self.orders = StandingOrders(core, self.fleet, self.goals, self.clearances, self.recovery, self.system_tasks)
        self.command = Command(core, self.fleet, self.goals, self.tasks, self.orders)
        self.lockdowns = Lockdowns(core, self.orders)
        self.breaches = Breaches(core, self.tasks, self.orders)
        self.closures = Closures(core, self.goals, self.breaches)
        self.timing = Timing(core, requests, self.tasks)
        self.allocation = Allocation(core, self.tasks, self.fleet, self.authority, POLICIES[site.policy], self.timing)
        self.by_hand = ByHand(core, self.tasks, self.orders, self.authority, self.allocation)
        self.alarms = Alarms(core)
        self.rules = StandingRules(core, self.intake, refuse_if_full)
        rescue = Rescue(core, self.goals, self.people, self.runs, self.tasks)
        self.reconcile = Reconcile(core, self.fleet, self.goals, self.authority, rescue, self.rules)
        core.stands_by = resumes
        self.unbuilt: dict[str, str] = {}
        """Tasks whose trees could not be rebuilt -> why."""
        if state is not None:
            self.unbuilt = restore_trees(core, self.runs, self.recovery, without, look or _look if resumes else None)

    @property
    def state(self) -> EngineState:
        """Return the state. Read only: `apply` alone writes it."""
        return self.core.state

    @property
    def open_tasks(self) -> tuple[str, ...]:
        """Return the tasks that have not ended, in the order of their admission."""
        return tuple(self.core.open)

    def next_deadline(self) -> tuple[Micros, tm.Timer] | None:
        """Return when the next TimerDue must be given, and its timer; None = nothing is waited for."""
        return self.core.next_deadline()

    def put_off(self, due: tm.WallTimer, wall: Micros, heard: Micros = 0) -> Micros | None:
        """Return by how much a wall-time deadline that has come up at `wall` is put off; None = WallDue must be given.

        The look whether an agent is still heard of is put off while it is: nothing happens, so there is no step. `heard` is
        when its wire last heard it, if that says more than its statuses.
        """
        if not isinstance(due, tm.LiveDue) or self.core.stands_by:
            return None
        return self.fleet.heard_for(due.agent, wall, heard)

    def statuses(self, task_id: str) -> dict[str, str]:
        """Return the running nodes of a task, by key."""
        run = self.runs.open.get(task_id)
        return run.trees.statuses() if run else {}

    def handle(self, now: Micros, given: inp.Input) -> inp.EngineStep:
        """Handle one input at one instant.

        Raises:
            AssertionError: time goes back, or a deadline before `now` was not given (a driver's bug).
        """
        core = self.core
        assert now >= core.now, f"time goes back from {core.now} to {now}"
        if type(given) is inp.Outage:
            core.stands_by = True  # what came up meanwhile waits until it is known what happened
        due = core.next_deadline()
        assert due is None or due[0] >= now or isinstance(given, inp.TimerDue), (
            f"deadline {due} was passed over at {now}"
        )
        core.begin(now)
        if core.state.resume is not None:
            self.reconcile.before_input(given)
        try:
            reply: Reply | None = self._dispatch(given)
        except TaskError as error:
            reply = Refusal(error.code, str(error))
        if core.state.resume is not None:
            self.reconcile.after_input(given)
        self._settle()
        if core.state.resume is not None and self.reconcile.proceed():
            self._settle()
        self.allocation.hear()
        self.alarms.end_step(given)
        return inp.EngineStep(core.state.seq, now, given, tuple(core.changes), tuple(core.effects), reply)

    def _dispatch(self, given: inp.Input) -> Reply | None:
        match given:  # the frequent ones first
            case inp.AgentStatusInput(status, wall, clock):
                if clock > self.core.now:
                    self.core.clock = clock
                self.fleet.on_status(status, wall)
                if self.rules.looks:
                    self.rules.on_status(status.id)
            case inp.GoalEventInput(event, wall, clock):
                self.core.clock = max(self.core.now, clock)
                self._goal_event(event, wall)
            case inp.TimerDue(timer):
                self._timer(timer)
            case inp.WallDue(wall_timer, at):
                self._wall(wall_timer, at)
            case inp.Submit():
                refuse_if_full(self.core, given)
                return Accepted(self.intake.submit(given))
            case inp.Approve() | inp.Duty():
                refuse_if_full(self.core, given)
                self.authority.take(given)
                return Done()
            case inp.AddAgent() | inp.RemoveAgent():
                refuse_if_full(self.core, given)
                self.fleet.membership.take(given)
                return Done()
            case inp.Learn():
                refuse_if_full(self.core, given)
                self.fleet.discovery.learn(given)
                return Done()
            case inp.Serve():
                refuse_if_full(self.core, given)
                for change in self.core.library.serve(given, self.core.open):
                    self.core.emit(change)
                return Done()
            case inp.Abort():
                self.tasks.abort(given)
                return Done()
            case inp.Operator():
                refuse_if_full(self.core, given)
                self.command.give(given)
                return Done()
            case inp.Assign() | inp.Unassign() | inp.Prioritize() | inp.InService():
                refuse_if_full(self.core, given)
                self.by_hand.take(given)
                return Done()
            case inp.CloseRegion() | inp.OpenRegion():
                refuse_if_full(self.core, given)
                self.closures.take(given)
                return Done()
            case inp.RuleOrder():
                refuse_if_full(self.core, given)
                return self.rules.order(given)
            case inp.AcknowledgeAlarm():
                self.alarms.acknowledge(given)
                return Done()
            case inp.LockdownOrder():
                refuse_if_full(self.core, given)
                self.lockdowns.order(given)
                return Done()
            case inp.AgentSeenInput(card, wall, wire, lacks):
                self.fleet.on_seen(card, wall, wire, lacks)
            case inp.AgentGoneInput(agent):
                self.fleet.on_gone(agent)
            case inp.AgentEventInput(event):
                self.agent_events.on_event(event)
            case inp.QueryReplyInput(agent, boot_id, goals, clock):
                self.core.clock = max(self.core.now, clock)
                self.fleet.on_query_reply(agent, boot_id, goals)
            case inp.UpdateGoal(goal_id, fields, _):
                refuse_if_full(self.core, given)
                self.updates.order(goal_id, fields)
                return Done()
            case inp.UpdateReplyInput(reply):
                self.updates.on_reply(reply)
            case inp.BadStatusInput(agent, text):
                self.fleet.on_bad(agent, text)
            case inp.EffectFailed():
                self.fleet.on_effect_failed(given)
            case inp.Started(epoch):
                self.core.emit(ch.CounterSet("epoch", epoch))
                if self.state.counters.get("deposed"):
                    self.core.emit(ch.CounterSet("deposed", 0))
                self.rules.read_anew()
            case inp.Resumed():
                self.reconcile.begin(given)
                if given.restored and self.state.lockdown is None:
                    self.lockdowns.order(inp.LockdownOrder("hold", by=RESTORE))
            case inp.HouseState():
                self.alarms.look_at_house(given)
            case inp.NewsDelivered(marks):
                self.core.emit(ch.NewsMarksPut(marks))
            case inp.Behind():
                note_behind(self.core, given)
            case inp.Outage():
                self.reconcile.stood_still(given)
            case inp.JournalState():
                note_journal(self.core, given)
            case _:
                assert_never(given)
        return None

    def _goal_event(self, event: GoalEvent, wall: Micros) -> None:
        if event.state == "succeeded" and "~" in event.goal_id and event.goal_id not in self.state.goals:
            self.people.late(event.agent, event.goal_id)
        self.fleet.on_goal_event(event, wall)
        if self.rules.looks and event.status is not None:
            self.rules.on_status(event.status.id)

    def _timer(self, due: tm.Timer) -> None:
        core = self.core
        first = core.next_deadline()
        assert first is not None, f"no deadline is set, but {due} was given"
        assert first[1] == due, f"the next deadline is {first}, not {due}"
        assert first[0] <= core.now, f"the deadline {first} is not due at {core.now}"
        core.emit(ch.DeadlineSet(due, None))
        match due:
            case tm.NodeDue(task, node):
                core.due.add((task, node))
                core.wake(task, node)
            case tm.AllocationDue():
                self.allocation.look()
            case tm.TurnDue():
                self.wake_queue.go_on()
            case tm.TaskDue(_, "not_before"):
                self.allocation.look()
            case tm.TaskDue(task, "deadline"):
                self.timing.late(task)
            case tm.TaskDue():
                self.tasks.on_deadline(due)
            case tm.HopelessDue(task, node):
                if node or core.task(task).status == "PENDING":
                    self.allocation.look()
            case tm.HomeOverdue(task, agent):
                self.recovery.overdue(task, agent)
            case tm.HomeAgain(task, agent):
                self.recovery.try_again(task, agent)
            case tm.WayDue(goal):
                self.gatekeeper.room.waited_enough(goal)
            case tm.AsideDue(goal):
                self.gatekeeper.waited(goal)
            case tm.PortDue(goal):
                self.gatekeeper.room.port_waited(goal)
            case tm.EscalationDue(question):
                self.people.escalate(question)
            case tm.StrayDue(agent):
                self.fleet.on_stray_due(agent)
            case tm.OrderDue(agent):
                self.orders.on_deadline(agent)
            case tm.ClearanceDue() | tm.ClearanceAgain():
                self.clearances.on_deadline(due)
            case tm.AlarmDue():
                self.alarms.on_deadline(due)
            case tm.RuleDue():
                self.rules.on_deadline(due)
            case _:
                assert_never(due)

    def _wall(self, due: tm.WallTimer, at: Micros) -> None:
        match due:
            case tm.LiveDue(agent):
                self.fleet.on_live_due(agent, at)
            case tm.AcceptDue() | tm.CancelDue() | tm.GraceDue() | tm.UpdateDue():
                self.goals.on_wall(due)
            case tm.ResumeDue() | tm.AskDue():
                self.reconcile.on_wall(due)
            case _:
                assert_never(due)

    def _hear(self, news: nw.News) -> None:
        """Hand what a part reports on to the part that it concerns."""
        match news:
            case nw.StatusTaken(agent, ended):
                self.breaches.look(agent, ended)
            case nw.Landed(task, agent):
                self.system_tasks.grounded(task, agent)
            case nw.Flies(agent):
                self.system_tasks.flies(agent)
            case nw.CameBack(agent):
                self.system_tasks.start_recover(agent)
            case nw.UnreadableMessage(agent, text):
                self.fleet.on_bad(agent, text)
            case nw.GoalUnreachable(agent):
                self.fleet.on_unreachable(agent)
            case nw.MustLeave(agent, why):
                self.fleet.quarantine(agent, why)
            case nw.TakenOver(goal):
                self.fleet.on_taken_over(goal)
            case nw.Leaves(agent):
                self.orders.forget(agent)
                self.by_hand.forget(agent)
            case nw.Left(task, agent):
                self.tasks.on_agent_left(task, agent)
            case nw.Idle(agent):
                self.orders.bring_home_if_idle(agent, "engine")
            case nw.Stopped(agent):
                self.orders.go_on(agent)
            case nw.NoWayHome(agent, why):
                self.orders.no_way_home(agent, why)
            case nw.ClearanceDenied(task, why):
                self.tasks.fail(task, "no_clearance", why)
            case nw.Unwanted(order):
                with suppress(TaskError):  # it is ending already
                    self.tasks.abort(order)
            case nw.AllHome(task):
                self.tasks.end(task)
            case nw.TaskEnds(task, is_over):
                self.orders.ended_by_word(task, is_over=is_over)
            case nw.StepsStopped(task):
                self.orders.cleanup_goes_on(task)
            case nw.EventKept(kept):
                self.rules.on_event(kept)
            case nw.CarriedOut(record):
                self.orders.carried_out(record)
            case _:
                assert_never(news)

    def _settle(self) -> None:
        """Go on until nothing is woken, no answer is waiting, and no goal may leave that could not before."""
        core = self.core
        for _ in range(SETTLE_LIMIT):
            if core.answered:
                self._answers()
            elif core.touched:
                touched, core.touched = core.touched, {}
                for task_id in self.wake_queue.of(touched):
                    core.at_work = task_id
                    self.tasks.settle(task_id)
            elif core.stale:
                if core.state.lockdown is not None:
                    self.lockdowns.review(core.stale)
                if core.state.orders:
                    self.orders.review(core.stale)
                self.gatekeeper.review()
            else:
                if core.index.free_people:
                    self.people.pump()
                return
        raise AssertionError("the step does not settle")

    def _answers(self) -> None:
        core = self.core
        answered, core.answered = core.answered, []
        for goal_id in answered:
            question = self.people.on_goal_ended(goal_id)
            if question is None or question.reply is None:
                continue
            if question.kind == "clearance":
                self.clearances.on_answer(question)
                continue
            if question.clears and question.reply["answer"] in question.clears_on:
                self.clearances.grant(question.clears, question.reply["by"])
            core.wake(question.task, question.owner)


def _look(task_id: str) -> None:
    """Nobody wants to know which task is rebuilt."""
