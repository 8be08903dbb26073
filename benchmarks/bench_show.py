"""What drawing a tree costs: in the terminal, and as SVG, for a task of 2,000 steps; reading the file apart.

python benchmarks/bench_show.py [--steps N]
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.show.facts import StepFact
from formiga_bt.show.tree.drawing import drawing_of, is_step, walk
from formiga_bt.show.tree.formats import as_text
from formiga_bt.show.tree.svg import svg_of
from formiga_bt.show.tree.terminal import draw

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "pictures"))
from make_trees import written


def best(call: Callable[[], Any], rounds: int = 3) -> float:
    """Return the shortest of some rounds, seconds."""
    found = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return min(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=2_000)
    args = parser.parse_args()
    with TemporaryDirectory() as place:
        path = Path(place) / "rounds.yaml"
        path.write_text(written(args.steps), encoding="utf-8")
        read = read_task(path, read_world())
    task = read.task
    if task is None:
        raise SystemExit("\n".join(str(problem) for problem in read.diagnostics))
    drawing = drawing_of(task, sources=read.sources)
    steps = [box.path for box in walk(drawing.sections) if is_step(box)]
    facts = {path: StepFact(path=path, status="success", succeeded=1) for path in steps[: len(steps) // 2]}
    print(f"{len(steps)} steps, half of them with a status; best of three")
    print(f"from the checked model to facts  {best(lambda: drawing_of(task)) * 1e3:7.0f} ms")
    print(f"terminal, 100 columns            {best(lambda: draw(drawing, facts)) * 1e3:7.0f} ms")
    print(f"svg                              {best(lambda: svg_of(drawing, facts)) * 1e3:7.0f} ms")
    for form in ("html", "mermaid", "json"):
        print(f"{form:33}{best(lambda form=form: as_text(form, drawing, facts)) * 1e3:7.0f} ms")


if __name__ == "__main__":
    main()
