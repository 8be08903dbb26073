"""Recover: at every release each machine that may be airborne is brought home by its type's recover subtree.

It has no time-out, but an alarm each minute beyond its estimate; a failed one is tried twice more, then the machine is
QUARANTINED with the alarm `agent_needs_help`. A machine lost meanwhile is postponed: it comes back by itself (`fleet`).
"""

from typing import Any, Final, Literal

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.energy import CALM, reach_m
from formiga_bt.base.geo import Place
from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ResumeHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.news import AllHome, NoWayHome
from formiga_bt.engine.kernel.records import AgentRecord, Recovering, TaskRecord
from formiga_bt.engine.kernel.timers import HomeAgain, HomeOverdue, TaskDue
from formiga_bt.engine.resting import is_at_home, is_in_its_place
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.engine.tasks.treerun import Ended, TaskTrees
from formiga_bt.lang.model import Subtree
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.ends import FinallyEnd
from formiga_bt.safety.envelope import safe_landing_spot

Way = Literal["recover", "fetch", "land"]

NO_PORT: Final = "no_port: no port of the site is its own any more"
TRIES = 3
PAUSES_US = (2 * SECOND, 5 * SECOND)
"""Between tries: a radio or an autopilot that is busy needs a moment."""
UNDER_WAY = ("running", "waiting")
KEEP_PCT = 5.0
"""Charge that is not counted on when a spot to land is looked for: near it machines land by themselves."""
SHIFT_M = 200.0
"""A machine that is told to land here goes at most so far to be clear of people."""
ESTIMATE_US = 300 * SECOND
ALARM_EVERY_US = 60 * SECOND


def has_no_port(core: Core, agent: AgentRecord) -> bool:
    """Return whether a machine has no home to come to (the site file lost it), and can land where it is."""
    return agent.home not in core.site.ports and core.agent_type(agent).land is not None


class Recovery:
    """The last part of every task."""

    def __init__(self, core: Core, fleet: Fleet, runs: Runs) -> None:
        self._core = core
        self._fleet = fleet
        self._runs = runs

    def enter(self, task_id: str) -> None:
        """Go to the last part of a task."""
        self._core.put_task(task_id, section="recover")
        self._core.clear_deadline(TaskDue(task_id, "cleanup"))
        self.begin(task_id)

    def begin(self, task_id: str) -> None:
        """Start the way home of each machine that the task still holds and that may be airborne."""
        task = self._core.task(task_id)
        for agent_id in self._to_bring(task):
            last = max((r.attempt for r in task.agents.recovering if r.agent == agent_id), default=0)
            self._try(task_id, agent_id, last + 1)
        self.proceed(task_id)

    def _to_bring(self, task: TaskRecord) -> list[str]:
        found = []
        for agent_id in task.agents.granted:
            agent = self._core.state.agents[agent_id]
            if agent.human or not self._has(task, agent):
                continue
            if self._is_down(agent, "fetch" if task.system.stop == "return" else "recover"):
                continue
            if self._way(task, agent) is None or self.is_under_way(task.id, agent_id) or self._ordered(task, agent_id):
                continue
            found.append(agent_id)
        return found

    @staticmethod
    def _has(task: TaskRecord, agent: AgentRecord) -> bool:
        return agent.task == task.id or (bool(task.system.stop) and task.system.agent == agent.id)

    def _ordered(self, task: TaskRecord, agent_id: str) -> bool:
        """Return whether an order of its own brings the machine down: the task's recover waits for its end."""
        order = self._core.state.orders.get(agent_id)
        return not task.system.stop and order is not None and order.state == "open" and order.task not in ("", task.id)

    def _way(self, task: TaskRecord, agent: AgentRecord) -> Way | None:
        name: Way = "recover"
        if task.system.stop == "land":
            name = "land"
        elif task.system.stop == "return" and agent.landed == "grounded":
            name = "fetch"
        return name if self._core.agent_type(agent).way(name) else None

    def _subtree(self, agent_id: str, way: Way) -> Subtree:
        kind = self._core.agent_type(self._core.state.agents[agent_id])
        subtree = kind.way(way)
        assert subtree is not None, f"{kind.name} has no way to {way}"
        return subtree

    def is_under_way(self, task_id: str, agent_id: str) -> bool:
        """Return whether a task brings a machine home now."""
        return any(r.agent == agent_id and r.state in UNDER_WAY for r in self._core.task(task_id).agents.recovering)

    def releases(self, task_id: str) -> None:
        """Go on with releases before the task's end: goal-free, then home if airborne, then free."""
        core = self._core
        for agent_id, leaving in list(core.task(task_id).agents.releasing.items()):
            agent = core.state.agents[agent_id]
            if agent.task == task_id:
                if any(not goal.ended for goal in core.index.goals_of(agent_id)):
                    continue
                cleanups = core.task(task_id).ending.cleanups
                if any(FinallyEnd(one.id) in leaving.after and not one.ended for one in cleanups):
                    continue  # a `finally` inside the block that had it may still command it
                if self.is_under_way(task_id, agent_id):
                    continue
                if not self._is_down(agent, "recover") and core.agent_type(agent).recover is not None:
                    self._try_again(task_id, agent_id)
                    continue
                self._fleet.release(agent_id)
            task = core.task(task_id)
            core.put_part(
                task_id,
                "agents",
                releasing={a: o for a, o in task.agents.releasing.items() if a != agent_id},
                roles={role: tuple(a for a in agents if a != agent_id) for role, agents in task.agents.roles.items()},
            )
            core.wake(task_id, leaving.owner)

    def _try_again(self, task_id: str, agent_id: str) -> None:
        """Bring home who is to be released; a way home that ended well but not on the ground counts as one that failed."""
        last = next((r for r in self._core.task(task_id).agents.recovering if r.agent == agent_id), None)
        if has_no_port(self._core, self._core.state.agents[agent_id]) and self._ordered(
            self._core.task(task_id), agent_id
        ):
            return  # it lands where it is
        if last is None or last.tries < TRIES:
            self._try(task_id, agent_id, last.attempt + 1 if last is not None else 1)
        else:
            self._give_up(task_id, agent_id, "not_grounded")

    def _give_up(self, task_id: str, agent_id: str, code: str) -> None:
        self._core.effect(Alarm("agent_needs_help", f"{agent_id} could not be brought home: {code}", task_id, agent_id))
        self._fleet.quarantine(agent_id, "recover_failed")

    def _try(self, task_id: str, agent_id: str, attempt: int) -> None:
        core = self._core
        agent = core.state.agents[agent_id]
        way = self._way(core.task(task_id), agent) or "recover"
        subtree = self._subtree(agent_id, way)
        first = next((r.first for r in core.task(task_id).agents.recovering if r.agent == agent_id), 1)
        if way == "recover" and has_no_port(core, agent):
            self._set(task_id, Recovering(agent_id, attempt, "failed", way=way, first=first))
            if not self._ordered(core.task(task_id), agent_id):
                core.report(NoWayHome(agent_id, NO_PORT))
            return
        now = Recovering(agent_id, attempt, "running", way=way, first=first)
        self._set(task_id, now)
        values: dict[str, Any] = {}
        for name, param in subtree.params.items():
            values[name] = AgentRef(agent_id) if param.type.name == "agent" else self.spot(agent)
        core.emit(ch.ScopePut(task_id, now.section, values))
        core.set_deadline(HomeOverdue(task_id, agent_id), core.now + ESTIMATE_US, task_id)
        self._runs.start(task_id, now.section, subtree.steps, now.section)

    def restore(self, recovering: Recovering, trees: TaskTrees) -> None:
        """Rebuild a way home that was under way."""
        subtree = self._subtree(recovering.agent, recovering.way)
        trees.restore(recovering.section, subtree.steps, recovering.section)

    def ended(self, task_id: str, now: Recovering, ended: Ended) -> None:
        """A way home ended: done, tried again, or given up."""
        if now.state != "running":
            return
        core, agent_id = self._core, now.agent
        task = core.task(task_id)
        core.clear_deadline(HomeOverdue(task_id, agent_id))
        core.emit(ch.ScopePut(task_id, ended.section, None))
        agent = core.state.agents[agent_id]
        code = ended.failure.code if ended.failure is not None else ""
        if ended.failure is None or self._is_down(agent, now.way):
            self._set(task_id, replace(now, state="done"))  # also one that its pilot or its failsafe has landed
        elif not self._has(task, agent):
            self._set(task_id, replace(now, state="failed"))
        elif code.startswith("envelope.") and now.way == "recover":
            self._set(task_id, replace(now, state="failed"))
            self._note(task_id, f"{code}: {ended.failure.reason}")
            if not task.system.stop:
                core.report(NoWayHome(agent_id, f"{code}: {ended.failure.reason}"))
        elif now.way == "fetch" and (code == "no_clearance" or now.tries >= TRIES):
            self._set(task_id, replace(now, state="failed"))  # it stands where it stood
            self._note(task_id, f"{code}: {ended.failure.reason}")
        elif now.tries < TRIES:
            self._set(task_id, replace(now, state="waiting"))
            at = core.now + PAUSES_US[now.tries - 1]
            core.set_deadline(HomeAgain(task_id, agent_id), at, task_id)
        else:
            self._set(task_id, replace(now, state="failed"))
            self._give_up(task_id, agent_id, ended.failure.code)
        self.proceed(task_id)

    def try_again(self, task_id: str, agent_id: str) -> None:
        """The pause after a failed way home is over."""
        task = self._core.task(task_id)
        last = next((r for r in task.agents.recovering if r.agent == agent_id), None)
        if last is None or last.state != "waiting":
            return
        agent = self._core.state.agents[agent_id]
        if not self._has(task, agent) or self._ordered(task, agent_id):
            self._set(task_id, replace(last, state="failed"))
        elif self._is_down(agent, last.way):
            self._set(task_id, replace(last, state="done"))
        else:
            self._try(task_id, agent_id, last.attempt + 1)
        self._core.touch(task_id)
        self.proceed(task_id)

    def _is_down(self, agent: AgentRecord, way: Way) -> bool:
        """Return whether nothing of a way home is left to do: one that is fetched must stand at home."""
        if way == "fetch":
            return agent.landed == "grounded" and is_at_home(self._core, agent)
        return agent.landed == "grounded" and (agent.flies or is_in_its_place(self._core, agent))

    def _note(self, task_id: str, text: str) -> None:
        self._core.put_part(task_id, "outcome", notes=(*self._core.task(task_id).outcome.notes, text))

    def spot(self, agent: AgentRecord) -> Place:
        """Return where a machine lands that is told to land here: clear of people and machines, if its charge allows."""
        core = self._core
        if agent.position is None:
            return Place(0.0, 0.0)
        power = core.power(agent)
        reach = 0.0
        if power is not None and agent.battery is not None:
            reach = reach_m(agent.battery - KEEP_PCT, agent.position, power, agent.wind or CALM, agent.payload_kg)
        others = [a for a in core.state.agents.values() if a.id != agent.id and a.position is not None]
        standing = [a for a in others if not a.human and a.landed == "grounded"]
        keep_clear = [
            a for a in others if a not in standing
        ]  # people, and machines in the air: nobody lands through one
        ends = [end for goal in core.state.goals.values() if goal.agent != agent.id for end in goal.ends]
        clear_of = [a.position.ground for a in keep_clear if a.position] + [end.ground for end in ends]
        clear_of += self._spots(agent.id)
        taken = [a.position.ground for a in standing if a.position is not None]
        return safe_landing_spot(
            agent.position.ground, clear_of, taken, core.airspace, core.rules(agent, agent.task), min(reach, SHIFT_M)
        )

    def _spots(self, but: str) -> list[Place]:
        """Return where other machines are about to land: those that are ordered down at one instant choose one by one."""
        state = self._core.state
        found: list[Place] = []
        for task_id in self._core.open:
            for one in state.tasks[task_id].agents.recovering:
                if one.way == "land" and one.state == "running" and one.agent != but:
                    scope = state.scopes.get(task_id, {}).get(one.section, {})
                    found += [value for value in scope.values() if isinstance(value, Place)]
        return found

    def abandon(self, task_id: str, one: Recovering) -> None:
        """A way home was stopped by another order."""
        core = self._core
        core.clear_deadline(HomeOverdue(task_id, one.agent))
        core.clear_deadline(HomeAgain(task_id, one.agent))
        if one.state == "running":
            core.emit(ch.ScopePut(task_id, one.section, None))
        self._set(task_id, replace(one, state="failed"))

    def agent_left(self, task_id: str, agent_id: str) -> None:
        """A machine was lost or abandoned on its way home: its section stops, the others' go on."""
        core = self._core
        core.clear_deadline(HomeOverdue(task_id, agent_id))
        core.clear_deadline(HomeAgain(task_id, agent_id))
        for one in core.task(task_id).agents.recovering:
            if one.agent == agent_id and one.state == "waiting":
                self._set(task_id, replace(one, state="failed"))
            elif one.agent == agent_id and one.state == "running":
                self._runs.stop(task_id, one.section)
                core.emit(ch.ScopePut(task_id, one.section, None))
                self._set(task_id, replace(one, state="failed"))
        self.proceed(task_id)

    def proceed(self, task_id: str) -> None:
        """End the task once nothing is under way."""
        task = self._core.task(task_id)
        if (
            task.section != "recover"
            or task.ending.stopping
            or any(r.state in UNDER_WAY for r in task.agents.recovering)
        ):
            return
        agents = self._core.state.agents
        if any(self._has(task, agents[a]) and self._ordered(task, a) for a in task.agents.granted):
            return  # its order's end calls again
        tried = {r.agent for r in task.agents.recovering}
        late = [a for a in self._to_bring(task) if a not in tried]
        if late and not task.system.stop:
            for (
                agent_id
            ) in late:  # it had begun to start when its goal ended, and has told only since then that it flies
                self._try(task_id, agent_id, 1)
            return
        self._core.report(AllHome(task_id))

    def overdue(self, task_id: str, agent_id: str) -> None:
        """The estimate is over: an alarm each minute. Who waits for a spot on which another stands looks for another spot."""
        core = self._core
        if (
            ResumeHold() not in core.task(task_id).hold.causes
        ):  # else it stands, and a person has been asked what becomes of it
            core.effect(Alarm("recover_slow", f"{agent_id} is not home yet", task_id, agent_id))
        if any(r.agent == agent_id and r.way == "land" for r in core.task(task_id).agents.recovering):
            for goal in core.index.goals_of(agent_id):
                if goal.task == task_id and goal.state == "gated" and goal.code == "spot_busy":
                    core.put_goal(goal.id, state="gate_refused")
                    core.wake(task_id, goal.owner)
        core.set_deadline(HomeOverdue(task_id, agent_id), core.now + ALARM_EVERY_US, task_id)

    def _set(self, task_id: str, recovering: Recovering) -> None:
        core = self._core
        task = core.task(task_id)
        others = tuple(r for r in task.agents.recovering if r.agent != recovering.agent)
        core.put_part(task_id, "agents", recovering=(*others, recovering))
