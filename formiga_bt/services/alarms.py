"""Alarms for callers: the list, and a person's word that they take care of one."""

from collections.abc import Callable

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.inputs import AcknowledgeAlarm, Input
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import AlarmList, OrderDone
from formiga_bt.show.history.alarms import alarm_fact, in_order


class AlarmDesk:
    """What people ask of alarms, and say to them.

    Args:
        ask: hands an input to the engine and returns its reply; raises `Refused`.
        view: the copy of the engine's state.
        now: the engine time.
    """

    def __init__(self, ask: Callable[[Input], Accepted | Done], view: EngineView, now: Callable[[], Micros]) -> None:
        self._ask = ask
        self._view = view
        self._now = now

    def all(self, *, cleared: bool = False) -> AlarmList:
        """Return the open alarms; with `cleared` also the newest of those that are over."""
        with self._view.reading() as state:
            known = [one for one in state.alarms.values() if cleared or one.is_open]
            total = sum(one.is_open for one in known)
            return AlarmList(self._now(), tuple(map(alarm_fact, in_order(known))), total)

    def acknowledge(self, alarm: str, by: str = "", note: str = "") -> OrderDone:
        """Take a person's word that they take care of an alarm; return what happened.

        Raises:
            Refused: `unknown_alarm`, `already_acknowledged`, `alarm_cleared`.
        """
        reply = self._ask(AcknowledgeAlarm(alarm.upper(), by, note))
        self._view.catch_up()
        with self._view.reading() as state:
            record = state.alarms.get(alarm.upper())
        over = record is None or not record.is_open
        then = "and cleared: nothing of it lasts" if over else "it is cleared when what is wrong is over"
        return OrderDone(with_keeping(f"{alarm.upper()} is acknowledged by {by or 'you'}; {then}", reply))
