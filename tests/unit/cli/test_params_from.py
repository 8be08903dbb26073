"""Parameters from files: `--params-from` of dryrun and run, `params_from` of scenarios and test files."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording
from tests.unit.cli.paper import PaperClient

Capture = pytest.CaptureFixture[str]
ROUND = """\
formiga: 1
task: Round
params:
  spots: {type: {list: place}}
  rest: {type: duration, default: 5 s}
steps:
  - for:
      spot: ${spots}
    steps:
      - notify: Now ${spot}.
      - wait: ${rest}
"""
SPOTS = "id,lat,lng\na,66.501,25.7\nb,66.502,25.701\n"
TEST = """\
formiga_test: 1
task: round.yaml
cases:
  - name: two spots
    params_from: FROM
    params: {rest: 1 s}
    expect: {status: succeeded, notices: [Now, Now], max_time: 3 s}
"""
SCENARIO = """\
scenario: two-spots
site: demo-site.yaml
agents: [{id: watcher_1, type: watcher, at: camp}]
tasks: [{at: 0 s, task: Round, params_from: [spots.csv]}]
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in (("round.yaml", ROUND), ("spots.csv", SPOTS), ("day.yaml", "spots: [camp]\nrest: 9 s\n")):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("words", ["spots.csv", "spots=spots.csv", "day.yaml"])
def test_a_dry_run_takes_them(words: str, capsys: Capture) -> None:
    assert run(["dryrun", "round.yaml", "--params-from", words]) == 0, capsys.readouterr().err
    assert capsys.readouterr().out.count("Now ") == (1 if words == "day.yaml" else 2)


def test_what_is_wrong_is_told_with_its_row(here: Path, capsys: Capture, wording: Wording) -> None:
    (here / "spots.csv").write_text(SPOTS.replace("66.502", "66,502"), encoding="utf-8")
    assert run(["dryrun", "round.yaml", "--params-from", "spots.csv"]) == 1
    wording(capsys.readouterr().err)
    assert run(["dryrun", "round.yaml", "--params-from", "none.csv"]) == 2
    wording(capsys.readouterr().err)
    assert run(["dryrun", "round.yaml", "--params-from", "=none.csv"]) == 2


@pytest.mark.parametrize("files", ["spots.csv", "[spots.csv]", "{spots: spots.csv}"])
def test_a_case_takes_them(files: str, here: Path, capsys: Capture) -> None:
    (here / "round.test.yaml").write_text(TEST.replace("FROM", files), "utf-8")

    assert run(["test", "round.test.yaml"]) == 0, capsys.readouterr().out


def test_what_a_case_cannot_take_is_told_with_its_row(here: Path, capsys: Capture, wording: Wording) -> None:
    (here / "spots.csv").write_text("id,lat,lng\na,66.501,\nb,66.502,25.701\n", encoding="utf-8")
    for files in ("spots.csv", "none.csv", "/etc/hosts", "{rest: spots.csv}", "round.test.yaml"):
        (here / "round.test.yaml").write_text(TEST.replace("FROM", files), encoding="utf-8")
        assert run(["check", "round.test.yaml"]) == 1
        wording(capsys.readouterr().out)


def test_a_scenario_takes_them(here: Path, capsys: Capture) -> None:
    (here / "two.yaml").write_text(SCENARIO, encoding="utf-8")

    assert run(["check", "two.yaml"]) == 0
    assert run(["sim", "two.yaml", "--virtual"]) == 0, capsys.readouterr()


def test_a_running_engine_is_sent_their_texts(monkeypatch: pytest.MonkeyPatch) -> None:
    class Paper(PaperClient):
        def take(self, path: str, body: object) -> object:
            sent.append((path, body))
            return {"id": "Round-1"}

    sent: list[tuple[str, object]] = []
    monkeypatch.setattr("formiga_bt.cli.operator.run.connect", lambda *_args: Paper())

    assert run(["run", "Round", "--params-from", "spots=spots.csv", "-p", "rest=1 s"]) == 0
    ((path, body),) = sent
    assert path == "/v1/tasks"
    assert isinstance(body, dict)
    assert body["params_from"] == [{"file": "spots.csv", "text": SPOTS, "param": "spots"}]
