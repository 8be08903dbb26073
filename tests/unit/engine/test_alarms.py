"""Alarms: raised once, acknowledged by a person, cleared when what is wrong is over, bounded, and there after a restart."""

from pathlib import Path

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.alarm_records import CRITICAL, TRANSITIONS, WARNING, AlarmRecord, severity_of
from formiga_bt.engine.kernel.inputs import (
    AcknowledgeAlarm,
    Alarm,
    HouseState,
    JournalState,
    LockdownOrder,
    Resumed,
    Trouble,
)
from formiga_bt.engine.orders.alarms import KEPT_CLEARED, MOST, OF_AGENT, OF_SITE
from tests.reloading import reloaded
from tests.unit.engine.ruled import SOS, Ruled

CRY = """\
formiga: 1
task: Cry
agents: {watcher: {type: watcher}}
steps:
  - notify: the bridge is down
    to: [watcher]
    severity: alarm
"""


def known(bench: Ruled, code: str) -> AlarmRecord:
    """Return the newest alarm of a code."""
    return [one for one in bench.engine.state.alarms.values() if one.code == code][-1]


def turns(alarm: AlarmRecord) -> list[tuple[str, str]]:
    return [(turn.what, turn.by) for turn in alarm.history]


def test_what_lasts_is_cleared_when_it_is_over_whoever_acknowledged_it(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("hold", by="ann"))
    alarm = known(bench, "lockdown")
    assert (alarm.id, alarm.state, alarm.severity, alarm.lasts) == ("A1", "raised", "critical", True)

    bench.ask(AcknowledgeAlarm("A1", by="bob", note="the mast fell"))
    alarm = known(bench, "lockdown")
    assert (alarm.state, alarm.owner, alarm.history[-1].note) == ("acknowledged", "bob", "the mast fell")

    bench.ask(LockdownOrder("release", by="ann"))
    assert turns(known(bench, "lockdown")) == [("raised", ""), ("acknowledged", "bob"), ("cleared", "")]
    bench.ask(LockdownOrder("hold", by="ann"))
    assert known(bench, "lockdown").id == "A2"
    bench.check()


def test_what_does_not_last_is_cleared_by_the_word_of_who_takes_care(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS, tasks=(CRY, *_HELP))
    task = bench.submit("Cry")
    bench.run_until_ended(task)
    alarm = known(bench, "notify")
    assert (alarm.task, alarm.state, alarm.lasts, alarm.severity) == (task, "raised", False, "critical")

    bench.ask(AcknowledgeAlarm(alarm.id, by="ann"))
    assert known(bench, "notify").state == "cleared"
    assert known(bench, "notify").owner == "ann"
    bench.check()


def test_the_same_of_the_same_subject_only_counts_up_while_it_is_open(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("hold", by="ann"))
    for _ in range(3):
        bench.press()
    waits = known(bench, "rule_waits")
    assert (waits.times, waits.agent, waits.human) == (3, "picker_1", True)
    assert [one.code for one in bench.engine.state.alarms.values()] == ["lockdown", "rule_waits"]


def test_a_word_on_what_is_no_open_alarm_is_refused(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("hold", by="ann"))
    bench.ask(AcknowledgeAlarm("A1", by="ann"))

    def refused(alarm: str) -> str:
        with pytest.raises(TaskError) as error:
            bench.ask(AcknowledgeAlarm(alarm, by="bob"))
        return error.value.code

    assert refused("A9") == "unknown_alarm"
    assert refused("A1") == "already_acknowledged"
    assert known(bench, "lockdown").owner == "ann"
    bench.ask(LockdownOrder("release", by="ann"))
    assert refused("A1") == "alarm_cleared"


def test_an_alarm_can_be_acknowledged_while_nothing_can_be_kept_and_is_cleared_when_it_can(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.driver.feed(JournalState("full", "no room"))
    bench.ask(AcknowledgeAlarm("A1", by="ann"))
    bench.driver.feed(JournalState("ok"))
    assert known(bench, "journal_full").state == "cleared"


def test_the_house_is_told_whole_so_that_what_an_earlier_start_left_is_over(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    clock, file = Trouble("clock_off", "clock", "it is late"), Trouble("set_aside", "marks.json", "unreadable")
    bench.driver.feed(HouseState((clock, file)))
    bench.driver.feed(HouseState((clock, file)))
    assert [(one.code, one.about, one.times) for one in bench.engine.state.alarms.values()] == [
        ("clock_off", "clock", 1), ("set_aside", "marks.json", 1),
    ]  # fmt: skip
    bench.ask(AcknowledgeAlarm(known(bench, "clock_off").id, by="ann"))
    assert known(bench, "clock_off").state == "acknowledged"  # it lasts, as its house says
    bench.driver.feed(HouseState((file,)))
    assert known(bench, "clock_off").state == "cleared"
    assert known(bench, "set_aside").state == "raised"
    bench.check()


def test_an_engine_that_goes_on_knows_its_alarms_and_raises_none_twice(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("hold", by="ann"))
    bench.press()
    again = Ruled(tmp_path, SOS)
    again.engine.core.state.alarms.update(reloaded(bench.engine.state).alarms)
    again.engine.core.state.counters["alarm"] = 2
    again.engine.alarms.__init__(again.engine.core)  # type: ignore[misc]  # as at a start that goes on
    sent = tuple(effect for step in bench.steps for effect in step.effects if isinstance(effect, Alarm))
    assert len(sent) == 2
    again.engine.core.begin(again.engine.core.now)
    for effect in sent:
        again.engine.core.effect(effect)
    again.engine.alarms.end_step(Resumed(epoch=2, at=0, since=0, wall=0, again=sent))
    assert again.engine.state.alarms == reloaded(bench.engine.state).alarms


def test_alarms_are_bounded_and_those_that_nobody_saw_stay_longest(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    first = tuple(Trouble("set_aside", f"file {n}", "unreadable") for n in range(KEPT_CLEARED + 20))
    bench.driver.feed(HouseState(first))
    bench.driver.feed(HouseState(()))
    assert len(bench.engine.state.alarms) == KEPT_CLEARED
    bench.ask(LockdownOrder("hold", by="ann"))
    flood = tuple(Trouble("set_aside", f"other {n}", "unreadable") for n in range(MOST + 50))
    bench.driver.feed(HouseState(flood))
    kept = bench.engine.state.alarms
    assert len(kept) == MOST
    assert {one.state for one in kept.values()} == {"raised"}
    assert known(bench, "lockdown").state == "raised"  # what is critical is not driven out
    bench.check()


def test_no_alarm_comes_back_from_cleared() -> None:
    assert TRANSITIONS["cleared"] == frozenset()
    assert {state for after in TRANSITIONS.values() for state in after} == {"acknowledged", "cleared"}


def test_severities_are_one_of_each_code() -> None:
    assert frozenset() == CRITICAL & WARNING
    assert severity_of("envelope.reserve") == "critical"
    assert severity_of("rule_waits") == "alarm"
    assert not set(OF_AGENT) & set(OF_SITE)


_HELP = ("formiga: 1\ntask: Help\nagents: {watcher: {type: watcher}}\nparams: {who: {type: agent, of: [picker, drone]}, "
         "spot: {type: place, optional: true}}\nsteps: [{wait: 1 s}]\n",)  # fmt: skip
