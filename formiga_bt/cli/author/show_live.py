"""`formiga show --live`: the tree of a running task, drawn again at every change until the task ends."""

import shutil
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TextIO

if TYPE_CHECKING:
    from formiga_bt.cli.author.show_out import DrawingOptions
    from formiga_bt.show.facts import TaskPicture
    from formiga_bt.show.tree.terminal import DrawnLine

PERIOD_S: Final = 0.5


def follow(
    read: "Callable[[], TaskPicture]",
    picture: "TaskPicture",
    canvas: "DrawingOptions",
    *,
    out: TextIO | None = None,
    in_place: bool | None = None,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Draw a task until it ends: in place on a terminal, else one tree after another.

    Args:
        read: asks for the task's picture of now.
        picture: the first one.
        canvas: how to draw it; with a file, that is written anew.
        out: where to; None = stdout.
        in_place: draw over the last one; None = if stdout is a terminal.
        sleep: waits seconds.
    """
    out = out or sys.stdout
    in_place = out.isatty() if in_place is None else in_place
    before: list[DrawnLine] = []
    drawn = 0
    while True:
        lines = canvas.task_lines(picture)
        if lines != before:
            if canvas.out is not None or canvas.form not in ("", "terminal"):
                canvas.show_task(picture)
            elif in_place:
                over = picture.task.is_over
                shown = lines if over else window(lines, shutil.get_terminal_size((100, 24)).lines - 1)
                out.write(f"\x1b[{drawn}F\x1b[J" if drawn else "")
                out.write("".join(canvas.text(line) + "\n" for line in shown))
                drawn = len(shown)
            else:
                out.write(("\n" if before else "") + "".join(canvas.text(line) + "\n" for line in lines))
            out.flush()
            before = lines
        if picture.task.is_over:
            return
        sleep(PERIOD_S)
        picture = read()


def window(lines: "list[DrawnLine]", height: int) -> "list[DrawnLine]":
    """Return as many lines as a terminal has: the first, and those around the first step that runs and has no other below."""
    from formiga_bt.show.tree.terminal import DrawnLine, LinePiece

    if len(lines) <= height:
        return lines
    room = max(1, height - 3)
    running = [at for at, line in enumerate(lines) if any(piece.style == "running" for piece in line.pieces)]
    leaf = next((at for at in running if at + 1 not in running), 0)
    start = min(max(1, leaf - room // 2), len(lines) - room)
    above, below = start - 1, len(lines) - start - room
    words = [f"... {count} lines {where}" if count else "" for count, where in ((above, "above"), (below, "below"))]
    more = [DrawnLine((LinePiece(word, "dim"),)) for word in words]
    return [lines[0], more[0], *lines[start : start + room], more[1]]
