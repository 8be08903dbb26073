"""From a name to where it is defined, to all its places, and to another name.

A name belongs to the body in which it is defined: the task, or one subtree. Rename and references work on a document that is
YAML; the definition is also found while it is not.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.editor.index import SUBTREES, Occurrence
from formiga_bt.editor.phrase import word_at
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.view import PositionView, look
from formiga_bt.lang.expr.helpers import STANDARD
from formiga_bt.lang.own_names import BUILT_IN, why_taken
from formiga_bt.lang.text.reading import IDENTIFIER

_WORD: Final = re.compile(r"[A-Za-z_]\w*")


class CannotRename(Exception):  # noqa: N818 - it is an answer
    """A name cannot be changed here; the text says why."""


@dataclass(frozen=True, slots=True)
class LineColumns:
    """Columns of a line of a file, 0-based."""

    path: Path
    line: int
    start: int
    end: int


def definition(project: Project, document: Document, line: int, col: int) -> LineColumns | None:
    """Return where the name at a position is defined: here, in an imported file or in the catalogue; None if unknown."""
    view = look(project, document, line, col)
    if view is None:
        return None
    word, option = view.at.text.strip(), view.option
    name = option.name if option is not None else ""
    inside = view.expression()
    if inside is not None:
        found = word_at(inside[0], inside[1])
        return _own(view, found[0]) if found is not None and not found[3] else None
    if view.at.slot == "key":
        return _of_key(view)
    if name == "imports":
        path = project.locate(document.path, word)
        return LineColumns(path, 0, 0, 0) if path is not None else None
    if name in ("call", "request"):
        return _at(view.callee.mark, view.callee.path) if view.callee is not None else None
    if option is not None and option.form == "action":
        role, dot, action = word.partition(".")
        spec = view.catalogue.actions.get(action)
        if dot and view.at.offset > len(role):
            return _at(spec.mark) if spec is not None else None
        return _own(view, role)
    if name in ("type", "any_of", "of", "extends") and word in view.catalogue.types:
        return _at(view.catalogue.types[word].mark)
    if name == "actions" and word in view.catalogue.actions:
        return _at(view.catalogue.actions[word].mark)
    return _own(view, word)


def _of_key(view: PositionView) -> LineColumns | None:
    word = view.at.text
    if view.callee is not None and word in view.callee.params and view.at.levels[-1].under == word:
        return _at(view.callee.params[word].mark, view.callee.path)
    if view.action is not None and word in view.action.fields:
        return _at(view.action.mark)
    return _own(view, word)


def _own(view: PositionView, name: str) -> LineColumns | None:
    found = view.document.last_known().definition((view.slot.body, name))
    if found is None or view.document.lines[found.line : found.line + 1] == []:
        return None
    if view.document.lines[found.line][found.start : found.end] != name:  # it has moved since
        index = view.document.index()
        found = index.definition((view.slot.body, name)) if index is not None else found
    return _place(view.document, found) if found is not None else None


def _at(mark: Mark, path: Path | None = None) -> LineColumns:
    return LineColumns(path or Path(mark.file), mark.line - 1, mark.col - 1, max(mark.end_col - 1, mark.col - 1))


def _place(document: Document, one: Occurrence) -> LineColumns:
    return LineColumns(document.path, one.line, one.start, one.end)


def references(document: Document, line: int, col: int, *, with_definition: bool = True) -> list[LineColumns]:
    """Return every place in the file of the name at a position."""
    index = document.index()
    found = index.at(line, col) if index is not None else None
    if index is None or found is None:
        return []
    return [_place(document, one) for one in index.all_of(found.key) if with_definition or not one.origin]


def renamable(document: Document, line: int, col: int) -> Occurrence:
    """Return the name at a position, if it may be changed in this file.

    Raises:
        CannotRename: it is no name of this file, is built in, or the file is no YAML at the moment.
    """
    index = document.index()
    if index is None:
        raise CannotRename("this file cannot be read at the moment: fix it first")
    found = index.at(line, col)
    if found is None:
        raise CannotRename(_why_not(document, line, col))
    if index.definition(found.key) is None:
        if found.name in BUILT_IN:
            raise CannotRename(f"'{found.name}' is built in")
        what = "subtree" if found.space == SUBTREES else "name"
        raise CannotRename(f"no {what} '{found.name}' is defined in this file")
    return found


def _why_not(document: Document, line: int, col: int) -> str:
    text = document.lines[line] if line < len(document.lines) else ""
    for word in _WORD.finditer(text):
        if word.start() <= col <= word.end():
            if word[0] in STANDARD.names():
                return f"'{word[0]}' is a helper of the language"
            if word[0] in BUILT_IN:
                return f"'{word[0]}' is built in"
            return f"'{word[0]}' is not a name that this file defines"
    return "there is no name here"


def rename(document: Document, line: int, col: int, new: str) -> list[LineColumns]:
    """Return the places at which the name at a position is to be replaced by `new`.

    Raises:
        CannotRename: the name may not be changed, or the new one is taken or is none.
    """
    found = renamable(document, line, col)
    if not IDENTIFIER.match(new):
        raise CannotRename(f"'{new}' cannot be a name: a letter, then letters, digits and _")
    if taken := why_taken(new):
        raise CannotRename(taken)
    index = document.index()
    assert index is not None, "renamable read it"
    if new != found.name and any(one.origin for one in index.all_of((found.space, new))):
        raise CannotRename(f"'{new}' is defined in this file already")
    places = {(one.line, one.start): one for one in index.all_of(found.key)}
    return [_place(document, places[at]) for at in sorted(places)]
