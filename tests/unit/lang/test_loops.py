"""Loops, parallel, guard, release and live waits: what they become, what their names are, what is certain after them."""

from collections.abc import Callable

import pytest

from formiga_bt.lang import model
from formiga_bt.lang.loader import Loaded
from formiga_bt.lang.model import Task

Load = Callable[[str], Loaded]
Read = Callable[[str], Task]

AGENTS = """
agents:
  drones: {type: lwd, count: 3}
  one: {type: lwd}
  pickers: {type: picker, count: 2}
  picker: {type: picker}
  watcher: {type: watcher}
"""
ASK_TRACKER = """
      - do: picker.MiniFinder
        with: {base: "${base}"}
        save_as: fix
"""


@pytest.fixture
def steps(load: Load) -> Callable[[str], tuple[model.Step, ...]]:
    """Read steps that have no problems; unused roles do not count."""

    def read(text: str) -> tuple[model.Step, ...]:
        loaded = load(AGENTS + "steps:\n" + text)
        assert [d for d in loaded.diagnostics if d.code != "W060"] == []
        assert loaded.task is not None
        return loaded.task.steps

    return read


@pytest.fixture
def codes(load: Load) -> Callable[[str], list[tuple[str, int]]]:
    """Return the codes of a text of steps and their lines; the first step stands in line 1."""

    def read(text: str) -> list[tuple[str, int]]:
        first = AGENTS.count("\n") + 4
        found = load(AGENTS + "steps:\n" + text.lstrip("\n")).diagnostics
        return [(d.code, d.mark.line - first + 1) for d in found if d.code != "W060"]

    return read


Steps = Callable[[str], tuple[model.Step, ...]]
Codes = Callable[[str], list[tuple[str, int]]]


class TestWhatIsRead:
    def test_a_loop_knows_how_long_and_how_often(self, steps: Steps) -> None:
        loops = steps(
            "  - repeat: 3\n    steps: [{wait: 5 s}]\n"
            "  - repeat: 30 min\n    every: 15 s\n    max: 7\n    steps: [{notify: on}]\n"
            "  - repeat: forever\n    until: one.battery < 50 %\n    steps: [{wait: 5 s}]\n"
            "  - while: one.battery > 50 %\n    steps: [{wait: 5 s}]\n"
            '  - repeat: "${len(drones)}"\n    steps: [{wait: 5 s}]\n'
        )

        three, half_hour, forever, while_, by_list = loops
        assert isinstance(three, model.Loop)
        assert three.times is not None
        assert (three.times.const, three.kind, three.forever) == (3, "repeat", False)
        assert isinstance(half_hour, model.Loop)
        assert [e.const for e in (half_hour.duration, half_hour.every, half_hour.max) if e] == [1800.0, 15.0, 7]
        assert isinstance(forever, model.Loop)
        assert forever.forever
        assert forever.until is not None
        assert isinstance(while_, model.Loop)
        assert while_.cond is not None
        assert while_.kind == "while"
        assert isinstance(by_list, model.Loop)
        assert by_list.times is not None
        assert not by_list.times.is_const

    def test_a_for_has_its_lists_in_order(self, steps: Steps) -> None:
        (loop,) = steps(
            '  - for: {drone: "${drones}", n: "${range(3)}"}\n    mode: parallel\n    max_parallel: 2\n    need: 2\n'
            "    on_child_failure: cancel\n    steps:\n      - notify: ${drone.id} is ${n}.\n"
        )

        assert isinstance(loop, model.For)
        assert list(loop.lists) == ["drone", "n"]
        assert (loop.parallel, loop.max_parallel, loop.need, loop.on_child_failure) == (True, 2, 2, "cancel")
        assert [step.seg for step in loop.steps] == ["steps[0]"]

    def test_branches_are_numbered(self, steps: Steps) -> None:
        (step,) = steps("  - parallel: [{wait: 5 s}, {wait: 6 s}]\n    need: any\n")

        assert isinstance(step, model.Parallel)
        assert step.need == "any"
        assert [child.seg for child in step.steps] == ["parallel[0]", "parallel[1]"]

    def test_a_sequence_has_its_finally(self, steps: Steps) -> None:
        (step,) = steps("  - sequence: [{wait: 5 s}]\n    finally: [{notify: done}]\n")

        assert isinstance(step, model.Sequence)
        assert [child.seg for child in step.finally_] == ["finally[0]"]

    def test_live_conditions_have_deadlines_and_others_do_not(self, load: Load) -> None:
        loaded = load(
            "params: {t: time}\nsteps:\n  - wait_until: now > t\n    timeout: 1 h\n"
            "  - guard: now < t + 5 min\n    steps: [{wait: 5 s}]\n  - check: now > t\n"
            "  - sequence:\n      - check: now < t\n      - wait: 5 s\n    reactive: true\n"
        )
        assert loaded.task is not None
        until, guard, check, reactive = loaded.task.steps

        assert isinstance(until, model.WaitUntil)
        assert isinstance(guard, model.Guard)
        assert isinstance(check, model.Check)
        assert isinstance(reactive, model.Sequence)
        first = reactive.steps[0]
        assert isinstance(first, model.Check)
        assert [len(step.cond.deadlines) for step in (until, guard, check, first)] == [1, 1, 0, 1]

    def test_a_role_knows_what_its_items_are_ordered_to_do(self, task: Read) -> None:
        found = task(
            "imports: [lib/flying.yaml]\nagents:\n  drones: {type: lwd, count: 2}\nsteps:\n"
            '  - for: {drone: "${drones}"}\n    steps:\n      - do: drone.TakeOff\n'
            '      - call: ReturnHome\n        with: {drone: "${drone}"}\n'
        )

        assert found.roles["drones"].actions == ("TakeOff", "GoTo", "LandIn")


class TestNames:
    def test_a_loop_name_may_be_used_again_by_a_later_loop(self, steps: Steps) -> None:
        loop = '  - for: {drone: "${drones}"}\n    steps:\n      - notify: ${drone.id}\n'

        assert len(steps(loop + "  - wait: 1 s\n" + loop)) == 3

    def test_it_may_be_asked_and_told_and_passed_on(self, codes: Codes) -> None:
        text = """
  - for: {who: "${pickers}"}
    mode: parallel
    steps:
      - ask: Are you there?
        of: [who]
        timeout: 5 min
      - notify: Thanks.
        to: [who]
"""
        assert codes(text) == []

    def test_what_the_last_round_saved_may_be_unset(self, codes: Codes) -> None:
        loop = f"  - while: picker.battery > 20 %\n    steps:{ASK_TRACKER}"

        assert codes(loop + "  - check: fix.in_range\n") == [("E019", 6)]
        assert codes(loop + "  - check: is_set(fix) and fix.in_range\n") == []

    def test_a_loop_that_runs_at_least_once_has_saved_it(self, codes: Codes) -> None:
        for how in ("repeat: 3", "repeat: 5 min", "for: {i: [1, 2]}"):
            found = codes(f"  - {how}\n    steps:{ASK_TRACKER}  - check: fix.in_range\n")
            assert found == [], how

    def test_what_was_saved_before_the_way_out_is_certain_after_it(self, codes: Codes) -> None:
        before = (
            f"  - repeat: forever\n    steps:{ASK_TRACKER}      - break_if: fix.in_range\n  - check: fix.in_range\n"
        )
        after = (
            f"  - repeat: forever\n    steps:\n      - break_if: picker.battery < 50 %{ASK_TRACKER}"
            "      - check: fix.in_range\n  - check: fix.in_range\n"
        )

        assert codes(before) == []
        assert codes(after) == [("E019", 8)]

    def test_until_sees_what_the_round_saved(self, codes: Codes) -> None:
        assert codes(f"  - repeat: forever\n    until: fix.in_range\n    steps:{ASK_TRACKER}") == []

    def test_a_round_reads_nothing_that_the_one_before_saved(self, codes: Codes) -> None:
        text = f"  - repeat: 3\n    steps:\n      - notify: Last time HERE.{ASK_TRACKER}"

        assert codes(text.replace("HERE", "${fix.go_to}")) == [("E019", 3)]
        assert codes(text.replace("notify", "when: is_set(fix)\n        notify").replace("HERE", "there")) == [
            ("E019", 3)
        ]

    def test_branches_see_nothing_of_each_other_until_all_have_ended(self, codes: Codes) -> None:
        deeper = ASK_TRACKER.replace("      ", "          ")
        text = f"  - parallel:\n      - sequence:{deeper}      - HERE\n  - check: fix.in_range\n"

        assert codes(text.replace("HERE", "wait: 5 s")) == []
        assert codes(text.replace("HERE", "check: fix.in_range")) == [("E019", 6)]
        assert codes(text.replace("HERE", "wait: 5 s").replace("  - check", "    need: any\n  - check")) == [
            ("E019", 8)
        ]

    def test_items_keep_what_they_save_to_themselves(self, codes: Codes) -> None:
        text = f'  - for: {{picker_: "${{pickers}}"}}\n    mode: parallel\n    steps:{ASK_TRACKER}'.replace(
            "do: picker.", "do: picker_."
        )

        used = text.replace("save_as: fix", "save_as: fix\n      - check: fix.in_range")
        assert codes(used) == []
        assert codes(used + "  - check: fix.in_range\n") == [("E072", 8)]
        collect = text.replace("mode: parallel", "mode: parallel\n    collect: fix")
        assert codes(collect + "  - notify: Go to ${fix[0].go_to}.\n") == []
        assert codes(collect) == []  # saved in vain is only a warning, W060

    def test_first_gives_the_value_of_one_item(self, codes: Codes) -> None:
        text = f'  - for: {{picker_: "${{pickers}}"}}\n    mode: parallel\n    first: fix\n    steps:{ASK_TRACKER}'.replace(
            "do: picker.", "do: picker_."
        )

        assert codes(text + "  - notify: Go to ${fix.go_to}.\n") == []
        assert codes(text + "  - notify: Go to ${fix[0].go_to}.\n") == [("E013", 8)]  # no list
        assert codes(text.replace("first: fix", "first: fixes")) == [("E010", 3)]
        assert codes(text.replace("mode: parallel", "mode: each")) == [("E008", 3)]
        for other in ("need: 1", "collect: fix", "on_child_failure: cancel"):
            assert codes(text.replace("mode: parallel", f"mode: parallel\n    {other}")) == [("E008", 3)]

    def test_of_a_list_that_may_be_empty_first_may_have_no_value(self, codes: Codes) -> None:
        text = f"  - for: {{i: LIST}}\n    mode: parallel\n    max_parallel: 1\n    first: fix\n    steps:{ASK_TRACKER}"
        empty = text.replace("LIST", "'${range(len(pickers))}'")
        after = "  - notify: Go to ${fix.go_to}.\n"

        assert codes(text.replace("LIST", "[1, 2]") + after) == []
        assert codes(empty + after) == [("E019", 9)]
        assert codes(empty + after + "    when: is_set(fix)\n") == []

    def test_each_collects_too(self, codes: Codes) -> None:
        text = f"  - for: {{i: [1, 2]}}\n    collect: fix\n    steps:{ASK_TRACKER}  - check: len(fix) == 2\n"

        assert codes(text) == []

    def test_a_name_keeps_its_meaning(self, codes: Codes) -> None:
        text = f"  - for: {{i: [1, 2]}}\n    steps:{ASK_TRACKER}      - check: fix.in_range\n"

        assert codes(text + "  - for: {fix: [1, 2]}\n    steps: [{notify: 'Now ${fix}.'}]\n") == [("E018", 7)]


class TestRelease:
    def test_reading_it_before_is_fine_and_people_may_go(self, codes: Codes) -> None:
        assert codes("  - check: one.battery > 50 %\n  - release: one\n  - release: watcher\n") == []

    def test_a_branch_that_gives_it_back_counts(self, codes: Codes) -> None:
        text = "  - if: one.battery > 50 %\n    then: [{release: one}]\n  - check: one.battery > 20 %\n"

        assert codes(text) == [("E023", 3)]

    def test_the_list_is_gone_with_its_items(self, codes: Codes) -> None:
        loop = '  - for: {drone: "${drones}"}\n    steps: [{release: drone}]\n'

        assert codes(loop) == []
        assert codes(loop + loop) == [("E023", 3)]

    def test_what_is_no_agent_cannot_be_released(self, codes: Codes) -> None:
        assert codes("  - release: drones\n") == [("E024", 1)]
        assert codes("  - release: watchers\n") == [("E020", 1)]


class TestEndsAndWaits:
    @pytest.mark.parametrize(
        "around",
        [
            "  - repeat: forever\n    timeout: 5 min\n    ignore_failure: true\n    steps: [{wait: 5 s}]\n",
            "  - sequence:\n      - repeat: forever\n        steps: [{wait: 5 s}]\n    timeout: 5 min\n",
            "  - guard: one.battery > 50 %\n    steps:\n      - repeat: forever\n        steps: [{wait: 5 s}]\n",
            "  - parallel:\n      - wait: 5 min\n      - repeat: forever\n        steps: [{wait: 5 s}]\n    need: any\n",
        ],
    )
    def test_something_around_may_end_it(self, codes: Codes, around: str) -> None:
        assert codes(around) == []

    def test_a_break_of_an_inner_loop_does_not_end_the_outer_one(self, codes: Codes) -> None:
        text = """
  - repeat: forever
    steps:
      - repeat: forever
        steps:
          - wait: 5 s
          - break_if: one.battery > 50 %
"""
        assert codes(text) == [("E041", 1)]

    def test_a_count_or_a_period_is_wait_enough(self, codes: Codes) -> None:
        assert codes("  - repeat: 3\n    steps: [{notify: on}]\n") == []
        assert codes("  - repeat: 5 min\n    every: 5 s\n    steps: [{notify: on}]\n") == []
        assert codes("  - repeat: 5 min\n    steps: [{notify: on}]\n") == [("E042", 1)]

    def test_after_a_loop_that_only_a_timeout_ends_nothing_runs(self, codes: Codes) -> None:
        loop = "  - repeat: forever\n    timeout: 5 min\n    steps: [{wait: 5 s}]\n"

        assert codes(loop + "  - notify: done\n") == [("E043", 4)]
        assert codes(loop + "    ignore_failure: true\n  - notify: done\n") == []

    def test_break_if_works_through_what_keeps_order(self, codes: Codes) -> None:
        text = """
  - repeat: forever
    steps:
      - wait: 5 s
      - guard: one.battery > 40 %
        steps:
          - sequence:
              - if: one.battery > 50 %
                then: [{break_if: one.battery > 60 %}]
            name: Until it is full
"""
        assert codes(text) == []


def test_a_check_of_a_percent_reads_as_written(codes: Codes) -> None:
    assert codes("  - while: one.battery > 0.5 %\n    steps: [{wait: 5 s}]\n") == [("W070", 1)]


def test_forever_with_max_has_an_end(codes: Codes) -> None:
    assert codes("  - repeat: forever\n    max: 3\n    timeout: 5 min\n    steps: [{wait: 5 s}]\n  - wait: 1 s\n") == []
    assert codes("  - repeat: forever\n    max: 3\n    steps: [{wait: 5 s}]\n  - wait: 1 s\n") == []
