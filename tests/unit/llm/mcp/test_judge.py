"""Checks, trees and dry runs of an assistant's tasks, in this process."""

import pytest

from formiga_bt.llm.mcp.ground import ServedSite, ServerFiles, ground_of
from formiga_bt.llm.mcp.judge import JobResult, JudgeJob, done
from formiga_bt.llm.mcp.records import FlightOut
from tests.golden import Wording

ASK = """\
formiga: 1
task: Ask
agents:
  picker: {type: picker}
steps:
  - ask: Shall we?
    of: [picker]
    options: ["yes", "no"]
    timeout: 1 min
    expect: result.answer == 'yes'
"""


@pytest.fixture(scope="module")
def ground() -> ServedSite:
    return ground_of(ServerFiles())


def do(ground: ServedSite, **job: object) -> JobResult:
    return done(JudgeJob(**job), ground, lambda *_: None)  # type: ignore[arg-type]


def fly(ground: ServedSite, **job: object) -> FlightOut:
    told = do(ground, kind="fly", **job)
    assert told.flight is not None, told.error
    return told.flight


def test_problems_have_places_and_help(ground: ServedSite) -> None:
    told = do(ground, kind="check", yaml="formiga: 1\ntask: Ask\nagents:\n  picker: {type: pickr}\nsteps: []\n").check
    assert told is not None
    assert not told.ok
    first = next(one for one in told.problems if one.severity == "error")
    assert (first.code, first.line, first.column, first.file) == ("E020", 4, 18, "")
    assert first.source == "  picker: {type: pickr}"
    assert "refused: " in told.rendered


def test_a_task_that_can_fly_is_ok(ground: ServedSite, wording: Wording) -> None:
    told = do(ground, kind="check", yaml=ASK).check
    assert told is not None
    assert (told.ok, told.task, told.problems) == (True, "Ask", [])
    wording(told.rendered)


def test_a_tree_is_drawn(ground: ServedSite, wording: Wording) -> None:
    told = do(ground, kind="tree", yaml=ASK).tree
    assert told is not None
    wording(told.tree)


def test_a_dry_run_tells_who_did_what_and_what_was_asked(ground: ServedSite, wording: Wording) -> None:
    told = fly(ground, task="PickUp", params={"target": "north_field", "user": "picker_1"})
    assert (told.ok, told.status, told.crashes) == (True, "SUCCEEDED", 0)
    assert told.agents == {"drone": ["hwd_1"], "picker": ["picker_1"], "watcher": ["watcher_1"]}
    assert [one.action for one in told.actions if one.agent == "hwd_1"][:2] == ["TakeOff", "GoTo"]
    wording(told.questions[-1].text)
    assert 80 < told.least_battery_percent["hwd_1"] < 100
    assert "✓ drone.LandIn(at: target)" in told.tree


def test_people_answer_as_told_and_a_failure_is_explained(ground: ServedSite) -> None:
    told = fly(ground, yaml=ASK, answers={"picker_1": ["no"], "picker_2": ["no"]})
    assert (told.ok, told.status) == (False, "FAILED")
    assert told.why.startswith("Ask-1 FAILED")


def test_progress_is_told_for_each_minute_of_virtual_time(ground: ServedSite, wording: Wording) -> None:
    heard: list[str] = []
    done(JudgeJob(kind="fly", task="Circle"), ground, lambda at, text: heard.append(text))
    wording(heard)


def test_a_task_that_takes_long_is_given_up_after_its_hours(ground: ServedSite, wording: Wording) -> None:
    text = "formiga: 1\ntask: Ever\nagents:\n  p: {type: picker}\nsteps:\n  - repeat: 2 h\n    steps:\n      - wait: 10 s\n"
    told = fly(ground, yaml=text, hours=0.05)
    assert (told.ok, told.status, told.duration_s) == (False, "UNFINISHED", pytest.approx(180, abs=12))
    wording(told.reason)


@pytest.mark.parametrize(
    ("job", "error"),
    [
        ({"task": "Nothing"}, "there is no task 'Nothing'"),
        ({"yaml": "formiga: 1\ntask: X\n"}, "the task has errors; mend them first"),
        ({"task": "PickUp"}, "PickUp was not started"),
        ({"task": "Circle", "params": {"radius": "far"}}, "parameter radius:1:1"),
        (
            {"task": "Circle", "params": {"radius": "9" * 5000}},
            "parameter 'radius' has 5,000 characters; at most 4,000",
        ),
        ({"task": "Circle", "answers": {"eve": ["yes"]}}, "answers: the site has no person 'eve'; people: picker_1"),
        ({"task": "Circle", "answers": {"picker_1": []}}, "answers: 'picker_1' lacks an answer"),
    ],
)
def test_what_cannot_be_flown_is_told_with_what_to_do(ground: ServedSite, job: dict[str, object], error: str) -> None:
    told = do(ground, kind="fly", **job)
    assert told.flight is None
    assert error in told.error


def test_values_that_are_no_texts_are_read_as_literals(ground: ServedSite) -> None:
    told = fly(ground, task="Circle", params={"points": 4, "center": {"east": "20 m", "north": "20 m"}})
    assert told.status == "SUCCEEDED"
    assert sum(one.action == "GoTo" for one in told.actions) < 12


def test_what_a_task_requests_is_flown_with_it(ground: ServedSite) -> None:
    told = fly(ground, yaml="formiga: 1\ntask: Mine\nsteps:\n  - request: Circle\n    with: {points: 4}\n")
    assert (told.ok, told.status) == (True, "SUCCEEDED")
    assert any(one.action == "LandIn" for one in told.actions)
