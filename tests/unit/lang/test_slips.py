"""Slips of a first task: each is told once, where it is, with a way out that works."""

from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.interpolation import shown
from formiga_bt.lang.loader import Loaded, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.request.binding import SiteEnv, bind_params
from formiga_bt.lang.types import PLACE, POSITION, list_of
from tests.golden import Wording

Load = Callable[[str], Loaded]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("steps:\n  - wait: -3 s\n", "E062 'wait' is a duration, it cannot be below 0 s"),
        ("steps:\n  - wait: ${-3 s}\n", "E062 'wait' is a duration, it cannot be below 0 s"),
        ("steps:\n  - wait: 1 s\n    retry: {attempts: 2, delay: -1 s}\n", "E062 'delay' is a duration"),
        ("steps:\n  - repeat: 3\n    every: -1 s\n    steps: [{wait: 1 s}]\n", "E008 'every' must be longer than 0 s"),
        ("steps:\n  - repeat: -1 min\n    steps: [{wait: 1 s}]\n", "E008 'repeat' must be longer than 0 s"),
        ('steps:\n  - repeat: "${-1 min}"\n    steps: [{wait: 1 s}]\n', "E008 'repeat' must be longer than 0 s"),
        (
            "agents:\n  a: {type: picker}\n  b: {type: picker}\n"
            "steps:\n  - ask: Well?\n    of: [a, b]\n    timeout: 1 min\n    escalate_after: -1 s\n",
            "E062 'escalate_after' is a duration",
        ),
        (
            "params:\n  pause: {type: duration, default: -1 s}\nsteps:\n  - wait: ${pause}\n",
            "E061 'pause' is a duration, it cannot be below 0 s",
        ),
        ("agents:\n  a: {type: picker, wait: -1 s}\nsteps:\n  - notify: ${a.id}\n", "E062 'wait' is a duration"),
        (
            "steps:\n  - call: Rest\n    with: {pause: -1 s}\n"
            "subtrees:\n  Rest:\n    params: {pause: duration}\n    steps: [{wait: '${pause}'}]\n",
            "E062 'pause' is a duration",
        ),
    ],
)
def test_a_constant_duration_below_zero_is_refused(load: Load, text: str, said: str) -> None:
    found = [f"{d.code} {d.message}" for d in load(text).diagnostics]
    assert len(found) == 1
    assert said in found[0]


def test_a_param_of_type_duration_is_at_least_zero_unless_it_says_otherwise(
    load: Load, demo_site: Site, wording: Wording
) -> None:
    text = "params:\n  pause: duration\n  shift: {type: duration, min: -9 s}\nsteps:\n  - wait: ${pause + shift}\n"
    task = load(text).task
    assert task is not None
    _, problems, _ = bind_params(task, {"pause": "-1 s", "shift": "-1 s"}, demo_site)
    wording([p.message for p in problems])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("agents:\n  a: {type: lwd, battery_min: 150 %}\nsteps:\n  - notify: ${a.id}\n", "E062 'battery_min'"),
        ("agents:\n  a: {type: lwd, battery_min: -5 %}\nsteps:\n  - notify: ${a.id}\n", "E062 'battery_min'"),
        ("params:\n  least: {type: percent, default: 150 %}\nsteps:\n  - notify: At ${least}\n", "E061 'least'"),
        ("params:\n  least: {type: percent, default: -1 %}\nsteps:\n  - notify: At ${least}\n", "E061 'least'"),
        (
            "steps:\n  - call: Rest\n    with: {least: 101 %}\n"
            "subtrees:\n  Rest:\n    params: {least: percent}\n    steps: [{notify: At least}]\n",
            "E062 'least'",
        ),
    ],
)
def test_a_constant_percent_is_between_0_and_100(load: Load, text: str, said: str, wording: Wording) -> None:
    found = [f"{d.code} {d.message}" for d in load(text).diagnostics if d.severity == "error"]
    wording(found)


@pytest.mark.parametrize("least", ["0 %", "100 %"])
def test_the_ends_of_a_percent_are_percents(load: Load, least: str) -> None:
    text = f"agents:\n  a: {{type: lwd, near: '${{base}}', battery_min: {least}}}\nsteps:\n  - notify: ${{a.id}}\n"
    assert load(text).diagnostics == []


def test_a_param_of_type_percent_is_held_to_it_at_submission(load: Load, demo_site: Site, wording: Wording) -> None:
    text = (
        "params:\n  least: percent\n  change: {type: percent, min: -20 %}\nsteps:\n  - notify: At ${least + change}\n"
    )
    task = load(text).task
    assert task is not None
    for value in ("-150 %", "101 %"):
        _, problems, _ = bind_params(task, {"least": value, "change": "-1 %"}, demo_site)
        wording([str(p.message) for p in problems])
    assert bind_params(task, {"least": "100 %", "change": "-20 %"}, demo_site)[1] == []


def test_a_name_in_a_misspelt_field_counts_as_used(load: Load) -> None:
    text = (
        "params:\n  high: distance\nagents:\n  drone: {type: lwd}\nsteps:\n"
        "  - do: drone.TakeOff\n    with:\n      altitud: ${high}\n"
        "  - do: drone.LandIn\n    with:\n      at: ${drone.home}\n"
    )
    assert [d.code for d in load(text).diagnostics] == ["E022"]


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        # What is wrong in a step tells nothing of the names in it.
        ("params: {at: place}\nagents: {d: {type: lwd}}\nsteps:\n  - do: d.Fly\n    with: {to: '${at}'}\n", ["E021"]),
        (
            "params: {at: place}\nagents: {d: {type: lwd}}\nsteps:\n  - do: d.GoTo\n    to: ${at}\n",
            ["E030", "E022", "E004"],
        ),
        ("params: {far: distance}\nsteps:\n  - check: site.farr > far\n", ["E011"]),
        (
            "params: {at: place}\nagents: {d: {type: lwd, near: '${abve(at)}'}}\nsteps:\n  - do: d.TakeOf\n",
            ["E012", "E021"],
        ),
        ("params: {n: int}\nsteps:\n  - wait: 1 s\nepilogue:\n  - notify: It is ${n}.\n", ["E004"]),
        (
            "params: {at: place}\nagents: {d: {type: lwd, beside: '${at}'}}\nsteps:\n  - notify: It is ${d.id}.\n",
            ["E004"],
        ),
        ("params: {n: int}\nsteps:\n  - wait: 1 s\nfinaly:\n  - notify: It is ${n}.\n", ["E004"]),
        ("steps:\n  - call: Nap\n    wait: 1 s\nsubtrees:\n  Nap:\n    steps: [{wait: 5 s}]\n", ["E005"]),
        (
            "imports: [lib/flying.yaml]\nagents: {d: {type: lwd}}\nsteps:\n  - call: ReturnHome\n    wait: ${d.battery}\n",
            ["E005"],
        ),
        (
            "steps:\n  - call: Nap\nsubtrees:\n  Nap:\n    params: {far: distance}\n    steps:\n      - chek: far > 3 m\n",
            ["E050", "E006"],
        ),
        # What no step mentions is left over all the same; so is what the step itself saves.
        ("params: {at: place}\nsteps:\n  - wat: 1 s\n", ["W060", "E006"]),
    ],
)
def test_names_in_what_has_an_error_are_not_called_unused(load: Load, text: str, codes: list[str]) -> None:
    assert [d.code for d in load(text).diagnostics] == codes


def test_keys_with_a_capital_are_named(catalogue: Catalogue, wording: Wording) -> None:
    loaded = load_task_text("Formiga: 1\nTask: Hello\nsteps:\n  - wait: 1 s\n", "a.yaml", catalogue=catalogue)
    assert [(d.code, d.mark.line) for d in loaded.diagnostics] == [("E007", 1), ("E004", 2)]
    wording(loaded.diagnostics[0].message, loaded.diagnostics[1].message)


def test_a_role_of_the_task_is_proposed_before_one_of_the_site(load: Load, wording: Wording) -> None:
    head = "agents:\n  watcher: {type: watcher}\nsteps:\n  - notify: ${watcher.id}\n"
    wording(load(head + "    to: [watchr]\n").diagnostics[0].message)
    said = load(head + "  - do: watchrs.Confirm\n").diagnostics[0]
    assert "watchers" not in said.message + said.help


def test_the_way_home_names_its_import_where_it_is_missing(load: Load, wording: Wording) -> None:
    up = "agents:\n  drone: {type: lwd}\nsteps:\n  - do: drone.TakeOff\n"
    (found,) = load(up).diagnostics
    wording(found.help)
    (found,) = [d for d in load("imports: [lib/flying.yaml]\n" + up).diagnostics if d.code == "E031"]
    wording(found.help)


def test_both_verbs_refuse_a_site_with_an_unknown_agent_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    from formiga_bt.cli.app import run

    monkeypatch.chdir(tmp_path)
    assert run(["init", "."]) == 0
    site = tmp_path / "site.yaml"
    site.write_text(site.read_text().replace("type: picker}", "type: piker}"))
    for words in (["dryrun", "trees/hello.yaml", "--site", "site.yaml"], ["up", "--sim", "--site", "site.yaml"]):
        capsys.readouterr()
        assert run(words) != 0
        said = capsys.readouterr().err
        wording(said)


def test_people_read_the_name_of_a_place(demo_site: Site, wording: Wording) -> None:
    env = SiteEnv(demo_site)
    assert shown(demo_site.places["camp"], PLACE, env) == "camp"
    assert shown(Place(30.9, -40.0), PLACE, env) == "camp"
    assert shown(Place(31.1, -40.0), PLACE, env) == "66.49964, 25.70070"
    assert shown((Place(20.0, 260.5), Place(0.0, 0.0)), list_of(PLACE), env) == "north_field, 66.50000, 25.70000"
    wording(shown(Position(30.0, -40.0, 60.0), POSITION, env))
