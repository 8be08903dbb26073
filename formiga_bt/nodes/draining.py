"""Drain sets: the goals whose end a node that ordered a stop waits for, before it returns what it decided.

A goal in a drain set is woken for its new owner. If the owner is itself stopped, the goals that have not ended move on.
"""

from collections.abc import Sequence

from formiga_bt.nodes.run import Failure, Run


def adopt(run: Run, owner: str, goals: Sequence[str]) -> tuple[str, ...]:
    """Make the node with key `owner` the one that waits for these goals; return them as its drain set."""
    for goal in goals:
        run.adopt(goal, owner)
    return tuple(goals)


def is_empty(run: Run, drain: Sequence[str]) -> bool:
    """Return whether all goals of a drain set have ended."""
    return all(run.goal(goal).ended for goal in drain)


def unconfirmed(run: Run, drain: Sequence[str], path: str) -> Failure | None:
    """Return the failure of a drain set whose cancel an agent never confirmed, if there is one."""
    for goal in drain:
        view = run.goal(goal)
        if view.state == "in_doubt":
            reason = "the agent never confirmed the cancel"
            return Failure("cancel_unconfirmed", reason, path, view.agent, retryable=False)
    return None


def drop(run: Run, drain: Sequence[str]) -> None:
    """Forget the ended goals of a drain set."""
    for goal in drain:
        run.drop_goal(goal)


def move_on(run: Run, drain: Sequence[str]) -> list[str]:
    """Return the goals that have not ended, for who stopped us; forget the others."""
    left = [goal for goal in drain if not run.goal(goal).ended]
    drop(run, [goal for goal in drain if goal not in left])
    return left
