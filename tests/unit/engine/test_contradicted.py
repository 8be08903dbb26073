"""An action that is done, says its machine, and the machine's own status says otherwise: the catalogue does not know better."""

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel.inputs import GoalEventInput
from formiga_bt.rehearsal.testing import alarms
from formiga_bt.transport.messages import GoalEvent
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART

UP = CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Park}]"


def test_a_start_that_succeeded_on_the_ground_has_failed_and_nothing_that_builds_on_it_is_sent(
    make: Make, wording: Wording
) -> None:
    yard = make(UP)
    task = yard.start()
    yard.cart.succeed(landed="grounded")

    assert yard.end(task) == ("FAILED", "failed:contradicted")
    wording(yard.task(task).outcome.reason)
    assert yard.cart.done == ["Rise"]
    assert yard.record("c1").landed == "grounded"


def test_a_landing_that_succeeded_in_the_air_has_failed_and_it_is_brought_home(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Rise}, {do: cart.Park}]")
    task = yard.start()
    yard.cart.succeed()
    yard.run_for(0.5)
    yard.cart.succeed(landed="airborne")
    yard.run_for(0.5)
    assert yard.record("c1").landed == "airborne"
    assert yard.cart.done == ["Rise", "Park", "Home"]
    yard.cart.succeed()

    assert yard.end(task) == ("FAILED", "failed:contradicted")


def test_a_way_home_that_only_says_so_is_tried_again_then_a_person_is_needed(make: Make) -> None:
    yard = make(UP)
    task = yard.start()
    yard.cart.succeed()
    yard.run_for(0.5)
    yard.cart.effects = {}
    yard.cart.auto = {"Home": 1}
    yard.abort(task)
    yard.cart.side.finish(yard.cart.goal.goal_id, "canceled") if yard.cart.side.active else None
    yard.run_for(60)

    assert yard.cart.done.count("Home") == 3
    assert "agent_needs_help" in alarms(yard)
    assert yard.record("c1").quarantine == "recover_failed"


def test_a_start_that_is_tried_again_may_succeed(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Rise, retry: {attempts: 2}}, {do: cart.Home}]")
    task = yard.start()
    yard.cart.succeed(landed="grounded")
    yard.run_for(3)
    yard.cart.succeed()
    yard.run_for(0.5)
    yard.cart.succeed()

    assert yard.end(task) == ("SUCCEEDED", "")
    assert yard.cart.done == ["Rise", "Rise", "Home"]


@pytest.mark.parametrize("landed", ["unknown", "airborne"])
def test_what_does_not_know_or_agrees_contradicts_nothing(make: Make, landed: str) -> None:
    yard = make(UP)
    yard.start()
    yard.cart.succeed(landed=landed)
    yard.run_for(0.5)

    assert yard.cart.done == ["Rise", "Move"]


def test_without_a_status_the_catalogue_holds_until_the_next_one(make: Make) -> None:
    yard = make(UP)
    yard.start()
    goal = yard.cart.goal.goal_id
    yard.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c1", state="succeeded", n=3)))
    assert yard.record("c1").landed == "airborne"

    yard.cart.say(landed="grounded")
    yard.run_for(0.2)
    assert yard.record("c1").landed == "grounded"


def test_a_status_that_is_not_believed_contradicts_nothing(make: Make) -> None:
    yard = make(UP)
    yard.start()
    goal = yard.cart.goal.goal_id
    lie = replace(yard.cart.side.status, battery=150.0, seq=99, last_goal=goal, action_name="", status="STANDBY")
    yard.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c1", state="succeeded", n=9, status=lie)))

    assert yard.record("c1").landed == "airborne"


def test_a_newer_status_that_came_before_the_end_counts(make: Make) -> None:
    yard = make(UP)
    task = yard.start()
    goal = yard.cart.goal.goal_id
    status = yard.cart.side.status
    yard.cart.say(landed="grounded")
    yard.run_for(0.2)
    old = replace(
        status, landed="airborne", last_goal=goal, last_goal_state="succeeded", action_name="", status="STANDBY"
    )
    yard.driver.feed(GoalEventInput(GoalEvent(goal_id=goal, agent="c1", state="succeeded", n=9, status=old)))

    assert yard.end(task) == ("FAILED", "failed:contradicted")
