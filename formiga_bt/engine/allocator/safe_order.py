"""The banker's check: after a grant, can all that could end before it still end, in some order?

Source: E. W. Dijkstra, Een algorithme ter voorkoming van de dodelijke omarming, EWD-108 (1965). What holds something is a
`Job`: a block with resources, a task with its machines, which ends after its blocks, and a machine on the routes, which ends
where it is to stay. A job that has what it may still ask for comes to its end, and gives back what it holds. A task that could
not end before (a machine that it needs is lost) keeps nobody from anything.

A machine on the routes needs no fixed things, but a way whose nodes and edges are all free, and keeps the end that it comes to.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from msgspec import Struct

from formiga_bt.base.routes import Entry, Patches, RouteGraph

FULLY: Final = 2
"""A job comes to its end."""
ASIDE: Final = 1
"""It, or one before it, only comes to some place where it may stay, not to where it is to go."""


class Way(Struct, frozen=True):
    """Where a machine is to drive before its job ends."""

    entries: tuple[Entry, ...]
    """Where it goes on from."""
    to: str = ""
    """The end of the routes that it is to come to; "" = any."""


class Job(Struct, frozen=True):
    """What holds something until it ends."""

    id: str
    task: str
    holds: Mapping[str, int]
    needs: Mapping[str, int]
    """What it may ask for before it ends, at once."""
    after: tuple[str, ...] = ()
    """Jobs that end first; what they hold is back then."""
    way: Way | None = None
    may_stay: bool = False
    """It stands where it may stay, and would leave: others count on that, but it need not be able to."""


def can_end(jobs: Iterable[Job], free: Mapping[str, int], graph: RouteGraph | None = None) -> dict[str, int]:
    """Return the jobs that can all end, one after another, if each gets what is free and what those before gave back.

    Args:
        jobs: the jobs.
        free: what is free.
        graph: the routes, if any job has a way.

    Returns:
        Of each such job whether it ends `FULLY` or `ASIDE`.
    """
    left = {job.id: job for job in jobs}
    known = set(left)
    have = dict(free)
    ended: dict[str, int] = {}
    patches = Patches(graph, have) if graph is not None else None
    level = FULLY
    while any(not job.may_stay for job in left.values()):
        # Who would stay in the way of others goes last, one by one; who cannot come to where it is to go steps aside at last.
        went_on = _end_some(left, known, have, ended, level, graph, patches, in_the_way=False)
        went_on = went_on or _end_some(left, known, have, ended, level, graph, patches, in_the_way=True)
        if not went_on:
            if level == ASIDE or graph is None:
                return ended
            level = ASIDE
    return ended


def _end_some(
    left: dict[str, Job], known: set[str], have: dict[str, int], ended: dict[str, int], level: int,
    graph: RouteGraph | None, patches: Patches | None, *, in_the_way: bool,
) -> bool:  # fmt: skip
    """End the jobs that can, or (`in_the_way`) the first whose machine would then stand in the way; return whether any did."""
    went_on = False
    wanted = {job.way.to for job in left.values() if job.way is not None and not job.may_stay}
    for job in list(left.values()):
        if job.may_stay and job.way is not None and job.way.to in wanted:
            continue  # it can wait where it is until who is on the way there has come, and gone
        if any(one in known and one not in ended for one in job.after):
            continue
        if any(units > have.get(key, 0) for key, units in job.needs.items()):
            continue
        end = ""
        if job.way is not None and graph is not None and patches is not None:
            end = _end_of(job, job.way, have, patches, level, graph)
            if not end or (not in_the_way and not graph.is_aside(end)):
                continue
        elif in_the_way:
            continue
        for key, units in job.holds.items():
            have[key] = have.get(key, 0) + units
        if end:
            have[end] -= 1
        if patches is not None and job.way is not None:
            patches.release(job.holds)
            if end and graph is not None and not graph.is_aside(end):
                patches.renew()
        del left[job.id]
        ended[job.id] = level
        if in_the_way:
            return True
        went_on = True
    return went_on


def _end_of(job: Job, way: Way, have: Mapping[str, int], patches: Patches, level: int, graph: RouteGraph) -> str:
    """Return the end that a machine can come to now by parts that are free or its own, or ""."""
    if way.to and _comes_to(job, way, way.to, have, patches, graph):
        return way.to
    if way.to and (level == FULLY or job.may_stay):
        return ""
    ends = sorted(graph.ends, key=lambda end: not graph.is_aside(end))
    return next((end for end in ends if _comes_to(job, way, end, have, patches, graph)), "")


def _comes_to(job: Job, way: Way, end: str, have: Mapping[str, int], patches: Patches, graph: RouteGraph) -> bool:
    own = job.holds
    if not _is_free(end, have, own):
        return False
    patch = patches.of(end)
    for entry in way.entries:
        if not _is_free(entry.node, have, own) or (entry.edge and not _is_free(entry.edge, have, own)):
            continue
        if entry.node == end:
            return True
        begins = [node for node, edge, _ in graph.out[entry.node] if have.get(edge, 0) > 0 or edge in own]
        if end in begins:
            return True
        if patch and (patches.of(entry.node) == patch or any(patches.of(node) == patch for node in begins)):
            starts = [node for node in begins if _is_free(node, have, own)]
            if not graph.has_one_way or graph.reaches(starts, end, have):
                return True
    return False


def _is_free(part: str, have: Mapping[str, int], own: Mapping[str, int]) -> bool:
    return part in own or have.get(part, 0) > 0


def left_waiting(
    before: Iterable[Job],
    after: Iterable[Job],
    free: Mapping[str, int],
    then: Mapping[str, int],
    graph: RouteGraph | None = None,
) -> str:
    """Return a task that could end before a grant and cannot after it, or "".

    Args:
        before: the jobs.
        after: the jobs with what is granted.
        free: what is free before.
        then: what is free after.
        graph: the routes, if any job has a way.
    """
    after, before = list(after), list(before)
    can = can_end(after, then, graph)
    return "" if all_end(after, can) else worse_off(before, after, can_end(before, free, graph), can)


def all_end(jobs: Iterable[Job], can: Mapping[str, int]) -> bool:
    """Return whether all jobs come to their ends that must."""
    return all(can.get(job.id) == FULLY or job.may_stay for job in jobs)


def worse_off(before: Sequence[Job], after: Sequence[Job], could: Mapping[str, int], can: Mapping[str, int]) -> str:
    """Return a task that could end before a grant and cannot after it, or "".

    Args:
        before: the jobs.
        after: the jobs with what is granted.
        could: what `can_end` says of those before.
        can: what it says of those after.
    """
    stood = {job.id for job in before if job.may_stay}
    new = [job for job in after if job.id not in {one.id for one in before}]
    lost = [job for job in after if _worse(job, can, could) and not job.may_stay]
    gone = [job for job in after if job.id in stood and not job.may_stay and can.get(job.id) != FULLY]
    for job in (*lost, *gone, *(job for job in new if can.get(job.id) != FULLY and (job.task in could or job.way))):
        return job.task
    return ""


def _worse(job: Job, can: Mapping[str, int], could: Mapping[str, int]) -> bool:
    return can.get(job.id, 0) < could.get(job.id, 0)
