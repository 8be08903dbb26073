"""The engine comes late: an alarm once, and no machine is to blame for it."""

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.inputs import Alarm, Behind, EngineStep, NotifyPeople
from formiga_bt.engine.kernel.overload import lag_since
from tests.unit.engine.conftest import Make

WAITS = "steps:\n  - wait: 1 h\n"


def codes(step: EngineStep) -> list[str]:
    return [effect.code for effect in step.effects if isinstance(effect, Alarm)]


def test_that_it_comes_late_is_an_alarm_once_and_ends_when_it_has_caught_up(make: Make) -> None:
    yard = make(WAITS)
    yard.start()
    yard.run_for(1)
    feed = yard.driver.feed

    assert codes(feed(Behind(3 * SECOND))) == ["behind"]
    assert codes(feed(Behind(4 * SECOND))) == []
    assert lag_since(yard.engine.state, yard.now) is None
    yard.run_for(5)
    ended = feed(Behind(0, 8 * SECOND))
    assert [e.severity for e in ended.effects if isinstance(e, NotifyPeople)] == ["info"]
    assert feed(Behind(0, 8 * SECOND)).effects == ()


def test_what_began_before_it_caught_up_has_so_much_more_time(make: Make) -> None:
    yard = make(WAITS)
    yard.run_for(1)
    begin = yard.now
    assert lag_since(yard.engine.state, begin) == 0
    yard.driver.feed(Behind(3 * SECOND))
    yard.run_for(5)
    yard.driver.feed(Behind(0, 8 * SECOND))

    assert lag_since(yard.engine.state, begin) == 8 * SECOND
    yard.run_for(1)
    assert lag_since(yard.engine.state, yard.now) == 0


def test_a_task_in_haste_is_named(make: Make) -> None:
    yard = make("steps:\n  - parallel:\n" + "      - {repeat: 5 min, steps: [{wait: 1 ms}]}\n" * 30)
    task = yard.start()
    yard.run_for(3)
    (alarm,) = (e for e in yard.driver.feed(Behind(3 * SECOND)).effects if isinstance(e, Alarm))
    assert task in alarm.text
