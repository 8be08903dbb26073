"""Which process of an agent is heard: late words of a former one, two at once, and statuses that do not count up."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import AgentStatusInput, Alarm, Operator
from formiga_bt.rehearsal.testing import ScriptedAgent, effects
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard

STAY = CART + "steps: [{wait: 10 min}]"


def told(yard: Yard, code: str) -> list[str]:
    """Return the texts of the alarms of a code."""
    return [alarm.text for alarm in effects(yard, Alarm) if alarm.code == code]


class Other:
    """A second process that says it is an agent, each half second for as long as it runs."""

    def __init__(self, yard: Yard, agent: ScriptedAgent, boot: str = "other", **fields: object) -> None:
        self.runs, self._seq = True, 0
        self._yard, self._agent, self._fields = yard, agent, {"boot_id": boot, **fields}
        self._speak()

    def _speak(self) -> None:
        if self.runs:
            self._seq += 1
            self._agent.tell(seq=self._seq, stamp=self._yard.now, **self._fields)
            self._yard.scheduler.call_at(self._yard.now + SECOND // 2, self._speak)


def test_of_two_processes_that_are_one_machine_neither_gets_work_until_one_is_silent(
    make: Make, wording: Wording
) -> None:
    yard = make(CART + "steps: [{do: cart.Home}]")
    task = yard.start()
    other = Other(yard, yard.cart, landed="airborne")
    yard.run_for(20)

    found = yard.record("c1")
    assert (found.pool, found.quarantine, found.task) == ("QUARANTINED", "double", "")
    assert yard.task(task).status == "FAILED"
    assert list(yard.engine.state.tasks) == [task]  # nobody is brought home meanwhile
    (text,) = told(yard, "double")
    wording(text)
    assert not told(yard, "found_airborne")
    with pytest.raises(TaskError) as refused:
        yard.ask(Operator("clear", "c1"))
    wording(refused.value)

    other.runs = False
    yard.run_for(4)
    assert yard.record("c1").quarantine == "double"
    yard.run_for(8)
    assert (yard.record("c1").pool, yard.record("c1").boot_id) == ("STANDBY", "c1-1")


def test_two_that_are_announced_in_turn_are_two(make: Make) -> None:
    """A wire that asks for the card of who speaks hears now the one's, now the other's."""
    yard = make(STAY)
    yard.run_for(3)
    mine = yard.cart.side.card
    for turn in range(12):
        yard.cart.link.publish_card(replace(mine, boot_id="other") if turn % 2 else mine)
        yard.run_for(0.5)
    assert (yard.record("c1").quarantine, len(told(yard, "double"))) == ("double", 1)

    yard.cart.link.publish_card(mine)
    yard.run_for(12)
    assert yard.record("c1").pool == "STANDBY"


def test_it_is_told_again_when_it_happens_again(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    for _ in range(2):
        other = Other(yard, yard.cart)
        yard.run_for(15)
        assert yard.record("c1").quarantine == "double"
        other.runs = False
        yard.run_for(15)
        assert yard.record("c1").pool == "STANDBY"

    assert len(told(yard, "double")) == 2


def test_the_one_that_goes_on_is_heard_though_it_was_there_first(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.silent = True
    Other(yard, yard.cart, "first")
    yard.run_for(3)
    yard.cart.boot()
    yard.cart.silent = False
    yard.run_for(10)
    assert (yard.record("c1").quarantine, yard.record("c1").boot_id) == ("double", "c1-2")

    yard.cart.silent = True
    ended = yard.now
    assert yard.run_until(lambda: yard.record("c1").boot_id == "first", 10)
    assert 2 * SECOND < yard.now - ended < 5 * SECOND
    assert yard.run_until(lambda: yard.record("c1").pool == "STANDBY", 10)


def test_a_person_who_is_there_twice_is_told_of_only(make: Make, wording: Wording) -> None:
    yard = make(STAY)
    yard.run_for(3)
    Other(yard, yard.ann)
    yard.run_for(20)

    assert yard.record("ann").pool == "STANDBY"
    (text,) = told(yard, "double")
    wording(text)


def test_a_straggler_is_no_second_process(make: Make) -> None:
    yard = make(STAY)
    task = yard.start()
    yard.run_for(3)
    yard.cart.tell(boot_id="other", seq=1, stamp=yard.now)
    yard.run_for(10)

    assert (yard.record("c1").boot_id, yard.record("c1").task) == ("c1-1", task)
    assert not told(yard, "double")


def test_a_new_process_far_ahead_of_the_engines_clock_is_not_believed(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.tell(boot_id="other", seq=1, stamp=yard.now + 2 * 3600 * SECOND)
    yard.run_for(0.1)
    assert (yard.record("c1").boot_id, yard.record("c1").bad) == ("c1-1", 1)

    yard.run_for(2)
    assert yard.now - yard.record("c1").heard_at <= SECOND


def test_a_machine_that_was_far_ahead_itself_may_start_anew(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.tell(stamp=yard.now + 2 * 3600 * SECOND)
    yard.cart.silent = True
    yard.run_for(1)
    yard.cart.tell(boot_id="c1-2", seq=1, stamp=yard.now)
    yard.run_for(0.1)

    assert yard.record("c1").boot_id == "c1-2"


def test_statuses_that_do_not_count_up_are_told(make: Make, wording: Wording) -> None:
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.silent = True
    for _ in range(5):
        yard.cart.tell(seq=1, stamp=yard.now)
        yard.run_for(0.5)

    assert (yard.record("c1").pool, yard.record("c1").quarantine) == ("QUARANTINED", "bad_status")
    (text,) = told(yard, "bad_status")
    wording(text)


def test_a_machine_whose_count_was_led_far_ahead_is_heard_again(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.tell(seq=2**60, stamp=yard.now)
    yard.run_for(20)

    assert yard.record("c1").pool == "STANDBY"
    assert yard.now - yard.record("c1").heard_at <= SECOND
    assert len(told(yard, "bad_status")) == 1


def test_two_processes_of_one_boot_id_are_two_at_once(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home}]")
    task = yard.start()
    yard.run_for(3)
    other = Other(yard, yard.cart, yard.record("c1").boot_id)
    yard.run_for(2.5)

    assert (yard.record("c1").quarantine, yard.record("c1").task) == ("double", "")
    assert len(told(yard, "double")) == 1
    yard.run_for(20)
    assert yard.task(task).status == "FAILED"

    other.runs = False
    yard.run_for(12)
    assert yard.record("c1").pool == "STANDBY"


def test_a_stamp_far_ahead_is_a_bad_status_and_hides_nothing(make: Make) -> None:
    yard = make(STAY)
    yard.run_for(3)
    before = yard.record("c1")
    yard.cart.tell(stamp=yard.now + 700 * SECOND, battery=3.0)
    yard.run_for(0.1)

    after = yard.record("c1")
    assert (after.bad, after.battery, after.seq) == (before.bad + 1, before.battery, before.seq)
    yard.run_for(2)
    assert (yard.record("c1").bad, yard.record("c1").liveness) == (0, "ALIVE")


def test_a_stamp_a_little_ahead_does_not_make_the_next_way_a_jump(make: Make) -> None:
    """Agents of an engine that ran at 20 times real time are ahead for a while; 60 m in 5 s are no jump for 10 m/s."""
    yard = make(STAY)
    yard.run_for(3)
    yard.cart.tell(stamp=yard.now + 500 * SECOND)
    yard.cart.silent = True
    yard.run_for(5)
    at = yard.record("c1").position
    assert at is not None
    yard.cart.tell(stamp=yard.now, seq=yard.record("c1").seq + 1, position=replace(at, east_m=at.east_m + 60.0))
    yard.run_for(0.1)

    found = yard.record("c1").position
    assert found is not None
    assert found.east_m == at.east_m + 60.0


def test_stamps_are_judged_by_the_clock_at_arrival_not_by_a_late_deadline(make: Make) -> None:
    """Under overload an input bears the time of the earliest deadline not yet given."""
    yard = make(STAY)
    yard.run_for(3)
    status = replace(yard.cart.side.status, seq=1000, stamp=yard.now + 3600 * SECOND)
    yard.driver.feed(AgentStatusInput(status, yard.now, clock=yard.now + 3600 * SECOND))
    assert (yard.record("c1").seq, yard.record("c1").bad) == (1000, 0)
