"""Indexes of the state agree with the state at every step of random missions, and heaps forget what is no longer so."""

from typing import Any

import pytest

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.index import SPARE, DeadlineHeap, Instants, StateIndex
from formiga_bt.engine.kernel.records import BUSY, Deadline
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import OrderDue
from tests.property.strategies import missions
from tests.property.world import World
from tests.unit.engine.conftest import Make


def assert_agrees(engine: Engine) -> None:
    """Compare each index with a look at everything."""
    state, index = engine.state, engine.core.index
    for agent in state.agents:
        assert [g.id for g in index.goals_of(agent)] == [g.id for g in state.goals.values() if g.agent == agent]
        shown = [g for g in state.goals.values() if g.agent == agent and g.owner == "!question" and not g.ended]
        assert index.shown_to(agent) == len(shown)
        assert set(index.asked_of(agent)) == {q.id for q in state.questions.values() if agent in q.asked}
    for task in state.tasks:
        assert list(index.deadlines_of(task)) == [key for key, d in state.deadlines.items() if d.task == task]
        assert list(index.questions_of(task)) == [q.id for q in state.questions.values() if q.task == task]
    assert set(index.gated) == {g.id for g in state.goals.values() if g.state == "gated"}
    assert set(index.busy) == {g.id for g in state.goals.values() if g.state == "gated" and g.code in BUSY}
    assert list(engine.core.open) == [task.id for task in state.tasks.values() if task.section != "done"]
    assert set(index.ended) == {task.id for task in state.tasks.values() if task.section == "done"}
    earliest = min(((d.at, d.seq, key) for key, d in state.deadlines.items()), default=None)
    assert engine.next_deadline() == (None if earliest is None else (earliest[0], earliest[2]))


def test_indexes_agree_with_the_state_at_every_step() -> None:
    for mission in missions(25, 900, tasks=2):
        steps = 0

        def look(world: World, _: Any) -> None:
            nonlocal steps
            steps += 1
            assert_agrees(world.engine)

        world = World(mission.tasks(), mission.deeds, mission.events, watch=look)
        world.run()
        assert steps > 5
        anew = StateIndex(world.engine.state)
        for agent in world.engine.state.agents:
            assert anew.goals_of(agent) == world.engine.core.index.goals_of(agent)
        assert set(anew.ended) == set(world.engine.core.index.ended)


FAR = OrderDue("far")


def test_deadlines_that_are_set_again_and_again_do_not_pile_up() -> None:
    state = EngineState()
    heap = DeadlineHeap(state)
    for seq in range(1, 10_001):
        state.deadlines[FAR] = Deadline(10**12 + seq, seq)
        heap.push(10**12 + seq, seq, FAR)
    assert heap.first() == (10**12 + 10_000, FAR)
    assert len(heap._heap) <= 2 + SPARE
    del state.deadlines[FAR]
    heap.forget()
    assert heap.first() is None


def test_a_node_is_looked_at_from_its_instant_on_until_that_is_dropped() -> None:
    instants = Instants()
    instants.set("T-1", "a", 10)
    instants.set("T-1", "b", 20)
    instants.set("T-1", "b", 30)
    assert list(instants.until(9)) == []
    assert list(instants.until(20)) == [("T-1", "a")]
    assert list(instants.until(30)) == [("T-1", "a"), ("T-1", "b")]
    instants.drop("T-1", "a")
    assert list(instants.until(30)) == [("T-1", "b")]
    instants.set("T-1", "b", 40)
    assert list(instants.until(30)) == []
    for at in range(1000):
        instants.set("T-2", "c", 100 + at)
    assert len(instants._heap) <= 4 + SPARE


def test_only_the_newest_ended_tasks_are_kept(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("formiga_bt.engine.tasks.tasks.KEPT_ENDED", 3)
    yard = make("steps: [{wait: 1 s}]")
    ids = [yard.start() for _ in range(6)]
    yard.run_for(5.0)

    assert list(yard.engine.state.tasks) == ids[3:]
    assert list(yard.engine.core.index.ended) == ids[3:]
    assert set(yard.engine.state.explanations) <= set(ids[3:])
    assert not yard.engine.runs.open
    assert not yard.engine.state.memory
    assert not any(ids[0] in key for key, _ in yard.engine.core.board.under("/"))
