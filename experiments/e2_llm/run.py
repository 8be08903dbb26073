"""Runs the experiment with one model and one column, and appends each run to a results file.

    python -m experiments.e2_llm.run --provider local --model q15 --column paper --tasks T6,T7 --runs 30 --out results.jsonl

Runs that the file has are passed over, so an interrupted experiment goes on where it was.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, Final

from experiments.e2_llm.authors import Author, DraftAuthor, Written
from experiments.e2_llm.columns import COLUMNS, Column, has_hidden, hidden_in
from experiments.e2_llm.fly import World, checked, fly, world_of
from experiments.e2_llm.judging import judge
from experiments.e2_llm.measures import Measures, measure
from experiments.e2_llm.records import Judged, Run, Whose, append, read
from experiments.e2_llm.requests import RUNS, Request, last_run, requests
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.packaged import folder

TASKS: Final = ("T6", "T7", "T8", "T9", "T10", "T10+")
Say = Callable[[str], None]
MakeRun = Callable[[Request, Written, World, str, Whose], Run]


def judged(request: Request, yaml: str, values: Mapping[str, str], passed: bool, column: str, world: World) -> Judged:
    """Return a task as judged by the oracles of its request."""
    if not yaml:
        return Judged(valid=False, passed=False, success=False, faults=("no_task",), said="the answer holds no task")
    leaks = hidden_in(yaml) if has_hidden(column) else ()
    if leaks:
        text = f"it uses {', '.join(leaks)}, which there is not in this column"
        return Judged(valid=False, passed=passed, success=False, faults=("hidden_helper",), said=text)
    task, errors = checked(yaml, world)
    if task is None:
        return Judged(valid=False, passed=passed, success=False, faults=("check",), said="; ".join(errors[:3]))
    of = "T10" if request.task == "T10+" else request.task
    verdict = judge(of, request.goal, lambda scene: fly(yaml, values, world, scene), request.scenes)
    valid = "refused" not in verdict.codes
    return Judged(valid=valid, passed=passed, success=verdict.ok, faults=verdict.codes, said=str(verdict)[:600])


def measured(request: Request, yaml: str, world: World) -> Measures | None:
    """Return how near a task is to its reference; None: it is no task that can be read."""
    from formiga_bt.lang.json_form.writing import from_yaml

    if not yaml or checked(yaml, world)[0] is None:
        return None
    reference = (folder("trees") / f"{request.reference}.yaml").read_text(encoding="utf-8")
    return measure(from_yaml(yaml, world.catalogue), from_yaml(reference, world.catalogue))


def run_of(request: Request, written: Written, world: World, column: str, whose: Whose) -> Run:
    """Return the run of a request, judged."""
    first = written.attempts[0] if written.attempts else None
    made = written.kind == "task"
    near = measured(request, written.yaml or (first.yaml if first is not None else ""), world)
    nothing = Judged(valid=False, passed=False, success=False, faults=(f"said_{written.kind}",), said=written.say[:300])
    early = judged(request, first.yaml, first.values, first.passed, column, world) if first and first.yaml else nothing
    if not made and written.kind != "failed":
        late = nothing
    elif first is not None and written.yaml == first.yaml and written.values == first.values:
        late = early
    else:
        late = judged(request, written.yaml, written.values, made, column, world)
    return Run(
        provider=whose.provider,
        model=whose.model,
        trained_on=whose.trained_on,
        column=column,
        task=request.task,
        run=request.run,
        words=request.words,
        paper_words=request.paper_words,
        kind=written.kind,
        rounds=len(written.attempts),
        prompt_tokens=sum(one.prompt_tokens for one in written.attempts),
        tokens=sum(one.tokens for one in written.attempts),
        seconds_first=first.seconds if first is not None else 0.0,
        seconds=written.seconds,
        seconds_checks=written.seconds_checks,
        problems=first.problems if first is not None else (),
        first=early,
        last=late,
        ngram_tree=near.ngram_tree if near is not None else None,
        subtree_match=near.subtree_match if near is not None else None,
        flow_match=near.flow_match if near is not None else None,
        mends=len(first.mends) if first is not None else 0,
        yaml_first=first.yaml if first is not None else "",
        yaml=written.yaml,
        values=written.values,
        say=written.say,
    )


def experiment(
    author: Author,
    whose: Whose,
    column: Column,
    tasks: Sequence[str],
    runs: int,
    out: Path,
    *,
    first: int = 0,
    say: Say = lambda _text: None,
    make_run: MakeRun = run_of,
    clock: Callable[[], float] = monotonic,
) -> int:
    """Do the runs that a results file lacks; return how many were done. `make_run` judges what was written."""
    world = world_of()
    have = {one.key for one in read(out) if one.kind != "error"}
    due = [one for one in _wanted(tasks, runs, first, world) if _key(whose, column, one) not in have]
    say(f"{len(due)} runs to do, {len(have)} in {out}")
    for number, request in enumerate(due, start=1):
        began = clock()
        try:
            written = author.write(request.task, request.words)
            done = make_run(request, written, world, column, whose)
        except FormigaError as error:
            done = Run(
                provider=whose.provider,
                model=whose.model,
                trained_on=whose.trained_on,
                column=column,
                task=request.task,
                run=request.run,
                words=request.words,
                kind="error",
                say=str(error),
            )
        append(out, done)
        how = "error" if done.last is None else "right" if done.last.success else ", ".join(done.last.faults) or "wrong"
        say(f"{number}/{len(due)} {request.id} {done.kind} after {done.rounds} rounds, {clock() - began:.1f} s: {how}")
    return len(due)


def _wanted(tasks: Sequence[str], runs: int, first: int, world: World) -> Iterator[Request]:
    for task in tasks:
        yield from requests(task, world, runs, first)


def _beyond(tasks: Sequence[str], runs: int, first: int) -> str:
    """Return what is wrong with the runs asked for, or nothing."""
    over = [one for one in tasks if one != "second" and first + runs - 1 > last_run(one)]
    told = ", ".join(f"{one} has runs 0 to {last_run(one)}" for one in over)
    return f"--from {first} --runs {runs} asks for runs {first} to {first + runs - 1}: {told}" if over else ""


def _key(whose: Whose, column: str, request: Request) -> tuple[str, str, str, str, int]:
    return (whose.provider, whose.model, column, request.task, request.run)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run from the command line."""
    reader = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.run", description=(__doc__ or "").split("\n")[0]
    )
    reader.add_argument("--provider", default="", help="as of formiga draft: local, groq, openai, ...")
    reader.add_argument("--model", default="")
    reader.add_argument("--base-url", default="", help="an endpoint that speaks the protocol of OpenAI")
    reader.add_argument("--adapter", default="", help="a LoRA adapter for a local model (column tuned)")
    reader.add_argument(
        "--prompt", default="", help="the prompt that the model behind --base-url was tuned with: brief-1"
    )
    reader.add_argument("--trained-on", default="", help="what the training of the model saw (column tuned)")
    reader.add_argument("--name", default="", help="how results call the model; default: as the provider calls it")
    reader.add_argument("--column", choices=COLUMNS, required=True)
    reader.add_argument("--tasks", default=",".join(TASKS), help=f"some of {', '.join(TASKS)}, T1 to T5, or second")
    reader.add_argument("--runs", type=int, default=RUNS, help=f"so many runs of each task (default: {RUNS})")
    reader.add_argument(
        "--from",
        type=int,
        default=0,
        dest="first",
        metavar="N",
        help="the first run; T6 to T10: 30 to 49 are fresh wordings",
    )
    reader.add_argument(
        "--every-wording", action="store_true", help="of the second set; else one of each request by turns"
    )
    reader.add_argument("--every", type=int, default=1, help="of the second set: each so-many-th request")
    reader.add_argument(
        "--turn", type=int, default=0, help="of the second set: 1 and 2 take other wordings than 0 does (default: 0)"
    )
    reader.add_argument(
        "--run-generated-python",
        action="store_true",
        help="with the column paper-form: programs that a model wrote are run, in a locked child process",
    )
    reader.add_argument("--out", type=Path, required=True)
    given = reader.parse_args(arguments)
    tasks = given.tasks.split(",")
    unknown = [one for one in tasks if one not in (*TASKS, "T1", "T2", "T3", "T4", "T5", "second")]
    if unknown:
        reader.error(f"unknown task {', '.join(unknown)}")
    if given.runs < 1 or given.first < 0:
        reader.error("--runs is 1 or more, --from 0 or more")
    if beyond := _beyond(tasks, given.runs, given.first):
        reader.error(beyond)
    if given.every < 1 or given.turn < 0:
        reader.error("--every is 1 or more, --turn 0 or more")
    if given.out.suffix == ".gz":
        reader.error(f"runs are added to a plain file, not to {given.out}; the report reads both")
    if given.column == "tuned" and not given.trained_on:
        reader.error("the column tuned says what training saw: --trained-on TEXT")
    is_python = given.column == "paper-form"
    if is_python and not given.run_generated_python:
        reader.error("the column paper-form runs programs that a model wrote: say so with --run-generated-python")
    if is_python and "second" in tasks:
        reader.error("the second set has no programs in the paper's form; --tasks T1 to T10+")
    if given.column not in ("paper", "paper-form") and "T10+" in tasks:
        tasks = [one for one in tasks if one != "T10+"]  # the others' examples do not change
    if is_python:
        from experiments.e2_llm.paper_form.child import NoSandboxError, check_sandbox

        try:
            check_sandbox()
        except NoSandboxError as error:
            reader.error(str(error))
    from formiga_bt.llm.client import open_chat

    chat: Any = open_chat(given.provider, given.model, base_url=given.base_url, adapter=given.adapter)
    if given.prompt:
        chat.prompt = given.prompt
    whose = Whose(provider=chat.name, model=given.name or chat.model, trained_on=given.trained_on)
    tell: Say = lambda text: print(text, file=sys.stderr, flush=True)  # noqa: E731, T201
    try:
        if is_python:
            from experiments.e2_llm.paper_form.author import PaperFormAuthor
            from experiments.e2_llm.paper_form.runs import run_of_program

            python = PaperFormAuthor(chat, world_of())
            experiment(
                python,
                whose,
                given.column,
                tasks,
                given.runs,
                given.out,
                first=given.first,
                say=tell,
                make_run=run_of_program,
            )
            return 0
        author = DraftAuthor(chat, given.column)
        if "second" in tasks:
            from experiments.e2_llm.second_run import second

            second(
                author,
                whose,
                given.column,
                given.out,
                every_wording=given.every_wording,
                every=given.every,
                turn=given.turn,
                say=tell,
            )
            tasks = [one for one in tasks if one != "second"]
        experiment(author, whose, given.column, tasks, given.runs, given.out, first=given.first, say=tell)
    finally:
        chat.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
