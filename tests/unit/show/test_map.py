"""Maps: what is in view, the text of the terminal, labels that do not overlap, and what hostile ways do."""

import math

import pytest

from formiga_bt.show.facts import Chart, MapLane, MapMark, Point, Track
from formiga_bt.show.map.figure import _Map
from formiga_bt.show.map.files import made
from formiga_bt.show.map.labels import Rect, TakenSpace
from formiga_bt.show.map.text import drawn
from formiga_bt.show.map.view import scene_of, turns_of
from formiga_bt.show.picture import Tips, extent, fixed_style
from formiga_bt.show.styled import StyledLine
from tests.golden import Wording, having
from tests.unit.show.flown import SITE

FINE = """\
camp: PickUp-1
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·                                             N ↑
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·                                       ⢀⡠▽ field
      │╱╱╱╱╱╱╱no_fly_1╱·                                    a↗⠞⠉
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·                                 ⢀⡠⠞⠉ picker_1
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·                              ⢀⡠⠞⠉        ☻
      │╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱╱·                           a↗⠖⠉
      │·················                        ⢀⡤⠖⠁
      │                                      ⢀⡤⠖⠁
      │                                   a↗⠖⠉
   50 ┼                                ⢀⡤⠖⠉
      │                             ⢀⡠⠖⠉
      │                          a↗⠖⠉       ················
      │                       ⢀⡠⠖⠉          ·              ·
      │                    ⢀⡠⠖⠉             ·              ·
      │                 a↗⠖⠉                ·         bog  ·
      │              ⢀⡠⠖⠉                   ·              ·
      │           ⢀⡠⠖⠋                      ················
      │        a↗⠖⠋
      │      ⡠⠖⠋
      │     □ p1            □ p2
      │
    0 ┼                          ⊕ base
      │
      │
      ┼┼─────────────────────────┼─────────────────────────┼────────────
m     -50                        0                         50

─────────────────────────── 50 m
a hwd_1  122 m over ground in 75 s, heights 0 60 0 m
b picker_1  at 62 E 70 N
⊕ base   □ port   • place   ▽ landing   ☻ person   ·· region or zone
╱╱ no entry
outside: far, fence (--whole shows all)
"""

WHOLE = """\
camp
      |                                                  N ^
      |
      |
      |    ========
      |    =... a@=
      |    =.aaa^.=
    0 +    = oB p2=                                    x far
      |    ========
      |
      |
      |
      +-------+----------------------+----------------------
m             0                     500

----------------------- 500 m
a hwd_1  122 m over ground in 75 s, heights 0 60 0 m
b picker_1  at 62 E 70 N
B base   o port   x place   v landing   @ person   == fence
.. region or zone   // no entry
"""


def plain(lines: list[StyledLine]) -> str:
    return "".join(line.plain + "\n" for line in lines)


def test_the_map_of_a_task_in_the_terminal() -> None:
    """Base, ports, places, areas, the way with its direction and heights, and where a person stood."""
    assert plain(drawn(SITE, 72, ids=["PickUp-1"])) == FINE


def test_the_whole_site_in_ascii() -> None:
    """All of the site, the fence too; ASCII only."""
    assert plain(drawn(SITE, 60, ascii_only=True, whole=True)) == WHOLE
    assert WHOLE.isascii()


@pytest.mark.parametrize("width", [40, 41, 80, 150])
def test_no_line_is_wider_than_asked_for(width: int) -> None:
    assert max(len(line.plain) for line in drawn(SITE, width)) <= width


def test_what_lies_outside_is_told() -> None:
    """The view is where somebody went, with the base; the rest is told in words."""
    scene = scene_of(SITE)

    assert scene.outside == ("far", "fence")
    assert scene.view.west < -40
    assert scene.view.east > 62
    assert scene_of(SITE, whole=True).outside == ()


def test_turns_are_told_from_straight_legs() -> None:
    """A climb, a turn and a descent are turning points; a point on a straight leg is none."""
    way = Track(
        agent="d", type="lwd", times=(0, 1, 2, 3, 4, 5),
        points=(Point(0, 0), Point(0, 0, 60), Point(50, 0, 60), Point(100, 0, 60), Point(100, 50, 60), Point(100, 50)),
    )  # fmt: skip

    assert turns_of(way) == [0, 1, 3, 4, 5]


def test_pieces_of_a_way_are_one_agent() -> None:
    """An agent that worked for two tasks has one colour, one line of the legend, and both tasks."""
    chart = Chart(
        site="s", at=0, marks=(), shapes=(),
        tracks=(
            Track(agent="d", type="lwd", task="A-1", times=(0, 1), points=(Point(0, 0), Point(50, 0))),
            Track(agent="d", type="lwd", task="B-2", times=(1, 2), points=(Point(50, 0), Point(50, 50))),
        ),
    )  # fmt: skip

    (walk,) = scene_of(chart).walks

    assert (walk.agent, walk.tasks, walk.length_m, walk.span) == ("d", ("A-1, B-2",), 100.0, (0, 2))


def test_labels_do_not_overlap() -> None:
    """Forty ports side by side and ten ways: no two labels meet, none leaves the map."""
    ways = tuple(
        Track(agent=f"lwd_{n}", type="lwd", times=(0, 1), points=(Point(n * 9, 0, 60), Point(200 - n * 9, 200, 30 + n)))
        for n in range(10)
    )
    ports = tuple(MapMark(name=f"port_{n}", kind="port", at=Point(n * 5, (n % 3) * 4)) for n in range(40))
    with fixed_style():
        drawing = _Map(scene_of(Chart(site="s", at=0, marks=ports, shapes=(), tracks=ways), ratio=(0.5, 0.8)), Tips())
        drawing.draw(Chart(site="s", at=0, marks=(), shapes=(), tracks=()), ())
        names = [text for text in drawing.axes.texts if text.get_zorder() == 8]
        boxes = [extent(text, drawing.canvas) for text in names]
        frame = drawing.axes.get_window_extent()

    assert len(names) > 20
    rects = [Rect(box.x0, box.y0, box.x1, box.y1) for box in boxes]
    assert [(a, b) for i, a in enumerate(rects) for b in rects[i + 1 :] if a.meets(b)] == []
    assert all(rect.is_inside(Rect(frame.x0, frame.y0, frame.x1, frame.y1)) for rect in rects)


def test_a_label_takes_a_free_place_or_none() -> None:
    places = TakenSpace(Rect(0, 0, 100, 100))

    first, second = places.place(50, 50, 20, 10), places.place(50, 50, 20, 10)

    assert first is not None
    assert second is not None
    assert not first[0].meets(second[0])
    assert places.place(50, 50, 300, 10) is None


def test_no_way_one_point_and_no_number(wording: Wording) -> None:
    """A site where nobody moved, somebody at one point, and a position that is no number are drawn."""
    still = Chart(
        site="s",
        at=0,
        marks=(),
        shapes=(),
        tracks=(Track(agent="a", type="lwd", times=(0,), points=(Point(5, 5, 3),)),),
    )
    nan = Track(agent="b", type="lwd", times=(0, 1, 2), points=(Point(0, 0), Point(math.nan, 0), Point(9, math.inf)))

    wording(having(plain(drawn(Chart(site="s", at=0, marks=(), shapes=(), tracks=()))), "nobody"))
    wording(having(plain(drawn(still)), "heights"))
    wording(having(plain(drawn(Chart(site="s", at=0, marks=(), shapes=(), tracks=(nan,)))), "left out"))
    assert made(still, "svg")


def test_two_hundred_agents_say_what_to_narrow(wording: Wording) -> None:
    ways = tuple(Track(agent=f"d{n}", type="lwd", times=(0, 1), points=(Point(n, 0), Point(n, 50))) for n in range(200))

    text = plain(drawn(Chart(site="s", at=0, marks=(), shapes=(), tracks=ways), 80))

    wording(having(text, "not drawn"))


def test_what_happened_at_one_place_is_one_mark() -> None:
    """Six questions to one person are one label."""
    marks = tuple(MapMark(name=f"Q{n}", kind="event", at=Point(10.1, 10)) for n in (1, 2, 2))

    (mark,) = scene_of(Chart(site="s", at=0, marks=marks, shapes=(), tracks=())).marks

    assert mark.name == "Q1, Q2"


def test_hostile_names_stay_text() -> None:
    evil = "<script>alert(1)</script> $x$ \x1b[31m"
    chart = Chart(
        site=evil, at=0, marks=(MapMark(name=evil, kind="place", at=Point(1, 1)),), shapes=(),
        tracks=(Track(agent=evil, type=evil, times=(0, 1), points=(Point(0, 0), Point(30, 20))),),
    )  # fmt: skip

    text, page = plain(drawn(chart, 60)), made(chart, "html", ids=[evil]).decode()

    assert "\x1b" not in text
    assert "<script>alert" not in page
    assert "\x1b" not in page


def test_a_picture_is_the_same_each_time_and_a_page_hides_agents() -> None:
    """Each way carries its agent, so that the page can hide it; nothing is fetched."""
    page = made(SITE, "html", ids=["PickUp-1"]).decode()

    assert made(SITE, "html", ids=["PickUp-1"]).decode() == page
    assert '<input type="checkbox" checked data-hides="0"> hwd_1' in page
    assert "<title>hwd_1 (hwd), PickUp-1\n122 m over ground</title>" in page
    assert "src=" not in page
    assert "<image" not in page
    assert made(SITE, "png").startswith(b"\x89PNG")


def hall() -> Chart:
    """Return a site with routes: a triangle, one side of it one way only, with a place to park."""
    corner, top, east = Point(0, 0), Point(30, 20), Point(60, 0)
    lanes = (
        MapLane(name="top-corner", start=top, end=corner, one_way=True), MapLane(name="top-east", start=top, end=east),
        MapLane(name="corner-east", start=corner, end=east),
    )  # fmt: skip
    marks = (MapMark(name="bay", kind="park", at=top), MapMark(name="s1", kind="station", at=east))
    return Chart(site="hall", at=0, marks=marks, shapes=(), tracks=(), lanes=lanes)


def test_routes_are_drawn_and_where_they_are_one_way(wording: Wording) -> None:
    wording(plain(drawn(hall(), 60)) + plain(drawn(hall(), 60, ascii_only=True)))


def test_a_picture_has_the_routes_and_what_they_are_called() -> None:
    svg = made(hall(), "svg").decode()

    assert "route top-corner, one way" in svg
    assert "route corner-east" in svg
    assert "parking" in svg


def test_routes_of_far_away_are_not_drawn() -> None:
    far = MapLane(name="far", start=Point(5000, 0), end=Point(5010, 0))
    way = Track(agent="r", type="rover", mobility="ground", times=(0, 1), points=(Point(0, 0), Point(30, 0)))
    chart = Chart(site="s", at=0, marks=(), shapes=(), tracks=(way,), lanes=(far, *hall().lanes))

    assert [lane.name for lane in scene_of(chart).lanes] == ["top-corner", "top-east", "corner-east"]
