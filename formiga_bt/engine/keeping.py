"""What the engine does when its journal cannot keep up: no new task while nothing can be written; what flies goes on."""

from typing import Final

from formiga_bt.engine import changes as ch
from formiga_bt.engine.core import Core
from formiga_bt.engine.inputs import Alarm, JournalState, Notify
from formiga_bt.errors import TaskError

JOURNAL: Final = "journal"
"""The counter that tells how the journal stands."""
LEVELS: Final = {"ok": 0, "slow": 1, "full": 2}


def note_journal(core: Core, given: JournalState) -> None:
    """Take how the journal stands now, and tell people."""
    was, now = core.state.counters.get(JOURNAL, 0), LEVELS[given.state]
    if was == now:
        return
    core.emit(ch.CounterSet(JOURNAL, now))
    why = f": {given.text}" if given.text else ""
    if given.state == "full":
        core.effect(Alarm("journal_full", f"nothing can be kept, no new task is admitted; what flies goes on{why}"))
    elif given.state == "slow":
        core.effect(Alarm("journal_slow", f"the journal is slow, orders and answers wait for it{why}"))
    else:
        core.effect(Notify(f"the journal keeps everything again{why}", (), "info"))


def refuse_if_full(core: Core) -> None:
    """Refuse a person's request while nothing can be kept.

    Raises:
        TaskError: `journal_full`.
    """
    if core.state.counters.get(JOURNAL, 0) == LEVELS["full"]:
        raise TaskError("journal_full", "the journal cannot be written, so no task is admitted; make room on its disk")
