"""What the engine does when its journal cannot keep up: no new task while nothing can be written; what flies goes on."""

from typing import Final

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import (
    AddAgent,
    Alarm,
    Approve,
    Assign,
    Duty,
    Input,
    InService,
    JournalState,
    Learn,
    LockdownOrder,
    NotifyPeople,
    OpenRegion,
    Operator,
    Prioritize,
    RuleOrder,
    Serve,
    Submit,
    Unassign,
)
from formiga_bt.engine.kernel.journal_levels import JOURNAL, LEVELS

LACKS: Final = {
    LEVELS["full"]: ("journal_full", "the journal cannot be written", "make room on its disk"),
    LEVELS["gone"]: (
        "journal_gone",
        "the journal's files were moved, removed or replaced",
        "put them back, or end the engine (formiga down) and start it again",
    ),
}
"""Level at which nothing can be kept -> code, what is wrong, and what to do."""


def note_journal(core: Core, given: JournalState) -> None:
    """Take how the journal stands now, and tell people."""
    was, now = core.state.counters.get(JOURNAL, 0), LEVELS[given.state]
    if was == now:
        return
    core.emit(ch.CounterSet(JOURNAL, now))
    why = f": {given.text}" if given.text else ""
    if given.state == "gone":
        core.effect(Alarm("journal_gone", f"nothing can be kept, no new task is admitted; what flies goes on{why}"))
    elif given.state == "full":
        core.effect(Alarm("journal_full", f"nothing can be kept, no new task is admitted; what flies goes on{why}"))
    elif given.state == "slow":
        core.effect(Alarm("journal_slow", f"the journal is slow, orders and answers wait for it{why}"))
    else:
        core.effect(NotifyPeople(f"the journal keeps everything again{why}", (), "info"))


def begins_something(given: Input) -> bool:
    """Return whether an input of a person begins something new, or lets more be begun: it is refused while nothing is kept.

    All others act also then: they stop what is under way, or let it come to its end.
    """
    match given:
        case (
            Submit()
            | Serve()
            | AddAgent()
            | Learn()
            | Assign()
            | Unassign()
            | Prioritize()
            | OpenRegion()
            | InService(reason="")
            | RuleOrder(do="start")
            | Operator("restart")
            | LockdownOrder("release")
        ):
            return True
        case Approve(revoke=revoke):
            return not revoke
        case Duty(on=on):
            return on
        case _:
            return False


def refuse_if_full(core: Core, given: Input) -> None:
    """Refuse what would begin something while nothing can be kept.

    Raises:
        TaskError: `journal_full`, `journal_gone`.
    """
    lack = LACKS.get(core.state.counters.get(JOURNAL, 0))
    if lack is not None and begins_something(given):
        code, why, remedy = lack
        what = "no task is admitted" if isinstance(given, Submit) else "nothing new is begun or allowed"
        raise TaskError(code, f"{why}, so {what}; {remedy}")
