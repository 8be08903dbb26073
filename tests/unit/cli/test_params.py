"""Parameters of the command line: NAME=VALUE, and @file with GeoJSON."""

import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.geo import Place, Region, horizontal_m
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.params import read_params
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.rehearsal.testing import packaged_world, task_of
from tests.golden import Wording

RING = [[25.700, 66.501], [25.705, 66.501], [25.705, 66.503], [25.700, 66.501]]
PATROL = "params: {region: region}\nagents: {w: {type: watcher, near: '${centroid(region)}'}}\nsteps: [{wait: 1 s}]\n"
GO = "params: {region: place}\nagents: {w: {type: watcher, near: '${region}'}}\nsteps: [{wait: 1 s}]\n"
POLYGON = {"type": "Polygon", "coordinates": [RING]}


def of(tmp_path: Path, data: Any, name: str = "area.geojson") -> dict[str, str]:
    file = tmp_path / name
    file.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return read_params([f"region=@{file}"])


@pytest.mark.parametrize(
    "data",
    [
        POLYGON,
        {"type": "Feature", "properties": {}, "geometry": POLYGON},
        {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": POLYGON}]},
    ],
)
def test_a_polygon_becomes_a_region(tmp_path: Path, data: Any) -> None:
    site, catalogue = packaged_world()
    task = task_of(PATROL, site, catalogue)

    values, problems, _ = bind_params(task, of(tmp_path, data), site)

    assert not problems
    region = values["region"]
    assert isinstance(region, Region)
    assert len(region.corners) == 3  # the closing corner is the first one again
    assert region.corners[0].north_m == pytest.approx(111.5, abs=1.0)  # 0.001 degrees north of the base: lat, not lng


def test_a_point_becomes_a_place(tmp_path: Path) -> None:
    site, catalogue = packaged_world()
    task = task_of(GO, site, catalogue)
    values, problems, _ = bind_params(task, of(tmp_path, {"type": "Point", "coordinates": [25.7, 66.5, 12.0]}), site)
    assert not problems
    assert horizontal_m(values["region"], Place(0.0, 0.0)) < 0.01


def test_any_other_file_is_its_text(tmp_path: Path) -> None:
    assert of(tmp_path, "60 m\n", "height.txt") == {"region": "60 m"}
    assert of(tmp_path, ["a", "b"], "list.json") == {"region": '["a", "b"]'}


@pytest.mark.parametrize(
    "data",
    [
        "{",
        {"type": "FeatureCollection", "features": []},
        {"type": "Polygon", "coordinates": [RING, RING]},
        {"type": "Polygon"},
        {"type": "MultiPolygon", "coordinates": []},
        {"type": "MultiPoint", "coordinates": 1},
        {"type": "Point", "coordinates": [1]},
    ],
)
def test_a_file_that_says_something_else_is_told(tmp_path: Path, data: Any, wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        of(tmp_path, data)
    wording(refused.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(UnusableFile, match=r"cannot read .*nope\.geojson"):
        read_params([f"region=@{tmp_path}/nope.geojson"])


@pytest.mark.parametrize("words", [["target"], ["=x"], ["a=1", "a=2"]])
def test_words_that_are_no_parameters(words: list[str], wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        read_params(words)
    wording(refused.value)


def test_a_value_may_hold_anything() -> None:
    assert read_params(["text=a=b, c", "at=66.50,25.73"]) == {"text": "a=b, c", "at": "66.50,25.73"}
