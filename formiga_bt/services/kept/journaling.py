"""The journal of a running engine: opened before it starts, closed after it has ended. Or none.

Called by `services.host`, which hands it to the driver as what keeps steps.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.durations import DurationCounts, Durations
from formiga_bt.base.errors import JournalError
from formiga_bt.base.site_folder import COUNTERS, JOURNAL, RESERVE, UNKNOWN, SiteFolder, journal_of
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.kernel.inputs import EngineStep, JournalState
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.services.kept.bundles import Stored

if TYPE_CHECKING:
    from formiga_bt.journal.database import Durability
    from formiga_bt.journal.keep import Housekeeper
    from formiga_bt.journal.store import Journal
    from formiga_bt.journal.writer import Writer
    from formiga_bt.services.kept.resuming import Comeback

LIBRARIES: Final = ("eclipse-zenoh", "lapx", "msgspec", "numpy", "py-trees", "pyproj", "shapely", "sqlalchemy")


class JournalAt(Struct, frozen=True):
    """Which journal an engine shall keep."""

    where: str = ""
    """A path or a URL; "" = where the last engine of the site kept it, at first in the site's runtime folder."""
    durability: "Durability" = "full"


class Journaling:
    """The journal of a host.

    Args:
        folder: the runtime folder, taken.
        site: its name.
        at: which journal; None = none.
        start_anew: begin a new history; what there is of another one is set aside.
        outbox: keep the news of steps, too, for who delivers them.
        also: called with each step before it is kept; what it wants to be kept it hands to the folder.
    """

    def __init__(
        self,
        folder: SiteFolder,
        site: str,
        at: JournalAt | None,
        also: Callable[[EngineStep], None],
        *,
        start_anew: bool = False,
        outbox: bool = False,
    ) -> None:
        self._outbox = outbox
        self._folder, self._site, self._at, self._also = folder, site, at, also
        self._start_anew = start_anew
        self.aside: list[str] = []
        """Where is what this start has set aside, for people."""
        self._knows_ids = True
        self._passed_over = self._last_epoch = 0
        self.journal: Journal | None = None
        self._writer: Writer | None = None
        self._housekeeper: Housekeeper | None = None
        self._stands = self._told = JournalState("ok")

    @property
    def text(self) -> str:
        """Return where history is kept, for people."""
        if self.journal is None:
            return "none: what happens is not kept (--no-journal)"
        return f"{self.journal.where} (durability {self.journal.database.durability})"

    @property
    def word(self) -> str | None:
        """Return the path or URL of the journal, as it was given; None: there is none."""
        return self._where(self._at) if self._at is not None else None

    def _where(self, at: JournalAt) -> str:
        return at.where or journal_of(self._folder.path) or str(self._folder.path / JOURNAL)

    def open(self) -> None:
        """Open the journal, if there shall be one.

        Raises:
            JournalError: it cannot be used, or what an earlier start kept in it is gone and nobody said to begin anew.
            SiteError: what is there cannot be set aside.
        """
        if self._start_anew:
            self._begin_anew()
        if self._at is None:
            return
        from formiga_bt.journal.store import Journal  # loads SQLAlchemy: only where it is wanted

        where = self._where(self._at)
        is_known = self._folder.had_journal and not self._start_anew
        if is_known:
            self._refuse_lost(where)
        self.journal = Journal(where, self._site, durability=self._at.durability)
        if is_known and self.journal.number is None:
            self.close()
            raise JournalError(self._lost(self.journal.where, "has nothing of it"))

    def _refuse_lost(self, where: str) -> None:
        from formiga_bt.journal.database import read_url
        from formiga_bt.journal.files import lost

        url = read_url(where)
        if url.get_backend_name() == "sqlite" and (what := lost(Path(url.database or ""))):
            raise JournalError(self._lost(url.database or "", what))

    def _lost(self, where: str, what: str) -> str:
        return (
            f"the site '{self._site}' has run before, but its journal {where} {what}: "
            "its tasks, orders and lockdown would be forgotten\n"
            "  help: put it back, with its -wal, or name it: --journal FILE|URL; or begin anew: formiga up --start-anew"
        )

    def _begin_anew(self) -> None:
        self._knows_ids = not self._folder.had_journal or (self._folder.path / "marks.json").exists()
        found = [self._folder.begin_anew()]
        self.aside = [str(one) for one in found if one is not None]
        if self._at is not None:
            from formiga_bt.journal.aside import last_epoch, set_aside

            where = self._where(self._at)
            self._last_epoch = last_epoch(where, self._site)
            there = set_aside(where, self._site, self._folder.path)
            self.aside = [there, *self.aside] if there else self.aside

    def take(self) -> int:
        """Return the epoch of this start, higher than any that the folder or the journal knows.

        Raises:
            SiteError: another engine writes this journal.
            JournalError: it cannot be written.
        """
        if self.journal is None or not self._folder.had_journal:
            self._folder.note_journal(False)  # who is killed before the journal has the site has forgotten nothing
        if self._folder.lost_marks and self.journal is None:
            self._knows_ids = False
        epoch = self._folder.next_epoch()
        if self.journal is not None:
            taken = self.journal.take(max(epoch, self._last_epoch + 1))
            self._folder.keep_journal_at(self.journal.database.address)
            self._folder.note_journal(True)
            if taken > epoch:
                self._folder.raise_epoch(taken)
            epoch = taken
        if not self._knows_ids:
            self._passed_over = epoch * UNKNOWN
        return epoch

    def first_state(self, now: Micros, counters: Mapping[str, int]) -> EngineState:
        """Return the state that an engine begins with: no number and no instant comes twice."""
        seq, last = self.journal.last() if self.journal is not None else (0, 0)
        if self._passed_over:
            counters = dict.fromkeys(COUNTERS, self._passed_over)
        return EngineState(
            seq=seq, now=max(now, last + 1 if seq else 0), counters={name: n for name, n in counters.items() if n}
        )

    def find_comeback(
        self, tasks: Bundles, site: Site, catalogue: Catalogue, now: Micros, counters: Mapping[str, int]
    ) -> "Comeback | None":
        """Return what this start goes on from; None: there is no journal, or it has nothing.

        Args:
            tasks: are served; versions that run are added.
            site: of the engine.
            catalogue: of the engine.
            now: engine time that the runtime folder knows.
            counters: that it has set aside.

        Raises:
            JournalError: the journal cannot be read.
        """
        from formiga_bt.services.kept.resuming import find

        found = find(self.journal, self._folder.path, tasks, site, catalogue) if self.journal is not None else None
        if found is None:
            return None
        found.restored = self._folder.was_restored
        found.state.now = max(found.state.now, now)
        if not (found.sign.kept and self._is_exact(found.state.counters, counters)):
            for name, value in counters.items():
                found.state.counters[name] = max(found.state.counters.get(name, 0), value)
        if self._folder.lost_marks:
            for name in COUNTERS:
                found.state.counters[name] = found.state.counters.get(name, 0) + UNKNOWN
        return found

    def _is_exact(self, known: Mapping[str, int], aside: Mapping[str, int]) -> bool:
        """Return whether the journal knows every id that was used: it was never full, lost nothing, and is no older copy."""
        assert self.journal is not None
        last = self.journal.starts()[-1:]
        is_last = bool(last) and last[0].epoch == self.journal.epoch - 1
        is_near = all(known.get(name, 0) >= value - RESERVE for name, value in aside.items())
        return self._folder.was_exact and is_last and is_near

    @property
    def stands(self) -> Literal["ok", "slow", "full", "gone"]:
        """Return how the journal and the runtime folder stand, as the engine was told."""
        return self._told.state

    @property
    def written(self) -> int:
        """Return `seq` of the last step that this start has on disk; 0: none."""
        return self._writer.written if self._writer is not None else 0

    @property
    def commit_times(self) -> DurationCounts:
        """Return how long commits took."""
        return (self._writer.commit_times if self._writer is not None else Durations()).statistics()

    @property
    def is_changed(self) -> bool:
        """Return whether the journal's files are gone or back, and the engine does not know it; called from any thread."""
        return self.journal is not None and bool(self.journal.gone()) != (self._stands.state == "gone")

    def begin(self, state: Callable[[], EngineState], now: Callable[[], Micros]) -> None:
        """Note the start.

        Args:
            state: the engine's, read in the driver's thread.
            now: engine time.
        """
        self._folder.note_exact(self.journal is not None and self.journal.database.durability == "full")
        if self.journal is None:
            return
        from formiga_bt.journal.keep import Housekeeper
        from formiga_bt.journal.writer import Writer

        self._writer = Writer(
            self.journal,
            state,
            wall=lambda: time.time_ns() // 1000,
            clock=time.monotonic,
            beside=True,
            outbox=self._outbox,
        )
        self._writer.begin({name: metadata.version(name) for name in LIBRARIES}, now())
        self._housekeeper = Housekeeper(self.journal, now)
        self._housekeeper.start()

    def keep(self, steps: Sequence[EngineStep]) -> Outcome:
        """Keep steps; see `Persist.keep`."""
        self._note(steps)
        return self._with_folder(DURABLE if self._writer is None else self._writer.keep(steps))

    def start(self, steps: Sequence[EngineStep]) -> bool:
        """Write steps; see `PersistAhead.start`."""
        self._note(steps)
        return self._writer is not None and self._writer.start(steps)

    def commit(self) -> None:
        """Make them durable; see `PersistAhead.commit`."""
        if self._writer is not None:
            self._writer.commit()

    def finish(self) -> Outcome:
        """Return what became of them; see `PersistAhead.finish`."""
        return self._with_folder(DURABLE if self._writer is None else self._writer.finish())

    def _note(self, steps: Sequence[EngineStep]) -> None:
        self._folder.write_waiting()
        for step in steps:
            self._also(step)

    def _with_folder(self, kept: Outcome) -> Outcome:
        """Return what became of steps, their marks and approvals in the runtime folder included: that may be full, too."""
        self._stands = stands = kept.news or self._stands
        lack = self._folder.lack
        if not kept.durable and self._told.state not in ("full", "gone"):
            self._folder.note_exact(False)
        if lack and stands.state not in ("full", "gone"):
            stands = JournalState("full", lack)
        news = stands if stands.state != self._told.state else None
        self._told = stands
        return Outcome(kept.durable and not lack, news)

    # -- files -------------------------------------------------------------------------------------------------------
    def keep_files(self, name: str, bundle: str, file: str, texts: Mapping[str, str], *, loaded: bool = False) -> None:
        """Keep the exact files of a task, or (`SITE_FILES`) of the site and its catalogue.

        Raises:
            JournalError: they cannot be written.
        """
        if self.journal is not None and texts:
            self.journal.keep_bundle(name, bundle, file, texts, "loaded" if loaded else "base")

    def keep_loaded(self, task: Task, file: str, texts: Mapping[str, str]) -> None:
        """Keep the files of a task that was loaded into the running engine."""
        self.keep_files(task.name, task.bundle, file, texts, loaded=True)

    def keep_read(self, tasks: Mapping[str, Task], texts: Mapping[str, Mapping[str, str]]) -> None:
        """Keep the files of the tasks that were read at the start, and of the site.

        Args:
            tasks: by name.
            texts: by name of the task, or `SITE_FILES`: path -> text.
        """
        for name, files in texts.items():
            task = tasks.get(name)
            if task is not None:
                self.keep_files(name, task.bundle, task.mark.file, files)
            elif name == SITE_FILES:
                self.keep_files(name, "", list(files)[-1] if files else "", files)

    def keep_again(self, task: Task, stored: Stored) -> None:
        """Keep the files of a task that an earlier start had loaded."""
        self.keep_files(task.name, task.bundle, stored.bundle.file, stored.bundle.texts, loaded=True)

    # -- the end -------------------------------------------------------------------------------------------------------
    def end(self) -> None:
        """Note the clean end; the driver has stopped."""
        if self._housekeeper is not None:
            self._housekeeper.stop()
        if self._writer is not None:
            self._writer.end()

    def close(self) -> None:
        """Give the journal back; may be called twice."""
        if self.journal is not None:
            self.journal.close()


SITE_FILES: Final = "!site"
"""As in `journal.store`, which is not loaded without a journal."""
