"""The tables of `formiga stats`, from hand-made spreads, to the letter."""

import pytest

from formiga_bt.show.facts import Spread, Stats
from formiga_bt.show.stats import as_csv, draw, is_empty, span
from tests.golden import Wording

STATS = Stats(
    since=0,
    at=8 * 3_600_000_000,
    tasks=(
        Spread(name="Circle", n=1, least_s=100, q1_s=100, median_s=100, q3_s=100, most_s=100),
        Spread(name="PickUp", n=12, failed=2, least_s=200, q1_s=300, median_s=400, q3_s=500, most_s=800),
        Spread(name="Broken", n=0, failed=3),
    ),
    actions=(
        Spread(name="TakeOff", group="hwd", n=9, least_s=10.25, q1_s=11, median_s=12, q3_s=13, most_s=30),
        Spread(name="GoTo", group="lwd", n=40, failed=1, least_s=3, q1_s=10, median_s=15, q3_s=20, most_s=28),
    ),
)


def lines(width: int, *, ascii_only: bool = True) -> list[str]:
    return [line.plain() for line in draw(STATS, width=width, ascii_only=ascii_only)]


def test_wide() -> None:
    assert lines(100) == WIDE.strip("\n").split("\n")


def test_narrow() -> None:
    assert lines(60) == NARROW.strip("\n").split("\n")


def test_in_unicode() -> None:
    assert lines(100, ascii_only=False)[5].endswith(" ├───▒▒▒▒┃▒▒▒▒────────────┤")


@pytest.mark.parametrize("width", range(40, 130, 7))
def test_no_line_is_wider_than_asked_for(width: int) -> None:
    assert max(len(line) for line in lines(width)) <= width
    assert all(line.isascii() for line in lines(width))


def test_a_median_of_one_table_stands_over_the_same_of_another_row() -> None:
    twice = (Spread(name="a", n=2, most_s=8, median_s=4), Spread(name="bb", n=2, most_s=4, median_s=4))
    _, _, _, _, first, second = (
        line.plain() for line in draw(Stats(since=0, at=1, tasks=twice), width=100, ascii_only=True)
    )

    assert first.index("#") == len(second) - 1


def test_nothing(wording: Wording) -> None:
    nothing = Stats(since=0, at=90_000_000)

    assert is_empty(nothing)
    assert not is_empty(STATS)
    wording([line.plain() for line in draw(nothing)])


def test_csv() -> None:
    assert as_csv(STATS).splitlines() == [
        "table,name,group,n,failed,least_s,q1_s,median_s,q3_s,most_s",
        "tasks,Circle,,1,0,100,100,100,100,100",
        "tasks,PickUp,,12,2,200,300,400,500,800",
        "tasks,Broken,,0,3,,,,,",
        "actions,TakeOff,hwd,9,0,10.25,11,12,13,30",
        "actions,GoTo,lwd,40,1,3,10,15,20,28",
    ]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0, "0 s"), (0.26, "0.3 s"), (9.96, "10.0 s"), (42.4, "42 s"), (99.9, "100 s"),
     (250, "4.2 min"), (5999, "100 min"), (5400, "90 min"), (9000, "2.5 h"), (40000, "11 h")],
)  # fmt: skip
def test_durations_are_short(seconds: float, words: str) -> None:
    assert span(seconds) == words


WIDE = """
what ended in the last 8 h

tasks  from the first step to the end
         n  failed    least       q1   median       q3     most  0                            13 min
Circle   1          1.7 min  1.7 min  1.7 min  1.7 min  1.7 min      #
PickUp  12       2  3.3 min    5 min  6.7 min  8.3 min   13 min           |---====#====------------|
Broken   0       3

actions  by the type of agent
              n  failed  least    q1  median    q3  most  0                                     30 s
hwd TakeOff   9           10 s  11 s    12 s  13 s  30 s                |=#==----------------------|
lwd GoTo     40       1    3 s  10 s    15 s  20 s  28 s      |---------=======#======----------|
"""

NARROW = """
what ended in the last 8 h

tasks  from the first step to the end
         n  failed    least   median     most  0      13 min
Circle   1          1.7 min  1.7 min  1.7 min    #
PickUp  12       2  3.3 min  6.7 min   13 min     |-=#==---|
Broken   0       3

actions  by the type of agent
              n  failed  least  median  most  0         30 s
hwd TakeOff   9           10 s    12 s  30 s      |#=------|
lwd GoTo     40       1    3 s    15 s  28 s   |--===#==--|
"""
