"""The banker's check: after a grant, can all that could end before it still end, in some order?

Source: E. W. Dijkstra, Een algorithme ter voorkoming van de dodelijke omarming, EWD-108 (1965). What holds something is a
`Job`: a block with resources, and a task with its machines, which ends after its blocks. A job that has what it may still ask
for comes to its end, and gives back what it holds. A task that could not end before (a machine that it needs is lost) keeps
nobody from anything.
"""

from collections.abc import Iterable, Mapping

from msgspec import Struct


class Job(Struct, frozen=True):
    """What holds something until it ends."""

    id: str
    task: str
    holds: Mapping[str, int]
    needs: Mapping[str, int]
    """What it may ask for before it ends, at once."""
    after: tuple[str, ...] = ()
    """Jobs that end first; what they hold is back then."""


def can_end(jobs: Iterable[Job], free: Mapping[str, int]) -> dict[str, None]:
    """Return the jobs that can all end, one after another, if each gets what is free and what those before gave back."""
    left = {job.id: job for job in jobs}
    known = set(left)
    have = dict(free)
    ended: dict[str, None] = {}
    went_on = True
    while went_on:
        went_on = False
        for job in list(left.values()):
            if any(one in known and one not in ended for one in job.after):
                continue
            if any(units > have.get(key, 0) for key, units in job.needs.items()):
                continue
            for key, units in job.holds.items():
                have[key] = have.get(key, 0) + units
            del left[job.id]
            ended[job.id] = None
            went_on = True
    return ended


def left_waiting(before: Iterable[Job], after: Iterable[Job], free: Mapping[str, int], then: Mapping[str, int]) -> str:
    """Return a task that could end before a grant and cannot after it, or "".

    Args:
        before: the jobs.
        after: the jobs with what is granted.
        free: what is free before.
        then: what is free after.
    """
    could = can_end(before, free)
    after = list(after)
    can = can_end(after, then)
    new = [job for job in after if job.id not in {one.id for one in before}]
    lost = [job for job in after if job.id in could and job.id not in can]
    for job in (*lost, *(job for job in new if job.id not in can and job.task in could)):
        return job.task
    return ""
