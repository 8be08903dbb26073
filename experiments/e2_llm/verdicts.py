"""What an oracle says: whether a flight did what was asked, and every reason why not."""

from collections.abc import Iterable

from msgspec import Struct


class Fault(Struct, frozen=True):
    """One reason why a flight is not what was asked for."""

    code: str
    text: str


class Verdict(Struct, frozen=True):
    """The faults of a flight; none: it did what was asked."""

    faults: tuple[Fault, ...] = ()

    @property
    def ok(self) -> bool:
        """Return whether it did what was asked."""
        return not self.faults

    @property
    def codes(self) -> tuple[str, ...]:
        """Return the codes of the faults, each once."""
        return tuple(dict.fromkeys(one.code for one in self.faults))

    def __str__(self) -> str:
        return "right" if self.ok else "; ".join(f"{one.code}: {one.text}" for one in self.faults)


def together(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the faults of several flights of one task as one verdict."""
    return Verdict(tuple(fault for one in verdicts for fault in one.faults))


class Faults:
    """Gathers faults."""

    def __init__(self) -> None:
        self._found: list[Fault] = []

    def add(self, code: str, text: str) -> None:
        """Take a fault."""
        self._found.append(Fault(code, text))

    def unless(self, holds: bool, code: str, text: str) -> bool:
        """Take a fault unless something holds; return whether it holds."""
        if not holds:
            self.add(code, text)
        return holds

    def verdict(self) -> Verdict:
        """Return what was gathered."""
        return Verdict(tuple(self._found))
