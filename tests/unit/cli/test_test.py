"""`formiga test`: exit codes, what it prints, folders, names, JSON."""

import json
import re
import shutil
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.params import of_profile_by_name
from formiga_bt.show.facts import LibraryTask, ParamFact
from tests.golden import Wording

TREES = Path(__file__).parents[3] / "trees"
MOVE = str(TREES / "move_task.test.yaml")
Capture = pytest.CaptureFixture[str]

FILE = """\
formiga_test: 1
task: move_task.yaml
cases:
  - name: home
    params: {robot: lwd_1}
    expect: {end_state: {drone: at_port}}
  - name: a wrong hope
    params: {robot: lwd_1}
    expect: {status: failed, actions: [drone.TakeOff, drone.LandIn]}
"""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "mine.test.yaml"
    path.write_text(FILE, encoding="utf-8")
    return path


def test_cases_that_pass_are_a_line_each(capsys: Capture, wording: Wording) -> None:
    assert run(["test", MOVE]) == 0
    lines = capsys.readouterr().out.splitlines()
    wording(lines[0])
    assert lines[-1] == "7 cases passed"
    assert len(lines) == 8


def test_a_case_that_fails_tells_what_was_expected_and_what_came(mine: Path, capsys: Capture, wording: Wording) -> None:
    assert run(["test", str(mine)]) == 1
    out = re.sub(r" at \S*flying.yaml:\d+", " at flying.yaml:N", capsys.readouterr().out)
    wording(out.splitlines()[1:])


def test_a_name_chooses_cases(mine: Path, capsys: Capture, wording: Wording) -> None:
    assert run(["test", str(mine), "-k", "HOME"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "1 case passed"
    assert run(["test", str(mine), "-k", "nothing like it"]) == 2
    wording(capsys.readouterr().err)


def test_coverage_names_what_was_not_reached(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    shutil.copy(TREES / "pick_up.yaml", tmp_path)
    file = tmp_path / "pick_up.test.yaml"
    cases = "cases:\n  - name: no\n    params: {target: camp, user: picker_1}\n"
    cases += "    answers: [{do: drone.TakeOff, reject: no}]\n    expect: {status: failed}\n"
    file.write_text(f"formiga_test: 1\ntask: pick_up.yaml\n{cases}", encoding="utf-8")

    assert run(["test", str(file), "--coverage"]) == 0
    lines = capsys.readouterr().out.splitlines()
    wording(lines[1])
    assert f"  never reached: {tmp_path / 'pick_up.yaml'}:26 drone.LandIn" in lines


def test_json_tells_all_of_it_and_the_same_each_time(mine: Path, capsys: Capture) -> None:
    assert run(["test", str(mine), "--json", "--coverage"]) == 1
    first = capsys.readouterr().out
    assert run(["test", str(mine), "--json", "--coverage"]) == 1
    assert capsys.readouterr().out == first
    report = json.loads(first)
    assert (report["ok"], report["problems"]) == (False, [])
    (file,) = report["files"]
    assert [(case["name"], case["ok"]) for case in file["cases"]] == [("home", True), ("a wrong hope", False)]
    assert file["cases"][1]["differs"][0] == {
        "what": "status", "expected": "failed", "came": "succeeded", "lines": [],
    }  # fmt: skip
    assert file["coverage"]["percent"] == 100.0
    assert file["coverage"]["untaken"] == [f"{TREES / 'move_task.yaml'}:20 drone.TakeOff: skipped"]


def test_a_file_with_errors_is_not_played(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    bad = tmp_path / "bad.test.yaml"
    bad.write_text(FILE.replace("status: failed", "status: fine"), encoding="utf-8")

    assert run(["test", str(bad)]) == 1
    out = capsys.readouterr().out
    wording(out, out.splitlines()[-1])
    assert run(["test", str(bad), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["ok"] is False


def test_a_folder_means_its_test_files(mine: Path, capsys: Capture, wording: Wording) -> None:
    assert run(["test", str(mine.parent), "-k", "home"]) == 0
    assert run(["test", str(TREES / "lib")]) == 2
    wording(capsys.readouterr().err)
    assert run(["test", str(mine.parent / "none.test.yaml")]) == 2


def test_check_takes_test_files_too(mine: Path, capsys: Capture) -> None:
    shutil.copy(TREES / "move_task.yaml", mine.parent)

    assert run(["check", str(mine.parent)]) == 0
    assert "ok: 2 files" in capsys.readouterr().out


class TestProfiles:
    def test_a_shipped_task_is_named_and_flies_by_a_profile(self, capsys: Capture, wording: Wording) -> None:
        assert run(["dryrun", "Circle", "--profile", "paper-code", "-p", "points=8", "--json"]) == 0
        to = [a["where"] for a in json.loads(capsys.readouterr().out)["actions"] if a["action"] == "GoTo"]
        wording(to[3])
        assert len(to) == 3 + 9 + 1 + 2

    def test_what_a_person_says_ranks_above_the_profile_also_by_an_alias(
        self, tmp_path: Path, capsys: Capture, wording: Wording
    ) -> None:
        high = tmp_path / "high.yaml"
        text = "formiga_profile: 1\nprofile: high\ntasks:\n  WatchDogSOS: {height: 150 m}\n"
        high.write_text(text, encoding="utf-8")
        words = ["dryrun", "WatchDogSOS", "--profile", str(high), "-p", "alarmtype=sos", "-p", "target=camp"]
        assert run(words) == 1
        err = capsys.readouterr().err
        wording(err)
        assert run([*words, "-p", "alt=40 m"]) == 0

    @pytest.mark.parametrize(
        "words",
        [
            ["WatchDogSOS", "-p", "alarmtype=sos", "-p", "target=camp"],
            ["WatchDogRequest", "-p", "alarmtype=lost", "-p", "target=camp", "-p", "username=picker_2"],
            ["Delivery", "-p", "target=north_field", "-p", "next_stop=east_field"],
        ],
        ids=["T4", "T5", "T10"],
    )
    def test_the_missions_start_with_the_values_of_the_published_code(self, words: list[str], capsys: Capture) -> None:
        assert run(["dryrun", *words, "--profile", "paper-code", "--json"]) == 0
        capsys.readouterr()

    def test_a_profile_that_is_not_there_is_named(self, capsys: Capture, wording: Wording) -> None:
        assert run(["dryrun", "Circle", "--profile", "paper-cod"]) == 2
        wording(capsys.readouterr().err)

    def test_a_request_gets_the_texts_of_what_was_not_given(self) -> None:
        assert of_profile_by_name("paper-code", "Circle", ["radius"]) == {"points": "360"}
        assert of_profile_by_name("paper-code", "PickUp", []) == {}
        assert of_profile_by_name("", "Circle", []) == {}

    def test_a_request_by_alias_gets_them_too(self) -> None:
        params = (ParamFact(name="radius", type="distance", aliases=("r",)), ParamFact(name="points", type="int"))
        library = [LibraryTask(task="Circle", aliases=("CircleTask",), description="", file="", params=params)]
        assert of_profile_by_name("paper-code", "CircleTask", [], library) == {"radius": "5 m", "points": "360"}
        assert of_profile_by_name("paper-code", "CircleTask", ["r"], library) == {"points": "360"}

    def test_a_profile_of_ones_own_lies_in_profiles(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, wording: Wording
    ) -> None:
        (tmp_path / "profiles").mkdir()
        text = "formiga_profile: 1\nprofile: small\ntasks:\n  Circle:\n    radius: 2 m\n    center: {east: 9 m, north: 0 m}\n"
        (tmp_path / "profiles" / "small.yaml").write_text(text, encoding="utf-8")
        monkeypatch.chdir(tmp_path)

        assert run(["dryrun", "Circle", "--profile", "small", "--json"]) == 0
        to = [a["where"] for a in json.loads(capsys.readouterr().out)["actions"] if a["action"] == "GoTo"]
        wording(to[3])

    def test_a_profile_with_errors_is_refused_with_its_places(self, tmp_path: Path, capsys: Capture) -> None:
        bad = tmp_path / "bad.yaml"
        bad.write_text("formiga_profile: 2\nprofile: a b\ntask: {}\ntasks: [1]\n", encoding="utf-8")

        assert run(["dryrun", "Circle", "--profile", str(bad)]) == 1
        err = capsys.readouterr().err
        for line in (":1:18: E007:", ":2:10: E008:", ":3:1: E004:", ":4:8: E008:"):
            assert f"{bad}{line}" in err


def test_a_case_whose_loop_never_gets_on_is_given_up_and_the_loop_named(tmp_path: Path, capsys: Capture) -> None:
    task = tmp_path / "hasty.yaml"
    task.write_text("formiga: 1\ntask: Hasty\nsteps:\n  - repeat: 5 h\n    steps:\n      - wait: 1 ms\n")
    file = tmp_path / "hasty.test.yaml"
    file.write_text(
        "formiga_test: 1\ntask: hasty.yaml\nsite: demo-site.yaml\ncases:\n  - name: ends\n    expect: {status: succeeded}\n"
    )
    assert run(["test", "--json", str(file), "--most-steps", "500"]) == 1
    (case,) = json.loads(capsys.readouterr().out)["files"][0]["cases"]
    (differs,) = case["differs"]
    assert differs["what"] == "status"
    assert "hasty.yaml:4" in differs["came"]
