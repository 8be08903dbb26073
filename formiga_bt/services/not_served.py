"""`NotServed`: a task file that an engine does not serve, and why. `formiga up` finds them, whoever asks for one is told."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NotServed:
    """A file that the start of an engine passed over."""

    why: str
    """Its first error and where that is."""
    command: str = ""
    """Tells all its errors."""
    names: tuple[str, ...] = ()
    """Of the task that it holds, the aliases too, as far as they can be read; of none, if another file has them."""
    load: str = ""
    """The command that has the engine read it again, or empty."""

    @property
    def text(self) -> str:
        """Return why it is not served, and the command that tells more."""
        return "; ".join(part for part in (self.why, self.command) if part)

    @property
    def hint(self) -> str:
        """Return what helps."""
        mended = f"; when it is mended: {self.load}" if self.load else ""
        return f"{self.command} tells all{mended}"


def of_name(refused: Iterable[NotServed], name: str) -> NotServed | None:
    """Return the first file that holds the task of this name, or None."""
    return next((one for one in refused if name in one.names), None)
