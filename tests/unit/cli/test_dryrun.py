"""`formiga dryrun`: exit codes, what it prints, and that it prints the same twice."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording, having

ROOT = Path(__file__).parents[3]
PICK_UP = [str(ROOT / "trees" / "pick_up.yaml"), "-p", "target=north_field", "-p", "user=picker_1"]
Capture = pytest.CaptureFixture[str]


def _form_file(folder: Path) -> str:
    file = folder / "count.yaml"
    file.write_text(
        "formiga: 1\ntask: Count\nagents: {watcher: {type: watcher}}\nsteps:\n"
        "  - {ask: 'How many?', of: [watcher], form: {many: {type: int, max: 9}, spot: place}, timeout: 9 min, save_as: got}\n"
        "  - check: got.many == 7\n",
        encoding="utf-8",
    )
    return str(file)


@pytest.mark.parametrize(
    ("fields", "ends"), [((), 1), (("many=7", "spot=camp"), 0), (("many=10",), 2), (("more=1",), 2)]
)
def test_forms_are_filled_in_as_said(tmp_path: Path, fields: tuple[str, ...], ends: int) -> None:
    assert run(["dryrun", _form_file(tmp_path), *(word for one in fields for word in ("--field", one))]) == ends


def written(folder: Path, steps: str, agents: str = "") -> str:
    path = folder / "task.yaml"
    path.write_text(f"formiga: 1\ntask: Mine\n{agents}steps:\n{steps}")
    return str(path)


def test_a_mission_that_succeeds_is_told_with_its_actions(capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", *PICK_UP]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["start", "end", "agent", "action"]
    assert lines[1].split() == ["0.0", "s", "20.0", "s", "hwd_1", "TakeOff", "succeeded"]
    assert lines[-1] == "crashes: 0"
    wording(lines[1:])
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


def test_a_task_that_fails_says_code_and_reason(capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=not_yet"]) == 1
    out = capsys.readouterr().out
    assert "parked_away" in out
    wording(having(out, "FAILED", "parked_away"))


def test_what_went_wrong_in_the_cleanup_of_a_success_is_told(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    steps = "  - wait: 1 s\nfinally:\n  - fail: The lamp stays on.\n    code: lamp\n"
    file = written(tmp_path, steps)
    assert run(["dryrun", file]) == 0
    lines = capsys.readouterr().out.splitlines()
    wording(lines[lines.index("Mine-1 SUCCEEDED after 1 s") + 1])
    assert run(["dryrun", "--json", file]) == 0
    wording(json.loads(capsys.readouterr().out)["cleanup"])


def test_an_answer_that_no_question_offered_is_noted(capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=laoded"]) == 1
    wording(capsys.readouterr().out.splitlines()[-1])


def test_no_agent_names_who_refused(capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", *PICK_UP[:3], "-p", "user=picker_9"]) == 1
    out = capsys.readouterr().out
    wording(out)
    refusals = [line.strip() for line in out.splitlines() if line.startswith("  not granted: ")]
    wording(refusals)
    assert "least battery" not in out


def test_a_task_without_agents_has_no_empty_table(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", written(tmp_path, "  - notify: Hello.\n  - fail: no luck\n")]) == 1
    out = capsys.readouterr().out
    assert "start" not in out
    assert "to watcher_1: Hello." in out
    wording(out.splitlines()[-1])


def test_a_task_that_does_not_end_is_given_up(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    file = written(tmp_path, "  - wait: 2 h\n")
    assert run(["dryrun", file, "--limit", "0.5"]) == 1
    wording(capsys.readouterr().out.splitlines()[-1])
    assert run(["dryrun", file]) == 0
    wording(capsys.readouterr().out.splitlines()[-1])


def test_a_file_with_errors_prints_its_diagnostics(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    file = written(tmp_path, "  - notfy: Hello.\n")
    assert run(["dryrun", file]) == 1
    err = capsys.readouterr().err
    assert f"{file}:4:5: E0" in err
    wording(err)


@pytest.mark.parametrize(
    "words", [["-p", "tagret=camp"], ["-p", "target=kamp"], ["-p", "height=60"], ["-p", "height=300 m"], []]
)
def test_parameters_that_do_not_fit_are_refused_in_words(words: list[str], capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", PICK_UP[0], *words]) == 1
    streams = capsys.readouterr()
    assert streams.out == ""
    wording(streams.err)


@pytest.mark.parametrize(
    "words",
    [
        ["-p", "target"],
        ["-p", "=camp"],
        ["-p", "a=1", "-p", "a=2"],
        ["--answer", "picker_9=yes"],
        ["--answer", "hwd_1=yes"],
        ["--answer", "picker_1="],
        ["--site", "nope.yaml"],
    ],
)
def test_a_command_line_that_cannot_be_used_is_code_2(words: list[str], capsys: Capture, wording: Wording) -> None:
    fitting = [] if words[0] == "-p" else PICK_UP[1:]
    assert run(["dryrun", PICK_UP[0], *fitting, *words]) == 2
    wording(capsys.readouterr().err)


def test_a_site_with_errors_is_refused(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    site = tmp_path / "site.yaml"
    site.write_text("formiga_site: 1\nname: x\n")
    assert run(["dryrun", *PICK_UP, "--site", str(site)]) == 1
    wording(capsys.readouterr().err)


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


def test_the_end_is_explained_if_asked_for(capsys: Capture, wording: Wording) -> None:
    assert run(["dryrun", *PICK_UP, "--answer", "picker_1=not_yet", "--why"]) == 1
    told = capsys.readouterr().out.split("crashes: 0\n\n")[1].replace(str(ROOT), "").replace("/trees/", "trees/")
    wording(told.splitlines()[:8])


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


@pytest.mark.parametrize(("at", "code"), [("14:59", 0), ("2026-06-21T15:01", 1), ("tomorrow", 2), ("2026-06-21", 2)])
def test_the_hour_of_the_request_can_be_said(tmp_path: Path, at: str, code: int) -> None:
    path = written(tmp_path, "  - check: now < until\n", "params:\n  until: {type: time, default: 15:00}\n")
    assert run(["dryrun", path, "--at", at]) == code
