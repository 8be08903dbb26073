"""A chat that says what a test tells it to, and keeps what it was asked."""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from formiga_bt.llm.records import Message, ModelReply, Usage


class Scripted:
    """Answers one after another; the last one again and again."""

    name = "scripted"
    model = "none"

    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self.asked: list[list[Message]] = []
        self.temperatures: list[float] = []

    def complete(
        self,
        messages: Sequence[Message],
        schema: Mapping[str, Any] | None,
        *,
        max_tokens: int,
        temperature: float = 0.0,
        seed: int | None = None,
        on_progress: Callable[[int], None] | None = None,
        cancel: threading.Event | None = None,
    ) -> ModelReply:
        """Return the next answer."""
        del schema, max_tokens, seed, on_progress, cancel
        self.asked.append(list(messages))
        self.temperatures.append(temperature)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, ModelReply):
            return answer
        text = answer if isinstance(answer, str) else json.dumps(answer)
        data = None if isinstance(answer, str) else answer
        return ModelReply(text=text, data=data, usage=Usage(1000, 900, 100), seconds=1.0, model=self.model)

    def close(self) -> None:
        """Nothing is open."""


def tree(
    *steps: Any, agents: Sequence[Mapping[str, Any]] = ({"name": "drone", "type": "lwd"},), task: str = "Mission"
) -> Any:
    """Return an answer with a task in short form."""
    return {"plan": "As asked.", "answer": {"tree": {"task": task, "agents": list(agents), "steps": list(steps)}}}


def fly_to(place: str, height: str = "40 m", agent: str = "drone") -> dict[str, str]:
    """Return the step."""
    return {"do": "FlyTo", "agent": agent, "to": place, "height": height}


def home(agent: str = "drone") -> dict[str, str]:
    """Return the step."""
    return {"do": "ReturnHome", "agent": agent}
