"""Who steps aside for whom: what preemption says to the task that waits, and to the one that began anew.

Pure functions over a state, part of `why`.
"""

from collections.abc import Iterator, Mapping
from typing import Final

from formiga_bt.engine.kernel.records import AgentRequest, TaskRecord, Verdict
from formiga_bt.show.facts import Because

KEPT: Final[Mapping[str, str]] = {
    "not_preemptible": "its task file does not allow it",
    "held": "a person holds it",
    "ordered": "an order stands on a machine of it",
    "spent": "it has done something that may not be done twice",
    "loaded": "a machine of it is loaded",
    "critical": "a critical step of it runs",
}
"""Why a task is not preempted now (`engine.allocator.preemption`)."""

ENDED: Final[Mapping[str, str]] = {
    "preempted": "was preempted",
    "agent_lost": "lost a machine",
    "restart": "was restarted by a person",
}
"""Why an earlier run ended."""


def making_room(request: AgentRequest) -> Iterator[Because]:
    """Tell a task that waits who steps aside for it."""
    if request.preempting:
        names = ", ".join(request.preempting)
        verb = "step" if len(request.preempting) > 1 else "steps"
        text = f"{names} {verb} aside for it, machines come home first; the roles' `wait` stands still meanwhile"
        yield Because("preempting", text)


def earlier_runs(task: TaskRecord) -> Iterator[Because]:
    """Tell why a task began anew, for each of its earlier runs."""
    for line in task.restart.past:
        run, _, rest = line.partition(": ")
        word, _, more = rest.partition(" ")
        text = f"{run} {ENDED.get(word, word)}" + (f" {more}" if word == "preempted" else f" ({more})" if more else "")
        yield Because(f"past.{word}", text)


def detail(verdict: Verdict) -> str:
    """Return the detail of a verdict in words."""
    if verdict.code != "kept":
        return verdict.detail
    return f"{verdict.detail}, which is not preempted: {KEPT.get(verdict.why, verdict.why)}"
