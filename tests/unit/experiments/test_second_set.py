"""The second set: every oracle accepts a right tree and refuses wrong ones; wordings are many, and in two languages."""

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from experiments.e2_llm import rejudge
from experiments.e2_llm.authors import Attempt, Written
from experiments.e2_llm.fly import checked, world_of
from experiments.e2_llm.records import Judged, Whose, append, read
from experiments.e2_llm.report import tables
from experiments.e2_llm.second_run import second, second_run
from experiments.e2_llm.second_set import LANGUAGES, Second, judge_tree, second_set
from experiments.e2_llm.shorthand import task_text
from tests.golden import Wording
from tests.shares import some

WORLD = world_of()
SET = second_set()
FLOWN = [one for one in SET if one.reference]
FIRST = [one for one in FLOWN if one.case == 0]


def name(one: Second) -> str:
    return one.id


def test_there_are_enough_of_them() -> None:
    assert len(SET) >= 120
    assert len({one.kind for one in SET}) >= 10
    assert len({one.id for one in SET}) == len(SET)
    for one in SET:
        assert len(one.words["en"]) >= 2, one.id
        assert len(one.words["es"]) >= 1, one.id
        assert len(set(one.wordings)) == len(one.wordings), one.id
    assert LANGUAGES == ("en", "es")


def test_no_two_requests_have_the_same_words() -> None:
    words = [text for one in SET for text in one.wordings]

    assert [text for text in words if words.count(text) > 1] == []
    assert not any("{" in text or "<" in text for text in words)


def test_what_flies_has_checks_and_a_wrong_tree_and_what_does_not_has_neither() -> None:
    for one in SET:
        assert ("task" in one.answer) == bool(one.reference) == bool(one.flights) == bool(one.wrong), one.id


@pytest.mark.parametrize("one", FIRST, ids=name)
def test_a_right_tree_is_accepted(one: Second) -> None:
    assert str(judge_tree(one, one.reference, {}, WORLD)) == "right"


@pytest.mark.parametrize("one", FIRST, ids=name)
def test_wrong_trees_are_refused(one: Second) -> None:
    for text in one.wrong:
        task, errors = checked(text, WORLD)
        assert task is not None, errors
        verdict = judge_tree(one, text, {}, WORLD)
        assert not verdict.ok
        assert "refused" not in verdict.codes


@pytest.mark.parametrize("one", [one for one in FLOWN if one.case == 1][::6], ids=name)
def test_cases_of_a_family_differ_in_what_is_flown(one: Second) -> None:
    other = next(two for two in FLOWN if (two.kind, two.family, two.case) == (one.kind, one.family, 0))

    assert judge_tree(one, one.reference, {}, WORLD).ok
    assert not judge_tree(one, other.reference, {}, WORLD).ok


class Perfect:
    """Writes the reference, refuses and asks where that is right; or flies whatever is asked."""

    def __init__(self, *, flies_all: bool = False) -> None:
        self.by_words = {text: one for one in SET for text in one.wordings}
        self.flies_all = flies_all

    def write(self, task: str, words: str) -> Written:
        one = self.by_words[words]
        if one.reference or self.flies_all:
            text = one.reference or FLOWN[0].reference
            return Written(kind="task", attempts=(Attempt(yaml=text, passed=True),), yaml=text, seconds=1.0)
        return Written(kind=one.answer[0], attempts=(Attempt(),), say="No.", seconds=1.0)  # type: ignore[arg-type]


WHOSE = Whose(provider="scripted", model="none")


def test_the_second_set_runs_on_from_where_it_was(tmp_path: Path, wording: Wording) -> None:
    out = tmp_path / "results.jsonl"

    assert second(Perfect(), WHOSE, "helpers", out, most=2) == 2
    assert second(Perfect(), WHOSE, "helpers", out, most=3) == 3

    runs = read(out)
    assert len({run.key for run in runs}) == 5
    assert all(run.last is not None and run.last.success for run in runs)
    assert {run.task.split("/")[1] for run in runs} == {"ambiguous"}
    assert "| ambiguous/what/0 |" not in tables(runs)
    wording(tables(runs))


def test_another_turn_takes_other_wordings_of_each_so_many_th_request(tmp_path: Path) -> None:
    for turn in (0, 1, 2):
        assert second(Perfect(), WHOSE, "helpers", tmp_path / "all.jsonl", every=60, turn=turn) == len(SET[::60])

    runs = read(tmp_path / "all.jsonl")
    assert len({run.words for run in runs}) == 3 * len(SET[::60])
    assert {run.task for run in runs} == {f"second/{one.id}" for one in SET[::60]}


def test_trees_of_a_results_file_are_judged_anew(tmp_path: Path) -> None:
    out, anew = tmp_path / "results.jsonl", tmp_path / "anew.jsonl"
    second(Perfect(), WHOSE, "helpers", out, every=30)
    runs = read(out)
    wrong = Judged(valid=True, passed=True, success=False, faults=("ends",), said="an oracle that was wrong")
    out.unlink()
    for run in runs:
        append(out, structs.replace(run, first=wrong, last=wrong) if run.kind == "task" else run)

    rejudge.main([str(out), "--out", str(anew)])

    assert read(anew) == runs


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        (["a land camp", "b land offset(camp, east=10 m)", "c land offset(camp, east=-10 m)"], "right"),
        (["a land camp", "b land offset(camp, east=10 m)", "c land offset(camp, east=20 m)"], "right"),
        (
            ["a land offset(camp, east=30 m)", "b land offset(camp, east=10 m)", "c land offset(camp, east=20 m)"],
            "row: 2 stand at camp at the end, not 3",
        ),
        (
            ["a land camp", "b land offset(camp, east=5 m)", "c land offset(camp, east=15 m)"],
            "row: their nearest are 5, 5, 10 m away, not 10 m",
        ),
    ],
)
def test_a_row_may_begin_at_its_place(steps: list[str], said: str) -> None:
    one = next(one for one in SET if one.id == "teams/three_meet/0")
    text = task_text({"agents": {"a": "lwd", "b": "lwd", "c": "lwd"}, "steps": steps})

    assert str(judge_tree(one, text, {}, WORLD)) == said


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        (["d fly camp 40 m", {"repeat": 3, "steps": ["d fly lake_shore 40 m", "d fly camp 40 m"]}, "d home"], "right"),
        (
            ["d fly camp 40 m", {"repeat": 2, "steps": ["d fly lake_shore 40 m", "d fly camp 40 m"]}, "d home"],
            "over: 2 fitting visits to lake_shore, not 3",
        ),
    ],
)
def test_rounds_may_end_where_they_begin(steps: list[Any], said: str) -> None:
    one = next(one for one in SET if one.id == "loops/back_and_forth/0")

    assert str(judge_tree(one, task_text({"agents": {"d": "lwd"}, "steps": steps}), {}, WORLD)) == said


@pytest.mark.parametrize("kind", ["impossible", "dangerous", "ambiguous"])
def test_flying_what_must_be_refused_is_wrong(kind: str) -> None:
    one = next(one for one in SET if one.kind == kind)

    run = second_run(Perfect(flies_all=True), one, 0, WHOSE, "helpers", WORLD)

    assert run.last is not None
    assert (run.last.success, run.last.faults) == (False, ("not_refused",))


def test_refusing_what_can_be_done_is_wrong() -> None:
    class No:
        def write(self, task: str, words: str) -> Written:
            return Written(kind="impossible", attempts=(Attempt(),), say="No.")

    run = second_run(No(), FLOWN[0], 0, WHOSE, "helpers", WORLD)

    assert run.last is not None
    assert run.last.faults == ("said_impossible",)


def test_the_comparison_of_the_product_has_nothing_against_a_right_tree_in_any_wording_and_language() -> None:
    from formiga_bt.lang.loader import load_task_text
    from formiga_bt.llm.judging.compare import compare
    from formiga_bt.llm.judging.outcome import fly
    from formiga_bt.llm.words.wording import read
    from formiga_bt.llm.world import world_of as live_world

    world = live_world()
    alarms = []
    for one in FLOWN[:: some(4, 1)]:
        task = load_task_text(
            one.reference, "x.yaml", catalogue=world.catalogue, site=world.site, library=world.folders
        ).task
        assert task is not None
        flight = fly(task, world)
        for words in one.wordings:
            found = compare(read(words, world.site, world.catalogue), task, one.reference, flight, world)
            alarms += [(one.id, said.code, words) for said in found if said.severity == "error"]
    assert alarms == []
