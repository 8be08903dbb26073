"""Other names of tasks and params: who is meant, what is refused."""

from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import render
from formiga_bt.base.geo import Place
from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import Loaded
from formiga_bt.lang.model import Site
from formiga_bt.lang.request.aliases import find_task, given_params, names_in
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.lang.scenario import load_scenario_text
from formiga_bt.rehearsal.testing import packaged_task, packaged_world

Load = Callable[[str], Loaded]
BODY = "steps: [{notify: hello}]\n"


# -- tasks ---------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("formiga: 1\ntask: Look\n", ["Look"]),
        ("task: Look   # who\naliases: [Gaze, Stare]   # once called\n", ["Look", "Gaze", "Stare"]),
        ("aliases:\n  - Gaze   # Old\n- Stare\ntask: Look\nsteps: [{wait: 1 s}]\n", ["Look", "Gaze", "Stare"]),
        ("task: Look\nparams:\n  n: {type: int, aliases: [m]}\n  k:\n    aliases: [l]\n", ["Look"]),
        ("aliases: [Gaze]\nsubtrees: {}\n", []),
    ],
)
def test_the_names_of_a_task_are_read_off_its_text(text: str, names: list[str]) -> None:
    assert names_in(text) == names


def test_what_a_file_says_is_what_its_text_says() -> None:
    for path in folder("trees").glob("*.yaml"):
        names = names_in(path.read_text(encoding="utf-8"))
        if names and not path.name.endswith((".test.yaml", "site.yaml")):
            assert names[1:] == list(packaged_task(path.stem).aliases), path


@pytest.mark.parametrize(
    ("alias", "file"),
    [
        ("TriangleTask", "triangle"), ("LangGetTask", "triangle"), ("CircleTask", "circle"), ("ZigzagTask", "zig_zag"),
        ("DeliverTask", "delivery"), ("WatchdogSOS", "watch_dog_sos"), ("WatchdogRequest", "watch_dog_request"),
    ],
)  # fmt: skip
def test_the_spellings_of_the_paper_are_known(alias: str, file: str) -> None:
    tasks = {task.name: task for task in map(packaged_task, ("pick_up", file))}
    assert find_task(tasks, alias) is tasks[packaged_task(file).name]


def test_a_name_goes_before_an_alias(load: Load) -> None:
    one, other = load(f"aliases: [Gaze]\n{BODY}").task, load(BODY).task
    assert one is not None
    assert other is not None
    assert find_task({"Look": one, "Gaze": other}, "Gaze") is other
    assert find_task({"Look": one}, "Gaze") is one
    assert find_task({"Look": one}, "gaze") is None


@pytest.mark.parametrize(
    ("aliases", "said"),
    [
        ("[Gaze, Gaze]", ["E018: this task is called 'Gaze' already"]),
        ("[Example]", ["E018: this task is called 'Example' already"]),
        ("[gaze, to_look]", [
            "E008: a task's name is CamelCase, this is 'gaze'", "E008: a task's name is CamelCase, this is 'to_look'",
        ]),
    ],
)  # fmt: skip
def test_aliases_of_a_task_are_names_of_tasks(load: Load, aliases: str, said: list[str]) -> None:
    assert [f"{d.code}: {d.message}" for d in load(f"aliases: {aliases}\n{BODY}").diagnostics] == said


def test_a_scenario_may_use_an_alias(tmp_path: Path) -> None:
    head = "scenario: day\nsite: demo-site.yaml\nagents: [{id: lwd_1}]\n"
    text = f"{head}tasks: [{{task: TriangleTask, params: {{target: {{east: 5 m, north: 0 m}}}}}}]\n"
    found = load_scenario_text(text, "day.yaml", catalogue=packaged_world()[1], folders=(tmp_path, folder("trees")))
    assert found.diagnostics == []
    assert found.scenario is not None
    assert [task.task for task in found.scenario.requests] == ["Triangle"]
    assert list(found.scenario.tasks) == ["Triangle"]


# -- params ----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("params", "said"),
    [
        ("a: {type: int, aliases: [b]}, b: int", "E018: 'b' is a param already"),
        ("a: {type: int, aliases: [c]}, b: {type: int, aliases: [c]}", "E018: 'c' is the param 'a' already"),
        ("a: {type: int, aliases: [a]}", "E018: 'a' is a param already"),
    ],
)
def test_an_alias_is_for_one_param(load: Load, params: str, said: str) -> None:
    found = load(f"params: {{{params}}}\nsteps: [{{notify: hello}}]\n").diagnostics
    assert [f"{d.code}: {d.message}" for d in found if d.code != "W060"] == [said]


PLACES = """\
params:
  target: {type: place}
  next: {type: place, optional: true, aliases: [target2]}
  n: {type: int, default: 1}
steps:
  - notify: ${target} ${n}
  - notify: then ${next}
    when: is_set(next)
"""
ONE = "params: {corner: place}\nsteps: [{notify: 'at ${corner}'}]\n"
HERE = Place(0.0, 0.0)

Bound = Callable[..., tuple[dict[str, object], list[str]]]


@pytest.fixture
def bound(load: Load, demo_site: Site) -> Bound:
    def bind(text: str, **raw: str) -> tuple[dict[str, object], list[str]]:
        task = load(text).task
        assert task is not None
        values, problems, sources = bind_params(task, raw, demo_site)
        return values, [render(problem, sources) for problem in problems]

    return bind


@pytest.mark.parametrize("lng", ["lng", "lon"])
def test_degrees_apart_are_the_place_that_is_called_target(bound: Bound, lng: str) -> None:
    assert bound(PLACES, lat="66.5", **{lng: "25.7"}) == ({"target": HERE}, [])


def test_degrees_with_an_ending_are_the_place_with_that_ending_also_by_an_alias(bound: Bound) -> None:
    values, problems = bound(PLACES, target="camp", lat2="66.5", lon2="25.7")
    assert (values["next"], problems) == (HERE, [])


def test_a_task_with_one_place_needs_no_target(bound: Bound) -> None:
    assert bound(ONE, lat=" 66.5", lng="25.7") == ({"corner": HERE}, [])


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        ({"lat": "66.5"}, "parameter lat:1:1: E051: 'lat' is half a place: 'lng' is missing"),
        ({"lng": "25.7"}, "parameter lng:1:1: E051: 'lng' is half a place: 'lat' is missing"),
        ({"target": "camp", "lat2": "66.5"}, "parameter lat2:1:1: E051: 'lat2' is half a place: 'lng2' is missing"),
        (
            {"target": "camp", "lat": "66.5", "lng": "25.7"},
            "parameter lat and lng:1:1: E018: 'lat and lng' and 'target' are the same parameter",
        ),
        ({"lat": "north", "lng": "25.7"}, "parameter lat and lng:1:7: E016: "),
        ({"lat": "95", "lng": "25.7"}, "parameter lat and lng:1:"),
        ({"lat": "66.5", "lng": "25.7", "lon": "1"}, "parameter lon:1:1: E010: Example has no parameter 'lon'"),
        ({"target": "camp", "lat3": "1", "lng3": "2"}, "parameter lat3:1:1: E010: Example has no parameter 'lat3'"),
    ],
)
def test_degrees_that_are_no_place_are_told(bound: Bound, raw: dict[str, str], said: str) -> None:
    _, problems = bound(PLACES, **raw)
    assert problems[0].startswith(said)


def test_params_that_are_called_so_are_left_alone(bound: Bound) -> None:
    text = "params: {lat: number, lng: number, spot: place}\nsteps: [{notify: '${lat} ${lng} ${spot}'}]\n"
    assert bound(text, lat="1", lng="2", spot="66.5,25.7") == ({"lat": 1.0, "lng": 2.0, "spot": HERE}, [])


def test_what_was_given_is_known_under_whatever_names(load: Load) -> None:
    task = load(PLACES).task
    assert task is not None
    assert given_params(task.params, ["lat", "lng", "target2", "other"]) == {"target", "next", "other"}


def test_the_papers_calls_are_understood(demo_site: Site) -> None:
    call = {"robotPreference": "lwd_1", "lat": "66.5", "lon": "25.7", "lat2": "66.5", "lon2": "25.7"}
    values, problems, _ = bind_params(packaged_task("delivery"), call, demo_site)
    assert problems == []
    assert (values["target"], values["next_stop"]) == (HERE, HERE)
