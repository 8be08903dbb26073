"""Goals: from a leaf's wish, through the gate, to an end that someone takes.

| state | on | next |
|---|---|---|
| gated | the gate says go / refuses / the leaf stops | sent / gate_refused / canceled (no effect ever left) |
| sent, accepted, running | news of the agent | accepted, running, or an end |
| sent, accepted, running | the leaf stops | canceling: CancelGoal, again each 2 s wall, until `cancel_grace` |
| canceling | the agent's end of it | that end (also succeeded: the work was done) |
| canceling | `cancel_grace` is over | in_doubt, `cancel_unconfirmed`, the agent is quarantined |
| any in flight | agent lost / restarted | lost / in_doubt |
| any in flight | a pilot takes over, or an order stops the machine | interrupted: its step waits for a person's word |
| canceling by an order | a person says continue | as it ends: again |
| interrupted, gated | a person says continue | again: its step sends its next attempt under another id |

Of a take-off that was broken off in the air, the next attempt is what is left of it (`engine.goals.climbing`).
"""

from typing import Any

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.goals import epochs
from formiga_bt.engine.goals.climbing import climb, is_up, top_m
from formiga_bt.engine.goals.gatekeeper import TTL_BEATS, Gatekeeper
from formiga_bt.engine.goals.people import TTL_BEATS as QUESTION_BEATS
from formiga_bt.engine.goals.updates import Updates
from formiga_bt.engine.goals.wire_values import read_result
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.files import note_files
from formiga_bt.engine.kernel.inputs import Alarm, CancelGoal, EffectFailed, QueryGoal
from formiga_bt.engine.kernel.news import GoalUnreachable, Idle, MustLeave, Stopped, TakenOver, UnreadableMessage
from formiga_bt.engine.kernel.records import BUSY, GO_ON, STOPPED, AgentRecord, GoalRecord
from formiga_bt.engine.kernel.timers import AcceptDue, CancelDue, GoalTimer, GraceDue, UpdateDue
from formiga_bt.nodes.run import Failure, GoalOrder
from formiga_bt.safety.traffic import area_of
from formiga_bt.transport.messages import TERMINAL, GoalEvent

RESEND_US = 2 * SECOND
"""A cancel is sent again after so much wall time without its end."""


class Goals:
    """All goals of all tasks."""

    def __init__(self, core: Core, gatekeeper: Gatekeeper, updates: Updates) -> None:
        self._core = core
        self._gate = gatekeeper
        self.updates = updates

    # -- from the trees ------------------------------------------------------------------------------------------
    def order(self, task_id: str, order: GoalOrder) -> Failure | None:
        """Make a goal and show it to the gate; a Failure says why it cannot be."""
        core = self._core
        task = core.task(task_id)
        section = order.goal_id.split("/", 3)[2]
        held = any(order.agent in agents for agents in task.agents.roles.values())
        agent = core.state.agents[order.agent]
        if not held and not agent.shared:
            code = "agent_lost" if agent.pool == "QUARANTINED" else "released"
            return Failure(code, "the task no longer holds this agent", order.owner, agent.id, retryable=False)
        if not agent.shared and self._mine_in_flight(task_id, order.agent):
            return Failure("agent_busy", "another step of this task commands it", order.owner, agent.id)
        goal = GoalRecord(
            id=order.goal_id,
            agent=order.agent,
            action=order.action,
            task=task_id,
            owner=order.owner,
            section=section.split(":", 1)[0],
            fields=order.fields,
            repeatable=core.action(order.action).repeatable,
            safety=bool(task.system.stop),
            order=core.count("goal"),
            at=core.now,
        )
        if order.attempt > 1:
            goal = self._rest_of(goal)
        goal = self._gate.routing.planned(goal)
        if order.tracks and ("update" in agent.lacks or goal.path):
            why = "it drives on routes, edge by edge" if goal.path else f"the wire {agent.wire} cannot change a goal"
            reason = f"{agent.id} cannot be told of a target that moves: {why}"
            return Failure("no_update", reason, order.owner, agent.id, retryable=False, by_another=True)
        core.emit(ch.GoalPut(goal))
        if not goal.ended:
            self._gate.try_send(goal.id)
        return None

    def _rest_of(self, goal: GoalRecord) -> GoalRecord:
        """Return what is left of a goal whose earlier attempt was broken off: of a take-off, the climb."""
        agent, action = self._core.state.agents[goal.agent], self._core.action
        top = top_m(goal, action)
        if top is None or agent.landed != "airborne":
            return goal
        if is_up(agent, top):
            return replace(goal, state="succeeded")
        found = climb(agent, top, action)
        return goal if found is None else replace(goal, action=found[0], fields=found[1], rest_of=goal.action)

    def _mine_in_flight(self, task_id: str, agent_id: str) -> bool:
        goals = self._core.index.goals_of(agent_id)
        return any(g.task == task_id and not g.ended and not g.cancel_asked for g in goals)

    def cancel(self, goal_id: str, why: str = "") -> bool:
        """Cancel a goal; return whether its end must be waited for."""
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is None:
            return False
        if goal.ended:  # its end was not taken and now never will be
            self._drop(goal)
            return False
        if goal.state in ("gated", "interrupted"):
            self._gate.forget(goal)
            self._drop(goal)
            return False
        if core.withdraw_send(goal_id):
            self._free_agent(goal)
            self._drop(goal)
            return False
        if goal.cancel_asked:
            core.put_goal(goal_id, cancel_why=why)  # stopped by an order before: now its end is wanted
            return True
        self._ask_cancel(goal, why)
        return True

    def _ask_cancel(self, goal: GoalRecord, why: str) -> None:
        core, goal_id = self._core, goal.id
        core.put_goal(goal_id, state="canceling", cancel_asked=True, cancel_why=why)
        core.effect(CancelGoal(goal_id, goal.agent, goal.action))
        core.set_wall(AcceptDue(goal_id), None)
        core.set_wall(CancelDue(goal_id), RESEND_US)
        core.set_wall(GraceDue(goal_id), core.action(goal.action).cancel_grace_us)

    # -- interrupted, and sent again -----------------------------------------------------------------------------
    def interrupt_all(self, agent_id: str) -> None:
        """An order stops a machine: what it does is canceled, and waits for a person's word."""
        core = self._core
        for goal in [g for g in core.index.goals_of(agent_id) if g.in_flight]:
            if goal.cancel_why == GO_ON:
                core.put_goal(goal.id, cancel_why=STOPPED)
            if goal.cancel_asked or goal.owner == "!none":
                continue
            if core.withdraw_send(goal.id):
                self.interrupt(goal.id, STOPPED)
            else:
                self._ask_cancel(goal, STOPPED)

    def interrupt(self, goal_id: str, code: str) -> None:
        """A goal ended before its work was done, and not by its step's doing: the step waits."""
        core = self._core
        core.clear_walls(goal_id)
        if core.state.goals[goal_id].owner == "!none":
            self.end(goal_id, "taken_over" if code == "taken_over" else "canceled")
            return
        goal = core.put_goal(
            goal_id, state="interrupted", code=code, leg=None, cancel_asked=False, cancel_why="", released=0
        )
        self._free_agent(goal)

    def go_on(self, goal_id: str) -> None:
        """A person says continue while an order still cancels a goal: its step goes on as soon as the machine has stopped."""
        self._core.put_goal(goal_id, cancel_why=GO_ON)

    def _stopped(self, goal: GoalRecord) -> None:
        """What an order canceled has ended."""
        self.interrupt(goal.id, STOPPED)
        if goal.cancel_why == GO_ON:
            self._core.report(Stopped(goal.agent))

    def again(self, goal_id: str) -> None:
        """Have the step of an interrupted or waiting goal send its next attempt."""
        self.end(goal_id, "again")

    def order_safety(self, goal_id: str, agent_id: str, action: str) -> None:
        """Send a goal of the engine's own that replaces whatever the machine does."""
        core = self._core
        core.emit(
            ch.GoalPut(
                GoalRecord(
                    id=goal_id, agent=agent_id, action=action, owner="!none", section="recover", safety=True,
                    order=core.count("goal"), at=core.now,
                )
            )
        )  # fmt: skip
        self._gate.try_send(goal_id)

    def _drop(self, goal: GoalRecord) -> None:
        core = self._core
        core.clear_walls(goal.id)
        core.emit(ch.GoalDrop(goal.id))
        self._look_at_release(goal.agent)

    def _look_at_release(self, agent_id: str) -> None:
        """A task gives a machine back once it has no goal: also none of an order that borrows it."""
        core = self._core
        task = core.state.tasks.get(core.state.agents[agent_id].task)
        if task is not None and agent_id in task.agents.releasing:
            core.touch(task.id)

    # -- from the agents -----------------------------------------------------------------------------------------
    def on_event(self, event: GoalEvent) -> None:
        """Take news of a goal; a status that came with it is taken already (`Fleet.on_goal_event`)."""
        core = self._core
        goal = core.state.goals.get(event.goal_id)
        if goal is None or goal.agent != event.agent or goal.ended or goal.state == "gated":
            return
        if event.n and event.n <= goal.n:
            return
        if event.n:
            goal = core.put_goal(goal.id, n=event.n)
        if event.attachments:
            note_files(core, goal.task, goal.agent, goal.action, event.attachments, goal.id)
        if event.state in TERMINAL:
            self._on_end(goal, event)
        elif event.state == "unknown":
            self._on_unknown(goal)
        elif goal.state == "interrupted":
            return  # by the very status that came with this news: a pilot has the machine
        elif goal.state == "canceling":
            core.put_goal(goal.id, phase=event.phase or goal.phase)
        else:
            state = "running" if event.state in ("running", "canceling") else "accepted"
            if state != goal.state or (event.phase and event.phase != goal.phase):  # mostly it just goes on
                core.put_goal(goal.id, state=state, phase=event.phase or goal.phase)
            core.set_wall(AcceptDue(goal.id), None)

    def _on_end(self, goal: GoalRecord, event: GoalEvent) -> None:
        core = self._core
        spec = core.action(goal.action)
        stopped = goal.cancel_why in (STOPPED, GO_ON)
        taken = event.state == "taken_over" or (event.state == "rejected" and event.code == "not_in_command")
        if event.state == "rejected" and event.code == "epoch_old":
            self._deposed(goal, stopped=stopped)
            return
        if taken and (stopped or not goal.cancel_asked) and not core.state.agents[goal.agent].human:
            self.interrupt(goal.id, "taken_over")
            core.report(TakenOver(goal))
            return
        ordered = goal.agent in core.state.orders  # else a goal replaced it that this engine knows nothing of any more
        if (stopped and event.state != "succeeded") or (
            event.state == "superseded" and goal.task and ordered and not goal.cancel_asked
        ):
            self._stopped(goal)
            return
        if event.code == "goal_expired" and event.state == "rejected" and self._came_late(goal):
            self.again(goal.id)
            return
        result: dict[str, Any] = {}
        if event.state == "succeeded" and goal.goes_on and not goal.cancel_asked:
            self.again(goal.id)
            return
        if event.state == "succeeded":
            agent = core.state.agents[goal.agent]
            if spec.effect and agent.flies and not _is_past(event):
                if _contradicts(agent, event, spec.effect):
                    text = (
                        f"{agent.id} says that {goal.action} is done, and that it is {agent.landed}, not {spec.effect}"
                    )
                    self.end(goal.id, "failed", "contradicted", text)
                    return
                core.put_agent(goal.agent, landed=spec.effect)
            try:
                result = read_result(spec.result, event.result)
            except ValueError as error:
                core.report(UnreadableMessage(goal.agent, f"result of {goal.action} cannot be read: {error}"))
                self.end(goal.id, "failed", "bad_result", str(error))
                return
        self.end(goal.id, event.state, event.code, event.text, result)

    def _deposed(self, goal: GoalRecord, *, stopped: bool) -> None:
        # Another engine of a later epoch commands this site: nothing leaves this one any more.
        core = self._core
        core.clear_walls(goal.id)
        if stopped:
            self._stopped(goal)
        elif goal.cancel_asked:
            self.end(goal.id, "canceled")
        else:
            core.put_goal(
                goal.id, state="gated", code="epoch", leg=None, n=-1, released=0
            )  # its agent remembers nothing of it
            self._free_agent(goal)
        epochs.depose(core, goal.agent, core.state.agents[goal.agent].epoch)

    def _on_unknown(self, goal: GoalRecord) -> None:
        # The agent never had it: a cancel is done with, a goal is sent again under the same id, if it still may go.
        asked = goal.owner == "!question"
        if goal.state == "interrupted":
            return  # told before: it was stopped, and waits for a person's word
        if goal.cancel_why in (STOPPED, GO_ON):
            self._stopped(goal)
        elif goal.cancel_asked:
            self.end(goal.id, "canceled")
        elif goal.state == "sent" and not goal.repeatable and self._may_begin_yet(goal):
            self.end(goal.id, "in_doubt", "", "its wire does not guarantee that it is begun once at most")
        elif self._came_late(goal):
            self.again(goal.id)
        elif goal.state == "sent" and self._is_expired(goal, QUESTION_BEATS if asked else TTL_BEATS):
            self.end(
                goal.id, "rejected", "goal_expired", "the engine was away, and the order is too old to be sent again"
            )
        elif goal.state == "sent" and self._gate.may_resend(goal):
            self._gate.resend(goal)
        elif goal.state == "sent":
            self._back_to_the_gate(goal)
        else:
            self.end(goal.id, "in_doubt", "", f"{goal.agent} does not know it any more")

    def _came_late(self, goal: GoalRecord) -> bool:
        """Return whether a goal of a step never began because the engine stood still: its next attempt is due, no failure."""
        late = goal.state == "sent" and goal.owner not in ("!question", "!none") and not goal.cancel_asked
        resume = self._core.state.resume
        return late and resume is not None and resume.stood and resume.is_expired(goal.sent_at, TTL_BEATS)

    def _may_begin_yet(self, goal: GoalRecord) -> bool:
        """Return whether a goal that its agent does not know may have been begun, or come late and be begun still."""
        lacks = self._core.state.agents[goal.agent].lacks
        return "goal_memory" in lacks or "expiry" in lacks

    def _is_expired(self, goal: GoalRecord, life_s: float) -> bool:
        resume = self._core.state.resume
        return resume is not None and resume.is_expired(goal.sent_at, life_s)

    def _back_to_the_gate(self, goal: GoalRecord) -> None:
        core = self._core
        self._free_agent(goal)
        core.set_wall(AcceptDue(goal.id), None)
        core.put_goal(goal.id, state="gated", code="unreachable", leg=None, area=None, released=0)

    def end(
        self, goal_id: str, state: str, code: str = "", text: str = "", result: dict[str, Any] | None = None
    ) -> None:
        """Give a goal its end: the agent is free, who waits for the goal is woken."""
        core = self._core
        was = core.state.goals[goal_id]
        if was.state in ("gated", "interrupted"):
            self._gate.forget(was)
        goal = core.put_goal(goal_id, state=state, code=code, text=text, result=result or {})
        core.clear_walls(goal_id)
        self._free_agent(goal)
        self._look_at_release(goal.agent)
        if goal.owner == "!none":
            self._drop(goal)
            if state not in ("lost", "in_doubt"):
                core.report(Idle(goal.agent))
            if state == "succeeded" and goal.leg is not None and goal.leg[0].ground == goal.leg[1].ground:
                self._read_anew(goal.agent)
        elif goal.owner == "!question":
            core.answered.append(goal_id)
        elif goal.task:
            core.wake(goal.task, goal.owner)

    def _read_anew(self, agent_id: str) -> None:
        """The engine moved a machine to another layer: what waits for its way is ordered again, from there."""
        for goal in [g for g in self._core.index.goals_of(agent_id) if g.state == "gated" and g.task]:
            if goal.code in (*BUSY, "draining"):
                self.again(goal.id)

    def _free_agent(self, goal: GoalRecord) -> None:
        core = self._core
        agent = core.state.agents[goal.agent]
        core.stale.add(goal.agent)
        if agent.goal == goal.id:
            pool = agent.pool
            if pool == "EXECUTING ACTION":
                pool = "ASSIGNED" if agent.task else "STANDBY"
            core.put_agent(agent.id, goal="", action="", pool=pool)

    # -- from wall time and wires ----------------------------------------------------------------------------
    def on_wall(self, timer: GoalTimer) -> None:
        """Handle what waits for an agent's word on a goal."""
        core, goal_id = self._core, timer.goal
        core.set_wall(timer, None)
        goal = core.state.goals.get(goal_id)
        if goal is None or goal.ended:
            return
        if isinstance(timer, AcceptDue) and goal.state == "sent":
            core.effect(QueryGoal(goal.agent, (goal.id,)))
            core.set_wall(timer, core.action(goal.action).accept_timeout_us)
        elif isinstance(timer, UpdateDue):
            self.updates.on_due(goal)
        elif isinstance(timer, CancelDue) and goal.state == "canceling":
            core.effect(CancelGoal(goal_id, goal.agent, goal.action))
            core.set_wall(timer, RESEND_US)
        elif isinstance(timer, GraceDue) and goal.state == "canceling":
            agent = core.state.agents[goal.agent]
            if agent.goal == goal_id and (
                agent.landed != "grounded" or agent.mobility == "ground" or agent.liveness != "ALIVE"
            ):
                self._keep_way(goal)
            self.end(goal_id, "in_doubt", "cancel_unconfirmed", "the cancel was never confirmed")
            if agent.human:  # people are only unreachable
                text = f"{goal.agent} never confirmed that the request was withdrawn"
                core.effect(Alarm("cancel_unconfirmed", text, goal.task, goal.agent))
            else:
                core.report(MustLeave(goal.agent, "cancel_unconfirmed"))

    def on_effect_failed(self, failed: EffectFailed) -> None:
        """A goal that surely did not arrive waits at the gate again; one that may have is asked for."""
        core = self._core
        goal = core.state.goals.get(failed.goal_id)
        if goal is None or goal.ended or failed.what != "goal" or goal.state != "sent":
            return
        if failed.outcome == "unreachable":
            core.report(GoalUnreachable(goal.agent))  # else it would be sent again at once, for ever
            self._back_to_the_gate(goal)
        else:
            core.effect(QueryGoal(goal.agent, (goal.id,)))

    def lose(self, agent_id: str, state: str, text: str = "") -> None:
        """End every goal that an agent has or waits for (`lost`, `in_doubt`); `text` says what put it in doubt.

        What a person's app forgot as it was started anew is asked again if it may be: nothing that moves is in doubt then.
        """
        human = self._core.state.agents[agent_id].human
        for goal in [g for g in self._core.index.goals_of(agent_id) if not g.ended]:
            asked_again = human and state == "in_doubt" and goal.repeatable and not goal.cancel_asked
            if asked_again and goal.in_flight and goal.owner not in ("!question", "!none"):
                self.again(goal.id)
            elif goal.in_flight or state == "lost":
                if goal.in_flight:
                    self._keep_way(goal)
                self.end(goal.id, state, "in_doubt" if state == "in_doubt" else "", text)

    def _keep_way(self, goal: GoalRecord) -> None:
        """Nobody knows whether a machine goes on with a goal: what that takes up in the air stays its own."""
        if goal.leg is not None or goal.area is not None:
            leg, area = goal.leg, goal.area
            if leg is not None and goal.also is not None:  # it may be on either way, or turn anywhere between them
                ends = (leg[0].ground, leg[1].ground, goal.also[1].ground)
                leg, area = goal.also, area_of(ends, goal.leg[1].up_m if goal.leg else 0.0, None)
            self._core.put_agent(goal.agent, lost_leg=leg, lost_area=area)

    def give_up(self, agent_id: str) -> None:
        """End what waits for a machine that leaves its task: nothing of that is sent any more."""
        for goal in [g for g in self._core.index.goals_of(agent_id) if g.state in ("gated", "interrupted")]:
            self.end(goal.id, "lost")


def _contradicts(agent: AgentRecord, event: GoalEvent, effect: str) -> bool:
    """Return whether what a machine says of itself with the end of a goal, or has said since, is not what that leads to.

    A status that was not believed says nothing, nor does one of a machine that does not know whether it stands.
    """
    status = event.status
    heard = status is not None and agent.boot_id == status.boot_id and agent.seq >= status.seq
    return heard and agent.landed != "unknown" and agent.landed != effect


def _is_past(event: GoalEvent) -> bool:
    """Return whether its machine has done, or does, something else since a goal ended: what it says of itself holds then.

    A result is told again when an engine that forgot it (its journal was full when it ended) sends the goal anew.
    """
    status = event.status
    return status is not None and (bool(status.action_name) or status.last_goal not in ("", event.goal_id))
