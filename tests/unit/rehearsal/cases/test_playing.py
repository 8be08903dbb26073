"""Cases are played as they are written: mocked goals, answers, and what is said of what differs."""

from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.codes import is_code, read_code, written_code
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems
from formiga_bt.nodes.base import Node
from formiga_bt.rehearsal.cases.cases import CaseFile
from formiga_bt.rehearsal.cases.coverage import Coverage
from formiga_bt.rehearsal.cases.judging import diff, fits, judge
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.cases.running import Came, SentGoal, play
from formiga_bt.rehearsal.testing import packaged_world
from tests.golden import Wording

CATALOGUE = packaged_world()[1]
Read = Callable[..., CaseFile]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Write a task (or name a shipped one) with one case, and read it."""

    def write(case: str, task: str = "", shipped: str = "") -> CaseFile:
        if not shipped:
            (tmp_path / "mine.yaml").write_text(f"formiga: 1\ntask: Mine\n{task}", encoding="utf-8")
        file = tmp_path / "mine.test.yaml"
        text = f"formiga_test: 1\ntask: {shipped or 'mine.yaml'}\ncases:\n  - name: it\n{case}"
        file.write_text(text, encoding="utf-8")
        loaded = load_cases(file, catalogue=CATALOGUE)
        assert loaded.cases is not None, [str(d) for d in loaded.diagnostics]
        return loaded.cases

    return write


def outcome(cases: CaseFile) -> tuple[Came, list[str]]:
    case = cases.cases[0]
    came = play(cases, case)
    return came, [str(one) for one in judge(case, came)]


PICK_UP = "    params: {target: north_field, user: picker_1}\n"
ASKING = """\
agents:
  watcher: {type: watcher}
steps:
  - ask: Is it cold?
    of: [watcher]
    timeout: 10 min
    save_as: cold
  - ask: Is it dark?
    of: [watcher]
    options: [yes, no, perhaps]
    timeout: 10 min
    save_as: dark
  - if: cold.answer == 'yes' and dark.answer == 'no'
    then:
      - notify: Cold and light.
    else:
      - fail: neither
        code: too_bad
  - notify: Done.
    when: dark.answer != 'perhaps'
"""


class TestGoals:
    def test_a_goal_that_fails_on_the_way_leaves_the_drone_where_it_was(self, read: Read) -> None:
        cases = read(
            PICK_UP
            + "    answers: [{do: drone.GoTo, nth: 2, fail: blocked, after: 5 s}]\n"
            + "    expect: {status: failed, code: blocked, end_state: {drone: at_port}}\n",
            shipped="pick_up.yaml",
        )
        came, differs = outcome(cases)

        assert differs == []
        assert [one.name for one in came.sent] == [
            "drone.TakeOff", "drone.GoTo", "drone.GoTo", "drone.GoTo", "drone.GoTo", "drone.LandIn",
        ]  # fmt: skip

    def test_a_refused_goal_is_sent_once_and_is_a_failure(self, read: Read) -> None:
        case = (
            "    answers: [{do: hwd_1.TakeOff, reject: no_propeller}]\n    expect: {status: failed, code: rejected}\n"
        )
        came, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        assert differs == []
        assert [one.name for one in came.sent] == ["drone.TakeOff"]
        assert came.task is not None
        assert "no_propeller" in came.task.outcome.reason

    def test_a_goal_that_begins_late_takes_longer(self, read: Read, wording: Wording) -> None:
        expect = "    expect: {max_time: 3 min}\n"
        quick, _ = outcome(read(PICK_UP + expect, shipped="pick_up.yaml"))
        late = "    answers: [{do: drone.TakeOff, nth: 1, after: 1 min}]\n"
        slow, differs = outcome(read(PICK_UP + late + expect, shipped="pick_up.yaml"))

        assert abs(slow.duration_s - quick.duration_s - 60.0) < 1.0
        wording(differs)

    @pytest.mark.parametrize("after", ["30 s", "5 min"])
    def test_a_goal_that_had_ended_before_it_could_fail_is_told(self, read: Read, after: str, wording: Wording) -> None:
        case = f"    answers: [{{do: drone.TakeOff, nth: 1, fail: broken, after: {after}}}]\n    expect: {{}}\n"
        _, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        wording(differs)

    def test_a_rule_that_never_counted_is_told(self, read: Read, wording: Wording) -> None:
        case = "    answers: [{do: drone.LandIn, nth: 3, fail: broken}, {ask: 2, answer: loaded}]\n    expect: {}\n"
        _, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        wording(differs)

    def test_a_canceled_goal_that_had_not_begun_is_forgotten(self, read: Read) -> None:
        case = "    answers: [{do: drone.TakeOff, after: 1 h}]\n    abort_at: 20 s\n    expect: {status: canceled}\n"
        came, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        assert differs == []
        assert came.duration_s < 30.0


class TestAnswers:
    def test_questions_are_answered_by_number_and_by_text(self, read: Read) -> None:
        answers = "    answers: [{ask: dark, answer: no}, {ask: 1, answer: yes, after: 9 s}]\n"
        case = answers + "    expect: {notices: [Cold, Done]}\n"
        came, differs = outcome(read(case, ASKING))

        assert differs == []
        assert came.asked == ("Is it cold?", "Is it dark?")
        assert came.duration_s >= 12.0

    @pytest.mark.parametrize(("fields", "told"), [("", "0"), (", fields: {many: 12}", "12")])
    def test_a_form_is_filled_in_as_the_case_says_or_with_the_least(self, read: Read, fields: str, told: str) -> None:
        ask = "ask: 'How many?', of: [watcher], form: {many: int, spot: place}, timeout: 9 min, save_as: got"
        tree = f"agents: {{watcher: {{type: watcher}}}}\nsteps: [{{{ask}}}, {{notify: '${{got.many}}'}}]\n"
        case = f"    answers: [{{ask: many, answer: done{fields}}}]\n    expect: {{notices: ['{told}']}}\n"
        _, differs = outcome(read(case, tree))

        assert differs == []

    def test_several_answers_to_one_text_come_one_after_another(self, read: Read) -> None:
        answers = "    answers: [{ask: buckets, answer: not_yet}, {ask: buckets, answer: loaded}]\n"
        came, differs = outcome(read(PICK_UP + answers + "    expect: {answers_asked: 2}\n", shipped="pick_up.yaml"))

        assert differs == []
        assert came.task is not None

    def test_an_answer_that_this_question_does_not_offer_is_told(self, read: Read, wording: Wording) -> None:
        case = "    answers: [{ask: cold, answer: perhaps}]\n    expect: {status: failed}\n"
        _, differs = outcome(read(case, ASKING))

        wording(differs)

    def test_a_question_that_is_never_answered_runs_into_its_timeout(self, read: Read) -> None:
        came, differs = outcome(
            read("    answers: [{ask: 1, never: true}]\n    expect: {status: failed, code: timeout}\n", ASKING)
        )

        assert differs == []
        assert came.duration_s == 600.0


class TestWhatDiffers:
    def test_a_wrong_end_names_code_reason_and_place(self, read: Read, wording: Wording) -> None:
        cases = read("    answers: [{ask: cold, answer: no}]\n    expect: {status: succeeded, notices: []}\n", ASKING)
        _, differs = outcome(cases)

        wording(differs)

    def test_a_wrong_end_state_names_role_and_agent(self, read: Read, wording: Wording) -> None:
        case = "    expect: {end_state: {drone: parked_away, hwd_2: airborne}}\n"
        _, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        wording(differs)

    def test_notices_and_questions_are_shown(self, read: Read, wording: Wording) -> None:
        cases = read(
            "    answers: [{ask: dark, answer: no}]\n    expect: {notices: [Warm], answers_asked: 1}\n", ASKING
        )
        found = judge(cases.cases[0], play(cases, cases.cases[0]))

        wording([(str(one), one.lines) for one in found])

    def test_a_task_that_is_refused_is_no_pass(self, read: Read) -> None:
        case = "    orders: [{at: 0 s, lockdown: return}]\n    limit: 10 min\n    expect: {}\n"
        _, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        assert differs != []


SENSOR = """\
types:
  sensor:
    label: Sensor
    mobility: fixed
    actions: [Look]
    events: {moved: {what: text, spot: place, how_far: distance}}
actions:
  Look: {fields: {}, result: {}, repeatable: true}
"""
MOVED = """\
formiga: 1
task: Mine
agents:
  sensor: {type: sensor}
steps:
  - wait_for: sensor.moved
    save_as: told
    timeout: 5 min
  - check: distance(told.spot, site.places.camp) < 1 m
  - notify: ${told.what} ${round(told.how_far / 1 m)}
"""
DAY = """\
params:
  until: {type: time, default: 15:00}
steps:
  - if: now < until
    then: [{notify: early}]
    else: [{notify: late}]
"""
WHO = """\
agents:
  picker: {type: picker}
  watcher: {type: watcher}
steps:
  - ask: Is it cold?
    of: [watcher, picker]
    policy: any
    timeout: 10 min
    save_as: cold
    escalate_after: 1 min
  - notify: ${cold.by}
"""


class TestWhatACaseSays:
    @pytest.mark.parametrize(
        ("now", "said"), [("14:59", "early"), ("2026-06-21T15:01", "late"), ("2026-06-21T15:01+02:00", "early")]
    )
    def test_the_day_and_hour_of_the_request(self, read: Read, now: str, said: str) -> None:
        came, differs = outcome(read(f"    now: {now}\n    expect: {{notices: [{said}]}}\n", DAY))

        assert (list(came.notices), differs) == ([said], [])

    def test_a_param_may_be_a_time_of_that_day(self, read: Read) -> None:
        case = "    params: {until: 8:00}\n    now: 2026-06-21T07:00\n    expect: {notices: [early]}\n"

        assert outcome(read(case, DAY))[1] == []

    def test_who_answers_is_the_one_named(self, read: Read) -> None:
        case = "    answers: [{ask: cold, answer: yes, by: picker_1}]\n    expect: {}\n"
        came, differs = outcome(read(case, WHO))

        assert (came.notices[-1], differs) == ("picker_1", [])

    @pytest.mark.parametrize(
        ("fields", "codes"),
        [
            (", fields: {what: a cow, spot: camp, how_far: 12 m}", []),
            ("", ["E022"]),
            (", fields: {what: a cow, spot: camp}", ["E022"]),
            (", fields: {what: a cow, spot: camp, how_far: 12, more: 1}", ["E017", "E022"]),
        ],
    )
    def test_an_event_has_its_fields(self, tmp_path: Path, fields: str, codes: list[str]) -> None:
        (tmp_path / "mine.yaml").write_text(MOVED, encoding="utf-8")
        (tmp_path / "sensor.yaml").write_text(SENSOR, encoding="utf-8")
        file = tmp_path / "mine.test.yaml"
        file.write_text(
            "formiga_test: 1\ntask: mine.yaml\ncases:\n  - name: it\n"
            "    agents: {yard: {type: sensor, at: base}}\n"
            f"    faults: [{{at: 20 s, agent: yard, kind: event, event: moved{fields}}}]\n"
            "    expect: {notices: [a cow 12]}\n",
            encoding="utf-8",
        )
        loaded = load_cases(file, actions=[tmp_path / "sensor.yaml"])

        assert sorted(one.code for one in loaded.diagnostics) == codes
        if loaded.cases is not None:
            assert outcome(loaded.cases)[1] == []

    def test_a_case_goes_on_no_longer_than_its_limit(self, read: Read) -> None:
        case = "    answers: [{ask: cold, never: true}]\n    limit: 5 min\n    expect: {status: failed}\n"
        came, differs = outcome(read(case, WHO))

        assert not came.in_time
        assert differs != []


def goals(*names: str) -> list[SentGoal]:
    parts = (name.split(".") for name in names)
    return [SentGoal("hwd_1", role, action, Mark("t.yaml", i + 1, 1)) for i, (role, action) in enumerate(parts)]


class TestActions:
    @pytest.mark.parametrize(
        ("wanted", "is_fit"),
        [
            (["d.Up", "d.Go", "d.Go", "d.Down"], True),
            (["hwd_1.Up", "..", "d.Down"], True),
            (["..", "d.Down"], True),
            (["d.Up", ".."], True),
            (["..", "d.Go", ".."], True),
            ([".."], True),
            (["..", "d.Up", "d.Go", "d.Go", "..", "d.Down", ".."], True),
            (["d.Up", "d.Go", "d.Down"], False),
            (["d.Up", "..", "d.Up"], False),
            (["d.Go", ".."], False),
            ([], False),
            (["d.Up", "d.Go", "d.Go", "d.Down", "d.Up"], False),
        ],
    )
    def test_gaps_stand_for_any_number(self, wanted: list[str], is_fit: bool) -> None:
        assert fits(wanted, goals("d.Up", "d.Go", "d.Go", "d.Down")) is is_fit

    def test_nothing_sent_fits_nothing_and_a_gap(self) -> None:
        assert fits([], [])
        assert fits([".."], [])
        assert not fits(["d.Up"], [])

    def test_a_difference_is_read_line_by_line_with_places(self, wording: Wording) -> None:
        wording(list(diff(["d.Up", "d.Down"], goals("d.Up", "d.Go", "d.Down"))))
        assert list(diff(["d.Up", "d.Go", "d.Down"], goals("d.Up", "d.Down")))[1] == "  - d.Go"


class TestCoverage:
    def test_steps_and_branches_that_no_case_reached_are_named(self, read: Read) -> None:
        cases = read("    answers: [{ask: cold, answer: no}]\n    expect: {status: failed}\n", ASKING)
        coverage = Coverage(cases.task)
        play(cases, cases.cases[0], coverage)

        assert [(step.mark.line, step.title) for step in coverage.missed] == [(17, "notify"), (21, "notify")]
        assert [(step.mark.line, way) for step, way in coverage.untaken] == [
            (15, "then"),
            (21, "when"),
            (21, "skipped"),
        ]
        assert round(coverage.percent, 1) == 66.7

    def test_a_skipped_step_is_not_reached_but_its_branch_is_taken(self, read: Read) -> None:
        text = "steps:\n  - notify: Early.\n    when: task.priority == 'high'\n  - wait: 1 s\n"
        cases = read("    expect: {}\n", text)
        coverage = Coverage(cases.task)
        play(cases, cases.cases[0], coverage)

        assert [step.mark.line for step in coverage.missed] == [4]
        assert [way for _, way in coverage.untaken] == ["when"]

    def test_nodes_are_as_before_afterwards_also_after_an_error(self, read: Read) -> None:
        enter = Node.enter
        coverage = Coverage(read("    expect: {}\n", ASKING).task)

        def fall_over() -> None:
            with coverage.watched():
                assert Node.enter is not enter
                raise RuntimeError

        with pytest.raises(RuntimeError):
            fall_over()
        assert Node.enter is enter

    def test_equal_cases_come_out_equal(self, read: Read) -> None:
        cases = read(PICK_UP + "    expect: {}\n", shipped="pick_up.yaml")

        assert play(cases, cases.cases[0]) == play(cases, cases.cases[0])


REQUESTING = """\
steps:
  - request: Helper
    with: {n: %d}
    timeout: 20 min
  - notify: The helper is done.
"""
HELPER = """\
formiga: 1
task: Helper
params: {n: int}
steps:
  - check: n == 2
  - request: MoveTask
    with: {robot: lwd_2}
    timeout: 10 min
"""


class TestRequests:
    """A task beside the file, and one of the library that it requests in its turn, are played too."""

    def test_a_requested_task_is_played(self, read: Read, tmp_path: Path) -> None:
        (tmp_path / "helper.yaml").write_text(HELPER, encoding="utf-8")
        case = "    expect: {status: succeeded, actions: [], notices: [The helper is done.]}\n"
        cases = read(case, task=REQUESTING % 2)
        came, differs = outcome(cases)

        assert differs == []
        assert [task.name for task in cases.requested] == ["Helper", "MoveTask"]
        assert came.agents["lwd_2"].landed == "grounded"

    @pytest.mark.parametrize("code", ["request:check", "request:timeout"])
    def test_how_it_ended_can_be_expected(self, code: str, read: Read, tmp_path: Path) -> None:
        (tmp_path / "helper.yaml").write_text(HELPER, encoding="utf-8")
        cases = read(f"    expect: {{status: failed, code: {code}}}\n", task=REQUESTING % 3)
        _, differs = outcome(cases)

        assert len(differs) == (code != "request:check")

    def test_a_requested_task_with_errors_is_reported_once(self, tmp_path: Path) -> None:
        wrong = HELPER.replace("n == 2", "m == 2")
        for name, text in {"helper": wrong, "mine": "formiga: 1\ntask: Mine\n" + REQUESTING % 2}.items():
            (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
        file = tmp_path / "mine.test.yaml"
        file.write_text("formiga_test: 1\ntask: mine.yaml\ncases:\n  - {name: one, expect: {}}\n", encoding="utf-8")
        loaded = load_cases(file, catalogue=CATALOGUE)

        assert loaded.cases is None
        assert [(d.code, Path(d.mark.file).name) for d in loaded.diagnostics if d.severity == "error"] == [
            ("E010", "helper.yaml")
        ]


class TestCodes:
    def test_a_limit_of_the_envelope_is_a_code(self, read: Read) -> None:
        case = (
            "    faults: [{at: 20 s, agent: hwd_1, kind: battery, charge: 15 %}]\n"
            "    expect: {status: failed, code: envelope.reserve}\n"
        )
        _, differs = outcome(read(PICK_UP + case, shipped="pick_up.yaml"))

        assert differs == []

    @pytest.mark.parametrize(
        ("expected", "came", "is_it"),
        [
            ("blocked", "failed:blocked", True),
            ("failed:blocked", "failed:blocked", True),
            ("failed:blocked", "blocked", False),
            ("request:blocked", "request:failed:blocked", True),
            ("blocked", "request:failed:blocked", False),
            ("request:timeout", "request:timeout", True),
        ],
    )
    def test_an_agents_own_word_may_stand_alone(self, expected: str, came: str, is_it: bool) -> None:
        assert is_code(expected, came) is is_it

    @pytest.mark.parametrize(
        ("code", "written"),
        [
            ("envelope.reserve", "envelope.reserve"),
            ("failed:blocked", "blocked"),
            ("failed:timeout", "failed:timeout"),
            ("failed:timeouts", "failed:timeouts"),
            ("request:failed:blocked", "request:failed:blocked"),
            ("failed:Motor 3 is hot", ""),
            ("", ""),
        ],
    )
    def test_a_code_that_came_can_be_expected_again(self, code: str, written: str) -> None:
        problems = Problems()

        assert written_code(code) == written
        assert read_code(Scalar(written or "check", Mark("x", 1, 1)), (), problems) == (written or "check")
        assert problems.found == []
