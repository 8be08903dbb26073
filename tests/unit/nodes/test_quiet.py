"""A node that is woken for nothing is not visited; one that has something to do is, with everything on the way to it."""

import pytest

from formiga_bt.engine.tasks.taskrun import TaskRun
from tests.unit.engine.yard import CART, Yard


@pytest.fixture
def visits(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a counter of visited nodes."""
    counted = [0]
    spend = TaskRun.spend

    def count(run: TaskRun) -> None:
        counted[0] += 1
        spend(run)

    monkeypatch.setattr(TaskRun, "spend", count)
    return counted


def test_a_condition_that_stays_false_is_not_visited(visits: list[int]) -> None:
    yard = Yard(CART + "steps:\n  - wait_until: cart.battery < 30 %\n    timeout: 1 h")
    task = yard.start()
    visits[0] = 0
    for level in (70.0, 60.0, 50.0):
        yard.cart.say(battery=level)
        yard.run_for(0.1)
    assert visits[0] == 0
    assert yard.task(task).status == "ACTIVE"

    yard.cart.say(battery=20.0)
    yard.run_for(0.1)
    assert visits[0] == 3, "root, timeout, wait_until"
    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_guard_that_holds_is_not_visited_and_one_that_breaks_stops_its_steps(visits: list[int]) -> None:
    yard = Yard(CART + "steps:\n  - guard: cart.battery > 30 %\n    steps: [{wait: 1 h}]")
    task = yard.start()
    visits[0] = 0
    yard.cart.say(battery=50.0)
    yard.run_for(0.1)
    assert visits[0] == 0

    yard.cart.say(battery=20.0)
    yard.run_for(0.1)
    assert yard.end(task) == ("FAILED", "guard")


def test_a_goal_that_goes_on_is_not_visited_but_shows_how_it_stands(visits: list[int]) -> None:
    yard = Yard(CART + "steps:\n  - do: cart.Haul\n    timeout: 1 h")
    task = yard.start()
    (leaf,) = [n for n in yard.engine.runs.open[task].trees.roots["steps"].iterate() if n.name == "cart.Haul"]  # type: ignore[attr-defined]
    assert leaf.status.name == "RUNNING"
    visits[0] = 0
    yard.engine.runs.open[task].trees.wake(leaf.key)
    assert yard.engine.runs.open[task].trees.run_passes() == []
    assert visits[0] == 0
    assert leaf.feedback_message in ("sent", "accepted", "running")
    yard.cart.succeed()
    assert yard.end(task) == ("SUCCEEDED", "")


def test_what_a_condition_reads_may_become_another_thing_while_it_waits() -> None:
    """It is watched anew with the names: once `limit` is another one, the same charge is below it."""
    steps = """
vars: {limit: 50 %}
steps:
  - parallel:
      - wait_until: cart.battery < limit
        timeout: 1 h
      - sequence:
          - wait: 10 s
          - set: {limit: 95 %}
          - wait: 10 s
"""
    yard = Yard(CART + steps)
    task = yard.start()
    yard.cart.say(battery=90.0)
    yard.run_for(5.0)
    assert any("wait_until" in key or "parallel" in key for key in yard.engine.statuses(task))
    before = len(yard.engine.statuses(task))
    yard.run_for(6.0)
    assert len(yard.engine.statuses(task)) < before, "the wait is over, the other branch waits on"
    assert yard.end(task) == ("SUCCEEDED", "")
