"""Success against the number of candidates and time: sample N trees, leave out what does not pass, take what most of them mean.

    python -m experiments.e2_llm.candidates --provider local --column tuned --tasks T6,T7,second --runs 6 --out c.jsonl
    python -m experiments.e2_llm.candidates --report c.jsonl

Each request gets the same answers for every N: the first of them at temperature 0, the others drawn. What N of them would have
given is reckoned afterwards with the product's own vote (`formiga_bt.llm.judging.agreeing`). No repairs.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from experiments.e2_llm.columns import COLUMNS, NEAR_EXAMPLES
from experiments.e2_llm.fly import World, world_of
from experiments.e2_llm.report import share
from experiments.e2_llm.requests import requests
from experiments.e2_llm.run import judged
from experiments.e2_llm.second_set import judge_tree, second_set
from formiga_bt.llm.judging.agreeing import elected, what_happened
from formiga_bt.llm.records import Draft

MOST: Final = 5
DRAWN: Final = 0.7
"""Temperature of all candidates but the first."""


class Candidate(Struct, frozen=True, kw_only=True):
    """One answer to a request."""

    kind: str
    means: str
    """Equal for answers that mean the same; "" = it does not pass, and has no vote."""
    right: bool
    seconds: float


class Sampled(Struct, frozen=True, kw_only=True):
    """A request with its answers, in the order in which they came."""

    model: str
    column: str
    task: str
    run: int
    candidates: tuple[Candidate, ...]


def taken(candidates: Sequence[Candidate]) -> Candidate | None:
    """Return the candidate that the product takes of these, or None if none passes."""
    good = [one for one in candidates if one.means]
    return good[elected([one.means for one in good])] if good else None


def means(made: Draft) -> str:
    """Return what a draft means, as a short text; "" = it did not pass."""
    if made.kind == "failed":
        return ""
    if made.kind != "task" or made.flight is None:
        return made.kind
    return sha256(repr(what_happened(made.flight)).encode()).hexdigest()[:16]


def table(rows: Sequence[Sampled], most: int = MOST) -> str:
    """Return success and time against N, as Markdown: paper's tasks and second set apart."""
    lines = [
        "| | N | right and offered | wrong but offered | none passes | seconds a request (median) |",
        "|---|---|---|---|---|---|",
    ]
    for title, chosen in _groups(rows):
        for n in range(1, most + 1):
            found = [taken(one.candidates[:n]) for one in chosen]
            right = sum(one is not None and one.right for one in found)
            wrong = sum(one is not None and not one.right for one in found)
            seconds = sorted(sum(c.seconds for c in one.candidates[:n]) for one in chosen)
            cells = (share(right, len(chosen)), share(wrong, len(chosen)), str(len(chosen) - right - wrong))
            lines.append(f"| {title} | {n} | " + " | ".join(cells) + f" | {seconds[len(seconds) // 2]:.1f} |")
    return "\n".join(lines) + "\n"


def _groups(rows: Sequence[Sampled]) -> list[tuple[str, list[Sampled]]]:
    of_paper = [one for one in rows if not one.task.startswith("second/")]
    second = [one for one in rows if one.task.startswith("second/")]
    return [(title, some) for title, some in (("T6 to T10", of_paper), ("second set", second)) if some]


def sample(
    draft: Callable[[str, int], Draft],
    whose: tuple[str, str],
    tasks: Sequence[str],
    runs: int,
    out: Path,
    *,
    most: int = MOST,
    every: int = 1,
    first: int = 0,
    say: Callable[[str], None] = lambda _text: None,
) -> None:
    """Sample what a file lacks.

    Args:
        draft: (request, number of the candidate) -> one draft without repairs.
        whose: model and column.
        tasks: of T6 to T10, or `second`.
        runs: requests of each task.
        out: a file of lines.
        most: candidates.
        every: of the second set, each so-many-th request.
        first: of T6 to T10, the first run.
        say: is told what was done.
    """
    world = world_of()
    have = {(one.model, one.column, one.task, one.run) for one in read(out)}
    for task, run, words, judge in _due(tasks, runs, world, every, first):
        if (*whose, task, run) in have:
            continue
        found = []
        for number in range(most):
            made = draft(words, number)
            found.append(Candidate(kind=made.kind, means=means(made), right=judge(made), seconds=made.seconds))
        with out.open("ab") as file:
            row = Sampled(model=whose[0], column=whose[1], task=task, run=run, candidates=tuple(found))
            file.write(msgspec.json.encode(row) + b"\n")
        say(f"{task}/{run}: " + " ".join("right" if one.right else one.kind if one.means else "-" for one in found))


def _due(
    tasks: Sequence[str], runs: int, world: World, every: int, first: int
) -> list[tuple[str, int, str, Callable[[Draft], bool]]]:
    found: list[tuple[str, int, str, Callable[[Draft], bool]]] = []
    for task in tasks:
        if task == "second":
            for number, one in list(enumerate(second_set()))[::every]:
                run = number % len(one.wordings)
                found.append(
                    (f"second/{one.id}", run, one.wordings[run], lambda made, one=one: _right_second(made, one, world))
                )
        else:
            for request in requests(task, world, runs, first):
                found.append(
                    (task, request.run, request.words, lambda made, request=request: _right(made, request, world))
                )
    return found


def _right(made: Draft, request: Any, world: World) -> bool:
    if made.kind != "task":
        return False
    values = {one.name: one.text for one in made.values}
    return judged(request, made.yaml, values, True, "helpers", world).success


def _right_second(made: Draft, request: Any, world: World) -> bool:
    if made.kind != "task":
        return made.kind in request.answer
    if "task" not in request.answer:
        return False
    return bool(judge_tree(request, made.yaml, {one.name: one.text for one in made.values}, world).ok)


def read(path: Path) -> list[Sampled]:
    """Return the rows of a file; a line that was cut off is passed over."""
    found = []
    for line in path.read_bytes().split(b"\n") if path.is_file() else ():
        try:
            found.append(msgspec.json.decode(line, type=Sampled))
        except msgspec.DecodeError:
            continue
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Sample, or report."""
    reader = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.candidates", description=(__doc__ or "").split("\n")[0]
    )
    reader.add_argument("--report", type=Path)
    reader.add_argument("--provider", default="")
    reader.add_argument("--model", default="")
    reader.add_argument("--base-url", default="")
    reader.add_argument("--adapter", default="")
    reader.add_argument("--prompt", default="", help="the prompt that the model behind --base-url was tuned with")
    reader.add_argument(
        "--column", choices=[one for one in COLUMNS if one in ("helpers", "tuned", "shipped")], default="helpers"
    )
    reader.add_argument("--tasks", default="T6,T7,T8,T9,T10")
    reader.add_argument("--runs", type=int, default=6)
    reader.add_argument("--from", dest="first", metavar="N", type=int, default=0, help="the first run of T6 to T10")
    reader.add_argument("--most", type=int, default=MOST)
    reader.add_argument("--every", type=int, default=1, help="of the second set: each so-many-th request")
    reader.add_argument("--out", type=Path)
    given = reader.parse_args(arguments)
    if given.report is not None:
        sys.stdout.write(table(read(given.report), given.most))
        return 0
    if given.out is None:
        reader.error("--out FILE, or --report FILE")
    from formiga_bt.llm.client import open_chat
    from formiga_bt.llm.draft import Options, draft
    from formiga_bt.llm.world import world_of as live_world

    chat: Any = open_chat(given.provider, given.model, base_url=given.base_url, adapter=given.adapter)
    if given.prompt:
        chat.prompt = given.prompt
    world, without = live_world(), () if given.column == "shipped" else NEAR_EXAMPLES

    def one(words: str, number: int) -> Draft:
        options = Options(rounds=0, without=without, temperature=DRAWN if number else 0.0, seed=number + 1)
        return draft(words, world, chat, options=options)

    try:
        tell: Callable[[str], None] = lambda text: print(text, file=sys.stderr, flush=True)  # noqa: E731, T201
        sample(
            one,
            (chat.model, given.column),
            given.tasks.split(","),
            given.runs,
            given.out,
            most=given.most,
            every=given.every,
            first=given.first,
            say=tell,
        )
    finally:
        chat.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
