"""What a driver knows of a journal: steps are kept, then their effects leave and callers are answered."""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, Protocol, TypeVar, runtime_checkable

from msgspec import Struct

from formiga_bt.engine.kernel.inputs import EngineStep, JournalState


class Outcome(Struct, frozen=True):
    """What became of some steps."""

    durable: bool
    """They are on disk. If not, they wait for it in memory: effects leave, but no request is admitted."""
    news: JournalState | None = None
    """How the journal stands now, if that has changed; the driver gives it to the engine."""


DURABLE = Outcome(True)


class Persist(Protocol):
    """Keeps steps."""

    def keep(self, steps: Sequence[EngineStep]) -> Outcome:
        """Keep steps that follow those of the last call; called in the driver's thread, and returns when they are durable.

        Raises:
            FormigaError: the engine must end, and the effects of these steps must not leave.
        """
        ...


@runtime_checkable
class PersistAhead(Persist, Protocol):
    """Keeps steps in three parts, so that the engine goes on while the disk is waited for: `start`, `commit`, `finish`."""

    def start(self, steps: Sequence[EngineStep]) -> bool:
        """Write steps that follow those of the last call; called in the driver's thread.

        Returns:
            Whether `commit` must be called before `finish`.

        Raises:
            FormigaError: as `keep`.
        """
        ...

    def commit(self) -> None:
        """Make durable what was started; may be called in another thread, and nothing else meanwhile.

        Raises:
            FormigaError: as `keep`.
        """
        ...

    def finish(self) -> Outcome:
        """Return what became of the steps; called in the driver's thread."""
        ...


B = TypeVar("B")


class Ahead(Generic[B]):
    """One batch whose commit is waited for in a thread of its own; made and used by a driver's thread.

    Args:
        persist: what keeps steps.
    """

    def __init__(self, persist: PersistAhead) -> None:
        self._persist = persist
        self._pool = ThreadPoolExecutor(1, "formiga-commit")
        self._batch: B | None = None
        self._commit: Future[None] | None = None

    @property
    def is_under_way(self) -> bool:
        """Return whether there is one."""
        return self._batch is not None

    @property
    def is_done(self) -> bool:
        """Return whether there is one that need not be waited for."""
        return self._batch is not None and (self._commit is None or self._commit.done())

    def begin(self, batch: B, steps: Sequence[EngineStep]) -> None:
        """Write a batch and begin to commit it; none is under way.

        Raises:
            FormigaError: as `Persist.keep`.
        """
        assert self._batch is None, "one at a time"
        if self._persist.start(steps):
            self._commit = self._pool.submit(self._persist.commit)
        self._batch = batch

    def end(self) -> tuple[B, "Outcome | BaseException"]:
        """Wait for the batch that is under way; return it and what became of it."""
        batch, commit = self._batch, self._commit
        assert batch is not None, "none is under way"
        self._batch = self._commit = None
        error = commit.exception() if commit is not None else None
        return batch, error if error is not None else self._persist.finish()

    def close(self) -> None:
        """End the thread."""
        self._pool.shutdown()
