"""Alarms of the engine's own house: told once, standing as long as they are true."""

import pytest

from formiga_bt.base.clock import OFF, SECOND, EngineClock, Micros
from formiga_bt.engine.kernel.inputs import Trouble
from formiga_bt.services.standing_alarms import StandingAlarms, clock_check

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
