"""Records: values of several fields, declared by a task, a library or a catalogue, and known by their fields."""

from pathlib import Path

import pytest

from formiga_bt.base.geo import Place
from formiga_bt.engine.goals.wire_values import read_value
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Site
from formiga_bt.lang.request.binding import bind_params

LIBRARY = """
formiga: 1
records:
  find: {spot: place, score: number}
subtrees:
  Best:
    params: {finds: {list: find}}
    steps:
      - check: len(finds) > 0
    returns: ${last(sort(finds, by=item.score))}
"""
TASK = """
formiga: 1
task: Choose
imports: [best.yaml]
params:
  finds: {list: find}
steps:
  - call: Best
    with: {finds: "${finds}"}
    save_as: best
  - notify: The best is ${best.spot} of ${count(finds, item.score > 0)}.
"""
CATALOGUE = """
records:
  find: {spot: place, score: number}
types:
  scout: {mobility: none, actions: [Search], events: {found: {what: find}}}
actions:
  Search:
    fields: {known: {type: {list: find}, default: []}}
    result: {best: find, all: {list: find}}
"""
SEARCH = """
formiga: 1
task: Look
agents: {scout: {type: scout}}
vars:
  best: {type: find}
steps:
  - do: scout.Search
    save_as: got
  - set: {best: "${got.best}"}
  - do: scout.Search
    with: {known: "${append(got.all, best)}"}
  - wait_for: scout.found
    timeout: 5 min
    save_as: event
  - notify: ${event.what.score}
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "best.yaml").write_text(LIBRARY)
    (tmp_path / "choose.yaml").write_text(TASK)
    (tmp_path / "catalogue.yaml").write_text(CATALOGUE)
    (tmp_path / "look.yaml").write_text(SEARCH)
    return tmp_path


def test_who_imports_a_library_has_its_records(files: Path) -> None:
    catalogue, _, _ = load_catalogue([])
    loaded = load_task(files / "choose.yaml", catalogue=catalogue)
    assert [str(one) for one in loaded.diagnostics] == []


def test_a_record_is_given_as_text_and_is_where_the_site_allows(files: Path) -> None:
    catalogue, _, _ = load_catalogue([])
    task = load_task(files / "choose.yaml", catalogue=catalogue).task
    assert task is not None
    corners = [Place(x, y) for x, y in ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0))]
    from formiga_bt.base.geo import Region

    site = Site(name="here", lat=60.0, lng=22.0, ground_msl_m=0.0, timezone="UTC", fence=Region(tuple(corners)))

    values, problems, _ = bind_params(task, {"finds": "[{spot: {east: 3 m, north: 4 m}, score: 2}]"}, site)
    assert (values, problems) == ({"finds": ({"spot": Place(3.0, 4.0), "score": 2},)}, [])
    _, problems, _ = bind_params(task, {"finds": "[{spot: {east: 300 m, north: 4 m}, score: 2}]"}, site)
    assert [one.code for one in problems] == ["E063"]
    _, problems, _ = bind_params(task, {"finds": "[{spot: {east: 3 m, north: 4 m}}]"}, site)
    assert [one.code for one in problems] == ["E013"]


def test_a_catalogue_has_records_in_fields_results_and_events_and_tasks_know_them(files: Path) -> None:
    catalogue, problems, _ = load_catalogue([files / "catalogue.yaml"])
    assert problems == []
    assert [str(one) for one in load_task(files / "look.yaml", catalogue=catalogue).diagnostics] == []
    result = catalogue.actions["Search"].result
    raw = {"spot": {"east_m": 3.0, "north_m": 4.0}, "score": 2.0, "more": 1}
    assert read_value(result["all"], [raw]) == ({"spot": Place(3.0, 4.0), "score": 2.0},)
    for wrong in ({"score": 2.0}, {**raw, "score": "high"}, 7):
        with pytest.raises((KeyError, TypeError, ValueError)):
            read_value(result["best"], wrong)
