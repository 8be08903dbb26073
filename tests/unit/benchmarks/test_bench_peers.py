"""The table and the plot of engines side by side, and the benchmarks of reaction and of memory, at tiny sizes."""

from pathlib import Path

import pytest

from benchmarks import bench_leak, bench_peers, bench_reaction
from benchmarks.plots import draw_peers, series
from tests.golden import Wording

pytestmark = pytest.mark.usefixtures("set_aside_again")


@pytest.mark.network
@pytest.mark.slow
def test_cells_in_processes_of_their_own(tmp_path: Path) -> None:
    found = bench_peers.run(["mission"], [2], ["py_trees"], 2)
    assert [(one["peer"], one["measure"], one["size"]) for one in found] == [
        ("py_trees", "idle", 2),
        ("py_trees", "news", 2),
    ]
    draw_peers(found, {"ours": "formiga_bt", "py_trees": "py_trees"}, tmp_path / "peers.png")
    assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")


def test_what_is_measured() -> None:
    assert bench_peers.measures_of("py_trees", "twelve", 1) == ("idle", "news")
    assert bench_peers.measures_of("py_trees", "mission", 100) == ("idle", "news", "burst", "result")
    assert bench_peers.measures_of("threads", "mission", 1) == ("idle",)
    assert bench_peers.measures_of("bonsai", "watch", 1) == ("news",)
    assert bench_peers.measures_of("bonsai", "watch", 1000) == ("news", "burst")
    assert bench_peers.measures_of("threads", "mission", 30) == ("idle", "result")


ROWS = [
    bench_peers.row("twelve", 1, "py_trees", "idle", 0.3, 15.0, 50.0),
    bench_peers.row("twelve", 100, "py_trees", "idle", 0.5, 1500.0, 3000.0),
    bench_peers.row("twelve", 100, "bonsai", "idle", 0.5, 0.0, 0.14),
]


def test_the_table_has_ours_first_and_ratios_beside_the_others(wording: Wording) -> None:
    wording(bench_peers.table(ROWS, "twelve", "idle"))
    assert bench_peers.table(ROWS, "wide", "idle") == []


def test_a_plot_leaves_out_what_cost_nothing() -> None:
    assert series(ROWS, "twelve", "idle") == {
        "ours": [(1, 0.3), (100, 0.5)],
        "py_trees": [(1, 15.0), (100, 1500.0)],
        "bonsai": [],
    }


def test_reaction_in_process_counts_few_and_many() -> None:
    found = bench_reaction.in_process(3, 7)
    assert (found["tasks"], found["goals"]) == (3, 7)
    assert 0 < found["cpu"]["many"]["p50_us"] <= found["cpu"]["many"]["p99_us"]


def test_centiles() -> None:
    assert bench_reaction.figures([n / 1e6 for n in range(1, 101)]) == {"p50_us": 50.5, "p99_us": 100.0}


@pytest.mark.network
@pytest.mark.slow
def test_reaction_over_zenoh() -> None:
    found = bench_reaction.over_zenoh(3, 6)
    assert found["reaction"]["p50_us"] > 0 < found["bare"]["p50_us"]


def test_growth_tells_a_leak_from_a_jump() -> None:
    size = 0

    def leak(count: int) -> None:
        nonlocal size
        size += 7 * count

    assert bench_leak.growth(leak, lambda: size, 60, 20, 4)["bytes_a_task"] == 7.0
    calls = iter([1000, 1000, 1000, 5000, 5000])
    found = bench_leak.growth(lambda count: None, lambda: next(calls), 60, 20, 4)
    assert (found["bytes_a_task"], found["bytes_in_all"]) == (0.0, 100.0)


def test_short_tasks_end() -> None:
    short = bench_leak.Short()
    short.do(5)
    assert [task.status for task in short.fleet.engine.state.tasks.values()] == ["SUCCEEDED"] * 5
    assert not short.fleet.engine.state.goals


@pytest.mark.parametrize(("unregister", "left"), [(False, 30), (True, 0)])
def test_what_py_trees_leaves_behind(unregister: bool, left: int) -> None:
    for _ in range(2):  # what is counted is taken away after
        found = bench_leak.py_trees_left(30, unregister, 1)
        assert (found["clients"], found["metadata"], found["values"]) == (left, left, left)
