"""What an order stopped waits for a word that somebody can say, or goes on: nothing waits for nobody."""

from formiga_bt.engine.kernel.inputs import GoalEventInput, LockdownOrder
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.rehearsal.testing import packaged_world, task_of
from formiga_bt.show.why.causes import causes_of
from formiga_bt.transport.messages import GoalEvent
from tests.missions.conftest import Fly
from tests.missions.test_faults import crossing, pool
from tests.missions.test_orders import order, refused, standing

TWO = """
imports: [lib/flying.yaml]
agents:
  one: {type: hwd, id: hwd_1}
  two: {type: lwd, id: lwd_1}
steps:
  - for: {drone: "${[one, two]}"}
    mode: parallel
    steps:
      - do: drone.TakeOff
        with: {altitude: 60 m}
      - do: drone.GoTo
        with: {to: {east: 20 m, north: 300 m, height: 60 m}}
      - call: ReturnHome
        with: {drone: "${drone}"}
"""


def test_a_way_home_that_was_held_goes_on_when_its_task_is_aborted_at_once(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(5)
    order(rehearsal, "hold", "hwd_1")
    rehearsal.run_for(10)
    assert [c.code for c in causes_of(rehearsal.engine.state, rehearsal.task(task))][-1] == "goal.interrupted"

    rehearsal.abort(task, how="now")

    assert standing(rehearsal) is None
    assert [c.code for c in causes_of(rehearsal.engine.state, rehearsal.task(task))] == ["goal.sent"]
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_task_stays_held_for_the_machine_that_nobody_continued(fly: Fly) -> None:
    rehearsal = fly(task_of(TWO, *packaged_world(), name="Two"))
    task = rehearsal.submit("Two")
    rehearsal.run_for(30)
    rehearsal.ask(LockdownOrder("return", "ann"))
    rehearsal.run_for(3)
    rehearsal.ask(LockdownOrder("release", "ann"))
    order(rehearsal, "hold", "lwd_1")
    assert rehearsal.run_until(lambda: standing(rehearsal) is None, 300)
    assert rehearsal.task(task).hold.words == ("operator", "operator:lwd_1")

    order(rehearsal, "continue", "lwd_1")

    assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
    assert refused(rehearsal, "continue", "hwd_1")[0] == "cannot_continue"
    assert order(rehearsal, "restart", task) == Done()
    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_a_restarted_task_whose_machine_was_told_to_land_begins_anew(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    order(rehearsal, "restart", task)
    rehearsal.run_for(3)
    order(rehearsal, "land", task)

    assert rehearsal.run_until(lambda: rehearsal.task(task).run == 2, 300)

    assert rehearsal.task(task).status == "PENDING"
    assert task in rehearsal.engine.state.requests
    assert [c.code for c in causes_of(rehearsal.engine.state, rehearsal.task(task))] == ["agents"]
    rehearsal.abort(task)


def test_a_quarantined_machine_that_lockdown_brings_home_stays_quarantined(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task, how="abandon")
    rehearsal.ask(LockdownOrder("return", "ann"))

    assert rehearsal.run_until(lambda: pool(rehearsal)[1] == "grounded", 600)
    rehearsal.run_for(5)
    rehearsal.ask(LockdownOrder("release", "ann"))

    assert pool(rehearsal) == ("QUARANTINED", "grounded")
    order(rehearsal, "clear", "hwd_1")
    rehearsal.run_for(2)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_goal_that_no_order_replaced_fails_its_step(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    goal = rehearsal.engine.state.agents["hwd_1"].goal

    rehearsal.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="hwd_1", state="superseded", n=99)))

    assert goal not in rehearsal.engine.state.goals
    assert rehearsal.task(task).outcome.code == "failed:superseded"
    assert rehearsal.run_until_ended(task, limit_s=600)
