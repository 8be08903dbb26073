"""`formiga demo`: the shipped missions on simulated drones and people, each a process of its own, over real Zenoh."""

import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.errors import FormigaError, TreeError
from formiga_bt.packaged import folder

if TYPE_CHECKING:
    from formiga_bt.demo import Demo
    from formiga_bt.lang.model import Catalogue, Site, Task

TASKS = ("move_task.yaml", "pick_up.yaml")
WALL_LIMIT_S = 600.0


def command(
    headless: Annotated[bool, typer.Option("--headless", help="Plain lines instead of the live display.")] = False,
    speed: Annotated[
        float, typer.Option(help="Engine seconds per wall second, up to 20.", metavar="X", min=0.1, max=20.0)
    ] = 6.0,
) -> None:
    """Fly one MoveTask and two PickUps at once on 2 light and 2 heavy drones, with 2 pickers and a watcher.

    Exit code 0 only if every task succeeded and nothing crashed. Ctrl-C aborts the tasks and waits until the drones have
    landed; a second Ctrl-C ends at once.
    """
    site, catalogue, tasks = _world()
    from formiga_bt.demo import Demo
    from formiga_bt.show.live import LiveView, PlainView

    view = PlainView() if headless or not sys.stdout.isatty() else LiveView()
    with Demo(site, catalogue, tasks, speed=speed) as demo, view:
        interrupted = not _fly(demo, lambda: view.show(demo.log, demo.driver.now()))
        verdict = demo.verdict()
    view.close_with(demo.log, verdict)
    if interrupted:
        raise typer.Exit(130)
    if not demo.log.all_succeeded() or not verdict.is_clean:
        raise typer.Exit(1)


def _world() -> "tuple[Site, Catalogue, list[Task]]":
    world = read_world((), folder("trees") / "demo-site.yaml")
    read = [read_task(folder("trees") / name, world) for name in TASKS]
    problems = [*world.diagnostics, *(d for r in read for d in r.diagnostics)]
    tasks = [r.task for r in read if r.task is not None]
    if world.site is None or len(tasks) < len(TASKS):
        raise TreeError("the demo's own files have errors", problems)
    return world.site, world.catalogue, tasks


def _fly(demo: "Demo", show: Callable[[], None]) -> bool:
    """Run the missions; return False if they were interrupted (the drones have landed then)."""
    from formiga_bt.demo import missions

    try:
        demo.wait_ready(show)
        ids = demo.submit(missions(demo.site))
        until = time.monotonic() + WALL_LIMIT_S
        while not demo.ended(ids):
            if time.monotonic() > until:
                raise FormigaError(f"the demo did not end within {WALL_LIMIT_S:g} s")
            demo.pump(0.2)
            show()
    except KeyboardInterrupt:
        demo.abort_all()
        while not demo.all_ended():
            demo.pump(0.2)
            show()
        return False
    return True
