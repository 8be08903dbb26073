"""Tables and figures from results files, beside the paper's values.

    python -m experiments.e2_llm.report results.jsonl [more.jsonl ...] --out FOLDER

One table for each column and model; columns are never mixed. Shares have 95 % Wilson intervals. Fresh wordings have rows of
their own in the tables, and no part in the figures.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Final

from experiments.e2_llm import fresh, published
from experiments.e2_llm.records import Run, read

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ORDER: Final = ("T1", "T2", "T3", "T4", "T5", "T6", "T7", "T8", "T9", "T10", "T10+")
Z: Final = 1.959964
Group = tuple[str, str, str]
"""Provider, model, column."""
Part = tuple[str, str, list[Run]]
"""What a row of a table is called, its task, its runs."""


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval of a share."""
    if of == 0:
        return (0.0, 1.0)
    p, z2 = hits / of, Z * Z
    middle = (p + z2 / (2 * of)) / (1 + z2 / of)
    half = Z * math.sqrt(p * (1 - p) / of + z2 / (4 * of * of)) / (1 + z2 / of)
    return (max(0.0, middle - half), min(1.0, middle + half))


def share(hits: int, of: int) -> str:
    """Return a share as text: `93.3 % (28/30; 78.7 to 98.2)`."""
    if of == 0:
        return "-"
    low, high = wilson(hits, of)
    return f"{100 * hits / of:.1f} % ({hits}/{of}; {100 * low:.1f} to {100 * high:.1f})"


def groups(runs: Iterable[Run]) -> dict[Group, list[Run]]:
    """Return runs by model and column, the newest of a run only; those without an answer are left out."""
    found: dict[Group, dict[tuple[str, int], Run]] = {}
    for run in runs:
        if run.kind != "error":
            found.setdefault((run.provider, run.model, run.column), {})[run.task, run.run] = run
    return {group: list(rows.values()) for group, rows in sorted(found.items())}


def tables(runs: Iterable[Run]) -> str:
    """Return all tables as Markdown."""
    parts = ["# Experiment 2: tasks written by language models\n"]
    for (provider, model, column), rows in groups(runs).items():
        parts.append(f"## {model} ({provider}), column `{column}`\n")
        told = {run.trained_on for run in rows if run.trained_on}
        parts += [f"Training saw: {', '.join(sorted(told))}.\n"] if told else []
        shown = _parts(rows)
        if shown:
            parts += [_success(shown, column), _measures(shown), _faults(shown)]
        second = [run for run in rows if run.task.startswith("second/")]
        if second:
            parts.append(_second(second))
    return "\n".join(parts)


def _parts(rows: list[Run]) -> list[Part]:
    """Return the rows of a table: one for each task, and those of its fresh wordings behind it."""
    found = []
    for task in ORDER:
        of = [run for run in rows if run.task == task]
        known = [run for run in of if run.run < fresh.FIRST]
        first = [run for run in of if fresh.FIRST <= run.run < fresh.SECOND]
        second = [run for run in of if run.run >= fresh.SECOND]
        named = ((task, known), (f"{task}, fresh wordings", first), (f"{task}, fresh wordings again", second))
        found += [(name, task, rows) for name, rows in named if rows]
    return found


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def _success(parts: list[Part], column: str) -> str:
    head = [
        "task", "paper (Table 3)", "first answer right", "offered after repair and right", "offered but wrong, first",
        "offered but wrong, repaired", "first answer valid", "rounds", "tokens", "first answer s", "whole s",
        "checks s (median, most)", "paper's seconds (median)",
    ]  # fmt: skip
    made = []
    for name, task, of in parts:
        paper = published.SUCCESSES.get(task) if name == task else None
        seconds = published.SECONDS.get(task) if name == task else None
        made.append(
            [
                name,
                share(paper, published.RUNS) if paper is not None and column in ("paper", "paper-form") else "-",
                _share(of, lambda run: run.first is not None and run.first.success),
                _share(of, lambda run: run.last is not None and run.last.success and run.last.passed),
                _share(of, lambda run: run.first is not None and run.first.passed and not run.first.success),
                _share(of, lambda run: run.last is not None and run.last.passed and not run.last.success),
                _share(of, lambda run: run.first is not None and run.first.valid),
                f"{median(run.rounds for run in of):g}",
                f"{median(run.tokens for run in of):g}",
                f"{median(run.seconds_first for run in of):.1f}",
                f"{median(run.seconds for run in of):.1f}",
                _checks(of),
                f"{seconds:.2f}" if seconds is not None and column == "paper" else "-",
            ]
        )
    return _table(head, made)


def _checks(rows: list[Run]) -> str:
    """Return the seconds of a run that were not the model's."""
    values = [run.seconds_checks for run in rows if run.seconds_checks is not None]
    return f"{median(values):.2f}, {max(values):.2f}" if values else "-"


def _share(rows: list[Run], holds: Callable[[Run], bool]) -> str:
    return share(sum(map(holds, rows)), len(rows))


def _measures(parts: list[Part]) -> str:
    head = ["task", "measured", "`ngram_tree`", "`subtree_match`", "`flow_match`"]
    made = []
    for name, _, rows in parts:
        of = [run for run in rows if run.ngram_tree is not None]
        values = [[getattr(run, field) for run in of] for field in ("ngram_tree", "subtree_match", "flow_match")]
        made.append([name, str(len(of)), *(f"{median(one):.3f}" if one else "-" for one in values)])
    note = (
        "Medians over trees, against the shipped tree of the task; neither CodeBLEU nor comparable with the paper's.\n"
    )
    return f"{note}\n{_table(head, made)}"


def _faults(parts: list[Part]) -> str:
    head = ["task", "what was wrong in the end"]
    made = []
    for name, _, rows in parts:
        counts: dict[str, int] = {}
        for run in rows:
            if run.last is not None and not run.last.success:
                for code in run.last.faults[:1] or ("wrong",):
                    counts[code] = counts.get(code, 0) + 1
        told = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
        made.append([name, ", ".join(f"{code} {count}" for code, count in told) or "-"])
    return _table(head, made)


def _second(rows: list[Run]) -> str:
    head = [
        "second set",
        "first answer right",
        "right in the end",
        "offered but wrong",
        "median s",
        "checks s (median, most)",
    ]
    made = []
    for task in [*sorted({run.task.rsplit("/", 2)[0] for run in rows}), "second/"]:
        of = [run for run in rows if run.task.startswith(task)]
        made.append(
            [
                task.removeprefix("second/") or "all",
                _share(of, lambda run: run.first is not None and run.first.success),
                _share(of, lambda run: run.last is not None and run.last.success),
                _share(of, lambda run: run.last is not None and run.last.passed and not run.last.success),
                f"{median(run.seconds for run in of):.1f}",
                _checks(of),
            ]
        )
    return _table(head, made)


def figures(runs: Iterable[Run], out: Path) -> list[Path]:
    """Draw Fig. 15 and 16 anew, one file each for every model and column; return the files. Fresh wordings have no part."""
    from matplotlib.figure import Figure

    made = []
    for (provider, model, column), rows in groups(run for run in runs if run.run < fresh.FIRST).items():
        name = "".join(c if c.isalnum() else "-" for c in f"{provider}-{model}-{column}")
        for number, tasks in (("15", ORDER[5:10]), ("16", ("T10", "T10+"))):
            have = {run.task for run in rows} & set(tasks)
            if not have or (number == "16" and len(have) < 2):  # that one is a comparison
                continue
            figure = Figure(figsize=(10, 7), layout="constrained")
            figure.suptitle(f"As Fig. {number} of the paper, over trees: {model}, column {column}")
            for axes, panel in zip(figure.subplots(2, 2).flat, _PANELS, strict=True):
                _box(axes, rows, list(tasks), *panel, column)
            path = out / f"figure-{number}-{name}.svg"
            figure.savefig(path, metadata={"Date": None})
            made.append(path)
    return made


_PANELS: Final = (
    ("seconds_first", "seconds from request to first answer", published.SECONDS),
    ("ngram_tree", "ngram_tree (paper: weighted n-gram match of Python)", published.NGRAM),
    ("subtree_match", "subtree_match (paper: AST match of Python)", published.AST),
    ("flow_match", "flow_match (paper: data-flow match of Python)", published.FLOW),
)


def _box(axes: "Axes", rows: list[Run], tasks: list[str], field: str, title: str, paper: object, column: str) -> None:
    values = [
        [getattr(run, field) for run in rows if run.task == task and getattr(run, field) is not None] for task in tasks
    ]
    axes.boxplot(values, tick_labels=tasks)
    axes.set_title(title, fontsize=9)
    assert isinstance(paper, dict)
    known = [(i, paper[task]) for i, task in enumerate(tasks, start=1) if task in paper]
    if known and column == "paper":
        axes.plot(*zip(*known, strict=True), "D", mfc="none", color="tab:red", label="paper's median")
        axes.legend(fontsize=8)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run from the command line."""
    reader = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.report", description=(__doc__ or "").split("\n")[0]
    )
    reader.add_argument("results", nargs="+", type=Path)
    reader.add_argument("--out", type=Path, required=True, help="a folder for report.md and the figures")
    given = reader.parse_args(arguments)
    runs = [run for path in given.results for run in read(path)]
    if not runs:
        reader.error(f"no runs in {', '.join(map(str, given.results))}")
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "report.md").write_text(tables(runs), encoding="utf-8")
    figures(runs, given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
