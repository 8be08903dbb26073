"""The story of a task: everything that people would have seen of it, in order, and why it ended as it did."""

from msgspec import Struct

from formiga_bt.clock import Micros
from formiga_bt.show.facts import ActionFact, Because, TaskFact, Waiting
from formiga_bt.show.source import Source


class Happened(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that happened."""

    at: Micros
    text: str
    severity: str = "info"
    agent: str = ""


class Tale(Struct, frozen=True, kw_only=True):
    """The story of one task until a moment."""

    at: Micros
    task: TaskFact
    events: tuple[Happened, ...]
    because: tuple[Because, ...]


def tale(source: Source, task_id: str) -> Tale:
    """Return the story of a task.

    Raises:
        TaskError: there is no such task.
    """
    picture, timeline = source.task(task_id), source.timeline([task_id])
    events = [Happened(at=one.at, text=one.text, severity=one.severity, agent=one.agent) for one in picture.lines]
    for action in timeline.actions:
        if action.action != "Confirm":
            events += _of_action(action)
    for wait in timeline.waits:
        if wait.kind in ("gate", "held"):
            events += _of_wait(wait)
    events.sort(key=lambda one: one.at)
    return Tale(at=picture.at, task=picture.task, events=tuple(events), because=tuple(source.why(task_id)[1]))


def _of_action(action: ActionFact) -> list[Happened]:
    words = f"{action.agent} {action.action} {action.detail}".rstrip()
    found = [Happened(at=action.start, text=words, agent=action.agent)]
    if action.end is not None:
        bad = action.state not in ("succeeded", "answered", "withdrawn", "canceled", "superseded")
        outcome = f"{action.state} {action.code if action.code != action.state else ''}".rstrip()
        text = f"{action.agent} {action.action}: {outcome}"
        found.append(Happened(at=action.end, text=text, severity="warning" if bad else "info", agent=action.agent))
    return found


def _of_wait(wait: Waiting) -> list[Happened]:
    who = f"{wait.agent} " if wait.agent else ""
    return [Happened(at=wait.start, text=f"{who}{'is held' if wait.kind == 'held' else 'waits'}: {wait.text}")]
