"""Lockdown: nothing starts and nothing goes on; what flies or drives under our control is ordered to return, hold or land.

Machines that come under our control in the air later get the same order. The release lifts it; a task whose steps were
interrupted stays HELD until a person says continue or aborts it.
"""

from collections.abc import Iterable

from msgspec.structs import replace

from formiga_bt.base.machines import MOVING
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import LockdownHold, OperatorHold
from formiga_bt.engine.kernel.core import EVERYTHING, Core
from formiga_bt.engine.kernel.holds import hold, unhold
from formiga_bt.engine.kernel.inputs import Alarm, LockdownOrder
from formiga_bt.engine.kernel.records import AgentRecord, Lockdown, StandingOrder
from formiga_bt.engine.orders.orders import StandingOrders


class Lockdowns:
    """The one switch."""

    def __init__(self, core: Core, orders: StandingOrders) -> None:
        self._core = core
        self._orders = orders

    def review(self, stale: Iterable[str]) -> None:
        """Machines changed: what is newly under our control in the air obeys it too."""
        core = self._core
        if core.state.lockdown is not None:
            for agent in list(core.state.agents.values()):
                if EVERYTHING in stale or agent.id in stale:
                    self._press(agent, core.state.lockdown)

    def order(self, given: LockdownOrder) -> None:
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
            if not core.task(task_id).system.agent:
                hold(core, task_id, LockdownHold())
        for agent in list(core.state.agents.values()):
            self._press(agent, now, changed=old is not None)

    def _press(self, agent: AgentRecord, lockdown: Lockdown, *, changed: bool = False) -> None:
        core = self._core
        if agent.mobility not in MOVING or self._orders.refusal(agent, lockdown.how) is not None:
            return
        if agent.landed == "grounded" and not self._orders.is_busy(agent.id):
            return
        order = core.state.orders.get(agent.id)
        task = core.state.tasks.get(agent.task)
        if order is not None and (order.scope == "lockdown" or order.stop == "land") and not changed:
            return
        if order is not None and order.scope == "engine" and order.state == "open":
            return  # a breach, or a word before: it comes down by that
        if order is not None and order.scope in ("agent", "task", "all") and order.at >= lockdown.at and not changed:
            return  # a person's word in lockdown
        if order is None and lockdown.how == "return" and task is not None and task.section == "recover":
            return  # it is on its way home already
        self._orders.stop(agent, lockdown.how, lockdown.by, "lockdown", strict=False)

    def _release(self) -> None:
        core = self._core
        core.emit(ch.LockdownPut(None))
        core.stale.add(EVERYTHING)
        for task_id in list(core.open):
            task = core.task(task_id)
            if task.system.agent or LockdownHold() not in task.hold.causes:
                continue
            goals = [g for g in core.state.goals.values() if g.task == task_id]
            stopped = any(a.id in core.state.orders for a in self._orders.machines_of(task))
            if task.section == "steps" and (stopped or any(g.state == "interrupted" for g in goals)):
                hold(core, task_id, OperatorHold())
            unhold(core, task_id, LockdownHold())
        for order in list(core.state.orders.values()):
            if order.scope == "lockdown":
                self._let_go(order)

    def _let_go(self, order: StandingOrder) -> None:
        """Lockdown ended: what it ordered is finished, what hovers waits with its task, goes on ending it, or comes home."""
        core = self._core
        agent = core.state.agents[order.agent]
        task = core.state.tasks.get(agent.task)
        if order.stop != "hold" and order.state == "open":
            self._orders.put(replace(order, scope="engine"))
        elif order.stop == "hold" and task is not None and task.section == "steps":
            self._orders.put(replace(order, scope="task"))
        else:
            self._orders.withdraw(order)
            if task is None or task.section != "steps":
                self._orders.resume(agent)
