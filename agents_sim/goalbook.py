"""What one simulated agent did with its goals, in a file that outlives its process and its engine: `<id>.goals.jsonl`.

A line when the body begins a goal and one when the goal ends, written before the engine hears of it. Who judges whether a leg
was flown twice, or a person asked twice, reads it here: it is the agents' own account, not the engine's. Written by `process`.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import msgspec
from msgspec import Struct

from agents_sim.lines import Disk, Lines
from formiga_bt.agent.pacing import PacedSide
from formiga_bt.base.clock import Micros
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.base import AgentBody, UpdatableBody
from formiga_bt.transport.messages import TERMINAL, GoalRequest, GoalState


class GoalNote(Struct, frozen=True, omit_defaults=True):
    """A line: the body begins a goal (`state` = "begun"), or one that was begun has ended."""

    agent: str
    goal: str
    state: Literal["begun"] | GoalState
    wall: Micros
    """Since 1970."""
    at: Micros
    """Engine time, as the agent knows it."""
    action: str = ""
    fields: dict[str, Any] = {}


class GoalBook:
    """The file of one agent, open for appending.

    Args:
        folder: where it is.
        agent: whose.
        now: engine time.
        disk: whom to tell that it cannot be written.
    """

    def __init__(self, folder: Path, agent: str, now: Callable[[], Micros], disk: Disk | None = None) -> None:
        self._agent, self._now = agent, now
        self._lines = Lines(folder / f"{agent}.goals.jsonl", disk if disk is not None else Disk(agent))

    def note(
        self,
        goal: str,
        state: Literal["begun"] | GoalState,
        action: str = "",
        fields: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        """Append a line; if there is room it is with the operating system when this returns."""
        line = GoalNote(self._agent, goal, state, time.time_ns() // 1000, self._now(), action, dict(fields))
        self._lines.write(msgspec.json.encode(line))

    def try_again(self) -> None:
        """Write what had no room."""
        self._lines.try_again()

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


class BookedBody:
    """Stands before a body and notes each goal that it begins (an `AgentBody`)."""

    def __init__(self, body: AgentBody, book: GoalBook) -> None:
        self._body, self._book = body, book

    def start(self, request: GoalRequest) -> str:
        """Let the body begin, and note it if it did."""
        code = self._body.start(request)
        if not code:
            self._book.note(request.goal_id, "begun", request.action, request.fields)
        return code

    def cancel(self, goal_id: str) -> bool:
        """Let the body cancel."""
        return self._body.cancel(goal_id)

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        """Let the body follow other fields, if it can."""
        return self._body.update(goal_id, fields) if isinstance(self._body, UpdatableBody) else "no_update"


class BookedSide(PacedSide):
    """A side that notes how its goals end. Set `book` before the first goal; None: nothing is noted."""

    book: GoalBook | None = None

    def finish(
        self,
        goal_id: str,
        state: GoalState,
        *,
        code: str = "",
        text: str = "",
        result: dict[str, Any] | None = None,
        attachments: Sequence[Attachment] = (),
    ) -> None:
        """End a goal, as any side does."""
        if self.book is not None and self.state_of(goal_id) not in {*TERMINAL, "unknown"}:
            self.book.note(goal_id, state)
        super().finish(goal_id, state, code=code, text=text, result=result, attachments=attachments)


def read_books(folder: Path) -> Iterator[GoalNote]:
    """Return the notes of all agents of a folder, agent by agent in order. A line cut short by a death is left out."""
    decoder = msgspec.json.Decoder(GoalNote)
    for path in sorted(folder.glob("*.goals.jsonl")):
        with path.open("rb") as lines:
            for line in lines:
                if line.endswith(b"\n"):
                    yield decoder.decode(line)
