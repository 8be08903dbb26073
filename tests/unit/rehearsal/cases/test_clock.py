"""When test files and scenarios play: `now`, `timezone`; what the sun and times of today are then."""

from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.lang.scenario import load_scenario
from formiga_bt.rehearsal.cases.judging import judge
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.cases.running import play
from formiga_bt.rehearsal.simulation import VirtualRun

TASK = """\
formiga: 1
task: Mine
params: {until: {type: time, default: "12:00"}}
steps:
  - if: now < until
    then: [{notify: early}]
    else: [{notify: late}]
"""
FLIES = """\
formiga: 1
task: Mine
imports: [lib/flying.yaml]
agents: {drone: {type: lwd, near: "${base}"}}
steps:
  - do: drone.TakeOff
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
SCENARIO = """\
scenario: morning
site: demo-site.yaml
HEAD
agents: [{id: watcher_1, type: watcher, at: camp}]
tasks: [{task: Mine}]
"""


def differs(here: Path, head: str, case: str, task: str = TASK) -> list[str]:
    (here / "mine.yaml").write_text(task, encoding="utf-8")
    file = here / "mine.test.yaml"
    file.write_text(f"formiga_test: 1\ntask: mine.yaml\n{head}cases:\n  - name: it\n{case}", encoding="utf-8")
    loaded = load_cases(file)
    assert loaded.cases is not None, [str(one) for one in loaded.diagnostics]
    return [str(one) for one in judge(loaded.cases.cases[0], play(loaded.cases, loaded.cases.cases[0]))]


@pytest.mark.parametrize(
    ("head", "now", "said"),
    [
        ("now: 2026-06-21T11:00\n", "", "early"),
        ("now: 2026-06-21T11:00\n", "12:30", "late"),
        ("timezone: Europe/Helsinki\n", "2026-06-21T11:30", "early"),
        ("timezone: Europe/Helsinki\n", "2026-06-21T09:30Z", "late"),
        ("timezone: Europe/Helsinki\nnow: 2026-06-21T11:30\n", "12:30", "late"),
    ],
)
def test_a_file_says_day_and_zone_of_its_cases(head: str, now: str, said: str, tmp_path: Path) -> None:
    at = f"    now: {now}\n" if now else ""

    assert differs(tmp_path, head, f"{at}    expect: {{notices: [{said}]}}\n") == []


@pytest.mark.parametrize(("head", "said"), [("now: 11:00", "early"), ("now: 13:00", "late")])
def test_a_scenario_begins_when_it_says(head: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(TASK, encoding="utf-8")
    (tmp_path / "morning.yaml").write_text(SCENARIO.replace("HEAD", head), encoding="utf-8")
    loaded = load_scenario(tmp_path / "morning.yaml")
    assert loaded.scenario is not None, [str(one) for one in loaded.diagnostics]
    run = VirtualRun(loaded.scenario)

    assert run.run()
    assert said in str(run.steps)
    run.close()


@pytest.mark.parametrize(("now", "status"), [("2026-06-21T12:00", "succeeded"), ("2026-12-21T23:00", "failed")])
def test_the_sun_is_where_it_is_then(now: str, status: str, tmp_path: Path) -> None:
    site = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8")
    assert "\nenvelope:" not in site
    (tmp_path / "dark-site.yaml").write_text(f"{site}\nenvelope: {{daylight_only: true}}\n", encoding="utf-8")
    head = f"site: dark-site.yaml\nnow: {now}\n"
    code = ", code: envelope.daylight_only" if status == "failed" else ""

    assert differs(tmp_path, head, f"    expect: {{status: {status}{code}}}\n", f"{FLIES}timeout: 20 min\n") == []


@pytest.mark.parametrize(("head", "code"), [("timezone: Europe/Helsinky\n", "E008"), ("now: noon\n", "E016")])
def test_no_such_zone_or_time_is_told(head: str, code: str, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(TASK, encoding="utf-8")
    file = tmp_path / "mine.test.yaml"
    file.write_text(f"formiga_test: 1\ntask: mine.yaml\n{head}cases: [{{name: it, expect: {{}}}}]\n", encoding="utf-8")
    (tmp_path / "morning.yaml").write_text(SCENARIO.replace("HEAD", head), encoding="utf-8")

    assert [one.code for one in load_cases(file).diagnostics] == [code]
    assert [one.code for one in load_scenario(tmp_path / "morning.yaml").diagnostics] == [code]
