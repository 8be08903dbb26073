"""Whether what was interrupted is done, can be done again, or what is left of it: by action, height and place."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.goals.climbing import THERE_M, climb
from formiga_bt.engine.kernel.records import GO_ON, STOPPED, AgentRecord, Deadline, GoalRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import PortDue
from formiga_bt.engine.orders.continuing import cannot, climbs_to_m, is_done
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.safety.traffic import first_in_the_way, traffic_of
from tests.golden import Wording

ACTION = packaged_world()[1].actions.__getitem__
UP = Position(5.0, 6.0, 3.0)
AGENT = AgentRecord(id="d1", type="hwd", actions=("TakeOff", "GoTo", "LandIn"), position=UP, landed="airborne")
TAKE_OFF = GoalRecord(id="T-1/1/steps/x", agent="d1", action="TakeOff", fields={"altitude": 60.0}, state="interrupted")
CLIMB = replace(TAKE_OFF, action="GoTo", rest_of="TakeOff", fields={"to": Position(5.0, 6.0, 60.0)})
LAND = GoalRecord(id="T-1/1/steps/y", agent="d1", action="LandIn", fields={"at": Place(5.0, 6.0)}, state="interrupted")


def at(up_m: float) -> AgentRecord:
    return replace(AGENT, position=Position(5.0, 6.0, up_m))


@pytest.mark.parametrize("goal", [TAKE_OFF, CLIMB])
@pytest.mark.parametrize(
    ("up_m", "done"),
    [(0.3, False), (30.0, False), (60.0 - THERE_M - 0.01, False), (59.0, True), (60.0, True), (80.0, True)],
)
def test_a_take_off_is_done_at_its_altitude(goal: GoalRecord, up_m: float, done: bool) -> None:
    assert is_done(goal, at(up_m), ACTION) is done
    assert climbs_to_m(goal, at(up_m), ACTION) == (None if done else 60.0)
    assert cannot(EngineState(), goal, at(up_m), ACTION) == ""


def test_a_climb_is_straight_up_by_the_action_that_flies_to_a_position() -> None:
    assert climb(AGENT, 60.0, ACTION) == ("GoTo", {"to": Position(5.0, 6.0, 60.0)})


@pytest.mark.parametrize("goal", [TAKE_OFF, CLIMB])
@pytest.mark.parametrize(
    ("agent", "text"),
    [
        (
            replace(AGENT, actions=("TakeOff", "LandIn")),
            "TakeOff of d1 was broken off 3 m up, and it has no action that climbs on to 60 m",
        ),
        (replace(AGENT, position=None), "TakeOff of d1 was broken off in the air, and it is not known where it is"),
        (replace(AGENT, landed="unknown"), "TakeOff needs d1 grounded, it is unknown"),
    ],
)
def test_why_the_rest_of_a_take_off_cannot_be_flown(goal: GoalRecord, agent: AgentRecord, text: str) -> None:
    assert cannot(EngineState(), goal, agent, ACTION) == text


@pytest.mark.parametrize("goal", [TAKE_OFF, CLIMB])
def test_on_the_ground_it_takes_off_again(goal: GoalRecord) -> None:
    grounded = replace(AGENT, landed="grounded", position=Position(5.0, 6.0, 0.0))
    assert not is_done(goal, grounded, ACTION)
    assert climbs_to_m(goal, grounded, ACTION) is None
    assert cannot(EngineState(), goal, grounded, ACTION) == ""


def test_a_take_off_that_never_left_is_no_climb(wording: Wording) -> None:
    waits = replace(TAKE_OFF, state="gated", code="stopped")
    assert climbs_to_m(waits, AGENT, ACTION) is None
    wording(cannot(EngineState(), waits, AGENT, ACTION))


def test_a_climb_that_waits_at_the_gate_may_be_asked_for_again() -> None:
    assert cannot(EngineState(), replace(CLIMB, state="gated", code="stopped"), AGENT, ACTION) == ""
    assert cannot(EngineState(), replace(CLIMB, state="gated", code="stopped"), at(61.0), ACTION) == ""


@pytest.mark.parametrize(
    ("east_m", "text"),
    [(15.0, ""), (15.1, "LandIn needs d1 within 10 m, it is 11 m away"), (105.0, "it is 100 m away")],
)
def test_a_landing_goes_on_only_where_it_was(east_m: float, text: str) -> None:
    found = cannot(EngineState(), LAND, replace(AGENT, position=Position(east_m, 6.0, 60.0)), ACTION)
    assert found.endswith(text)
    assert bool(found) is bool(text)


def test_a_landing_that_waited_for_its_port_is_brought_back_above_it() -> None:
    state = EngineState()
    state.deadlines[PortDue(LAND.id)] = Deadline(1, 1)
    assert cannot(state, LAND, replace(AGENT, position=Position(105.0, 6.0, 60.0)), ACTION) == ""


def test_what_is_still_stopping_may_be_continued_but_not_what_may_not_be_repeated(wording: Wording) -> None:
    leaving = replace(TAKE_OFF, state="canceling", cancel_asked=True, cancel_why=STOPPED)
    assert leaving.stopping
    assert not replace(leaving, cancel_why=GO_ON).stopping
    assert not is_done(leaving, at(60.0), ACTION)
    for landed in ("airborne", "grounded", "unknown"):
        assert cannot(EngineState(), leaving, replace(at(60.0), landed=landed), ACTION) == ""
    explore = replace(leaving, action="Explore", fields={})
    wording(cannot(EngineState(), explore, AGENT, ACTION))


def test_a_climb_keeps_apart_as_a_take_off_does() -> None:
    way = ((Position(0.0, 0.0, 3.0), Position(0.0, 0.0, 60.0)),)

    def blocker(other: Position, *, climbs_on: bool) -> str:
        near = [traffic_of("d2", "T-2", "airborne", other)]
        return first_in_the_way("d1", "T-1", way, None, near, 15.0, climbs_on=climbs_on)

    assert blocker(Position(10.0, 0.0, 3.0), climbs_on=True) == ""
    assert blocker(Position(10.0, 0.0, 3.0), climbs_on=False) == "d2"
    assert blocker(Position(7.0, 0.0, 3.0), climbs_on=True) == "d2"
    assert blocker(Position(10.0, 0.0, 60.0), climbs_on=True) == "d2"
