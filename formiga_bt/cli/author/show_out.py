"""Where `formiga show` draws: the terminal, or a file in one of the formats of trees."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from formiga_bt.base.errors import FormigaError, UnusableFile

if TYPE_CHECKING:
    from formiga_bt.show.facts import Drawing, StepFact, TaskPicture
    from formiga_bt.show.tree.terminal import DrawnLine


@dataclass(frozen=True, slots=True)
class DrawingOptions:
    """How and where a tree is drawn."""

    form: str
    """Empty: as the file's name ends, else for the terminal."""
    out: Path | None
    depth: int | None
    collapse: tuple[str, ...]
    ascii_only: bool
    width: int
    colour: bool

    def show(self, drawing: "Drawing", steps: "Mapping[str, StepFact] | None" = None, title: str = "") -> None:
        """Draw a task.

        Raises:
            UnusableFile: the file cannot be written, or its ending says no format.
            FormigaError: something that the format needs is missing; or nothing can be collapsed by that name.
        """
        from formiga_bt.show.tree import formats

        form = self._form()
        drawing = self.cut(drawing)
        if form == "terminal":
            lines = self._lines(drawing, steps, title)
            self._put("".join(self.text(line) + "\n" for line in lines))
        elif form == "png":
            self._put_bytes(formats.as_png(drawing, steps, title))
        else:
            self._put(formats.as_text(form, drawing, steps, title))

    def show_task(self, picture: "TaskPicture") -> None:
        """Draw a task of an engine with how its steps stand."""
        drawing = with_sources(picture.drawing) if self._form() == "html" else picture.drawing
        self.show(drawing, {step.path: step for step in picture.steps}, title_of(picture))

    def task_lines(self, picture: "TaskPicture") -> "list[DrawnLine]":
        """Return the lines of a task of an engine, without what was collapsed."""
        steps = {step.path: step for step in picture.steps}
        return self._lines(self.cut(picture.drawing), steps, title_of(picture))

    def text(self, line: "DrawnLine") -> str:
        """Return a line, with colours where they show."""
        return line.styled() if self.colour and self.out is None else line.plain()

    def _lines(self, drawing: "Drawing", steps: "Mapping[str, StepFact] | None", title: str) -> "list[DrawnLine]":
        from formiga_bt.show.tree.terminal import draw, titled

        drawn = draw(drawing, steps, width=self.width, ascii_only=self.ascii_only, head=not title)
        return [*titled(title, width=self.width, ascii_only=self.ascii_only), *drawn] if title else drawn

    def cut(self, drawing: "Drawing") -> "Drawing":
        """Return a drawing without what is too deep, or collapsed."""
        from formiga_bt.show.tree.drawing import cut, names_of, walk

        names = {name for box in walk(drawing.sections) for name in names_of(box) if name}
        for name in self.collapse:
            if name not in names:
                near = get_close_matches(name, sorted(names), n=3, cutoff=0.5)
                raise FormigaError(f"nothing in {drawing.task} is called '{name}' that could be collapsed", near=near)
        return cut(drawing, depth=self.depth, collapse=self.collapse)

    def _form(self) -> str:
        from formiga_bt.show.tree.formats import UnknownFormat, format_of

        if self.form or self.out is None:
            return self.form or "terminal"
        try:
            return format_of(self.out)
        except UnknownFormat as error:
            raise UnusableFile(str(error)) from error

    def _put(self, text: str) -> None:
        if self.out is None:
            sys.stdout.write(text)
        else:
            self._put_bytes(text.encode())

    def _put_bytes(self, data: bytes) -> None:
        if self.out is None:
            if sys.stdout.isatty():
                raise UnusableFile("a picture would make a mess of the terminal; name a file: -o tree.png")
            sys.stdout.buffer.write(data)
            return
        try:
            self.out.write_bytes(data)
        except OSError as error:
            raise UnusableFile(f"cannot write {self.out}: {error.strerror or error}") from error


def with_sources(drawing: "Drawing") -> "Drawing":
    """Return the drawing of a task that an engine runs with the texts of its files, if those here still say the same."""
    from msgspec.structs import replace

    from formiga_bt.cli.inputs import read_task, read_world
    from formiga_bt.show.tree.drawing import drawing_of

    path = Path(drawing.spot.file)
    if drawing.sources or not path.is_file():
        return drawing
    read = read_task(path, read_world())
    if read.task is None or drawing_of(read.task) != drawing:
        return drawing
    return replace(drawing, sources=drawing_of(read.task, sources=read.sources).sources)


def title_of(picture: "TaskPicture") -> str:
    """Return how a task stands, in one line."""
    task = picture.task
    held = " HELD" if task.held and not task.is_over else ""
    facts = [
        f"{task.id} {task.status}{held}",
        task.versions,
        *task.held,
        task.doing or f"{task.code} {task.reason}".strip(),
    ]
    return "  ".join(fact for fact in facts if fact)
