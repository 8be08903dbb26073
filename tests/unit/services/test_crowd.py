"""Who gives way at a full door, and what is kept for stops."""

import pytest

from formiga_bt.services.http.crowd import AT_ONCE, LANE, Crowd, DoorLimits, http_places, local_places


def crowd(connections: int = 3, requests: int = 2, streams: int = 1) -> Crowd[str]:
    return Crowd(DoorLimits(connections, requests, streams))


def test_who_has_waited_longest_gives_way() -> None:
    door = crowd()
    assert [door.come(name) for name in "abc"] == [None, None, None]
    door.busy("a")
    assert door.come("d") == "b"
    assert door.come("e") == "c"
    assert len(door) == 3


def test_a_client_that_does_not_read_gives_way_when_nobody_waits() -> None:
    door = crowd()
    for name in "abc":
        door.come(name)
        door.busy(name)
    door.stuck("b", is_stuck=True)
    door.stuck("c", is_stuck=True)
    door.stuck("b", is_stuck=False)
    assert door.come("d") == "c"


def test_nobody_gives_way_who_is_busy() -> None:
    door = crowd()
    for name in "abc":
        door.come(name)
        door.busy(name)
    assert door.come("d") == "d"
    door.leave("a")
    assert door.come("d") is None


def test_one_that_was_closed_has_no_place() -> None:
    door = crowd()
    door.come("a")
    door.leave("a")
    door.leave("a")
    door.wait("a")
    door.stuck("a", is_stuck=True)
    assert len(door) == 0
    assert [door.come(name) for name in "bcd"] == [None, None, None]
    assert door.come("e") == "b"


def test_urgent_requests_are_not_counted() -> None:
    door = crowd()
    assert [door.begin(urgent=False) for _ in range(3)] == ["", "", "crowded"]
    assert [door.begin(urgent=True) for _ in range(5)] == [""] * 5
    door.end(urgent=False)
    assert door.begin(urgent=False) == ""


def test_streams_are_counted_apart() -> None:
    door = crowd()
    assert door.begin(urgent=False, stream=True) == ""
    assert door.begin(urgent=False, stream=True) == "too_many_streams"
    assert door.begin(urgent=False) == ""
    door.end(urgent=False, stream=True)
    assert door.begin(urgent=False, stream=True) == ""


@pytest.mark.parametrize("limit", [64, 128, 256, 1024, 20_000])
def test_doors_leave_most_descriptors_to_the_rest(limit: int) -> None:
    http, local = http_places(limit), local_places(limit)
    for places in (http, local):
        assert places.connections - places.requests >= LANE >= 4 * AT_ONCE
        assert 0 < places.streams < places.requests
    assert http.connections + local.connections <= max(limit // 2, 64)
