"""What a step says to people, one line each: states of tasks, questions and answers, notices, alarms, refused orders."""

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.inputs import (
    Abort,
    Alarm,
    Effect,
    EngineStep,
    LockdownOrder,
    NotifyPeople,
    Operator,
    PublishState,
)
from formiga_bt.engine.kernel.records import Question
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.facts import LineFact


class LineMaker(Struct):
    """Makes the lines; it remembers which status of each task was told last."""

    shown: dict[str, str]

    def of_effect(self, at: Micros, effect: Effect, state: EngineState) -> LineFact | None:
        """Return the line of an effect, or None if people need none."""
        match effect:
            case NotifyPeople(text, to, severity, task):
                return LineFact(at=at, text=f"to {', '.join(to) or 'nobody'}: {text}", severity=severity, task=task)
            case Alarm(code, text, task, agent):
                of = f", {task}" if task else ""
                return LineFact(at=at, text=f"{text} ({code}{of})", severity="alarm", task=task, agent=agent)
            case PublishState(task, "HELD") if task not in state.tasks or not state.tasks[task].hold.causes:
                return None  # and went on in the same step
            case PublishState(task, status, code, reason):
                return LineFact(at=at, text=f"{task} {self._status(task, status, code, reason, state)}", task=task)
        return None

    def _status(self, task: str, status: str, code: str, reason: str, state: EngineState) -> str:
        was, self.shown[task] = self.shown.get(task), status
        if status == "HELD":
            return f"HELD ({', '.join(state.tasks[task].hold.words)})"
        if was == "HELD" and status in ("ASSIGNED", "ACTIVE"):
            return "goes on"
        return f"{status}: {code} {reason}".rstrip() if code else status


def of_refusal(step: EngineStep) -> LineFact | None:
    """Return the line of an order that was refused, or None."""
    given = step.input
    refusal = step.reply
    if not isinstance(refusal, Refusal) or not isinstance(given, Operator | LockdownOrder | Abort):
        return None
    match given:
        case Operator(order, target, _):
            what = f"{order} {target or 'all'}"
        case LockdownOrder(how, _):
            target, what = "", f"lockdown {how}"
        case Abort(target):
            what = f"abort {target}"
    text = f"refused to {given.by or 'somebody'}: {what}: {refusal.text}"
    return LineFact(at=step.at, text=text, severity="warning", task=target)


def of_question(at: Micros, question: Question, before: Question | None) -> list[LineFact]:
    """Return the lines of a question that was opened or answered."""
    found = []
    if before is None:
        who = ", ".join(question.asked) or "nobody"
        text = f"{question.number} to {who}: {question.text} ({', '.join(question.options)})"
        found.append(LineFact(at=at, text=text, task=question.task))
    if question.reply is not None and (before is None or before.reply is None):
        said = f"{question.reply['answer']} by {question.reply['by']}"
        found.append(LineFact(at=at, text=f"{question.number} is answered: {said}", task=question.task))
    return found
