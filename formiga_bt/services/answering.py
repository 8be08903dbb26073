"""Answers of people at this engine's desk: who answers is told what became of it once the engine has it.

An answer goes to the engine as news of a goal, which nobody waits for. So each step is looked at for it, after the journal.
"""

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as TooLate
from typing import Any, Final

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, GoalEventInput
from formiga_bt.engine.kernel.replies import Done, Refusal
from formiga_bt.services.refused import Refused
from formiga_bt.transport.desk import DeskTransport, OpenQuestion

ANSWER_S: Final = 10.0
"""An answer that the engine has not taken by then is told to be on its way."""


class Answering:
    """Hands answers in, and waits for them.

    Args:
        desk: where people work.
        kept: returns the number of the last step that is on disk.
        within_s: how long an answer is waited for.
    """

    def __init__(self, desk: DeskTransport, kept: Callable[[], int], within_s: float = ANSWER_S) -> None:
        self._desk, self._kept, self._within_s = desk, kept, within_s
        self._door = threading.RLock()
        self._waiting: dict[str, Future[Done | Refusal]] = {}
        """Goal id -> who waits for the reply."""
        self._closed = False

    def answer(self, question: OpenQuestion, option: str, form: Mapping[str, Any] | None = None) -> Done:
        """Answer an open question; return the engine's reply. `form`: what was filled in, as runtime values.

        Raises:
            Refused: no such option, it was closed before, or the engine did not take it in time.
        """
        number, goal_id = question.ask.number, question.goal_id
        future: Future[Done | Refusal] = Future()
        with self._door:
            if self._closed:
                raise _stopped()
            before = self._waiting.setdefault(goal_id, future)
            problem = self._desk.answer(goal_id, option, form)
            if problem:
                if before is future:
                    del self._waiting[goal_id]
                code, _, text = problem.partition(": ")
                raise Refused(code, text)
        try:
            reply = future.result(self._within_s)
        except TooLate:
            text = f"{number}: the answer is on its way, but the engine did not take it within {self._within_s:g} s"
            raise Refused("no_reply", text, "formiga inbox shows whether it is still open") from None
        finally:
            self._waiting.pop(goal_id, None)
        if isinstance(reply, Refusal):
            raise Refused(reply.code, f"{number} is closed: {reply.text}", "formiga inbox")
        return reply

    def feed_step(self, step: EngineStep) -> None:
        """Look at a step that was kept, or could not be; called in the driver's thread."""
        if not self._waiting:
            return
        kept = Done(kept=self._kept() >= step.seq)
        for change in step.changes:
            if isinstance(change, ch.QuestionPut):
                for one in change.question.answers:
                    self._tell(change.question.showing(one.by), kept)
        given = step.input
        if isinstance(given, GoalEventInput) and given.event.state == "succeeded":
            late = Refusal("answer_late", "it was answered, withdrawn or has lapsed")
            self._tell(given.event.goal_id, late)  # nobody asks any more

    def close(self) -> None:
        """The engine has stopped: nobody waits any longer."""
        with self._door:
            self._closed = True
        for future in list(self._waiting.values()):
            if not future.done():
                future.set_exception(_stopped())

    def _tell(self, goal_id: str, reply: Done | Refusal) -> None:
        future = self._waiting.get(goal_id)
        if future is not None and not future.done():
            future.set_result(reply)


def _stopped() -> Refused:
    return Refused("stopped", "the engine is stopped", "formiga up starts it again")
