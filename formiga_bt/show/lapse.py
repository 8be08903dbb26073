"""When an open question lapses."""

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.records import Question
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import ClearanceDue


def cleared_machine(question: Question) -> str:
    """Return the machine that a question of the engine wants people to stand clear of, or "" if it is another question."""
    return question.id.split("/")[1] if question.kind == "clearance" else ""


def lapses_at(state: EngineState, question: Question) -> Micros | None:
    """Return when a question lapses, or None: it waits for ever.

    A machine that waits for people to stand clear gives up when its patience ends, which in the air is when its charge says so.
    """
    machine = cleared_machine(question)
    if machine:
        patience = state.deadlines.get(ClearanceDue(machine))
        if patience is not None:
            return patience.at
    return question.expires_at
