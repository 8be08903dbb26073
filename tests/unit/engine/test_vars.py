"""Vars and defaults, computed at admission: they may read the task itself, and a new run computes them anew."""

from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.rehearsal.testing import effects
from tests.reloading import reloaded
from tests.unit.engine.yard import CART, Yard

DRAWS = """
params:
  label: {type: text, default: "${task.id}"}
vars:
  order: ${shuffle(range(9), 3)}
  run: ${task.run}
steps:
  - notify: "${label}|${run}|${order}"
  - do: cart.Move
  - notify: "${label}|${run}|${shuffle(range(9), 3)}"
"""


def test_vars_read_the_task_and_chance_is_the_same_in_all_of_a_run() -> None:
    bench = Yard(CART + DRAWS)
    task = bench.start()
    order = reloaded(bench.engine.state).scopes[task][""]["order"]
    bench.cart.succeed()
    bench.run_for(0.2)

    assert bench.end(task)[0] == "SUCCEEDED"
    shown = ", ".join(map(str, order))
    assert [notice.text for notice in effects(bench, NotifyPeople)] == [f"{task}|1|{shown}"] * 2
    assert sorted(order) == list(range(9)) != list(order)


def test_another_task_draws_another_order() -> None:
    bench = Yard(CART + DRAWS)
    for _ in range(2):
        bench.start()
        bench.cart.succeed()
        bench.run_for(0.2)
    told = [notice.text.split("|")[2] for notice in effects(bench, NotifyPeople)]
    assert (told[0] == told[1], told[0] == told[2]) == (True, False)
