"""Any moment of a site's past, from its journal: the state, and the blackboard that shows it."""

from typing import Any

from formiga_bt.blackboard import Blackboard
from formiga_bt.clock import Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.state import EngineState, board_of, fold
from formiga_bt.errors import JournalError
from formiga_bt.journal.reading import Readable
from formiga_bt.journal.thin import lay_over


class Past:
    """Reads a journal, also while an engine writes it.

    Args:
        journal: of the site.
    """

    def __init__(self, journal: Readable) -> None:
        self.journal = journal

    def state(self, at: Micros | None = None) -> EngineState:
        """Return the state as it stood at a moment, or (None) after the last step.

        Steps at that very moment count. Positions and charge come from the newest way point.

        Raises:
            JournalError: it was not written yet then, is no longer kept, or could not be written.
        """
        if at is not None:
            self._refuse_gap(at)
        state = self.journal.snapshot_at(at)
        if state is None:
            raise JournalError(self._nothing(at))
        begun = state.seq
        board = _NoBoard()
        put: dict[str, int] = {}
        for kept in self.journal.read(state.seq, until=at):
            fold(state, board, kept.step)
            for change in kept.step.changes:
                if isinstance(change, ch.AgentPut):
                    put[change.agent.id] = kept.seq
        lay_over(state, self.journal.points_at(state.agents, begun, at), put)
        return state

    def board(self, at: Micros | None = None) -> Blackboard:
        """Return the blackboard as it stood at a moment; see `state`."""
        return board_of(self.state(at))

    def first(self) -> Micros | None:
        """Return the earliest moment that can be looked at; None: there is none."""
        return self.journal.first_snapshot_at()

    def _refuse_gap(self, at: Micros) -> None:
        for gap in self.journal.gaps():
            if gap.at <= at < gap.to_at:
                raise JournalError(
                    f"the journal {self.journal.where} has nothing from {gap.at} to {gap.to_at} us: {gap.why}"
                )

    def _nothing(self, at: Micros | None) -> str:
        first = self.first()
        if first is None:
            return f"the journal {self.journal.where} has nothing of the site '{self.journal.site}'"
        return (
            f"the journal {self.journal.where} has nothing of the site '{self.journal.site}' from {at} us\n"
            f"  help: its earliest moment is {first} us of engine time"
        )


class _NoBoard(Blackboard):
    """While steps are folded nobody reads the blackboard."""

    def put(self, key: str, value: Any) -> bool:  # noqa: ARG002
        return False

    def touch(self, key: str) -> None:
        pass

    def drop(self, key: str) -> None:
        pass
