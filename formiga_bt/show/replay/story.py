"""The story of a task: everything that people would have seen of it, in order, and why it ended as it did."""

from typing import TYPE_CHECKING

from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.show.facts import ActionFact, Because, TaskFact, Waiting

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import Restart
    from formiga_bt.show.replay.source import JournalSource


class StoryEvent(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that happened."""

    at: Micros
    text: str
    severity: str = "info"
    agent: str = ""


class Tale(Struct, frozen=True, kw_only=True):
    """The story of one task until a moment."""

    at: Micros
    task: TaskFact
    events: tuple[StoryEvent, ...]
    because: tuple[Because, ...]


def tale(source: "JournalSource", task_id: str) -> Tale:
    """Return the story of a task.

    Raises:
        TaskError: there is no such task.
    """
    picture, timeline = source.task(task_id), source.timeline([task_id])
    events = [StoryEvent(at=one.at, text=one.text, severity=one.severity, agent=one.agent) for one in picture.lines]
    for action in timeline.actions:
        if action.action != CONFIRM:
            events += _of_action(action)
    for wait in timeline.waits:
        if wait.kind in ("gate", "held"):
            events += _of_wait(wait)
    ended_at = picture.task.ended_at
    for restart in source.machine.restarts(picture.task.submitted_at, picture.at):
        if ended_at is None or restart.ended_at < ended_at:
            events.append(_of_restart(restart))
    events.sort(key=lambda one: one.at)
    return Tale(at=picture.at, task=picture.task, events=tuple(events), because=tuple(source.why(task_id)[1]))


def _of_action(action: ActionFact) -> list[StoryEvent]:
    words = f"{action.agent} {action.action} {action.detail}".rstrip()
    found = [StoryEvent(at=action.start, text=words, agent=action.agent)]
    if action.end is not None:
        bad = action.state not in ("succeeded", "answered", "withdrawn", "canceled", "superseded")
        outcome = f"{action.state} {action.code if action.code != action.state else ''}".rstrip()
        text = f"{action.agent} {action.action}: {outcome}"
        found.append(StoryEvent(at=action.end, text=text, severity="warning" if bad else "info", agent=action.agent))
    return found


def _of_wait(wait: Waiting) -> list[StoryEvent]:
    who = f"{wait.agent} " if wait.agent else ""
    return [StoryEvent(at=wait.start, text=f"{who}{'is held' if wait.kind == 'held' else 'waits'}: {wait.text}")]


def _of_restart(restart: "Restart") -> StoryEvent:
    away, passed = restart.away_us / SECOND, (restart.at - restart.ended_at) / SECOND
    other = f" ({passed:.0f} s of engine time)" if abs(passed - away) > 1 + away / 10 else ""
    end = "the engine was ended" if restart.is_clean else "the engine ended without notice"
    text = f"{end}, started again after {away:.1f} s{other}"
    return StoryEvent(at=restart.ended_at, text=text, severity="info" if restart.is_clean else "warning")
