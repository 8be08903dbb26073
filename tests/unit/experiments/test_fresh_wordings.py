"""The fresh wordings of T6 to T10: each says all, none is a copy, and they are kept apart in runs and reports."""

import re
from pathlib import Path
from typing import Any

import pytest

from experiments.e2_llm import run as runner
from experiments.e2_llm.authors import Written
from experiments.e2_llm.columns import examples_for
from experiments.e2_llm.fly import world_of
from experiments.e2_llm.fresh import FRESH, SECOND
from experiments.e2_llm.records import Judged, Run, read
from experiments.e2_llm.report import figures, tables
from experiments.e2_llm.requests import WORDS, last_run, requests
from formiga_bt.base.errors import FormigaError
from tests.golden import Wording

WORLD = world_of()
EACH = [(task, run, words) for task, wordings in FRESH.items() for run, words in enumerate(wordings, start=30)]
ONE_OF = {
    "T6": (
        r"\bport\b",
        r"\b(round|ring|circle|360|tour|revolution|orbit|lap|circuit|loop|circumference|sixty|full way)\b",
        r"\b(lands?|landing|down)\b",
    ),
    "T7": (
        r"\b(three|3)\b",
        r"\b(square|right.angle[ds]?|right triangle|ninety|90|quarter|L)\b",
        r"\b(lands?|landing|set down|touch down|ground)\b",
    ),
    "T8": (
        r"\b(land|lands|landing|touching down|put down|on the ground)\b",
        r"\b(zig-?zags?|tack|bounce|cross|weaving|slaloming)\b",
    ),
    "T9": (
        r"\b(two|2|another|pair|both|one more)\b",
        r"\b(turn|360|circuit|ring|circle|turns|about|lap|orbits|orbit|round)\b",
        r"\b(lands?|landing|down)\b",
    ),
    "T10": (
        r"\b(two|2|couple)\b",
        r"\bwatcher\b",
        r"\bport\b",
        r"\b(yes|affirmative|If so|If it is|confirm)\b",
        r"\b(first|one|1|lead)\b",
    ),
}


def sixes(words: str, value: str) -> set[tuple[str, ...]]:
    """Return all runs of six words, with a mark, or nothing, in place of what is drawn."""
    told = re.findall(r"[\w'#]+", re.sub(r"\{\w+\}", value, words).lower())
    return {tuple(told[i : i + 6]) for i in range(len(told) - 5)}


def copied(words: str, others: list[str]) -> set[tuple[str, ...]]:
    return {six for value in (" # ", " ") for other in others for six in sixes(words, value) & sixes(other, value)}


def test_there_are_twice_ten_of_each() -> None:
    assert {task: len(wordings) for task, wordings in FRESH.items()} == dict.fromkeys(
        ("T6", "T7", "T8", "T9", "T10"), 20
    )
    for task in (*FRESH, "T10+"):
        found = requests(task, WORLD, 20, 30)
        assert [one.run for one in found] == list(range(30, 50))
        assert len({one.words for one in found}) == 20
        assert not any("{" in one.words or one.paper_words for one in found)


@pytest.mark.parametrize("task", FRESH)
def test_no_fresh_wording_has_six_words_of_another(task: str) -> None:
    others = [words for wordings in WORDS.values() for words in wordings]
    shown = [request for request, _ in examples_for("T10+")]
    for number, words in enumerate(FRESH[task]):
        run = 30 + number
        apart = [one for _, at, one in EACH if one != words and (run >= SECOND or at < SECOND)]
        rows = copied(words, [*others, *shown, *apart])
        if run < SECOND:
            assert rows == set(), f"{task}/{run}"
        else:  # who wrote these had seen none of the others; what everybody says may be the same
            assert len(rows) <= len(sixes(words, " # ")) / 2, f"{task}/{run}: {sorted(rows)}"


def test_a_copy_would_be_found() -> None:
    assert copied("please fly once round {center} at a distance of five", list(WORDS["T6"]))
    assert copied("a radius of {radius} m around the first drone, say", list(WORDS["T9"]))


@pytest.mark.parametrize(("task", "run", "words"), EACH, ids=[f"{task}/{run}" for task, run, _ in EACH])
def test_a_fresh_wording_says_all_that_is_drawn(task: str, run: int, words: str) -> None:
    drawn = set(re.findall(r"\{(\w+)\}", WORDS[task][0]))
    assert {name.removesuffix("_words") for name in re.findall(r"\{(\w+)\}", words)} == drawn, run
    assert re.search(r"\b(LWDs?|light drones?|lightweight)\b", words, re.IGNORECASE)
    for pattern in ONE_OF[task]:
        assert re.search(pattern, words, re.IGNORECASE), pattern


def test_numbers_may_be_in_words(wording: Wording) -> None:
    (request,) = requests("T6", WORLD, 1, 34)

    assert request.goal["radius_m"] == 5.0
    wording(request.words)


def test_earlier_runs_stay_as_they_are() -> None:
    assert requests("T8", WORLD, 2, 28) == requests("T8", WORLD)[28:]
    assert len(requests("T8", WORLD)) == 30


def test_there_is_no_run_beyond_the_last(wording: Wording) -> None:
    assert (last_run("T6"), last_run("T10+"), last_run("T1")) == (49, 49, 29)
    with pytest.raises(FormigaError) as refused:
        requests("T6", WORLD, 21, 30)
    wording(refused.value)
    with pytest.raises(FormigaError) as refused:
        requests("T1", WORLD, 1, 30)
    wording(refused.value)


class Asks:
    """A model, and an author, that only asks back."""

    name = model = "scripted"

    def __init__(self, *_any: object) -> None: ...

    def write(self, _task: str, _words: str) -> Written:
        return Written(kind="question", attempts=(), say="Where?", seconds=1.0)

    def close(self) -> None: ...


def test_runs_may_begin_at_the_fresh_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import formiga_bt.llm.client as client

    monkeypatch.setattr(client, "open_chat", lambda *_a, **_k: Asks())
    monkeypatch.setattr(runner, "DraftAuthor", Asks)
    out = tmp_path / "fresh.jsonl"
    given = ["--column", "helpers", "--tasks", "T6,T9", "--from", "38", "--runs", "2", "--out", str(out)]

    assert runner.main(given) == 0

    assert [(one.task, one.run) for one in read(out)] == [("T6", 38), ("T6", 39), ("T9", 38), ("T9", 39)]
    assert read(out)[0].words == requests("T6", WORLD, 1, 38)[0].words


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (["--tasks", "T6", "--from", "30"], "--from 30 --runs 30 asks for runs 30 to 59: T6 has runs 0 to 49"),
        (["--tasks", "T6,T1", "--from", "30", "--runs", "10"], "asks for runs 30 to 39: T1 has runs 0 to 29"),
        (["--tasks", "T6", "--from", "-1"], "--runs is 1 or more, --from 0 or more"),
        (["--tasks", "T6", "--runs", "0"], "--runs is 1 or more, --from 0 or more"),
    ],
)
def test_a_run_beyond_the_last_is_told(
    given: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        runner.main([*given, "--column", "helpers", "--out", str(tmp_path / "x.jsonl")])

    assert text in " ".join(capsys.readouterr().err.split())


def row(run: int, success: bool, column: str = "paper", **more: Any) -> Run:
    judged = Judged(valid=True, passed=True, success=success, faults=() if success else ("no_circle",))
    values: dict[str, Any] = {"task": "T6", "kind": "task", "first": judged, "last": judged, "ngram_tree": 0.5} | more
    return Run(provider="p", model="m", column=column, run=run, words="", subtree_match=0.5, flow_match=0.5, **values)


def test_the_report_has_them_in_a_row_of_their_own(tmp_path: Path, wording: Wording) -> None:
    for column in ("paper", "helpers", "tuned"):
        text = tables([row(0, True, column), row(29, True, column), row(30, False, column, ngram_tree=0.25)])

        lines = [line for line in text.splitlines() if line.startswith("| T6")]
        old, new = lines[0].split(" | "), lines[1].split(" | ")
        assert old[0] == "| T6"
        wording(new[0])
        assert old[2][:14] == "100.0 % (2/2; "
        wording(new[2][:13])
        assert (old[1] == "-", new[1]) == (column != "paper", "-")  # what the paper has is of its own sentence
        wording(lines[2:])
    only = tables([row(30, True, task="T10")])
    wording(only)
    assert "| T10 | " not in only
    assert figures([row(30, True), row(39, True, task="T10")], tmp_path) == []


def test_figures_leave_them_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import experiments.e2_llm.report as report

    drawn: list[list[int]] = []
    monkeypatch.setattr(report, "_box", lambda _axes, rows, *_rest: drawn.append([one.run for one in rows]))

    figures([row(0, True), row(29, True), row(30, True)], tmp_path)

    assert drawn == [[0, 29]] * 4
