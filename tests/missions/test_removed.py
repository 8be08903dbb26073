"""A machine that is never heard of again, and a person who takes it away and says so (`formiga agents removed`)."""

import pytest

from agents_sim.world import AgentSpec
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place
from formiga_bt.engine.kernel.inputs import Alarm, NotifyPeople, Operator
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import alarms, effects, folded
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.crashing import Crashing
from tests.missions.test_shipped import SITE, pick_up

FIELD = SITE.places["north_field"]
WORKSHOP = Place(-200.0, -200.0)


def waiting(rehearsal: Rehearsal) -> list[tuple[str, str]]:
    return [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"]


def crashed(rehearsal: Rehearsal) -> str:
    """Lose hwd_1 on its way to the field: it comes down, and is never heard of again. Return its task."""
    task = pick_up(rehearsal)
    rehearsal.run_for(24)
    rehearsal.sim.kill("hwd_1")
    rehearsal.sim["hwd_1"].drone.set_battery(0.0)
    rehearsal.run_for(60)
    record = rehearsal.engine.state.agents["hwd_1"]
    assert (record.pool, record.liveness, record.landed) == ("QUARANTINED", "LOST", "airborne")
    return task


def test_a_word_that_a_crashed_machine_was_removed_frees_its_way(fly: Fly) -> None:
    rehearsal = fly()
    crashed(rehearsal)
    task = pick_up(rehearsal)
    rehearsal.run_for(200)
    assert waiting(rehearsal) == [("leg_busy", "hwd_1")]

    rehearsal.sim["hwd_1"].drone.carry(WORKSHOP)
    rehearsal.ask(Operator("removed", "hwd_1", "ann"))

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    record = rehearsal.engine.state.agents["hwd_1"]
    assert (record.pool, record.quarantine, record.position, record.layer_m) == ("QUARANTINED", "removed", None, None)
    assert not record.may_be_airborne


def test_who_said_so_is_in_the_journal_and_people_are_told(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    crashed(rehearsal)
    rehearsal.ask(Operator("removed", "hwd_1", "ann"))

    step = next(s for s in rehearsal.steps if s.input == Operator("removed", "hwd_1", "ann"))
    wording([e.text for e in step.effects if isinstance(e, NotifyPeople)])
    assert folded(rehearsal.steps).agents["hwd_1"] == rehearsal.engine.state.agents["hwd_1"]

    rehearsal.ask(Operator("removed", "hwd_1", "bob"))  # the same again changes nothing
    assert (rehearsal.steps[-1].changes, rehearsal.steps[-1].effects) == ((), ())


@pytest.mark.parametrize("removed", [False, True])
def test_another_engine_goes_on_with_what_a_person_said(fly: Fly, removed: bool) -> None:
    rehearsal = fly()
    crashed(rehearsal)
    if removed:
        rehearsal.sim["hwd_1"].drone.carry(WORKSHOP)
        rehearsal.ask(Operator("removed", "hwd_1", "ann"))
    flown = Crashing(rehearsal)
    flown.die()
    first = flown.resume()
    told = [effect.agent for effect in first.effects if isinstance(effect, Alarm)]
    assert told == ([] if removed else ["hwd_1"])  # it may be in the air

    rehearsal.run_for(10)
    pick_up(rehearsal)
    rehearsal.run_for(200)
    assert waiting(rehearsal) == ([] if removed else [("leg_busy", "hwd_1")])
    if not removed:
        rehearsal.ask(Operator("removed", "hwd_1", "ann"))
    assert rehearsal.run_until_ended()


def test_it_frees_the_spot_where_a_dead_machine_stood(fly: Fly) -> None:
    parked = AgentSpec(id="lwd_9", type="lwd", at=Place(FIELD.east_m, FIELD.north_m + 1.0))
    rehearsal = fly(more=[parked])
    rehearsal.sim.kill("lwd_9")
    rehearsal.run_for(60)
    task = pick_up(rehearsal)
    rehearsal.run_for(200)
    assert ("spot_busy", "lwd_9") in waiting(rehearsal)

    rehearsal.sim["lwd_9"].drone.carry(WORKSHOP)
    rehearsal.ask(Operator("removed", "lwd_9", "ann"))

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_one_that_was_removed_and_is_switched_on_again_comes_back_when_a_person_cleared_it(fly: Fly) -> None:
    rehearsal = fly()
    crashed(rehearsal)
    rehearsal.sim["hwd_1"].drone.carry(WORKSHOP)
    rehearsal.ask(Operator("removed", "hwd_1", "ann"))
    rehearsal.sim["hwd_1"].drone.set_battery(100.0)
    rehearsal.sim.restart("hwd_1")
    rehearsal.run_for(30)

    record = rehearsal.engine.state.agents["hwd_1"]
    assert (record.pool, record.quarantine, record.liveness) == ("QUARANTINED", "removed", "ALIVE")
    assert record.position is not None
    assert record.position.ground == WORKSHOP
    assert "found_airborne" not in alarms(rehearsal)

    rehearsal.ask(Operator("clear", "hwd_1", "ann"))
    rehearsal.run_for(10)
    assert rehearsal.engine.state.agents["hwd_1"].pool == "PARKED_AWAY"


def test_one_that_flies_after_all_is_told_with_an_alarm_and_brought_home(fly: Fly) -> None:
    rehearsal = fly()
    pick_up(rehearsal)
    rehearsal.run_for(24)
    rehearsal.sim.freeze("hwd_1")
    rehearsal.run_for(60)
    rehearsal.ask(Operator("removed", "hwd_1", "ann"))
    rehearsal.sim.thaw("hwd_1")
    rehearsal.run_for(10)
    assert rehearsal.run_until_ended()

    assert alarms(rehearsal).count("found_airborne") == 1
    record = rehearsal.engine.state.agents["hwd_1"]
    assert (record.pool, record.landed, record.quarantine) == ("STANDBY", "grounded", "")


def refused(rehearsal: Rehearsal, agent: str) -> tuple[str, str]:
    before = rehearsal.engine.state.agents.get(agent)
    with pytest.raises(TaskError) as caught:
        rehearsal.ask(Operator("removed", agent, "ann"))
    assert rehearsal.engine.state.agents.get(agent) == before
    return caught.value.code, str(caught.value)


ONLY = "only what counts as lost can be said to be removed"


def test_it_is_refused_while_the_machine_is_heard_of(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = pick_up(rehearsal)
    rehearsal.run_for(24)
    code, text = refused(rehearsal, "hwd_1")
    assert code == "still_heard"
    wording(text)
    code, text = refused(rehearsal, "lwd_1")
    assert code == "still_heard"
    wording(text)
    assert refused(rehearsal, "picker_1")[0] == "human"
    assert refused(rehearsal, "hwd_9")[0] == "unknown_agent"

    rehearsal.abort(task, how="abandon")  # quarantined, but heard
    rehearsal.run_for(5)
    assert refused(rehearsal, "hwd_1")[0] == "still_heard"

    rehearsal.sim.freeze("hwd_1")
    rehearsal.run_for(10)
    code, text = refused(rehearsal, "hwd_1")
    assert code == "still_heard"
    wording(text)
    rehearsal.sim.thaw("hwd_1")
    rehearsal.run_for(10)
    rehearsal.ask(Operator("clear", "hwd_1"))
    assert rehearsal.run_until_ended()


def test_one_that_was_never_admitted_frees_its_place_too(fly: Fly) -> None:
    """It has no port, so nobody ever brings it home."""
    more = [AgentSpec(id=f"lwd_{n}", type="lwd", at=Place(-300.0 - 20.0 * n, -300.0)) for n in range(20, 40)]
    rehearsal = fly(more=more)
    stranger = next(a for a in rehearsal.engine.state.agents.values() if a.refused)
    rehearsal.sim.kill(stranger.id)
    rehearsal.run_for(60)
    rehearsal.ask(Operator("removed", stranger.id, "ann"))

    record = rehearsal.engine.state.agents[stranger.id]
    assert (record.position, record.quarantine) == (None, "")
    assert effects(rehearsal, NotifyPeople)[-1].text.startswith(f"{stranger.id} was removed")
