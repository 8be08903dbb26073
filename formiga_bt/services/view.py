"""A read-only copy of the engine's state for everyone who asks, folded from its steps in a thread of its own.

The driver's thread only puts its steps into a queue. HTTP threads read here, under one lock, and never touch the engine.
`show.history.ledger` folds; the view has the thread, the lock, and the feed of events. Ended tasks are kept up to a number.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any, Final

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.alarm_records import AlarmRecord
from formiga_bt.engine.kernel.inputs import Abort, Alarm, EngineStep, LockdownOrder, NotifyPeople, Operator
from formiga_bt.engine.kernel.records import (
    AgentRecord,
    GoalRecord,
    Lockdown,
    Question,
    StandingOrder,
    TaskRecord,
    Version,
)
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.services.feed import Feed
from formiga_bt.services.standing import wall_us
from formiga_bt.show.facts import LineFact
from formiga_bt.show.history.ledger import Bounds, Ledger
from formiga_bt.show.history.rows import ActionRow, rest_words
from formiga_bt.show.why.standing import AGAIN, doing, given, lockdown_text

ENDED_KEPT: Final = 2000
ROWS_KEPT: Final = 500
"""Of the actions of one task."""
NOTICES_KEPT: Final = 50
"""Of one task."""
log = logging.getLogger("formiga.view")


class EngineView:
    """The copy. `feed_step` may be called from the driver's thread; everything else reads.

    Args:
        epoch: of the engine.
        ended_kept: so many ended tasks are kept.
        state: what the engine goes on from; a copy that is nobody else's.
    """

    def __init__(self, epoch: int, *, ended_kept: int = ENDED_KEPT, state: EngineState | None = None) -> None:
        self.feed = Feed(epoch)
        self.ledger = Ledger(Bounds(ended=ended_kept, rows=ROWS_KEPT), state)
        self.state = self.ledger.state
        self.alarms: deque[LineFact] = deque(maxlen=100)
        self.recall: Callable[[Sequence[str]], None] = lambda _ids: None
        """Makes the ledger know the beginnings of tasks of earlier starts; called without the lock."""
        self._notices: dict[str, deque[LineFact]] = {}
        self._sections: dict[str, str] = {}
        """Where the tasks of the step that is folded stand after it: a section that it only passed through is not told."""
        self.ledger.before.append(self._look)
        self._queue: SimpleQueue[EngineStep | threading.Event | None] = SimpleQueue()
        self.lock = threading.RLock()
        """Held while the state is read or changed."""
        self._thread: threading.Thread | None = None

    # -- the thread --------------------------------------------------------------------------------------------------
    def start(self) -> None:
        """Start to fold."""
        self._thread = threading.Thread(target=self._run, name="formiga-view", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Fold what is queued, then end; readers of the feed are told."""
        self._queue.put(None)
        if self._thread is not None:
            self._thread.join(5.0)
        self.feed.close()

    def feed_step(self, step: EngineStep) -> None:
        """Take a step; returns at once."""
        self._queue.put(step)

    def catch_up(self, within_s: float = 2.0) -> None:
        """Wait until everything that was fed before is folded."""
        mark = threading.Event()
        self._queue.put(mark)
        mark.wait(within_s)

    @contextmanager
    def reading(self) -> Iterator[EngineState]:
        """Hold the state still while it is read."""
        with self.lock:
            yield self.state

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, threading.Event):
                item.set()
                continue
            try:
                with self.lock:
                    self._fold(item)
            except Exception:  # a bug here must not end the view of everything else
                log.exception("step %s could not be folded", item.seq)
            self.feed.announce()

    # -- folding -----------------------------------------------------------------------------------------------------
    def _fold(self, step: EngineStep) -> None:
        self._refused(step)
        self._sections = {c.task.id: c.task.section for c in step.changes if type(c) is ch.TaskPut}
        self.ledger.feed(step)
        for effect in step.effects:
            match effect:
                case NotifyPeople(text, to, severity, task_id):
                    self._line(step.at, severity, f"to {', '.join(to) or 'nobody'}: {text}", task_id, "")
                case Alarm(code, text, task_id, agent_id):
                    self._line(step.at, "alarm", f"{text} ({code})", task_id, agent_id)

    def _look(self, at: Micros, change: ch.Change, state: EngineState) -> None:
        try:
            self._tell(at, change, state)
        except Exception:  # the feed lacks an event then, but the copy of the state must not lack the change
            log.exception("%s could not be reported", type(change).__name__)

    def _tell(self, at: Micros, change: ch.Change, state: EngineState) -> None:
        """Put what a change means to the outside into the feed; `state` is as it was before."""
        match change:
            case ch.TaskPut(task):
                self._task(at, task, state.tasks.get(task.id))
            case ch.GoalPut(goal):
                self._goal(at, goal, state.goals.get(goal.id))
            case ch.AgentPut(agent):
                self._agent(at, agent, state.agents.get(agent.id))
            case ch.OrderPut(agent_id, order):
                self._order(at, agent_id, order, state.orders.get(agent_id))
            case ch.LockdownPut(lockdown):
                self._lockdown(at, lockdown)
            case ch.LibraryPut(name, versions):
                self._library(at, name, versions)
            case ch.AlarmPut(alarm):
                self._alarm(at, alarm, state.alarms.get(alarm.id))
            case ch.QuestionPut(question):
                self._question(at, question, state.questions.get(question.id))
            case ch.QuestionDrop(question_id):
                dropped = state.questions.get(question_id)
                if dropped is not None and dropped.reply is None:
                    self._report_question(at, dropped, "withdrawn", f"{dropped.number} is withdrawn")

    def rows(self, task_id: str) -> Sequence[ActionRow]:
        """Return the actions of a task, oldest first; hold the state still meanwhile."""
        story = self.ledger.stories.get(task_id)
        return story.rows if story is not None else ()

    def notices(self, task_id: str) -> Sequence[LineFact]:
        """Return the notices and alarms of a task, oldest first."""
        return self._notices.get(task_id, ()) if task_id in self.state.tasks else ()

    def _line(self, at: Micros, severity: str, text: str, task: str, agent: str) -> None:
        line = LineFact(at=at, severity=severity, text=text, task=task, agent=agent)
        if severity == "alarm":
            self.alarms.append(line)
        if task in self.state.tasks:
            if len(self._notices) > len(self.state.tasks):  # of tasks that were forgotten
                self._notices = {known: kept for known, kept in self._notices.items() if known in self.state.tasks}
            self._notices.setdefault(task, deque(maxlen=NOTICES_KEPT)).append(line)
        self.feed.add(
            "alarm" if severity == "alarm" else "notice", at, text, task=task, agent=agent, data={"severity": severity}
        )

    def _task(self, at: Micros, task: TaskRecord, before: TaskRecord | None) -> None:
        if before is None or task.status != before.status:
            why = f": {task.outcome.code} {task.outcome.reason}".rstrip() if task.outcome.code else ""
            if task.restart.why:
                why = f": {AGAIN[task.restart.why]}; then it begins anew"
            text = f"{task.id} {task.status}{why}"
        elif task.hold.causes != before.hold.causes:
            text = f"{task.id} " + (f"HELD ({', '.join(task.hold.words)})" if task.hold.causes else "goes on")
        elif task.section != before.section and task.section == self._sections.get(task.id):
            text = f"{task.id}: {task.section}"
        else:
            return
        data = {
            "status": task.status,
            "held": list(task.hold.words),
            "section": task.section,
            "code": task.outcome.code,
        }
        self.feed.add("task", at, text, task=task.id, data={**data, "reason": task.outcome.reason})

    def _goal(self, at: Micros, goal: GoalRecord, old: GoalRecord | None) -> None:
        if old is None or (goal.state, goal.code) != (old.state, old.code):
            word = f"{goal.state} {goal.code}".rstrip()
            said = goal.text or rest_words(goal)
            text = f"{goal.agent}.{goal.action} {word}" + (f" ({said})" if said else "")
            data = {"goal": goal.id, "action": goal.action, "state": goal.state, "code": goal.code}
            self.feed.add("goal", at, text, task=goal.task, agent=goal.agent, data=data)

    def _agent(self, at: Micros, agent: AgentRecord, before: AgentRecord | None) -> None:
        news = [
            f"{name} {getattr(agent, name) or 'none'}"
            for name in ("liveness", "pool", "control", "breach", "task", "refused")
            if before is None or getattr(agent, name) != getattr(before, name)
            if before is not None or getattr(agent, name)
        ]
        data: dict[str, Any] = {"pool": agent.pool, "liveness": agent.liveness, "control": agent.control}
        if before is not None and agent.taken != before.taken:
            news.append("taken over" if agent.taken else "handed back")
            data["taken"] = agent.taken
        if news:
            first = "is here: " if before is None else ""
            self.feed.add(
                "agent", at, f"{agent.id} {first}{', '.join(news)}", task=agent.task, agent=agent.id, data=data
            )

    def _order(self, at: Micros, agent: str, order: StandingOrder | None, former: StandingOrder | None) -> None:
        shown = order or former
        if shown is None or (order is not None and former is not None and _alike(order, former)):
            return
        if order is None:
            text = f"{agent}: the order `{shown.stop}` stands no more"
        elif order.state == "open":
            text = f"{given(order)}: {doing(self.state, order, at, wall_us())}"
        else:
            text = f"{agent}: the order `{order.stop}` is {order.state}"
        record = self.state.agents.get(agent)
        data = {"stop": shown.stop, "state": "ended" if order is None else order.state, "by": shown.by}
        self.feed.add("order", at, text, task=record.task if record is not None else "", agent=agent, data=data)

    def _refused(self, step: EngineStep) -> None:
        """Tell that an order of a person was refused."""
        given = step.input
        refusal = step.reply
        if not isinstance(refusal, Refusal) or not isinstance(given, Operator | LockdownOrder | Abort):
            return
        match given:
            case Operator(order, target, _):
                what = f"{order.replace('handback_', 'handback --')} {target or '--all'}"
            case LockdownOrder(how, _):
                target, what = "", f"lockdown {how}"
            case Abort(target):
                what = f"abort {target}"
        data = {"order": what, "target": target, "by": given.by, "state": "refused", "code": refusal.code}
        task = target if target in self.state.tasks else ""
        self.feed.add(
            "order", step.at, f"refused to {given.by or 'somebody'}: {what}: {refusal.text}", task=task, data=data
        )

    def _lockdown(self, at: Micros, found: Lockdown | None) -> None:
        text = lockdown_text(found, at) if found is not None else "lockdown is released"
        how, by = (found.how, found.by) if found is not None else ("", "")
        self.feed.add("lockdown", at, text, data={"on": found is not None, "how": how, "by": by})

    def _alarm(self, at: Micros, alarm: AlarmRecord, before: AlarmRecord | None) -> None:
        """Tell what became of an alarm; that it was raised is told by its effect."""
        if before is None or alarm.state == before.state:
            return
        turns = alarm.history[len(before.history) :] if len(alarm.history) > len(before.history) else alarm.history[-1:]
        by = next((turn.by for turn in turns if turn.by), "")
        states = " and ".join(turn.what for turn in turns)
        text = f"{alarm.id} ({alarm.code}) is {states}" + (f" by {by}" if by else "")
        data = {"code": alarm.code, "state": alarm.state, "severity": "info"}
        self.feed.add("notice", at, text, task=alarm.task, agent=alarm.agent, data=data)

    def _library(self, at: Micros, name: str, versions: Sequence[Version]) -> None:
        newest = versions[-1]
        text = f"{name} is served" + (f" in version {newest.n}: new requests get it" if newest.n > 1 else " now")
        self.feed.add("library", at, text, data={"name": name, "version": newest.n, "bundle": newest.bundle})

    def _question(self, at: Micros, question: Question, before: Question | None) -> None:
        if before is None:
            self._report_question(at, question, "open", f"{question.number}: {question.text}")
        elif question.reply is not None and before.reply is None:
            said = f"{question.reply['answer']} by {question.reply['by']}"
            self._report_question(at, question, "answered", f"{question.number} is answered: {said}")

    def _report_question(self, at: Micros, question: Question, state: str, text: str) -> None:
        data = {"question": question.number, "state": state, "options": list(question.options)}
        self.feed.add("question", at, text, task=question.task, data={**data, "people": list(question.asked)})


def _alike(one: StandingOrder, other: StandingOrder) -> bool:
    return (one.stop, one.scope, one.state) == (other.stop, other.scope, other.state)
