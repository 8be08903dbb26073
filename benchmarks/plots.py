"""Plots of what benchmarks found."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

PANELS = (
    ("idle", "a round without news, us"),
    ("news", "a wake that ends nothing, us"),
    ("burst", "a wake of 100, nobody says whose, us"),
    ("bytes", "memory an instance, bytes"),
)


def draw_peers(rows: Sequence[Mapping[str, Any]], names: Mapping[str, str], path: Path) -> None:
    """Draw one row of panels a tree: cost over the number of instances, both logarithmic.

    Args:
        rows: as bench_peers.py writes them.
        names: of engines, by key; `ours` among them.
        path: of the picture.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    trees = list(dict.fromkeys(row["tree"] for row in rows))
    figure = Figure(figsize=(4 * len(PANELS), 3.2 * max(1, len(trees))), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(max(1, len(trees)), len(PANELS), squeeze=False)
    lines: dict[str, Any] = {}
    for line, tree in enumerate(trees):
        for column, (measure, title) in enumerate(PANELS):
            axes = grid[line][column]
            found = series(rows, tree, measure)
            if not any(found.values()):
                axes.set_axis_off()  # this is not measured of that tree
                continue
            for key, points in found.items():
                colour = f"C{list(names).index(key)}"
                (lines[names[key]],) = axes.plot(
                    [x for x, _ in points], [y for _, y in points], "o-", color=colour,
                    linewidth=2.5 if key == "ours" else 1.2, markersize=4,
                )  # fmt: skip
            axes.set(xscale="log", yscale="log", xlabel=f"{tree}, instances", ylabel=title)
            axes.grid(visible=True, which="major", alpha=0.3)
    if lines:
        figure.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=len(lines))
    figure.savefig(path, dpi=110)


def series(rows: Sequence[Mapping[str, Any]], tree: str, measure: str) -> dict[str, list[tuple[int, float]]]:
    """Return points by engine; what cost nothing that could be measured is left out."""
    found: dict[str, dict[int, float]] = {}
    for row in rows:
        if row["tree"] == tree and row["measure"] == measure:
            found.setdefault("ours", {})[row["size"]] = row["ours"]
            found.setdefault(row["peer"], {})[row["size"]] = row["theirs"]
    return {key: [(x, y) for x, y in sorted(points.items()) if y > 0] for key, points in found.items()}
