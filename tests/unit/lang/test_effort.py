"""What a task surely takes: where the estimate stops, so that nothing is reported that may be fine; ways through regions."""

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Region
from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Site

CATALOGUE = load_catalogue([folder("actions") / "base.yaml"])[0]
HEAD = "formiga: 1\ntask: T\nparams:\n  target: place\nagents:\n  drone: {type: lwd}\nsteps:\n"
UP = "  - do: drone.TakeOff\n"
DOWN = "  - do: drone.LandIn\n    with: {at: '${drone.home}'}\n"
Codes = Callable[[str], list[str]]


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(folder("trees") / "demo-site.yaml", CATALOGUE)[0]
    assert found is not None
    region = Region((Place(90.0, -10.0), Place(110.0, -10.0), Place(110.0, 10.0), Place(90.0, 10.0)))
    return replace(found, no_fly=(region,))


@pytest.fixture
def codes(site: Site) -> Codes:
    def read(body: str) -> list[str]:
        loaded = load_task_text(HEAD + body, "t.yaml", catalogue=CATALOGUE, site=site)
        return [f"{d.code} {d.mark.line}" for d in loaded.diagnostics if d.code in ("W063", "W064")]

    return read


def go(east: float, more: str = "") -> str:
    return f"  - do: drone.GoTo\n    with: {{to: '${{above(offset(base, {east} m), 60 m)}}'}}\n{more}"


def test_a_place_in_a_no_fly_region_is_told(codes: Codes) -> None:
    assert codes(UP + go(100.0) + DOWN) == ["W063 10"]


def test_a_way_through_a_no_fly_region_is_told_at_its_end(codes: Codes) -> None:
    assert codes(UP + go(50.0) + go(150.0) + DOWN) == ["W063 12"]


def test_a_way_from_an_unknown_place_is_not(codes: Codes) -> None:
    between = "  - do: drone.GoTo\n    with: {to: '${above(target, 60 m)}'}\n"

    assert codes(UP + go(50.0) + between + go(150.0) + DOWN) == []


def test_a_step_that_may_be_skipped_takes_nothing(codes: Codes) -> None:
    pause = "  - wait: 25 min\n"

    assert codes(UP + pause + DOWN) == ["W064 6"]
    assert codes(UP + pause + "    when: drone.battery > 99 %\n" + DOWN) == []


def test_of_two_branches_the_cheaper_counts(codes: Codes) -> None:
    either = "  - if: drone.battery > 99 %\n    then:\n      - wait: 25 min\n    else:\n      - wait: 1 s\n"

    assert codes(UP + either + DOWN) == []


def test_who_waits_on_the_ground_uses_nothing(codes: Codes) -> None:
    assert codes(UP + DOWN + "  - wait: 2 h\n") == []


def test_a_wait_beside_another_branch_is_not_in_the_air(codes: Codes) -> None:
    both = "  - parallel:\n      - do: drone.LandIn\n        with: {at: '${drone.home}'}\n      - wait: 2 h\n"

    assert codes(UP + both) == []


def test_one_round_of_a_loop_counts(codes: Codes) -> None:
    rounds = "  - repeat: 3\n    timeout: 1 min\n    steps:\n      - wait: {0}\n"

    assert codes(rounds.format("30 s") + UP + DOWN) == []
    assert codes(rounds.format("2 min") + UP + DOWN) == ["W064 9"]
