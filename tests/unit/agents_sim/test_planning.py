"""A drone that is told to go elsewhere while it starts or lands first rises to where it may fly level."""

import pytest

from agents_sim.planning import LOWEST_HOVER_M, plan
from agents_sim.shipped import KINDS
from formiga_bt.base.geo import Position
from formiga_bt.transport.messages import GoalRequest

HWD = KINDS["hwd"].actions


@pytest.mark.parametrize(
    ("action", "fields"),
    [
        ("GoTo", {"to": {"east_m": 30.0, "north_m": 0.0, "up_m": 60.0}}),
        ("LandIn", {"at": {"east_m": 6.0, "north_m": 0.0}}),
    ],
)
@pytest.mark.parametrize(("up_m", "kinds"), [(0.1, "climb cruise"), (2.0, "cruise"), (40.0, "cruise")])
def test_below_the_lowest_hover_it_climbs_first(
    action: str, fields: dict[str, object], up_m: float, kinds: str
) -> None:
    request = GoalRequest(goal_id="g", agent="hwd_1", action=action, fields=fields)

    legs = plan(request, HWD[action], Position(0.0, 0.0, up_m), is_airborne=True, is_low=False, lasts_us=0)

    assert not isinstance(legs, str)
    assert [leg.kind for leg in legs if leg.kind != "descend"] == kinds.split()
    assert all(leg.to.up_m >= LOWEST_HOVER_M for leg in legs if leg.kind != "descend")


def test_a_landing_right_below_goes_straight_down() -> None:
    request = GoalRequest(goal_id="g", agent="hwd_1", action="LandIn", fields={"at": {"east_m": 0.0, "north_m": 0.0}})

    legs = plan(request, HWD["LandIn"], Position(0.0, 0.0, 0.5), is_airborne=True, is_low=False, lasts_us=0)

    assert not isinstance(legs, str)
    assert [leg.kind for leg in legs] == ["descend"]
