"""Judges the trees of a results file anew, after an oracle was mended; no model is asked.

    python -m experiments.e2_llm.rejudge results.jsonl.gz --out results-again.jsonl

What the models answered, how long it took and what the product said of it stays as it was.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec
from msgspec import structs

from experiments.e2_llm.fly import World, world_of
from experiments.e2_llm.records import Judged, Run, append, read
from experiments.e2_llm.requests import Request, last_run, requests
from experiments.e2_llm.run import judged
from experiments.e2_llm.second_run import again as second_again
from experiments.e2_llm.second_set import second_set


def again(run: Run, request: Request, world: World) -> Run:
    """Return a run whose trees are judged by the oracles as they are now.

    Args:
        run: of T1 to T10+, in words of the language (not of the column `paper-form`).
        request: what it was for.
        world: where it is flown.
    """
    is_one = run.yaml == run.yaml_first
    last = _judged(run.last, request, run.yaml, run, world)
    first = last if is_one and run.last is not None and run.first == run.last else None
    return structs.replace(run, first=first or _judged(run.first, request, run.yaml_first, run, world), last=last)


def _judged(before: Judged | None, request: Request, yaml: str, run: Run, world: World) -> Judged | None:
    """Judge a tree as before; what held none, or was not flown, stays."""
    if before is None or not yaml or set(before.faults) & {"check", "hidden_helper", "no_task"}:
        return before
    values = run.values if yaml == run.yaml else {}
    return judged(request, yaml, values, before.passed, run.column, world)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run from the command line."""
    reader = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.rejudge", description=(__doc__ or "").split("\n")[0]
    )
    reader.add_argument("results", type=Path)
    reader.add_argument("--out", type=Path, required=True, help="a new plain file")
    given = reader.parse_args(arguments)
    if given.out.exists() or given.out.suffix == ".gz":
        reader.error(f"{given.out} is there already" if given.out.exists() else "--out is a plain file")
    world, changed = world_of(), 0
    known: dict[tuple[str, int], Request] = {}
    of_second = {f"second/{one.id}": one for one in second_set()}
    for run in read(given.results):
        new = run
        if run.task.startswith("second/"):
            new = second_again(run, of_second[run.task], world)
        elif run.column != "paper-form":
            if (run.task, run.run) not in known:
                every = requests(run.task, world, last_run(run.task) + 1)
                known |= {(run.task, one.run): one for one in every}
            new = again(run, known[run.task, run.run], world)
        if msgspec.json.encode(new) != msgspec.json.encode(run):
            changed += 1
            sys.stderr.write(f"{run.task}/{run.run:02d}: {_of(run)} -> {_of(new)}\n")
        append(given.out, new)
    sys.stderr.write(f"{changed} changed\n")
    return 0


def _of(run: Run) -> str:
    return "-" if run.last is None else ", ".join(run.last.faults) or "right"


if __name__ == "__main__":
    sys.exit(main())
