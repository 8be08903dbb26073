"""The problems of a file as an editor shows them: in this file, with their mends and with the places that they speak of.

A problem in an imported file, or in the catalogue, is shown at the import, else at the file's first line.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Fix, Mark
from formiga_bt.editor.project import Document, Project

_LINE: Final = re.compile(r"\b(?:at|when|from) line (\d+)\b|\(line (\d+)\)|\bat line (\d+)")


@dataclass(frozen=True, slots=True)
class FileSpan:
    """A stretch of a file; lines and columns are 0-based."""

    path: Path
    line: int
    start: int
    end_line: int
    end: int


@dataclass(frozen=True, slots=True)
class ShownProblem:
    """A problem as it is shown."""

    code: str
    severity: str
    span: FileSpan
    message: str
    related: tuple[tuple[FileSpan, str], ...] = ()
    fix: Fix | None = None


def shown(project: Project, document: Document, found: Sequence[Diagnostic]) -> list[ShownProblem]:
    """Return the problems of a document, those of the files that it reads included."""
    return [
        _own(document, one) if one.mark.file == str(document.path) else _foreign(project, document, one)
        for one in found
    ]


def _own(document: Document, one: Diagnostic) -> ShownProblem:
    span = span_of(document, one.mark)
    return ShownProblem(one.code, one.severity, span, _message(one), _related(document, one), one.fix)


def _message(one: Diagnostic) -> str:
    return one.message + (f"\nhelp: {one.help}" if one.help else "")


def _related(document: Document, one: Diagnostic) -> tuple[tuple[FileSpan, str], ...]:
    """Return the lines of this file that a message names."""
    numbers = [int(next(filter(None, match.groups()))) for match in _LINE.finditer(one.message)]
    found = []
    for number in dict.fromkeys(numbers):
        if 1 <= number <= len(document.lines) and number != one.mark.line:
            text = document.lines[number - 1]
            start = len(text) - len(text.lstrip())
            found.append((FileSpan(document.path, number - 1, start, number - 1, len(text.rstrip())), "this is meant"))
    return tuple(found)


def _foreign(project: Project, document: Document, one: Diagnostic) -> ShownProblem:
    """Return a problem of another file, shown where this file names it."""
    at = Mark(str(document.path), 1, 1)
    there: Path | None = None
    index = document.last_known()
    for word, path in project.imports(document, index).items():
        if one.mark.file == str(path) or one.mark.file.endswith(f"/{word}") or one.mark.file == word:
            there = path
            at = _import_mark(document, word) or at
    if there is None and Path(one.mark.file).is_file():
        there = Path(one.mark.file)
    message = f"{one.mark.file}:{one.mark.line}: {_message(one)}"
    related: tuple[tuple[FileSpan, str], ...] = ()
    if there is not None:
        line, start = one.mark.line - 1, one.mark.col - 1
        end = max(one.mark.end_col - 1, start) if one.mark.end_line == one.mark.line else start
        related = ((FileSpan(there, line, start, line, end), one.message),)
    return ShownProblem(one.code, one.severity, span_of(document, at), message, related)


def _import_mark(document: Document, word: str) -> Mark | None:
    for number, text in enumerate(document.lines, 1):
        start = text.find(word)
        if start >= 0:
            return Mark(str(document.path), number, start + 1, number, start + 1 + len(word))
    return None


def span_of(document: Document, mark: Mark) -> FileSpan:
    """Return the stretch of a mark; one without an end is a character, or the word there."""
    line, start = max(0, mark.line - 1), max(0, mark.col - 1)
    if mark.end_line >= mark.line and (mark.end_line, mark.end_col) > (mark.line, mark.col):
        return FileSpan(document.path, line, start, mark.end_line - 1, max(0, mark.end_col - 1))
    text = document.lines[line] if line < len(document.lines) else ""
    word = re.match(r"[\w.]+|.?", text[start:])
    return FileSpan(document.path, line, start, line, start + len(word[0] if word else ""))
