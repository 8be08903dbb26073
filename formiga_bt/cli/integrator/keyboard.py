"""The person at the keyboard of `formiga demo --ask-me`: questions are printed, a typed line answers the oldest one.

A thread reads lines; what they mean is decided in the demo's own thread, in `look`. Without a terminal nothing is read, and the
`formiga answer` command to use is named instead.
"""

import sys
import threading
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from formiga_bt.services.demo import ScenarioDemo
    from formiga_bt.show.live import LivePrinter
    from formiga_bt.transport.desk import OpenQuestion


class Keyboard:
    """Shows what is asked and takes the answers."""

    def __init__(self, demo: "ScenarioDemo", view: "LivePrinter") -> None:
        self._demo = demo
        self._view = view
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._told: set[str] = set()
        self._reads = sys.stdin is not None and sys.stdin.isatty()
        if self._reads:
            threading.Thread(target=self._read, name="keyboard", daemon=True).start()

    def _read(self) -> None:
        for line in sys.stdin:
            self._lines.put(line.strip())

    def look(self) -> None:
        """Print new questions, and give the answers typed since the last look."""
        questions = sorted(self._demo.open_questions(), key=lambda q: q.asked_at)
        for question in questions:
            if question.goal_id not in self._told:
                self._told.add(question.goal_id)
                self._print(question)
        while True:
            try:
                line = self._lines.get_nowait()
            except Empty:
                return
            if line:
                self._answer(line, questions)

    def _print(self, question: "OpenQuestion") -> None:
        ask = question.ask
        self._view.say(
            f"{ask.number} for you, {question.person}: {ask.question}" + (f" ({ask.note})" if ask.note else "")
        )
        if self._reads:
            self._view.say(f"    type {', '.join(ask.options[:-1])} or {ask.options[-1]}, then Enter")
        else:
            asked = [q for q in self._demo.open_questions() if q.ask.number == ask.number]
            by = f" --by {question.person}" if len(asked) > 1 else ""
            self._view.say(
                f"    answer with: formiga answer {ask.number} {ask.options[0]}{by}   (or {', '.join(ask.options[1:])})"
            )

    def _answer(self, line: str, questions: "list[OpenQuestion]") -> None:
        first, _, rest = line.partition(" ")
        named = [q for q in questions if q.ask.number.lower() == first.lower()]
        word = rest.strip() if named else line
        assert self._demo.host is not None
        if not questions:
            self._view.say("nothing is asked now")
            return
        target = (named or questions)[0]
        error = self._demo.host.desk.answer(target.goal_id, word)
        if error:
            self._view.say(f"{target.ask.number}: {error}")
