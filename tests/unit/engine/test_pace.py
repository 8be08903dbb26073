"""What the clocks of one task may take: beyond its budget deadlines are rounded up; others, and cleanup, are untouched."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.changes import WakesPut
from formiga_bt.engine.kernel.inputs import Abort, TimerDue
from formiga_bt.engine.kernel.pace import throttled
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.lang.model import WAKES_A_SECOND
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.history.records import task_fact
from formiga_bt.show.history.urgency import UrgencyIndex
from formiga_bt.show.why.running import running
from formiga_bt.show.why.scene import WhyScene
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import Yard

HASTY = """
steps:
  - parallel:
""" + "".join("      - {repeat: 5 min, steps: [{wait: 1 ms}]}\n" for _ in range(40))
CALM = """
steps:
  - parallel:
""" + "".join("      - {repeat: 5 min, steps: [{wait: 5 s}]}\n" for _ in range(40))


def wakes(yard: Yard, task: str, since: int) -> int:
    """Return how often a node of a task was woken by a deadline since an instant."""
    due = [step.input.timer for step in yard.steps if isinstance(step.input, TimerDue) and step.at > since]
    return sum(isinstance(timer, NodeDue) and timer.task == task for timer in due)


def test_a_task_in_haste_has_its_budget_and_no_more(make: Make) -> None:
    yard = make(HASTY)
    task = yard.start()
    yard.run_for(5)
    begin = yard.now
    yard.run_for(10)

    assert 0.9 * 10 * WAKES_A_SECOND <= wakes(yard, task, begin) <= 10 * WAKES_A_SECOND + 1
    found = throttled(yard.engine.state, yard.engine.state.tasks[task], yard.now)
    assert found is not None
    assert found.since is not None
    assert begin - 6 * SECOND < found.since < begin
    assert found.path.startswith("steps")


def test_a_calm_task_of_as_many_loops_is_untouched(make: Make) -> None:
    yard = make(CALM)
    task = yard.start()
    yard.run_for(60)
    assert not [c for step in yard.steps for c in step.changes if isinstance(c, WakesPut)]
    assert throttled(yard.engine.state, yard.engine.state.tasks[task], yard.now) is None


def test_short_waits_in_a_row_are_exact_while_there_is_budget(make: Make) -> None:
    yard = make("steps:\n  - {repeat: 150, steps: [{wait: 20 ms}]}\n")
    task = yard.start()
    assert yard.end(task)[0] == "SUCCEEDED"
    record = yard.engine.state.tasks[task]
    assert record.times.ended_at is not None
    assert record.times.active_at is not None
    assert record.times.ended_at - record.times.active_at == 3 * SECOND
    assert task not in yard.engine.state.wakes


def test_cleanup_is_not_rounded_up_after_steps_in_haste(make: Make) -> None:
    yard = make(HASTY + "on_abort:\n  - {repeat: 500, steps: [{wait: 1 ms}]}\n")
    task = yard.start()
    yard.run_for(5)
    yard.driver.feed(Abort(task))
    begin = yard.now
    yard.run_for(2)
    ended = yard.engine.state.tasks[task].times.ended_at
    assert ended is not None
    assert ended - begin < SECOND


def test_the_budget_survives_a_snapshot(make: Make) -> None:
    yard = make(HASTY)
    task = yard.start()
    yard.run_for(3)
    state = yard.engine.state
    assert reloaded(state).wakes[task] == state.wakes[task]


@pytest.mark.parametrize("loops", [1, 200])
def test_another_task_keeps_its_times_beside_one_in_haste(make: Make, loops: int) -> None:
    hasty = "steps:\n  - parallel:\n" + "".join(
        "      - {repeat: 5 min, steps: [{wait: 1 ms}]}\n" for _ in range(loops)
    )
    yard = make(hasty)
    yard.start()
    yard.run_for(4)
    begin, steps = yard.now, len(yard.steps)
    yard.run_for(10)
    assert len(yard.steps) - steps < 12 * WAKES_A_SECOND
    assert yard.now - begin == 10 * SECOND


def test_people_see_that_a_task_is_throttled(make: Make) -> None:
    yard = make(HASTY)
    task = yard.start()
    yard.run_for(3)
    state, record = yard.engine.state, yard.engine.state.tasks[task]
    scene = WhyScene(state, yard.now, {record.name: yard.engine.core.model(record)})

    assert "throttled" in [one.code for one in running(scene, record)]
    assert task_fact(UrgencyIndex(Ledger(state=state), yard.now), record).throttled_since is not None
