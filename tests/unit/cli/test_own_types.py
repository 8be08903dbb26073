"""A site with a type of its own: from `new` to a dry run, test cases and a scenario, with no line of code."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run

SITE = """formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
ports: {p1: {at: {east: 0 m, north: 20 m}}}
places: {pit: {east: 60 m, north: 60 m}}
people: {watchers: [watcher_1]}
agents:
  crane_1: {type: crane, home: p1}
  watcher_1: {type: watcher}
actions: [actions/crane.yaml]
"""
CRANE = """types:
  crane: {extends: hwd, label: crane drone, actions: [Winch]}
actions:
  Winch:
    fields: {down: {type: distance, min: 0 m, max: 20 m}}
    result: {held: mass, state: {type: enum, values: [slack, tight]}}
    requires: airborne
    repeatable: true
    typical: 20 s
"""
STEPS = """agents:
  crane: {type: crane}
steps:
  - do: crane.TakeOff
  - do: crane.Winch
    with: {down: 5 m}
  - do: crane.Winch
    with: {down: 0 m}
    save_as: hook
    timeout: 2 min
  - notify: It holds ${hook.held}.
  - do: crane.LandIn
    with: {at: "${crane.home}"}
"""
CASES = """formiga_test: 1
task: lift.yaml
site: ../site.yaml
cases:
  - name: the hook is empty
    expect: {notices: [It holds 0 kg], actions: [crane.TakeOff, crane.Winch, crane.Winch, crane.LandIn]}
  - name: it brings something up
    results: [{do: Winch, nth: 2, give: {held: 3 kg, state: tight}}]
    expect: {notices: [It holds 3 kg]}
  - name: it jams
    results: [{do: crane_1.Winch, fail: jammed}]
    expect: {status: failed, code: "failed:jammed", end_state: {crane: at_port}}
  - name: it is late
    results: [{do: Winch, nth: 2, delay: 5 min}]
    expect: {status: failed, code: timeout, end_state: {crane: at_port}}
"""
DAY = """scenario: lifting
site: site.yaml
speed: 20
agents: [{id: crane_1}, {id: watcher_1, at: pit}]
tasks: [{at: 0 s, task: Lift}]
results: [{do: Winch, nth: 1, delay: 2 s}]
"""


@pytest.fixture(autouse=True)
def yard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("actions").mkdir()
    Path("trees").mkdir()
    Path("site.yaml").write_text(SITE)
    Path("actions/crane.yaml").write_text(CRANE)
    assert run(["new", "Lift", "--kind", "empty"]) == 0
    file = Path("trees/lift.yaml")
    head = file.read_text().partition("\n# params")[0].partition("\nsteps")[0]
    file.write_text(head + "\n" + STEPS)
    Path("trees/lift.test.yaml").write_text(CASES)
    Path("lifting.yaml").write_text(DAY)
    capsys.readouterr()


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    code = run(list(words))
    read = capsys.readouterr()
    return code, read.out + read.err


def test_every_file_checks(capsys: pytest.CaptureFixture[str]) -> None:
    files = ["trees/lift.yaml", "trees/lift.test.yaml", "site.yaml", "actions/crane.yaml", "lifting.yaml"]
    code, out = said(capsys, "check", "--strict", "--site", "site.yaml", *files)

    assert code == 0, out


def test_it_is_dry_run(capsys: pytest.CaptureFixture[str]) -> None:
    code, out = said(capsys, "dryrun", "trees/lift.yaml", "--json")

    assert code == 0, out
    assert [row["action"] for row in json.loads(out)["actions"]] == ["TakeOff", "Winch", "Winch", "LandIn"]


def test_its_cases_are_played_with_the_results_that_they_want(capsys: pytest.CaptureFixture[str]) -> None:
    code, out = said(capsys, "test", "trees", "--json")

    assert code == 0, out
    assert [case["ok"] for file in json.loads(out)["files"] for case in file["cases"]] == [True] * 4


def test_its_scenario_is_played(capsys: pytest.CaptureFixture[str]) -> None:
    code, out = said(capsys, "sim", "lifting.yaml", "--virtual", "--json")

    assert code == 0, out


@pytest.mark.parametrize(
    ("result", "code"),
    [
        ("{do: Winch, give: {held: 3 m}}", "E017"),
        ("{do: Winch, give: {held: yes}}", "E016"),
        ("{do: Winch, give: {state: loose}}", "E014"),
        ("{do: Winch, give: {hold: 3 kg}}", "E022"),
        ("{do: Wynch, give: {held: 3 kg}}", "E021"),
        ("{do: watcher_1.Winch, fail: jammed}", "E021"),
        ("{do: crane_2.Winch, fail: jammed}", "E010"),
        ("{do: Winch}", "E008"),
        ("{do: Winch, fail: jammed, give: {held: 3 kg}}", "E008"),
        ("{do: Winch, nth: 0, fail: jammed}", "E062"),
        ("{do: Winch, delay: -1 s}", "E062"),
    ],
)
@pytest.mark.parametrize("file", ["lifting.yaml", "trees/lift.test.yaml"])
def test_a_result_that_cannot_be_is_a_diagnostic_with_its_place(
    capsys: pytest.CaptureFixture[str], result: str, code: str, file: str
) -> None:
    path = Path(file)
    lines = [line for line in path.read_text().splitlines() if "results:" not in line or "nth" in line]
    at = next(number for number, line in enumerate(lines) if "results:" in line)
    lines[at] = lines[at].partition("results:")[0] + f"results: [{result}]"
    path.write_text("\n".join(lines) + "\n")

    exit_code, out = said(capsys, "check", "--json", "--site", "site.yaml", file)
    found = [one for one in json.loads(out)["diagnostics"] if one["severity"] == "error"]

    assert exit_code == 1
    assert [(one["code"], one["line"]) for one in found] == [(code, at + 1)], found
