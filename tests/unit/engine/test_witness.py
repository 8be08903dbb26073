"""The safe order that is kept from look to look, against the one that is looked for anew, and against all orders tried."""

import random

import pytest

from formiga_bt.base.geo import Place
from formiga_bt.base.routes import Entry, RouteEdge, RouteGraph, RouteNode, Routes
from formiga_bt.engine.allocator.safe_order import FULLY, Job, Way, can_end, left_waiting
from formiga_bt.engine.allocator.witness import Held, Witness

STEP_M = 10.0


def graph_of(draw: random.Random) -> RouteGraph:
    """Return lanes in a small grid, some one-way, with bays beside them and a place to stay on some."""
    columns, rows = draw.randint(2, 4), draw.randint(2, 3)
    nodes, edges = {}, []
    for row in range(rows):
        for column in range(columns):
            name = f"n{column}_{row}"
            nodes[name] = RouteNode(name, Place(column * STEP_M, row * STEP_M), is_end=draw.random() < 0.1)
            for on, back in ((column, f"n{column - 1}_{row}"), (row, f"n{column}_{row - 1}")):
                if on and draw.random() < 0.85:
                    a, b = draw.choice([(name, back), (back, name)])
                    edges.append(RouteEdge(a, b, one_way=draw.random() < 0.4))
    for n, at in enumerate(draw.sample(sorted(nodes), min(len(nodes), 5))):
        place = nodes[at].at
        nodes[f"b{n}"] = RouteNode(f"b{n}", Place(place.east_m + 3.0, place.north_m + 3.0), is_end=True)
        edges.append(RouteEdge(at, f"b{n}"))
    return RouteGraph(Routes(nodes, tuple(edges)))


class Hall:
    """Machines on a graph, one node each, that are moved as the rule says."""

    def __init__(self, seed: int) -> None:
        self.draw = random.Random(seed)
        self.graph = graph_of(self.draw)
        self.witness = Witness(self.graph)
        count = min(self.draw.randint(2, 5), len(self.graph.ends))
        self.at = dict(zip([f"r{n}" for n in range(count)], self.draw.sample(self.graph.ends, count), strict=True))
        self.to = {one: self.draw.choice([*self.graph.ends, ""]) for one in self.at}
        self.lost = {one for one in self.at if self.draw.random() < 0.05}

    def held(self, moved: tuple[str, str] | None) -> list[Held]:
        return [Held(self.witness.ways.mask([node]), job) for node, job in self.machines(moved)]

    def machines(self, moved: tuple[str, str] | None) -> list[tuple[str, Job | None]]:
        """Return the node and the job of each machine; `moved`: one of them at another node, as the last one."""
        found: list[tuple[str, Job | None]] = []
        order = [one for one in self.at if moved is None or one != moved[0]] + ([moved[0]] if moved else [])
        for one in order:
            at = moved[1] if moved is not None and one == moved[0] else self.at[one]
            is_end, to = self.graph.nodes[at].is_end, self.to[one]
            stays = is_end and (moved is None or one != moved[0])
            idle = one in self.lost or (to in ("", at) if stays else at == to)
            job = None if idle else Job(one, one, {at: 1}, {}, way=Way((Entry(at),), to), may_stay=stays)
            found.append((at, job))
        return found

    def fully(self, moved: tuple[str, str] | None) -> tuple[list[Job], dict[str, int]]:
        machines = self.machines(moved)
        free = dict.fromkeys(self.graph.parts, 1)
        for node, _ in machines:
            free[node] -= 1
        return [job for _, job in machines if job is not None], free


def tried(hall: Hall, moved: tuple[str, str] | None) -> bool:
    """Return whether there is any order, and any choice of ends, in which all come to their ends that may not stay."""
    jobs, free = hall.fully(moved)
    seen: set[tuple[frozenset[str], frozenset[str]]] = set()

    def goes_on(left: list[Job], have: frozenset[str]) -> bool:
        if all(job.may_stay for job in left):
            return True
        key = frozenset(job.id for job in left), have
        if key in seen:
            return False
        seen.add(key)
        for job in left:
            assert job.way is not None
            own = have | frozenset(job.holds)
            for end in [job.way.to] if job.way.to else hall.graph.ends:
                way = hall.graph.free_way(job.way.entries, [end], own.__contains__)
                if way is not None and goes_on([one for one in left if one is not job], own - {end}):
                    return True
        return False

    return goes_on(jobs, frozenset(part for part, count in free.items() if count > 0))


@pytest.mark.parametrize("seed", range(150))
def test_kept_order_says_what_the_full_check_says(seed: int) -> None:
    """Machines drive on as the kept order allows; each look is made anew, too; if they differ, all orders are tried."""
    hall = Hall(seed)
    for _ in range(40):
        one = hall.draw.choice(list(hall.at))
        steps = [(node, edge) for node, edge, _ in hall.graph.out[hall.at[one]]]
        if one in hall.lost or not steps:
            continue
        node = hall.draw.choice(steps)[0]
        if node in hall.at.values():
            continue
        moved = one, node
        answer = hall.witness.all_end(hall.held(moved))
        kept = not answer.waits
        after, then = hall.fully(moved)
        before, free = hall.fully(None)
        full = can_end(after, then, hall.graph)
        assert hall.witness.ends(hall.held(moved)) == full, (seed, moved, hall.at, hall.to)
        assert hall.witness.ends(hall.held(None)) == can_end(before, free, hall.graph), (seed, hall.at, hall.to)
        found = all(full.get(job.id) == FULLY or job.may_stay for job in after)
        if kept and not found:
            assert tried(hall, moved), (seed, moved, hall.at, hall.to)
        if answer.waits and answer.is_sure:
            assert not found, (seed, moved, hall.at, hall.to)
            assert not tried(hall, moved), (seed, moved, hall.at, hall.to)
            if not hall.witness.all_end(hall.held(None)).waits:  # all could end, and now cannot
                refused = left_waiting(before, after, free, then, hall.graph)
                assert refused or tried(hall, None), (seed, moved, hall.at, hall.to)
        if kept:
            hall.at[one] = node
        if hall.graph.nodes[hall.at[one]].is_end and hall.draw.random() < 0.5:
            hall.to[one] = hall.draw.choice([*hall.graph.ends, ""])
