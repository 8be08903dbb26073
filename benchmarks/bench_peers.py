"""Thousands of trees: ours beside py_trees, BehaviorTree.CPP, bonsai, async-btree and a thread a task.

The same trees everywhere, so many instances of each, all waiting for actions. Each engine has a process of its own, which
takes turns with ours on one core; figures are processor time, medians of rounds; a ratio is the median of pairs, theirs by
ours: above 1 ours is the cheaper one. What stands is frozen for the garbage collector (`gc.freeze`), which is on.

    build    building and starting, an instance
    memory   resident memory, an instance
    idle     one round in which nobody has news, of all instances: what ticks ticks all of them
    news     one wake that ends nothing, told to the instance whom it concerns (a peer ticks that tree only). Ours records
             news of an action and visits nothing; in `watch` the news is a charge that a task waits for, and is looked at
    burst    one wake of 100 at once (ten bursts a second: 1,000 wakes a second), and nobody says who: a peer ticks all
    result   an action ends and the next one begins, told to the instance whom it concerns; the mission only

    python benchmarks/bench_peers.py [--full] [--trees twelve mission] [--sizes 1 100 1000] [--peers NAME ...] [--out FILE]

Needs `pip install -e '.[btcpp,peers]'`; who is not installed is left out. Writes JSON, and a plot beside it.
"""

import argparse
import json
import os
import platform
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

from benchmarks.peers.all_peers import all_peers, missing
from benchmarks.peers.cell import compare, pin
from benchmarks.peers.child import Child
from benchmarks.peers.protocol import Peer
from benchmarks.peers.trees import TREES, WATCH

RESULTS = Path(__file__).parent / "results"
FEW = {"wide": 1000, "chain": 1000}
"""Trees of which no more instances are built: their memory says nothing new."""
THREAD_SIZES = (1, 10, 30)
SHARED_FROM = 1000
"""From so many on, all peers are measured against one fleet of ours; a smaller one would run out of missions."""
MANY = 100
"""From so many on, building, memory, bursts and results are measured."""
TITLES = {
    "idle": "a round without news, all instances, us",
    "news": "a wake that ends nothing, us",
    "burst": "a wake of 100 at once, nobody says whose, us",
    "result": "an action ends, the next begins, us",
    "build_us": "building and starting an instance, us",
    "bytes": "memory an instance, bytes",
}


def measures_of(key: str, tree: str, size: int) -> tuple[str, ...]:
    """Return what is measured.

    Threads that poll have no news, they look. A burst is one of many, and few results are told apart from a cold cache.
    """
    if tree == WATCH:
        return () if key == "threads" else ("news", "burst") if size >= MANY else ("news",)
    known = ["idle"]
    if key != "threads":
        known.append("news")
        if size >= MANY:
            known.append("burst")
    if tree == "mission" and (size >= MANY or (key == "threads" and size > 1)):
        known.append("result")
    return tuple(known)


def row(tree: str, size: int, key: str, measure: str, ours: float, peer: float, ratio: float) -> dict[str, Any]:
    """Return one figure."""
    return {
        "tree": tree, "size": size, "peer": key, "measure": measure,
        "ours": round(ours, 3), "theirs": round(peer, 3), "ratio": round(ratio, 4),
    }  # fmt: skip


def pair(ours: Child, key: str, tree: str, size: int, rounds: int) -> list[dict[str, Any]]:
    """Return all figures of one peer beside ours."""
    with closing(Child(key, tree, size)) as theirs:
        found = []
        stands = tree != WATCH and (size >= MANY or (key == "threads" and size > 1))
        for what in ("build_us", "bytes") if stands else ():
            a, b = ours.built[what], theirs.built[what]
            found.append(row(tree, size, key, what, a, b, b / max(a, 1e-9)))
        for what in measures_of(key, tree, size):
            got = compare(ours, theirs, what, rounds)
            found.append(row(tree, size, key, what, got["ours_us"], got["peer_us"], got["ratio"]))
        return found


def run(trees: list[str], sizes: list[int], keys: list[str], rounds: int) -> list[dict[str, Any]]:
    """Return all figures; say on the way what is measured."""
    found: list[dict[str, Any]] = []
    peers = all_peers()
    for tree in trees:
        threads = THREAD_SIZES if "threads" in keys and tree != WATCH and tree not in peers["threads"].lacks else ()
        for size in sorted({*sizes, *threads}):
            if size > FEW.get(tree, size):
                continue
            here = [key for key in keys if fits(key, peers[key], tree, size, sizes)]
            fleet: Child | None = None
            try:
                for key in here:
                    began = time.monotonic()
                    if fleet is None or (size < SHARED_FROM and tree == "mission"):
                        if fleet is not None:
                            fleet.close()
                        fleet = Child("ours", tree, size)
                    try:
                        found += pair(fleet, key, tree, size, rounds)
                    except RuntimeError as e:
                        print(f"left out: {e}", file=sys.stderr)
                    took_s = time.monotonic() - began
                    print(f"  {size:,} of {tree}: {peers[key].name}, {took_s:.0f} s", file=sys.stderr)
            finally:
                if fleet is not None:
                    fleet.close()
    return found


def fits(key: str, peer: Peer, tree: str, size: int, sizes: list[int]) -> bool:
    """Return whether a peer is measured with so many of a tree."""
    if key == "threads":
        return tree != WATCH and size in THREAD_SIZES and tree not in peer.lacks
    return size in sizes and size <= peer.most and tree not in peer.lacks


def table(found: list[dict[str, Any]], tree: str, measure: str) -> list[str]:
    """Return lines: ours, then each peer with its ratio, by number of instances."""
    rows = [one for one in found if one["tree"] == tree and one["measure"] == measure]
    if not rows:
        return []
    sizes = sorted({one["size"] for one in rows})
    names = {key: peer.name for key, peer in all_peers().items()}
    lines = [f"{tree}: {TITLES[measure]}", " " * 22 + "".join(f"{size:>20,}" for size in sizes)]
    ours = {one["size"]: one["ours"] for one in rows}
    lines.append(f"  {'formiga_bt':20}" + "".join(f"{ours[size]:>12,.1f}{'':8}" for size in sizes))
    for key in dict.fromkeys(one["peer"] for one in rows):
        by_size = {one["size"]: one for one in rows if one["peer"] == key}
        cells = (
            f"{by_size[size]['theirs']:>12,.1f}{times(by_size[size]['ratio']):>8}" if size in by_size else " " * 20
            for size in sizes
        )
        lines.append(f"  {names[key]:20}" + "".join(cells))
    return lines


def times(ratio: float) -> str:
    """Return a ratio for a table."""
    return f"x{ratio:,.0f}" if ratio >= 20 else f"x{ratio:.1f}" if ratio >= 1 else f"x{ratio:.2f}"


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all trees, up to 10,000 instances")
    parser.add_argument("--trees", nargs="+", choices=list(TREES))
    parser.add_argument("--sizes", nargs="+", type=int)
    parser.add_argument("--peers", nargs="+", choices=[key for key in all_peers() if key != "ours"])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=RESULTS / "peers.json")
    options = parser.parse_args()
    trees = options.trees or (list(TREES) if options.full else ["twelve", "watch", "mission"])
    sizes = options.sizes or ([1, 100, 1000, 10_000] if options.full else [1, 100, 1000])
    keys, versions = [], {}
    for key, peer in all_peers().items():
        if key == "ours" or key in (options.peers or [key]):
            if why := missing(peer):
                print(f"left out: {why}")
                continue
            versions[peer.name] = {"version": peer.version(), "given": peer.given}
            keys.append(key)
    keys.remove("ours")
    core = pin()
    began = time.monotonic()
    found = run(trees, sizes, keys, options.rounds)
    for name, about in versions.items():
        print(f"{name} {about['version']}: {about['given']}")
    for tree in trees:
        for measure in TITLES:
            if lines := table(found, tree, measure):
                print("\n" + "\n".join(lines))
    where = f"core {core}" if core is not None else "not kept on one core"
    print(f"\nPython {platform.python_version()}, {where}, {options.rounds} rounds, {time.monotonic() - began:.0f} s")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    about = {
        "python": platform.python_version(), "core": core, "cores": os.cpu_count(), "rounds": options.rounds,
        "load": os.getloadavg()[0], "gc": "on, what stands frozen", "engines": versions,
    }  # fmt: skip
    options.out.write_text(json.dumps({"about": about, "rows": found}, indent=1), encoding="utf-8")
    from benchmarks.plots import draw_peers

    picture = options.out.with_suffix(".png")
    draw_peers(found, {key: peer.name for key, peer in all_peers().items()}, picture)
    print(f"written: {options.out}, {picture}")


if __name__ == "__main__":
    main()
