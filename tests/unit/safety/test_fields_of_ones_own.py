"""The gate reads a height and a speed of any action, whatever its author calls the field: by its type, not by its name."""

from pathlib import Path

import pytest

from formiga_bt.lang.compose import compose
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import ActionSpec, Catalogue, Site
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import task_of

OWN = """
types:
  kite:
    mobility: air
    actions: [Rise, Sink]
    limits: {speed: 5 m/s, climb: 5 m/s}
    envelope: {max_height: 80 m}
  cart:
    mobility: ground
    rest: parked
    actions: [Roll]
    limits: {speed: 5 m/s}
    envelope: {max_speed: 2 m/s}
actions:
  Rise: {fields: {up: distance}, requires: grounded, effect: {airborne: true}, starts_rotors: true, repeatable: true}
  Sink: {fields: {spot: place}, moves_to: spot, requires: airborne, effect: {airborne: false}, lands: true, repeatable: true}
  Roll: {fields: {where: place, pace: {type: speed, optional: true}}, moves_to: where, repeatable: true}
"""
SITE = """
formiga_site: 1
name: meadow
base: {lat: 66.5, lng: 25.7}
ports: {p1: {at: {east: 0 m, north: 20 m}}}
agents: {kite_1: {type: kite, home: p1}, cart_1: {type: cart, at: {east: -30 m, north: 0 m}}}
actions: [own.yaml]
"""
FLY = """params: {up: distance}
agents: {it: {type: kite}}
steps: [{do: it.Rise, with: {up: "${up}"}}, {do: it.Sink, with: {spot: "${it.home}"}}]"""
ROLL = """params: {pace: speed}
agents: {it: {type: cart}}
steps: [{do: it.Roll, with: {where: {east: 30 m, north: 0 m}, pace: "${pace}"}}]"""


@pytest.fixture
def own(tmp_path: Path) -> tuple[Site, Catalogue]:
    (tmp_path / "own.yaml").write_text(OWN)
    (tmp_path / "site.yaml").write_text(SITE)
    found = compose(tmp_path / "site.yaml")
    assert [str(one) for one in found.diagnostics if one.severity == "error"] == []
    assert found.site is not None
    return found.site, found.catalogue


@pytest.mark.parametrize(
    ("text", "value", "code"),
    [
        (FLY, {"up": 70.0}, ""),
        (FLY, {"up": 90.0}, "envelope.max_height"),
        (ROLL, {"pace": 1.5}, ""),
        (ROLL, {"pace": 3.0}, "envelope.max_speed"),
    ],
)
def test_the_gate_refuses_what_is_too_high_or_too_fast(
    own: tuple[Site, Catalogue], text: str, value: dict[str, float], code: str
) -> None:
    rehearsal = Rehearsal(*own, [task_of(text, *own)], fleet_of(*own))
    rehearsal.run_for(1.0)
    task = rehearsal.submit("Try", value)
    highest = 0.0
    while not rehearsal.ended(task):
        rehearsal.run_for(1.0)
        here = rehearsal.engine.state.agents["kite_1"].position
        highest = max(highest, here.up_m if here is not None else 0.0)
    outcome = rehearsal.task(task).outcome
    rehearsal.close()

    assert (outcome.status, outcome.code) == (("FAILED", code) if code else ("SUCCEEDED", ""))
    if "up" in value and not code:
        assert highest > 60.0


def test_the_checker_knows_how_high_is_too_high(own: tuple[Site, Catalogue]) -> None:
    loaded = load_task_text(
        "formiga: 1\ntask: T\n" + FLY.replace('"${up}"', "90 m"), "t.yaml", catalogue=own[1], site=own[0]
    )

    assert "up 90 m is above the limit of 80 m for kite" in [one.message for one in loaded.diagnostics]


@pytest.mark.parametrize(
    ("fields", "effect", "height", "speed"),
    [
        ("{altitude: distance, spacing: distance}", "airborne", "altitude", ""),
        ("{up: distance}", "airborne", "up", ""),
        ("{up: distance, out: distance}", "airborne", "", ""),
        ("{behind: distance}", "", "", ""),
        ("{height: distance, pace: speed}", "", "height", "pace"),
        ("{speed: speed, wind: speed}", "", "", "speed"),
    ],
)
def test_which_field_is_which(tmp_path: Path, fields: str, effect: str, height: str, speed: str) -> None:
    then = "{airborne: true}" if effect else "{}"
    (tmp_path / "a.yaml").write_text(
        f"types: {{k: {{mobility: air, actions: [A]}}}}\nactions: {{A: {{fields: {fields}, effect: {then}}}}}\n"
    )
    (tmp_path / "site.yaml").write_text("formiga_site: 1\nname: s\nbase: {lat: 1, lng: 1}\nactions: [a.yaml]\n")
    spec: ActionSpec = compose(tmp_path / "site.yaml").catalogue.actions["A"]

    assert (spec.height, spec.speed) == (height, speed)
