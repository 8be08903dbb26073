"""The outbox: news that leave the engine, written in the commit of the step that they come of.

So each is on disk before anybody is told, and none is told that did not happen. Who delivers reads from where it is with each
channel (`EngineState.news`, journaled as well). News are made of a step alone: made again, they are the same.
"""

import logging
from collections.abc import Iterator
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.severities import Severity
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.alarm_records import AlarmRecord, AlarmTurn
from formiga_bt.engine.kernel.inputs import EngineStep, PublishState
from formiga_bt.engine.kernel.records import Question, TaskRecord
from formiga_bt.lang.model.news import What

Kind = Literal[
    "task.ended", "question.opened", "alarm.raised", "alarm.acknowledged", "alarm.cleared", "alarm.escalated"
]
ENDS = {"SUCCEEDED": "info", "FAILED": "warning", "CANCELED": "info"}


class NewsItem(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that people elsewhere may be told."""

    seq: int
    """Of its step."""
    n: int
    """The how-manieth of its step, from 0."""
    at: Micros
    """Engine time."""
    what: What
    kind: Kind
    severity: Severity
    id: str
    """Of a task, a question (`Q7`) or an alarm (`A7`)."""
    state: str
    code: str = ""
    task: str = ""
    agent: str = ""
    """A machine; that of a person is in `person`."""
    to: str = ""
    """Of an escalation: only this channel."""
    text: str = ""
    """From here on what goes along only where the site says so."""
    person: str = ""
    about: str = ""
    by: str = ""
    note: str = ""

    @property
    def urgent(self) -> bool:
        """Return whether it overtakes all that is not, and is held back at no hour."""
        return self.severity == "critical"


MOST_TEXT: Final = 1000
"""Letters of a text that go along."""
log = logging.getLogger("formiga.news")


def news_of(step: EngineStep) -> tuple[NewsItem, ...]:
    """Return what of a step is told elsewhere. Called for each step in the driver's thread: most have nothing."""
    try:
        return _news_of(step)
    except Exception:  # a bug here must not stop the engine
        log.exception("the news of step %s could not be made", step.seq)
        return ()


def _news_of(step: EngineStep) -> tuple[NewsItem, ...]:
    ends = {
        effect.task: effect.status for effect in step.effects if type(effect) is PublishState and effect.status in ENDS
    }
    asked: set[str] = set()
    found: list[NewsItem] = []
    for change in step.changes:
        kind = type(change)
        if kind is ch.AlarmPut:
            assert isinstance(change, ch.AlarmPut)
            turns = change.alarm.history[len(change.alarm.history) - change.new :]
            found += (_of_alarm(step, len(found), change.alarm, turn) for turn in turns)
        elif kind is ch.CounterSet:
            assert isinstance(change, ch.CounterSet)
            if change.name == "question":
                asked.add(f"Q{change.value}")
        elif asked and kind is ch.QuestionPut:
            assert isinstance(change, ch.QuestionPut)
            if change.question.number in asked:
                asked.discard(change.question.number)
                found.append(_of_question(step, len(found), change.question))
    if ends:
        found += _of_ends(step, len(found), ends)
    return tuple(found)


def _of_alarm(step: EngineStep, n: int, alarm: AlarmRecord, turn: AlarmTurn) -> NewsItem:
    return NewsItem(
        seq=step.seq, n=n, at=step.at, what="alarms", kind=f"alarm.{turn.what}",  # type: ignore[arg-type]  # see Kind
        severity=alarm.severity, id=alarm.id, state=alarm.state, code=alarm.code, task=alarm.task,
        agent="" if alarm.human else alarm.agent, to=turn.to, text=alarm.text[:MOST_TEXT],
        person=alarm.agent if alarm.human else "", about=alarm.about, by=turn.by, note=turn.note,
    )  # fmt: skip


def _of_question(step: EngineStep, n: int, question: Question) -> NewsItem:
    waits = question.kind == "clearance" or question.priority == "high"
    return NewsItem(
        seq=step.seq, n=n, at=step.at, what="questions", kind="question.opened",
        severity="alarm" if waits else "warning", id=question.number, state="open", code=question.kind,
        task=question.task, agent=question.clears, text=question.text[:MOST_TEXT], person=", ".join(question.asked),
    )  # fmt: skip


def _of_ends(step: EngineStep, n: int, ends: dict[str, str]) -> Iterator[NewsItem]:
    """Yield the ends of tasks of people and programs; those of the engine itself, such as ways home, are no news."""
    records: dict[str, TaskRecord] = {}
    for change in step.changes:
        if type(change) is ch.TaskPut and change.task.id in ends:
            records[change.task.id] = change.task
    for task_id, status in ends.items():
        record = records.get(task_id)
        if record is None or record.system.agent:
            continue
        yield NewsItem(
            seq=step.seq, n=n, at=step.at, what="ends", kind="task.ended",
            severity=ENDS[status], id=task_id, state=status,  # type: ignore[arg-type]  # the table has severities
            code=record.outcome.code, task=task_id, text=record.outcome.reason[:MOST_TEXT], by=record.request.by,
        )  # fmt: skip
        n += 1
