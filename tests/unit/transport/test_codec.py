"""What every wire refuses of the newer fields: half a wind, checks without a name, a silence that nobody can keep."""

import math

import pytest

from formiga_bt.transport.codec import CHECKS_LIMIT, WireError, check_request, check_status
from formiga_bt.transport.messages import AgentStatus, GoalRequest, PreflightCheck


def status(**fields: object) -> AgentStatus:
    return AgentStatus(**{"id": "a", "type": "lwd", **fields})


MANY = tuple(PreflightCheck(f"check_{i}", True) for i in range(CHECKS_LIMIT + 1))


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"wind_east_m_s": math.nan, "wind_north_m_s": 0.0}, "a status with a number that is not finite"),
        ({"wind_east_m_s": 1.0}, "a status with half a wind: east and north, or neither"),
        ({"checks": MANY}, "a status with preflight checks that are more than 32, nameless, or named twice"),
        ({"checks": (PreflightCheck("", True),)}, "nameless"),
        ({"checks": (PreflightCheck("gnss", True), PreflightCheck("gnss", False))}, "named twice"),
    ],
)
def test_a_bad_status_is_refused(fields: dict[str, object], says: str) -> None:
    with pytest.raises(WireError, match=says):
        check_status("a", status(**fields))


def test_a_good_one_passes() -> None:
    good = status(wind_east_m_s=-3.0, wind_north_m_s=0.0, checks=MANY[:CHECKS_LIMIT])
    assert check_status("a", good) is good


@pytest.mark.parametrize("silence_s", [0.0, -1.0, math.inf, math.nan])
def test_a_silence_that_cannot_be_kept_is_refused(silence_s: float) -> None:
    request = GoalRequest(goal_id="g", agent="a", action="Go", link_silence_s=silence_s)
    with pytest.raises(WireError, match=r"a goal with link_silence_s .*: seconds above 0, or null"):
        check_request(request)
