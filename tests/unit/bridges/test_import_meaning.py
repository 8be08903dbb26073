"""Nodes with a memory of their own run as they do there: the imported steps and the node, beside each other on all outcomes."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest
import yaml

from formiga_bt.bridges.btcpp_in import import_btcpp
from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import CheckWorld
from formiga_bt.lang.loader import load_task_text

HEAD = '<root BTCPP_format="4">'
LEFT_TO_PEOPLE = {"E020", "E021"}


def imported(tree: str, *more: str) -> Any:
    """Return what becomes of a tree: the finding codes, and the task as YAML."""
    trees = "".join(f'<BehaviorTree ID="S{n}">{one}</BehaviorTree>' for n, one in enumerate(more))
    return import_btcpp(f'{HEAD}<BehaviorTree ID="Main">{tree}</BehaviorTree>{trees}</root>'.encode(), "m.xml")


class Steps:
    """The few kinds of steps that are needed here, on given outcomes of actions."""

    def __init__(self, task: dict[str, Any], outcomes: Iterator[bool]) -> None:
        self.values: dict[str, Any] = dict(task.get("vars", {}))
        self.task, self.outcomes, self.ran = task, outcomes, ""

    def all(self) -> bool:
        return all(self.step(step) for step in self.task["steps"])

    def step(self, step: dict[str, Any]) -> bool:
        if not self.holds(step.get("when", "True")):
            return True
        attempts = step.get("retry", {}).get("attempts", 1)
        return any(self.once(step) for _ in range(attempts)) or bool(step.get("ignore_failure"))

    def once(self, step: dict[str, Any]) -> bool:
        if "do" in step:
            self.ran += step["do"].partition(".")[2].lower()
            return next(self.outcomes)
        if "sequence" in step:
            return all(self.step(one) for one in step["sequence"])
        if "fallback" in step:
            return any(self.step(one) for one in step["fallback"])
        if "set" in step:
            self.values.update(step["set"])
            return True
        return self.holds(step["check"])

    def holds(self, condition: str) -> bool:
        return bool(eval(str(condition), {}, dict(self.values)))


def recovery(retries: int, outcomes: Iterator[bool]) -> tuple[str, bool]:
    """Return what Nav2's RecoveryNode of A and B runs, and how it ends."""
    ran = ""
    for left in range(retries, -1, -1):
        ran += "a"
        if next(outcomes):
            return ran, True
        if left:
            ran += "b"
            if not next(outcomes):
                return ran, False
    return ran, False


@pytest.mark.parametrize("retries", [0, 1])
def test_a_recovery_node_runs_its_second_child_after_a_failure_of_the_first(retries: int) -> None:
    done = imported(f'<RecoveryNode number_of_retries="{retries}"><A/><B/></RecoveryNode>')
    for outcomes in product([True, False], repeat=3):
        steps = Steps(yaml.safe_load(done.text), iter(outcomes))
        end = steps.all()
        assert (steps.ran, end) == recovery(retries, iter(outcomes)), outcomes
    assert done.errors == []


@pytest.mark.parametrize("retries", [2, 4])
def test_a_recovery_node_tries_as_often_as_it_says_where_recovery_succeeds(retries: int) -> None:
    done = imported(f'<RecoveryNode number_of_retries="{retries}"><A/><B/></RecoveryNode>')
    for of_a in product([True, False], repeat=retries + 1):
        outcomes = [one for a in of_a for one in (a, True)]
        steps = Steps(yaml.safe_load(done.text), iter(outcomes))
        end = steps.all()
        assert (steps.ran, end) == recovery(retries, iter(outcomes)), outcomes
    assert "X07" in {one.code for one in done.found}


def test_a_recovery_node_without_a_number_retries_once() -> None:
    task = yaml.safe_load(imported("<RecoveryNode><A/><B/></RecoveryNode>").text)
    steps = Steps(task, iter([False, True, False]))
    assert not steps.all()
    assert steps.ran == "aba"


def test_round_robin_begins_with_the_child_after_the_one_that_ended_it() -> None:
    """Three rounds of it: as a ring of children, of which the next one that succeeds ends a round."""
    robin = "<RoundRobin><A/><B/><C/></RoundRobin>"
    task = yaml.safe_load(imported(robin).text)
    for outcomes in product([True, False], repeat=9):
        given = iter(outcomes)
        steps = Steps(task, given)
        there, turn, expected = iter(outcomes), 0, ""
        for _ in range(3):
            end = steps.all()
            turn, expected_end = turn % 3, False
            while turn < 3 and not expected_end:
                expected += "abc"[turn]
                expected_end, turn = next(there), turn + 1
            assert (steps.ran, end) == (expected, expected_end), outcomes


@pytest.mark.parametrize("fails", [True, False])
def test_an_inverter_of_an_action_succeeds_where_it_fails(fails: bool) -> None:
    steps = Steps(
        yaml.safe_load(imported("<Sequence><Inverter><A/></Inverter><B/></Sequence>").text), iter([not fails, True])
    )
    assert steps.all() is fails
    assert steps.ran == ("ab" if fails else "a")


@pytest.mark.parametrize(
    "tree",
    [
        "<PipelineSequence><A/><B/></PipelineSequence>",
        '<RateController hz="1"><A/></RateController>',
        "<RunOnce><A/></RunOnce>",
        "<RecoveryNode><A/></RecoveryNode>",
        '<A _onSuccess="x := 1"/>',
        '<SubTree ID="Nowhere"/>',
    ],
)
def test_what_cannot_be_said_is_an_error_at_its_place(tree: str) -> None:
    done = imported(f"<Sequence>\n  {tree}\n</Sequence>")
    assert [(one.code in ("X08", "X09"), one.mark.line) for one in done.errors] == [(True, 2)]


@pytest.mark.parametrize("tree", ["<Inverter><A/></Inverter>", "<RoundRobin><A/><B/></RoundRobin>"])
def test_what_needs_a_variable_is_an_error_in_a_subtree(tree: str) -> None:
    done = imported('<SubTree ID="S0"/>', tree)
    assert [one.code for one in done.errors] == ["X09"]
    with_steps = yaml.safe_load(done.text)["subtrees"]["S0"]["steps"]
    assert "fail" in with_steps[0]["sequence"][0]


def test_these_nodes_check_but_for_the_catalogue(world: CheckWorld) -> None:
    done = imported(
        '<RecoveryNode number_of_retries="3"><Inverter><A/></Inverter><RoundRobin><B/><C/></RoundRobin></RecoveryNode>'
    )
    found = load_task_text(done.text, "task.yaml", catalogue=world.catalogue).diagnostics
    assert {one.code for one in found} <= LEFT_TO_PEOPLE


def test_an_import_with_errors_ends_with_one_and_writes_a_task_that_fails_there(tmp_path: Any) -> None:
    xml, out = tmp_path / "a.xml", tmp_path / "a.yaml"
    xml.write_text(f'{HEAD}<BehaviorTree ID="M"><RateController><A/></RateController></BehaviorTree></root>')
    assert run(["import", str(xml), "-o", str(out)]) == 1
    assert "fail" in yaml.safe_load(out.read_text())["steps"][0]["sequence"][0]
