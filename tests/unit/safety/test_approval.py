"""What is approved before a task may fly for real (safety.approval)."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.lang.site import load_site_text
from formiga_bt.rehearsal.testing import packaged_task, packaged_world, task_of
from formiga_bt.safety.approval import approval_digest, lands_away, needs_another, same_person
from tests.golden import Wording

FLYING = "imports: [lib/flying.yaml]\n"
ONE = "agents: {drone: {type: lwd}}\n"
UP = "  - do: drone.TakeOff\n"

HOP = """\
formiga: 1
task: Hop
agents: {drone: {type: lwd}}
steps:
  - do: drone.TakeOff
    with: {altitude: 20 m}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
SITE = """\
formiga_site: 1
name: yard
actions: [base, building]
base: {lat: 60.0, lng: 25.0}
fence: [{east: -400 m, north: -400 m}, {east: 400 m, north: -400 m}, {east: 400 m, north: 400 m}, {east: -400 m, north: 400 m}]
ports:
  p1: {at: {east: 0 m, north: 0 m}}
  p2: {at: {east: 20 m, north: 0 m}}
resources: {gap: {region: [{east: 30 m, north: 30 m}, {east: 40 m, north: 30 m}, {east: 40 m, north: 40 m}]}}
people: {approvers: [ann]}
agents:
  lwd_1: {type: lwd, home: p1}
  gate: {type: door, at: {east: 35 m, north: 35 m}, guards: {Close: gap}}
transports: {zenoh: {listen: tcp/127.0.0.1:7447}}
"""
BASE = (folder("actions") / "base.yaml").read_text(encoding="utf-8")


def made(text: str) -> Task:
    return task_of(text, *packaged_world())


def away(text: str) -> tuple[str, ...]:
    return lands_away(made(text), packaged_world()[1])


def digest_of(text: str = HOP, site: str = SITE, base: str = BASE) -> str:
    """Return what is approved of a task; all of it is read from text."""
    catalogue, wrong, _ = load_catalogue(
        [folder("actions") / one for one in ("base.yaml", "building.yaml")],
        read=lambda path: base if path.name == "base.yaml" else path.read_text(encoding="utf-8"),
    )
    the_site, more, _ = load_site_text(site, "site.yaml", catalogue)
    assert not [d for d in (*wrong, *more) if d.severity == "error"]
    assert the_site is not None
    found = load_task_text(text, "hop.yaml", catalogue=catalogue, site=the_site)
    assert found.task is not None, found.diagnostics
    return approval_digest(found.task, the_site)


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    "other",
    [
        {"text": changed(HOP, "20 m", "21 m")},
        {"text": HOP + "# a remark, which the approver read too\n"},
        {"site": changed(SITE, "east: -400 m", "east: -500 m")},
        {"site": changed(SITE, "{Close: gap}", "{Open: gap}")},
        {"base": changed(BASE, "reserve: 25 %", "reserve: 24 %")},
        {"base": changed(BASE, "typical: 45 s", "typical: 46 s")},
        {"base": changed(BASE, "typical: 1 min", "typical: 2 min")},
        {"base": changed(BASE, "types:\n", "types:\n  swift: {extends: lwd}\n")},
    ],
    ids=[
        "steps",
        "remark",
        "fence",
        "guard",
        "limit",
        "action",
        "action of the way home",
        "a type that may be granted",
    ],
)
def test_a_change_of_what_an_approval_covers_voids_it(other: dict[str, str]) -> None:
    assert digest_of(**other) != digest_of()


@pytest.mark.parametrize(
    "other",
    [
        {"site": changed(SITE, "agents:\n", "agents:\n  lwd_2: {type: lwd, home: p2}\n")},
        {"site": changed(SITE, "[ann]", "[ann, bob]")},
        {"site": changed(SITE, "7447", "7448")},
        {"site": "# laid out anew\n\n" + SITE},
        {"base": changed(BASE, "types:\n", "types:\n  truck: {mobility: ground, rest: anywhere}\n")},
        {"base": changed(BASE, "actions:\n  TakeOff", "actions:\n  Sing: {typical: 3 s}\n  TakeOff")},
        {"base": changed(BASE, "actions: [Explore]", "actions: [Explore, Confirm]")},
        {"base": changed(BASE, "typical: 20 min", "typical: 21 min")},
        {"base": "# laid out anew\n\n" + BASE},
    ],
    ids=[
        "agent",
        "approver",
        "wire",
        "layout",
        "type",
        "action",
        "action not ordered",
        "action not used",
        "its layout",
    ],
)
def test_a_change_of_what_it_does_not_cover_leaves_it(other: dict[str, str]) -> None:
    assert digest_of(**other) == digest_of()


def test_parts_of_the_digest_cannot_be_shifted_into_each_other() -> None:
    site, _ = packaged_world()
    task = packaged_task("move_task")
    one = approval_digest(replace(task, covered="ab"), replace(site, covered="c"))

    assert one != approval_digest(replace(task, covered="a"), replace(site, covered="bc"))


@pytest.mark.parametrize(
    "steps",
    [
        UP + "  - {do: drone.LandIn, with: {at: '${drone.home}'}}\n",
        UP + "  - call: ReturnHome\n    with: {drone: '${drone}'}\n",
        "  - call: FlyAndLand\n    with: {drone: '${drone}', at: '${drone.home}'}\n",
        "  - {wait: 1 s}\n",
    ],
    ids=["itself", "library", "as an argument", "no flight"],
)
def test_a_landing_at_its_own_home_is_none_away(steps: str) -> None:
    assert away(FLYING + ONE + "steps:\n" + steps) == ()


def test_a_landing_anywhere_else_is_one_away(wording: Wording) -> None:
    wording(
        away("params: {target: place}\n" + ONE + "steps:\n" + UP + "  - {do: drone.LandIn, with: {at: '${target}'}}\n")
    )


def test_a_place_that_is_handed_into_a_subtree_is_followed(wording: Wording) -> None:
    (found,) = away(
        FLYING
        + "params: {target: place}\n"
        + ONE
        + "steps:\n  - call: FlyAndLand\n    with: {drone: '${drone}', at: '${target}'}\n"
    )
    wording(found)


def test_the_home_of_another_machine_is_away() -> None:
    two = "agents: {drone: {type: lwd}, other: {type: hwd}}\n"
    assert away(two + "steps:\n" + UP + "  - {do: drone.LandIn, with: {at: '${other.home}'}}\n")
    assert away(FLYING + two + "steps:\n  - call: FlyAndLand\n    with: {drone: '${drone}', at: '${other.home}'}\n")


def test_what_is_computed_counts_as_away_even_if_it_is_home() -> None:
    assert away("vars: {spot: '${base}'}\n" + ONE + "steps:\n" + UP + "  - {do: drone.LandIn, with: {at: '${spot}'}}\n")


def test_cleanup_counts() -> None:
    text = ONE + "params: {target: place}\nimports: [lib/flying.yaml]\n"
    text += "steps: [{do: drone.TakeOff}, {call: ReturnHome, with: {drone: '${drone}'}}]\non_failure:\n"
    assert away(text + "  - {do: drone.LandIn, with: {at: '${target}'}}\n")


def test_the_shipped_missions() -> None:
    catalogue = packaged_world()[1]
    assert needs_another(packaged_task("pick_up"), catalogue)
    assert not needs_another(packaged_task("move_task"), catalogue)
    assert needs_another(packaged_task("move_task"), catalogue, by_program=True)


def test_a_name_with_a_machine_and_in_capitals_is_the_same_person() -> None:
    assert same_person("ann@desk", "Ann")
    assert not same_person("ann", "anna")
