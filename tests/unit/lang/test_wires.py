"""`transports:` is a table of the wires that are installed, and mode real demands what they guarantee."""

import pytest

import formiga_bt.base.wires as wires
from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Site
from formiga_bt.lang.site import load_site_text
from formiga_bt.rehearsal.testing import packaged_world
from tests.unit.lang.museum import WIRES

REAL = "mode: real\npilots: [{id: anna}]\n"


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wires, "entry_points", lambda **given: WIRES.select(**given))


def read(more: str) -> tuple[Site | None, list[Diagnostic]]:
    head = "formiga_site: 1\nname: north\nbase: {lat: 66.5, lng: 25.7}\n"
    return load_site_text(head + more, "site.yaml")[:2]


def test_a_wire_of_a_package_is_read_by_its_own_options() -> None:
    site, found = read("transports: {mqtt: {broker: localhost:1883, keep: true}, zenoh: {}}\n")
    assert found == []
    assert site is not None
    assert site.transports == {"mqtt": {"broker": "localhost:1883", "keep": True}, "zenoh": {}}


@pytest.mark.parametrize(
    ("more", "code", "word"),
    [
        ("transports: {mqt: {broker: a:1}}\n", "E004", "mqtt"),
        ("transports: {mqtt: {brokr: a:1}}\n", "E004", "broker"),
        ("transports: {mqtt: {broker: here}}\n", "E008", "no port"),
        ("transports: {odd: {}}\n", "E140", "WireKind"),
        ("transports: {gone: {}}\n", "E140", "no_such_module"),
        ("transports: {alias: {}}\n", "E140", "calls itself 'zenoh'"),
        ("transports: {mqtt: {broker: a:1}}\n" + REAL, "E140", "epoch, expiry, link_silence, update"),
        ("transports: {mqtt: {broker: a:1}}\naccept_missing: {mqtt: [epoch]}\n" + REAL, "E140", "expiry"),
        ("accept_missing: {zenoh: [epoch]}\n", "E140", "nothing to accept"),
        ("accept_missing: {mqtt: [epoch]}\n", "E140", "no wire of this site"),
        ("transports: {mqtt: {broker: a:1}}\naccept_missing: {mqtt: [epok]}\n", "E140", "epoch, expiry"),
    ],
)
def test_what_no_site_can_use_is_an_error(more: str, code: str, word: str) -> None:
    _, found = read(more)
    assert {one.code for one in found} == {code}
    assert any(word in f"{one.message} {one.help}" for one in found), found


def test_a_real_site_may_do_without_what_it_names() -> None:
    accepted = "accept_missing: {mqtt: [epoch, expiry, link_silence, update]}\n"
    site, found = read("transports: {mqtt: {broker: a:1}}\n" + accepted + REAL)
    assert [one for one in found if one.code == "E140"] == []
    assert site is not None
    assert site.accept_missing == {"mqtt": ("epoch", "expiry", "link_silence", "update")}


@pytest.mark.parametrize(
    ("wires", "refused"),
    [("mqtt: {broker: a:1}", True), ("mqtt: {broker: a:1}, zenoh: {}", False), ("zenoh: {}", False)],
)
def test_a_target_cannot_move_where_no_wire_of_the_site_can_change_a_goal(wires: str, refused: bool) -> None:
    site, _ = read(f"transports: {{{wires}}}\n")
    _, catalogue = packaged_world()
    text = """\
formiga: 1
task: Meet
agents: {drone: {type: lwd}, picker: {type: picker}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${above(ground(picker.position), 40 m)}"}
    track: {every: 2 s}
    timeout: 5 min
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
    found = load_task_text(text, "meet.yaml", catalogue=catalogue, site=site).diagnostics
    assert ["no_update" in one.message for one in found if one.code == "E054"] == [True] * refused
