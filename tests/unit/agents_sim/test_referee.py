"""The referee finds what happens between two samples, counts it once, and judges rotor starts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents_sim.motion import Segment, closest_approach
from agents_sim.referee import Referee
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, distance_m
from formiga_bt.transport.messages import Clearance
from tests.unit.agents_sim.conftest import World, point


def segment(t0_s: float, p0: tuple[float, float, float], t1_s: float, p1: tuple[float, float, float]) -> Segment:
    return Segment(round(t0_s * SECOND), Position(*p0), round(t1_s * SECOND), Position(*p1))


def test_a_crash_in_the_middle_of_two_legs_is_found() -> None:
    referee = Referee()
    referee.moved("a", segment(0, (0, 0, 60), 10, (100, 0, 60)), "cruise")
    referee.moved("b", segment(0, (100, 1, 60), 10, (0, 1, 60)), "cruise")
    verdict = referee.verdict(10 * SECOND)
    assert [(c.a, c.b, c.at, c.distance_m) for c in verdict.crashes] == [("a", "b", 5 * SECOND, 1.0)]
    assert verdict.closest_pass is not None
    assert verdict.closest_pass.distance_m == 1.0


def test_the_same_crossing_at_other_times_is_none() -> None:
    referee = Referee()
    referee.moved("a", segment(0, (0, 0, 60), 10, (100, 0, 60)), "cruise")
    referee.moved("b", segment(0, (50, -100, 60), 10, (50, -50, 60)), "cruise")
    referee.moved("b", segment(10, (50, -50, 60), 20, (50, 50, 60)), "cruise")
    verdict = referee.verdict(20 * SECOND)
    assert verdict.is_clean
    assert verdict.closest_pass is not None
    assert verdict.closest_pass.distance_m == 50.0  # b is over a's way when a is at its end


def test_the_closest_cruise_pass_is_of_two_neither_of_which_takes_off_or_lands() -> None:
    referee = Referee()
    referee.moved("a", segment(0, (0, 0, 60), 10, (100, 0, 60)), "cruise")
    referee.moved("b", segment(0, (50, 8, 30), 10, (50, 8, 90)), "climb")
    referee.moved("c", segment(0, (0, 40, 60), 10, (100, 40, 60)), "cruise")

    verdict = referee.verdict(10 * SECOND)
    assert verdict.closest_pass is not None
    assert verdict.closest_cruise is not None
    assert (verdict.closest_pass.b, verdict.closest_pass.distance_m) == ("b", 8.0)
    assert (verdict.closest_cruise.b, verdict.closest_cruise.distance_m) == ("c", 40.0)

    # it may come nearer later, though not as near as the climb was
    referee.moved("c", segment(10, (100, 40, 60), 20, (100, 40, 60)), "hover")
    referee.moved("a", segment(10, (100, 0, 60), 20, (100, 20, 60)), "cruise")
    later = referee.verdict(20 * SECOND)
    assert later.closest_pass == verdict.closest_pass
    assert later.closest_cruise is not None
    assert (later.closest_cruise.at, later.closest_cruise.distance_m) == (20 * SECOND, 20.0)


@pytest.mark.parametrize("asked_s", [(20,), (2, 4, 5, 6, 8, 20), tuple(range(21))])
def test_each_crash_counts_once_however_often_one_asks(asked_s: tuple[int, ...]) -> None:
    """Two passes, the first over two legs: two crashes."""
    referee = Referee()
    referee.moved("b", segment(0, (50, 0, 60), 0, (50, 0, 60)), "hover")
    referee.moved("a", segment(0, (0, 0, 60), 5, (50, 0, 60)), "cruise")
    for at_s in asked_s:
        if at_s >= 5:
            break
        referee.verdict(at_s * SECOND)
    referee.moved("a", segment(5, (50, 0, 60), 10, (100, 0, 60)), "cruise")
    for at_s in asked_s:
        if at_s < 10:
            referee.verdict(at_s * SECOND)
    referee.moved("a", segment(10, (100, 0, 60), 20, (0, 0, 60)), "cruise")
    verdict = [referee.verdict(at_s * SECOND) for at_s in asked_s if at_s >= 10][-1]
    assert [(crash.at, crash.distance_m) for crash in verdict.crashes] == [(5 * SECOND, 0.0), (15 * SECOND, 0.0)]


def test_drones_side_by_side_on_the_ground_are_no_crash_until_one_flies() -> None:
    referee = Referee()
    referee.moved("a", segment(0, (0, 0, 0), 0, (0, 0, 0)), "rest")
    referee.moved("b", segment(0, (1, 0, 0), 0, (1, 0, 0)), "rest")
    assert referee.verdict(10 * SECOND).is_clean
    referee.moved("a", segment(10, (0, 0, 0), 20, (0, 0, 30)), "climb")
    assert len(referee.verdict(20 * SECOND).crashes) == 1
    assert referee.verdict(20 * SECOND).closest_pass is None  # of two that fly


@pytest.mark.parametrize(
    ("person_m", "given_s", "unsafe"),
    [(4.9, None, True), (5.0, None, False), (4.9, 30, False), (4.9, 61, True), (4.9, -1, False), (4.9, -3, True)],
)
def test_rotors_near_a_person_need_a_fresh_clearance(
    world: World, person_m: float, given_s: int | None, unsafe: bool
) -> None:
    world.fleet.add(AgentSpec(id="p", type="picker", at=Place(person_m, 0.0)))
    world.fleet.add(AgentSpec(id="d", type="lwd"))
    clearance = None if given_s is None else Clearance("p", world.clock.now() - given_s * SECOND)
    world.order("d", "TakeOff", clearance=clearance, altitude=30.0)
    starts = world.referee.verdict(world.clock.now()).unsafe_starts
    assert [(start.agent, start.person, start.distance_m) for start in starts] == (
        [("d", "p", person_m)] if unsafe else []
    )


def test_two_drones_of_a_fleet_that_cross_are_judged(world: World) -> None:
    world.fleet.add(AgentSpec(id="a", type="hwd", at=Position(0.0, 0.0, 60.0)))
    world.fleet.add(AgentSpec(id="b", type="hwd", at=Position(100.0, 0.0, 61.0)))
    world.order("a", "GoTo", to=point(100, 0, 60))
    world.order("b", "GoTo", to=point(0, 0, 61))
    world.run(20.0)
    verdict = world.referee.verdict(world.clock.now())
    assert [crash.distance_m for crash in verdict.crashes] == [1.0]
    assert not verdict.low_flights


coordinate = st.integers(-200, 200).map(float)
points = st.builds(Position, coordinate, coordinate, coordinate)
segments = st.builds(
    lambda t0, p0, lasts, p1: Segment(t0, p0, t0 + lasts, p1),
    st.integers(0, 20 * SECOND),
    points,
    st.integers(1, 20 * SECOND),
    points,
)


@given(segments, segments, st.integers(0, 40 * SECOND), st.integers(0, 40 * SECOND))
def test_the_closest_approach_is_symmetric_and_below_every_sample(a: Segment, b: Segment, t: int, u: int) -> None:
    since, until = min(t, u), max(t, u)
    found = closest_approach(a, b, since, until)
    assert closest_approach(b, a, since, until).distance_m == found.distance_m
    assert since <= found.at <= until
    # Its instant is known to a microsecond, in which nothing here moves farther than its own way.
    at_best = distance_m(a.at(found.at), b.at(found.at))
    speed = sum(distance_m(s.p0, s.p1) / (s.t1 - s.t0) for s in (a, b))
    assert found.distance_m - 1e-6 <= at_best <= found.distance_m + speed + 1e-6
    for index in range(21):
        at = since + (until - since) * index // 20
        assert found.distance_m <= distance_m(a.at(at), b.at(at)) + 1e-6
