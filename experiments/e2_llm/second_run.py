"""Runs the second set: one wording of each request by turns, or all of them."""

from collections.abc import Callable, Iterator
from pathlib import Path

from msgspec import structs

from experiments.e2_llm.authors import Attempt, Author, Written
from experiments.e2_llm.columns import Column
from experiments.e2_llm.fly import World, checked, world_of
from experiments.e2_llm.records import Judged, Run, Whose, append, read
from experiments.e2_llm.second_set import Second, judge_tree, second_set
from formiga_bt.base.errors import FormigaError


def second(
    author: Author,
    whose: Whose,
    column: Column,
    out: Path,
    *,
    every_wording: bool = False,
    every: int = 1,
    turn: int = 0,
    most: int | None = None,
    say: Callable[[str], None] = lambda _text: None,
) -> int:
    """Do the runs of the second set that a results file lacks; return how many were done.

    Args:
        author: writes the tasks.
        whose: the model.
        column: what it is shown.
        out: the results file.
        every_wording: all wordings of a request; else one, English and Spanish by turns.
        every: each so-many-th request only.
        turn: so many wordings further on than where the turns begin; 1 and 2 are wordings that turn 0 does not have.
        most: at most so many runs.
        say: is told what was done.
    """
    world = world_of()
    have = {one.key for one in read(out) if one.kind != "error"}
    due = [
        (one, run)
        for one, run in _wanted(every_wording, every, turn)
        if (whose.provider, whose.model, column, _task(one), run) not in have
    ][:most]
    say(f"second set: {len(due)} runs to do")
    for number, (request, run) in enumerate(due, start=1):
        made = second_run(author, request, run, whose, column, world)
        append(out, made)
        how = "error" if made.last is None else "right" if made.last.success else ", ".join(made.last.faults)
        say(f"{number}/{len(due)} {request.id} ({run}) {made.kind} after {made.rounds} rounds: {how}")
    return len(due)


def _wanted(every_wording: bool, every: int, turn: int) -> Iterator[tuple[Second, int]]:
    for number, one in list(enumerate(second_set()))[::every]:
        count = len(one.wordings)
        runs = range(count) if every_wording else ((number + turn) % count,)
        for run in runs:
            yield one, run


def _task(request: Second) -> str:
    return f"second/{request.id}"


def second_run(author: Author, request: Second, run: int, whose: Whose, column: str, world: World) -> Run:
    """Return the run of a request in one of its wordings."""
    words = request.wordings[run]
    kind, say, first, last, written = "error", "", None, None, None
    try:
        written = author.write("", words)
        kind, say = written.kind, written.say
        last = _judged(request, written.kind, written, world)
        early = written.attempts[0] if written.attempts else None
        first = last if early is None or len(written.attempts) == 1 else _judged_first(request, early, world)
    except FormigaError as error:
        say = str(error)
    return Run(
        provider=whose.provider,
        model=whose.model,
        trained_on=whose.trained_on,
        column=column,
        task=_task(request),
        run=run,
        words=words,
        kind=kind,
        rounds=len(written.attempts) if written else 0,
        prompt_tokens=sum(one.prompt_tokens for one in written.attempts) if written else 0,
        tokens=sum(one.tokens for one in written.attempts) if written else 0,
        seconds_first=written.attempts[0].seconds if written and written.attempts else 0.0,
        seconds=written.seconds if written else 0.0,
        seconds_checks=written.seconds_checks if written else None,
        problems=written.attempts[0].problems if written and written.attempts else (),
        first=first,
        last=last,
        yaml_first=written.attempts[0].yaml if written and written.attempts else "",
        yaml=written.yaml if written else "",
        values=written.values if written else {},
        say=say,
    )


def again(run: Run, request: Second, world: World) -> Run:
    """Return a run whose trees are judged by the oracles as they are now."""
    is_one = run.yaml == run.yaml_first and run.last is not None and run.first == run.last
    last = _tree_again(run.last, request, run.yaml, run.values, world) if run.kind in ("task", "failed") else run.last
    first = last if is_one else _tree_again(run.first, request, run.yaml_first, {}, world)
    return structs.replace(run, first=first, last=last)


def _tree_again(
    before: Judged | None, request: Second, text: str, values: dict[str, str], world: World
) -> Judged | None:
    return before if before is None or not text else _tree(request, text, values, before.passed, world)


def _judged(request: Second, kind: str, written: Written, world: World) -> Judged:
    """Judge what a request ended with: a tree by its flights; a question or a refusal by whether that was right."""
    if kind in ("task", "failed") and written.yaml:
        return _tree(request, written.yaml, written.values, kind == "task", world)
    right = kind in request.answer
    faults = () if right else (f"said_{kind}",)
    return Judged(valid=right, passed=kind == "task", success=right, faults=faults, said=written.say[:300])


def _judged_first(request: Second, early: Attempt, world: World) -> Judged:
    if not early.yaml:
        return Judged(valid=False, passed=False, success=False, faults=("no_task",))
    return _tree(request, early.yaml, early.values, early.passed, world)


def _tree(request: Second, text: str, values: dict[str, str], passed: bool, world: World) -> Judged:
    task, errors = checked(text, world)
    if task is None:
        return Judged(valid=False, passed=passed, success=False, faults=("check",), said="; ".join(errors[:3]))
    if "task" not in request.answer:
        refusal = not passed  # the loop offered nothing: nobody flies, but nobody was told why either
        fault = "not_refused" if passed else "failed_instead"
        return Judged(valid=True, passed=passed, success=False, faults=(fault,), said="" if refusal else "it would fly")
    verdict = judge_tree(request, text, values, world)
    return Judged(
        valid="refused" not in verdict.codes,
        passed=passed,
        success=verdict.ok,
        faults=verdict.codes,
        said=str(verdict)[:600],
    )
