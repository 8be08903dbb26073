"""What every wire refuses of the newer fields: half a wind, checks without a name, a silence that nobody can keep.

And numbers that nothing here can reckon with: out of bounds, or too deep within each other.
"""

import json
import math
import sys

import pytest

from formiga_bt.base.bounds import ID_LIMIT, MOST, MOST_DEPTH, MOST_INT
from formiga_bt.base.geo import Position
from formiga_bt.transport.codec import (
    CHECKS_LIMIT,
    WireError,
    check_agent_event,
    check_card,
    check_event,
    check_request,
    check_status,
    decode,
)
from formiga_bt.transport.messages import AgentCard, AgentEvent, AgentStatus, GoalEvent, GoalRequest, PreflightCheck
from tests.golden import Wording


def status(**fields: object) -> AgentStatus:
    return AgentStatus(**{"id": "a", "type": "lwd", "boot_id": "b", "seq": 1, "stamp": 1, **fields})


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
def test_a_silence_that_cannot_be_kept_is_refused(silence_s: float, wording: Wording) -> None:
    request = GoalRequest(goal_id="g", agent="a", action="Go", link_silence_s=silence_s)
    with pytest.raises(WireError) as refused:
        check_request(request)
    wording(refused.value)


NO_FIX = sys.float_info.max
DEEP = b"[" * (MOST_DEPTH + 1) + b"]" * (MOST_DEPTH + 1)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"position": Position(NO_FIX, 0.0, 0.0)}, r"a status with a number beyond 1e\+07"),
        ({"initial_deployment": Position(0.0, 0.0, -NO_FIX)}, r"a status with a number beyond 1e\+07"),
        ({"payload_kg": 1e300}, r"a status with a number beyond 1e\+07"),
        ({"seq": 2**63}, r"a status with a whole number beyond 2\*\*61"),
        ({"stamp": -(10**26)}, r"a status with a whole number beyond 2\*\*61"),
        ({"boot_id": ""}, "a status without boot_id"),
        ({"beat": 10**26}, r"a status with a whole number beyond 2\*\*61"),
        ({"age_us": 10**26}, r"a status with a whole number beyond 2\*\*61"),
    ],
)
def test_a_status_with_numbers_out_of_bounds_is_refused(fields: dict[str, object], says: str) -> None:
    with pytest.raises(WireError, match=says):
        check_status("a", status(**fields))


@pytest.mark.parametrize("field", ["boot_id", "seq", "stamp"])
def test_a_status_that_cannot_be_told_from_old_news_is_refused(field: str, wording: Wording) -> None:
    raw = {"id": "a", "type": "lwd", "boot_id": "b", "seq": 1, "stamp": 1}
    del raw[field]
    with pytest.raises(WireError) as refused:
        decode(json.dumps(raw).encode(), AgentStatus)
    wording(refused.value)


def test_the_largest_numbers_pass() -> None:
    good = status(position=Position(MOST, -MOST, 0.0), seq=MOST_INT, stamp=-MOST_INT)
    assert check_status("a", good) is good


@pytest.mark.parametrize(
    ("rest", "says"),
    [
        (b'"n": 99999999999999999999999999', r"an event with a whole number beyond 2\*\*61"),
        (b'"result": {"x": 99999999999999999999999999}', r"an event whose result holds a whole number beyond 2\*\*61"),
        (b'"result": {"x": ' + DEEP + b"}", "an event whose result holds values more than 32 deep"),
        (
            b'"status": {"id": "a", "type": "lwd", "boot_id": "b", "stamp": 1, "seq": 99999999999999999999999999}',
            "a status with a whole number",
        ),
    ],
)
def test_an_event_with_numbers_out_of_bounds_is_refused(rest: bytes, says: str) -> None:
    event = decode(b'{"goal_id": "g", "agent": "a", "state": "running", ' + rest + b"}", GoalEvent)
    with pytest.raises(WireError, match=says):
        check_event("a", event)


def test_a_goal_id_that_is_too_long_is_refused(wording: Wording) -> None:
    longest = GoalEvent(goal_id="9" * ID_LIMIT, agent="a", state="unknown")
    assert check_event("a", longest) is longest
    with pytest.raises(WireError) as refused:
        check_event("a", GoalEvent(goal_id="\u0663" * 2049, agent="a", state="unknown"))
    wording(refused.value)


def test_an_agents_own_event_and_its_card_have_bounds_too(wording: Wording) -> None:
    good = {"agent": "a", "event": "sos", "boot_id": "b", "n": 1}
    with pytest.raises(WireError) as refused:
        check_agent_event("a", AgentEvent(**{**good, "stamp": 10**26}))
    wording(refused.value)
    with pytest.raises(WireError) as refused:
        check_agent_event("a", AgentEvent(**good, fields={"at": [{"x": 10**26}]}))
    wording(refused.value)
    with pytest.raises(WireError) as refused:
        check_card("a", AgentCard(id="a", type="lwd", boot_id="b", actions=(), limits={"speed_m_s": 1e300}))
    wording(refused.value)
