"""An engine that comes late: deadlines are given after their time because there is more to do than the computer can.

The driver tells when that begins and when it has caught up. Meanwhile inputs bear the time of the earliest deadline that was
not given, so engine time stands back and then makes a leap: no machine is to blame for what passed in it.
"""

from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm, Behind, NotifyPeople
from formiga_bt.engine.kernel.pace import throttled
from formiga_bt.engine.kernel.state import EngineState

LATE: Final = "behind"
"""The counter that tells whether the engine comes late now."""
WORST: Final = "behind_worst"
"""By how much it was late at most, the last time."""
UNTIL: Final = "behind_until"
"""When it had caught up, the last time."""


def note_behind(core: Core, given: Behind) -> None:
    """Take that the engine comes late, or has caught up, and tell people."""
    state = core.state
    if given.late_us > 0 and not state.counters.get(LATE):
        core.emit(ch.CounterSet(LATE, 1))
        hasty = [task for task in core.open if throttled(state, core.task(task), core.now) is not None]
        names = f"; in haste: {', '.join(hasty[:5])}" if hasty else ""
        text = (
            f"the engine comes {given.late_us / SECOND:.1f} s late, there is more to do than this computer can{names}"
        )
        core.effect(Alarm(LATE, text))
    elif given.late_us <= 0 and state.counters.get(LATE):
        for name, value in ((LATE, 0), (WORST, given.worst_us), (UNTIL, core.now)):
            core.emit(ch.CounterSet(name, value))
        core.effect(NotifyPeople(f"the engine keeps up again; it was {given.worst_us / SECOND:.1f} s late", (), "info"))


def lag_since(state: EngineState, begin: Micros) -> Micros | None:
    """Return how much of the time since an instant may be the engine's own delay; None: it comes late now."""
    counters = state.counters
    if counters.get(LATE):
        return None
    return counters.get(WORST, 0) if counters.get(UNTIL, 0) > begin else 0
