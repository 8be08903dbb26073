"""Alarms of the engine's own house: told once, standing as long as they are true."""

import pytest

from formiga_bt.base.clock import OFF, SECOND, EngineClock, Micros
from formiga_bt.base.clock_sync import ClockSync
from formiga_bt.engine.kernel.inputs import Trouble
from formiga_bt.services.standing_alarms import StandingAlarms, clock_check, machine_clock_check

WALL: Micros = 1_800_000_000 * SECOND


def test_a_trouble_is_told_when_it_begins_and_when_it_is_over_and_stands_in_between() -> None:
    now: list[Trouble] = []
    told: list[list[str]] = []
    house = StandingAlarms(lambda troubles: told.append([one.subject for one in troubles]), [lambda: now, lambda: ()])
    house.look()
    house.look()
    assert (told, house.standing) == ([[]], ())  # what an earlier start left is over
    now[:] = [Trouble("unreadable", "epoch", "first"), Trouble("unreadable", "marks.json", "m")]
    house.look()
    now[0] = Trouble("unreadable", "epoch", "other words")
    house.look()
    assert told[1:] == [["epoch", "marks.json"]]
    assert [one.trouble.text for one in house.standing] == ["other words", "m"]
    del now[0]
    house.look()
    assert told[2:] == [["marks.json"]]
    assert [one.trouble.subject for one in house.standing] == ["marks.json"]


@pytest.mark.parametrize("off", [2 * OFF, -2 * OFF])
def test_a_clock_that_is_far_from_the_wall_clock_is_a_trouble_in_mode_real_only(off: Micros) -> None:
    def found(ahead: Micros, *, follows: bool) -> list[str]:
        clock = EngineClock(WALL + ahead, follows_wall=follows, passed=lambda: 0, wall=lambda: WALL)
        return [one.code for one in clock_check(clock)()]

    assert found(off, follows=True) == ["clock_off"]
    assert found(off // 4, follows=True) == found(off, follows=False) == []


def test_a_wall_clock_that_may_be_wrong_is_a_trouble_and_one_that_was_never_right_is_none() -> None:
    told: list[ClockSync | None] = [None]
    clock = EngineClock(WALL, follows_wall=True, passed=lambda: 0, wall=lambda: WALL)
    look = machine_clock_check(clock, lambda: told[0])

    def found(now: ClockSync | None) -> list[str]:
        told[0] = now
        return [one.subject for one in look()]

    assert found(None) == found(ClockSync(False, 16.0)) == []
    assert found(ClockSync(True, 2.5)) == ["machine"]
    assert found(ClockSync(True, 0.1)) == []
    assert found(ClockSync(False, 16.0)) == ["machine"], "what set it right has ended"
    simulated = EngineClock(WALL, follows_wall=False, passed=lambda: 0, wall=lambda: WALL)
    assert list(machine_clock_check(simulated, lambda: ClockSync(True, 9.0))()) == []
