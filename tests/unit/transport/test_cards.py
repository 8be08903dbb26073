"""Cards of wire 2: what cannot be read costs that part of the card, and not the agent."""

from typing import Any

import msgspec
import pytest

from formiga_bt.lang.params import SIMPLE
from formiga_bt.transport.cards import UNITS, WIRE
from formiga_bt.transport.codec import WireError, decode_card

PLACE = {"type": "place"}


def card(**fields: Any) -> dict[str, Any]:
    return {"id": "r1", "type": "rover", "boot_id": "b", "wire": WIRE, "actions": [], **fields}


def read(**fields: Any) -> Any:
    return decode_card(msgspec.json.encode(card(**fields)))


def test_the_types_of_a_card_are_those_of_the_language() -> None:
    assert set(UNITS) == {*SIMPLE, "enum"} - {"any"}


def test_an_action_may_stand_by_its_name_alone() -> None:
    assert read(actions=["Go", {"name": "Look", "fields": {"at": PLACE}}]).names == ("Go", "Look")


@pytest.mark.parametrize(
    ("action", "says"),
    [
        ({"name": "Bad", "fields": {"at": {"type": "spot"}}}, "spot"),
        ({"name": "Bad", "fields": {"at": {"type": "distance", "unit": "km"}}}, "km"),
        ({"name": "Bad", "fields": {"at": {"type": "enum"}}}, "values"),
        ({"name": "Bad", "fields": {"at": "place"}}, "object"),
        ({"name": "Bad", "result": {"at": {"type": "list of list of spot"}}}, "spot"),
        ({"name": "Bad", "typical_s": -1}, "time"),
        ({"name": "Bad", "fields": {"at": PLACE}, "moves_to": "there"}, "there"),
        ({"name": "Bad", "lands": "perhaps"}, "lands"),
        ({"name": "../x"}, "name"),
        ({}, "name"),
        (7, "name"),
    ],
)
def test_what_cannot_be_read_refuses_that_action_and_not_the_agent(action: Any, says: str) -> None:
    found = read(actions=["Go", action, "Look"])
    assert found.names == ("Go", "Look")
    (fault,) = found.faults.values()
    assert says in fault


def test_an_action_that_is_announced_twice_is_refused_once() -> None:
    found = read(actions=["Go", {"name": "Go", "lands": True}])
    assert (found.names, list(found.faults)) == (("Go",), ["Go"])


def test_fields_and_events_are_read_one_by_one() -> None:
    found = read(
        fields={"open": {"type": "bool"}, "odd": {"type": "?"}}, events={"sos": {}, "bad": {"x": {"type": "?"}}}
    )
    assert (list(found.fields), list(found.events)) == (["open"], ["sos"])
    assert set(found.faults) == {"field odd", "event bad"}


@pytest.mark.parametrize("version", [1, 3, None])
def test_a_card_of_another_version_is_kept_as_that_and_without_actions(version: int | None) -> None:
    given = card(actions=["Go"], wire=version, mobility="swims")
    if version is None:
        del given["wire"]
    found = decode_card(msgspec.json.encode(given))
    assert (found.wire, found.actions) == (version or 1, ())


@pytest.mark.parametrize("wrong", [{"id": 7}, {"actions": "Go"}, {"mobility": "swims"}, {"limits": {"x": "much"}}])
def test_a_card_that_is_none_is_a_bad_message(wrong: Any) -> None:
    with pytest.raises(WireError):
        read(**wrong)


def test_an_agent_cannot_say_its_own_faults() -> None:
    assert read(faults={"Go": "no"}).faults == {}


def test_a_card_of_any_size_is_read_in_bounds() -> None:
    found = read(actions=[f"A{n}" for n in range(500)])
    assert len(found.names) == 200
    assert len(found.faults) == 300
