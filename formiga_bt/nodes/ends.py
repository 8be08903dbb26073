"""What a drain set waits for: each member is a value that says whose end it is."""

from msgspec import Struct


class GoalEnd(Struct, frozen=True, tag="goal", array_like=True):
    """The end of a canceled goal."""

    goal: str


class FinallyEnd(Struct, frozen=True, tag="finally", array_like=True):
    """The end of a stopped sequence's `finally`, which runs on its own."""

    id: str


class AgentReleased(Struct, frozen=True, tag="release", array_like=True):
    """An agent of a block is back in the pool."""

    agent: str


class ChildEnd(Struct, frozen=True, tag="task", array_like=True):
    """The end of a requested task."""

    task: str


End = GoalEnd | FinallyEnd | AgentReleased | ChildEnd
Drain = tuple[End, ...]
