"""Parameters from texts: read as the language reads literals, all problems at once."""

from collections.abc import Callable

import pytest

from formiga_bt.base.diagnostics import render
from formiga_bt.base.geo import Place, Region, is_within
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.lang.types import AgentRef
from tests.golden import Wording

TEXT = """\
params:
  target: {type: place, aliases: [where]}
  user: {type: agent, of: [picker]}
  height: {type: distance, default: 60 m, min: 10 m, max: 120 m}
  alarm: {type: enum, values: [sos, geofence], optional: true}
  rounds: {type: int, optional: true, min: 1}
  note: {type: text, optional: true}
agents:
  watcher: {type: watcher}
steps:
  - notify: ${target} ${user} ${height}
    to: [watcher]
"""

Bind = Callable[..., tuple[dict[str, object], list[str]]]


@pytest.fixture
def bind(load: Callable[[str], object], demo_site: Site) -> Bind:
    task: Task | None = load(TEXT).task  # type: ignore[attr-defined]
    assert task is not None

    def bound(**raw: str) -> tuple[dict[str, object], list[str]]:
        values, problems, sources = bind_params(task, raw, demo_site)
        return values, [render(problem, sources) for problem in problems]

    return bound


def test_names_units_and_agents_become_values(bind: Bind, demo_site: Site) -> None:
    values, problems = bind(target="camp", user="picker_1", height="45 m", alarm="sos", rounds="3", note="on: 1, ${x}")
    assert problems == []
    assert values == {
        "target": demo_site.places["camp"],
        "user": AgentRef("picker_1"),
        "height": 45.0,
        "alarm": "sos",
        "rounds": 3,
        "note": "on: 1, ${x}",
    }


@pytest.mark.parametrize("text", ["66.5, 25.7", "66.5,25.7", "{lat: 66.5, lng: 25.7}", "{east: 0 m, north: 0 m}"])
def test_a_place_may_be_degrees_or_metres(bind: Bind, text: str) -> None:
    values, problems = bind(target=text, user="picker_1")
    assert problems == []
    assert values["target"] == Place(0.0, 0.0)


def test_an_alias_is_its_parameter(bind: Bind, demo_site: Site) -> None:
    values, problems = bind(where="camp", user="picker_1")
    assert (values["target"], problems) == (demo_site.places["camp"], [])


def test_a_parameter_and_its_alias_cannot_both_be_given(bind: Bind, wording: Wording) -> None:
    _, problems = bind(target="camp", where="camp", user="picker_1")
    assert len(problems) == 1
    wording(problems[0])


def test_what_is_left_out_keeps_its_default(bind: Bind) -> None:
    values, problems = bind(target="camp", user="picker_1")
    assert problems == []
    assert set(values) == {"target", "user"}


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("target", "kamp", "E010: the site has no place 'kamp'; did you mean 'camp'?"),
        ("target", "", "E008: 'target' is empty, it needs a value (place)"),
        ("target", "[camp", "parameter target:1:"),
        ("user", "hwd_1", "E013: expected a picker agent, 'hwd_1' is a hwd agent"),
        ("height", "45", "E017: 45 needs a unit: 45 m?"),
        ("height", "45 kg", "parameter height:1:1: E"),
        ("height", "1e308 m", "E013: 1e308 m is too large"),
        ("height", "121 m", "E062: 'height' must be at most 120 m\n    1 | 121 m\n      | ^^^^^"),
        ("height", "9 m", "E062: 'height' must be at least 10 m"),
        ("rounds", "0", "E062: 'rounds' must be at least 1"),
        ("alarm", "fire", "E014: 'fire' is never possible here"),
        ("rounds", "two", "parameter rounds:1:1: E"),
        ("target", "${now}", "E027: 'now' has no value here: this is read before there is a task"),
        ("target", "${task.name}", "E027: 'task' has no value here"),
        ("target", "${bas}", "E010: unknown name 'bas'; did you mean 'base'?"),
        ("target", "base", "did you mean ${base}?"),
        ("target", "${[base][3]}", "E062: 'target' has no value: "),
        ("rounds", "${1 // 0}", "E013: this never has a value: division by zero"),
        ("target", "{east: 700 m, north: 0 m}", "E063: 'target' lies outside the fence of site rovaniemi"),
        ("target", "66.0, 25.7", "E063: 'target' lies outside the fence of site rovaniemi"),
        ("target", "${offset(base, 600.01 m)}", "E063: 'target' lies outside the fence of site rovaniemi"),
        ("nope", "1", "E010: Example has no parameter 'nope'"),
        ("hieght", "50 m", "E010: Example has no parameter 'hieght'; did you mean 'height'?"),
    ],
)
def test_what_cannot_be_read_is_said_in_words(bind: Bind, name: str, text: str, said: str) -> None:
    _, problems = bind(**{"target": "camp", "user": "picker_1", name: text})
    assert len(problems) == 1
    assert said in problems[0]


def test_all_problems_are_reported_at_once(bind: Bind, wording: Wording) -> None:
    values, problems = bind(tagret="camp", height="500 m")
    assert values == {}
    assert [p.splitlines()[0].split(": ", 2)[1] for p in problems] == ["E010", "E062", "E051", "E051"]
    wording(problems[2], problems[3])


def test_one_that_is_wrong_is_not_called_missing_as_well(bind: Bind) -> None:
    _, problems = bind(target="kamp", user="picker_1")
    assert len(problems) == 1


def test_base_and_the_site_may_be_read(bind: Bind, demo_site: Site) -> None:
    values, problems = bind(target="${base}", user="picker_1", height="${distance(base, site.ports.p5) + 10 m}")
    assert problems == []
    assert values["target"] == Place(0.0, 0.0)
    values, problems = bind(target="${offset(site.places.camp, 10 m)}", user="picker_1")
    assert (values["target"], problems) == (Place(40.0, -40.0), [])


@pytest.mark.parametrize("text", ["base", "now", "task.run", "site.places", "distance(base, site)"])
def test_nothing_is_proposed_that_then_fails(bind: Bind, text: str) -> None:
    _, problems = bind(target="camp", user="picker_1", height=text)
    assert len(problems) == 1
    assert "did you mean" not in problems[0]


def test_the_fence_itself_is_inside(bind: Bind) -> None:
    for text in ("{east: 600 m, north: 0 m}", "{east: -600 m, north: 600 m}", "${offset(base, 0 m, -600 m)}"):
        assert bind(target=text, user="picker_1")[1] == []


def test_a_default_outside_the_fence_warns_when_checked_and_is_refused_when_used(
    catalogue: Catalogue, demo_site: Site
) -> None:
    text = (
        "formiga: 1\ntask: Far\nparams:\n  target: {type: place, default: {east: 700 m, north: 0 m}}\n"
        "agents:\n  drone: {type: lwd, near: '${target}'}\n"
        "vars:\n  spots: '${[offset(base, 0 m, 900 m), site.places.camp]}'\n  over: ${above(site.places.camp, 9 m)}\n"
        "steps:\n  - notify: ${spots} ${drone.id} ${over}\n"
    )
    loaded = load_task_text(text, "far.yaml", catalogue=catalogue, site=demo_site)
    assert [(d.code, d.mark.line) for d in loaded.diagnostics] == [("W063", 4), ("W063", 8)]
    assert load_task_text(text, "far.yaml", catalogue=catalogue).diagnostics == []
    assert loaded.task is not None
    _, problems, _ = bind_params(loaded.task, {}, demo_site)
    assert [p.code for p in problems] == ["E063"]


def test_the_border_of_a_bent_fence() -> None:
    bent = Region((Place(0, 0), Place(10, 0), Place(10, 10), Place(5, 5), Place(0, 10)))
    inside = [(0, 0), (5, 5), (2.5, 7.5), (5, 4.9), (1, 8), (9, 8.9), (10, 3), (5, 0)]
    outside = [(5, 5.1), (5, 9), (-0.01, 0), (5, -0.01), (10.01, 10), (0, 10.01), (3, 7.5)]
    assert [p for p in inside if not is_within(Place(*p), bent)] == []
    assert [p for p in outside if is_within(Place(*p), bent)] == []
