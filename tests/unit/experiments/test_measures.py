"""The measures of trees: bounds, identity, and what each of them sees."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.e2_llm.fly import world_of
from experiments.e2_llm.measures import distance, is_near, measure, ngram_tree
from experiments.e2_llm.trees import KEYWORDS, flows, tokens
from formiga_bt.base.packaged import folder
from formiga_bt.lang.json_form.writing import from_yaml

CATALOGUE = world_of().catalogue
NAMES = (
    "move_task", "explore_region", "pick_up", "watch_dog_sos", "watch_dog_request",
    "circle", "triangle", "zig_zag", "patrol_and_escort", "delivery",
)  # fmt: skip
TREES: dict[str, Any] = {
    name: from_yaml((folder("trees") / f"{name}.yaml").read_text(encoding="utf-8"), CATALOGUE) for name in NAMES
}
PLAIN = st.recursive(
    st.text("abc${} .", max_size=6) | st.integers(0, 9) | st.booleans() | st.none(),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["steps", "action", "agent", "to", "expr", "name", "vars", "for", "save_as"]), inner
        )
    ),
    max_leaves=20,
)


@pytest.mark.parametrize("name", NAMES)
def test_a_tree_is_its_own_best_match(name: str) -> None:
    same = measure(TREES[name], json.loads(json.dumps(TREES[name])))

    assert (same.ngram_tree, same.subtree_match, same.flow_match) == (pytest.approx(1.0), 1.0, 1.0)
    assert distance(TREES[name], TREES[name]) == 0.0


@given(PLAIN, PLAIN)
def test_measures_of_anything_lie_from_0_to_1(a: Any, b: Any) -> None:
    for one, other in ((a, b), (b, a), (a, a)):
        found = measure(one, other)
        assert all(0.0 <= value <= 1.0 for value in (found.ngram_tree, found.subtree_match, found.flow_match))
    assert distance(a, b) == distance(b, a)
    assert 0.0 <= distance(a, b) <= 1.0


def test_other_missions_are_farther_than_oneself() -> None:
    for name in NAMES:
        for other in NAMES:
            if other != name:
                found = measure(TREES[name], TREES[other])
                assert found.ngram_tree < 0.9, (name, other)
                assert found.subtree_match < 1.0, (name, other)


def test_names_of_the_author_do_not_matter_to_flow_and_shape() -> None:
    renamed = json.loads(json.dumps(TREES["zig_zag"]).replace("amplitude", "swing").replace("drone", "flyer"))
    found = measure(renamed, TREES["zig_zag"])

    assert found.flow_match == 1.0
    assert found.subtree_match == 1.0
    assert found.ngram_tree < 1.0


def test_prose_does_not_matter() -> None:
    other = TREES["circle"] | {"description": "Something else.", "version": "9.9.9", "on_abort": None}

    assert measure(other, TREES["circle"]).ngram_tree == pytest.approx(1.0)


def test_a_dropped_step_costs_shape_and_flow() -> None:
    short = json.loads(json.dumps(TREES["delivery"]))
    del short["steps"][2]
    found = measure(short, TREES["delivery"])

    assert 0.5 < found.subtree_match < 1.0
    assert 0.5 < found.flow_match < 1.0
    assert 0.0 < distance(short, TREES["delivery"]) < 0.5


def test_a_keyword_weighs_five_times_as_much() -> None:
    assert "steps" in KEYWORDS
    keyword_lost = (
        ngram_tree(["x"], ["x"]),
        ngram_tree(["steps", "a"], ["b", "a"]),
        ngram_tree(["b", "a"], ["steps", "a"]),
    )

    assert keyword_lost[0] == pytest.approx(1.0)
    assert keyword_lost[1] == pytest.approx(((1 / 6) * (0.1 / 5)) ** 0.5)
    assert keyword_lost[2] == pytest.approx(((1 / 2) * (0.1 / 1)) ** 0.5)


def test_flows_say_what_comes_from_what() -> None:
    task = {
        "params": [{"name": "target", "type": "place"}],
        "vars": [{"name": "spot", "value": {"expr": "above(target, 60 m)"}}],
        "agents": [{"name": "drone", "type": "lwd"}],
        "steps": [{"action": "GoTo", "agent": "drone", "to": {"expr": "spot"}, "save_as": "done"}],
    }

    assert flows(task) == [
        ("v1", "from", "v0"),
        ("v3", "from", "GoTo"),
        ("GoTo.agent", "uses", "v2"),
        ("GoTo.to", "uses", "v1"),
    ]


def test_distance_counts_steps() -> None:
    a = {"steps": [{"action": "TakeOff"}, {"action": "GoTo"}, {"action": "LandIn"}]}
    b = {"steps": [{"action": "TakeOff"}, {"action": "LandIn"}]}
    c = {"steps": [{"parallel": [{"action": "TakeOff"}, {"action": "GoTo"}, {"action": "LandIn"}]}]}

    assert distance(a, b) == pytest.approx(1 / 4)
    assert distance(a, c) == pytest.approx(1 / 5)
    assert is_near(a, b)
    assert not is_near(TREES["circle"], TREES["delivery"])


def test_tokens_split_expressions() -> None:
    assert tokens({"to": {"expr": "above(target, 60 m)"}}) == [
        "to",
        "expr",
        "above",
        "(",
        "target",
        ",",
        "60",
        "m",
        ")",
    ]
