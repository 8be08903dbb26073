"""Checks, draws and flies a task of an assistant: what runs in a process of its own, because it may take long.

Nothing here waits for wall time or leaves the process: a dry run is the production engine with simulated agents, in virtual
time.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND
from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.base.errors import FormigaError, TaskError, UnusableFile
from formiga_bt.lang.loader import Loaded
from formiga_bt.llm.mcp.ground import TEXT_NAME, ServedSite
from formiga_bt.llm.mcp.records import MAX_VALUE, Asked, CheckOut, Did, FlightOut, ProblemOut, TreeOut

if TYPE_CHECKING:
    from formiga_bt.engine.kernel.inputs import EngineStep
    from formiga_bt.lang.model import Task
    from formiga_bt.rehearsal.rehearsal import Rehearsal
    from formiga_bt.show.history.runlog import RunLog

MOST_PROBLEMS: Final = 100
MOST_LINES: Final = 200
SLICE_S: Final = 60.0
"""So much virtual time between two words of progress."""
WIDTH: Final = 120
"""Columns of a tree."""

Progress = Callable[[float, str], None]


class JudgeJob(Struct, frozen=True, kw_only=True):
    """Something to do with a task, given as a text or by its name."""

    kind: str
    """check, tree or fly."""
    yaml: str = ""
    task: str = ""
    params: dict[str, Any] = {}
    answers: dict[str, list[str]] = {}
    hours: float = 6.0


class JobResult(Struct, frozen=True, kw_only=True):
    """What came of it; one of the three, or the words of an error."""

    check: CheckOut | None = None
    tree: TreeOut | None = None
    flight: FlightOut | None = None
    error: str = ""


def done(job: JudgeJob, ground: ServedSite, progress: Progress) -> JobResult:
    """Do a job; what is wrong with the task is told as an error."""
    try:
        loaded = ground.load(job.yaml) if job.yaml else ground.load_named(job.task)
        if job.kind == "check":
            return JobResult(check=checked(loaded))
        task = _usable(loaded)
        if job.kind == "tree":
            return JobResult(tree=TreeOut(task.name, "", tree_of(task)))
        progress(0.0, f"{task.name} is checked; it begins to fly")
        return JobResult(flight=flown(task, loaded, ground, job, progress))
    except FormigaError as error:
        return JobResult(error=str(error))
    except (OSError, UnicodeDecodeError) as error:
        return JobResult(error=f"the task cannot be read: {getattr(error, 'strerror', None) or error}")


def checked(loaded: Loaded) -> CheckOut:
    """Return what the checker found."""
    found = loaded.diagnostics[:MOST_PROBLEMS]
    errors = sum(d.severity == "error" for d in loaded.diagnostics)
    warnings = len(loaded.diagnostics) - errors
    closing = f"{'refused' if loaded.task is None else 'ok'}: {_count(errors, 'error')}, {_count(warnings, 'warning')}"
    left = len(loaded.diagnostics) - len(found)
    texts = [*(render(d, loaded.sources) for d in found), *([f"and {left} more"] if left else []), closing]
    return CheckOut(
        ok=loaded.task is not None,
        task=loaded.task.name if loaded.task is not None else "",
        errors=errors,
        warnings=warnings,
        problems=[_problem(d, loaded.sources) for d in found],
        rendered="\n\n".join(texts),
    )


def _problem(found: Diagnostic, sources: Mapping[str, str]) -> ProblemOut:
    mark = found.mark
    lines = sources.get(mark.file, "").splitlines()
    return ProblemOut(
        code=found.code,
        severity=found.severity,
        line=mark.line,
        column=mark.col,
        message=found.message,
        help=found.help,
        within=found.within,
        source=lines[mark.line - 1][:300] if 1 <= mark.line <= len(lines) else "",
        file="" if mark.file == TEXT_NAME else mark.file,
    )


def _usable(loaded: Loaded) -> "Task":
    if loaded.task is not None:
        return loaded.task
    errors = [d for d in loaded.diagnostics if d.severity == "error"][:10]
    texts = "\n\n".join(render(d, loaded.sources) for d in errors)
    raise UnusableFile(f"{texts}\n\nthe task has errors; mend them first (check_task tells all)")


def tree_of(
    task: "Task", steps: "Iterable[EngineStep]" = (), task_id: str = "", ground: ServedSite | None = None
) -> str:
    """Return the tree of a task as text; after a run with how each step ended."""
    from formiga_bt.show.tree import terminal
    from formiga_bt.show.tree.drawing import drawing_of

    facts = None
    if task_id and ground is not None:
        from formiga_bt.show.history.folded import FoldedSource
        from formiga_bt.show.history.ledger import ALL, Ledger

        ledger = Ledger(ALL)
        for step in steps:
            ledger.feed(step)
        picture = FoldedSource(ledger, ground.site, {task.name: task}).task(task_id)
        facts = {fact.path: fact for fact in picture.steps}
    return "\n".join(line.plain() for line in terminal.draw(drawing_of(task), facts, width=WIDTH))


def texts_of(params: Mapping[str, Any]) -> dict[str, str]:
    """Return parameters as the language reads them.

    Raises:
        UnusableFile: a value is too long, or would be read as a file where a person runs the task.
    """
    found = {}
    for name, value in params.items():
        text = value if isinstance(value, str) else json.dumps(value)
        if len(text) > MAX_VALUE:
            raise UnusableFile(f"parameter '{name}' has {len(text):,} characters; at most {MAX_VALUE:,} are read")
        if text.startswith("@"):
            raise UnusableFile(f"parameter '{name}' begins with '@', which means a file", help="give the value itself")
        found[name] = text
    return found


def flown(task: "Task", loaded: Loaded, ground: ServedSite, job: JudgeJob, progress: Progress) -> FlightOut:
    """Fly a task on the site's simulated fleet.

    Raises:
        FormigaError: a parameter or an answer is wrong; the texts say how to mend it.
    """
    from formiga_bt.lang.request.binding import bind_params
    from formiga_bt.lang.request.requested import with_requested
    from formiga_bt.lang.scenario.entries import START
    from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of, patience, simulated

    values, problems, sources = bind_params(task, texts_of(job.params), ground.site, START)
    if problems:
        raise FormigaError("\n\n".join([*(render(p, sources) for p in problems), f"{task.name} was not started"]))
    scripts = {who: [{"match": "*", "options": said}] for who, said in _answers(job.answers, ground).items()}
    specs = fleet_of(ground.site, ground.catalogue, scripts=scripts)
    tasks = with_requested(task, lambda path: _usable(ground.load_file(path)), ground.site)
    rehearsal = Rehearsal(simulated(ground.site), ground.catalogue, tasks, specs)
    try:
        rehearsal.run_for(1.0)
        try:
            task_id = rehearsal.submit(task.name, values, wait=patience(task))
        except TaskError as refused:
            return FlightOut(ok=False, task=task.name, status="REFUSED", reason=str(refused))
        _fly(rehearsal, task_id, job.hours * 3600.0, progress)
        return _told(rehearsal, task, task_id, loaded, ground)
    finally:
        rehearsal.close()


def _fly(rehearsal: "Rehearsal", task_id: str, limit_s: float, progress: Progress) -> None:
    begin = rehearsal.now
    end = begin + round(limit_s * SECOND)
    while not rehearsal.ended(task_id) and rehearsal.now < end:
        before = rehearsal.now
        rehearsal.run_until_ended(task_id, limit_s=min(SLICE_S, (end - before) / SECOND))
        if rehearsal.now == before:
            rehearsal.run_for(SLICE_S)
        passed = (rehearsal.now - begin) / SECOND
        progress(passed, f"{passed / 60:.0f} min of virtual time")


def _answers(said: Mapping[str, list[str]], ground: ServedSite) -> Mapping[str, list[str]]:
    types = ground.catalogue.types
    people = [a.id for a in ground.site.agents.values() if a.type in types and types[a.type].human]
    for who, words in said.items():
        if who not in people:
            raise UnusableFile(f"answers: the site has no person '{who}'; people: {', '.join(people) or 'none'}")
        if not words or not all(words):
            raise UnusableFile(f"answers: '{who}' lacks an answer; leave the name out, or give at least one")
    return said


def _told(rehearsal: "Rehearsal", task: "Task", task_id: str, loaded: Loaded, ground: ServedSite) -> FlightOut:
    from formiga_bt.show.history.runlog import RunLog

    log = RunLog()
    for step in rehearsal.steps:
        log.feed(step)
    record, verdict = log.state.tasks[task_id], rehearsal.referee.verdict(rehearsal.now)
    zero, ended = record.times.submitted_at, record.times.ended_at
    status = record.status if ended is not None else "UNFINISHED"
    actions = [
        Did(
            row.agent,
            row.action,
            round((row.start - zero) / SECOND, 1),
            None if row.end is None else round((row.end - zero) / SECOND, 1),
            row.outcome,
            row.detail,
        )
        for row in log.actions
    ]
    lines = [f"{(line.at - zero) / SECOND:.0f} s  {line.text}" for line in log.lines]
    near = verdict.closest_pass
    broken = (verdict.crashes, verdict.unsafe_starts, verdict.low_flights)
    return FlightOut(
        ok=status == "SUCCEEDED" and not any(broken),
        task=task.name,
        status=status,
        code=record.outcome.code,
        reason=record.outcome.reason if ended is not None else "it did not end in the time given (`hours`)",
        duration_s=round(((ended or rehearsal.now) - zero) / SECOND, 1),
        agents=_roles(rehearsal, task_id),
        actions=actions[:MOST_LINES],
        questions=_questions(rehearsal),
        log=lines[:MOST_LINES],
        least_battery_percent={
            a: round(left, 1) for a, left in log.least_battery.items() if _took_part(log, a, task_id)
        },
        crashes=len(verdict.crashes),
        unsafe_starts=len(verdict.unsafe_starts),
        low_flights=len(verdict.low_flights),
        closest_pass_m=round(near.distance_m, 1) if near is not None else None,
        why="" if status == "SUCCEEDED" else _why(rehearsal, log, task, task_id),
        tree=tree_of(task, rehearsal.steps, task_id, ground),
        warnings=[f"{d.code} line {d.mark.line}: {d.message}" for d in loaded.diagnostics if d.severity == "warning"],
        left_out=max(0, len(actions) - MOST_LINES) + max(0, len(lines) - MOST_LINES),
    )


def _took_part(log: "RunLog", agent: str, task_id: str) -> bool:
    return any(row.agent == agent for row in log.rows_of([task_id]))


def _roles(rehearsal: "Rehearsal", task_id: str) -> dict[str, list[str]]:
    """Return who was chosen for each role, in order."""
    chosen: dict[str, list[str]] = {}
    for verdict in rehearsal.engine.state.explanations.get(task_id, ()):
        if verdict.code == "chosen" and verdict.agent not in chosen.setdefault(verdict.role, []):
            chosen[verdict.role].append(verdict.agent)
    return chosen


def _questions(rehearsal: "Rehearsal") -> list[Asked]:
    from formiga_bt.engine.kernel.inputs import SendGoal

    found = []
    for effect in (effect for step in rehearsal.steps for effect in step.effects):
        if isinstance(effect, SendGoal) and effect.fields.get("options"):
            text, options = str(effect.fields.get("question", "")), [str(one) for one in effect.fields["options"]]
            found.append(Asked(effect.agent, text, options))
    return found[:50]


def _why(rehearsal: "Rehearsal", log: "RunLog", task: "Task", task_id: str) -> str:
    from formiga_bt.show.why.front import explain
    from formiga_bt.show.why.text import in_words

    actions = [row.fact() for row in log.rows_of([task_id])]
    now, catalogue = rehearsal.now, rehearsal.engine.core.catalogue
    told = explain(log.state, {task.name: task}, task_id, now, catalogue=catalogue, wall=now, actions=actions)
    return in_words(*told)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
