"""What a drone says of a region that it searched: cells, those that it saw, and their share."""

import json
import math

import pytest

from agents_sim.coverage import MOST, covered
from agents_sim.kinds import Outcome
from agents_sim.sweep import sweep
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Frame, Place, Position
from tests.unit.agents_sim.conftest import World, point

SQUARE = [Place(0.0, 0.0), Place(100.0, 0.0), Place(100.0, 100.0), Place(0.0, 100.0)]
CORNERS = [point(c.east_m, c.north_m) for c in SQUARE]


def share(height_m: float, corners: list[Place] = SQUARE) -> float:
    result = covered(corners, sweep(corners, 20.0), height_m).result()
    assert result["coverage"] == pytest.approx(100.0 * result["seen"] / result["cells"], abs=0.05)
    return float(result["coverage"])


def test_from_high_up_all_is_seen_from_low_only_what_lies_below_the_lanes() -> None:
    assert share(60.0) == share(20.0) == 100.0
    assert 40.0 < share(10.0) < 60.0
    assert share(2.0) == 0.0


def test_a_region_has_cells_inside_only_and_never_too_many() -> None:
    triangle = [Place(0.0, 0.0), Place(100.0, 0.0), Place(0.0, 100.0)]
    assert covered(triangle, sweep(triangle, 20.0), 60.0).result()["cells"] == pytest.approx(200, abs=20)
    wide = [Place(0.0, 0.0), Place(4000.0, 0.0), Place(4000.0, 3000.0), Place(0.0, 3000.0)]
    found = covered(wide, [Place(0.0, 10.0), Place(4000.0, 10.0)], 60.0)
    assert len(found.cells) <= MOST * 1.1
    assert found.cell_m > 5.0


def test_a_region_smaller_than_a_cell_has_one() -> None:
    tiny = [Place(0.0, 0.0), Place(1.0, 0.0), Place(0.0, 1.0)]
    assert covered(tiny, sweep(tiny, 20.0), 60.0).result() == {"coverage": 100.0, "cells": 1, "seen": 1}


def test_the_cells_are_a_file_for_maps() -> None:
    found = json.loads(covered(SQUARE, sweep(SQUARE, 20.0), 10.0).geojson(Frame(66.5, 25.7)))
    rings = {f["properties"]["seen"]: [poly[0] for poly in f["geometry"]["coordinates"]] for f in found["features"]}
    assert sum(map(_area_m2, rings[True])) + sum(map(_area_m2, rings[False])) == pytest.approx(10_000.0, rel=0.01)
    assert sum(map(_area_m2, rings[True])) == pytest.approx(5_200.0, rel=0.05)
    assert all(ring[0] == ring[-1] and len(ring) == 5 for ring in (*rings[True], *rings[False]))


def _area_m2(ring: list[list[float]]) -> float:
    """Return the size of a rectangle near the base."""
    (west, south), (east, north) = ring[0], ring[2]
    return (east - west) * 111_320.0 * math.cos(math.radians(66.5)) * (north - south) * 111_320.0


def explored(world: World, spec: AgentSpec) -> dict[str, object]:
    world.fleet.add(spec)
    goal = world.order("d", "Explore", region=CORNERS, altitude=60.0)
    world.run(600.0)
    return world.end(goal)[1].result


def test_a_search_gives_its_coverage_and_no_finds(world: World) -> None:
    result = explored(world, AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0)))
    assert result == {"coverage": 100.0, "cells": 400, "seen": 400, "finds": []}


def test_a_scenario_says_what_is_found(world: World) -> None:
    finds = [point(20, 30)]
    outcomes = (Outcome(action="Explore", give={"finds": finds}),)
    result = explored(world, AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0), outcomes=outcomes))
    assert (result["coverage"], result["finds"]) == (100.0, finds)


class Shelf:
    """Keeps the bytes of attachments in memory."""

    def __init__(self) -> None:
        self.kept: dict[str, bytes] = {}

    def put(self, digest: str, data: bytes) -> None:
        self.kept[digest] = data

    def get(self, digest: str) -> bytes | None:
        return self.kept.get(digest)


def test_a_search_sends_its_cells_as_a_file_that_its_result_names(world: World) -> None:
    world.hub.files = shelf = Shelf()
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 10.0), base=(66.5, 25.7)))
    goal = world.order("d", "Explore", region=CORNERS, altitude=10.0)
    world.run(600.0)
    (file,) = world.end(goal)[1].attachments
    assert (file.name, file.media_type) == ("coverage.geojson", "application/geo+json")
    data = shelf.kept[file.sha256]
    assert len(data) == file.size
    assert [one["properties"]["seen"] for one in json.loads(data)["features"]] == [True, False]


def test_what_nobody_keeps_is_not_named(world: World) -> None:
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0), base=(66.5, 25.7)))
    goal = world.order("d", "Explore", region=CORNERS, altitude=60.0)
    world.run(600.0)
    assert world.end(goal)[1].attachments == ()


def test_who_does_not_know_the_base_sends_no_file(world: World) -> None:
    world.hub.files = shelf = Shelf()
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0)))
    goal = world.order("d", "Explore", region=CORNERS, altitude=60.0)
    world.run(600.0)
    assert world.end(goal)[1].attachments == ()
    assert shelf.kept == {}


def test_a_leg_gives_nothing(world: World) -> None:
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0)))
    goal = world.order("d", "GoTo", to=point(10, 0, 60))
    world.run(60.0)
    assert world.end(goal)[1].result == {}
