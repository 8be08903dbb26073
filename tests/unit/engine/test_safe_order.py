"""The banker's check: what can end in some order, against all orders tried; and what steps may ask for."""

from collections.abc import Mapping
from itertools import permutations

from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.engine.allocator.demand import demand_of
from formiga_bt.engine.allocator.safe_order import Job, can_end, left_waiting
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from tests.unit.engine.yard import CART, yard

AMOUNTS = st.dictionaries(st.sampled_from(["a", "b"]), st.integers(0, 2), max_size=2)


def tried(jobs: list[Job], free: Mapping[str, int]) -> set[str]:
    """Return what ends in the best of all orders."""
    best: set[str] = set()
    for order in permutations(jobs):
        have, ended = dict(free), set()
        for job in order:
            if all(one in ended for one in job.after) and all(have.get(k, 0) >= n for k, n in job.needs.items()):
                ended.add(job.id)
                for key, units in job.holds.items():
                    have[key] = have.get(key, 0) + units
        best = max(best, ended, key=len)
    return best


@given(
    st.lists(st.tuples(AMOUNTS, AMOUNTS, st.booleans()), min_size=1, max_size=4),
    st.dictionaries(st.sampled_from(["a", "b"]), st.integers(0, 2)),
)
@settings(max_examples=150, deadline=None)
def test_it_finds_an_order_if_there_is_one(
    drawn: list[tuple[dict[str, int], dict[str, int], bool]], free: dict[str, int]
) -> None:
    jobs = [
        Job(f"j{n}", f"j{n}", holds, needs, (f"j{n - 1}",) if behind and n else ())
        for n, (holds, needs, behind) in enumerate(drawn)
    ]

    assert set(can_end(jobs, free)) == tried(jobs, free)


def test_who_could_not_end_before_keeps_nobody_from_anything() -> None:
    lost = Job("lost", "lost", {"lift": 1}, {"crane": 1})
    mine = Job("mine", "mine", {}, {})

    assert left_waiting([lost, mine], [lost, Job("mine", "mine", {"bay": 1}, {})], {"bay": 1}, {"bay": 0}) == ""


def test_the_task_that_would_wait_for_ever_is_named() -> None:
    before = [Job("one", "one", {"lift": 1}, {"bridge": 1}), Job("two", "two", {}, {"lift": 1, "bridge": 1})]
    after = [before[0], Job("two", "two", {"bridge": 1}, {"lift": 1})]

    assert left_waiting(before, after, {"bridge": 1}, {"bridge": 0}) == "one"


def test_steps_in_a_row_need_what_the_greediest_needs_and_nested_ones_both() -> None:
    _, catalogue = yard()
    inner = "{with_resource: b, steps: [{wait: 1 s}]}"
    text = (
        f"{CART}steps: [{{with_resource: [a, c: 2], steps: [{inner}]}}, {{parallel: [{inner}, {inner}]}}, "
        "{with_agents: {more: {type: cart, count: 2}}, steps: [{with_resource: a, steps: [{check: len(more) > 1}]}]}]"
    )
    made = task_without_site(text)

    assert demand_of(made.steps, catalogue.types) == {"a": 1, "c": 2, "b": 1, "@cart": 2}


def task_without_site(text: str) -> Task:
    """Return a task that is checked against no site: any resource may be named."""
    _, catalogue = yard()
    loaded = load_task_text(f"formiga: 1\ntask: Try\n{text}\n", "try.yaml", catalogue=catalogue)
    assert loaded.task is not None, loaded.diagnostics
    return loaded.task
