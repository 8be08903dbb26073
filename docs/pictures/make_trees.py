"""Draws the trees of docs/trees.md, that of the README, and one of 300 steps, as SVG: `make pictures`.

The same files give the same pictures.

python docs/pictures/make_trees.py [FOLDER]
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.show.facts import Drawing
from formiga_bt.show.tree.drawing import drawing_of
from formiga_bt.show.tree.svg import svg_of

ROOT = Path(__file__).parents[2]
TASKS = (
    "move_task", "explore_region", "pick_up", "watch_dog_sos", "watch_dog_request",
    "circle", "triangle", "zig_zag", "patrol_and_escort", "delivery",
)  # fmt: skip
WAREHOUSE = ("tote_run", "ward_delivery", "find_and_fetch")
STEPS = 300

ROUND = """  - sequence:
      - fallback:
          - check: drone.battery > {low} %
          - ask: Battery below {low} %. Go on to post {n}?
            of: [watcher]
            timeout: 10 min
            expect: result.answer == 'yes'
      - do: drone.GoTo
        with:
          to: ${{above(offset(target, east={n} m), 60 m)}}
        retry: {{attempts: 3}}
      - if: deep
        then:
          - parallel:
              - wait: 20 s
              - check: drone.airborne
              - notify: At post {n}
                to: [watcher]
"""
"""Ten steps."""


def written(count: int) -> str:
    """Return a task of so many steps, of the kinds that missions are made of."""
    head = (
        "formiga: 1\ntask: Rounds\ndescription: A long round of posts.\nimports: [lib/flying.yaml]\n"
        "params:\n  target: place\n  deep: bool\nagents:\n  drone: {type: lwd}\n  watcher: {type: watcher}\n"
        "steps:\n  - do: drone.TakeOff\n"
    )
    rounds = "".join(ROUND.format(n=n + 1, low=20 + n % 3 * 5) for n in range((count - 5) // 10))
    waits = "  - wait: 5 s\n" * ((count - 5) % 10)
    return f"{head}{rounds}{waits}  - call: ReturnHome\n    with:\n      drone: ${{drone}}\n"


def first_task() -> str:
    """Return the task of the README."""
    return (ROOT / "README.md").read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0]


def drawn(path: Path, site: Path | None = None) -> Drawing:
    """Return the drawing of a task file, named as from the folder that it is in."""
    read = read_task(path, read_world(site=site))
    if read.task is None:
        raise SystemExit("\n".join(str(problem) for problem in read.diagnostics))
    return drawing_of(read.task)


def main(folder: Path) -> None:
    """Draw all."""
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(ROOT)
    for name in TASKS:
        (folder / f"{name}.svg").write_text(svg_of(drawn(Path("trees") / f"{name}.yaml")), encoding="utf-8")
    for name in WAREHOUSE:
        drawing = drawn(Path(f"trees/warehouse/trees/{name}.yaml"), Path("trees/warehouse/site.yaml"))
        (folder / f"{name}.svg").write_text(svg_of(drawing), encoding="utf-8")
    with TemporaryDirectory() as place:
        os.chdir(place)
        Path("my.yaml").write_text(first_task(), encoding="utf-8")
        (folder / "look_at.svg").write_text(svg_of(drawn(Path("my.yaml"))), encoding="utf-8")
        Path("rounds.yaml").write_text(written(STEPS), encoding="utf-8")
        (folder / "rounds.svg").write_text(svg_of(drawn(Path("rounds.yaml"))), encoding="utf-8")
        os.chdir(ROOT)
    sys.stdout.write(f"{len(TASKS) + len(WAREHOUSE) + 2} trees drawn into {folder}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "docs" / "pictures" / "trees")
