"""Wind, load and climb cost what the engine's estimate says they cost; checks, drift, and motors that are cut."""

import pytest

from agents_sim.faults import Order
from agents_sim.limits import DroneLimits
from agents_sim.motion import ground_speed
from agents_sim.world import AgentSpec
from formiga_bt.base.energy import power_of, way_pct
from formiga_bt.base.geo import Place, Position
from formiga_bt.transport.messages import AgentSeen
from tests.golden import Wording
from tests.unit.agents_sim.conftest import World, point

HOVERS = Position(0.0, 0.0, 60.0)


def add(world: World, **fields: object) -> None:
    world.fleet.add(AgentSpec(**{"id": "d", "type": "hwd", "at": HOVERS, **fields}))


@pytest.mark.parametrize(
    ("to", "wind", "speed"),
    [
        ((300, 0), (0.0, 0.0), 10.0),
        ((300, 0), (3.0, 0.0), 13.0),  # from behind
        ((-300, 0), (3.0, 0.0), 7.0),  # against it
        ((0, 300), (6.0, 0.0), 8.0),  # across: the nose into the wind
        ((0, 300), (12.0, 0.0), 0.5),  # it cannot hold its track: it creeps
        ((-300, 0), (10.0, 0.0), 0.5),
    ],
)
def test_wind_changes_the_speed_over_ground(to: tuple[int, int], wind: tuple[float, float], speed: float) -> None:
    assert ground_speed(Place(0.0, 0.0), Place(*map(float, to)), 10.0, wind) == pytest.approx(speed)


def test_a_leg_against_the_wind_takes_longer_and_a_climb_does_not(world: World) -> None:
    add(world, wind=(3.0, 0.0))
    leg = world.order("d", "GoTo", to=point(-70, 0, 60))
    world.run(20.0)
    up = world.order("d", "GoTo", to=point(-70, 0, 90))
    world.run(20.0)
    assert (world.end(leg)[0], world.end(up)[0]) == (10.0, 30.0)


def test_a_speed_that_was_asked_for_is_over_ground(world: World) -> None:
    add(world, wind=(3.0, 0.0))
    leg = world.order("d", "GoTo", to=point(-50, 0, 60), speed=5.0)
    world.run(20.0)
    assert world.end(leg)[0] == 10.0


def test_wind_that_changes_on_the_way_counts_for_the_rest_of_it(world: World) -> None:
    add(world)
    leg = world.order("d", "GoTo", to=point(100, 0, 60))
    world.run(5.0)
    world.fleet.order("d", Order(kind="wind", east=-5.0))
    world.run(20.0)
    assert world.end(leg)[0] == 15.0
    status = world.statuses("d")[-1]
    assert (status.wind_east_m_s, status.wind_north_m_s) == (-5.0, 0.0)


@pytest.mark.parametrize(
    ("to", "wind", "payload_kg"),
    [
        ((200, 0, 60), (0.0, 0.0), 0.0),
        ((200, 0, 90), (-3.0, 2.0), 1.5),
        ((0, 0, 90), (4.0, 4.0), 2.0),
        ((-90, 50, 30), (0.0, -2.0), 0.5),
    ],
)
def test_a_leg_costs_what_the_engine_expects(
    world: World, to: tuple[int, int, int], wind: tuple[float, float], payload_kg: float
) -> None:
    limits = {"climb_drain_pct_s": 0.1, "payload_drain_pct_kg_s": 0.02}
    add(world, wind=wind, payload_kg=payload_kg, limits=limits, battery=90.0)
    world.run(0)
    card = next(event.card for _, event in world.heard if isinstance(event, AgentSeen))
    world.order("d", "GoTo", goal_id="leg", to=point(*to))
    world.run(100.0)
    power = power_of({}, card.limits)
    assert power is not None
    status = world.end("leg")[1].status
    assert status is not None
    expected = way_pct(HOVERS, Position(*map(float, to)), power, wind, payload_kg)
    spent = 90.0 - status.battery
    assert spent <= expected + 0.001  # a tail wind is not counted on
    if wind == (0.0, 0.0) or to[0] > 0:
        assert spent == pytest.approx(expected, abs=0.001)
    assert status.payload_kg == payload_kg


def test_the_card_tells_what_climbing_costs_also_if_it_costs_no_more() -> None:
    assert DroneLimits().on_card()["climb_drain_pct_s"] == DroneLimits().cruise_drain_pct_s


def test_a_charge_that_breaks_away(world: World) -> None:
    add(world, limits={"hover_drain_pct_s": 0.1})
    world.fleet.order("d", Order(kind="battery", percent=30.0))
    assert world.fleet["d"].drone.battery() == 30.0
    world.run(10.0)
    assert world.fleet["d"].drone.battery() == 29.0
    world.run(240.0 + 20.0)
    assert world.fleet["d"].drone.landed() == "grounded"  # its own failsafe reckons with the new charge


def test_checks_are_told_on_the_ground_and_one_can_be_broken(world: World, wording: Wording) -> None:
    world.fleet.add(AgentSpec(id="d", type="hwd", at=Place(0.0, 20.0), home=Place(0.0, 20.0), battery=87.4))
    world.run(0)
    checks = world.statuses("d")[-1].checks
    assert [check.check for check in checks] == ["armable", "home", "gnss", "control", "storage", "battery"]
    assert all(check.ok for check in checks)
    assert {check.check: check.text for check in checks if check.text} == {"home": "0 E 20 N", "battery": "87 %"}

    world.fleet.order("d", Order(kind="preflight", check="gnss", text="3 satellites"))
    world.run(0)
    bad = [check for check in world.statuses("d")[-1].checks if not check.ok]
    assert [(check.check, check.text) for check in bad] == [("gnss", "3 satellites")]

    world.fleet.order("d", Order(kind="preflight", check="gnss", on=False))
    world.fleet.take_over("d")
    world.run(0)
    bad = [check for check in world.statuses("d")[-1].checks if not check.ok]
    assert [check.check for check in bad] == ["control"]
    wording([check.text for check in bad])


def test_checks_are_not_told_in_the_air(world: World) -> None:
    add(world)
    world.run(0)
    assert world.statuses("d")[-1].checks == ()


def test_a_fix_that_drifts_is_only_told(world: World) -> None:
    add(world)
    world.fleet.order("d", Order(kind="drift", east=3.0, north=-1.0))
    world.run(0)
    assert world.statuses("d")[-1].position == Position(3.0, -1.0, 60.0)
    assert world.fleet["d"].drone.position() == HOVERS
    world.fleet.order("d", Order(kind="drift", on=False))
    world.run(0)
    assert world.statuses("d")[-1].position == HOVERS


def test_cut_motors_is_announced_only_if_the_spec_says_so(world: World) -> None:
    add(world)
    refused = world.order("d", "CutMotors")
    assert world.end(refused)[1].code == "unknown_action"


@pytest.mark.parametrize(("up_m", "lasts_s"), [(60.0, 2.0), (4.905, 1.0)])
def test_cut_motors_falls_to_the_ground(world: World, up_m: float, lasts_s: float) -> None:
    add(world, at=Position(10.0, 0.0, up_m), cut=True)
    leg = world.order("d", "GoTo", to=point(10, 0, up_m))
    world.run(0)
    cut = world.order("d", "CutMotors")
    world.run(3.0)
    at, event = world.end(cut)
    assert (at, event.state) == (pytest.approx(lasts_s, abs=0.01), "succeeded")
    assert event.status is not None
    assert (event.status.landed, event.status.control) == ("grounded", "engine")
    assert event.status.position == Position(10.0, 0.0, 0.0)
    assert world.end(leg)[1].state == "succeeded"
    assert world.referee.verdict(world.clock.now()).is_clean


def test_nothing_breaks_off_a_fall(world: World) -> None:
    add(world, cut=True)
    cut = world.order("d", "CutMotors")
    world.run(0.5)
    world.hub.transport.cancel_goal("d", cut)
    world.run(3.0)
    assert any(event.cancel_refused for event in world.events(cut))
    assert world.end(cut)[1].state == "succeeded"
    assert world.fleet["d"].drone.landed() == "grounded"


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"payload_kg": -1.0}, "payload_kg of d must be 0 or more, got -1.0"),
        ({"wind": (float("nan"), 0.0)}, r"wind of d must be two finite numbers in m/s, got \(nan, 0.0\)"),
        ({"on_link_loss": "panic"}, "on_link_loss of d must be return, land or hold, got 'panic'"),
    ],
)
def test_a_wrong_spec_is_refused(world: World, fields: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        add(world, **fields)
