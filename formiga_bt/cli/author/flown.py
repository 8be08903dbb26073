"""Pictures of a run in this process: what `dryrun --gantt` and `--map` write, and the pictures of the documents."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from formiga_bt.base.errors import UnusableFile

if TYPE_CHECKING:
    from formiga_bt.engine.kernel.inputs import EngineStep
    from formiga_bt.lang.model import Catalogue, Site, Task
    from formiga_bt.show.history.folded import FoldedSource


def check_pictures(*outs: Path | None, as_json: bool) -> None:
    """Find out before the flight whether its pictures can be written.

    Raises:
        UnusableFile: a name does not tell what it shall be, its folder is missing, or stdout is to take two things.
    """
    from formiga_bt.cli.picture_out import HERE, form_of

    for out in outs:
        if out == HERE and as_json:
            raise UnusableFile("--json has stdout to itself: name a file for the picture")
        if out is not None and out != HERE:
            form_of(out)


def source_of_steps(
    steps: "Iterable[EngineStep]", site: "Site", catalogue: "Catalogue", tasks: "Sequence[Task]"
) -> "FoldedSource":
    """Return what can be asked of a run that is over."""
    from formiga_bt.show.history.folded import FoldedSource
    from formiga_bt.show.history.ledger import ALL, Ledger

    ledger = Ledger(ALL)
    for step in steps:
        ledger.feed(step)
    return FoldedSource(ledger, site, {task.name: task for task in tasks}, catalogue)


def draw_steps(
    steps: "Iterable[EngineStep]",
    site: "Site",
    catalogue: "Catalogue",
    tasks: "Sequence[Task]",
    gantt: Path | None,
    map_: Path | None,
) -> None:
    """Write pictures of what an engine did; None = not this one, `-` = to the terminal.

    Raises:
        UnusableFile: a file cannot be written.
    """
    from formiga_bt.cli import picture_out as out

    source = source_of_steps(steps, site, catalogue, tasks)
    plain, room = out.is_plain(False), out.columns(None)
    timeline = source.timeline()
    if gantt is not None:
        from formiga_bt.show.gantt import files, text

        out.draw(gantt, lambda form: files.made(timeline, form), lambda: text.drawn(timeline, room, ascii_only=plain))
    if map_ is not None:
        from formiga_bt.show.map import files as map_files
        from formiga_bt.show.map import text as map_text

        ids = tuple(task.id for task in timeline.tasks)
        chart = source.chart(ids)
        out.draw(
            map_,
            lambda form: map_files.made(chart, form, ids=ids),
            lambda: map_text.drawn(chart, room, ascii_only=plain, ids=ids),
        )
