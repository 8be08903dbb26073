"""Values of parameters from files: tables, GeoJSON, YAML; what is wrong is told with the file and the row."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.base.bounds import MOST_CELLS, MOST_FILE_BYTES
from formiga_bt.base.diagnostics import render
from formiga_bt.base.geo import Place, Region, horizontal_m
from formiga_bt.lang.request.binding import MOST_PROBLEMS, bind_params
from formiga_bt.lang.request.value_files import ValueFile, given_in, read_value_file
from formiga_bt.rehearsal.testing import packaged_world, task_of
from tests.golden import Wording

SITE, CATALOGUE = packaged_world()
STEPS = "agents: {w: {type: watcher}}\nsteps: [{wait: 1 s}]\n"
TYPES = {
    "spots": "{type: {list: place}}", "names": "{type: {list: text}}", "depths": "{type: {list: distance}}",
    "target": "place", "field": "region", "fields": "{type: {list: region}}", "height": "{type: distance, max: 80 m}",
    "user": "{type: agent, of: [picker]}",
}  # fmt: skip

ALL = "".join(f"  {name}: {of}\n" for name, of in TYPES.items())
EVERY = task_of(f"params:\n{ALL}{STEPS}", SITE, CATALOGUE)


def bound(*files: ValueFile, **given: str) -> tuple[dict[str, Any], str]:
    wanted = {name for one in files for name in [one.param, *given_in([one])] if name in TYPES} | set(given)
    params = "".join(f"  {name}: {TYPES[name]}\n" for name in sorted(wanted)) or "  target: place\n"
    task = task_of(f"params:\n{params}{STEPS}", SITE, CATALOGUE)
    values, problems, sources = bind_params(task, given, SITE, files=files)
    return values, "\n".join(render(one, sources) for one in problems)


def bound_all(*files: ValueFile) -> tuple[dict[str, Any], list[str]]:
    values, problems, sources = bind_params(EVERY, {}, SITE, files=files)
    return values, [render(one, sources) for one in problems]


def table(text: str, param: str = "spots") -> ValueFile:
    return ValueFile("rows.csv", text, param)


def test_a_row_is_a_place_by_its_degrees_or_metres_or_name() -> None:
    values, wrong = bound(
        table("id,lat,lng,note\na,66.501,25.7,x\n\nb,66.502,25.701,\n"),
        ValueFile("target.csv", "east;north\n10 m;-4 m\n"),
    )

    assert not wrong
    assert horizontal_m(values["spots"][0], Place(0.0, 111.5)) < 1.0
    assert (len(values["spots"]), values["target"]) == (2, Place(10.0, -4.0))
    named, wrong = bound(table('spot\ncamp\n"66.5, 25.7"\nbase\n'.replace("base\n", "")))
    assert not wrong
    assert named["spots"] == (SITE.places["camp"], Place(0.0, 0.0))


def test_other_lists_take_the_only_column_or_the_one_of_their_name() -> None:
    assert bound(table("depth\n4 m\n2.5 m\n", "depths"))[0] == {"depths": (4.0, 2.5)}
    assert bound(table('id,names\n1,"a, ""b"""\n2, c \n', "names"))[0] == {"names": ('a, "b"', "c")}
    assert bound(table("depth\n", "depths"))[0] == {"depths": ()}


def test_rows_are_the_corners_of_a_region() -> None:
    values, wrong = bound(table("east,north\n0 m,0 m\n9 m,0 m\n9 m,9 m\n", "field"))

    assert not wrong
    assert isinstance(values["field"], Region)


def feature(kind: str, points: str) -> str:
    return f'{{"type": "Feature",\n "properties": {{"id": 1}},\n\t"geometry": {{"type": "{kind}", "coordinates": {points}}}}}'


POINT = feature("Point", "[25.7, 66.501, 12.0]")
RING = "[[25.7, 66.501], [25.705, 66.501], [25.705, 66.503], [25.7, 66.501]]"


@pytest.mark.parametrize(
    ("param", "features", "many"),
    [
        ("spots", [POINT, POINT], 2),
        ("spots", [feature("LineString", RING)], 4),
        ("target", [POINT], 0),
        ("field", [feature("Polygon", f"[{RING}]")], 0),
        ("fields", [feature("Polygon", f"[{RING}]")] * 2, 2),
    ],
)
def test_features_are_places_and_regions(param: str, features: list[str], many: int) -> None:
    text = f'{{"type": "FeatureCollection", "features": [{", ".join(features)}]}}'
    values, wrong = bound(ValueFile(f"{param}.geojson", text))

    assert not wrong
    assert not many or len(values[param]) == many


def test_yaml_holds_one_parameter_or_several() -> None:
    assert bound(ValueFile("day.yaml", "target: camp\nheight: 60 m\n"))[0]["height"] == 60.0
    assert bound(ValueFile("day.yaml", "[camp, '66.5, 25.7']", "spots"))[0]["spots"][1] == Place(0.0, 0.0)
    assert bound(ValueFile("x.json", '{"height": "60 m"}'), user="picker_1")[0]["height"] == 60.0


def test_what_is_given_twice_is_told(wording: Wording) -> None:
    wording(bound(ValueFile("day.yaml", "target: camp\n"), target="camp")[1])


def test_files_are_bounded(tmp_path: Path) -> None:
    assert f"more than {MOST_CELLS:,} values" in bound(table("a,b\n" + "1,2\n" * (MOST_CELLS // 2 + 1)))[1]
    assert "larger than" in bound(table("spot\n" + "camp\n" * (MOST_FILE_BYTES // 5)))[1]
    (tmp_path / "large.csv").write_bytes(b"a\n" * MOST_FILE_BYTES)
    (tmp_path / "latin.csv").write_bytes(b"a\n\xff\n")
    for name in ("large.csv", "latin.csv", "none.csv", "code.py"):
        assert isinstance(read_value_file(tmp_path / name), str)


def test_a_byte_order_mark_and_windows_line_ends_are_no_matter(tmp_path: Path) -> None:
    (tmp_path / "spots.csv").write_bytes("\ufefflat;lng\r\n66.5;25.7\r\n".encode())
    read = read_value_file(tmp_path / "spots.csv")

    assert isinstance(read, ValueFile)
    assert bound(read)[0] == {"spots": (Place(0.0, 0.0),)}


def test_of_many_rows_that_are_wrong_the_first_are_told() -> None:
    told = bound(table("depth\n" + "4\n" * 300, "depths"))[1]

    assert told.count("needs a unit") == MOST_PROBLEMS
    assert "rows.csv:22:1: E017: 280 more are wrong from here on" in told


CELLS = st.sampled_from(
    ["lat", "lng", "66.5", "25.7", "camp", '"', ",", ";", "\n", "\r", "\x00", "${", "}", " ", "4 m", "{", "[", ":"]
)


@given(text=st.lists(CELLS, max_size=40).map("".join), name=st.sampled_from(["a.csv", "a.geojson", "a.yaml", "a.json"]),
       param=st.sampled_from(["spots", "target", "field", "height", ""]))  # fmt: skip
def test_no_text_of_a_file_is_too_odd(text: str, name: str, param: str) -> None:
    files = [ValueFile(name, text, param)]
    values, wrong = bound_all(*files)

    assert wrong or values
