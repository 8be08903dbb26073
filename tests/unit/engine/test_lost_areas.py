"""The area of an explorer of which nobody knows what it does: how long it stays closed to others (safety: keeping apart)."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.engine.kernel.inputs import Abort, Alarm, LockdownOrder
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import Bench, effects, packaged_world, task_of

BOG = Region((Place(100.0, 100.0), Place(200.0, 100.0), Place(200.0, 200.0), Place(100.0, 200.0)))
SURVEY = """
imports: [lib/flying.yaml]
params: {robot: {type: agent, of: [lwd]}, region: region}
agents: {drone: {type: lwd, id: "${robot}"}}
steps:
  - do: drone.TakeOff
    with: {altitude: 75 m}
  - do: drone.Explore
    with: {region: "${region}", altitude: 75 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
CROSS = """
imports: [lib/flying.yaml]
params: {robot: {type: agent, of: [lwd]}, to: position}
agents: {drone: {type: lwd, id: "${robot}"}}
steps:
  - do: drone.TakeOff
    with: {altitude: 75 m}
  - do: drone.GoTo
    with: {to: "${to}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
MIDDLE = Position(150.0, 150.0, 75.0)


class Field(Bench):
    """lwd_1 explores the bog; `crosses` tells what becomes of a flight into it."""

    def __init__(self, *, from_the_ground: bool = False) -> None:
        site, catalogue = packaged_world()
        survey = SURVEY
        if from_the_ground:
            actions = {
                **catalogue.actions,
                "Explore": replace(catalogue.actions["Explore"], requires="", effect="airborne"),
            }
            catalogue = replace(catalogue, actions=actions)
            survey = SURVEY.replace("  - do: drone.TakeOff\n    with: {altitude: 75 m}\n", "")
        tasks = [task_of(survey, site, catalogue, "Survey"), task_of(CROSS, site, catalogue, "Cross")]
        super().__init__(site, catalogue, tasks)
        self.explorer, self.other = self.agent("lwd_1", "lwd"), self.agent("lwd_2", "lwd")
        self.home = self.site.ports[self.record("lwd_1").home].at
        self.survey = self.submit("Survey", {"robot": AgentRef("lwd_1"), "region": BOG})
        self.run_for(1)
        if not from_the_ground:
            self.explorer.succeed()
            self.run_for(1)
        assert self.explorer.goal.action == "Explore"

    def hear(self, **fields: Any) -> None:
        self.explorer.say(**fields)
        self.run_for(1)

    def over_home(self, up_m: float) -> Position:
        return Position(self.home.east_m, self.home.north_m, up_m)

    def crosses(self) -> str:
        """Let lwd_2 rise and fly into the bog; tell what it does, or waits for."""
        self.submit("Cross", {"robot": AgentRef("lwd_2"), "to": MIDDLE})
        self.run_for(1)
        if self.other.side.active:
            self.other.succeed()
            self.run_for(1)
        (goal,) = [g for g in self.engine.state.goals.values() if g.agent == "lwd_2"]
        return f"waits: {goal.code} {goal.text}" if goal.code else goal.action


Make = Callable[..., Field]
CLOSED, FREE = "waits: leg_busy lwd_1", "GoTo"


@pytest.fixture
def make() -> Iterator[Make]:
    made: list[Field] = []

    def build(**options: Any) -> Field:
        made.append(Field(**options))
        return made[-1]

    yield build
    for field in made:
        field.close()


def test_a_lost_explorers_area_is_closed(make: Make) -> None:
    field = make()
    field.explorer.silent = True
    field.run_for(60)
    assert field.record("lwd_1").pool == "QUARANTINED"
    assert field.crosses() == CLOSED


def test_one_that_was_lost_before_it_said_that_it_flies_keeps_its_area_and_raises_the_alarm(make: Make) -> None:
    field = make(from_the_ground=True)
    field.explorer.silent = True
    field.run_for(60)
    assert field.record("lwd_1").landed == "grounded"
    assert field.crosses() == CLOSED
    assert "quarantined_airborne" in [alarm.code for alarm in effects(field, Alarm) if alarm.agent == "lwd_1"]


def test_one_that_is_heard_of_on_the_ground_frees_its_area(make: Make) -> None:
    field = make()
    field.explorer.silent = True
    field.run_for(60)
    field.hear(landed="grounded", position=field.over_home(0.0))
    assert (field.record("lwd_1").pool, field.record("lwd_1").lost_area) == ("STANDBY", None)
    assert field.crosses() == FREE


def test_an_abandoned_one_that_stood_and_is_flown_away_by_its_pilot_does_not_close_the_area_again(make: Make) -> None:
    field = make()
    field.ask(Abort(field.survey, how="abandon"))
    field.run_for(1)
    assert field.record("lwd_1").lost_area is not None

    field.hear(position=field.over_home(40.0))
    field.hear(landed="grounded", position=field.over_home(0.0))
    field.explorer.side.take_control("pilot")
    field.hear(landed="airborne", position=field.over_home(10.0))

    assert field.record("lwd_1").pool == "QUARANTINED"
    assert field.crosses() == FREE


@pytest.mark.parametrize("anew", [False, True])
def test_one_that_is_heard_of_in_the_air_hovers_where_it_says(make: Make, anew: bool) -> None:
    field = make()
    field.explorer.silent = True
    field.run_for(60)
    field.ask(LockdownOrder("hold"))  # no way home is flown, which would free the area by itself
    field.explorer.silent = False
    if anew:
        field.explorer.kill()
        field.explorer.boot()
    field.run_for(3)
    assert (field.record("lwd_1").landed, field.record("lwd_1").quarantine) == ("airborne", "")
    assert field.record("lwd_1").lost_area is None


def test_one_whose_process_starts_anew_before_it_was_lost_does_too(make: Make) -> None:
    field = make()
    field.ask(LockdownOrder("hold"))
    field.explorer.takes_cancel = False
    field.explorer.kill()
    field.explorer.boot()
    field.run_for(3)
    assert field.record("lwd_1").lost_area is None


@pytest.mark.parametrize(("silent", "alarm"), [(False, "cancel_unconfirmed"), (True, "quarantined_airborne")])
def test_a_start_that_never_confirmed_that_it_stopped_may_be_up_only_if_it_does_not_say_that_it_stands(
    make: Make, silent: bool, alarm: str
) -> None:
    field = make(from_the_ground=True)
    field.abort(field.survey)  # it would be in the way
    field.run_for(1)
    task = field.submit("Cross", {"robot": AgentRef("lwd_2"), "to": MIDDLE})
    field.run_for(1)
    field.other.confirms_cancel = False
    field.abort(task)
    field.run_for(5)
    field.other.silent = silent
    field.run_for(27)

    assert field.record("lwd_2").quarantine == "cancel_unconfirmed"
    assert (field.record("lwd_2").lost_leg is not None) is silent
    assert [one.code for one in effects(field, Alarm) if one.agent == "lwd_2"] == [alarm]
