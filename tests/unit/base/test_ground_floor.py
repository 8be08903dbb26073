"""What everything stands on: time as an argument, points and frames, diagnostics."""

import math

import pytest

from formiga_bt.base.clock import SECOND, VirtualScheduler, micros, seconds
from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order, render
from formiga_bt.base.geo import Frame, Place, Position, distance_m, horizontal_m, mm, segment_distance_m
from tests.golden import Wording

# -- clock ---------------------------------------------------------------------------------------------------------------


def test_seconds_become_whole_microseconds() -> None:
    assert [micros(s) for s in (0.1, 1e-6, 0.0000005, 0.0000015)] == [100_000, 1, 0, 2]
    assert seconds(1_500_000) == 1.5


def test_calls_run_in_order_of_time_then_of_scheduling() -> None:
    clock, log = VirtualScheduler(10), []
    clock.call_at(30, lambda: log.append("c"))
    clock.call_at(20, lambda: log.append("a"))
    clock.call_at(20, lambda: log.append("b"))

    while clock.run_next():
        pass

    assert log == ["a", "b", "c"]
    assert clock.now() == 30


def test_a_call_in_the_past_runs_now_and_time_never_goes_back() -> None:
    clock, log = VirtualScheduler(100), []
    clock.call_at(5, lambda: log.append(clock.now()))

    assert clock.next_time() == 100
    assert clock.run_next()
    assert log == [100]
    clock.advance_to(50)
    assert clock.now() == 100


def test_a_canceled_call_does_not_run_and_canceling_again_is_harmless() -> None:
    clock, log = VirtualScheduler(), []
    timer = clock.call_at(SECOND, lambda: log.append("x"))

    timer.cancel()
    timer.cancel()

    assert clock.next_time() is None
    assert not clock.run_next()
    assert log == []


def test_time_does_not_jump_over_a_call() -> None:
    clock = VirtualScheduler()
    clock.call_at(10, lambda: None)

    with pytest.raises(AssertionError, match="jump over"):
        clock.advance_to(11)


# -- geo -----------------------------------------------------------------------------------------------------------------


def test_lengths_are_rounded_to_a_millimetre_without_a_negative_zero() -> None:
    assert mm(1.23456) == 1.235
    assert math.copysign(1.0, mm(-0.0001)) == 1.0


def test_distances() -> None:
    assert horizontal_m(Place(0, 0), Position(3, 4, 99)) == 5.0
    assert distance_m(Position(0, 0, 0), Position(2, 3, 6)) == 7.0
    assert Position(1, 2, 3).ground == Place(1, 2)


@pytest.mark.parametrize(
    ("p", "q", "least"),
    [
        (((0, 0, 0), (10, 0, 0)), ((5, -5, 3), (5, 5, 3)), 3.0),
        (((0, 0, 0), (10, 0, 0)), ((0, 2, 0), (10, 2, 0)), 2.0),
        (((0, 0, 0), (10, 0, 0)), ((20, 0, 0), (30, 0, 0)), 10.0),
        (((0, 0, 0), (0, 0, 0)), ((3, 4, 0), (3, 4, 0)), 5.0),
        (((0, 0, 0), (0, 0, 0)), ((-5, 4, 0), (5, 4, 0)), 4.0),
        (((-5, 4, 0), (5, 4, 0)), ((0, 0, 0), (0, 0, 0)), 4.0),
        (((0, 0, 0), (10, 0, 0)), ((12, 5, 0), (12, 1, 0)), math.sqrt(5)),
        (((0, 0, 0), (10, 0, 0)), ((-3, 4, 0), (-3, 9, 0)), 5.0),
    ],
)
def test_the_least_distance_of_two_legs(p: tuple, q: tuple, least: float) -> None:  # type: ignore[type-arg]
    a, b, c, d = (Position(*point) for point in (*p, *q))

    assert segment_distance_m(a, b, c, d) == pytest.approx(least)
    assert segment_distance_m(c, d, b, a) == pytest.approx(least)


@pytest.mark.parametrize(("lat", "lng"), [(66.5, 25.7), (0.0, 0.0), (-33.9, 151.2)])
def test_a_frame_takes_degrees_there_and_back(lat: float, lng: float) -> None:
    frame = Frame(lat, lng)

    assert frame.place(lat, lng) == Place(0.0, 0.0)
    there = frame.lat_lng(Place(500.0, -300.0))
    back = frame.place(*there)
    assert horizontal_m(back, Place(500.0, -300.0)) < 0.005


def test_north_is_north_and_east_is_east() -> None:
    frame = Frame(66.5, 25.7)

    north, east = frame.place(66.51, 25.7), frame.place(66.5, 25.71)

    assert north.north_m == pytest.approx(1115, abs=2)
    assert abs(north.east_m) < 0.01
    assert east.east_m == pytest.approx(445, abs=2)


# -- diagnostics -----------------------------------------------------------------------------------------------------------


def problem(code: str = "E010", line: int = 2, **fields: str) -> Diagnostic:
    return Diagnostic(code, Mark("a.yaml", line, 3, line, 7), "no such name", **fields)


def test_a_diagnostic_shows_its_line_with_carets_place_and_help(wording: Wording) -> None:
    text = render(problem(help="say drone", within="T / steps"), {"a.yaml": "first\n  droan: x\n"})

    wording(text.splitlines())


def test_without_the_source_only_the_words_are_shown(wording: Wording) -> None:
    wording(render(problem(), {}))


def test_tabs_keep_the_carets_below_the_word() -> None:
    text = render(Diagnostic("E001", Mark("a", 1, 2, 1, 3), "m"), {"a": "\tx"})

    assert text.splitlines()[2] == "      | \t^"


@pytest.mark.parametrize(
    ("col", "end", "starts", "ends"),
    [
        (3, 6, "ab" + "BAD", "x..."),
        (10_000, 10_003, "...", "x..."),
        (19_998, 20_001, "...x", "BAD"),
        (10_000, 20_001, "...", "x..."),
    ],
    ids=["at the start", "in the middle", "at the end", "all that follows"],
)
def test_of_a_very_long_line_the_part_around_what_is_wrong_is_shown(col: int, end: int, starts: str, ends: str) -> None:
    line = ("ab" + "x" * 20_000)[: col - 1] + "BAD" + "x" * 20_000
    text = render(Diagnostic("E001", Mark("a", 1, col, 1, end), "m"), {"a": line[:20_000]})
    shown, carets = (one[8:] for one in text.splitlines()[1:])
    assert shown.startswith(starts)
    assert shown.endswith(ends)
    assert len(shown) <= 200 + 2 * len("...")
    assert shown[carets.index("^") :].startswith("BAD")
    assert len(carets) == carets.rindex("^") + 1 <= len(shown)
    assert carets.count("^") == min(end - col, 200 - (carets.index("^") - 3))


def test_a_place_after_the_end_of_a_very_long_line_has_its_caret() -> None:
    text = render(Diagnostic("E001", Mark("a", 1, 20_500), "m"), {"a": "x" * 20_000})
    assert text.splitlines()[2].count("^") == 1


def test_diagnostics_are_ordered_and_told_once() -> None:
    late, early = problem(line=9), problem(line=1)

    assert in_order([late, early, late]) == [early, late]
    assert (problem().severity, problem("W001").severity) == ("error", "warning")
