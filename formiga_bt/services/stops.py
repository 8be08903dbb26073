"""Orders of people that rank above tasks: the four stops, continue, restart, lockdown, hand-back; and preflight.

`Orders` owns one. The engine decides; here its answer becomes what a person reads: who got the order, who did not and why,
what each machine does now, and what must be done next. That is read off the view before and after the order.
"""

from collections.abc import Callable, Iterable
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.causes import HoldCause
from formiga_bt.engine.kernel.inputs import Input, LockdownOrder, Operator, OperatorOrder
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder, TaskRecord
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.services.refused import Refused
from formiga_bt.services.replies.order_replies import (
    after_stop,
    count,
    held_tasks,
    machines,
    passed_over,
    released,
    restarted,
    same_order,
    sorted_out,
    told_of,
)
from formiga_bt.services.standing import lockdown_fact, wall_us
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import hint_for, with_keeping
from formiga_bt.show.facts import CheckFact, LockdownFact, OrderedFact, OrderReply, PreflightFact, SkippedFact
from formiga_bt.show.why.going_on import machines_of, stays, ways_on, ways_on_of
from formiga_bt.show.why.standing import STOPPED, doing
from formiga_bt.show.why.words import not_ready

LOOK_S: Final = 0.2
"""A stop waits no longer than that for a copy of the state that lags behind: it only tells what stood before."""
NOTHING: Final = "there is nothing to do: no machine is here"


class Stops:
    """The orders of people about machines, tasks or everything.

    Args:
        ask: hands an input to the engine and returns its reply; raises `Refused`.
        view: the copy of the engine's state.
        site: whether it requires preflight.
        now: the engine time.
        catalogue: tells what an interrupted action requires.
    """

    def __init__(
        self,
        ask: Callable[[Input], Accepted | Done],
        view: EngineView,
        site: Site,
        now: Callable[[], Micros],
        catalogue: Catalogue | None = None,
    ) -> None:
        self._catalogue = catalogue
        self._ask = ask
        self._view = view
        self._site = site
        self._now = now

    # -- stops, continue, restart ------------------------------------------------------------------------------------
    def agent(self, agent: str, order: OperatorOrder, by: str = "", confirmed: str = "") -> OrderReply:
        """Give an order to one machine.

        Raises:
            Refused: the engine refuses it, or a `cut` is not confirmed by the machine's id.
        """
        if order == "cut" and confirmed != agent:
            raise Refused(
                "not_confirmed",
                f"cut stops the motors of {agent} at once; in the air it falls",
                f'confirm it with the machine\'s id: {{"order": "cut", "confirmed": "{agent}"}};'
                f" formiga cut {agent} asks for it",
            )
        self._view.catch_up(LOOK_S)
        with self._view.reading() as state:
            if agent not in state.agents:
                raise Refused("unknown_agent", f"there is no agent '{agent}'", hint_for("unknown_agent"))
        return self._give(order, agent, by, lambda state: [a for a in state.agents.values() if a.id == agent])

    def task(self, task: str, order: OperatorOrder, by: str = "") -> OrderReply:
        """Give an order to all machines of a task, or restart it.

        Raises:
            Refused: the engine refuses it.
        """
        with self._view.reading() as state:
            if task in state.agents and task not in state.tasks:
                raise Refused("unknown_task", f"'{task}' is an agent", f"formiga {order} {task}")
        return self._give(order, task, by, lambda state: machines_of(state, task))

    def all(self, order: OperatorOrder, by: str = "") -> OrderReply:
        """Give an order to every machine of the site.

        Raises:
            Refused: the engine refuses it.
        """
        return self._give(order, "", by, machines)

    def _give(
        self, order: OperatorOrder, target: str, by: str, scope: Callable[[EngineState], list[AgentRecord]]
    ) -> OrderReply:
        before, held = self._standing()
        reply = self._ask(Operator(order, target, by))
        self._view.catch_up()
        with self._view.reading() as state:
            agents = scope(state)
            if order in STOPPED:
                same = all(same_order(before.get(a.id), state.orders.get(a.id)) for a in agents) and (
                    held == held_tasks(state)
                )
                return _kept(self._stopped(state, order, target, agents, before, stands_already=same), reply)
            if order == "restart":
                return restarted(state, target, agents)
            return _kept(self._went_on(state, target, agents, before, held), reply)

    def _standing(self) -> tuple[dict[str, StandingOrder], dict[str, tuple[HoldCause, ...]]]:
        self._view.catch_up(LOOK_S)
        with self._view.reading() as state:
            return dict(state.orders), held_tasks(state)

    def _stopped(
        self,
        state: EngineState,
        order: str,
        target: str,
        agents: Iterable[AgentRecord],
        before: dict[str, StandingOrder],
        *,
        stands_already: bool,
    ) -> OrderReply:
        ordered, skipped = sorted_out(state, order, agents, self._now(), before)
        if not ordered and not skipped:
            text = NOTHING if not target else f"{target} has no machine now; it is held"
        elif stands_already:
            text = f"{order} stands already; nothing was changed"
        else:
            text = f"{order} is ordered for {count(len(ordered), 'machine')}"
            text += told_of(skipped)
        return OrderReply(
            order=order,
            target=target,
            stands_already=stands_already and (bool(ordered) or any(one.code == "suspect" for one in skipped)),
            text=text,
            ordered=tuple(ordered),
            skipped=tuple(skipped),
            next=tuple(after_stop(state, order, target, self._catalogue)),
        )

    def _went_on(
        self,
        state: EngineState,
        target: str,
        agents: Iterable[AgentRecord],
        before: dict[str, StandingOrder],
        held: dict[str, tuple[HoldCause, ...]],
    ) -> OrderReply:
        now = self._now()
        ordered, skipped = [], []
        for agent in agents:
            order = state.orders.get(agent.id)
            if order is not None and order.brings_down and not target:
                does = doing(state, order, now, wall_us())
                text = f"its `{order.stop}` goes on: {does}; formiga continue {agent.id} would end it"
                skipped.append(passed_over(state, agent, "order_under_way", text, ""))
            elif order is not None:
                text = f"`{order.stop}` still stands on it: {doing(state, order, now, wall_us())}"
                skipped.append(passed_over(state, agent, "ordered", text, ways_on_of(state, agent, self._catalogue)[0]))
            elif agent.id in before:
                ordered.append(OrderedFact(who=agent.id, text=f"{agent.id} is free of `{before[agent.id].stop}`"))
        for task_id, causes in held.items():
            task = state.tasks.get(task_id)
            if task is None or (task.section != "done" and task.hold.causes == causes):
                continue
            if task.section == "done":
                ordered.append(OrderedFact(who=task_id, text=f"{task_id} went on, and has ended: {task.status}"))
            elif task.hold.causes:
                skipped.append(self._still_held(state, task, "held"))
            else:
                ordered.append(OrderedFact(who=task_id, text=f"{task_id} goes on"))
        if not target:  # tasks that could not be continued were passed over
            skipped += [
                self._still_held(state, task, "cannot_continue")
                for task in state.tasks.values()
                if task.hold.causes and task.section != "done" and task.hold.causes == held.get(task.id)
            ]
        nothing = "nothing goes on" if skipped else "nothing was stopped: no order stands, and no task waits for a word"
        text = ", ".join(one.text for one in ordered) or nothing
        return OrderReply(
            order="continue",
            target=target,
            stands_already=False,
            text=text,
            ordered=tuple(ordered),
            skipped=tuple(skipped),
            next=tuple(one.hint for one in skipped if one.hint.startswith("formiga ")) or ("formiga tasks",),
        )

    def _still_held(self, state: EngineState, task: TaskRecord, code: str) -> SkippedFact:
        why = stays(state, task.id, self._catalogue)
        text = f"{task.id} is still HELD ({', '.join(task.hold.words)})" + (f": {why}" if why else "")
        first = ways_on(state, task, self._catalogue)[0]
        hint = f"formiga why {task.id}" if first.startswith("formiga continue") else first
        return SkippedFact(who=task.id, code=code, text=text, hint=hint)

    # -- lockdown ----------------------------------------------------------------------------------------------------
    def lockdown(self, how: str, by: str = "") -> OrderReply:
        """Press lockdown, or release it.

        Raises:
            Refused: the engine refuses it.
        """
        self._view.catch_up(LOOK_S)
        with self._view.reading() as state:
            before, orders = state.lockdown, dict(state.orders)
            flew = {a.id for a in machines(state) if a.landed != "grounded"}
        if how == "release" and before is None:
            return released(None, [], "no lockdown stands", already=True)
        reply = self._ask(LockdownOrder(how, by))  # type: ignore[arg-type]
        self._view.catch_up()
        with self._view.reading() as state:
            if how == "release":
                stopped = [t.id for t in state.tasks.values() if t.hold.causes and t.section != "done"]
                text = "lockdown is released: tasks are admitted and machines granted again"
                return released(state, stopped, text, self._catalogue)
            concerned = [a for a in machines(state) if a.id in flew or a.landed != "grounded" or a.id in state.orders]
            ordered, skipped = sorted_out(state, how, concerned, self._now(), orders, at_lockdown=True)
            already = before is not None and before.how == how
            text = "lockdown stands already" if already else "LOCKDOWN: nothing starts, nothing goes on"
            if not concerned:
                text += "; no machine is in the air"
            return OrderReply(
                order="lockdown",
                target=how,
                stands_already=already,
                text=with_keeping(text, reply),
                ordered=tuple(ordered),
                skipped=tuple(skipped),
                next=("formiga lockdown release",),
            )

    def lockdown_now(self) -> LockdownFact:
        """Return how lockdown stands."""
        with self._view.reading() as state:
            return lockdown_fact(state, self._now())

    # -- hand-back ---------------------------------------------------------------------------------------------------
    def hand_back(self, agent: str, how: str = "end", by: str = "") -> OrderReply:
        """Give a machine back to the engine that its pilot had taken over.

        Raises:
            Refused: unknown, none took it over, its pilot still has it, or its step cannot be continued.
        """
        self._view.catch_up()
        with self._view.reading() as state:
            record = state.agents.get(agent)
            task = record.task if record is not None else ""
            stopped = any(
                g.agent == agent and g.state == "interrupted" and g.section != "recover" for g in state.goals.values()
            )
        reply = self._ask(Operator(f"handback_{how}", agent, by))  # type: ignore[arg-type]
        self._view.catch_up()
        with self._view.reading() as state:
            found = state.tasks.get(task)
            held = found is not None and bool(found.hold.causes)
            order = state.orders.get(agent)
            now = doing(state, order, self._now(), wall_us()) if order is not None else ""
            follow = ["formiga agents", "formiga tasks"]
            if found is not None and held:
                follow = ways_on(state, found, self._catalogue)
            if found is not None and how == "end" and not stopped and found.section == "steps":
                end = f"formiga abort {task}"  # who says --end wants no more of it
                follow = [end, *(way for way in follow if held and way != end)]
        then = {
            "continue": f"{task} goes on" if task else "it has no task",
            "return": f"it flies to its port, then {task} waits for your word" if task else "it flies to its port",
            "end": _ends(found, stopped=stopped) if found is not None else "it has no task",
        }[how]
        if how == "continue" and task and (order is not None or held):
            what = f"the order `{order.stop}` stands on it" if order is not None else "it is held otherwise"
            then = f"{what}, and {task} waits for your word" if held else what
        return OrderReply(
            order=f"handback_{how}",
            target=agent,
            stands_already=False,
            text=with_keeping(f"{agent} is the engine's again; {then}", reply),
            ordered=(OrderedFact(who=agent, text=now),) if now else (),
            skipped=(),
            next=tuple(follow),
        )

    # -- preflight ---------------------------------------------------------------------------------------------------
    def preflight(self, agent: str) -> PreflightFact:
        """Return whether a machine is ready to fly, as it says itself.

        Raises:
            Refused: unknown, or a person.
        """
        with self._view.reading() as state:
            record = state.agents.get(agent)
        if record is None:
            raise Refused("unknown_agent", f"there is no agent '{agent}'", "formiga agents lists them")
        if record.human:
            raise Refused("human", f"{agent} is a person, who is not looked at before a flight")
        checks = tuple(CheckFact(check=c.check, ok=c.ok, text=c.text) for c in record.checks)
        bad = not_ready(record.checks)
        ready = bool(checks) and not bad
        text = f"{agent} is ready" if ready else f"{agent} is not ready: {bad}"
        if not checks:
            text = f"{agent} has reported no checks yet; a machine reports them while it stands on the ground"
        airborne = record.landed != "grounded"
        if airborne:
            text = f"{agent} is not on the ground; " + (
                "these checks are of before" if checks else "it reports checks there"
            )
        return PreflightFact(
            agent=agent, ok=ready, required=self._site.preflight, airborne=airborne, checks=checks, text=text
        )


def _ends(task: TaskRecord, *, stopped: bool) -> str:
    """Return what `handback --end` does to a task; `stopped`: a step of it was interrupted."""
    then = f"{task.id} waits for your word" if task.hold.causes else f"{task.id} goes on"
    if stopped:
        return "its interrupted step fails (taken_over)" + (f", and {then}" if task.hold.causes else "")
    return f"no step of {task.id} was interrupted, so none fails: {then}"


def _kept(answer: OrderReply, reply: Accepted | Done) -> OrderReply:
    """Return an answer that says so if the order could not be kept."""
    return replace(answer, text=with_keeping(answer.text, reply))
