"""Limits of admission (execution: limits)."""

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine import allocation
from formiga_bt.engine.kernel.inputs import TimerDue
from formiga_bt.engine.kernel.timers import AllocationDue
from formiga_bt.engine.tasks import intake
from tests.golden import Wording
from tests.unit.engine.conftest import Make


def test_more_than_so_many_waiting_tasks_are_busy(
    make: Make, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(intake, "MAX_QUEUED", 2)
    yard = make("agents: {cart: {type: cart}}\nsteps: [{wait: 10 s}]", carts=1)
    first = yard.start()
    yard.start()
    last = yard.start()

    with pytest.raises(TaskError) as refused:
        yard.start()
    wording(refused.value)

    assert refused.value.code == "busy"
    yard.run_for(11)
    assert yard.task(first).status == "SUCCEEDED"
    yard.start()
    yard.run_for(60)
    assert yard.task(last).status == "SUCCEEDED"


def test_the_more_requests_wait_the_rarer_they_are_looked_at(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(allocation, "EACH_US", 1_000_000)
    yard = make("agents: {cart: {type: cart}}\nsteps: [{wait: 10 s}]", carts=1)
    for _ in range(5):
        yard.start()
    looks = [s.at for s in yard.steps if s.input == TimerDue(AllocationDue())]
    yard.run_for(9.5)
    later = [s.at for s in yard.steps if s.input == TimerDue(AllocationDue())][len(looks) :]
    assert 1 <= len(later) <= 3
    yard.run_for(70)
    assert all(task.status == "SUCCEEDED" for task in yard.engine.state.tasks.values())
