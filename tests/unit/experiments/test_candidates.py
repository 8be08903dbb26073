"""Success against the number of candidates: the vote is the product's, what does not pass has none, time adds up."""

from pathlib import Path

from experiments.e2_llm.candidates import Candidate, read, sample, table, taken
from experiments.e2_llm.fly import world_of
from experiments.e2_llm.requests import requests
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.records import Draft
from formiga_bt.llm.world import world_of as live_world
from tests.unit.llm.scripted import Scripted, fly_to, home, tree


def candidate(means: str, *, right: bool = False) -> Candidate:
    return Candidate(kind="task" if means else "failed", means=means, right=right, seconds=2.0)


A, B, BAD = candidate("a"), candidate("b", right=True), candidate("")


def test_the_first_that_passes_is_taken_until_another_meaning_has_more() -> None:
    assert taken([A]) == A
    assert taken([A, B]) == A
    assert taken([A, B, B]) == B
    assert taken([BAD, B]) == B
    assert taken([BAD, BAD]) is None


def test_requests_are_sampled_once_judged_by_their_oracle_and_told_by_n(tmp_path: Path) -> None:
    out = tmp_path / "c.jsonl"
    (request,) = requests("T6", world_of(), 1)
    center, radius = request.values.get("center", "base"), request.values["radius"]
    ring = {"do": "FlyAlong", "agent": "drone", "way": f"circle({center}, {radius})", "height": "30 m"}
    right = tree(ring, fly_to(center, "30 m"), home(), task="Ring")
    wrong = tree(fly_to(center, radius), home(), task="NoRing")
    asked = []

    def one(words: str, number: int) -> Draft:
        asked.append((words, number))
        return draft(words, live_world(), Scripted(wrong if number == 0 else right), options=Options(rounds=0))

    for _ in range(2):
        sample(one, ("m", "helpers"), ["T6"], 1, out, most=2)

    assert asked == [(request.words, 0), (request.words, 1)]
    (row,) = read(out)
    assert [one.right for one in row.candidates] == [False, True]
    lines = table([row], 2).splitlines()
    assert "| T6 to T10 | 1 | 0.0 % (0/1;" in lines[2]
    assert "| T6 to T10 | 2 | 100.0 % (1/1;" in lines[3]


def test_sampling_may_begin_at_a_later_run(tmp_path: Path) -> None:
    (fresh,) = requests("T6", world_of(), 1, 30)
    asked = []

    def one(words: str, _number: int) -> Draft:
        asked.append(words)
        return draft(words, live_world(), Scripted(tree(home())), options=Options(rounds=0))

    sample(one, ("m", "tuned"), ["T6"], 1, tmp_path / "c.jsonl", most=1, first=30)

    assert asked == [fresh.words]
    assert [row.run for row in read(tmp_path / "c.jsonl")] == [30]
