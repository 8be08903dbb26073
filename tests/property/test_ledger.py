"""The fold of random missions: what it says to run is what the engine's trees remember, after every single step."""

from collections import Counter

import pytest

from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.lang.places import static_path, steps_with_paths
from formiga_bt.show.history.ledger import Ledger
from tests.property.strategies import missions
from tests.property.world import World

SECTIONS = ("steps/", "on_failure/", "on_abort/", "finally/")


def remembered(ledger: Ledger, task_id: str) -> set[str]:
    """Return the static paths of the steps that run by the engine's own memory."""
    return {static_path(key) for key in ledger.state.memory.get(task_id, {})}


def check(ledger: Ledger, world: World, step: EngineStep) -> Counter[str]:
    seen: Counter[str] = Counter()
    for task in ledger.state.tasks.values():
        facts = {fact.path: fact for fact in ledger.stories[task.id].progress.facts()}
        running = {path for path, fact in facts.items() if fact.status == "running"}
        where = f"{task.id} at step {step.seq}"
        assert {p for p in remembered(ledger, task.id) if p.startswith(SECTIONS)} == running, where
        if task.section == "done":
            assert not running, where
        model = world.models.get(task.name)
        known = {path for path, _ in steps_with_paths(model)} | set(SECTIONS) if model is not None else set()
        assert set(facts) <= known, where
        for fact in facts.values():
            assert min(fact.succeeded, fact.failed, fact.skipped, fact.stopped) >= 0, (where, fact)
            assert (fact.running > 0) == (fact.status == "running"), (where, fact)
            assert fact.ended_at is None or fact.began_at is None or fact.began_at <= fact.ended_at, (where, fact)
            assert fact.status != "failure" or fact.code, (where, fact)
            seen[fact.status] += 1
    return seen


@pytest.mark.parametrize("first", [0, 700])
def test_what_runs_by_the_fold_is_what_the_trees_remember(first: int) -> None:
    seen: Counter[str] = Counter()
    for mission in missions(25, first, tasks=1 + (first > 0)):
        world = World(mission.tasks(), mission.deeds, mission.events)
        world.run()
        ledger = Ledger()
        for step in world.steps:
            ledger.feed(step)
            seen += check(ledger, world, step)
        assert snapshot(ledger.state) == snapshot(world.engine.state)
        assert all(
            row.end is not None for story in ledger.stories.values() for row in story.rows if not open_(world, row.task)
        )
    assert min(seen[status] for status in ("running", "success", "failure", "skipped", "stopped")) > 100, seen


def open_(world: World, task_id: str) -> bool:
    return task_id in world.engine.open_tasks
