"""Rows of a task's history: its actions, and the spans in which it waits. A row of something that lasts is changed in place."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.records import GoalRecord
from formiga_bt.lang.model import ActionSpec
from formiga_bt.lang.places import static_path
from formiga_bt.show.facts import ActionFact, Deed, Waiting

SECTIONS = frozenset({"steps", "on_failure", "on_abort", "finally"})
"""Sections of a task's file; in others machines are brought home."""


class ActionRow(Struct):
    """One goal of one agent, from sending to its end."""

    task: str
    agent: str
    action: str
    start: Micros
    end: Micros | None = None
    state: str = ""
    code: str = ""
    goal: str = ""
    detail: str = ""
    """Where it goes, for people."""
    path: str = ""
    """Static path of its step; "" for what the engine sends itself."""

    @property
    def outcome(self) -> str:
        """Return how it ended in words, `running` if it did not."""
        if self.end is None:
            return "running"
        code = "" if self.code == self.state else self.code
        return f"{self.state} {code}".strip()

    def fact(self) -> ActionFact:
        """Return the row as it is now."""
        return ActionFact(
            task=self.task, agent=self.agent, action=self.action, start=self.start, end=self.end,
            state=self.state, code=self.code, goal=self.goal, path=self.path, detail=self.detail,
        )  # fmt: skip


ORDERED: Final[Mapping[str, Deed]] = MappingProxyType({"hold": "stop", "cut": "stop", "return": "move", "land": "rise"})
"""What the engine's own goals do, which no catalogue has."""


def deed_of(action: str, spec: ActionSpec | None) -> Deed:
    """Return what an action does to its agent, by what the catalogue says of it."""
    if action == CONFIRM:
        return "ask"
    if spec is None:
        return ORDERED.get(action, "")
    if spec.cuts:
        return "stop"
    if spec.effect or spec.lands:
        return "rise"
    return "move" if spec.moves_to else ""


class WaitRow(Struct):
    """A span in which a task waits; `end` is None while it does."""

    task: str
    kind: Literal["pending", "question", "gate", "held"]
    start: Micros
    end: Micros | None = None
    agent: str = ""
    text: str = ""

    def fact(self) -> Waiting:
        """Return the row as it is now."""
        return Waiting(task=self.task, kind=self.kind, start=self.start, end=self.end, agent=self.agent, text=self.text)


def row_of(goal: GoalRecord, at: Micros) -> ActionRow:
    """Return the row of a goal that was sent just now."""
    path = path_of_goal(goal.id)
    return ActionRow(goal.task, goal.agent, goal.action, at, goal=goal.id, detail=where(goal), path=path)


def path_of_goal(goal_id: str) -> str:
    """Return the static path of the step that a goal (or a question) belongs to, or "" if it is none of a task's file.

    Ids are `<task>/<run>/<instance path>`, then `+2` for a goal that a person continued, `~<person>` for a question shown.
    """
    parts = goal_id.partition("~")[0].split("/", 2)
    if len(parts) < 3 or parts[2].partition("/")[0] not in SECTIONS:
        return ""
    return static_path(parts[2])


def rest_words(goal: GoalRecord) -> str:
    """Return what a goal does of its step's action that was broken off, or an empty text."""
    up = next((value.up_m for value in goal.fields.values() if isinstance(value, Position)), None)
    if not goal.rest_of or up is None:
        return ""
    return f"climbs to {up:.0f} m: what is left of {goal.rest_of}"


def where(goal: GoalRecord) -> str:
    """Return where a goal moves its agent: metres east, north and up of the base station, or what it is the rest of."""
    if rest := rest_words(goal):
        return rest
    for value in goal.fields.values():
        if isinstance(value, Position):
            return f"to {value.east_m:.0f} E {value.north_m:.0f} N {value.up_m:.0f} up"
        if isinstance(value, Place):
            return f"at {value.east_m:.0f} E {value.north_m:.0f} N"
    return ""
