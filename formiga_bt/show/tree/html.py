"""A drawing as one HTML file that needs nothing else: it folds, can be searched, and shows the source beside the tree.

It reads without JavaScript. All that comes from task files is escaped, and the page allows no script but its own.
"""

import base64
import hashlib
from collections.abc import Iterator, Mapping
from html import escape as as_html
from importlib.resources import files
from pathlib import PurePath

from formiga_bt.show.facts import Box, Drawing, FileSpot, StepFact
from formiga_bt.show.tree.drawing import is_step
from formiga_bt.show.tree.marks import MARKS, mark_of, note_of
from formiga_bt.show.tree.outline import BADGES
from formiga_bt.show.tree.terminal import safe

TINTS = 8
"""So many colours of roles has the style."""


def html_of(drawing: Drawing, steps: Mapping[str, StepFact] | None = None, title: str = "") -> str:
    """Return the page of a task.

    Args:
        drawing: the task; with `sources`, their texts are in the page.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    return "\n".join(_Page(drawing, steps, title).lines()) + "\n"


class _Page:
    def __init__(self, drawing: Drawing, steps: Mapping[str, StepFact] | None, title: str) -> None:
        self._drawing = drawing
        self._steps = steps
        self._title = title or drawing.task
        self._files = {file: at for at, file in enumerate(_main_first(drawing))}
        self._tints = {box.role: at % TINTS for at, box in enumerate(drawing.roles)}

    def lines(self) -> Iterator[str]:
        drawing = self._drawing
        style, script = _part("tree.css"), _part("tree.js")
        yield "<!DOCTYPE html>"
        yield '<html lang="en"><head><meta charset="utf-8">'
        yield (
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline';"
            f" script-src '{_digest(script)}'; base-uri 'none'; form-action 'none'\">"
        )
        yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
        yield f"<title>{escape(self._title)}</title><style>\n{style}</style></head><body>"
        yield f"<header><h1>{escape(self._title)} <small>{escape(drawing.version)}</small></h1>"
        yield f"<p>{escape(drawing.description)}</p>" if drawing.description else ""
        yield f'<p class="soft">{escape(", ".join(drawing.facts))} {self._link(drawing.spot)}</p>'
        if self._steps is not None:
            marks = "".join(f'<span class="mark {m.status}">{m.glyph}</span>{m.words}' for m in MARKS)
            yield f'<p class="legend">{marks}</p>'
        yield (
            '<div class="tools"><input id="find" type="search" placeholder="Search steps  ( / )" aria-label="Search steps">'
            '<span id="count" class="soft" role="status"></span><button id="open">Open all</button>'
            '<button id="close">Close all</button><button id="theme">Dark / light</button></div></header><main>'
        )
        yield '<section id="tree">'
        for word, boxes in (("params", drawing.params), ("vars", drawing.vars), ("agents", drawing.roles)):
            if boxes:
                yield f"<h2>{word}</h2><ul>"
                for box in boxes:
                    yield from self._item(box)
                yield "</ul>"
        for section in drawing.sections:
            more = f' <span class="hidden">({section.hidden} more)</span>' if section.hidden else ""
            yield f"<h2>{''.join(escape(span.text) for span in section.label)}{more}</h2><ul>"
            for box in section.children:
                yield from self._item(box)
            yield "</ul>"
        yield "</section>"
        yield from self._sources()
        yield f"</main><script>{script}</script></body></html>"

    def _item(self, box: Box) -> Iterator[str]:
        if not box.children:
            yield f'<li><div class="row"><span class="gap"></span>{self._row(box)}</div></li>'
            return
        kind = "call" if box.kind == "call" else ""
        yield f'<li><details class="{kind}" open><summary class="row"><span class="fold"></span>{self._row(box)}</summary><ul>'
        for child in box.children:
            yield from self._item(child)
        yield "</ul></details></li>"

    def _row(self, box: Box) -> str:
        fact = None if self._steps is None else self._steps.get(box.path)
        parts = []
        if self._steps is not None and is_step(box):
            mark = mark_of(box, fact)
            parts.append(
                f'<span class="mark {mark.status}" title="{mark.words}" aria-label="{mark.words}">{mark.glyph}</span>'
            )
        badge = BADGES.get(box.kind)
        what = f'<span class="sign" title="{badge.words}">{badge.symbol}</span> ' if badge else ""
        what += "".join(self._span(box, span.text, span.style) for span in box.label)
        if box.modifiers:
            what += f' <span class="mods">[{escape("; ".join(box.modifiers))}]</span>'
        if box.hidden:
            what += f' <span class="hidden">({box.hidden} more)</span>'
        note = note_of(fact)
        if note:
            what += f' <span class="note">{escape(note)}</span>'
        return "".join([*parts, f'<span class="what">{what}</span>', self._link(box.spot) if box.spot else ""])

    def _span(self, box: Box, text: str, style: str) -> str:
        if style == "agent":
            tint = self._tints.get(box.task_role or box.role) if box.kind not in ("call", "request") else None
            name, dot, _ = text.partition(".")
            return f'<b class="role r{tint}">{escape(name)}</b>{dot}' if tint is not None else f"<b>{escape(text)}</b>"
        if style in ("kind", "title"):
            return f"<b>{escape(text)}</b>"
        return f'<span class="mods">{escape(text)}</span>' if style == "dim" else escape(text)

    def _link(self, spot: FileSpot) -> str:
        words = escape(f"{PurePath(spot.file).name}:{spot.line}")
        at = self._files.get(spot.file)
        if at is None:
            return f'<span class="soft">{words}</span>'
        return f'<a href="#f{at}-{spot.line}" title="{escape(spot.file)}">{words}</a>'

    def _sources(self) -> Iterator[str]:
        if not self._files:
            return
        yield '<aside id="source" aria-label="Source">'
        for file, at in self._files.items():
            yield f'<h2 title="{escape(file)}">{escape(PurePath(file).name)}</h2>'
            lines = self._drawing.sources[file].removesuffix("\n").split("\n")
            rows = "".join(
                f'<span id="f{at}-{n}">{escape(text, tabs=True) or " "}</span>' for n, text in enumerate(lines, 1)
            )
            yield f"<pre>{rows}</pre>"
        yield "</aside>"


def _main_first(drawing: Drawing) -> list[str]:
    return sorted(drawing.sources, key=lambda file: (file != drawing.spot.file, file))


def _part(name: str) -> str:
    return (files("formiga_bt.show.tree.page") / name).read_text(encoding="utf-8")


def _digest(script: str) -> str:
    """Return what a browser knows the page's own script by."""
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def escape(text: str, *, tabs: bool = False) -> str:
    """Return a text for a page; signs that are not seen are spelled: one of them could turn round how the rest is read."""
    return as_html("\t".join(safe(part) for part in text.split("\t")) if tabs else safe(text))
