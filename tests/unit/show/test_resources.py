"""Who holds a resource and who waits for it, as `why`, the facts and the watch say it."""

from collections.abc import Iterator

import pytest
from msgspec.structs import replace

from formiga_bt.lang.model import Resource
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.show.facts import HeldUnits, Now, ResourceFact, Top
from formiga_bt.show.history.holding import resource_facts
from formiga_bt.show.watch.top import resource_line
from formiga_bt.show.why.causes import causes_of
from tests.unit.engine import yard as yards
from tests.unit.engine.yard import CART, Yard
from tests.unit.show.scene import source_of


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Yard, str, str]]:
    site, catalogue = yards.yard()
    hall = replace(site, resources={"lift": Resource("lift", 1), "bay": Resource("bay", 4)})
    monkeypatch.setattr(yards, "yard", lambda _mode="simulation": (hall, catalogue))
    block = "steps: [{with_resource: lift, wait: 60 s, steps: [{wait: 30 s}]}]"
    yard = Yard(CART + block, yards.task(CART + block, name="Other"), carts=2)
    first, second = yard.start(), yard.start("Other")
    yield yard, first, second
    yard.close()


def why(yard: Rehearsal, task: str) -> list[tuple[str, str]]:
    _, lines = source_of(yard).why(task)
    return [(line.code, line.text) for line in lines]


def test_why_names_who_holds_it_and_who_waits(two: tuple[Yard, str, str]) -> None:
    yard, first, second = two
    waits, holds = dict(why(yard, second)), dict(why(yard, first))

    assert first in waits["resource_busy"]
    assert first in waits["holds"]
    assert "resource_timeout" in waits
    assert "lift" in waits["wants"]
    assert "lift" in holds["holds"]
    assert second in holds["holds"]


def test_a_block_that_waits_has_a_cause_of_the_closed_list(two: tuple[Yard, str, str]) -> None:
    yard, _, second = two
    state = yard.engine.state

    assert [cause.code for cause in causes_of(state, state.tasks[second])] == ["resource"]


def test_the_facts_name_holders_and_those_who_wait(two: tuple[Yard, str, str]) -> None:
    yard, first, second = two
    lift, bay = resource_facts(yard.engine.state, yard.site.resources.values())

    assert [held.task for held in lift.held] == [first]
    assert (lift.waiting, lift.inside, lift.capacity) == ((second,), (), 1)
    assert bay == ResourceFact(name="bay", capacity=4)
    assert source_of(yard).now().resources == (lift, bay)


def test_the_watch_has_a_row_of_the_resources_in_use() -> None:
    lift = ResourceFact(name="lift", held=(HeldUnits(task="Tote-3"),), waiting=("Tote-4", "Tote-5"))
    bridge = ResourceFact(name="bridge", inside=("rover_2",))
    now = Now(
        site="hall", at=1, top=Top(), counts={}, tasks=(), total=0, agents=(), questions=(),
        resources=(lift, bridge, ResourceFact(name="bay")),
    )  # fmt: skip
    row = resource_line(now, 200)

    assert row is not None
    text = "".join(piece.text for piece in row)
    assert all(word in text for word in ("lift 1/1", "Tote-3", "bridge 0/1", "rover_2"))
    assert "bay" not in text
    assert resource_line(replace(now, resources=(ResourceFact(name="bay"),)), 200) is None
    assert resource_line(now, 20) is not None
