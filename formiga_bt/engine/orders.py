"""Orders that rank above every task: the four stops, continue, handback, lockdown.

| stop | in the air | on the ground |
|---|---|---|
| hold | what runs is canceled, it hovers; at reserve + 3 min it becomes a return | stands |
| return | a system task flies the type's `recover` with safety goals | at its port: done; elsewhere: `fetch` |
| land | a system task flies the type's `land`, to the nearest spot away from known people | done |
| cut | one safety goal of an announced action with `cuts` | done |

A `StandingOrder` stands until what it was given for is continued, ended or released; the engine's own until it is done. While
it stands the gate lets nothing but its own goals to the machine, and the allocator grants nobody the machine. The interrupted
goals of its task wait as `interrupted`; `continue` has their steps send them anew.
"""

from collections.abc import Iterable
from typing import Final

from msgspec.structs import replace

from formiga_bt.clock import SECOND, Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.core import EVERYTHING, Core
from formiga_bt.engine.fleet import Fleet
from formiga_bt.engine.goals import Goals
from formiga_bt.engine.holds import hold, unhold
from formiga_bt.engine.inputs import Alarm, LockdownOrder, Operator
from formiga_bt.engine.ports import ClearancePort
from formiga_bt.engine.records import AgentRecord, GoalRecord, Lockdown, StandingOrder, Stop, TaskRecord
from formiga_bt.engine.tasks import Tasks
from formiga_bt.errors import TaskError

RANK: Final = {"agent": 0, "all": 1, "task": 2, "lockdown": 3, "engine": 4}
"""Who may end an order: one of a lower number stands longer."""

BREACH_HOLD_US: Micros = 5 * SECOND
"""After a breach that says hold, the machine stops so long, then returns."""

NAMES: Final = {"return": "Return", "land": "Land"}
"""System tasks that carry out orders."""


class Orders:
    """All standing orders, and lockdown."""

    def __init__(self, core: Core, fleet: Fleet, goals: Goals, clearances: ClearancePort, tasks: Tasks) -> None:
        self._core = core
        self._fleet = fleet
        self._goals = goals
        self._clearances = clearances
        self._tasks = tasks

    # -- a person's word -----------------------------------------------------------------------------------------
    def give(self, given: Operator) -> None:
        """Carry out an order of a person.

        Raises:
            TaskError: it cannot be, and nothing was changed.
        """
        match given.order:
            case "clear":
                self._clear(self._machine(given.target))
            case "handback_continue" | "handback_return" | "handback_end":
                self._hand_back(self._machine(given.target), given.order.removeprefix("handback_"), given.by)
            case "continue":
                self._continue(given.target)
            case "restart":
                self._restart(given.target, given.by)
            case "cut":
                self._stop(self._machine(given.target), "cut", given.by, "agent")
            case "hold" | "return" | "land":
                self._stops(given.target, given.order, given.by)

    def _machine(self, name: str) -> AgentRecord:
        agent = self._core.state.agents.get(name)
        if agent is None:
            raise TaskError("unknown_agent", f"there is no agent '{name}'" if name else "this order is for one agent")
        if agent.human:
            raise TaskError("human", f"{name} is a person; orders are for machines")
        return agent

    def _task(self, name: str) -> TaskRecord:
        task = self._core.state.tasks.get(name)
        if task is None:
            raise TaskError("unknown_target", f"there is no agent and no task '{name}'")
        if task.section == "done":
            raise TaskError("already_ended", f"{name} has ended: {task.status}")
        if task.status == "PENDING":
            raise TaskError(
                "not_started", f"{name} waits for its agents and has started nothing; abort it if it shall not"
            )
        return task

    def _stops(self, target: str, stop: Stop, by: str) -> None:
        core = self._core
        if target in core.state.agents:
            self._stop(self._machine(target), stop, by, "agent")
        elif target:
            task = self._task(target)
            if not task.system_agent:
                hold(core, task.id, "operator")
            for agent in self._machines_of(task):
                self._stop(agent, stop, by, "task", strict=False)
        else:
            for agent in [a for a in core.state.agents.values() if not a.human and not a.refused]:
                self._stop(agent, stop, by, "all", strict=False)

    def _machines_of(self, task: TaskRecord) -> list[AgentRecord]:
        agents = self._core.state.agents
        mine = [task.system_agent] if task.system_agent else list(task.granted)
        return [a for a in (agents[name] for name in mine) if not a.human and (a.task == task.id or task.system_agent)]

    # -- stops ---------------------------------------------------------------------------------------------------
    def _stop(
        self, agent: AgentRecord, stop: Stop, by: str, scope: str, *, why: str = "", strict: bool = True
    ) -> None:  # fmt: skip
        """Put an order on a machine. `strict`: say why it cannot be; else such a machine is passed over."""
        core = self._core
        problem = self._refusal(agent, stop)
        if problem and (strict or problem[0] != "not_in_command"):
            if strict:
                raise TaskError(*problem)
            return
        old = core.state.orders.get(agent.id)
        if old is not None and (old.stop == "cut" or (old.stop == stop and old.state != "failed")):
            if old.stop == stop and RANK[scope] < RANK[old.scope]:
                self._put(replace(old, scope=scope, by=by))
                self._hold_task(agent, scope)
            elif old.stop != stop and strict:
                raise TaskError("cut", f"the motors of {agent.id} were ordered to be cut")
            return
        if old is not None:
            self._withdraw(old)
        self._put(StandingOrder(agent=agent.id, stop=stop, by=by, scope=scope, why=why, at=core.now))  # type: ignore[arg-type]
        self._hold_task(agent, scope)
        if self._recovered_by_its_task(agent, core.state.orders[agent.id]):
            self._put(replace(core.state.orders[agent.id], task=agent.task))
            self._resume(agent)
            return
        self._goals.interrupt_all(agent.id)
        if stop == "hold":
            patience = BREACH_HOLD_US if why else self._clearances.patience_us(agent)
            core.set_deadline(f"order|{agent.id}", core.now + patience)
        self.advance(agent.id)

    def _refusal(self, agent: AgentRecord, stop: str) -> tuple[str, str] | None:
        if agent.refused:
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
        if task is None or task.system_agent or (task.section == "recover" and order.stop == "return"):
            return
        if scope in ("agent", "all"):
            hold(self._core, task.id, f"operator:{agent.id}")

    def _put(self, order: StandingOrder) -> None:
        self._core.emit(ch.OrderPut(order.agent, order))
        self._core.stale.add(order.agent)

    def _withdraw(self, order: StandingOrder) -> None:
        """An order stands no more: what carries it out ends; its machine hovers until the next word."""
        core = self._core
        core.clear_deadline(f"order|{order.agent}")
        core.emit(ch.OrderPut(order.agent, None))
        core.stale.add(order.agent)
        task = core.state.tasks.get(order.task)
        if task is not None and task.stop and task.section != "done":
            self._tasks.end_system(task.id)
        self._tasks.poke_allocator()

    # -- carrying out --------------------------------------------------------------------------------------------
    def review(self, stale: Iterable[str]) -> None:
        """Machines changed: go on with their orders; in lockdown, what is newly under our control in the air is pressed."""
        core = self._core
        agents = core.state.agents
        names = list(agents) if EVERYTHING in stale else [name for name in agents if name in stale]
        for name in names:
            if core.state.lockdown is not None:
                self._press(agents[name], core.state.lockdown)
            self.advance(name)

    def advance(self, agent_id: str) -> None:
        """Take the next step of a machine's order, if it is time for one."""
        core = self._core
        order = core.state.orders.get(agent_id)
        if order is None or order.state != "open":
            return
        agent = core.state.agents[agent_id]
        carrier = core.state.tasks.get(order.task)
        if carrier is not None and carrier.section != "done" and (carrier.stop or agent.task == carrier.id):
            return
        busy = self._busy(agent_id)
        if agent.control != "engine" or agent.taken or agent.liveness == "LOST":
            return
        if order.stop == "hold":
            if not busy:
                self._settle(order)
        elif order.stop == "cut":
            self._cut(agent, order)
        elif agent.landed == "grounded" and busy:
            return  # rotors may be starting: the end of that goal tells
        elif agent.landed == "grounded" and (order.stop == "land" or self._fleet.at_port(agent)):
            self._settle(order)
        elif self._recovered_by_its_task(agent, order):
            self._put(replace(order, task=agent.task))
        else:
            self._start(agent, order)

    def _busy(self, agent_id: str) -> bool:
        return any(g.agent == agent_id and g.in_flight for g in self._core.state.goals.values())

    def _recovered_by_its_task(self, agent: AgentRecord, order: StandingOrder) -> bool:
        task = self._core.state.tasks.get(agent.task)
        return order.stop == "return" and task is not None and task.section == "recover" and agent.landed != "grounded"

    def _start(self, agent: AgentRecord, order: StandingOrder) -> None:
        kind = self._core.agent_type(agent)
        way = kind.land if order.stop == "land" else kind.fetch if agent.landed == "grounded" else kind.recover
        if way is None:
            self._put(replace(order, state="failed"))
            text = f"{agent.id} cannot {order.stop}: its type {agent.type} has no way to"
            self._core.effect(Alarm("agent_needs_help", text, agent.task, agent.id))
            return
        self._put(replace(order, task=self._tasks.next_system_id(NAMES[order.stop])))
        self._tasks.start_order(NAMES[order.stop], agent.id, order.stop, order.by)

    def _cut(self, agent: AgentRecord, order: StandingOrder) -> None:
        core = self._core
        goal = core.state.goals.get(order.goal)
        if agent.landed == "grounded" and (goal is None or goal.ended):
            self._settle(order)
            return
        if order.goal:
            if goal is None:
                self._put(replace(order, state="failed"))
                core.effect(Alarm("agent_needs_help", f"{agent.id} did not cut its motors", agent.task, agent.id))
            return
        goal_id = f"safety/{agent.id}/{core.count('safety')}"
        self._put(replace(order, goal=goal_id))
        self._goals.order_safety(goal_id, agent.id, self._cut_action(agent))

    def _settle(self, order: StandingOrder) -> None:
        if order.scope == "engine":
            self._withdraw(order)
        else:
            self._put(replace(order, state="done"))

    def carried_out(self, task: TaskRecord) -> None:
        """A system task that carried out an order ended, well or not."""
        core = self._core
        order = core.state.orders.get(task.system_agent)
        if order is None or order.task != task.id:
            return
        agent = core.state.agents[task.system_agent]
        core.stale.add(agent.id)
        if agent.landed == "grounded":
            self._settle(replace(order, task=""))
        elif task.notes and task.notes[-1].startswith("envelope.") and order.stop == "return":
            self.no_way_home(agent.id, task.notes[-1])
        elif agent.pool == "QUARANTINED":
            self._put(replace(order, task="", state="failed"))
        else:
            self._put(replace(order, task=""))
        self._tasks.ordered_home(agent.task)

    def no_way_home(self, agent_id: str, why: str) -> None:
        """No legal leg leads home: the machine lands where it is."""
        core = self._core
        agent = core.state.agents[agent_id]
        old = core.state.orders.get(agent_id)
        core.effect(Alarm("no_way_home", f"{agent_id} finds no legal way home and lands: {why}", agent.task, agent_id))
        if old is not None:
            core.emit(ch.OrderPut(agent_id, None))
        scope = old.scope if old is not None else "engine"
        self._stop(
            agent, "land", old.by if old else "engine", scope, why=why.split(" ", 1)[0].rstrip(":"), strict=False
        )

    def on_deadline(self, agent_id: str) -> None:
        """A machine that was told to hold has hovered long enough: it returns by itself."""
        core = self._core
        order = core.state.orders.get(agent_id)
        if order is None or order.stop != "hold":
            return
        agent = core.state.agents[agent_id]
        if agent.landed == "grounded" and not self._busy(agent_id):
            return
        if not order.why:
            text = f"{agent_id} has hovered until its reserve was near and returns"
            core.effect(Alarm("hold_over", text, agent.task, agent_id))
        self._stop(agent, "return", order.by, order.scope, why=order.why, strict=False)

    def forget(self, agent_id: str) -> None:
        """A machine was quarantined: no order of the kind stands on it; it comes home when it can."""
        order = self._core.state.orders.get(agent_id)
        if order is not None:
            self._withdraw(order)

    # -- continue ------------------------------------------------------------------------------------------------
    def _continue(self, target: str) -> None:
        core = self._core
        if core.state.lockdown is not None:
            raise TaskError("lockdown", "lockdown is on; formiga lockdown release comes first")
        if target in core.state.agents:
            agent = self._machine(target)
            self._continue_machines([agent], target)
        elif target:
            task = self._task(target)
            self._continue_machines(self._machines_of(task), target)
        else:
            for task_id in list(core.open):
                if any(cause.startswith("operator") for cause in core.task(task_id).held):
                    self._try_continue(task_id)
            for name in list(core.state.orders):
                self._try_continue(name)

    def _try_continue(self, target: str) -> None:
        try:
            self._continue(target)
        except TaskError:
            return  # it stays held, which `why` explains

    def _continue_machines(self, machines: list[AgentRecord], target: str) -> None:
        core = self._core
        tasks = {t.id: t for t in (core.state.tasks.get(a.task) for a in machines) if t is not None}
        if target in core.state.tasks:
            tasks[target] = core.task(target)
        held = any(c.startswith("operator") for t in tasks.values() for c in t.held)
        ordered = [core.state.orders[a.id] for a in machines if a.id in core.state.orders]
        if not held and not ordered:
            raise TaskError("not_held", f"{target} was not stopped, there is nothing to continue")
        for agent in machines:
            self._check_can_continue(agent)
        for order in ordered:
            self._withdraw(order)
        for task in tasks.values():
            for cause in task.held:
                mine = cause == "operator" or cause.removeprefix("operator:") in [a.id for a in machines]
                if cause.startswith("operator") and (mine or target == task.id):
                    unhold(core, task.id, cause)
        for agent in machines:
            self._resume(agent)
        self._tasks.poke_allocator()

    def _check_can_continue(self, agent: AgentRecord) -> None:
        core = self._core
        if agent.control != "engine" or agent.taken:
            raise TaskError(*(self._refusal(agent, "") or ("not_in_command", "")))
        order = core.state.orders.get(agent.id)
        carrier = core.state.tasks.get(order.task) if order is not None else None
        if order is not None and (order.stop == "cut" and order.state == "open"):
            raise TaskError("cut", f"the motors of {agent.id} were ordered to be cut")
        if carrier is not None and carrier.section != "done" and agent.landed != "grounded":
            assert order is not None
            text = f"{agent.id} is on its way ({order.stop}); let it end, or formiga hold {agent.id} first"
            raise TaskError("order_under_way", text)
        for goal in self._waiting(agent):
            text = self._cannot(goal, agent)
            if text and goal.section == "steps":
                raise TaskError(
                    "cannot_continue", f"{text}; formiga restart {goal.task} begins anew, formiga abort ends it"
                )

    def _waiting(self, agent: AgentRecord) -> list[GoalRecord]:
        goals = self._core.state.goals.values()
        return [g for g in goals if g.agent == agent.id and g.task and g.state in ("interrupted", "gated")]

    def _cannot(self, goal: GoalRecord, agent: AgentRecord) -> str:
        spec = self._core.action(goal.action)
        if goal.state == "interrupted" and not spec.repeatable:
            return f"{goal.action} of {agent.id} may not be done a second time"
        if spec.requires and agent.landed != spec.requires:
            return f"{goal.action} needs {agent.id} {spec.requires}, it is {agent.landed}"
        return ""

    def _resume(self, agent: AgentRecord) -> None:
        """The steps of a machine's interrupted goals send them anew; what waits at the gate reads its fields anew."""
        for goal in self._waiting(agent):
            if goal.state == "interrupted" and self._cannot(goal, agent):
                self._goals.end(goal.id, "canceled", "cannot_continue", self._cannot(goal, agent))
            elif goal.state == "interrupted" or goal.code in ("stopped", "held", "lockdown", "control"):
                self._goals.again(goal.id)

    # -- restart, abort ------------------------------------------------------------------------------------------
    def _restart(self, target: str, by: str) -> None:
        task = self._task(target)
        if task.system_agent:
            raise TaskError("system_task", f"{target} is the engine's own; nothing of it can be restarted")
        if task.section != "steps" or task.stopping:
            raise TaskError("already_ending", f"{target} is already ending")
        if self._core.state.lockdown is not None:
            raise TaskError("lockdown", "lockdown is on; formiga lockdown release comes first")
        for agent in self._machines_of(task):
            if agent.taken or agent.control != "engine":
                raise TaskError(*(self._refusal(agent, "") or ("not_in_command", "")))
        self.ended_by_word(task.id)
        self._tasks.restart(task.id, "restart", f"by {by or 'an operator'}")

    def ended_by_word(self, task_id: str) -> None:
        """A person ends a task: it is held no more; machines that hover for it are free to come home."""
        core = self._core
        task = core.task(task_id)
        for agent in self._machines_of(task):
            order = core.state.orders.get(agent.id)
            if order is None or order.scope == "lockdown":
                continue
            if order.stop == "hold":
                self._withdraw(order)
            elif order.scope == "task":
                self._put(replace(order, scope="engine"))
                if order.state != "open":
                    self._withdraw(order)
        for cause in core.task(task_id).held:
            if cause.startswith("operator"):
                unhold(core, task_id, cause)

    # -- a pilot gives back ----------------------------------------------------------------------------------------
    def _hand_back(self, agent: AgentRecord, how: str, by: str) -> None:
        core = self._core
        if not agent.taken:
            raise TaskError("not_taken_over", f"{agent.id} was not taken over")
        if agent.control != "engine":
            raise TaskError("not_in_command", f"{agent.id} is still under the control of its {agent.control}")
        if how == "continue":
            for goal in self._waiting(agent):
                text = self._cannot(goal, agent)
                if text and goal.section == "steps":
                    raise TaskError(
                        "cannot_continue",
                        f"{text}; formiga handback {agent.id} --return or --end, or formiga abort {goal.task}",
                    )
        agent = core.put_agent(agent.id, taken=False)
        core.stale.add(agent.id)
        if how == "end":
            for goal in self._waiting(agent):
                if goal.state == "interrupted" and goal.section != "recover":
                    self._goals.end(goal.id, "taken_over")
        if how == "return":
            self._stop(agent, "return", by, "agent")
        for task_id in list(core.open):
            unhold(core, task_id, f"take-over:{agent.id}")
        if how != "return" and agent.id not in core.state.orders:
            self._resume(agent)
            if not agent.task and agent.landed != "grounded":
                self._stop(agent, "return", by, "engine", why="handback", strict=False)
        self._tasks.poke_allocator()

    def _clear(self, agent: AgentRecord) -> None:
        if agent.pool != "QUARANTINED":
            raise TaskError("not_quarantined", f"{agent.id} is not quarantined")
        if agent.liveness != "ALIVE":
            raise TaskError("not_alive", f"{agent.id} cannot be reached; it comes back by itself when it can")
        self._fleet.begin_return(agent.id)

    # -- a breach ------------------------------------------------------------------------------------------------
    def breached(self, agent_id: str, name: str, reaction: Stop) -> None:
        """A machine broke its envelope: the engine brings it home, whatever its task does."""
        agent = self._core.state.agents[agent_id]
        self._stop(agent, reaction, "engine", "engine", why=f"envelope.{name}", strict=False)

    # -- lockdown ------------------------------------------------------------------------------------------------
    def lockdown(self, given: LockdownOrder) -> None:
        """Press lockdown, change what flies does in it, or release it."""
        core = self._core
        old = core.state.lockdown
        if given.how == "release":
            if old is not None:
                self._release()
            return
        if old is not None and old.how == given.how:
            return
        now = Lockdown(given.how, given.by, core.now)
        core.emit(ch.LockdownPut(now))
        core.stale.add(EVERYTHING)
        core.effect(Alarm("lockdown", f"lockdown ({given.how}) by {given.by or 'an operator'}"))
        for task_id in list(core.open):
            if not core.task(task_id).system_agent:
                hold(core, task_id, "lockdown")
        for agent in list(core.state.agents.values()):
            self._press(agent, now, changed=old is not None)

    def _press(self, agent: AgentRecord, lockdown: Lockdown, *, changed: bool = False) -> None:
        core = self._core
        if agent.human or agent.refused or self._refusal(agent, lockdown.how) is not None:
            return
        if agent.landed == "grounded" and not self._busy(agent.id):
            return
        order = core.state.orders.get(agent.id)
        task = core.state.tasks.get(agent.task)
        if order is not None and (order.scope == "lockdown" or order.stop == "land") and not changed:
            return
        if order is not None and order.scope == "engine" and order.stop == lockdown.how:
            return
        if order is None and lockdown.how == "return" and task is not None and task.section == "recover":
            return  # it is on its way home already
        self._stop(agent, lockdown.how, lockdown.by, "lockdown", strict=False)

    def _release(self) -> None:
        core = self._core
        core.emit(ch.LockdownPut(None))
        core.stale.add(EVERYTHING)
        for task_id in list(core.open):
            task = core.task(task_id)
            if task.system_agent or "lockdown" not in task.held:
                continue
            goals = [g for g in core.state.goals.values() if g.task == task_id]
            stopped = any(a.id in core.state.orders for a in self._machines_of(task))
            if task.section == "steps" and (stopped or any(g.state == "interrupted" for g in goals)):
                hold(core, task_id, "operator")
            unhold(core, task_id, "lockdown")
        for order in list(core.state.orders.values()):
            if order.scope == "lockdown":
                self._let_go(order)
        self._tasks.poke_allocator()

    def _let_go(self, order: StandingOrder) -> None:
        """Lockdown ended: what it ordered is finished, what hovers waits with its task, goes on ending it, or comes home."""
        core = self._core
        agent = core.state.agents[order.agent]
        task = core.state.tasks.get(agent.task)
        if order.stop != "hold" and order.state == "open":
            self._put(replace(order, scope="engine"))
        elif order.stop == "hold" and task is not None and task.section == "steps":
            self._put(replace(order, scope="task"))
        else:
            self._withdraw(order)
            if task is None or task.section != "steps":
                self._resume(agent)
            if agent.landed != "grounded" and task is None:
                self._stop(agent, "return", order.by, "engine", why="lockdown", strict=False)
