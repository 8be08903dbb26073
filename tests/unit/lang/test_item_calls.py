"""Helpers that read an expression for each item of a list: what they give, and that they are watched like anything else."""

import pytest

from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.rehearsal.testing import effects
from tests.unit.engine.yard import Yard


def told(text: str, **more: int) -> str:
    yard = Yard(f"vars: {{n: '${{[3, 1, 2, 1]}}', p: '${{[base, offset(base, east=9 m), offset(base, east=4 m)]}}'}}\n"
                f"steps: [{{check: len(n) + len(p) > 0}}, {{notify: \"{text}\"}}]\n", **more)  # fmt: skip
    task = yard.start()
    assert yard.end(task) == ("SUCCEEDED", ""), yard.task(task).outcome
    return effects(yard, NotifyPeople)[-1].text


@pytest.mark.parametrize(
    ("call", "gives"),
    [
        ("where(n, item > 1)", "3, 2"),
        ("where(n, item > 9)", ""),
        ("count(n, item == 1)", "2"),
        ("each(n, item * 2)", "6, 2, 4, 2"),
        ("sort(n, by=item)", "1, 1, 2, 3"),
        ("sort(n, 0 - item)", "3, 2, 1, 1"),
        ("reverse(sort(where(n, item < 3), item))", "2, 1, 1"),
        ("each(sort(p, by=distance(item, base)), distance(item, base))", "0 m, 4 m, 9 m"),
        ("sum(each(p, distance(item, base)))", "13 m"),
        ("append(n, 7)", "3, 1, 2, 1, 7"),
        ("concat(n, [7, 8])", "3, 1, 2, 1, 7, 8"),
        ("count(range(10), mod(item, 3) == 0)", "4"),
        ("each(fleet('cart'), item.id)", "c1, c2"),
        ("count(fleet('cart'), item.battery > 10 %)", "2"),
    ],
)
def test_what_a_call_gives(call: str, gives: str) -> None:
    assert told("=${" + call + "}", carts=2) == "=" + gives


def test_equal_items_stay_in_their_order() -> None:
    assert told("=${sort(p, by=1)}", carts=1) == told("=${p}", carts=1)


def test_a_condition_over_a_fleet_is_woken_by_each_of_its_agents() -> None:
    watch = "{wait_until: \"count(fleet('cart'), item.battery < 20 %) == 2\", timeout: 1 h}"
    yard = Yard(f"steps: [{watch}, {{notify: both}}]\n", carts=2)
    task = yard.start()
    yard.carts[1].say(battery=10.0)
    yard.run_for(1)
    assert yard.task(task).status == "ACTIVE"
    yard.carts[0].say(battery=15.0)
    assert yard.end(task) == ("SUCCEEDED", "")
    assert effects(yard, NotifyPeople)[-1].text == "both"


@pytest.mark.parametrize("index", ["n[0] - 4", "n[0] + 1", "len(n)"])
def test_an_index_below_nought_or_past_the_end_is_named(index: str) -> None:
    yard = Yard(f"vars: {{n: '${{[3, 1, 2, 1]}}'}}\nsteps: [{{notify: '${{n[{index}]}}'}}]\n")
    task = yard.start()
    assert yard.end(task)[1] == "cannot_compute"
