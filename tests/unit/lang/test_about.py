"""Diagnostics say in fields of what they speak, so that no program reads their words."""

from collections.abc import Callable

import pytest

from formiga_bt.base.diagnostics import About, CommandedTwice, LeftAirborne, OnGround, UnknownName, UnusedName
from formiga_bt.lang.loader import Loaded, load_task_text
from formiga_bt.lang.model import Catalogue, Site

DRONE = "agents: {drone: {type: lwd}}\n"
FLIES = "imports: [lib/flying.yaml]\n" + DRONE
UP = "  - do: drone.TakeOff\n    with: {altitude: 20 m}\n"
BRANCH = "    - {do: drone.GoTo, with: {to: '${above(base, 60 m)}'}}\n"
HOME = "  - {call: ReturnHome, with: {drone: '${drone}'}}\n"

CASES = [
    ("E010", "steps:\n  - check: nothing > 1\n", UnknownName("nothing")),
    ("E010", "params: {rounds: int}\nsteps:\n  - check: roumds > 1\n", UnknownName("roumds", "rounds")),
    ("W060", DRONE + "steps:\n  - wait: 1 s\n", UnusedName("role", "drone")),
    ("W060", "params: {rounds: int}\nsteps:\n  - wait: 1 s\n", UnusedName("param", "rounds")),
    ("W060", "imports: [lib/flying.yaml]\nsteps:\n  - wait: 1 s\n", UnusedName("import", "lib/flying.yaml")),
    ("E031", FLIES + "steps:\n" + UP, LeftAirborne("drone")),
    ("E034", FLIES + f"steps:\n{UP}  - parallel:\n{2 * BRANCH}{HOME}", CommandedTwice("drone")),
    ("E066", FLIES + "steps:\n" + UP + "  - do: drone.GoTo\n    with: {to: '${base}'}\n" + HOME, OnGround("base")),
]


@pytest.mark.parametrize(("code", "text", "about"), CASES)
def test_of_what_a_diagnostic_speaks(load: Callable[[str], Loaded], code: str, text: str, about: About) -> None:
    assert [one.about for one in load(text).diagnostics if one.code == code] == [about]


def test_a_place_of_the_site_in_the_air(catalogue: Catalogue, demo_site: Site) -> None:
    text = f"formiga: 1\ntask: Example\n{FLIES}steps:\n{UP}  - do: drone.GoTo\n    with: {{to: camp}}\n{HOME}"

    found = load_task_text(text, "example.yaml", catalogue=catalogue, site=demo_site).diagnostics

    assert [one.about for one in found if one.code == "E066"] == [OnGround("site.places.camp")]


def test_a_word_of_a_message_is_no_use_of_a_name(load: Callable[[str], Loaded]) -> None:
    found = load("params: {text: int}\nsteps:\n  - wait: soon\n").diagnostics

    assert [one.code for one in found] == ["W060", "E016"]


def test_a_name_that_was_meant_counts_as_used(load: Callable[[str], Loaded]) -> None:
    found = load("params: {rounds: int}\nsteps:\n  - check: roumds > 1\n").diagnostics

    assert [one.code for one in found] == ["E010"]
