"""What a driver knows of a journal: steps are kept, then their effects leave and callers are answered."""

from collections.abc import Sequence
from typing import Protocol

from msgspec import Struct

from formiga_bt.engine.inputs import JournalState, Step


class Outcome(Struct, frozen=True):
    """What became of some steps."""

    durable: bool
    """They are on disk. If not, they wait for it in memory: effects leave, but no request is admitted."""
    news: JournalState | None = None
    """How the journal stands now, if that has changed; the driver gives it to the engine."""


DURABLE = Outcome(True)


class Persist(Protocol):
    """Keeps steps."""

    def keep(self, steps: Sequence[Step]) -> Outcome:
        """Keep steps that follow those of the last call; called in the driver's thread, and returns when they are durable.

        Raises:
            FormigaError: the engine must end, and the effects of these steps must not leave.
        """
        ...
