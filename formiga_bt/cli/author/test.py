"""`formiga test`: play the cases of test files on the virtual clock, and tell what differs from what they expect."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.base.diagnostics import Diagnostic, in_order
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.author.dryrun import MostSeconds, MostSteps
from formiga_bt.cli.inputs import UnusableFile, added_catalogues, readable, rendered
from formiga_bt.rehearsal.spending import MOST_S, MOST_WAKES, RunSpending

if TYPE_CHECKING:
    from formiga_bt.rehearsal.cases.cases import CaseFile
    from formiga_bt.rehearsal.cases.coverage import Coverage
    from formiga_bt.rehearsal.cases.judging import Differs

SUFFIX = ".test.yaml"


def command(
    files: Annotated[list[Path], typer.Argument(help="Test files (*.test.yaml), or folders of them.", metavar="FILE")],
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Report which steps and branches no case reached.")
    ] = False,
    only: Annotated[str, typer.Option("-k", help="Only cases with this in their name.", metavar="NAME")] = "",
    actions: ActionsOption = None,
    most_steps: MostSteps = MOST_WAKES,
    most_seconds: MostSeconds = MOST_S,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
) -> None:
    """Play the cases of test files on the virtual clock.

    Exit code 0: all passed. 1: a case failed, or a file has errors. 2: the command line cannot be used.
    """
    from formiga_bt.rehearsal.cases.reading import load_cases

    problems, sources = list[Diagnostic](), dict[str, str]()
    added = added_catalogues(actions or ())
    read = []
    for path in test_files(files):
        loaded = load_cases(path, actions=added)
        problems += loaded.diagnostics
        sources.update(loaded.sources)
        read += [loaded.cases] if loaded.cases is not None else []
    refused = any(problem.severity == "error" for problem in problems)
    if not as_json:
        for text in rendered(in_order(problems), sources):
            typer.echo(text + "\n")
    reports = (
        []
        if refused
        else [_play(one, only, (most_steps, most_seconds), quiet=as_json, with_coverage=coverage) for one in read]
    )
    counts = [case["ok"] for report in reports for case in report["cases"]]
    if not refused and not counts:
        raise UnusableFile(f"no case has '{only}' in its name")
    ok = not refused and all(counts)
    if as_json:
        found = [str(problem) for problem in in_order(problems)]
        typer.echo(json.dumps({"ok": ok, "problems": found, "files": reports}, indent=2))
    elif refused:
        typer.echo("refused: nothing was played")
    else:
        typer.echo(_closing(counts))
    if not ok:
        raise typer.Exit(1)


def test_files(paths: list[Path]) -> list[Path]:
    """Return the files, with each folder replaced by the test files below it.

    Raises:
        UnusableFile: a path cannot be read, or a folder holds no test file.
    """
    found: list[Path] = []
    for path in paths:
        below = sorted(path.rglob(f"*{SUFFIX}")) if path.is_dir() else [readable(path)]
        if not below:
            raise UnusableFile(f"no test file (*{SUFFIX}) below {path}")
        found += below
    return list(dict.fromkeys(found))


def _play(cases: "CaseFile", only: str, most: tuple[int, float], *, quiet: bool, with_coverage: bool) -> dict[str, Any]:
    from formiga_bt.rehearsal.cases.coverage import Coverage
    from formiga_bt.rehearsal.cases.judging import judge
    from formiga_bt.rehearsal.cases.running import play

    coverage = Coverage(cases.task) if with_coverage else None
    report: dict[str, Any] = {"file": cases.file, "task": cases.task.name, "cases": []}
    for case in cases.cases:
        if only.lower() not in case.name.lower():
            continue
        came = play(cases, case, coverage, RunSpending(*most))
        differs = judge(case, came)
        if not quiet:
            typer.echo("\n".join(_lines(cases, case.name, case.mark.line, came.duration_s, differs)))
        report["cases"].append(
            {
                "name": case.name,
                "line": case.mark.line,
                "ok": not differs,
                "duration_s": round(came.duration_s, 1),
                "differs": [
                    {"what": d.what, "expected": d.expected, "came": d.came, "lines": d.lines} for d in differs
                ],
            }
        )
    if coverage is not None:
        report["coverage"] = _coverage(coverage)
        if not quiet:
            typer.echo("\n".join(_told(cases.task.name, report["coverage"])))
    return report


def _lines(cases: "CaseFile", name: str, line: int, duration_s: float, differs: "list[Differs]") -> list[str]:
    if not differs:
        return [f"ok    {cases.task.name}: {name} ({duration_s:.0f} s)"]
    found = [f"FAIL  {cases.task.name}: {name} ({cases.file}:{line})"]
    for one in differs:
        found += [f"        {one}", *(f"        {text}" for text in one.lines)]
    return found


def _coverage(coverage: "Coverage") -> dict[str, Any]:
    return {
        "steps": len(coverage.steps),
        "reached": len(coverage.reached),
        "percent": round(coverage.percent, 1),
        "branches": len(coverage.branches),
        "taken": len(coverage.taken & coverage.branches.keys()),
        "missed": [f"{step.mark.file}:{step.mark.line} {step.title}" for step in coverage.missed],
        "untaken": [f"{step.mark.file}:{step.mark.line} {step.title}: {way}" for step, way in coverage.untaken],
    }


def _told(task: str, found: dict[str, Any]) -> list[str]:
    head = f"coverage of {task}: {found['reached']} of {found['steps']} steps ({found['percent']:g} %)"
    if found["branches"]:
        head += f", {found['taken']} of {found['branches']} branches"
    return [
        head,
        *(f"  never reached: {text}" for text in found["missed"]),
        *(f"  never taken:   {text}" for text in found["untaken"]),
    ]


def _closing(counts: list[bool]) -> str:
    total, failed = len(counts), counts.count(False)
    cases = f"{total} case{'' if total == 1 else 's'}"
    return f"{cases} passed" if not failed else f"{cases}: {total - failed} passed, {failed} failed"
