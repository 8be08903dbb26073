"""Rows of tables and features of GeoJSON as records, told with their rows where they do not fit."""

from typing import Any

import pytest

from formiga_bt.base.diagnostics import render
from formiga_bt.bridges.btcpp_in import import_btcpp
from formiga_bt.bridges.btcpp_out import export_btcpp
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.lang.request.value_files import ValueFile
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import packaged_world
from tests.golden import Wording

SITE, CATALOGUE = packaged_world()
BLADES = """\
formiga: 1
task: Blades
records:
  blade: {id: text, at: place, long: distance, worn: bool}
  spot: {id: text, at: place}
params:
  blades: {list: blade}
  start: {type: spot, default: {id: b0, at: camp}}
steps:
  - for:
      blade: ${sort(where(blades, item.worn), by=item.long)}
    steps:
      - notify: ${blade.id} of ${blade.long} at ${blade.at}, after ${start.id}
"""
ROWS = "id,worn,long,lat,lng\nb1,true,50 m,66.501,25.7\nb2,false,51 m,66.502,25.7\nb3,true,49 m,66.503,25.7\n"


def loaded(text: str = BLADES) -> Any:
    found = load_task_text(text, "blades.yaml", catalogue=CATALOGUE, site=SITE)
    return found.task, "\n\n".join(render(one, found.sources) for one in found.diagnostics)


def bound(rows: str, file: str = "blades.csv") -> tuple[dict[str, Any], str]:
    task, wrong = loaded()
    assert not wrong
    values, problems, sources = bind_params(task, {}, SITE, files=[ValueFile(file, rows)])
    return values, "\n".join(render(one, sources) for one in problems)


def test_rows_are_records_that_a_task_reads() -> None:
    task, _ = loaded()
    values, wrong = bound(ROWS)
    assert not wrong

    run = Rehearsal(SITE, CATALOGUE, [task], [])
    task_id = run.submit("Blades", values)
    assert run.run_until_ended(task_id)
    said = str(run.steps)
    assert said.index("b3 of 49 m") < said.index("b1 of 50 m")
    assert "after b0" in said
    assert "b2 of" not in said
    run.close()


def test_features_are_records_of_their_properties_and_their_shape() -> None:
    point = (
        '{"type": "Feature", "properties": {"id": "b1", "worn": true, "long": "50 m", "note": null},'
        ' "geometry": {"type": "Point", "coordinates": [25.7, 66.501]}}'
    )
    values, wrong = bound(f'{{"type": "FeatureCollection", "features": [{point}, {point}]}}', "blades.geojson")

    assert not wrong
    assert [one["id"] for one in values["blades"]] == ["b1", "b1"]


@pytest.mark.parametrize(
    "rows",
    [ROWS.replace(",long", ",length"), ROWS.replace("49 m", "49"), ROWS.replace("66.503", "67.503")],
    ids=["no column", "no unit", "outside"],
)
def test_what_does_not_fit_is_told(rows: str, wording: Wording) -> None:
    wording(bound(rows)[1])


def test_a_default_that_is_a_mapping_goes_to_another_format_and_back() -> None:
    task, _ = loaded()
    xml = export_btcpp(task, CATALOGUE, {"blades.yaml": BLADES}).xml
    again, wrong = loaded(import_btcpp(xml.encode(), "blades.xml", CATALOGUE).text)

    assert not wrong
    assert again.params["start"].default.source == "{id: b0, at: camp}"
