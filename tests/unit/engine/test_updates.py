"""Other fields for a goal that runs: the gate judges them, the agent takes or refuses them, a restart sends them again."""

from typing import Any

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.inputs import (
    AgentSeenInput,
    Alarm,
    SendGoal,
    UpdateGoal,
    UpdateGoalFields,
    UpdateReplyInput,
)
from formiga_bt.engine.kernel.records import GoalRecord
from formiga_bt.engine.kernel.replies import Done, Refusal
from formiga_bt.nodes.memory import NODE_STATE_VERSION
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, effects, packaged_world, task_of
from formiga_bt.transport.messages import UpdateReply
from tests.missions.crashing import Crashing

SITE, CATALOGUE = packaged_world()
FLY = task_of(
    """
agents: {drone: {type: hwd}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${at_height(base, 75 m)}"}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
""",
    SITE,
    CATALOGUE,
)
THERE = Position(60.0, 20.0, 75.0)


class Following(ScriptedAgent):
    """Takes updates, or refuses them with `no`."""

    no = ""

    def __init__(self, *args: Any, **more: Any) -> None:
        self.updates: list[dict[str, Any]] = []
        super().__init__(*args, **more)

    def update(self, goal_id: str, fields: dict[str, Any]) -> str:
        if not self.no:
            self.updates.append(fields)
        return self.no


def aloft(monkeypatch: pytest.MonkeyPatch, *, follows: bool = True) -> tuple[Bench, ScriptedAgent, GoalRecord]:
    if follows:
        monkeypatch.setattr("formiga_bt.rehearsal.testing.ScriptedAgent", Following)
    made = Bench(SITE, CATALOGUE, [FLY])
    drone = made.agent("hwd_1", "hwd")
    made.run_for(2)
    made.submit("Try", {})
    made.run_for(10)
    drone.succeed()
    made.run_for(2)
    assert drone.goal.action == "GoTo"
    return made, drone, made.engine.state.goals[drone.goal.goal_id]


def order(made: Bench, goal: GoalRecord, **fields: Any) -> Any:
    return made.driver.feed(UpdateGoal(goal.id, fields, "anna")).reply


def now(made: Bench, goal: GoalRecord) -> GoalRecord:
    return made.engine.state.goals[goal.id]


def test_an_update_is_sent_taken_and_then_the_goal_has_its_fields_and_way(monkeypatch: pytest.MonkeyPatch) -> None:
    made, drone, goal = aloft(monkeypatch)
    assert isinstance(order(made, goal, to=THERE), Done)
    sent = now(made, goal)
    assert (sent.fields, sent.leg) == (goal.fields, goal.leg)
    assert sent.also is not None
    assert sent.also[1] == THERE, "both ways are reserved"
    made.run_for(1)
    taken = now(made, goal)
    assert isinstance(drone, Following)
    assert drone.updates == [{"to": {"east_m": 60.0, "north_m": 20.0, "up_m": 75.0}}]
    assert (taken.fields["to"], taken.update, taken.updates) == (THERE, None, 1)
    assert taken.leg is not None
    assert taken.leg[1] == THERE
    drone.say(battery=70.0)
    made.run_for(1)
    assert now(made, goal).also is None
    drone.say(position=THERE)
    drone.succeed()
    made.run_for(2)
    assert drone.goal.action == "LandIn"
    made.check()


def test_an_agent_without_updates_refuses_and_the_old_target_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, goal = aloft(monkeypatch, follows=False)
    assert isinstance(order(made, goal, to=THERE), Done)
    made.run_for(1)
    after = now(made, goal)
    assert (after.fields, after.leg, after.also, after.update) == (goal.fields, goal.leg, None, None)
    (said,) = [one.text for one in effects(made, Alarm) if one.code == "update_refused"]
    assert "no_update" in said
    made.check()


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"to": Position(60.0, 20.0, 9000.0)}, "envelope.max_height"),
        ({"to": Position(1e6, 20.0, 75.0)}, "envelope.keep_in"),
        ({"too": THERE}, "bad_field"),
        ({"to": "there"}, "bad_field"),
        ({}, "bad_field"),
    ],
)
def test_what_the_gate_or_the_catalogue_does_not_let_is_refused_and_nothing_changes(
    monkeypatch: pytest.MonkeyPatch, fields: dict[str, Any], code: str
) -> None:
    made, _, goal = aloft(monkeypatch)
    reply = order(made, goal, **fields)
    assert isinstance(reply, Refusal)
    assert reply.code == code
    assert now(made, goal) == goal
    assert effects(made, UpdateGoalFields) == []


def test_a_way_that_another_machine_takes_up_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, goal = aloft(monkeypatch)
    made.agent("hwd_2", "hwd", at=Position(60.0, 20.0, 75.0)).say(landed="airborne", position=THERE)
    made.run_for(1)
    reply = order(made, goal, to=THERE)
    assert isinstance(reply, Refusal)
    assert reply.code == "leg_busy"
    assert now(made, goal) == goal


def test_a_wire_without_updates_a_goal_that_is_over_and_a_second_update_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, drone, goal = aloft(monkeypatch)
    assert isinstance(order(made, goal, to=THERE), Done)
    assert order(made, goal, to=Position(50.0, 20.0, 75.0)).code == "update_open"
    made.run_for(1)
    made.driver.feed(AgentSeenInput(drone.side.card, made.now, "mqtt", ("update",)))
    assert order(made, goal, to=Position(50.0, 20.0, 75.0)).code == "no_update"
    drone.succeed()
    made.run_for(1)
    assert order(made, goal, to=THERE).code == "no_goal"
    assert made.driver.feed(UpdateGoal("nobody/0/steps/1", {"to": THERE})).reply.code == "no_goal"  # type: ignore[union-attr]


def test_an_update_that_is_lost_is_sent_again_under_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    made, drone, goal = aloft(monkeypatch)
    made.hub.cut("hwd_1", vanishes=False)
    order(made, goal, to=THERE)
    made.run_for(1)
    made.hub.mend("hwd_1")
    made.run_for(4)
    assert isinstance(drone, Following)
    assert {one.n for one in effects(made, UpdateGoalFields)} == {1}
    assert len(effects(made, UpdateGoalFields)) > 1
    assert len(drone.updates) == 1
    assert now(made, goal).fields["to"] == THERE


def test_after_a_crash_an_update_on_its_way_is_sent_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made, drone, goal = aloft(monkeypatch)
    made.hub.cut("hwd_1", vanishes=False)
    order(made, goal, to=THERE)
    crashing = Crashing(made)
    crashing.die()
    made.hub.mend("hwd_1")
    crashing.resume(3, node_state=NODE_STATE_VERSION)
    made.run_for(8)
    assert isinstance(drone, Following)
    assert len(drone.updates) == 1
    assert now(made, goal).fields["to"] == THERE
    assert {goal.id} == {one.goal_id for one in effects(made, SendGoal) if one.action == "GoTo"}


def test_an_answer_to_another_update_or_of_another_agent_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, goal = aloft(monkeypatch)
    made.hub.cut("hwd_1", vanishes=False)
    order(made, goal, to=THERE)
    before = now(made, goal)
    for reply in (
        UpdateReply(goal_id=goal.id, agent="hwd_1", n=7),
        UpdateReply(goal_id=goal.id, agent="hwd_2", n=1),
        UpdateReply(goal_id="none", agent="hwd_1", n=1),
    ):
        made.driver.feed(UpdateReplyInput(reply))
        assert now(made, goal) == before


def test_what_a_lost_machine_may_be_on_stays_reserved_either_way(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, goal = aloft(monkeypatch)
    made.hub.cut("hwd_1")
    order(made, goal, to=THERE)
    made.run_for(40)
    agent = made.record("hwd_1")
    assert agent.liveness == "LOST"
    assert agent.lost_leg is not None
    assert agent.lost_leg[1] == THERE
    assert agent.lost_area is not None
    assert goal.leg is not None
    assert goal.leg[1].ground in agent.lost_area.corners


def test_the_error_of_a_program_that_asks_names_what_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, goal = aloft(monkeypatch)
    with pytest.raises(TaskError) as error:
        made.engine.updates.order(goal.id, {"speeed": 3.0})
    assert "speed" in error.value.help
