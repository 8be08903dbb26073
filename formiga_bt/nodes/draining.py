"""Drain sets: the ends that a node which ordered a stop waits for, before it returns what it decided.

Whose end it is says `nodes.ends`. The owner of a drain set is woken at each end; if it is itself stopped, what is not over
moves on.
"""

from collections.abc import Iterator, Sequence

from formiga_bt.nodes.ends import Drain, End, GoalEnd
from formiga_bt.nodes.run import DrainRun, Failure, GoalView


def adopt(run: DrainRun, owner: str, ends: Sequence[End]) -> Drain:
    """Make the node with key `owner` the one that waits for these ends; return them as its drain set."""
    for end in ends:
        run.adopt(end, owner)
    return tuple(ends)


def is_empty(run: DrainRun, drain: Drain) -> bool:
    """Return whether all of a drain set is over."""
    return all(run.is_over(end) for end in drain)


def goals(run: DrainRun, drain: Drain) -> Iterator[GoalView]:
    """Return the goals of a drain set."""
    return (run.goal(end.goal) for end in drain if isinstance(end, GoalEnd))


def unconfirmed(run: DrainRun, drain: Drain, path: str) -> Failure | None:
    """Return the failure of a drain set whose cancel an agent never confirmed, if there is one."""
    for view in goals(run, drain):
        if view.state == "in_doubt":
            reason = "the agent never confirmed the cancel"
            return Failure("cancel_unconfirmed", reason, path, view.agent, retryable=False)
    return None


def drop(run: DrainRun, drain: Sequence[End]) -> None:
    """Forget what is over of a drain set."""
    for end in drain:
        run.forget(end)


def move_on(run: DrainRun, drain: Drain) -> list[End]:
    """Return what is not over, for who stopped us; forget the rest."""
    left = [end for end in drain if not run.is_over(end)]
    drop(run, [end for end in drain if end not in left])
    return left
