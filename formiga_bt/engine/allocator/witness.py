"""The safe order of machines on the routes, kept from one look to the next: a witness that all come to their ends.

`safe_order` looks for an order anew each time. Between two looks one machine has moved by one node: the order of before is
nearly always one still. So it is tried first, job by job, and only who cannot end at its place in it is looked at again, once
something that was in its way is free. An order that was found so is one by the same rule, and no order is trusted unseen.
"""

from collections.abc import Iterable

from msgspec import Struct

from formiga_bt.base.routes import RouteGraph
from formiga_bt.base.ways import Ways
from formiga_bt.engine.allocator.safe_order import ASIDE, FULLY, Job, Way


class Held(Struct, frozen=True):
    """A machine on the routes: what it takes up, and its job, if it is to go anywhere."""

    parts: int
    """As bits of `Ways`."""
    job: Job | None = None


class Answer(Struct, frozen=True):
    """Whether all that are on their way can come to their ends."""

    waits: str = ""
    """A machine that cannot; "" = all can."""
    is_sure: bool = True
    """No other order would do. One may if an end is in the way now that a machine need not have driven to first."""
    blocked: int = 0
    """Of a no: all that is in the way of those that cannot end. While it is, and they want the same, the answer is the same."""
    held_by: frozenset[str] = frozenset()
    """Jobs that cannot end, or came to an end that is in the way."""


class _Run(Struct):
    """An order in the making."""

    free: int
    doubled: int
    """What two machines take up: it is free for nobody when one of them has gone."""
    left: dict[str, tuple[Job, Way, int]]
    must: set[str]
    """Those of them that must end; others stand where they may stay."""
    wanted: dict[str, int]
    """End -> how many of these are to come to it."""
    blocked: dict[str, int]
    order: list[str]
    came_to: dict[str, int]
    """Job -> the end that it came to."""
    chosen: int = 0
    """Ends that machines came to in this order and, so far as they matter to others, need not have in another one."""


class Witness:
    """An order in which all machines came to where they are to go when it was last looked for."""

    def __init__(self, graph: RouteGraph) -> None:
        self._graph = graph
        self.ways = Ways(graph)
        self._order: list[str] = []

    def all_end(self, machines: Iterable[Held]) -> Answer:
        """Return whether all machines that are on their way can come to their ends, one after the other.

        Args:
            machines: all that take up parts of the routes.
        """
        run = self._begin(machines)
        for job_id in self._order:
            if not run.must:
                break
            if job_id in run.left:
                self._end(run, job_id, in_the_way=True)
        while run.must:
            went_on = (
                self._end_more(run, run.must)
                or self._end_more(run, self._near(run))
                or self._end_more(run, run.left)
                or self._end_more(run, run.left, in_the_way=True)
            )
            if not went_on:
                waits = next(job.task for name, (job, _, _) in run.left.items() if name in run.must)
                blocked, names = self._in_the_way(run)
                names |= {name for name, end in run.came_to.items() if end & blocked}
                return Answer(waits, not run.chosen & blocked, blocked, frozenset(names))
        self._order = run.order
        return Answer()

    def ends(self, machines: Iterable[Held]) -> dict[str, int]:
        """Return which jobs come to their ends, `FULLY` or `ASIDE`: what `safe_order.can_end` says, looked for anew."""
        run = self._begin(machines)
        ended: dict[str, int] = {}
        level = FULLY
        while run.must:
            went_on = self._end_some(run, ended, level, in_the_way=False) or self._end_some(
                run, ended, level, in_the_way=True
            )
            if not went_on and level == ASIDE:
                break
            if not went_on:
                level = ASIDE
                run.blocked.clear()
        return ended

    def _end_some(self, run: _Run, ended: dict[str, int], level: int, *, in_the_way: bool) -> bool:
        went_on = False
        wanted = {run.left[name][1].to for name in run.must}
        for name, (job, way, parts) in list(run.left.items()):
            if job.may_stay and way.to in wanted:
                continue
            end = self._end_of(run, name, level)
            if not end or (not in_the_way and not self._graph.is_aside(end)):
                continue
            run.free = (run.free | (parts & ~run.doubled)) & ~self.ways.bit[end]
            del run.left[name]
            run.must.discard(name)
            ended[name] = level
            if in_the_way:
                return True
            went_on = True
        return went_on

    def _end_of(self, run: _Run, name: str, level: int) -> str:
        """Return the end that a machine can come to now, or ""."""
        job, way, parts = run.left[name]
        blocked = run.blocked.get(name, 0)
        if blocked and not blocked & run.free:
            return ""
        found = self.ways.find(way.entries, way.to, run.free | parts)
        if not found.end and way.to and level == ASIDE and not job.may_stay:
            blocked = found.blocked
            found = self.ways.find(way.entries, "", run.free | parts)
        run.blocked[name] = 0 if found.end else blocked | found.blocked
        return found.end

    @staticmethod
    def _in_the_way(run: _Run) -> tuple[int, set[str]]:
        """Return all that keeps those from ending that must, and who: what is in their way, and in that of whoever holds it."""
        found, names = 0, set(run.must)
        while True:
            for name in names:
                found |= run.blocked.get(name, 0)
            more = {name for name, (_, _, parts) in run.left.items() if parts & found} - names
            if not more:
                return found, names
            names |= more

    def _begin(self, machines: Iterable[Held]) -> _Run:
        taken = doubled = 0
        left: dict[str, tuple[Job, Way, int]] = {}
        must: set[str] = set()
        wanted: dict[str, int] = {}
        for one in machines:
            doubled |= taken & one.parts
            taken |= one.parts
            job = one.job
            if job is not None and job.way is not None:
                left[job.id] = (job, job.way, one.parts)
                if not job.may_stay:
                    must.add(job.id)
                    wanted[job.way.to] = wanted.get(job.way.to, 0) + 1
        return _Run(self.ways.all & ~taken, doubled, left, must, wanted, {}, [], {})

    @staticmethod
    def _near(run: _Run) -> list[str]:
        """Return those that take up something on the way of who must end."""
        blocked = 0
        for name in run.must:
            blocked |= run.blocked.get(name, 0)
        return [name for name, (_, _, parts) in run.left.items() if parts & blocked]

    def _end_more(self, run: _Run, names: Iterable[str], *, in_the_way: bool = False) -> bool:
        """End those that can; or, of those that would then stand in the way of others, one. Return whether any did."""
        went_on = False
        wanted = frozenset(names)
        for name in [one for one in run.left if one in wanted]:
            if self._end(run, name, in_the_way=in_the_way):
                went_on = True
                if in_the_way:
                    return True
        return went_on

    def _end(self, run: _Run, name: str, *, in_the_way: bool) -> bool:
        job, way, parts = run.left[name]
        if job.may_stay and run.wanted.get(way.to):
            return False  # it can wait where it is until who is on the way there has come
        blocked = run.blocked.get(name, 0)
        if blocked and not blocked & run.free:
            return False
        found = self.ways.find(way.entries, way.to, run.free | parts)
        if not found.end:
            run.blocked[name] = found.blocked
            return False
        if not in_the_way and not self._graph.is_aside(found.end):
            return False
        run.free = (run.free | (parts & ~run.doubled)) & ~self.ways.bit[found.end]
        if job.may_stay or not way.to or len(self._graph.edges_at(found.end)) > 1:
            run.chosen |= self.ways.bit[found.end]
        run.order.append(name)
        run.came_to[name] = self.ways.bit[found.end]
        del run.left[name]
        if not job.may_stay:
            run.must.discard(name)
            run.wanted[way.to] -= 1
        return True
