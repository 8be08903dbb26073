"""What other engines are measured on: their trees do what ours do, and no measure is taken of something else."""

import pytest

from benchmarks.peers import btcpp
from benchmarks.peers.all_peers import all_peers, missing
from benchmarks.peers.cell import Cell, compare
from benchmarks.peers.ours import Ours
from benchmarks.peers.protocol import Fleet, Peer
from benchmarks.peers.threaded import MOST, Threaded
from benchmarks.peers.trees import ACTIONS_IN_TURN, CHECK, TREES, Node, act, fallback, mission, sequence, task_text
from tests.golden import Wording

Script = list[tuple[str, bool]]

pytestmark = pytest.mark.usefixtures("set_aside_again")
EVERYTHING_WELL = {
    "twelve": [("deep", True)],
    "watch": [("deep", True)],
    "mission": [(action, True) for action in ACTIONS_IN_TURN],
    "wide": [(f"wide_{i}", True) for i in range(49, -1, -1)],
    "chain": [("bottom", True)],
}
FAILING: dict[str, list[Script]] = {
    "mission": [[("out_0", True), ("out_1", False)], [("out_0", False)]],
    "chain": [[("bottom", False)]],
}
RETRYING: dict[str, list[Script]] = {
    "twelve": [[("deep", False), ("deep", True)], [("deep", False)] * 3],
    "mission": [
        [*((action, True) for action in ACTIONS_IN_TURN[:5]), ("loaded", False), ("loaded", True), ("take_off", True)],
        [*((action, True) for action in ACTIONS_IN_TURN[:5]), ("loaded", False), ("loaded", False), ("loaded", False)],
    ],
}
CHOICE = sequence(fallback(act("first"), sequence(CHECK, act("second"))), act("last"))
PEERS = [
    pytest.param(key, marks=() if key in ("py_trees", "threads") else pytest.mark.external)
    for key in all_peers()
    if key != "ours"
]


def the(key: str) -> Peer:
    if key == "threads":
        return Threaded(poll_s=0.001)
    peer = all_peers()[key]
    if why := missing(peer):
        pytest.skip(why)
    return peer


def scripts(key: str, tree: str) -> list[Script]:
    found: list[Script] = [EVERYTHING_WELL[tree]]
    if key != "btcpp_native":  # its actions cannot fail
        found += FAILING.get(tree, [])
        if key != "bonsai":
            found += RETRYING.get(tree, [])
    return found


def told(fleet: Fleet, script: Script, show: bool) -> list[tuple[str, frozenset[str]]]:
    """Return status and running actions of the first of two trees after each result, and of the other one at the end."""
    found = []
    for action, ok in script:
        fleet.results([0], action, ok)
        fleet.idle_round()  # some begin the next attempt in the next tick
        found.append((fleet.status(0), fleet.running(0) if show else frozenset()))
    found.append((fleet.status(1), fleet.running(1) if show else frozenset()))
    fleet.close()
    return found


@pytest.mark.parametrize("tree", list(TREES))
@pytest.mark.parametrize("key", PEERS)
def test_a_peers_tree_does_what_ours_does(key: str, tree: str) -> None:
    peer = the(key)
    if tree in peer.lacks:
        assert key == "threads"
        return
    show = key != "btcpp_native"
    for script in scripts(key, tree):
        ours = told(Ours().build(TREES[tree], tree, 2), script, show)
        assert told(peer.build(TREES[tree], tree, 2), script, show) == ours
        assert ours[-1][0] == "running"
        assert ours[-2][0] != "running" or script[-1] == ("take_off", True)


@pytest.mark.parametrize("key", [one for one in PEERS if one.values[0] != "btcpp_native"])
def test_a_choice_goes_on_to_its_next_child(key: str) -> None:
    script = [("first", False), ("second", True), ("last", True)]
    ours = told(Ours().build(CHOICE, "choice", 2), script, True)
    assert ours[0] == ("running", frozenset({"second"}))
    assert told(the(key).build(CHOICE, "choice", 2), script, True) == ours


def test_news_of_a_charge_is_looked_at_by_the_task_that_waits_for_it() -> None:
    fleet = Ours().build(TREES["watch"], "watch", 3)
    fleet.news([0, 1, 2, 0])
    assert {fleet.status(tree) for tree in range(3)} == {"running"}
    fleet.results([1], "deep")
    assert [fleet.status(tree) for tree in range(3)] == ["running", "success", "running"]


@pytest.mark.parametrize("key", PEERS)
def test_every_measure_is_taken_at_a_tiny_size(key: str) -> None:
    peer = the(key)
    ours, theirs = Cell(Ours(), "mission", 2), Cell(peer, "mission", 2)
    for what in ("idle", "news", "burst", "result"):
        got = compare(ours, theirs, what, 2)
        assert set(got) == {"ours_us", "peer_us", "ratio"}
        assert got["ours_us"] >= 0 <= got["peer_us"]
    assert theirs.done == 2
    assert theirs.fleet.status(0) == ours.fleet.status(0) == "running"
    assert theirs.built["build_us"] >= 0
    theirs.close()
    ours.close()


def test_results_take_mission_after_mission(wording: Wording) -> None:
    cell = Cell(Ours(), "mission", 201)
    for _ in range(10):
        cell.measure("result")
    assert cell.fleet.running(0) == frozenset({"home_2"})
    assert cell.fleet.running(200) == frozenset({"out_1"})
    for _ in range(8):
        cell.measure("result")
    with pytest.raises(AssertionError) as refused:
        cell.measure("result")
    wording(refused.value)


@pytest.mark.parametrize("tree", list(TREES.values()), ids=list(TREES))
@pytest.mark.parametrize("native", [False, True])
def test_nothing_that_starts_a_thread_is_given_to_btcpp(tree: Node, native: bool) -> None:
    text = btcpp.xml_of(tree, native)
    assert not any(word in text for word in ("Sleep", "Timeout", "Delay"))


def test_threads_that_appear_all_the_same_are_refused(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr(btcpp, "threads", lambda: 13)
    btcpp.refuse_threads(13 - btcpp.THREADS)
    with pytest.raises(RuntimeError) as refused:
        btcpp.refuse_threads(10)
    wording(refused.value)


def test_only_so_many_threads(wording: Wording) -> None:
    with pytest.raises(AssertionError) as refused:
        Threaded().build(mission(), "mission", MOST + 1)
    wording(refused.value)


def test_the_trees_are_tasks_of_ours() -> None:
    assert '"timeout": "7200 s"' in task_text("twelve", TREES["twelve"])
    assert {name: sum(1 for _ in tree.walk()) for name, tree in TREES.items()} == {
        "twelve": 13,
        "watch": 13,
        "mission": 25,
        "wide": 52,
        "chain": 57,
    }
