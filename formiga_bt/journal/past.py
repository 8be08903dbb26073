"""Any moment of a site's past, from its journal: the state, and the blackboard that shows it."""

from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.records import holder_of
from formiga_bt.engine.kernel.state import EngineState, apply, board_of
from formiga_bt.journal.reading import Readable
from formiga_bt.journal.thin import lay_over
from formiga_bt.nodes.blackboard import Blackboard


class Past:
    """Reads a journal, also while an engine writes it.

    Args:
        journal: of the site.
    """

    def __init__(self, journal: Readable) -> None:
        self.journal = journal

    def state(self, at: Micros | None = None) -> EngineState:
        """Return the state as it stood at a moment, or (None) after the last step.

        Steps at that very moment count. Positions and charge come from the newest way point. Explanations are those of tasks
        that had not ended.

        Raises:
            JournalError: it was not written yet then, is no longer kept, or could not be written.
        """
        if at is not None:
            self._refuse_gap(at)
        state = self.journal.snapshot_at(at)
        if state is None:
            raise JournalError(self._nothing(at))
        begun = state.seq
        put: dict[str, int] = {}
        for kept in self.journal.read(state.seq, until=at):
            follow(state, kept.step)
            for change in kept.step.changes:
                if type(change) is ch.AgentPut:
                    put[change.agent.id] = kept.seq
        lay_over(state, self.journal.points_at(state.agents, begun, at), put)
        return without_ended(state)

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


def follow(state: EngineState, step: EngineStep) -> None:
    """Bring a state that nobody watches from before a step to after it."""
    state.seq, state.now = step.seq, step.at
    for change in step.changes:
        if type(change) is ch.AgentPut:
            state.agents[change.agent.id] = change.agent  # most changes are of this kind, and no blackboard shows it
        else:
            apply(state, _NOBODY, change)


def without_ended(state: EngineState) -> EngineState:
    """Return a state without the explanations of tasks that have ended: thousands of them, and the steps tell each."""
    done = {task.id for task in state.tasks.values() if task.section == "done"}
    kept = {of: why for of, why in state.explanations.items() if holder_of(of) not in done}
    return replace(state, explanations=kept) if len(kept) < len(state.explanations) else state


class _NoBoard(Blackboard):
    """While steps are folded nobody reads the blackboard."""

    def put(self, key: str, value: Any) -> bool:  # noqa: ARG002
        return False

    def touch(self, key: str) -> None:
        pass

    def drop(self, key: str) -> None:
        pass


_NOBODY: Final = _NoBoard()
