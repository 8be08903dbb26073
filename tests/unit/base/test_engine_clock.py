"""Engine time of a running process: at a speed, or on its way to the wall clock; never back, never a jump."""

import pytest

from formiga_bt.base.clock import MOST_SLEW, SECOND, EngineClock, Micros

HOUR = 3600 * SECOND


class Hands:
    """A clock that passes and a wall clock, both turned by hand."""

    def __init__(self, wall: Micros = 1_000 * HOUR) -> None:
        self.passed, self.wall = 0, wall

    def go(self, span: Micros) -> None:
        self.passed += span
        self.wall += span

    def clock(self, start: Micros, speed: float = 1.0, *, follows_wall: bool = True) -> EngineClock:
        return EngineClock(start, speed, follows_wall=follows_wall, passed=lambda: self.passed, wall=lambda: self.wall)


def lived(hands: Hands, clock: EngineClock, seconds: int) -> list[Micros]:
    """Let so many seconds pass, steered each; return engine time after each."""
    found = []
    for _ in range(seconds):
        clock.steer()
        hands.go(SECOND)
        found.append(clock.now())
    return found


def test_a_simulation_goes_at_its_speed_whatever_is_done_to_the_wall_clock() -> None:
    hands = Hands()
    clock = hands.clock(hands.wall, 5.0, follows_wall=False)
    hands.go(10 * SECOND)
    hands.wall -= HOUR
    clock.steer()
    assert clock.now() == 1_000 * HOUR + 50 * SECOND
    clock.set_rate(1.0)
    hands.go(SECOND)
    assert (clock.now(), clock.rate) == (1_000 * HOUR + 51 * SECOND, 1.0)
    assert clock.ahead_us == 40 * SECOND + HOUR


@pytest.mark.parametrize("off", [4 * 60 * SECOND, -4 * 60 * SECOND, HOUR, -HOUR, 300_000, -300_000])
def test_the_wall_clock_is_approached_at_a_bounded_rate_and_never_by_a_jump(off: Micros) -> None:
    hands = Hands()
    clock = hands.clock(hands.wall + off)
    before, gaps = clock.now(), []
    for now in lived(hands, clock, 900):
        assert (1 - MOST_SLEW) * SECOND - 1 <= now - before <= (1 + MOST_SLEW) * SECOND + 1
        gaps.append(abs(clock.ahead_us))
        before = now
    assert gaps == sorted(gaps, reverse=True), "ever nearer, and not past it"
    assert gaps[-1] < max(1_000, abs(off) - 890 * MOST_SLEW * SECOND)


@pytest.mark.parametrize("step", [40 * SECOND, -40 * SECOND, -24 * HOUR])
def test_a_wall_clock_that_is_set_meanwhile_is_followed_without_going_back(step: Micros) -> None:
    hands = Hands()
    clock = hands.clock(hands.wall)
    lived(hands, clock, 10)
    before, off = clock.now(), clock.ahead_us
    assert abs(off) <= 1
    hands.wall += step
    assert abs(clock.ahead_us + step) <= 1
    for now in lived(hands, clock, 60):
        assert now > before
        before = now
    assert abs(clock.ahead_us) == pytest.approx(abs(step) - 60 * MOST_SLEW * SECOND, abs=100)


def test_the_sleep_of_a_suspended_machine_counts_where_the_wall_clock_is_followed() -> None:
    """CLOCK_BOOTTIME goes on while the machine sleeps, CLOCK_MONOTONIC does not: no difference is left to make up."""
    hands = Hands()
    clock = hands.clock(hands.wall)
    hands.go(2 * HOUR)
    clock.steer()
    assert (clock.ahead_us, clock.rate) == (0, 1.0)
