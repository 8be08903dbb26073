"""Limits of admission (execution: limits)."""

import pytest

from formiga_bt.engine import tasks
from formiga_bt.errors import TaskError
from tests.unit.engine.conftest import Make


def test_more_than_so_many_waiting_tasks_are_busy(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "MAX_QUEUED", 2)
    yard = make("agents: {cart: {type: cart}}\nsteps: [{wait: 10 s}]", carts=1)
    first = yard.start()
    yard.start()
    last = yard.start()

    with pytest.raises(TaskError, match="2 tasks wait already") as refused:
        yard.start()

    assert refused.value.code == "busy"
    yard.run_for(11)
    assert yard.task(first).status == "SUCCEEDED"
    yard.start()
    yard.run_for(60)
    assert yard.task(last).status == "SUCCEEDED"
