"""What went wrong in a run and what the engine did about it, one row each: who, what, the engine's answer, how it ended.

Folded from the engine's changes by `runlog.RunLog`; shown in the closing table of `demo` and `sim`. Rows tell of take-overs,
machines that fell silent (and acted by themselves), breaches of the envelope, orders of people, questions without an answer,
and lockdown.
"""

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Input, LockdownOrder, Operator
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Lockdown, Question, StandingOrder
from formiga_bt.engine.kernel.state import EngineState

SILENCE_US: Micros = 10 * SECOND
"""A shorter silence of a machine is not worth a row, unless the machine acted on it or was lost."""
FAILSAFE_US: Micros = 120 * SECOND
"""A machine that says after a silence that it is its own master began so because of it."""


class IncidentRow(Struct):
    """One row. `who` is an agent, or a person; `ended` is empty while it lasts."""

    at: Micros
    who: str
    what: str
    did: str = ""
    ended: str = ""
    is_over: bool = False


class Happenings:
    """Takes each change before it is applied; `rows` are in order of their begin."""

    def __init__(self) -> None:
        self.rows: list[IncidentRow] = []
        self._open: dict[tuple[str, str], IncidentRow] = {}
        """(kind, agent) -> the row that lasts."""
        self._silences: dict[str, IncidentRow] = {}
        """The newest silence of each machine, listed or not."""
        self._asked: dict[str, Micros] = {}
        """Since when an agent's clearance is asked for."""
        self._by = ""
        self._how = ""

    def begin(self, given: Input) -> None:
        """Take note of what a step answers: whose word its changes follow."""
        self._by = self._how = ""
        if isinstance(given, Operator):
            self._by, self._how = given.by, given.order.removeprefix("handback_")
        elif isinstance(given, LockdownOrder):
            self._by = given.by

    def before(self, at: Micros, change: ch.Change, state: EngineState) -> None:
        """Take a change; `state` is as it was before."""
        match change:
            case ch.AgentPut(agent) if not agent.human:
                self._agent(at, state.agents.get(agent.id), agent)
            case ch.OrderPut(agent_id, order):
                self._order(at, agent_id, state.orders.get(agent_id), order, state)
            case ch.ClearancePut(agent_id, clearance) if clearance is not None:
                self._asked[agent_id] = clearance.opened_at
            case ch.LockdownPut(lockdown):
                self._lockdown(at, state.lockdown, lockdown)
            case ch.GoalPut(goal) if goal.code == "no_clearance" and goal.ended:
                self._no_clearance(at, goal, state)
            case ch.QuestionDrop(question_id) if question_id in state.questions:
                self._unanswered(at, state.questions[question_id])

    # -- one kind each -------------------------------------------------------------------------------------------
    def _agent(self, at: Micros, was: AgentRecord | None, agent: AgentRecord) -> None:
        if was is None:
            return
        if was.liveness == "ALIVE" and agent.liveness != "ALIVE":
            row = IncidentRow(at, agent.id, "not heard any more", "no new work for it")
            self._open["silent", agent.id] = self._silences[agent.id] = row
        elif was.liveness != "LOST" and agent.liveness == "LOST" and ("silent", agent.id) in self._open:
            lost = self._list(self._open["silent", agent.id])
            lost.did = f"lost, {was.task} goes on without it or ends" if was.task else "lost"
        elif was.liveness != "ALIVE" and agent.liveness == "ALIVE":
            self._heard(at, agent)
        if agent.taken and not was.taken:
            self._taken(at, agent)
        elif was.taken and not agent.taken:
            self._end("taken", agent.id, at, f"handed back by {self._by or 'somebody'} ({self._how or 'the engine'})")

    def _taken(self, at: Micros, agent: AgentRecord) -> None:
        did = f"{agent.task} waits" if agent.task else "nothing is sent to it"
        silent = self._silences.get(agent.id)
        if agent.control == "failsafe" and silent is not None and (not silent.is_over or at - silent.at < FAILSAFE_US):
            silent.what, silent.did = f"lost its link, did by itself: {agent.on_link_loss}", did
            silent.ended, silent.is_over = "", False
            self._open["taken", agent.id] = self._list(silent)
            self._open.pop(("silent", agent.id), None)
            return
        by_pilot = agent.control == "pilot"
        what = "taken over by its pilot" if by_pilot else f"not under the engine's control ({agent.control})"
        self._start("taken", at, agent.id, what, did)

    def _order(
        self, at: Micros, agent: str, was: StandingOrder | None, order: StandingOrder | None, state: EngineState
    ) -> None:
        if order is None:
            machine = state.agents.get(agent)
            is_down = machine is not None and machine.landed == "grounded"
            self._end("order", agent, at, "on the ground" if is_down else "lifted")
            return
        if was is not None and (was.stop, was.scope, was.at) == (order.stop, order.scope, order.at):
            if was.state == "open" and order.state != "open":
                self._end("order", agent, at, order.state)
            return
        self._end("order", agent, at, f"now {order.stop}")
        if order.scope == "lockdown":
            self._order_of_lockdown(order)
            return
        of = state.agents.get(agent)
        task = of.task if of is not None else ""
        if order.scope == "engine":
            what, did = (
                f"broke {order.why.removeprefix('envelope.')}",
                f"{order.stop}{f', {task} ends' if task else ''}",
            )
        else:
            what, did = (
                f"{order.stop} ordered by {order.by or 'somebody'}",
                f"{order.stop}{f', {task} waits' if task else ''}",
            )
        self._start("order", at, agent, what, did)

    def _lockdown(self, at: Micros, was: Lockdown | None, lockdown: Lockdown | None) -> None:
        if lockdown is None:
            self._end("lockdown", "", at, f"released by {self._by or 'somebody'}")
        elif was is None:
            row = self._start(
                "lockdown", at, lockdown.by or "somebody", f"pressed lockdown ({lockdown.how})", "", of=""
            )
            row.did = "no task starts or goes on"

    def _order_of_lockdown(self, order: StandingOrder) -> None:
        row = self._open.get(("lockdown", ""))
        if row is not None:
            row.did += f"; {order.agent}: {order.stop}"

    def _no_clearance(self, at: Micros, goal: GoalRecord, state: EngineState) -> None:
        was = state.goals.get(goal.id)
        if was is not None and was.ended:
            return
        begin = self._asked.get(goal.agent, at)
        row = IncidentRow(begin, goal.agent, "nobody said that people stand clear", f"did not {goal.action}")
        row.ended, row.is_over = f"no_clearance after {_seconds(begin, at)}", True
        self._put(row)

    def _unanswered(self, at: Micros, question: Question) -> None:
        if (
            question.kind != "ask"
            or question.reply is not None
            or question.expires_at is None
            or at < question.expires_at
        ):
            return
        row = IncidentRow(
            question.asked_at, ", ".join(question.asked), f"no answer to {question.number}", question.text
        )
        row.ended, row.is_over = f"its time was over after {_seconds(question.asked_at, at)}", True
        self._put(row)

    def _heard(self, at: Micros, agent: AgentRecord) -> None:
        row = self._open.get(("silent", agent.id))
        self._end("silent", agent.id, at, "heard again")
        if row is not None and at - row.at >= SILENCE_US:
            self._list(row)

    # -- rows ----------------------------------------------------------------------------------------------------
    def _start(self, kind: str, at: Micros, who: str, what: str, did: str, of: str | None = None) -> IncidentRow:
        row = self._open[kind, who if of is None else of] = IncidentRow(at, who, what, did)
        self._put(row)
        return row

    def _list(self, row: IncidentRow) -> IncidentRow:
        if not any(one is row for one in self.rows):
            self._put(row)
        return row

    def _put(self, row: IncidentRow) -> None:
        self.rows.append(row)
        self.rows.sort(key=lambda one: one.at)

    def _end(self, kind: str, agent: str, at: Micros, how: str) -> None:
        row = self._open.pop((kind, agent), None)
        if row is not None:
            row.ended, row.is_over = f"{how} after {_seconds(row.at, at)}", True


def _seconds(begin: Micros, end: Micros) -> str:
    return f"{(end - begin) / SECOND:.0f} s"
