"""Diagnostics: what is wrong in a file, where, and how to mend it.

Built by `lang`, printed by `formiga check`, and fed back to a model that wrote the tree. Positions are 1-based.
"""

from collections.abc import Iterable, Mapping
from operator import attrgetter
from typing import Final, Literal

from msgspec import Struct

Severity = Literal["error", "warning"]

LONGEST: Final = 200
"""Letters of a source line that are shown; of a longer one, so many around what is wrong."""
CUT: Final = "..."


class Mark(Struct, frozen=True, eq=False):
    """A span of a source file: 1-based line and column of its first character, and the column after its last."""

    file: str
    line: int
    col: int
    end_line: int = 0
    end_col: int = 0
    label: str = ""
    """How messages call the line, if not by its number: the path of a task in JSON form."""

    def __eq__(self, other: object) -> bool:
        """Return whether two marks are of one span."""
        return isinstance(other, Mark) and _span(self) == _span(other)

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __lt__(self, other: "Mark") -> bool:
        """Return whether this span comes first."""
        return bool(_span(self) < _span(other))

    def __hash__(self) -> int:
        """Return a hash of the span."""
        return hash(_span(self))

    @property
    def said(self) -> str:
        """Return how messages call the line: `line 4`."""
        return self.label or f"line {self.line}"

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.col}"


_span = attrgetter("file", "line", "col", "end_line", "end_col")


class Fix(Struct, frozen=True):
    """A mechanical mend: replace the span of `mark` by `text`."""

    mark: Mark
    text: str


class UnknownName(Struct, frozen=True):
    """A word that names nothing here."""

    name: str
    meant: str = ""
    """A name that is like it; empty = none."""


class UnusedName(Struct, frozen=True):
    """Something that is declared and not used."""

    kind: str
    """As messages call it: `param`, `var`, `role`, `subtree`, `import`."""
    name: str
    """Of an import: as it is written."""


class LeftAirborne(Struct, frozen=True):
    """A role of which a machine can be in the air when it must stand."""

    role: str


class CommandedTwice(Struct, frozen=True):
    """A machine that is commanded from two places at once."""

    agent: str
    """A role or a loop name, or an item of one: `drones[0]`."""


class OnGround(Struct, frozen=True):
    """A place where a position in the air is needed."""

    place: str
    """The expression."""


About = UnknownName | UnusedName | LeftAirborne | CommandedTwice | OnGround


class Diagnostic(Struct, frozen=True, eq=False):
    """One problem: a stable code (E = refused, W = warning), its place, what is wrong, and the mend."""

    code: str
    mark: Mark
    message: str
    help: str = ""
    within: str = ""
    """Where in the task, in words: `PickUp / steps / GoTo`."""
    fix: Fix | None = None
    about: About | None = None
    """What the message speaks of, for programs: no program reads the message. None = no program asks."""

    def __eq__(self, other: object) -> bool:
        """Return whether two say the same of one place, whatever mends it."""
        return isinstance(other, Diagnostic) and _said(self) == _said(other)

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __hash__(self) -> int:
        """Return a hash of what it says."""
        return hash(_said(self))

    @property
    def severity(self) -> Severity:
        """Return "error" for E codes and "warning" for W codes."""
        return "warning" if self.code.startswith("W") else "error"


_said = attrgetter("code", "mark", "message", "help", "within")


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return the diagnostics without repeats, by file, line, column and code."""
    unique = {(d.mark.file, d.mark.line, d.mark.col, d.code, d.message): d for d in diagnostics}
    return [unique[key] for key in sorted(unique)]


def errors_first(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return the diagnostics as people read them: the files in their order, and in each the errors before the warnings."""
    found = list(diagnostics)
    files = list(dict.fromkeys(d.mark.file for d in found))
    return sorted(found, key=lambda d: (files.index(d.mark.file), d.severity != "error"))


def _cut(line: str, pad: str, width: int) -> tuple[str, str, int]:
    """Return a source line, what stands before its carets, and how many those are; of a very long line the part around them."""
    if len(line) <= LONGEST:
        return line, pad, width
    begin = max(0, min(len(pad) - LONGEST // 3, len(line) - LONGEST))
    before, after = (CUT if begin else ""), (CUT if begin + LONGEST < len(line) else "")
    pad = " " * len(before) + pad[begin:]
    return f"{before}{line[begin : begin + LONGEST]}{after}", pad, max(1, min(width, len(before) + LONGEST - len(pad)))


def render(diagnostic: Diagnostic, sources: Mapping[str, str]) -> str:
    """Return the text of one diagnostic: head line, source line with carets, place in the task, help.

    Args:
        diagnostic: the problem.
        sources: text of each file by the name used in marks; a missing file leaves the source line out.
    """
    mark = diagnostic.mark
    lines = [f"{mark}: {diagnostic.code}: {diagnostic.message}"]
    text = sources.get(mark.file, "").splitlines()
    if 1 <= mark.line <= len(text):
        line = text[mark.line - 1]
        end = mark.end_col if mark.end_line == mark.line and mark.end_col > mark.col else 0
        end = end or (len(line.rstrip()) + 1 if mark.end_line > mark.line else mark.col + 1)
        pad = "".join("\t" if ch == "\t" else " " for ch in line[: mark.col - 1])
        width = max(1, min(end, len(line) + 1) - mark.col)
        shown, pad, width = _cut(line.rstrip(), pad, width)
        lines.append(f"{mark.line:>5} | {shown}")
        lines.append(f"      | {pad}{'^' * width}")
    if diagnostic.within:
        lines.append(f"  in: {diagnostic.within}")
    if diagnostic.help:
        lines.append(f"  help: {diagnostic.help}")
    return "\n".join(lines)
