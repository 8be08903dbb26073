"""The runner of the language-model experiment, over an author that writes the shipped trees or wrong ones."""

import gzip
from pathlib import Path

import pytest
from msgspec import structs

from experiments.e2_llm import rejudge
from experiments.e2_llm.authors import Attempt, Written
from experiments.e2_llm.columns import LeakError, PaperChat, examples_for, hidden_in, without_hidden
from experiments.e2_llm.fly import world_of
from experiments.e2_llm.records import Judged, Whose, append, read
from experiments.e2_llm.report import figures, share, tables, wilson
from experiments.e2_llm.requests import WORDS, Request, requests
from experiments.e2_llm.run import experiment
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.packaged import folder
from formiga_bt.llm.records import Message
from tests.golden import Wording, timeless

WORLD = world_of()
WHOSE = Whose(provider="scripted", model="none")
WRONG = """formiga: 1
task: Wrong
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd, near: "${base}"}
steps:
  - do: drone.TakeOff
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
DUE = {one.words: one for task in ("T6", "T10+") for one in requests(task, WORLD)}


class Scripted:
    """Writes the shipped tree: at once, or after a wrong one."""

    def __init__(self, *, repairs: bool = False, kind: str = "task") -> None:
        self.repairs, self.kind, self.asked = repairs, kind, 0

    def write(self, task: str, words: str) -> Written:
        self.asked += 1
        if self.kind == "down":
            raise FormigaError("nobody answers")
        if self.kind == "question":
            return Written(kind="question", attempts=(Attempt(tokens=5),), say="Where?", seconds=1.0)
        request: Request = DUE[words]
        right = Attempt(yaml=reference(request), values=request.values, passed=True, tokens=100, seconds=2.0)
        wrong = Attempt(yaml=WRONG, passed=False, problems=("place_not_used",), tokens=50, seconds=1.0)
        attempts = (wrong, right) if self.repairs else (right,)
        return Written(kind="task", attempts=attempts, yaml=right.yaml, values=right.values, seconds=3.5)


def reference(request: Request) -> str:
    return (folder("trees") / f"{request.reference}.yaml").read_text(encoding="utf-8")


def test_a_right_tree_is_a_success(tmp_path: Path) -> None:
    out = tmp_path / "results.jsonl"

    experiment(Scripted(), WHOSE, "helpers", ["T6"], 2, out)

    first, second = read(out)
    assert (first.task, first.run, second.run) == ("T6", 0, 1)
    assert first.last is not None
    assert (first.last.success, first.last.valid, first.rounds, first.tokens) == (True, True, 1, 100)
    assert (first.ngram_tree, first.subtree_match, first.flow_match) == (pytest.approx(1.0), 1.0, 1.0)


def test_first_answer_and_repaired_one_are_told_apart(tmp_path: Path) -> None:
    out = tmp_path / "results.jsonl"

    experiment(Scripted(repairs=True), WHOSE, "helpers", ["T6"], 1, out)

    (run,) = read(out)
    assert run.first is not None
    assert run.last is not None
    assert (run.first.valid, run.first.passed, run.first.success) == (True, False, False)
    assert "no_circle" in run.first.faults
    assert (run.last.success, run.rounds, run.tokens, run.seconds_first, run.seconds) == (True, 2, 150, 1.0, 3.5)


def test_hidden_helpers_do_not_count_in_the_column_of_the_paper(tmp_path: Path, wording: Wording) -> None:
    out = tmp_path / "results.jsonl"

    experiment(Scripted(), WHOSE, "paper", ["T6"], 1, out)

    (run,) = read(out)
    assert run.last is not None
    assert run.last.faults == ("hidden_helper",)
    wording(run.last.said)


def test_an_interrupted_experiment_goes_on(tmp_path: Path, wording: Wording) -> None:
    out = tmp_path / "results.jsonl"
    experiment(Scripted(), WHOSE, "helpers", ["T6"], 1, out)
    with out.open("a") as file:
        file.write('{"provider": "cut o')
    author, said = Scripted(), []

    done = experiment(author, WHOSE, "helpers", ["T6"], 3, out, say=said.append)

    assert (done, author.asked) == (2, 2)
    assert [run.run for run in read(out)] == [0, 1, 2]
    wording(timeless("\n".join(said[:2])))
    packed = tmp_path / "results.jsonl.gz"
    packed.write_bytes(gzip.compress(out.read_bytes()))
    assert read(packed) == read(out)


def test_runs_without_an_answer_are_done_again(tmp_path: Path) -> None:
    out = tmp_path / "results.jsonl"
    experiment(Scripted(kind="down"), WHOSE, "helpers", ["T6"], 1, out)

    assert [run.kind for run in read(out)] == ["error"]
    assert experiment(Scripted(), WHOSE, "helpers", ["T6"], 1, out) == 1


def test_a_question_is_no_success(tmp_path: Path) -> None:
    out = tmp_path / "results.jsonl"

    experiment(Scripted(kind="question"), WHOSE, "helpers", ["T10+"], 1, out)

    (run,) = read(out)
    assert run.last is not None
    assert (run.last.success, run.last.faults, run.ngram_tree) == (False, ("said_question",), None)


def test_trees_of_a_results_file_are_judged_anew_and_the_rest_stays(tmp_path: Path) -> None:
    out, again = tmp_path / "results.jsonl", tmp_path / "again.jsonl"
    experiment(Scripted(), WHOSE, "helpers", ["T6"], 1, out)
    (run,) = read(out)
    wrong = Judged(valid=True, passed=True, success=False, faults=("not_level",), said="an oracle that was wrong")
    out.unlink()
    append(out, structs.replace(run, first=wrong, last=wrong))

    rejudge.main([str(out), "--out", str(again)])

    assert read(again) == [run]


@pytest.mark.parametrize(
    ("hits", "of", "text"),
    [
        (28, 30, "93.3 % (28/30; 78.7 to 98.2)"),
        (16, 30, "53.3 % (16/30; 36.1 to 69.8)"),
        (0, 30, "0.0 % (0/30; 0.0 to 11.4)"),
        (30, 30, "100.0 % (30/30; 88.6 to 100.0)"),
        (0, 0, "-"),
    ],
)
def test_shares_have_wilson_intervals(hits: int, of: int, text: str) -> None:
    assert share(hits, of) == text
    assert 0.0 <= wilson(hits, of)[0] <= wilson(hits, of)[1] <= 1.0


def test_the_report_has_the_papers_values_in_its_column_only(tmp_path: Path, wording: Wording) -> None:
    out = tmp_path / "results.jsonl"
    for column in ("paper", "helpers"):
        experiment(Scripted(repairs=True), WHOSE, column, ["T6"], 2, out)  # type: ignore[arg-type]
    runs = read(out)

    text = tables(runs)
    paper, helpers = text.split("column `helpers`")[1], text.split("column `helpers`")[0]
    paper, helpers = (helpers, paper) if "column `paper`" in helpers else (paper, helpers)

    assert text.count("## none (scripted), column ") == 2
    assert text.count("93.3 % (28/30; 78.7 to 98.2)") == 1
    wording(text)
    assert text.count("| 0.50, 0.50 |") == 2  # of what is left of the whole time when the model's is taken off
    assert [path.name for path in figures(runs[:2], tmp_path)] == ["figure-15-scripted-none-paper.svg"]
    last = [structs.replace(run, task=task) for run, task in zip(runs[:2], ("T10", "T10+"), strict=True)]
    assert len(figures(last[:1], tmp_path)) == 1  # Fig. 16 is a comparison of the two
    assert [path.name[:9] for path in figures(last, tmp_path)] == ["figure-15", "figure-16"]


class Told:
    """A model that keeps what it is told."""

    name, model = "told", "told"

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self.schema: object = None

    def complete(self, messages: list[Message], schema: object, **_options: object) -> None:
        self.messages, self.schema = messages, schema


SYSTEM = "Verbs:\nFlyAndLand - flies and lands\nGoTo - flies\ncircle(A, B) is a list. offset(A, north=5 m) is a place."


def test_the_column_of_the_paper_hides_helpers_in_prompt_and_schema(wording: Wording) -> None:
    told = Told()
    schema = {"anyOf": [{"$ref": "#/$defs/do_FlyAndLand"}, {"$ref": "#/$defs/do_GoTo"}],
              "$defs": {"do_FlyAndLand": {}, "do_GoTo": {}}}  # fmt: skip
    chat = PaperChat(told, "T10")  # type: ignore[arg-type]

    chat.complete([Message("system", SYSTEM), Message("user", "circle it")], schema, max_tokens=1)

    assert told.schema == {"anyOf": [{"$ref": "#/$defs/do_GoTo"}], "$defs": {"do_GoTo": {}}}
    assert hidden_in("".join(one.text for one in told.messages[:-1])) == ()
    wording(told.messages[0].text)
    assert told.messages[-1].text == "circle it"
    assert len(told.messages) == 2 + 2 * 5
    assert len(examples_for("T10+")) == 9


def test_a_leak_is_found() -> None:
    chat = PaperChat(Told(), "T6")  # type: ignore[arg-type]
    chat._examples = [("go", "circle(base, 3 m)")]

    with pytest.raises(LeakError, match="tells of circle"):
        chat.shown([Message("system", SYSTEM), Message("user", "x")])


def test_examples_do_not_have_the_words_of_requests() -> None:
    asked = {words for wordings in WORDS.values() for words in wordings}
    for request, _ in examples_for("T10+"):
        assert not any(request.casefold() in words.casefold() for words in asked)


def test_prompts_without_hidden_helpers_stay_as_they_are(wording: Wording) -> None:
    wording(without_hidden("Nothing of it.\n\nHere."))
