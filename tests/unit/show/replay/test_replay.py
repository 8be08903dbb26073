"""`formiga replay`: the moving moment, the story in text, the story as a case that `formiga test` plays."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import Mark
from formiga_bt.cli.app import run
from formiga_bt.rehearsal.cases.cases import AnswerRule
from formiga_bt.rehearsal.cases.judging import Differs
from formiga_bt.show.replay.cursor import Cursor, is_failure
from formiga_bt.show.replay.machine import TimeMachine
from tests.golden import Wording
from tests.unit.show.replay.flown import Flown, fly

Captured = pytest.CaptureFixture[str]
S = 1_000_000


@pytest.fixture
def machine(blocked: Flown) -> Iterator[TimeMachine]:
    with blocked.machine() as machine:
        yield machine


# -- the moment that moves ---------------------------------------------------------------------------------------------
def test_events_are_the_same_forth_and_back(machine: TimeMachine) -> None:
    cursor = Cursor(machine, machine.first)
    forth = []
    while cursor.step(1):
        forth.append(cursor.at)
    back = [cursor.at]
    while cursor.step(-1):
        back.append(cursor.at)

    assert len(forth) > 10
    assert sorted(set(forth)) == forth
    assert forth == back[::-1]


def test_a_failure_is_found_from_both_sides(machine: TimeMachine) -> None:
    """The goal fails first, the task at its end."""
    cursor = Cursor(machine, machine.first)
    assert cursor.step(1, is_failure)
    goal = cursor.at
    assert "drone.GoTo" in "".join(span.text for span in _failed(cursor))
    assert cursor.now(over=True).tasks[0].status == "ENDING"
    while cursor.step(1, is_failure):
        pass
    assert cursor.now(over=True).tasks[0].status == "FAILED"
    while cursor.step(-1, is_failure):
        pass
    assert goal == cursor.at


def _failed(cursor: Cursor):  # type: ignore[no-untyped-def]
    from formiga_bt.show.tree.drawing import walk

    picture = cursor.task("PickUp-1")
    paths = {step.path for step in picture.steps if step.failed}
    return [span for box in walk(picture.drawing.sections) if box.path in paths for span in box.label]


def test_it_plays_with_its_speed_and_stands_at_the_end(machine: TimeMachine) -> None:
    cursor = Cursor(machine, machine.first, speed=10.0)
    cursor.play(1.0)
    assert machine.first == cursor.at
    cursor.plays = True
    cursor.play(1.0)
    assert machine.first + 10 * S == cursor.at
    cursor.faster(1)
    assert cursor.speed == 30.0
    cursor.play(3600.0)
    assert (machine.last, False) == (cursor.at, cursor.plays)


def test_stepping_through_one_task_passes_over_others(good: Flown) -> None:
    with good.machine() as machine:
        cursor = Cursor(machine, machine.first, task="PickUp-2")
        assert cursor.step(1)
        assert {"SUCCEEDED", "ACTIVE"} >= {task.status for task in cursor.now(over=True).tasks}
        assert len(cursor.now(over=True).tasks) == 2


# -- as text -----------------------------------------------------------------------------------------------------------
def test_a_story_in_text(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["replay", "--task", "PickUp-1"]) == 0
    told = capsys.readouterr().out
    wording(told)

    assert run(["replay", "--task", "PickUp-1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["task"]["status"] == "FAILED"
    assert any(event["text"] == "hwd_1 GoTo: failed blocked" for event in found["events"])


def test_a_moment_in_text(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["replay", "--at", "13:47:00"]) == 0
    told = capsys.readouterr().out.splitlines()
    wording(told[0], told[2])
    assert run(["replay", "--at", "13:47:00", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["engine"] == "past"
    assert run(["replay", "--speed", "2"]) == 2


# -- as a case ---------------------------------------------------------------------------------------------------------
MORE = {
    "the picker is slow": """\
  - name: slow
    params: {target: {east: 100 m, north: 150 m}, user: picker_2, robot: hwd_2}
    agents: {lwd_1: {battery: 61 %}, hwd_1: {absent: true}}
    answers: [{ask: 1, answer: nothing_to_load, after: 70 s}]
    expect: {}
""",
    "people do not stand clear": """\
  - name: not clear
    params: {target: north_field, user: picker_1}
    answers: [{ask: about to land, answer: refuse}]
    expect: {}
""",
    "people take their time to stand clear": """\
  - name: clear late
    params: {target: north_field, user: picker_1}
    answers: [{ask: about to land, answer: clear, after: 24 s}, {ask: about to land, answer: clear, after: 9 s}]
    expect: {}
""",
    "nobody answers": """\
  - name: nobody
    params: {target: north_field, user: picker_1}
    answers: [{ask: buckets, never: true}]
    expect: {}
""",
    "refused by the machine": """\
  - name: refused
    params: {target: north_field, user: picker_1}
    answers: [{do: drone.LandIn, nth: 1, reject: not_now}]
    expect: {}
""",
    "held and continued by a person": """\
  - name: held
    params: {target: north_field, user: picker_1}
    orders: [{at: 25 s, order: hold, target: hwd_1, by: watcher_1}, {at: 40 s, order: continue, target: hwd_1}]
    expect: {}
""",
    "restarted by a person": """\
  - name: restarted
    params: {target: north_field, user: picker_1}
    answers: [{ask: 1, answer: loaded, after: 7 s}]
    orders: [{at: 25 s, order: restart, target: PickUp, by: watcher_1}]
    expect: {}
""",
    "a machine is lost": """\
  - name: lost
    params: {target: north_field, user: picker_1}
    faults: [{at: 20 s, agent: hwd_1, kind: kill}]
    expect: {}
""",
    "the process of a machine is started anew": """\
  - name: started anew
    params: {target: north_field, user: picker_1}
    faults: [{at: 25 s, agent: hwd_1, kind: kill, for: 4 s}]
    expect: {}
""",
}


@pytest.mark.parametrize("name", MORE)
def test_a_story_comes_back_as_a_case(
    name: str, tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Answers, failures, refusals, orders, the fleet: `formiga test` finds what the mission was."""
    fly(tmp_path, MORE[name])
    monkeypatch.chdir(tmp_path)
    assert run(["replay", "--task", "PickUp-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    assert "without" not in capsys.readouterr().err
    assert run(["test", "story.test.yaml"]) == 0, capsys.readouterr().out
    written = Path("story.test.yaml").read_text()
    for line in COMES_BACK.get(name, ()):
        assert f"{line}\n" in written


COMES_BACK = {
    "people take their time to stand clear": [
        '- {ask: "hwd_1 is about to land here", answer: clear, after: 24.0 s}  # asked by the engine itself',
    ],
    "restarted by a person": ["- {at: 25.0 s, order: restart, target: PickUp, by: watcher_1}"],
    "a machine is lost": [
        "- {at: 20.0 s, agent: hwd_1, kind: kill}  # nothing was heard of it from then on; at 49.0 s it was given up"
    ],
    "the process of a machine is started anew": [
        "- {at: 25.0 s, agent: hwd_1, kind: kill, for: 4.0 s}"
        "  # nothing was heard of it from then on; then it was back, its process started anew"
    ],
    "refused by the machine": ["- {do: drone.LandIn, nth: 1, reject: not_now}  # its 1st LandIn was refused"],
}

REBINDS = """\
formiga: 1
task: Look
preemptible: true
imports: [lib/flying.yaml]
params: {target: place}
agents:
  drone: {type: hwd, near: "${target}", if_lost: rebind}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: 40 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
LINK = """\
  - name: the link is lost
    params: {target: north_field}
    faults: [{at: 25 s, agent: hwd_1, kind: link_loss, presence: stays, for: 50 s}]
    expect: {}
"""


def test_a_task_that_began_anew_with_another_machine_comes_back_whole(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """The machine falls silent when it did, not when it was given up; so the second run comes when it did."""
    (tmp_path / "look.yaml").write_text(REBINDS)
    fly(tmp_path, LINK, task=str(tmp_path / "look.yaml"))
    monkeypatch.chdir(tmp_path)
    assert run(["replay", "--task", "Look-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    wording(capsys.readouterr().err)
    written = Path("story.test.yaml").read_text()
    wording(written)
    assert written.count("drone.TakeOff") == 2


FAR = """\
formiga: 1
task: Far
agents:
  drone: {type: hwd, near: "${base}"}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${above(site.places.north_field, 60 m)}"}
  - wait: 40 min
  - do: drone.LandIn
    with: {at: "${site.places.north_field}"}
"""
LOW = """\
  - name: it hovers too long
    expect: {}
"""


def test_a_limit_of_the_envelope_that_ended_a_task_is_expected_of_the_case(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "far.yaml").write_text(FAR)
    fly(tmp_path, LOW, task=str(tmp_path / "far.yaml"))
    monkeypatch.chdir(tmp_path)
    assert run(["replay", "--task", "Far-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    assert "      status: failed\n      code: envelope.reserve\n" in Path("story.test.yaml").read_text()


def test_of_a_task_that_was_preempted_the_run_after_it_is_the_case(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """The other task is not in it; what was seen of it is told, and busy machines are away."""
    fly(tmp_path, PREEMPTED, later=[(30.0, "high")])
    monkeypatch.chdir(tmp_path)
    assert run(["replay", "--task", "PickUp-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    told = capsys.readouterr().err
    wording(told)
    assert "without" not in told
    written = Path("story.test.yaml").read_text()
    wording(written)
    assert written.count("drone.TakeOff") == 2, "run 1 is not in it"
    capsys.readouterr()
    assert run(["test", "story.test.yaml"]) == 0


PREEMPTED = """\
  - name: preempted
    params: {target: north_field, user: picker_1}
    agents: {hwd_2: {absent: true}}
    expect: {}
"""


def test_clearances_that_do_not_come_again_are_left_out_if_all_were_given(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """Another machine, or no question at all: people stand clear as they do by themselves."""
    from formiga_bt.cli.operator import replay_case

    fly(tmp_path, MORE["people take their time to stand clear"])
    monkeypatch.chdir(tmp_path)
    play = replay_case._play

    def other_machine(machine: TimeMachine, out: Path) -> list[Differs]:
        rule = AnswerRule(Mark("story.test.yaml", 9, 1), None, "hwd_1 is about to land here", "clear")
        return (
            [Differs("answers", "", "never came", rule=rule)]
            if "is about to" in out.read_text()
            else play(machine, out)
        )

    monkeypatch.setattr(replay_case, "_play", other_machine)
    assert run(["replay", "--task", "PickUp-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    wording(capsys.readouterr().err)


def test_a_run_that_does_not_come_again_is_left_out(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """If all runs together do not pass, the last one may; what was left out is told."""
    from formiga_bt.cli.operator import replay_case

    fly(tmp_path, MORE["restarted by a person"])
    monkeypatch.chdir(tmp_path)
    play = replay_case._play

    def whole_fails(machine: TimeMachine, out: Path) -> list[Differs]:
        return [Differs("status", "succeeded", "failed")] if "order: restart" in out.read_text() else play(machine, out)

    monkeypatch.setattr(replay_case, "_play", whole_fails)
    assert run(["replay", "--task", "PickUp-1", "--as-test", "story.test.yaml"]) == 0, capsys.readouterr().err
    wording(capsys.readouterr().err)
    monkeypatch.setattr(replay_case, "_play", lambda *_: [Differs("status", "succeeded", "failed")])
    assert run(["replay", "--task", "PickUp-1", "--as-test", "story.test.yaml", "--force"]) == 1
    wording(capsys.readouterr().err)
    assert "order: restart" in Path("story.test.yaml").read_text(), "all of it is there to be mended"


@pytest.mark.parametrize("name", ["good", "blocked", "aborted"])
def test_a_case_says_what_happened(
    name: str, tmp_path: Path, request: pytest.FixtureRequest, capsys: Captured, wording: Wording
) -> None:
    flown: Flown = request.getfixturevalue(name)
    file = tmp_path / "story.test.yaml"
    words = ["replay", "--task", "PickUp-1", "--journal", str(flown.where), "--as-test", str(file)]
    assert run(words) == 0
    text = file.read_text()
    wanted = {
        "good": [
            "{ask: 1, answer: not_yet, after: 7.0 s}  # Are the buckets loaded, and do you stand 15 m away?\n",
            "{ask: 2, answer: loaded, after: 5.0 s}",
            "status: succeeded",
            'notices: ["is already answered: clear by"]  # a part of each notice, without names and numbers\n',
            "end_state: {drone: at_port}  # where its machines were when it ended\n",
        ],
        "blocked": [
            "{do: drone.GoTo, nth: 2, fail: blocked, after: 2.0 s}  # its 2nd GoTo failed\n",
            "code: blocked",
            "hwd_2: {battery: 40 %}",
        ],
        "aborted": ["{at: 30.0 s, abort: PickUp}", "code: aborted", "status: canceled"],
    }
    for part in wanted[name]:
        assert part in text, text
    wording(capsys.readouterr().err)
    assert run(words) == 2
    wording(capsys.readouterr().err)


def test_a_case_that_would_not_pass_is_told(
    tmp_path: Path, blocked: Flown, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """It is written, and what differs is said."""
    from formiga_bt.rehearsal.cases import judging

    monkeypatch.setattr(judging, "judge", lambda *_: [judging.Differs("status", "failed", "succeeded")])
    file = tmp_path / "story.test.yaml"
    assert run(["replay", "--task", "PickUp-1", "--journal", str(blocked.where), "--as-test", str(file)]) == 1
    wording(capsys.readouterr().err)
    assert file.exists()


def test_files_that_are_not_on_disk_any_more_lie_beside_the_case(
    tmp_path: Path, blocked: Flown, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    from formiga_bt.cli.operator import replay_case

    monkeypatch.setattr(replay_case, "_known", lambda *_: "")
    file = tmp_path / "story.test.yaml"
    assert run(["replay", "--task", "PickUp-1", "--journal", str(blocked.where), "--as-test", str(file)]) == 0
    assert "task: story_files/pick_up.yaml" in file.read_text()
    assert (tmp_path / "story_files" / "lib" / "flying.yaml").exists()
    capsys.readouterr()
    assert run(["test", str(file)]) == 0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--as-test", "x.test.yaml"], "say which: --task PickUp-12"),
        (["--task", "PickUp-1", "--as-test", "x.yaml"], "end in .test.yaml; say for example x.test.yaml"),
        (["--task", "PickUp-9", "--as-test", "x.test.yaml"], "the journal knows no task 'PickUp-9'"),
    ],
)
def test_what_cannot_become_a_case_is_told(words: list[str], told: str, here: Path, capsys: Captured) -> None:
    assert run(["replay", *words]) == 2
    assert told in capsys.readouterr().err
