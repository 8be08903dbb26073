"""The formats that a tree is drawn in: their names, the suffixes of their files, and who makes them.

Each maker takes a drawing and how its steps stand, and nothing else. Makers are imported when they are called.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec

from formiga_bt.base.errors import FormigaError
from formiga_bt.show.facts import Drawing, StepFact

SUFFIXES: Final[Mapping[str, tuple[str, ...]]] = {
    "terminal": (".txt",),
    "dot": (".dot", ".gv"),
    "svg": (".svg",),
    "png": (".png",),
    "mermaid": (".mmd", ".mermaid"),
    "html": (".html", ".htm"),
    "json": (".json",),
}
"""Format -> the endings of its files."""

Steps = Mapping[str, StepFact]


class UnknownFormat(FormigaError):  # noqa: N818 - it names what is wrong
    """A file's ending says no format that a tree is drawn in."""


def format_of(path: Path) -> str:
    """Return the format that a file's ending means.

    Raises:
        UnknownFormat: none.
    """
    for name, suffixes in SUFFIXES.items():
        if path.suffix.lower() in suffixes:
            return name
    known = ", ".join(f"{' '.join(suffixes)} ({name})" for name, suffixes in SUFFIXES.items())
    ending = f"'{path.suffix}' is no ending" if path.suffix else "it has no ending"
    raise UnknownFormat(
        f"the format of {path} is not known: {ending} of a picture", help=f"use one of {known}; or --format"
    )


def as_text(name: str, drawing: Drawing, steps: Steps | None = None, title: str = "") -> str:
    """Return a drawing in one of the formats that are text and need no terminal: dot, svg, mermaid, html, json.

    Args:
        name: the format.
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    match name:
        case "dot":
            from formiga_bt.show.tree.dot import dot_of

            return dot_of(drawing, steps, title)
        case "svg":
            from formiga_bt.show.tree.svg import svg_of

            return svg_of(drawing, steps, title)
        case "mermaid":
            from formiga_bt.show.tree.mermaid import mermaid_of

            return mermaid_of(drawing, steps, title)
        case "html":
            from formiga_bt.show.tree.html import html_of

            return html_of(drawing, steps, title)
        case "json":
            return json_of(drawing, steps)
    raise ValueError(f"{name} is no format of text")


def as_png(drawing: Drawing, steps: Steps | None = None, title: str = "") -> bytes:
    """Return a drawing as a PNG."""
    from formiga_bt.show.tree.png import png_of

    return png_of(drawing, steps, title)


def json_of(drawing: Drawing, steps: Steps | None = None) -> str:
    """Return a drawing as JSON: `{"formiga_tree": 1, "drawing": ..., "steps": [...]}`, without the texts of its files."""
    values = {
        "formiga_tree": 1,
        "drawing": msgspec.structs.replace(drawing, sources={}),
        "steps": None if steps is None else list(steps.values()),
    }
    return msgspec.json.format(msgspec.json.encode(values), indent=2).decode() + "\n"
