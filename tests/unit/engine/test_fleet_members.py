"""`fleet('picker')` while tasks run: who joins, who is lost, who comes back; nobody polls; a snapshot keeps it."""

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import AgentSeenInput, EngineStep
from formiga_bt.engine.kernel.state import board_of, members_key
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.transport.messages import AgentCard
from tests.reloading import reloaded
from tests.replay.missions import world

TEXT = """
formiga: 1
task: Crowd
steps:
  - wait_until: len(fleet('person')) > NUMBER
    timeout: 1 h
  - for: {one: "${fleet('person')}"}
    steps:
      - notify: ${one.id}
"""


@pytest.fixture
def flown() -> Rehearsal:
    site, _, _ = world()
    catalogue, problems, _ = load_catalogue(sorted(folder("actions").glob("*.yaml")))
    assert problems == []
    fleet = fleet_of(site, catalogue)
    people = sum(catalogue.types[one.type].human for one in fleet)
    loaded = load_task_text(TEXT.replace("NUMBER", str(people)), "crowd.yaml", catalogue=catalogue, site=site)
    assert loaded.diagnostics == []
    assert loaded.task is not None
    return Rehearsal(site, catalogue, [loaded.task], fleet)


def join(flown: Rehearsal, agent: str, kind: str = "picker") -> EngineStep:
    card = AgentCard(id=agent, type=kind, boot_id=f"{agent}-1", actions=("Confirm",), mobility="people")
    flown.driver.feed(AgentSeenInput(card))
    return flown.steps[-1]


def members(engine: Engine, kind: str) -> list[str]:
    return [one.id for one in TaskEnv(engine.core, None, {}).members(kind)]


def test_who_joins_wakes_a_condition_on_a_type_that_theirs_extends(flown: Rehearsal) -> None:
    flown.run_for(1)
    task = flown.submit("Crowd", {})
    flown.run_for(2)
    before = members(flown.engine, "person")
    assert flown.engine.state.tasks[task].status == "ACTIVE"
    join(flown, "zoe", "watcher")

    assert flown.engine.state.tasks[task].status == "SUCCEEDED"
    assert members(flown.engine, "person") == [*before, "zoe"]
    assert flown.engine.core.board.get(members_key("watcher")) == len(members(flown.engine, "watcher"))
    flown.close()


def test_who_is_not_admitted_is_not_there(flown: Rehearsal) -> None:
    flown.run_for(1)
    task = flown.submit("Crowd", {})
    flown.run_for(2)
    join(flown, "zoe", "ghost")

    assert "zoe" not in [one for kind in flown.engine.core.catalogue.types for one in members(flown.engine, kind)]
    assert flown.engine.state.tasks[task].status == "ACTIVE"
    flown.close()


def test_a_loaded_state_knows_who_is_there_and_wakes_as_before(flown: Rehearsal) -> None:
    flown.run_for(1)
    task = flown.submit("Crowd", {})
    flown.run_for(2)
    old = flown.engine
    state = reloaded(old.state)
    again = Engine(old.core.site, old.core.catalogue, old.core.models, state=state)
    key = members_key("picker")
    card = AgentCard(id="zoe", type="picker", boot_id="z", actions=("Confirm",), mobility="people")
    due = again.next_deadline()
    step = again.handle(state.now, AgentSeenInput(card))

    assert members(again, "drone") == members(old, "drone")
    assert board_of(state).get(key) == again.core.board.get(key) == old.core.board.get(key) + 1
    assert due is None or due[0] >= state.now
    assert again.state.tasks[task].status == "SUCCEEDED", step
    flown.close()
