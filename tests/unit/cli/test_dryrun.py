"""`formiga dryrun`: exit codes, what it prints, and that it prints the same twice."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run

ROOT = Path(__file__).parents[3]
PICK_UP = [str(ROOT / "trees" / "pick_up.yaml"), "-p", "target=north_field", "-p", "user=picker_1"]
Capture = pytest.CaptureFixture[str]


def written(folder: Path, steps: str, agents: str = "") -> str:
    path = folder / "task.yaml"
    path.write_text(f"formiga: 1\ntask: Mine\n{agents}steps:\n{steps}")
    return str(path)


def test_a_mission_that_succeeds_is_told_with_its_actions(capsys: Capture) -> None:
    assert run(["dryrun", *PICK_UP]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["start", "end", "agent", "action"]
    assert lines[1].split() == ["0.0", "s", "20.0", "s", "hwd_1", "TakeOff", "succeeded"]
    assert any("LandIn at 20 E 260 N" in line for line in lines)
    assert "PickUp-1 SUCCEEDED after 130.5 s" in lines
    assert "least battery: hwd_1 91.7 %" in lines
    assert lines[-1] == "crashes: 0"
    assert sum("answer_late" in line for line in lines) <= 1


def test_json_is_the_same_each_time_and_complete(capsys: Capture) -> None:
    assert run(["dryrun", "--json", *PICK_UP]) == 0
    first = capsys.readouterr().out
    assert run(["dryrun", "--json", *PICK_UP]) == 0
    assert capsys.readouterr().out == first
    report = json.loads(first)
    assert list(report) == [
        "task", "status", "code", "reason", "cleanup", "duration_s", "actions", "log", "least_battery", "crashes",
        "unsafe_starts", "low_flights", "closest_pass_m", "refused", "never_offered",
    ]  # fmt: skip
    assert (report["task"], report["status"], report["code"], report["crashes"]) == ("PickUp-1", "SUCCEEDED", "", 0)
    assert report["actions"][0] == {
        "agent": "hwd_1", "action": "TakeOff", "start_s": 0.0, "end_s": 20.0, "state": "succeeded",
        "where": "",
    }  # fmt: skip
    assert [a["action"] for a in report["actions"]].count("LandIn") == 2


def test_answers_are_given_one_after_another(capsys: Capture) -> None:
    assert run(["dryrun", "--json", *PICK_UP, "--answer", "picker_1=not_yet, loaded"]) == 0
    report = json.loads(capsys.readouterr().out)
    asked = [a for a in report["actions"] if a["agent"] == "picker_1"]
    assert len(asked) == 3  # whether people stand clear, then the buckets twice
    assert report["never_offered"] == []


def test_a_task_that_fails_says_code_and_reason(capsys: Capture) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=not_yet"]) == 1
    out = capsys.readouterr().out
    assert "PickUp-1 FAILED after 300.5 s: expect answered not_yet" not in out  # the field is further than the camp
    assert "PickUp-1 FAILED after " in out
    assert "s: expect answered not_yet" in out
    assert "hwd_1 stands away from its port (parked_away, PickUp-1)" in out


def test_what_went_wrong_in_the_cleanup_of_a_success_is_told(tmp_path: Path, capsys: Capture) -> None:
    steps = "  - wait: 1 s\nfinally:\n  - fail: The lamp stays on.\n    code: lamp\n"
    file = written(tmp_path, steps)
    assert run(["dryrun", file]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[lines.index("Mine-1 SUCCEEDED after 1 s") + 1] == (
        "  while it cleaned up: finally: failed:lamp The lamp stays on."
    )
    assert run(["dryrun", "--json", file]) == 0
    assert json.loads(capsys.readouterr().out)["cleanup"] == ["finally: failed:lamp The lamp stays on."]


def test_an_answer_that_no_question_offered_is_noted(capsys: Capture) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=laoded"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "not answered as told: no question offered picker_1=laoded"


def test_no_agent_names_who_refused(capsys: Capture) -> None:
    assert run(["dryrun", *PICK_UP[:3], "-p", "user=picker_9"]) == 1
    out = capsys.readouterr().out
    assert "PickUp-1 FAILED after 0 s: no_agent " in out
    refusals = [line.strip() for line in out.splitlines() if line.startswith("  not granted: ")]
    assert refusals == [
        "not granted: picker: picker_1 not_this_one picker_9",
        "not granted: picker: picker_2 not_this_one picker_9",
    ]
    assert "least battery" not in out


def test_a_task_without_agents_has_no_empty_table(tmp_path: Path, capsys: Capture) -> None:
    assert run(["dryrun", written(tmp_path, "  - notify: Hello.\n  - fail: no luck\n")]) == 1
    out = capsys.readouterr().out
    assert "start" not in out
    assert "to watcher_1: Hello." in out
    assert out.splitlines()[-1] == "Mine-1 FAILED after 0 s: failed no luck"


def test_a_task_that_does_not_end_is_given_up(tmp_path: Path, capsys: Capture) -> None:
    file = written(tmp_path, "  - wait: 2 h\n")
    assert run(["dryrun", file, "--limit", "0.5"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "Mine-1 UNFINISHED after 1800 s: given up after 0.5 h"
    assert run(["dryrun", file]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "Mine-1 SUCCEEDED after 7200 s"


def test_a_file_with_errors_prints_its_diagnostics(tmp_path: Path, capsys: Capture) -> None:
    file = written(tmp_path, "  - notfy: Hello.\n")
    assert run(["dryrun", file]) == 1
    err = capsys.readouterr().err
    assert f"{file}:4:5: E0" in err
    assert "did you mean 'notify'" in err
    assert f"formiga: {file} is not a task that can run; `formiga check {file}` tells more" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-p", "tagret=camp"], "E010: PickUp has no parameter 'tagret'; did you mean 'target'?"),
        (["-p", "target=kamp"], "E010: the site has no place 'kamp'; did you mean 'camp'?"),
        (["-p", "height=60"], "E017: 60 needs a unit: 60 m?"),
        (["-p", "height=300 m"], "E062: 'height' must be at most 120 m"),
        ([], "E051: PickUp needs the parameter 'target' (place)"),
        ([], "E051: PickUp needs the parameter 'user' (picker agent)"),
    ],
)
def test_parameters_that_do_not_fit_are_refused_in_words(words: list[str], said: str, capsys: Capture) -> None:
    assert run(["dryrun", PICK_UP[0], *words]) == 1
    streams = capsys.readouterr()
    assert streams.out == ""
    assert said in streams.err
    assert streams.err.endswith("PickUp was not started\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-p", "target"], "'target' is not NAME=VALUE"),
        (["-p", "=camp"], "'=camp' is not NAME=VALUE"),
        (["-p", "a=1", "-p", "a=2"], "'a' is given twice"),
        (["--answer", "picker_9=yes"], "the site has no person 'picker_9'; people: picker_1, picker_2, watcher_1"),
        (["--answer", "hwd_1=yes"], "the site has no person 'hwd_1'"),
        (["--answer", "picker_1="], "'picker_1=' lacks an answer; write for example picker_1=not_yet,loaded"),
        (["--site", "nope.yaml"], "cannot read nope.yaml"),
    ],
)
def test_a_command_line_that_cannot_be_used_is_code_2(words: list[str], said: str, capsys: Capture) -> None:
    fitting = [] if words[0] == "-p" else PICK_UP[1:]
    assert run(["dryrun", PICK_UP[0], *fitting, *words]) == 2
    assert said in capsys.readouterr().err


def test_a_site_with_errors_is_refused(tmp_path: Path, capsys: Capture) -> None:
    site = tmp_path / "site.yaml"
    site.write_text("formiga_site: 1\nname: x\n")
    assert run(["dryrun", *PICK_UP, "--site", str(site)]) == 1
    assert "formiga: the site file has errors" in capsys.readouterr().err


LOOK = """\
formiga: 1
task: Look
params: {target: place}
agents: {w: {type: watcher, near: "${target}"}}
steps: [{wait: 1 s}]
"""


def test_a_parameter_is_read_from_a_file_and_the_site_of_the_folder_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    assert run(["init", str(tmp_path)]) == 0
    monkeypatch.chdir(tmp_path)
    (tmp_path / "look.yaml").write_text(LOOK, encoding="utf-8")
    (tmp_path / "where.txt").write_text("lake_shore\n", encoding="utf-8")  # a place of this site only
    assert run(["dryrun", "look.yaml", "-p", "target=@where.txt"]) == 0
    assert "SUCCEEDED" in capsys.readouterr().out
    assert run(["dryrun", "look.yaml", "-p", "target=@nowhere.txt"]) == 2
    assert "cannot read nowhere.txt" in capsys.readouterr().err


def test_the_end_is_explained_if_asked_for(capsys: Capture) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=not_yet", "--why"]) == 1
    told = capsys.readouterr().out.split("crashes: 0\n\n")[1].replace(str(ROOT), "").replace("/trees/", "trees/")
    assert told.splitlines()[:8] == [
        "PickUp-1 FAILED",
        "  FAILED (expect): an action ended, but not with what was expected: answered not_yet",
        "    first failed: ask at trees/pick_up.yaml:29",
        "      it was asked 3 times: picker_1 said not_yet, then picker_1 said not_yet, then picker_1 said not_yet",
        "  hwd_1 stands away from its port",
        "      -> formiga return hwd_1",
        "  drone = hwd_1 (220 m, 22 s away), the nearest; others that fitted: hwd_2 (221 m, 22 s away)",
        "  picker = picker_1, the only one that fitted",
    ]


def test_a_run_that_was_given_up_says_what_it_waits_for(capsys: Capture) -> None:
    assert run(["dryrun", "--json", *PICK_UP, "--limit", "0.02", "--why"]) == 1
    because = json.loads(capsys.readouterr().out)["because"]
    assert (because[0]["code"], because[0]["agent"]) == ("goal.running", "hwd_1")


HASTE = "  - repeat: 5 h\n    steps:\n      - wait: 1 ms\n"


def test_a_loop_that_never_gets_on_is_given_up_and_named(tmp_path: Path, capsys: Capture) -> None:
    path = written(tmp_path, HASTE)
    assert run(["dryrun", "--json", path, "--most-steps", "500"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["status"] == "UNFINISHED"
    assert f"{path}:4" in report["reason"]
    assert "steps[0]" in report["reason"]
    assert report["duration_s"] < 60

    assert run(["dryrun", "--json", path, "--most-seconds", "0.1"]) == 1
    assert f"{path}:4" in json.loads(capsys.readouterr().out)["reason"]
