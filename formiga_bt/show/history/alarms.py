"""Alarms as lists show them."""

from collections.abc import Iterable

from formiga_bt.base.severities import SEVERITIES
from formiga_bt.engine.kernel.alarm_records import AlarmRecord
from formiga_bt.show.facts.alarms import AlarmFact, AlarmTurnFact

STATES = ("raised", "acknowledged", "cleared")


def in_order(alarms: Iterable[AlarmRecord]) -> list[AlarmRecord]:
    """Return alarms, those first that need somebody most: nobody's, then the loudest, then the newest."""
    return sorted(
        alarms, key=lambda one: (STATES.index(one.state), -SEVERITIES.index(one.severity), -one.at, -one.raised_at)
    )


def alarm_fact(alarm: AlarmRecord) -> AlarmFact:
    """Return an alarm."""
    return AlarmFact(
        id=alarm.id, code=alarm.code, severity=alarm.severity, state=alarm.state, text=alarm.text, task=alarm.task,
        agent=alarm.agent, about=alarm.about, owner=alarm.owner, times=alarm.times, lasts=alarm.lasts,
        raised_at=alarm.raised_at, at=alarm.at,
        history=tuple(
            AlarmTurnFact(at=turn.at, what=turn.what, by=turn.by, note=turn.note, to=turn.to) for turn in alarm.history
        ),
    )  # fmt: skip
