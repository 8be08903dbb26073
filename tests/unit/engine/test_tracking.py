"""A target that moves: the gate judges each new one, the old one stands where it says no, and nothing is lost in a crash."""

from typing import Any

import pytest

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.inputs import AgentSeenInput, Alarm, LockdownOrder, Operator, UpdateGoalFields
from formiga_bt.nodes.memory import NODE_STATE_VERSION
from formiga_bt.nodes.tracking import differing
from formiga_bt.rehearsal.testing import Bench, effects, packaged_world, task_of
from tests.golden import Wording
from tests.missions.crashing import Crashing
from tests.unit.engine.test_updates import Following

SITE, CATALOGUE = packaged_world()
MEET = """
agents: {drone: {type: hwd}, picker: {type: picker}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${above(ground(picker.position), 50 m)}"}
    track: {every: 2 s, within: 3 m}
    timeout: 10 min
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
HOVER = "  - do: drone.GoTo\n    with: {to: '${drone.position}'}\n"


class Meeting(Bench):
    """A drone in the air that goes after a picker."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, steps: str = MEET) -> None:
        monkeypatch.setattr("formiga_bt.rehearsal.testing.ScriptedAgent", Following)
        super().__init__(SITE, CATALOGUE, [task_of(steps, SITE, CATALOGUE)])
        self.drone = self.agent("hwd_1", "hwd")
        self.picker = self.agent("picker_1", "picker", at=Place(50.0, 0.0))
        self.run_for(2)
        self.id = self.submit("Try", {})
        self.run_for(1)
        self.rise()
        self.run_for(1)
        assert self.drone.goal.goal_id == f"{self.id}/1/steps/steps[1]", self.task(self.id).outcome

    def rise(self) -> None:
        """Let the drone be 60 m over its port, and say so."""
        port = self.record("hwd_1").position
        assert port is not None
        for up in range(3, 63, 3):
            self.drone.say(landed="airborne", position=Position(port.east_m, port.north_m, float(up)))
            self.run_for(1)
        self.drone.succeed()

    @property
    def told(self) -> list[dict[str, Any]]:
        assert isinstance(self.drone, Following)
        return [update["to"] for update in self.drone.updates]

    def walk(self, east: float) -> None:
        self.picker.say(position=Position(east, 0.0, 0.0))

    def failure(self) -> tuple[str, str]:
        return self.task(self.id).outcome.code, self.task(self.id).outcome.reason


def test_the_machine_is_told_where_they_are_now_and_a_small_step_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    meeting.walk(52.0)
    meeting.run_for(3)
    assert meeting.told == []
    meeting.walk(54.0)
    meeting.run_for(3)
    assert meeting.told == [{"east_m": 54.0, "north_m": 0.0, "up_m": 50.0}]
    meeting.drone.say(position=Position(54.0, 0.0, 50.0))
    meeting.drone.succeed()
    meeting.run_for(1)
    assert meeting.drone.goal.action == "LandIn"
    meeting.check()


def test_what_the_gate_refuses_leaves_the_old_target_in_force_and_fails_after_10_s(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    meeting = Meeting(monkeypatch)
    goal = meeting.drone.goal.goal_id
    meeting.walk(9000.0)  # beyond the fence
    meeting.run_for(9)
    assert meeting.told == []
    assert meeting.engine.state.goals[goal].fields["to"].east_m == 50.0
    assert meeting.drone.cancels == []
    meeting.run_for(4)
    assert meeting.drone.cancels == [goal]
    meeting.run_for(2)
    code, reason = meeting.failure()
    assert code == "no_update"
    wording(reason)
    assert meeting.drone.goal.goal_id.startswith(f"{meeting.id}/1/recover:hwd_1")
    meeting.check()


def test_one_who_comes_back_in_time_is_followed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    meeting.walk(9000.0)
    meeting.run_for(8)
    meeting.walk(60.0)
    meeting.run_for(8)
    assert [to["east_m"] for to in meeting.told] == [60.0]
    assert meeting.drone.cancels == []


def test_an_agent_that_refuses_is_no_alarm_and_the_reason_says_its_code(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(Following, "no", "not_now")
    meeting = Meeting(monkeypatch)
    meeting.walk(60.0)
    meeting.run_for(15)
    code, reason = meeting.failure()
    assert code == "no_update"
    wording(reason)
    assert [alarm for alarm in effects(meeting, Alarm) if alarm.code == "update_refused"] == []


def test_on_a_wire_that_cannot_change_a_goal_nothing_is_sent(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    meeting = Meeting(monkeypatch, MEET.replace("  - do: drone.GoTo\n", f"{HOVER}  - do: drone.GoTo\n", 1))
    card = meeting.drone.side.card
    meeting.driver.feed(AgentSeenInput(card, meeting.now, "mqtt", ("update",)))
    before = len(meeting.drone.requests)
    meeting.drone.succeed()
    meeting.run_for(2)
    code, reason = meeting.failure()
    assert code == "no_update"
    wording(reason)
    assert [request.action for request in meeting.drone.requests[before:] if "/steps/" in request.goal_id] == []


def test_after_a_crash_it_goes_on_following(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    meeting.walk(60.0)
    meeting.run_for(3)
    crashing = Crashing(meeting)
    crashing.die()
    meeting.walk(70.0)
    crashing.resume(3, node_state=NODE_STATE_VERSION)
    meeting.run_for(6)
    assert [to["east_m"] for to in meeting.told] == [60.0, 70.0]
    assert [one.n for one in effects(meeting, UpdateGoalFields)] == [1, 2]


@pytest.mark.parametrize(
    ("now", "before", "differs"),
    [
        (Place(3.0, 4.0), Place(0.0, 0.0), False),
        (Place(3.1, 4.0), Place(0.0, 0.0), True),
        (Position(0.0, 0.0, 5.1), Position(0.0, 0.0, 0.0), True),
        ((Place(1.0, 0.0), Place(2.0, 0.0)), (Place(0.0, 0.0), Place(0.0, 0.0)), False),
        ((Place(1.0, 0.0),), (Place(1.0, 0.0), Place(2.0, 0.0)), True),
        (2.0, 2.1, True),
        (True, True, False),
        (1.0, None, True),
    ],
)
def test_places_differ_by_metres_and_all_else_by_anything(now: Any, before: Any, differs: bool) -> None:
    assert bool(differing({"to": now}, {"to": before}, 5.0)) is differs


def updates_while(meeting: Meeting, stop: Any) -> int:
    """Return how many updates leave in the 20 s after something stops the machine, while the picker walks on."""
    meeting.walk(60.0)
    meeting.run_for(3)
    stop()
    before = len(effects(meeting, UpdateGoalFields))
    assert before
    for east in range(70, 90):
        meeting.walk(float(east))
        meeting.run_for(1)
    return len(effects(meeting, UpdateGoalFields)) - before


def test_nothing_is_told_to_a_machine_that_a_pilot_has(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    assert updates_while(meeting, lambda: meeting.drone.side.take_control("pilot")) == 0


def test_nothing_is_told_in_lockdown(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    assert updates_while(meeting, lambda: meeting.ask(LockdownOrder("hold", "watcher_1"))) == 0


def test_nothing_is_told_to_a_machine_that_is_to_stand_still(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = Meeting(monkeypatch)
    assert updates_while(meeting, lambda: meeting.ask(Operator("hold", meeting.id, "watcher_1"))) == 0
