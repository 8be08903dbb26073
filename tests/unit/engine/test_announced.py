"""Cards against the catalogue, versions of the wire, and fields that a type's statuses say besides."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.operator.agents import _row
from formiga_bt.engine.agents.announced import contradiction, refusals
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import Catalogue
from formiga_bt.rehearsal.testing import Bench, effects, packaged_world, task_of
from formiga_bt.show.history.records import agent_fact
from formiga_bt.transport.messages import AgentCard, AgentError, CardAction, CardField

SITE, BASE = packaged_world()
OWN = """
types:
  door:
    mobility: fixed
    shared: true
    actions: [Open]
    fields: {open: bool, angle: number, mode: {type: enum, values: [day, night]}}
  gate: {extends: door, fields: {locked: bool}}
  oven: {mobility: none, shared: true, label: oven, fields: {angle: text, heat: number}}
actions:
  Open:
    fields:
      how: {type: enum, values: [slow, fast]}
      far: {type: distance, default: 1 m}
      by: {type: place, optional: true}
    result: {wide: distance}
    effect: {}
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Catalogue:
    file = tmp_path_factory.mktemp("own") / "own.yaml"
    file.write_text(OWN)
    catalogue, problems, _ = load_catalogue([file])
    assert problems == []
    return catalogue


HOW = CardField(type="enum", values=("slow", "fast"))
WIDE = {"wide": CardField(type="distance")}


@pytest.mark.parametrize(
    ("card", "says"),
    [
        (CardAction(name="Open"), ""),
        (CardAction(name="Open", fields={"how": HOW}, result=WIDE), ""),
        (CardAction(name="Open", fields={"how": HOW, "odd": CardField(type="text", optional=True)}), ""),
        (CardAction(name="Open", fields={"how": CardField(type="enum", values=("slow", "fast", "dead_slow"))}), ""),
        (CardAction(name="Open", fields={"how": CardField(type="enum", values=("slow",))}), "field how"),
        (CardAction(name="Open", fields={"how": CardField(type="text")}), "field how"),
        (CardAction(name="Open", fields={}), "field how"),
        (CardAction(name="Open", fields={"how": HOW, "odd": CardField(type="text")}), "field odd"),
        (CardAction(name="Open", fields={"how": HOW, "far": CardField(type="number")}), "field far"),
        (CardAction(name="Open", result={}), "result wide"),
        (CardAction(name="Open", result={"wide": CardField(type="list of distance")}), "result wide"),
        (CardAction(name="Open", lands=True), "lands"),
        (CardAction(name="Open", starts_rotors=True), "starts_rotors"),
        (CardAction(name="Open", moves_to="by"), "moves_to"),
        (CardAction(name="Open", requires="airborne"), "requires"),
        (CardAction(name="Open", effect={"airborne": True}), "effect"),
    ],
)
def test_an_action_contradicts_the_catalogue_or_not(own: Catalogue, card: CardAction, says: str) -> None:
    found = contradiction(card, own.actions["Open"])
    assert (says in found) if says else (found == "")
    if says:
        assert "the card says" in found
        assert "the catalogue says" in found


def test_a_card_that_says_another_type_of_a_status_field_is_told_so(own: Catalogue) -> None:
    card = AgentCard(id="d", type="door", boot_id="b", actions=(), fields={"open": CardField(type="text")})
    assert list(refusals(card, own)) == ["field open"]


def alarmed(made: Bench, code: str) -> list[str]:
    return [one.text for one in effects(made, Alarm) if one.code == code]


def test_an_action_that_contradicts_is_refused_and_the_machine_flies_with_the_rest() -> None:
    made = Bench(SITE, BASE, [])
    drone = made.agent("hwd_1", "hwd")
    made.run_for(2)
    card = drone.side.card
    bad = CardAction(
        name="GoTo", fields={"to": CardField(type="place"), "speed": CardField(type="speed", optional=True)}
    )
    fields = {name: getattr(card, name) for name in AgentCard.__struct_fields__}
    rest = tuple(one for one in card.names if one != "GoTo")
    drone.link.publish_card(AgentCard(**{**fields, "actions": (*rest, bad)}))
    made.run_for(1)
    record = made.record("hwd_1")
    assert (record.refused, list(record.refused_actions)) == ("", ["GoTo"])
    assert "GoTo" not in record.actions
    assert set(record.actions) >= set(rest) - {"Confirm"}
    (said,) = alarmed(made, "action_refused")
    assert "place" in said
    assert "position" in said
    drone.link.publish_card(AgentCard(**fields))
    made.run_for(1)
    assert "GoTo" in made.record("hwd_1").actions
    assert made.record("hwd_1").refused_actions == {}


def test_an_agent_of_another_version_is_not_admitted_and_both_versions_are_named() -> None:
    made = Bench(SITE, BASE, [])
    drone = made.agent("hwd_1", "hwd")
    old = drone.side.card
    fields = {name: getattr(old, name) for name in AgentCard.__struct_fields__}
    drone.link.publish_card(AgentCard(**{**fields, "wire": 1}))
    made.run_for(1)
    assert made.record("hwd_1").refused == "wire_version"
    assert made.record("hwd_1").actions == ()
    drone.link.publish_card(old)
    made.run_for(1)
    assert made.record("hwd_1").refused == ""


# -- fields of a type's own -------------------------------------------------------------------------------------------
WATCH = """
agents: {door: {type: door}}
steps:
  - wait_until: door.open and door.angle > 30
    timeout: 10 min
  - check: door.mode == 'night'
"""


def test_a_condition_reads_fields_and_is_woken_by_them(own: Catalogue) -> None:
    made = Bench(SITE, own, [task_of(WATCH, SITE, own)])
    door = made.agent("door_1", "door")
    door.say(fields={"open": False, "angle": 0.0})
    made.run_for(2)
    task = made.submit("Try", {})
    made.run_for(2)
    door.say(fields={"open": True, "angle": 10})
    made.run_for(2)
    assert made.task(task).status == "ACTIVE"
    door.say(fields={"open": True, "angle": 45.0, "mode": "night", "odd": 7})
    made.run_for(2)
    assert made.task(task).status == "SUCCEEDED"
    assert made.record("door_1").fields == {"open": True, "angle": 45.0, "mode": "night"}


@pytest.mark.parametrize("wrong", [{"open": "yes"}, {"open": 1}, {"mode": "dusk"}, {"angle": "wide"}, {"open": None}])
def test_a_value_of_another_type_refuses_that_field_only_and_is_told_once(
    own: Catalogue, wrong: dict[str, Any]
) -> None:
    made = Bench(SITE, own, [])
    door = made.agent("door_1", "door")
    made.run_for(2)
    good = {"open": True, "angle": 3, "mode": "day"}
    for _ in range(3):
        door.say(fields={**good, **wrong}, battery=50.0)
        made.run_for(2)
    record = made.record("door_1")
    assert record.battery == 50.0
    assert set(record.fields) == set(good) - set(wrong)
    assert list(record.refused_fields) == list(wrong)
    assert len(alarmed(made, "field_refused")) == 1
    door.say(fields=good)
    made.run_for(2)
    assert (set(made.record("door_1").fields), made.record("door_1").refused_fields) == (set(good), {})


@pytest.mark.parametrize(
    ("role", "condition", "code"),
    [
        ("{type: door}", "door.open", ""),
        ("{type: gate}", "door.open and door.locked", ""),
        ("{type: door}", "door.locked", "E011"),
        ("{any_of: [door, oven]}", "door.heat > 3", "E011"),
        ("{any_of: [door, oven]}", "door.angle > 3", "E011"),
        ("{type: door}", "door.angle > 3 m", "E060"),
        ("{type: door}", "door.open > 3", "E060"),
    ],
)
def test_the_checker_knows_their_types(own: Catalogue, role: str, condition: str, code: str) -> None:
    text = f"formiga: 1\ntask: Try\nagents: {{door: {role}}}\nsteps:\n  - wait_until: {condition}\n    timeout: 1 min\n"
    found = load_task_text(text, "try.yaml", catalogue=own, site=SITE).diagnostics
    errors = [one.code for one in found if one.severity == "error"]
    assert bool(errors) == bool(code), found


def test_a_field_may_not_be_called_like_one_of_every_agent(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("types: {door: {mobility: fixed, fields: {battery: number, landed: bool, open: bool}}}\n")
    catalogue, problems, _ = load_catalogue([file])
    assert [one.code for one in problems] == ["E018", "E018"]
    assert list(catalogue.types["door"].fields) == ["open"]


def test_what_is_said_and_what_is_refused_is_shown(own: Catalogue) -> None:
    made = Bench(SITE, own, [])
    door = made.agent("door_1", "door")
    errors = (AgentError("hinge", "the hinge squeaks", "warning"),)
    door.say(fields={"open": True, "angle": "wide"}, errors=errors, floor="2", charging=True, heading_deg=90.0)
    made.run_for(2)
    record = made.record("door_1")
    fact = agent_fact(made.engine.state, record, made.now)
    assert (fact.fields, list(fact.refused_fields)) == ({"open": True}, ["angle"])
    assert (fact.errors, fact.floor, fact.charging, fact.heading_deg) == (("the hinge squeaks",), "2", True, 90.0)
    note = _row(fact, None)[-1]
    assert all(word in note for word in ("open: yes", "the hinge squeaks", "floor 2", "charges", "angle is refused"))
