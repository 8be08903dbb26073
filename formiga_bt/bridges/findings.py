"""What a bridge reports: a code, a place, what is lost, and what to do. Shown like diagnostics of the checker."""

from dataclasses import dataclass, field

from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order


@dataclass(slots=True)
class Findings:
    """What was found so far."""

    found: list[Diagnostic] = field(default_factory=list)

    def add(self, code: str, mark: Mark, message: str, mend: str = "") -> None:
        """Report; the codes stand in `table`."""
        self.found.append(Diagnostic(code, mark, message, mend))

    def all(self) -> list[Diagnostic]:
        """Return what was found in the order of the file."""
        return in_order(self.found)
