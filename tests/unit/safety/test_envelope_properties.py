"""What holds for every flight: tighter limits refuse no less, a rescue is never a matter of charge, nothing raises."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.envelope import GateFlight, at_gate, in_flight, ways_of
from formiga_bt.safety.rules import Rules
from tests.unit.safety.grounds import HOME, POWER, RULES, airspace, hilly, state

GROUNDS = (airspace(), hilly(2.0), airspace(fence=None, no_fly=(), relief_m=4.0))
FIELD = Region((Place(-300, 100), Place(-100, 100), Place(-100, 300), Place(-300, 300)))

metres = st.integers(-600, 600).map(float)
heights = st.integers(0, 140).map(float)
positions = st.builds(Position, metres, metres, heights)
grounds = st.sampled_from(GROUNDS)
winds = st.none() | st.tuples(st.floats(-12, 12), st.floats(-12, 12))
rules_ = st.builds(
    Rules,
    reserve_pct=st.floats(10, 60),
    max_height_m=st.floats(30, 130),
    terrain_clearance_m=st.floats(1, 20),
    wind_max_m_s=st.floats(2, 15),
    daylight_only=st.booleans(),
    keep_in=st.just(True),
    keep_out=st.just(True),
)


@st.composite
def flights(draw: st.DrawFn, *, rescue: bool = False) -> GateFlight:
    here = draw(st.none() | positions)
    to = draw(st.none() | positions | st.builds(Place, metres, metres))
    ground = draw(grounds)
    return GateFlight(
        agent="hwd_1",
        here=here,
        ways=ways_of(here, to, ground),
        region=draw(st.none() | st.just(FIELD)),
        lands_at=to if isinstance(to, Place) else None,
        grounded=draw(st.booleans()),
        hover_s=draw(st.floats(0, 300)),
        battery=draw(st.none() | st.floats(0, 100)),
        payload_kg=draw(st.floats(0, 5)),
        wind=draw(winds),
        power=draw(st.none() | st.just(POWER)),
        home=draw(st.none() | st.just(HOME)),
        layer_m=draw(st.none() | heights),
        sun_up=draw(st.none() | st.booleans()),
        rescue=rescue,
    )


@settings(derandomize=True, deadline=None, max_examples=150)
@given(flights(), grounds, rules_, rules_)
def test_tighter_limits_never_let_a_refused_goal_pass(
    flight: GateFlight, ground: Airspace, one: Rules, other: Rules
) -> None:
    tight = structs.replace(
        one,
        reserve_pct=max(one.reserve_pct, other.reserve_pct),
        max_height_m=min(one.max_height_m, other.max_height_m),
        terrain_clearance_m=max(one.terrain_clearance_m, other.terrain_clearance_m),
        wind_max_m_s=min(one.wind_max_m_s, other.wind_max_m_s),
        daylight_only=one.daylight_only or other.daylight_only,
    )

    if at_gate(flight, ground, one) is not None:
        assert at_gate(flight, ground, tight) is not None


@settings(derandomize=True, deadline=None, max_examples=150)
@given(flights(rescue=True), grounds, rules_)
def test_a_rescue_is_never_refused_for_charge_wind_or_light(flight: GateFlight, ground: Airspace, rules: Rules) -> None:
    breach = at_gate(flight, ground, rules)

    assert breach is None or breach.name in ("keep_in", "keep_out", "terrain_clearance", "max_height")
    if breach is not None:  # and more charge, calm and light would not have helped
        better = structs.replace(flight, battery=100.0, wind=(0.0, 0.0), sun_up=True)
        assert at_gate(better, ground, rules) == breach


@settings(derandomize=True, deadline=None, max_examples=150)
@given(flights(), grounds, rules_)
def test_what_a_task_may_do_a_rescue_may_do(flight: GateFlight, ground: Airspace, rules: Rules) -> None:
    if at_gate(flight, ground, rules) is None:
        assert at_gate(structs.replace(flight, rescue=True), ground, rules) is None


@settings(derandomize=True, deadline=None, max_examples=150)
@given(positions, st.floats(0, 1), grounds)
def test_a_way_that_passed_is_legal_all_along(to: Position, share: float, ground: Airspace) -> None:
    """A machine that flies what the gate let go is told of no zone and no height on its way."""
    here = Position(0, 0, 60)
    flight = GateFlight(agent="hwd_1", here=here, ways=ways_of(here, to, ground), home=HOME)
    if at_gate(flight, ground, RULES) is not None:
        return
    now = Position(*(a + share * (b - a) for a, b in ((0, to.east_m), (0, to.north_m), (60, to.up_m))))

    assert in_flight(state(now, power=None), ground, RULES) == ()


odd = st.sampled_from([math.nan, math.inf, -math.inf, -1.0, 0.0, 1e12])


@settings(derandomize=True, deadline=None, max_examples=150)
@given(odd, odd, odd, odd, st.booleans(), grounds)
def test_odd_numbers_never_raise(a: float, b: float, c: float, d: float, rescue: bool, ground: Airspace) -> None:
    here, to = Position(a, b, c), Position(d, a, b)
    flight = GateFlight(
        agent="hwd_1", here=here, ways=ways_of(here, to, ground), battery=c, payload_kg=d, wind=(a, b), hover_s=c,
        power=POWER, home=HOME, layer_m=d, speed_m_s=a, rescue=rescue, lands_at=Place(b, c),
    )  # fmt: skip

    at_gate(flight, ground, RULES)
    in_flight(state(here, battery=c, payload_kg=d, wind=(a, b), layer_m=d, lands_at=Place(b, c)), ground, RULES)
    if not math.isfinite(a) and not rescue:
        assert at_gate(flight, ground, RULES) is not None
