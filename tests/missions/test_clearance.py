"""Starting and landing near people: nothing starts or lands away from a port without a person's word (safety.md 3)."""

from typing import Any

import pytest

from agents_sim.planning import Leg, way_down
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.inputs import Operator, SendGoal
from formiga_bt.engine.kernel.timers import ClearanceDue
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import alarms, effects, packaged_world, task_of
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.test_shipped import pick_up

AWAY = {"lwd_1": {"at": Place(-60.0, -180.0)}}
NEVER = [{"match": "clear", "never": True}]


def says(*words: str, after: str = "3 s") -> list[dict[str, Any]]:
    return [{"match": "clear", "options": list(words), "after": after}]


def move(rehearsal: Rehearsal, **options: Any) -> str:
    return rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")}, **options)


def starts(rehearsal: Rehearsal) -> list[SendGoal]:
    return [goal for goal in effects(rehearsal, SendGoal) if goal.action == "TakeOff"]


def test_wait_is_asked_again_after_half_a_minute(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": says("wait", "wait", "clear")})

    task = move(rehearsal)
    rehearsal.run_for(50)
    assert len(rehearsal.sim["watcher_1"].person.asked) == 2
    assert rehearsal.task(task).hold.words == ("clearance:lwd_1",)

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert len(rehearsal.sim["watcher_1"].person.asked) == 3


def test_a_refusal_ends_a_grounded_task_at_once(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": says("refuse")})

    task = move(rehearsal)
    rehearsal.run_for(10)

    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "no_clearance")
    assert rehearsal.engine.state.agents["lwd_1"].pool == "PARKED_AWAY"
    assert {"no_clearance", "parked_away"} <= set(alarms(rehearsal))
    assert starts(rehearsal) == []


@pytest.mark.parametrize("script", [NEVER, says("wait")])
def test_without_a_word_in_five_minutes_a_grounded_drone_stays(fly: Fly, script: list[dict[str, Any]]) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": script})

    task = move(rehearsal)
    rehearsal.run_for(299)
    assert rehearsal.task(task).status == "ACTIVE"
    rehearsal.run_for(2)

    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "no_clearance")
    assert rehearsal.engine.state.agents["lwd_1"].pool == "PARKED_AWAY"
    assert rehearsal.engine.state.questions == {}


def test_in_the_air_it_waits_until_its_reserve_is_near_then_fails_and_recovers(fly: Fly, wording: Wording) -> None:
    never = {"picker_1": NEVER, "watcher_1": NEVER, "picker_2": NEVER}
    rehearsal = fly(scripts=never)

    task = pick_up(rehearsal)
    rehearsal.run_for(600)
    assert rehearsal.task(task).status == "ACTIVE"
    assert rehearsal.task(task).hold.words == ("clearance:hwd_1",)
    asked = next(q for q in rehearsal.engine.state.questions.values() if q.kind == "clearance")
    patience = rehearsal.engine.state.deadlines[ClearanceDue("hwd_1")]
    assert asked.expires_at == patience.at  # what people's apps count down to

    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "no_clearance")
    wording(rehearsal.task(task).outcome.reason)
    drone = rehearsal.engine.state.agents["hwd_1"]
    assert (drone.pool, drone.landed) == ("STANDBY", "grounded")
    assert drone.battery is not None
    assert drone.battery > 25.0


def test_the_people_of_the_task_are_asked_first_and_the_watchers_after_a_minute(fly: Fly) -> None:
    site, catalogue = packaged_world()
    text = """
agents:
  drone: {type: lwd, away: true, id: "${robot}"}
  picker: {type: picker}
params:
  robot: {type: agent, of: [lwd]}
imports: [lib/flying.yaml]
steps:
  - do: drone.TakeOff
    when: not drone.airborne
  - ask: Fine?
    of: [picker]
    timeout: 1 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
    rehearsal = fly(task_of(text, site, catalogue), change=AWAY, scripts={"picker_1": NEVER})

    task = rehearsal.submit("Try", {"robot": AgentRef("lwd_1")})
    rehearsal.run_for(59)
    assert rehearsal.sim["watcher_1"].person.asked == []
    assert len(rehearsal.sim["picker_1"].person.asked) == 1

    assert rehearsal.run_until_ended(task)
    assert len(rehearsal.sim["watcher_1"].person.asked) == 1
    assert starts(rehearsal)[0].clearance is not None


def test_timers_of_the_task_do_not_stand_still_for_a_clearance(fly: Fly) -> None:
    site, catalogue = packaged_world()
    text = """
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd, away: true, id: "${robot}"}
params:
  robot: {type: agent, of: [lwd]}
steps:
  - do: drone.TakeOff
    when: not drone.airborne
    timeout: 40 s
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
    rehearsal = fly(task_of(text, site, catalogue), change=AWAY, scripts={"watcher_1": NEVER})

    task = rehearsal.submit("Try", {"robot": AgentRef("lwd_1")})
    rehearsal.run_for(41)

    assert rehearsal.task(task).outcome.code == "timeout"
    assert rehearsal.engine.state.clearances == {}
    assert rehearsal.engine.state.questions == {}


def test_a_word_that_was_not_used_within_a_minute_is_asked_for_again(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": says("clear", after="5 s")})
    task = move(rehearsal)
    rehearsal.run_for(2)
    # The word comes while a pilot has the drone, and is old when it is handed back.
    rehearsal.sim.take_over("lwd_1")
    rehearsal.run_for(100)
    rehearsal.sim.hand_back("lwd_1")
    rehearsal.run_for(1)
    assert starts(rehearsal) == []

    rehearsal.ask(Operator("handback_end", "lwd_1"))

    assert rehearsal.run_until_ended(task)
    assert len(rehearsal.sim["watcher_1"].person.asked) == 2
    for goal in starts(rehearsal):
        assert goal.clearance is not None


def test_nobody_is_asked_again_and_again_while_the_way_down_is_taken(fly: Fly) -> None:
    field = packaged_world()[0].places["north_field"]
    rehearsal = fly(change={"lwd_1": {"at": Position(field.east_m, field.north_m, 30.0)}})
    rehearsal.ask(Operator("hold", "lwd_1"))  # else it is brought home
    watcher = rehearsal.sim["watcher_1"].person
    task = pick_up(rehearsal)
    rehearsal.run_for(400)

    assert [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"] == [
        ("leg_busy", "lwd_1")
    ]
    assert (rehearsal.task(task).hold.words, [one for one in watcher.asked if "land here" in str(one)]) == ((), [])

    rehearsal.ask(Operator("continue", "lwd_1"))

    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert len([one for one in watcher.asked if "land here" in str(one)]) == 1


def landing_is_asked(fly: Fly) -> tuple[Rehearsal, str]:
    """PickUp hovers over the field, and nobody says whether people stand clear."""
    rehearsal = fly(scripts=dict.fromkeys(("picker_1", "picker_2", "watcher_1"), NEVER))
    task = pick_up(rehearsal)
    assert rehearsal.run_until(lambda: rehearsal.task(task).hold.words == ("clearance:hwd_1",), 300)
    assert [q.kind for q in rehearsal.engine.state.questions.values()] == ["clearance"]
    return rehearsal, task


@pytest.mark.parametrize("how", ["land", "pilot", "failsafe"])
def test_one_that_has_landed_is_not_asked_for_any_more(fly: Fly, how: str) -> None:
    rehearsal, task = landing_is_asked(fly)
    drone = rehearsal.sim["hwd_1"].drone
    match how:
        case "land":
            rehearsal.ask(Operator("land", "hwd_1"))
        case "pilot":
            drone.take_over()
            drone._fly("", "by hand", way_down(drone.position()))
        case "failsafe":
            drone.set_battery(2.0)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].landed == "grounded", 200)

    assert rehearsal.engine.state.questions == {}
    assert rehearsal.engine.state.clearances == {}
    assert "clearance:hwd_1" not in rehearsal.task(task).hold.words


def test_one_that_its_pilot_has_flown_elsewhere_is_not_asked_for_there_any_more(fly: Fly) -> None:
    rehearsal, task = landing_is_asked(fly)
    drone = rehearsal.sim["hwd_1"].drone
    drone.take_over()
    here = drone.position()
    drone._fly("", "by hand", [Leg(Position(here.east_m + 60.0, here.north_m, here.up_m), "cruise")])
    rehearsal.run_for(20)

    assert rehearsal.engine.state.questions == {}
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(1)
    rehearsal.ask(Operator("handback_end", "hwd_1"))
    assert rehearsal.run_until_ended(task, limit_s=1200)


def test_a_start_is_not_asked_for_any_more_once_its_pilot_flies_it(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    task = move(rehearsal)
    rehearsal.run_for(5)
    drone = rehearsal.sim["lwd_1"].drone
    drone.take_over()
    here = drone.position()
    drone._fly("", "by hand", [Leg(Position(here.east_m, here.north_m, 30.0), "climb")])
    rehearsal.run_for(30)

    assert rehearsal.engine.state.questions == {}
    rehearsal.sim.hand_back("lwd_1")
    rehearsal.run_for(1)
    rehearsal.ask(Operator("handback_return", "lwd_1"))
    rehearsal.abort(task)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["lwd_1"].landed == "grounded", 600)


def test_an_abort_withdraws_the_question(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    task = move(rehearsal)
    rehearsal.run_for(5)

    rehearsal.abort(task)

    rehearsal.run_for(1)
    assert rehearsal.task(task).status == "CANCELED"
    assert rehearsal.engine.state.questions == {}
    assert rehearsal.engine.state.clearances == {}


def test_a_drone_lost_while_it_waits_for_a_word_withdraws_the_question(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    task = move(rehearsal)
    rehearsal.run_for(5)

    rehearsal.sim.kill("lwd_1")
    rehearsal.run_for(60)

    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "agent_lost")
    assert rehearsal.engine.state.questions == {}
    assert rehearsal.engine.state.clearances == {}


def test_a_watcher_who_leaves_and_comes_back_sees_the_question_again(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": says("clear", after="20 s")})
    task = move(rehearsal)
    rehearsal.run_for(5)

    rehearsal.sim.kill("watcher_1")
    rehearsal.run_for(30)
    rehearsal.sim.restart("watcher_1")

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert len(rehearsal.sim["watcher_1"].person.asked) == 2


def test_nobody_is_asked_for_a_start_or_landing_at_the_own_port(fly: Fly) -> None:
    rehearsal = fly()

    rehearsal.run_until_ended(move(rehearsal))

    assert rehearsal.sim["watcher_1"].person.asked == []
    assert starts(rehearsal)[0].clearance is None


def test_a_machine_that_is_carried_to_its_port_waits_for_no_word_any_more(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    task = move(rehearsal)
    rehearsal.run_for(10)
    assert rehearsal.task(task).hold.words == ("clearance:lwd_1",)

    site = rehearsal.engine.core.site
    rehearsal.sim["lwd_1"].drone.carry(site.ports[site.agents["lwd_1"].home].at)
    rehearsal.run_for(15)

    assert len(starts(rehearsal)) == 1
    assert rehearsal.task(task).hold.words == ()
    assert rehearsal.engine.state.clearances == {}
    assert rehearsal.engine.state.questions == {}
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_without_anybody_to_ask_there_is_an_alarm(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, without=("watcher_1",))

    task = move(rehearsal)

    assert rehearsal.run_until_ended(task, limit_s=400)
    assert rehearsal.task(task).outcome.code == "no_clearance"
    assert starts(rehearsal) == []


def test_a_word_is_for_a_spot_and_not_for_another(fly: Fly) -> None:
    site, catalogue = packaged_world()
    text = """
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd}
  picker: {type: picker}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.north_field}", height: 60 m}
  - ask: Do you stand clear here?
    of: [picker]
    options: [clear_here, no_way]
    clears: {role: drone, on: [clear_here]}
    timeout: 1 min
  - do: drone.GoTo
    with: {to: "${at_height(offset(site.places.north_field, east = -6 m), 60 m)}"}
  - do: drone.LandIn
    with: {at: "${offset(site.places.north_field, east = -6 m)}"}
  - do: drone.TakeOff
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
    rehearsal = fly(task_of(text, site, catalogue))

    task = rehearsal.submit("Try")

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    asked = [q for person in ("picker_1", "picker_2") for q in rehearsal.sim[person].person.asked]
    # the ask itself, the landing 6 m beside it, and the start after that word was used up
    assert len(asked) == 3
