"""The policies on their own: teams of least cost, reservation, charge, what no agent could ever serve. Pure functions."""

import math
from itertools import permutations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from formiga_bt.base.energy import power_of
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.energy import Charge
from formiga_bt.engine.allocator.filters import hopeless
from formiga_bt.engine.allocator.policy import closest, closest_charged
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest
from tests.golden import Wording


def drone(name: str, east_m: float, **fields: Any) -> Candidate:
    values: dict[str, Any] = {
        "id": name, "type": "lwd", "order": int(name[1:]), "shared": False, "mobility": "air",
        "actions": ("GoTo",), "refused": "",
        "pool": "STANDBY", "liveness": "ALIVE", "control": "engine", "task": "", "goal": "", "word": "STANDBY",
        "landed": "grounded", "at_port": True, "battery": 90.0, "position": Position(east_m, 0.0, 0.0),
    }  # fmt: skip
    return Candidate(**(values | fields))


def role(**fields: Any) -> RoleRequest:
    values: dict[str, Any] = {"role": "drone", "types": ("lwd",), "shared": False, "near": (Place(0.0, 0.0),)}
    return RoleRequest(**(values | fields))


def request(task: str, *roles: RoleRequest, order: int = 1, **fields: Any) -> AgentRequest:
    return AgentRequest(holder=task, priority="medium", order=order, at=0, roles=roles or (role(),), **fields)


def test_a_team_gets_the_assignment_of_least_total_distance() -> None:
    """Not each place its nearest: d1 is nearest to both, but only the pair (d1 to 100, d2 to 0) is short."""
    places = (Place(0.0, 0.0), Place(100.0, 0.0))
    agents = [drone("d1", 45.0), drone("d2", -10.0), drone("d3", 500.0)]

    decision = closest([request("T-1", role(near=places, count=2, is_list=True))], agents)

    assert decision.grants[0].roles == {"drone": ("d2", "d1")}


@given(st.data())
def test_of_all_teams_that_fit_it_is_the_one_of_least_cost(data: st.DataObject) -> None:
    """Beside trying all of them; some agents are of a type that only one of two roles takes."""
    easts = data.draw(st.lists(st.integers(-9, 9), min_size=1, max_size=6))
    kinds = data.draw(st.lists(st.sampled_from(["lwd", "ugv"]), min_size=len(easts), max_size=len(easts)))
    agents = [drone(f"d{n}", 100.0 * east, type=kinds[n - 1]) for n, east in enumerate(easts, 1)]
    near = tuple(Place(100.0 * east, 0.0) for east in data.draw(st.lists(st.integers(-9, 9), min_size=2, max_size=2)))
    roles = (role(near=near, count=2, is_list=True), role(role="other", types=("lwd", "ugv"), near=near[:1]))
    slots = [(0, near[0]), (0, near[1]), (1, near[0])]

    def cost(team: tuple[int, ...]) -> float:
        fits = all(kinds[one] in roles[which].types for one, (which, _) in zip(team, slots, strict=True))
        ways = (abs(100.0 * easts[one] - at.east_m) for one, (_, at) in zip(team, slots, strict=True))
        return sum(ways) if fits else math.inf

    best = min((cost(team) for team in permutations(range(len(agents)), 3)), default=math.inf)
    decision = closest([request("T-1", *roles)], agents)

    if best == math.inf:
        assert decision.grants == ()
    else:
        (granted,) = decision.grants
        team = tuple(int(name[1:]) - 1 for name in (*granted.roles["drone"], *granted.roles["other"]))
        assert len(set(team)) == 3
        assert cost(team) == pytest.approx(best)
        assert closest([request("T-1", *roles)], agents) == decision


def test_teams_of_equal_cost_are_of_the_agents_known_first() -> None:
    places = (Place(0.0, 0.0), Place(0.0, 0.0))

    decision = closest(
        [request("T-1", role(near=places, count=2, is_list=True))], [drone(f"d{n}", 9.0) for n in range(1, 6)]
    )

    assert decision.grants[0].roles == {"drone": ("d1", "d2")}


def test_equal_distances_go_to_the_agent_known_first() -> None:
    decision = closest([request("T-1")], [drone("d2", 10.0), drone("d1", -10.0)])

    assert decision.grants[0].roles == {"drone": ("d1",)}


def test_a_team_that_is_not_complete_gets_nobody_and_others_may_go_on() -> None:
    team = request("Team-1", role(count=2, is_list=True))

    decision = closest([team, request("One-2", order=2)], [drone("d1", 10.0)])

    assert [grant.task for grant in decision.grants] == ["One-2"]


def test_a_team_that_reserves_keeps_what_fits_from_later_requests() -> None:
    team = request("Team-1", role(count=2, is_list=True), reserves=True)

    decision = closest([team, request("One-2", order=2)], [drone("d1", 10.0)])

    assert decision.grants == ()
    assert [(v.code, v.detail) for v in decision.verdicts["One-2"]] == [("busy", "Team-1")]


def test_the_first_of_two_reserving_teams_is_served_when_it_is_complete() -> None:
    """Reservations are made anew at each look, so two teams never hold half each for ever."""
    first = request("Team-1", role(count=2, is_list=True), reserves=True)
    second = request("Team-2", role(count=2, is_list=True), order=2, reserves=True)

    decision = closest([first, second], [drone("d1", 10.0), drone("d2", 20.0)])

    assert [grant.task for grant in decision.grants] == ["Team-1"]


def test_hopeless_says_which_role_and_what_the_near_misses_lack(wording: Wording) -> None:
    wish = request("T-1", role(actions=("Winch",)))
    agents = [drone("d1", 0.0), drone("d2", 0.0, type="hwd")]

    reason = hopeless(wish, closest([wish], agents).verdicts["T-1"], Roster(agents).find)

    wording(reason)


def test_of_many_near_misses_a_few_are_named(wording: Wording) -> None:
    wish = request("T-1", role(actions=("Winch",)))
    agents = [drone(f"d{n}", 0.0) for n in range(1, 31)]

    reason = hopeless(wish, closest([wish], agents).verdicts["T-1"], Roster(agents).find)

    assert reason.count("no_action") == 3
    wording(reason)


def test_a_busy_or_empty_agent_is_no_reason_to_give_up() -> None:
    wish = request("T-1", role(battery_min=50.0))
    agents = [drone("d1", 0.0, task="Other-1"), drone("d2", 0.0, battery=3.0)]

    assert hopeless(wish, closest([wish], agents).verdicts["T-1"], Roster(agents).find) == ""


# -- charge --------------------------------------------------------------------------------------------------------------

DRAINS = {"speed_m_s": 8.0, "climb_m_s": 2.5, "cruise_drain_pct_s": 0.066, "hover_drain_pct_s": 0.058}


def charged(name: str, east_m: float, battery: float) -> Candidate:
    """Return a drone of which the charge is known, at home where it stands."""
    power = power_of(DRAINS)
    assert power is not None
    here, home = Position(east_m, 0.0, 0.0), Place(east_m, 0.0)
    charge = Charge(battery=battery, reserve=20.0, power=power, position=here, home=home, layer_m=40.0, lowest_m=40.0)
    return drone(name, east_m, battery=battery, charge=charge)


@pytest.mark.parametrize("near", [(), (Place(10.0, 0.0),)])
def test_one_with_little_charge_is_not_taken_before_full_ones(near: tuple[Place, ...]) -> None:
    agents = [charged("d1", 0.0, 27.0), *(charged(f"d{n}", 20.0 * n, 100.0) for n in range(2, 8))]

    decision = closest_charged([request("T-1", role(near=near))], agents)

    assert decision.grants[0].roles == {"drone": ("d2",)}
    assert closest([request("T-1", role(near=near))], agents).grants[0].roles == {"drone": ("d1",)}
    low = next(v for v in decision.verdicts["T-1"] if v.agent == "d1")
    assert low.short > 20
    assert "27 %" in low.detail


@pytest.mark.parametrize(
    ("metres", "fields", "is_hopeless"),
    [
        (6000.0, {}, True),
        (6000.0, {"task": "Other-1"}, True),  # also while it is busy: what it has does not matter
        (4000.0, {}, False),  # with a full battery it can
        (6000.0, {"charge": None}, False),  # nobody knows
    ],
)
def test_a_place_too_far_for_a_full_battery_is_hopeless_for_a_machine_that_begins_at_its_port(
    metres: float, fields: dict[str, Any], *, is_hopeless: bool
) -> None:
    agents = [replace(charged("d1", 0.0, 30.0), **fields)]
    for away in (False, True):
        wish = request("T-1", role(near=(Place(metres, 0.0),), away=away))
        reason = hopeless(wish, closest_charged([wish], agents).verdicts["T-1"], Roster(agents).find)
        assert bool(reason) is (is_hopeless and not away)
        assert "d1: too_far" in reason or not reason


def test_wind_and_another_machine_are_no_reason_to_give_up_and_one_of_two_too_far_is() -> None:
    far, near = charged("d1", 0.0, 100.0), charged("d2", 3000.0, 100.0)
    stormy = replace(near, charge=replace(near.charge, wind=(30.0, 0.0)))  # type: ignore[type-var]
    for count, agents in ((1, [far, stormy]), (2, [far, near])):
        wish = request("T-1", role(near=(Place(6000.0, 0.0),) * count, count=count, is_list=count > 1))
        reason = hopeless(wish, closest_charged([wish], agents).verdicts["T-1"], Roster(agents).find)
        assert ("this fleet has 1 that could ever serve" in reason) is (count == 2)


def test_of_those_with_charge_to_spare_the_closest_is_taken_however_full_another_is() -> None:
    agents = [charged("d1", 300.0, 100.0), charged("d2", 50.0, 75.0)]

    decision = closest_charged([request("T-1")], agents)

    assert decision.grants[0].roles == {"drone": ("d2",)}
    assert [v.short for v in decision.verdicts["T-1"]] == [0, 0]


def test_one_point_short_of_the_margin_counts_as_100_metres() -> None:
    """d1 stands at the place and is 9 points short: one 800 m away is better, one 1000 m away is not."""
    low = charged("d1", 0.0, 43.0)
    verdict = closest_charged([request("T-1")], [low]).verdicts["T-1"][0]
    assert (verdict.short, verdict.cost) == (9, 900.0)

    for metres, best in ((800.0, "d2"), (1000.0, "d1")):
        decision = closest_charged([request("T-1")], [low, charged("d2", metres, 100.0)])
        assert decision.grants[0].roles == {"drone": (best,)}


def test_the_preferred_one_is_taken_with_little_charge_too() -> None:
    agents = [charged("d1", 0.0, 27.0), charged("d2", 0.0, 100.0)]

    decision = closest_charged([request("T-1", role(near=(), prefer="d1"))], agents)

    assert decision.grants[0].roles == {"drone": ("d1",)}


def test_a_team_is_matched_by_way_and_charge() -> None:
    places = (Place(0.0, 0.0), Place(100.0, 0.0))
    agents = [charged("d1", 0.0, 30.0), charged("d2", 100.0, 100.0), charged("d3", 200.0, 100.0)]

    decision = closest_charged([request("T-1", role(near=places, count=2, is_list=True))], agents)

    assert decision.grants[0].roles == {"drone": ("d2", "d3")}
