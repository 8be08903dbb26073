"""Orders of people above the tasks: hold, return, land, cut, continue, handback, restart, lockdown."""

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.kernel.inputs import GoalEventInput, LockdownOrder, Operator, SendGoal, Submit
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import alarms, effects, packaged_world, task_of
from formiga_bt.transport.messages import GoalEvent
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.test_faults import crossing, pool


def order(rehearsal: Rehearsal, word: str, target: str = "", by: str = "ann") -> Accepted | Done:
    return rehearsal.ask(Operator(word, target, by))  # type: ignore[arg-type]


def refused(rehearsal: Rehearsal, word: str, target: str = "") -> tuple[str, str]:
    with pytest.raises(TaskError) as caught:
        order(rehearsal, word, target)
    return caught.value.code, str(caught.value)


def sent(rehearsal: Rehearsal, agent: str = "hwd_1") -> list[str]:
    return [g.goal_id for g in effects(rehearsal, SendGoal) if g.agent == agent]


def airborne(rehearsal: Rehearsal) -> list[str]:
    return [a.id for a in rehearsal.engine.state.agents.values() if a.landed != "grounded" and not a.human]


def standing(rehearsal: Rehearsal, agent: str = "hwd_1") -> tuple[str, str] | None:
    found = rehearsal.engine.state.orders.get(agent)
    return (found.stop, found.state) if found else None


def test_hold_hovers_and_continue_sends_the_leg_anew_under_another_id(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    leg = sent(rehearsal)[-1]

    order(rehearsal, "hold", "hwd_1")
    rehearsal.run_for(60)
    here = rehearsal.sim["hwd_1"].body.position()
    rehearsal.run_for(60)

    assert rehearsal.sim["hwd_1"].body.position() == here
    assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
    assert standing(rehearsal) == ("hold", "done")
    assert sent(rehearsal)[-1] == leg

    order(rehearsal, "continue", "hwd_1")
    rehearsal.run_for(1)

    assert sent(rehearsal)[-1] == f"{leg}+2"
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert standing(rehearsal) is None


def test_a_goal_that_was_stopped_stays_so_when_its_machine_says_once_more_that_it_never_had_it(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "hold", "hwd_1")
    rehearsal.run_for(5)
    goal = sent(rehearsal)[-1]

    rehearsal.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="hwd_1", state="unknown", n=0)))

    assert rehearsal.engine.state.goals[goal].state == "interrupted"
    order(rehearsal, "continue", "hwd_1")
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_the_same_order_twice_changes_nothing(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "hold", "hwd_1")
    rehearsal.run_for(5)
    before = len(sent(rehearsal))

    assert order(rehearsal, "hold", "hwd_1") == Done()
    assert rehearsal.steps[-1].changes == ()
    assert len(sent(rehearsal)) == before

    order(rehearsal, "continue", task)
    assert rehearsal.run_until_ended(task)


def test_one_that_hovers_too_long_comes_home_by_itself(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "hold", task)

    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 3600)

    assert "hold_over" in alarms(rehearsal)
    assert rehearsal.sim["hwd_1"].body.battery() > 25
    assert rehearsal.task(task).hold.words == ("operator",)
    code, text = refused(rehearsal, "continue", task)
    assert code == "cannot_continue"
    wording(text)
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)
    assert standing(rehearsal) is None


def test_return_flies_home_at_once_and_the_task_waits(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    order(rehearsal, "return", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)
    rehearsal.run_for(5)

    home = [g for g in effects(rehearsal, SendGoal) if g.goal_id.startswith("Return-")]
    assert [g.action for g in home] == ["GoTo", "GoTo", "LandIn"]
    assert all(g.safety for g in home)
    assert rehearsal.task(task).status == "ACTIVE"
    assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
    assert standing(rehearsal) == ("return", "done")
    assert pool(rehearsal)[0] != "STANDBY"  # it stays its task's

    order(rehearsal, "restart", task)
    rehearsal.run_for(2)
    order(rehearsal, "continue", "hwd_1")  # the order was for the machine: it stands until a person lifts it
    assert rehearsal.run_until_ended(task)
    record = rehearsal.task(task)
    assert (record.status, record.run) == ("SUCCEEDED", 2)
    assert any("/2/steps" in goal for goal in sent(rehearsal, record.agents.granted[0]))


def test_land_comes_down_here_and_parks_away(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    order(rehearsal, "land", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)
    rehearsal.run_for(5)

    assert standing(rehearsal) == ("land", "done")
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)
    assert pool(rehearsal) == ("PARKED_AWAY", "grounded")

    order(rehearsal, "return", "hwd_1")  # from the ground: people say first that they stand clear
    assert rehearsal.run_until(lambda: pool(rehearsal) == ("STANDBY", "grounded"), 900)
    assert [g.action for g in effects(rehearsal, SendGoal) if g.agent == "hwd_1"][-4:] == [
        "TakeOff",
        "GoTo",
        "GoTo",
        "LandIn",
    ]
    order(rehearsal, "continue", "hwd_1")


def test_land_shifts_away_from_known_people(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    drone, picker = rehearsal.sim["hwd_1"].body, rehearsal.sim["picker_1"].body
    picker.stand_at(packaged_world()[0].places["north_field"])
    assert rehearsal.run_until(lambda: horizontal_m(drone.position(), picker.position()) < 1, 60)

    order(rehearsal, "land", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)

    assert 15 <= horizontal_m(drone.position(), picker.position()) < 20
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)


def test_a_hold_in_recover_waits_and_goes_on(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(8)

    order(rehearsal, "hold", "hwd_1")
    rehearsal.run_for(120)
    assert rehearsal.task(task).section == "recover"
    assert pool(rehearsal)[1] == "airborne"

    order(rehearsal, "continue", "hwd_1")
    assert rehearsal.run_until_ended(task)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_return_while_its_task_recovers_it_goes_on_with_that(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(8)

    order(rehearsal, "return", "hwd_1")
    assert rehearsal.run_until_ended(task)

    assert not [t for t in rehearsal.engine.state.tasks if t.startswith("Return")]
    assert standing(rehearsal) == ("return", "done")
    order(rehearsal, "continue", "hwd_1")
    assert standing(rehearsal) is None


def test_hold_then_land_then_return_each_replaces_the_one_before(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    for word in ("hold", "land", "hold", "return", "hold", "return"):
        order(rehearsal, word, "hwd_1")
        rehearsal.run_for(2)
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 900)
    rehearsal.run_for(5)
    assert standing(rehearsal) == ("return", "done")
    rehearsal.abort(task)
    assert rehearsal.run_until_ended()


def test_hold_all_stops_everything_and_grants_nothing(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "hold")
    late = rehearsal.submit("MoveTask", {})
    rehearsal.run_for(30)

    assert {a for a, o in rehearsal.engine.state.orders.items() if o.stop == "hold"} == {
        "lwd_1",
        "lwd_2",
        "lwd_3",
        "hwd_1",
        "hwd_2",
    }
    assert rehearsal.task(late).status == "PENDING"
    order(rehearsal, "continue")
    assert rehearsal.run_until_ended(task, late)
    assert {rehearsal.task(t).status for t in (task, late)} == {"SUCCEEDED"}


def test_orders_that_cannot_be(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    pending = rehearsal.submit("MoveTask", {})
    code, text = refused(rehearsal, "hold", "nobody")
    assert code == "unknown_target"
    wording(text)
    code, text = refused(rehearsal, "hold", "picker_1")
    assert code == "human"
    wording(text)
    assert refused(rehearsal, "hold", pending)[0] in ("not_started", "")
    code, text = refused(rehearsal, "continue", task)
    assert code == "not_held"
    wording(text)
    code, text = refused(rehearsal, "cut", "lwd_1")
    assert code == "not_announced"
    wording(text)
    code, text = refused(rehearsal, "handback_end", "lwd_1")
    assert code == "not_taken_over"
    wording(text)
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)
    code, text = refused(rehearsal, "return", "hwd_1")
    assert code == "not_in_command"
    wording(text)  # fmt: skip
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(1)
    order(rehearsal, "handback_continue", "hwd_1")
    assert rehearsal.run_until_ended()


@pytest.mark.parametrize("how", ["continue", "return", "end"])
def test_a_person_hands_back_in_three_ways(fly: Fly, how: str) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(30)
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(5)

    order(rehearsal, f"handback_{how}", "hwd_1")

    if how == "return":
        assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)
        assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
        rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)
    expected = {"continue": ("SUCCEEDED", ""), "return": ("CANCELED", "aborted"), "end": ("FAILED", "taken_over")}
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == expected[how]


def test_lockdown_returns_all_and_release_leaves_stopped_tasks_to_a_person(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.ask(LockdownOrder("return", "ann"))
    with pytest.raises(TaskError) as caught:
        rehearsal.ask(Submit("MoveTask", {}))
    assert caught.value.code == "lockdown"
    assert rehearsal.run_until(lambda: not airborne(rehearsal), 600)
    rehearsal.run_for(5)
    assert rehearsal.task(task).hold.words == ("lockdown",)
    assert refused(rehearsal, "continue", task)[0] == "lockdown"

    rehearsal.ask(LockdownOrder("release", "ann"))
    rehearsal.run_for(30)

    assert rehearsal.task(task).hold.words == ("operator",)
    assert rehearsal.engine.state.orders == {}
    order(rehearsal, "restart", task)
    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).run) == ("SUCCEEDED", 2)


@pytest.mark.parametrize("how", ["hold", "land"])
def test_lockdown_stops_recover_until_its_release(fly: Fly, how: str) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(8)

    rehearsal.ask(LockdownOrder(how, "ann"))  # type: ignore[arg-type]
    rehearsal.run_for(120)
    assert pool(rehearsal)[1] == ("airborne" if how == "hold" else "grounded")

    rehearsal.ask(LockdownOrder("release", "ann"))
    assert rehearsal.run_until_ended(task)
    assert pool(rehearsal) == (("STANDBY" if how == "hold" else "PARKED_AWAY"), "grounded")


def test_what_is_handed_back_in_the_air_during_lockdown_obeys_it(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)
    rehearsal.ask(LockdownOrder("land", "ann"))
    rehearsal.run_for(10)
    assert standing(rehearsal) is None
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(5)

    order(rehearsal, "handback_continue", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)

    rehearsal.ask(LockdownOrder("release", "ann"))
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)


def test_an_action_that_may_not_be_repeated_cannot_be_continued(fly: Fly, wording: Wording) -> None:
    site, catalogue = packaged_world()
    survey = task_of(
        """imports: [lib/flying.yaml]
agents: {drone: {type: lwd}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.lake_shore}", height: 60 m}
  - do: drone.Explore
    with: {region: "${site.regions.lake}"}
    timeout: 30 min
  - call: ReturnHome
    with: {drone: "${drone}"}
""",
        site,
        catalogue,
        "Survey",
    )
    rehearsal = fly(survey)
    task = rehearsal.submit("Survey")
    assert rehearsal.run_until(lambda: any(a.action == "Explore" for a in rehearsal.engine.state.agents.values()), 600)
    rehearsal.run_for(5)
    order(rehearsal, "hold", task)
    rehearsal.run_for(5)

    code, text = refused(rehearsal, "continue", task)
    assert code == "cannot_continue"
    wording(text)
    order(rehearsal, "restart", task)
    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).run) == ("SUCCEEDED", 2)


TIDY = """imports: [lib/flying.yaml]
agents: {drone: {type: lwd}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.lake_shore}", height: 60 m}
  - parallel:
      - sequence:
          - wait: 10 min
        finally:
          - do: drone.GoTo
            with: {to: "${above(site.places.camp, 60 m)}"}
      - wait: 1 s
    need: any
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


@pytest.mark.parametrize("word", ["abort", "restart"])
@pytest.mark.parametrize("stop", ["lockdown", "hold"])
def test_a_finally_that_an_order_stopped_goes_on_when_its_task_is_ended(fly: Fly, stop: str, word: str) -> None:
    """It waits for nobody's word then; what it cannot do any more ends."""
    rehearsal = fly(task_of(TIDY, *packaged_world(), "Tidy"))
    task = rehearsal.submit("Tidy")
    assert rehearsal.run_until(lambda: bool(rehearsal.task(task).ending.cleanups), 600)
    rehearsal.run_for(2)
    (drone,) = rehearsal.task(task).agents.roles["drone"]
    if stop == "lockdown":
        rehearsal.ask(LockdownOrder("land", "ann"))
        rehearsal.run_for(60)
        rehearsal.ask(LockdownOrder("release", "ann"))
    else:
        order(rehearsal, stop, drone)
        rehearsal.run_for(60)
    (goal,) = [goal for goal in rehearsal.engine.state.goals.values() if goal.agent == drone]
    assert goal.state == "interrupted"

    rehearsal.abort(task) if word == "abort" else order(rehearsal, "restart", task)
    rehearsal.run_for(1)

    left = rehearsal.engine.state.goals.get(goal.id)
    assert left is None or left.state != "interrupted"
    rehearsal.abort(task) if word == "restart" else None
    assert rehearsal.run_until_ended(task, limit_s=300)


def test_a_machine_whose_motors_were_cut_is_nobodys_until_a_person_has_looked(fly: Fly) -> None:
    rehearsal = fly(change={"hwd_1": {"cut": True}})
    task = crossing(rehearsal)

    order(rehearsal, "cut", "hwd_1")
    rehearsal.run_for(10)

    assert sent(rehearsal)[-1].startswith("safety/hwd_1/")
    record = rehearsal.engine.state.agents["hwd_1"]
    assert (record.pool, record.quarantine, record.landed) == ("QUARANTINED", "cut", "grounded")
    assert "cut" in alarms(rehearsal)
    assert refused(rehearsal, "continue", "hwd_1")[0] == "not_held"
    assert rehearsal.run_until_ended(task)
    order(rehearsal, "clear", "hwd_1")
    rehearsal.run_for(5)
    assert rehearsal.engine.state.agents["hwd_1"].pool == "PARKED_AWAY"


def test_a_cut_on_the_ground_is_sent_too(fly: Fly) -> None:
    rehearsal = fly(change={"hwd_1": {"cut": True}})

    order(rehearsal, "cut", "hwd_1")

    assert [g.action for g in effects(rehearsal, SendGoal) if g.agent == "hwd_1"] == ["CutMotors"]


def not_cut(fly: Fly) -> tuple[Rehearsal, str]:
    """Return a flight whose machine was ordered to cut its motors, and was taken over by its pilot before it had."""
    rehearsal = fly(change={"hwd_1": {"cut": True}})
    task = crossing(rehearsal)
    rehearsal.hub.set_delay("hwd_1", 2_000_000)
    order(rehearsal, "cut", "hwd_1")
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(10)
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(5)
    rehearsal.hub.set_delay("hwd_1", 20_000)
    return rehearsal, task


def test_a_handback_that_is_refused_changes_nothing(fly: Fly, wording: Wording) -> None:
    rehearsal, task = not_cut(fly)
    assert standing(rehearsal) == ("cut", "open")

    code, text = refused(rehearsal, "handback_return", "hwd_1")
    assert code == "cut"
    wording(text)

    assert rehearsal.engine.state.agents["hwd_1"].taken
    assert any(cause.startswith("take-over:") for cause in rehearsal.task(task).hold.words)


@pytest.mark.parametrize("word", ["return", "land", "continue"])
def test_a_machine_that_did_not_cut_its_motors_can_be_ordered_again(fly: Fly, word: str) -> None:
    rehearsal, task = not_cut(fly)
    order(rehearsal, "handback_end", "hwd_1")
    rehearsal.run_for(1)
    assert standing(rehearsal) == ("cut", "failed")
    assert airborne(rehearsal) == ["hwd_1"]
    assert "agent_needs_help" in alarms(rehearsal)

    order(rehearsal, word, "hwd_1")
    if word != "continue":
        rehearsal.run_for(120)
        order(rehearsal, "continue", "hwd_1")

    assert rehearsal.run_until_ended(task)
    assert airborne(rehearsal) == []


def test_a_cut_that_failed_is_sent_again(fly: Fly) -> None:
    rehearsal, _ = not_cut(fly)
    order(rehearsal, "handback_end", "hwd_1")
    rehearsal.run_for(1)

    order(rehearsal, "cut", "hwd_1")
    rehearsal.run_for(10)

    assert rehearsal.engine.state.agents["hwd_1"].quarantine == "cut"


def test_a_take_off_that_was_held_goes_on_in_the_air(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal, 26)
    order(rehearsal, "return", "lwd_1")
    order(rehearsal, "continue", "lwd_1")
    second = rehearsal.submit("MoveTask", {})
    assert rehearsal.run_until_ended(task, second)

    third = rehearsal.submit("PickUp", rehearsal.task(task).request.params)
    assert rehearsal.run_until(lambda: any(a.action == "TakeOff" for a in rehearsal.engine.state.agents.values()), 60)
    rehearsal.run_for(10)
    drone = rehearsal.task(third).agents.roles["drone"][0]
    order(rehearsal, "hold", third)
    rehearsal.run_for(10)
    order(rehearsal, "continue", third)

    assert rehearsal.run_until_ended(third)
    assert rehearsal.task(third).status == "SUCCEEDED"
    assert [g for g in sent(rehearsal, drone) if "TakeOff" in g and g.endswith("+2")] == []


def test_a_landing_at_its_own_port_is_finished(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task, how="now")
    home = "recover:hwd_1#1/steps[2]"
    assert rehearsal.run_until(lambda: home in rehearsal.engine.state.agents["hwd_1"].goal, 300)
    rehearsal.run_for(3)
    before = len(sent(rehearsal))

    order(rehearsal, "return", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 60)

    assert len(sent(rehearsal)) == before
    order(rehearsal, "continue", "hwd_1")


def test_machines_that_are_ordered_down_at_one_instant_land_on_spots_of_their_own(fly: Fly) -> None:
    site, _ = packaged_world()
    over = site.places["north_field"]
    up = {f"lwd_{n}": {"at": Position(over.east_m, over.north_m, 50.0 + 20.0 * n)} for n in (1, 2)}
    rehearsal = fly(change={**up, "picker_1": {"at": over}})

    order(rehearsal, "land")
    rehearsal.run_for(240)

    spots = [rehearsal.sim[name].body.position() for name in up]
    assert [spot.up_m for spot in spots] == [0.0, 0.0]
    assert horizontal_m(*spots) >= 15.0


def test_a_start_that_is_under_way_when_its_order_is_withdrawn_ends_at_home(fly: Fly) -> None:
    rehearsal = fly(change={"lwd_1": {"at": Place(0.0, -90.0)}})
    order(rehearsal, "return")
    assert rehearsal.run_until(lambda: sent(rehearsal, "lwd_1") != [], 60)

    order(rehearsal, "continue", "lwd_1")
    rehearsal.run_for(240)

    record = rehearsal.engine.state.agents["lwd_1"]
    assert (record.pool, record.landed) == ("STANDBY", "grounded")
    assert standing(rehearsal, "lwd_1") is None


def test_continue_for_all_ends_no_way_home_that_is_not_done(fly: Fly) -> None:
    rehearsal = fly(
        change={"lwd_1": {"at": Place(0.0, -90.0)}},
        scripts={"watcher_1": [{"match": "start", "options": ["clear"], "after": "20 s"}]},
    )
    order(rehearsal, "return", "lwd_1")
    order(rehearsal, "hold", "lwd_2")
    rehearsal.run_for(5)

    order(rehearsal, "continue")

    assert standing(rehearsal, "lwd_1") == ("return", "open")
    assert standing(rehearsal, "lwd_2") is None
    assert rehearsal.run_until(lambda: standing(rehearsal, "lwd_1") == ("return", "done"), 300)
    assert pool(rehearsal, "lwd_1") == ("STANDBY", "grounded")
    order(rehearsal, "continue")  # what is done holds nothing any more
    assert standing(rehearsal, "lwd_1") is None


def test_continue_for_all_leaves_the_task_of_one_that_is_brought_home_held(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "land", "hwd_1")
    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 120)
    rehearsal.run_for(5)
    order(rehearsal, "return", "hwd_1")  # it stands in the field: it waits until people stand clear
    rehearsal.run_for(1)

    order(rehearsal, "continue")

    assert standing(rehearsal) == ("return", "open")
    assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
    order(rehearsal, "continue", "hwd_2") if standing(rehearsal, "hwd_2") else None
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task, limit_s=600)
