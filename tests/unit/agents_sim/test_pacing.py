"""Engine time of a process: wall time x speed, small corrections, jumps that take timers along."""

from formiga_bt.agent.pacing import PacedScheduler
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.transport.messages import ClockBeat


class Wall:
    def __init__(self) -> None:
        self.us: Micros = 0

    def __call__(self) -> Micros:
        return self.us


def beat(engine_s: float, speed: float, number: int = 1) -> ClockBeat:
    return ClockBeat(wall_us=0, engine_us=round(engine_s * SECOND), speed=speed, epoch=1, beat=number)


def test_the_first_beat_is_a_jump_and_timers_go_along() -> None:
    wall = Wall()
    clock = PacedScheduler(wall, 100 * SECOND)
    ran: list[Micros] = []
    clock.call_at(107 * SECOND, lambda: ran.append(clock.now()))
    wall.us = 2 * SECOND
    assert clock.on_beat(beat(5000, 10.0)) == 4898 * SECOND

    wall.us += SECOND // 2 - 1
    clock.run_due()
    assert ran == []  # 5 s of engine time were left: half a second of wall time

    wall.us += 1
    clock.run_due()
    assert ran == [5005 * SECOND]


def test_a_call_sees_the_instant_it_was_due_even_when_it_runs_late() -> None:
    wall = Wall()
    clock = PacedScheduler(wall, 0, speed=10.0)
    ran: list[tuple[str, Micros]] = []

    def first() -> None:
        ran.append(("first", clock.now()))
        clock.call_at(clock.now() + SECOND, lambda: ran.append(("then", clock.now())))

    clock.call_at(3 * SECOND, first)
    clock.call_at(3 * SECOND, lambda: ran.append(("second", clock.now()))).cancel()
    wall.us = SECOND
    clock.run_due()
    assert ran == [("first", 3 * SECOND), ("then", 4 * SECOND)]
    assert clock.now() == 10 * SECOND


def test_small_corrections_never_turn_time_back() -> None:
    wall = Wall()
    clock = PacedScheduler(wall, 0)
    assert clock.on_beat(beat(1000, 10.0)) == SECOND * 1000
    wall.us = SECOND
    assert clock.now() == 1010 * SECOND
    assert clock.on_beat(beat(1009.5, 10.0, 2)) == 0
    assert clock.now() == 1010 * SECOND
    wall.us += SECOND
    assert clock.now() == round(1019.5 * SECOND)
    assert clock.on_beat(beat(1020, 10.0, 3)) == 0
    assert clock.now() == 1020 * SECOND


def test_an_engine_whose_time_stood_still_turns_it_back_with_all_timers() -> None:
    wall = Wall()
    clock = PacedScheduler(wall, 0)
    clock.on_beat(beat(1000, 10.0))
    ran: list[Micros] = []
    clock.call_at(1300 * SECOND, lambda: ran.append(clock.now()))
    wall.us = 20 * SECOND  # engine time 1200
    assert clock.on_beat(beat(1050, 10.0, 2)) == -150 * SECOND
    assert clock.now() == 1050 * SECOND
    wall.us += 10 * SECOND
    clock.run_due()
    assert ran == [1150 * SECOND]


def test_how_long_to_wait_is_wall_time() -> None:
    wall = Wall()
    clock = PacedScheduler(wall, 0, speed=10.0)
    assert clock.wait_s(0.2) == 0.2
    clock.call_at(SECOND, lambda: None)
    assert clock.wait_s(0.2) == 0.1
    wall.us = SECOND
    assert clock.wait_s(0.2) == 0.0
