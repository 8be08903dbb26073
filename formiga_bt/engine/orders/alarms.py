"""Alarms: raised by what the engine tells people, acknowledged by a person, cleared when what was wrong is over.

At the end of each step `Alarms` makes a record of each `Alarm` effect, and looks whether what an open one is about has ended.
An alarm of something that does not last is cleared by the word of who acknowledges it.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.base.severities import SEVERITIES
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.alarm_records import BREACH, NOTIFY, AlarmRecord, AlarmTurn, severity_of
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.journal_levels import JOURNAL, LEVELS
from formiga_bt.engine.kernel.overload import LATE
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import AlarmDue

MOST: Final = 500
"""So many alarms are kept; of more the oldest that is cleared goes, else one that is acknowledged, else the quietest."""
MOST_TEXT: Final = 2000
"""Letters of an alarm's text: what it says may come from an agent."""
KEPT_CLEARED: Final = 100
"""So many that are cleared are kept; the journal has the others."""


def _quarantined(agent: AgentRecord) -> bool:
    return bool(agent.quarantine)


OF_AGENT: Final[Mapping[str, Callable[[AgentRecord], bool]]] = MappingProxyType(
    {
        "agent_needs_help": _quarantined,
        "cancel_unconfirmed": _quarantined,
        "in_doubt": _quarantined,
        "double": _quarantined,
        "quarantined_airborne": _quarantined,
        "found_airborne": lambda agent: agent.landed == "airborne",
        "parked_away": lambda agent: agent.pool == "PARKED_AWAY",
        "rebooted": lambda agent: agent.rebooted,
        "not_admitted": lambda agent: bool(agent.refused),
        "taken_over": lambda agent: agent.taken,
    }
)
"""Code -> whether what it says of an agent is still so."""
OF_SITE: Final[Mapping[str, Callable[[EngineState], bool]]] = MappingProxyType(
    {
        "lockdown": lambda state: state.lockdown is not None,
        "deposed": lambda state: state.counters.get("deposed", 0) > 0,
        LATE: lambda state: state.counters.get(LATE, 0) > 0,
        "journal_slow": lambda state: state.counters.get(JOURNAL, 0) == LEVELS["slow"],
        "journal_full": lambda state: state.counters.get(JOURNAL, 0) == LEVELS["full"],
        "journal_gone": lambda state: state.counters.get(JOURNAL, 0) == LEVELS["gone"],
    }
)
"""Code -> whether what it says of the site is still so."""


def _staying(alarm: AlarmRecord) -> tuple[int, int]:
    """Return how much an alarm has a right to stay: whoever raises many quiet ones drives out no critical one."""
    return ("cleared", "acknowledged", "raised").index(alarm.state), SEVERITIES.index(alarm.severity)


class Alarms:
    """The alarms of a site. Its state is in the engine's; what is kept here is found in that again.

    Args:
        core: of the engine.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._open: dict[tuple[str, str, str, str], str] = {}
        """Key -> the open alarm."""
        self._of_agent: dict[str, set[str]] = {}
        """Agent -> its open alarms of which the end is seen."""
        self._of_site: set[str] = set()
        for alarm in core.state.alarms.values():
            self._index(alarm)

    # -- what people say ---------------------------------------------------------------------------------------------
    def acknowledge(self, given: inp.AcknowledgeAlarm) -> None:
        """Take a person's word that they take care of an alarm.

        Raises:
            TaskError: `unknown_alarm`, `already_acknowledged`, `alarm_cleared`.
        """
        alarm = self._core.state.alarms.get(given.alarm)
        if alarm is None:
            raise TaskError("unknown_alarm", f"there is no alarm '{given.alarm}' (any more)")
        if alarm.state == "cleared":
            raise TaskError("alarm_cleared", f"{alarm.id} is cleared: there is nothing to do any more")
        if alarm.state == "acknowledged":
            raise TaskError("already_acknowledged", f"{alarm.owner or 'somebody'} takes care of {alarm.id} already")
        now = self._core.now
        alarm = alarm.turned(AlarmTurn(now, "acknowledged", given.by, given.note))
        is_over = not alarm.lasts and not alarm.about
        if is_over:
            alarm = alarm.turned(AlarmTurn(now, "cleared", given.by))
        self._put(alarm, new=2 if is_over else 1)

    def on_deadline(self, due: AlarmDue) -> None:
        """Escalate an alarm that nobody has acknowledged in time."""
        alarm = self._core.state.alarms.get(due.alarm)
        if alarm is not None and alarm.state == "raised":
            self._put(alarm.turned(AlarmTurn(self._core.now, "escalated", to=due.channel)), new=1)

    def look_at_house(self, given: inp.HouseState) -> None:
        """Take what is wrong with the engine's own house now: what is new is raised, what is over is cleared."""
        stands = {(one.code, one.subject): one for one in given.troubles}
        for alarm in list(self._core.state.alarms.values()):
            if alarm.is_open and alarm.about and (alarm.code, alarm.about) not in stands:
                self._clear(alarm)
                self._core.effect(inp.NotifyPeople(f"{alarm.code} is over ({alarm.about})", (), "info"))
        for one in stands.values():
            if (one.code, "", "", one.subject) not in self._open:
                self._core.effect(inp.Alarm(one.code, one.text, about=one.subject))

    # -- the end of a step -------------------------------------------------------------------------------------------
    def end_step(self, given: inp.Input) -> None:
        """Note the alarms of this step, and which of the open ones are over."""
        core = self._core
        if core.effects:
            again = given.again if isinstance(given, inp.Resumed) else ()
            for effect in core.effects:
                if isinstance(effect, inp.Alarm):
                    if not (effect in again and self._is_known(effect)):
                        self._raise(effect)
                elif isinstance(effect, inp.NotifyPeople) and effect.severity == "alarm" and effect not in again:
                    self._raise(inp.Alarm(NOTIFY, effect.text, effect.task))
        if self._of_agent or self._of_site:
            self._look(core.changes)

    def _is_known(self, effect: inp.Alarm) -> bool:
        """Return whether an alarm that may not have left the last process has its record."""
        key = (effect.code, effect.task, effect.agent, effect.about)
        return any(alarm.key == key for alarm in self._core.state.alarms.values())

    def _look(self, changes: list[ch.Change]) -> None:
        looked: dict[str, None] = {}
        for change in changes:
            if type(change) is ch.AgentPut:
                looked.update(dict.fromkeys(sorted(self._of_agent.get(change.agent.id, ()))))
            elif self._of_site and type(change) in (ch.CounterSet, ch.LockdownPut):
                looked.update(dict.fromkeys(sorted(self._of_site)))
            elif type(change) is ch.AlarmPut:
                looked[change.alarm.id] = None
        for alarm_id in looked:
            alarm = self._core.state.alarms.get(alarm_id)
            if alarm is None or not alarm.is_open:
                continue
            lasts = self._is_so(alarm)
            if lasts and not alarm.lasts:
                self._put(replace(alarm, lasts=True))
            elif alarm.lasts and not lasts:
                self._clear(alarm)

    def _is_so(self, alarm: AlarmRecord) -> bool:
        state = self._core.state
        of_site = OF_SITE.get(alarm.code)
        if of_site is not None:
            return of_site(state)
        agent = state.agents.get(alarm.agent)
        if agent is None:
            return False
        if alarm.code.startswith(BREACH):
            return bool(agent.breach)
        of_agent = OF_AGENT.get(alarm.code)
        return of_agent is not None and of_agent(agent)

    # -- records -----------------------------------------------------------------------------------------------------
    def _raise(self, effect: inp.Alarm) -> None:
        core, now = self._core, self._core.now
        key = (effect.code, effect.task, effect.agent, effect.about)
        known = self._open.get(key)
        if known is not None:
            old = core.state.alarms[known]
            self._put(replace(old, text=effect.text[:MOST_TEXT], times=old.times + 1, at=now))
            return
        agent = core.state.agents.get(effect.agent)
        alarm = AlarmRecord(
            id=f"A{core.count('alarm')}", code=effect.code, severity=severity_of(effect.code), text=effect.text[:MOST_TEXT],
            task=effect.task, agent=effect.agent, human=agent is not None and agent.human, about=effect.about,
            raised_at=now, at=now, history=(AlarmTurn(now, "raised"),),
        )  # fmt: skip
        self._put(alarm, new=1)
        for channel in core.site.news.values():
            after = channel.unacknowledged_us
            if after is not None and channel.takes("alarms", alarm.severity, alarm.task):
                core.set_deadline(AlarmDue(alarm.id, channel.name), now + after)
        self._make_room()

    def _clear(self, alarm: AlarmRecord) -> None:
        self._put(alarm.turned(AlarmTurn(self._core.now, "cleared")), new=1)

    def _put(self, alarm: AlarmRecord, new: int = 0) -> None:
        self._core.emit(ch.AlarmPut(alarm, new))
        self._index(alarm)
        if alarm.state != "raised":
            self._forget_deadlines(alarm.id)
        if not alarm.is_open:
            self._make_room()

    def _index(self, alarm: AlarmRecord) -> None:
        watched = alarm.code in OF_AGENT or alarm.code.startswith(BREACH)
        if not alarm.is_open:
            self._forget(alarm)
            return
        self._open[alarm.key] = alarm.id
        if alarm.code in OF_SITE:
            self._of_site.add(alarm.id)
        elif watched and alarm.agent:
            self._of_agent.setdefault(alarm.agent, set()).add(alarm.id)

    def _forget(self, alarm: AlarmRecord) -> None:
        if self._open.get(alarm.key) == alarm.id:
            del self._open[alarm.key]
        self._of_site.discard(alarm.id)
        mine = self._of_agent.get(alarm.agent)
        if mine is not None:
            mine.discard(alarm.id)
            if not mine:
                del self._of_agent[alarm.agent]

    def _forget_deadlines(self, alarm_id: str) -> None:
        for name in self._core.site.news:
            self._core.clear_deadline(AlarmDue(alarm_id, name))

    def _make_room(self) -> None:
        alarms = self._core.state.alarms
        cleared = [alarm for alarm in alarms.values() if not alarm.is_open]
        for alarm in cleared[: max(0, len(cleared) - KEPT_CLEARED)]:
            self._core.emit(ch.AlarmDrop(alarm.id))
        while len(alarms) > MOST:
            oldest = min(alarms.values(), key=_staying)
            self._core.emit(ch.AlarmDrop(oldest.id))
            self._forget(oldest)
            self._forget_deadlines(oldest.id)
