"""What was visible at the steps of a file when it was last checked, looked up for a text that has changed since."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from formiga_bt.base.diagnostics import Mark
from formiga_bt.editor.where import EditorPosition
from formiga_bt.lang.expr.scope import Scope


@dataclass(frozen=True, slots=True)
class Seen:
    """What was visible at the steps of a file when it was last checked."""

    lines: Sequence[str] = ()
    at: Sequence[tuple[int, int, Scope]] = ()
    """Line (0-based) and column (1-based) of each step, with what is visible; by line."""

    def visible(self, lines: Sequence[str], where: EditorPosition) -> Scope | None:
        """Return what is visible at a position of a text that has changed since, as far as one can tell."""
        if not self.at:
            return None
        step = next((one for one in reversed(where.levels) if one.kind == "list"), None)
        top = next((level.under for level in where.levels if level.kind == "map"), "")
        if step is None and top in ("vars", "agents", "params", "timeout", "expires", "cleanup_timeout", "envelope"):
            return self.at[0][2]
        line = self._then(lines, where.line)
        begun = self._then(lines, _step_line(where)) if step is not None else line
        return self._of_step(begun, where) or self._before(line, where.column + 1)

    def _of_step(self, begun: int, where: EditorPosition) -> Scope | None:
        """Return what is visible at the step around; of a step that is new, what is visible at the one after it."""
        index = bisect_left(self.at, begun, key=lambda one: one[0])
        if index == len(self.at):
            return None
        line, column = self.at[index][0], where.column + 1
        there = [(col, scope) for at, col, scope in self.at[index : index + 64] if at == line]
        if line == begun:
            fit = [one for one in there if one[0] <= column]
            return max(fit, key=lambda one: one[0])[1] if fit else None
        return next((scope for col, scope in there if col in (column, column - 2)), None)

    def _before(self, line: int, column: int) -> Scope | None:
        """Return what is visible behind the last step before a line that is not further in than a column."""
        index = bisect_left(self.at, line, key=lambda one: one[0]) - 1
        best: tuple[int, int, Scope] | None = None
        for one in reversed(self.at[: index + 1]):
            if best is not None and one[0] != best[0]:
                break
            if one[1] <= column and (best is None or one[1] > best[1]):
                best = one
        return best[2] if best is not None else self.at[0][2]

    def _then(self, lines: Sequence[str], line: int) -> int:
        """Return the line that a line of the present text was."""
        old = self.lines
        same = 0
        most = min(len(old), len(lines), line + 1)
        while same < most and old[same] == lines[same]:
            same += 1
        if same > line:
            return line
        behind = 0
        most = min(len(old), len(lines)) - same
        while behind < most and old[-1 - behind] == lines[-1 - behind]:
            behind += 1
        if line >= len(lines) - behind:
            return line - len(lines) + len(old)
        return min(line, len(old) - behind)


def _step_line(where: EditorPosition) -> int:
    """Return the line on which the innermost step around begins."""
    lists = [index for index, level in enumerate(where.levels) if level.kind == "list"]
    inner = where.levels[lists[-1] :] if lists else where.levels
    return min(level.line for level in inner)


class Recorder:
    """Gathers what is visible at each step of one file. Neighbours share what is equal."""

    def __init__(self, file: str, lines: Sequence[str]) -> None:
        self.file = file
        self.lines = lines
        self.entries: list[tuple[int, int, Scope]] = []

    def __call__(self, mark: Mark, scope: Scope) -> None:
        """Note what is visible at a place."""
        if mark.file != self.file:
            return
        last = self.entries[-1][2] if self.entries else None
        if last is not None and last.names == scope.names and last.maybe_unset == scope.maybe_unset:
            scope = last
        self.entries.append((mark.line - 1, mark.col, scope))

    def seen(self) -> Seen:
        """Return what was gathered, by line."""
        return Seen(self.lines, sorted(self.entries, key=lambda one: one[0]))
