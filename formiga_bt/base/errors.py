"""Every error of ours has one base, so that a caller can catch "any of ours".

    FormigaError
     +- TreeError         the author's: a task file is wrong; carries diagnostics
     +- TransportError    a wire cannot be opened or used
     +- TaskError         a request or an order to a task cannot be served (unknown task, already ending, ...)
     +- SiteError         a second engine on the site, unreadable runtime files
     +- JournalError      the journal is damaged, newer, not ours, or cannot be written
     +- UnusableFile      a file named on the command line cannot be read, or the command line says nothing sane

Bugs are AssertionError and are never caught. A library's exception is mapped where its library is used, with `from`.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from formiga_bt.base.diagnostics import Diagnostic


class FormigaError(Exception):
    """Base of all errors that formiga_bt raises on purpose: what is wrong, and where.

    Args:
        message: what people read of it.
        help: how to fix it.
        near: names that may have been meant, best first.
    """

    def __init__(self, message: str = "", *, help: str = "", near: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.help = help
        self.near = tuple(near)

    @property
    def text(self) -> str:
        """Return what is wrong, without the rest."""
        return super().__str__()

    def __str__(self) -> str:
        """Return what is wrong, what may have been meant, and how to fix it."""
        meant = f"; did you mean {' or '.join(self.near)}?" if self.near else ""
        return f"{self.text}{meant}" + (f"\n  help: {self.help}" if self.help else "")


class TreeError(FormigaError):
    """A task file, catalogue or site file cannot be used; `diagnostics` lists every problem found in it."""

    def __init__(self, message: str, diagnostics: "Sequence[Diagnostic]" = (), *, help: str = "") -> None:
        super().__init__(message, help=help)
        self.diagnostics = tuple(diagnostics)


class TransportError(FormigaError):
    """A wire cannot be opened, or was closed under us."""


class TaskError(FormigaError):
    """A request or an order to a task cannot be served. `code` is a stable snake_case word."""

    def __init__(self, code: str, message: str, *, help: str = "", near: Iterable[str] = ()) -> None:
        super().__init__(message, help=help, near=near)
        self.code = code


class SiteError(FormigaError):
    """The site's runtime folder cannot be used (a second engine runs there, or it is not writable)."""


class JournalError(FormigaError):
    """The journal cannot be used: damaged, of a newer version, not a journal at all, or it cannot be written."""


class UnusableFile(FormigaError):  # noqa: N818 - it names what is wrong
    """A file named on the command line cannot be read, or the command line itself says nothing sane (exit code 2)."""
