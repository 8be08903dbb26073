"""What is approved before a task may fly for real (safety.approval)."""

import pytest
from msgspec.structs import replace

from formiga_bt.lang.model import Task
from formiga_bt.rehearsal.testing import packaged_task, packaged_world, task_of
from formiga_bt.safety.approval import approval_digest, lands_away, needs_another, same_person
from tests.golden import Wording

FLYING = "imports: [lib/flying.yaml]\n"
ONE = "agents: {drone: {type: lwd}}\n"
UP = "  - do: drone.TakeOff\n"


def made(text: str) -> Task:
    return task_of(text, *packaged_world())


def away(text: str) -> tuple[str, ...]:
    return lands_away(made(text), packaged_world()[1])


def test_the_digest_changes_with_the_task_and_with_the_site() -> None:
    site, _ = packaged_world()
    task = packaged_task("move_task")
    digest = approval_digest(task, site)

    assert digest == approval_digest(task, site)
    assert len(digest) == 64
    changed = [
        approval_digest(packaged_task("pick_up"), site),
        approval_digest(replace(task, bundle=task.bundle[:-1] + "x"), site),
        approval_digest(task, replace(site, digest="another fence")),
    ]
    assert len({digest, *changed}) == 4


def test_parts_of_the_digest_cannot_be_shifted_into_each_other() -> None:
    site, _ = packaged_world()
    task = packaged_task("move_task")
    one = approval_digest(replace(task, bundle="ab"), replace(site, digest="c"))

    assert one != approval_digest(replace(task, bundle="a"), replace(site, digest="bc"))


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
