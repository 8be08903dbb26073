"""The engine is killed at steps all along the shipped missions; another one goes on: nothing is lost, nothing flown twice."""

from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import check_rehearsal, packaged_task, packaged_world
from formiga_bt.transport.memory import Faults
from tests.missions.crashing import Crashing, When
from tests.shares import some

SITE, CATALOGUE = packaged_world()
PLACES = SITE.places
MISSIONS: dict[str, dict[str, Any]] = {
    "pick_up": {"target": PLACES["north_field"], "user": AgentRef("picker_1")},
    "explore_region": {"region": SITE.regions["bog"]},
    "move_task": {"robot": AgentRef("lwd_1")},
    "watch_dog_sos": {"alarmtype": "sos", "target": PLACES["camp"]},
    "watch_dog_request": {"alarmtype": "lost", "target": PLACES["east_field"], "username": AgentRef("picker_2")},
    "patrol_and_escort": {"target": PLACES["north_field"]},
    "delivery": {"target": PLACES["north_field"], "next_stop": PLACES["east_field"], "return_second": True},
}
KILLS = some(5, 9)
"""So many steps of each mission are killed, two ways each; how many there are is another matter."""
ROUNDS = "patrol_and_escort"
"""Its first drone flies rounds until the second has landed: how many is a matter of time."""
WALKS = "watch_dog_request"
"""Its drone goes ahead of somebody who walks on meanwhile: where to is a matter of time."""


def begin(name: str) -> tuple[Crashing, str]:
    task = packaged_task(name)
    answers = [{"match": "loaded", "options": ["not_yet", "loaded"], "after": "4 s"}]
    flight = Rehearsal(SITE, CATALOGUE, [task], fleet_of(SITE, CATALOGUE, scripts={"picker_1": answers}))
    flight.run_for(1)
    crashing = Crashing(flight)
    return crashing, flight.submit(task.name, MISSIONS[name])


class Plain:
    """A mission that nothing happened to."""

    def __init__(self, name: str) -> None:
        self.name = name
        flown, self.task = begin(name)
        before = len(flown.seen)
        assert flown.run()
        self.steps = len(flown.seen) - before
        self.status, self.code = flown.flight.task(self.task).status, flown.flight.task(self.task).outcome.code
        self.legs = flown.legs()
        self.rounds = flown.again_begun()

    def compare(self, flown: Crashing, *, later: bool = False) -> None:
        """Check that another flight came to the same, and flew the same; `later`: time was lost on the way."""
        task = flown.flight.task(self.task)
        assert (task.status, task.outcome.code) == (self.status, self.code), flown.story()
        assert flown.twice() == []
        assert set(flown.again_begun()) <= set(self.rounds)
        differs = self.name == ROUNDS or (later and self.name == WALKS)
        for agent in () if differs else {agent for agent, _, _ in self.legs}:
            mine = [leg for leg in flown.legs() if leg[0] == agent]
            assert mine == [leg for leg in self.legs if leg[0] == agent]
        check_rehearsal(flown.flight)
        flown.flight.close()


@pytest.fixture(scope="module")
def plain() -> dict[str, Plain]:
    return {name: Plain(name) for name in MISSIONS}


@pytest.mark.parametrize("when", get_args(When))
@pytest.mark.parametrize("name", MISSIONS)
def test_a_short_outage_at_any_step_changes_nothing(name: str, when: When, plain: dict[str, Plain]) -> None:
    for step in range(1, plain[name].steps, max(1, plain[name].steps // KILLS)):
        flown, _ = begin(name)
        flown.kill_at(step, when)
        assert not flown.run()
        flown.resume(away_s=2.0)
        assert flown.run(), f"killed at step {step}"
        plain[name].compare(flown)


@settings(max_examples=some(8, 15), deadline=None)
@given(data=st.data())
def test_however_often_it_dies_all_ends_as_without(data: st.DataObject, plain: dict[str, Plain]) -> None:
    name = data.draw(st.sampled_from(["pick_up", "move_task", "delivery"]))
    flown, _ = begin(name)
    flown.kill_at(data.draw(st.integers(1, plain[name].steps)), data.draw(st.sampled_from(get_args(When))))
    deaths = 0
    while not flown.run():
        deaths += 1
        flown.resume(away_s=data.draw(st.floats(0.0, 4.0)))
        again = data.draw(st.integers(0, 60))  # the first few are in the midst of asking what became of the goals
        if again and deaths < 6:  # more could be an outage that people must look at
            flown.kill_at(again, data.draw(st.sampled_from(get_args(When))))
    assert flown.twice() == []
    plain[name].compare(flown)


@settings(max_examples=some(8, 15), deadline=None)
@given(data=st.data())
def test_over_a_bad_wire_too_no_goal_is_begun_twice_and_all_ends(data: st.DataObject, plain: dict[str, Plain]) -> None:
    name = data.draw(st.sampled_from(["pick_up", "move_task"]))
    flown, id_ = begin(name)
    for agent in flown.flight.sim.agents:
        faults = Faults(drop=0.1, duplicate=0.2, reorder=0.2, jitter_us=50_000)
        flown.flight.hub.set_faults(agent, faults)
    for _ in range(data.draw(st.integers(1, 4))):
        flown.kill_at(data.draw(st.integers(1, plain[name].steps)), data.draw(st.sampled_from(get_args(When))))
        if flown.run():
            break
        flown.resume(away_s=data.draw(st.floats(0.0, 3.0)))
    flown.flight.driver._persist = None
    if flown.flight.run_until(lambda: "resume" in flown.flight.task(id_).hold.words, limit_s=60):
        flown.flight.ask(Operator("continue", id_, "watcher_1"))
    assert flown.run(), flown.story()
    assert flown.twice() == []
    check_rehearsal(flown.flight)
    flown.flight.close()
