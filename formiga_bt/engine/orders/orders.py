"""Orders that rank above every task: the four stops, continue, handback, restart.

| stop | in the air | on the ground |
|---|---|---|
| hold | what runs is canceled, it hovers; at reserve + 3 min it becomes a return | stands |
| return | a system task flies the type's `recover` with safety goals | at its port: done; elsewhere: `fetch` |
| land | a system task flies the type's `land`, to the nearest spot away from known people | done |
| cut | one safety goal of an announced action with `cuts`; then QUARANTINED until a person clears it | the same |

What drives is on the ground: `hold` and `land` cancel its goals and it stands until a person decides, `return` drives it to a
station by its type's `recover`. What never moves finishes its motion and gets no new goal: `return` and `land` are a `hold`.

A `StandingOrder` stands until what it was given for is continued, ended or released; the engine's own until it is done. While
it stands the gate lets nothing but its own goals to the machine, and the allocator grants nobody the machine. The interrupted
goals of its task wait as `interrupted`; `continue` has their steps send them anew.
"""

from collections.abc import Iterable
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import horizontal_m
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.goals.clearances import Clearances
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import OperatorHold, waits_for_word
from formiga_bt.engine.kernel.core import EVERYTHING, Core
from formiga_bt.engine.kernel.holds import hold, unhold
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder, Stop, TaskRecord
from formiga_bt.engine.kernel.timers import OrderDue
from formiga_bt.engine.orders.continuing import cannot, is_done, obstacle, waiting
from formiga_bt.engine.resting import is_at_home
from formiga_bt.engine.tasks.recovery import NO_PORT, Recovery, has_no_port
from formiga_bt.engine.tasks.system_tasks import SystemTasks
from formiga_bt.safety.gate import AT_PORT_M

RANK: Final = {"agent": 0, "all": 1, "task": 2, "lockdown": 3, "engine": 4}
"""Who may end an order: one of a lower number stands longer."""

BREACH_HOLD_US: Micros = 5 * SECOND
"""After a breach that says hold, the machine stops so long, then returns."""

NAMES: Final = {"return": "Return", "land": "Land"}
"""System tasks that carry out orders."""


def _meaning(agent: AgentRecord, stop: Stop) -> Stop:
    """Return what a stop means for a machine: what does not fly never lands, what never moves never returns."""
    if agent.mobility == "ground":
        return "hold" if stop == "land" else stop
    return stop if agent.flies or stop == "cut" else "hold"


class StandingOrders:
    """All standing orders, and lockdown."""

    def __init__(
        self,
        core: Core,
        fleet: Fleet,
        goals: Goals,
        clearances: Clearances,
        recovery: Recovery,
        system_tasks: SystemTasks,
    ) -> None:
        self._core = core
        self._fleet = fleet
        self._goals = goals
        self._clearances = clearances
        self._recovery = recovery
        self._system_tasks = system_tasks
        self._replaced = ""
        """Whose order is being replaced: what carried out the old one ends, and its machine waits for the new one."""

    # -- stops ---------------------------------------------------------------------------------------------------
    def stop(
        self, agent: AgentRecord, stop: Stop, by: str, scope: str, *, why: str = "", strict: bool = True
    ) -> None:  # fmt: skip
        """Put an order on a machine. `strict`: say why it cannot be; else such a machine is passed over."""
        core = self._core
        stop = _meaning(agent, stop)
        problem = self.refusal(agent, stop)
        if problem and (strict or problem[0] != "not_in_command"):
            if strict:
                raise TaskError(*problem)
            return
        if stop == "hold" and not why and agent.landed != "grounded" and not self._clearances.patience_us(agent):
            stop = "return"  # it has nothing left to hover on
        old = core.state.orders.get(agent.id)
        if old is not None and old.state != "failed" and old.stop in ("cut", stop):
            if old.stop == stop and RANK[scope] < RANK[old.scope]:
                self.put(replace(old, scope=scope, by=by))
                self._hold_task(agent, scope)
            elif old.stop != stop and strict:
                raise TaskError("cut", f"the motors of {agent.id} were ordered to be cut")
            return
        if old is not None:
            self.withdraw(old, replaced=True)
        self.put(StandingOrder(agent=agent.id, stop=stop, by=by, scope=scope, why=why, at=core.now))  # type: ignore[arg-type]
        self._hold_task(agent, scope)
        if self._recovered_by_its_task(agent, core.state.orders[agent.id]):
            self.put(replace(core.state.orders[agent.id], task=agent.task))
            self.resume(agent)
            return
        if agent.mobility in MOVING and not (stop == "return" and self._lands_at_home(agent)):
            self._goals.interrupt_all(agent.id)
        if stop == "hold" and agent.flies:
            patience = BREACH_HOLD_US if why else self._clearances.patience_us(agent)
            core.set_deadline(OrderDue(agent.id), core.now + patience)
        self.advance(agent.id)

    def refusal(self, agent: AgentRecord, stop: str) -> tuple[str, str] | None:
        """Return (code, text) of why a machine cannot be ordered now, or None."""
        # One that was ours is quarantined: what needs no place and no height still reaches it.
        may = agent.pool == "QUARANTINED" and stop in ("hold", "cut")
        if agent.refused and not may:
            return "not_admitted", f"{agent.id} is not admitted: {agent.refused}"
        if agent.liveness == "LOST":
            return (
                "agent_lost",
                f"{agent.id} is lost; when it is heard of again it is asked what it does and brought home",
            )
        if agent.control != "engine" or agent.taken:
            who = "its pilot has it" if agent.control == "pilot" else f"its control is {agent.control}"
            if agent.control == "engine":
                who = "it was taken over and not handed back"
            return (
                "not_in_command",
                f"{agent.id} is not the engine's to command: {who}; formiga handback {agent.id} ends that",
            )
        if stop == "cut" and not self._cut_action(agent):
            return "not_announced", f"{agent.id} announces no action that cuts its motors"
        return None

    def _cut_action(self, agent: AgentRecord) -> str:
        return next((name for name in agent.actions if self._core.action(name).cuts), "")

    def _hold_task(self, agent: AgentRecord, scope: str) -> None:
        """The task of a machine that was stopped waits for a person; a way home that goes on anyway is not held."""
        task = self._core.state.tasks.get(agent.task)
        order = self._core.state.orders[agent.id]
        if task is None or task.system.agent or (task.section == "recover" and order.stop == "return"):
            return
        if scope in ("agent", "all"):
            hold(self._core, task.id, OperatorHold(agent.id))

    def put(self, order: StandingOrder) -> None:
        """Record an order."""
        self._core.emit(ch.OrderPut(order.agent, order))
        self._core.stale.add(order.agent)

    def withdraw(self, order: StandingOrder, *, replaced: bool = False, is_over: bool = False) -> None:
        """An order stands no more: what carries it out ends; its machine hovers until the next word.

        Args:
            order: stands no more.
            replaced: by another one.
            is_over: the task of its machine has nothing left to do, also no way home.
        """
        core = self._core
        core.clear_deadline(OrderDue(order.agent))
        core.emit(ch.OrderPut(order.agent, None))
        core.stale.add(order.agent)
        task = core.state.tasks.get(order.task)
        if task is not None and task.system.stop and task.section != "done":
            self._replaced = order.agent if replaced else ""
            self._system_tasks.end(task.id)
            self._replaced = ""
        if not replaced:
            if not is_over:
                self._system_tasks.ordered_home(core.state.agents[order.agent].task)
            self.bring_home_if_idle(order.agent, order.by)

    def bring_home_if_idle(self, agent_id: str, by: str) -> None:
        """A machine in the air that belongs to nobody any more comes home: it never hovers with no task and no order."""
        agent = self._core.state.agents[agent_id]
        nobody = not agent.task and not agent.human and agent.pool != "QUARANTINED"
        if nobody and agent.landed != "grounded" and agent_id not in self._core.state.orders:
            self.stop(agent, "return", by, "engine", why="idle", strict=False)

    # -- carrying out --------------------------------------------------------------------------------------------
    def review(self, stale: Iterable[str]) -> None:
        """Machines changed: go on with their orders."""
        core = self._core
        agents, orders = core.state.agents, core.state.orders
        if not orders:
            return
        names = list(agents) if EVERYTHING in stale else [name for name in stale if name in agents]
        names.sort(key=lambda name: agents[name].order)
        for name in names:
            if name in orders:
                self.advance(name)

    def advance(self, agent_id: str) -> None:
        """Take the next step of a machine's order, if it is time for one."""
        core = self._core
        order = core.state.orders.get(agent_id)
        if order is None or order.state != "open":
            return
        agent = core.state.agents[agent_id]
        carrier = core.state.tasks.get(order.task)
        if carrier is not None and carrier.section != "done" and (carrier.system.stop or agent.task == carrier.id):
            return
        busy = self.is_busy(agent_id)
        if agent.control != "engine" or agent.taken or agent.liveness == "LOST":
            return
        if order.stop == "hold":
            if not busy:
                self._settle(order)
        elif order.stop == "cut":
            self._cut(agent, order)
        elif busy and (agent.landed == "grounded" or order.stop == "land" or self._lands_at_home(agent)):
            return  # rotors may be starting; where it comes to stand is known when that goal has ended
        elif agent.landed == "grounded" and (order.stop == "land" or is_at_home(core, agent)):
            self._settle(order)
        elif self._recovered_by_its_task(agent, order):
            self.put(replace(order, task=agent.task))
        else:
            self._start(agent, order)

    def is_busy(self, agent_id: str) -> bool:
        """Return whether a machine has a goal in flight."""
        return any(goal.in_flight for goal in self._core.index.goals_of(agent_id))

    def _recovered_by_its_task(self, agent: AgentRecord, order: StandingOrder) -> bool:
        task = self._core.state.tasks.get(agent.task)
        if order.stop != "return" or task is None or task.section != "recover" or agent.landed == "grounded":
            return False
        return self._recovery.is_under_way(task.id, agent.id)

    def _lands_at_home(self, agent: AgentRecord) -> bool:
        """Return whether it comes down on its own port now: that is finished."""
        goal, port = self._core.state.goals.get(agent.goal), self._core.site.ports.get(agent.home)
        if goal is None or port is None or not goal.in_flight or goal.cancel_asked:
            return False
        spec = self._core.action(goal.action)
        target = goal.fields.get(spec.moves_to)
        return spec.lands and target is not None and horizontal_m(target, port.at) <= AT_PORT_M

    def _start(self, agent: AgentRecord, order: StandingOrder) -> None:
        kind = self._core.agent_type(agent)
        if order.stop == "return" and agent.landed != "grounded" and has_no_port(self._core, agent):
            self.no_way_home(agent.id, NO_PORT)
            return
        way = kind.way("land" if order.stop == "land" else "fetch" if agent.landed == "grounded" else "recover")
        if way is None:
            self.put(replace(order, state="failed"))
            text = f"{agent.id} cannot {order.stop}: its type {agent.type} has no way to"
            self._core.effect(Alarm("agent_needs_help", text, agent.task, agent.id))
            return
        self.put(replace(order, task=self._system_tasks.next_id(NAMES[order.stop])))
        self._system_tasks.start_order(NAMES[order.stop], agent.id, order.stop, order.by)

    def _cut(self, agent: AgentRecord, order: StandingOrder) -> None:
        core = self._core
        goal = core.state.goals.get(order.goal)
        if not order.goal:
            goal_id = f"safety/{agent.id}/{core.count('safety')}"
            self.put(replace(order, goal=goal_id))
            self._goals.order_safety(goal_id, agent.id, self._cut_action(agent))
        elif goal is None and agent.landed == "grounded":
            text = f"the motors of {agent.id} were cut; look at it, then formiga agents clear {agent.id}"
            core.effect(Alarm("cut", text, agent.task, agent.id))
            self._goals.lose(agent.id, "lost")
            self._fleet.quarantine(agent.id, "cut")
        elif goal is None:
            self.put(replace(order, state="failed"))
            core.effect(Alarm("agent_needs_help", f"{agent.id} did not cut its motors", agent.task, agent.id))

    def _settle(self, order: StandingOrder) -> None:
        agent = self._core.state.agents[order.agent]
        if order.scope == "engine" and (agent.flies or order.stop != "hold"):
            self.withdraw(order)
            self.resume(agent, steps=False)
        else:
            self.put(replace(order, state="done"))
            if agent.landed == "grounded":  # a way home, or a cleanup in the air, has nothing left to do
                core = self._core
                for goal in waiting(core.state, agent):
                    homewards = goal.section != "steps" and goal.state == "interrupted"
                    if homewards and (why := cannot(core.state, goal, agent, core.action)):
                        self._goals.end(goal.id, "canceled", "cannot_continue", why)
            self._system_tasks.ordered_home(agent.task)

    def carried_out(self, task: TaskRecord) -> None:
        """A system task that carried out an order ended, well or not."""
        core = self._core
        order = core.state.orders.get(task.system.agent)
        if order is None:  # it was withdrawn while the machine started: that ended in the air
            if task.system.agent != self._replaced:
                self.bring_home_if_idle(task.system.agent, task.request.by)
            return
        if order.task != task.id:
            return
        agent = core.state.agents[task.system.agent]
        core.stale.add(agent.id)
        if agent.landed == "grounded":
            if not agent.flies and not is_at_home(core, agent):
                text = f"{agent.id} did not get home: it stands where it is"
                core.effect(Alarm("agent_needs_help", text, agent.task, agent.id))
            self._settle(replace(order, task=""))
        elif task.outcome.notes and task.outcome.notes[-1].startswith("envelope.") and order.stop == "return":
            self.no_way_home(agent.id, task.outcome.notes[-1])
        elif agent.pool == "QUARANTINED":
            self.put(replace(order, task="", state="failed"))
        else:
            self.put(replace(order, task=""))
        self._system_tasks.ordered_home(agent.task)

    def no_way_home(self, agent_id: str, why: str) -> None:
        """No legal leg leads home: the machine lands where it is."""
        core = self._core
        agent = core.state.agents[agent_id]
        old = core.state.orders.get(agent_id)
        then = "lands" if agent.flies else "stands"
        core.effect(Alarm("no_way_home", f"{agent_id} finds no legal way home and {then}: {why}", agent.task, agent_id))
        if old is not None:
            core.emit(ch.OrderPut(agent_id, None))
        scope = old.scope if old is not None else "engine"
        self.stop(agent, "land", old.by if old else "engine", scope, why=why.split(" ", 1)[0].rstrip(":"), strict=False)

    def on_deadline(self, agent_id: str) -> None:
        """A machine that was told to hold has hovered long enough: it returns by itself."""
        core = self._core
        order = core.state.orders.get(agent_id)
        if order is None or order.stop != "hold":
            return
        agent = core.state.agents[agent_id]
        if agent.landed == "grounded" and not self.is_busy(agent_id):
            return
        if not order.why:
            text = f"{agent_id} has hovered until its reserve was near and returns"
            core.effect(Alarm("hold_over", text, agent.task, agent_id))
        self.stop(agent, "return", order.by, order.scope, why=order.why, strict=False)

    def forget(self, agent_id: str) -> None:
        """A machine was quarantined: no order of the kind stands on it; it comes home when it can."""
        order = self._core.state.orders.get(agent_id)
        if order is not None:
            self.withdraw(order, replaced=True)

    # -- goals that wait -----------------------------------------------------------------------------------------
    def machines_of(self, task: TaskRecord) -> list[AgentRecord]:
        """Return the machines that a task holds; of a system task, the one that it commands."""
        agents = self._core.state.agents
        mine = [task.system.agent] if task.system.agent else list(task.agents.granted)
        return [a for a in (agents[name] for name in mine) if not a.human and (a.task == task.id or task.system.agent)]

    def resume(self, agent: AgentRecord, *, steps: bool = True) -> None:
        """The steps of a machine's interrupted goals send them anew; what waits at the gate reads its fields anew.

        `steps=False`: only cleanup and the way home, which wait for no person's word. What can no longer be done ends.
        """
        core = self._core
        for goal in waiting(core.state, agent):
            if goal.section == "steps" and not steps and not core.task(goal.task).outcome.status:
                continue  # once its end is decided, what is left of its steps is a `finally`
            if goal.state == "gated" and goal.code not in ("stopped", "held", "lockdown", "control", "clearance"):
                continue
            why = cannot(core.state, goal, agent, core.action)
            if goal.stopping:
                self._goals.go_on(goal.id)
            elif is_done(goal, agent, core.action):
                self._goals.end(goal.id, "succeeded")
            elif why:
                self._goals.end(goal.id, "canceled", "cannot_continue", why)
            else:
                self._goals.again(goal.id)

    def go_on(self, agent_id: str) -> None:
        """A machine has stopped, and a person has said continue already."""
        agent = self._core.state.agents[agent_id]
        if obstacle(self._core.state, agent, self._core.action) is None:
            self.resume(agent)
        elif agent.task:
            hold(self._core, agent.task, OperatorHold(agent_id))  # a person must say what else

    # -- ends ------------------------------------------------------------------------------------------------------
    def ended_by_word(self, task_id: str, *, is_over: bool = False) -> None:
        """A person ends a task, or it is over: it is held no more; machines that hover for it are free to come home."""
        core = self._core
        task = core.task(task_id)
        if task.system.agent:
            return  # the order that it carries out is another task's
        for agent in self.machines_of(task):
            order = core.state.orders.get(agent.id)
            if order is None or order.scope == "lockdown":
                continue
            if order.stop == "hold":
                self._lift(order, agent, is_over=is_over)
            elif order.scope == "task":
                self.put(replace(order, scope="engine"))
                if order.state != "open":
                    self._lift(order, agent, is_over=is_over)
        for cause in core.task(task_id).hold.causes:
            if waits_for_word(cause):
                unhold(core, task_id, cause)

    def cleanup_goes_on(self, task_id: str) -> None:
        """The steps of a task were stopped on a person's word: each `finally` of them that an order had stopped goes on."""
        for agent in self.machines_of(self._core.task(task_id)):
            if agent.id not in self._core.state.orders and agent.control == "engine" and not agent.taken:
                self.resume(agent, steps=False)

    def _lift(self, order: StandingOrder, agent: AgentRecord, *, is_over: bool = False) -> None:
        """An order ends with its task: cleanup, or a way home, that it stopped goes on."""
        self.withdraw(order, is_over=is_over)
        if not agent.taken:
            self.resume(agent, steps=False)

    # -- a breach ------------------------------------------------------------------------------------------------
    def breached(self, agent_id: str, name: str, reaction: Stop) -> None:
        """A machine broke its envelope: the engine brings it home, whatever its task does."""
        agent = self._core.state.agents[agent_id]
        self.stop(agent, reaction, "engine", "engine", why=f"envelope.{name}", strict=False)
