"""Gantt charts: which bar goes where, the text of the terminal, and what hostile histories do."""

from datetime import UTC

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.errors import UnusableFile
from formiga_bt.lang.model import ActionSpec
from formiga_bt.show.facts import ActionFact, TaskFact, Timeline, Waiting
from formiga_bt.show.gantt.files import made
from formiga_bt.show.gantt.plan import planned
from formiga_bt.show.gantt.text import drawn, letters_of
from formiga_bt.show.history.rows import deed_of
from tests.golden import Wording
from tests.unit.show.flown import PICKUP, action, at, task

FINE = """\
PickUp-1  SUCCEEDED after 1 min 40 s
  (waits)   ···                           ?????                ‖‖‖‖‖‖
  hwd_1        [TakeOff▒▒▒]G[GoTo━━━━━━━━]::::::[LandIn▒▒▒▒]✗
  picker_1                                [C╌╌]
  watcher_1                               [C╌╌⊘
            ┬───────────┬───────────┬──────────┬───────────┬───────────┬
  s         0           20          40         60          80        100

C Confirm   G GoTo
▒▒ take off, land   ━━ move   ▓▓ work   ╌╌ ask a person
·· waits for agents   ?? waits for an answer   :: waits at the gate
‖‖ held   ✗ failed   ⊘ canceled
"""

PLAIN = """\
PickUp-1  SUCCEEDED after 1 min 40 s
  (waits)   .             ??        ===
  hwd_1      [T^^^]G[GoTo]:::[L^^]!
  picker_1                [C
  watcher_1               C/
            +---------------+-----------
  s         0               60

C Confirm   G GoTo   L LandIn
T TakeOff
^^ take off, land   -- move   ## work
~~ ask a person
.. waits for agents
?? waits for an answer
:: waits at the gate   == held
! failed   / canceled
"""


def plain(lines: list) -> str:
    return "".join(line.plain + "\n" for line in lines)


def test_the_chart_of_a_task_in_the_terminal() -> None:
    """Bars have names where they fit, else letters; each wait has a texture; what failed or was canceled is marked."""
    assert plain(drawn(PICKUP, 72)) == FINE


def test_the_chart_in_ascii_at_the_least_width() -> None:
    """Forty columns of ASCII tell the same with letters."""
    assert plain(drawn(PICKUP, 40, ascii_only=True)) == PLAIN
    assert PLAIN.isascii()


@pytest.mark.parametrize("width", [40, 41, 53, 80, 200])
def test_no_line_is_wider_than_asked_for(width: int) -> None:
    assert max(len(line.plain) for line in drawn(PICKUP, width)) <= width


def test_what_runs_goes_on_until_now(wording: Wording) -> None:
    """A bar without an end ends at a `now`, and says that it runs."""
    running = Timeline(
        at=at(30), tasks=(task(status="ACTIVE", end=None),), actions=(action("hwd_1", "GoTo", 10, None, ""),)
    )

    text = plain(drawn(running, 60, ascii_only=True))

    wording(text)
    assert text.splitlines()[1].endswith("---->")
    assert text.splitlines()[3].endswith("now")
    assert "> runs" in text


def test_the_clock_at_the_axis() -> None:
    """Engine time is a calendar's: 1 000 000 s are 1970-01-12 13:46:40 UTC."""
    text = plain(drawn(PICKUP, 72, clock=True, zone=UTC))

    assert "13:47:00" in text
    assert "\n  1970-01-12 UTC\n" in text


def test_a_part_is_cut_out(wording: Wording) -> None:
    """--from and --to are counted from the first request; bars are cut at the edges."""
    plan = planned(PICKUP, 100, from_us=30 * SECOND, to_us=60 * SECOND)

    assert {(bar.name, bar.start, bar.end) for bar in plan.bars} == {
        ("GoTo", at(30), at(50)), ("Confirm", at(50), at(58)), ("LandIn", at(60), at(60)),
    }  # fmt: skip
    with pytest.raises(UnusableFile) as refused:
        planned(PICKUP, 100, from_us=60 * SECOND, to_us=30 * SECOND)
    wording(refused.value)


def test_short_actions_are_one_bar_that_shows_the_worst() -> None:
    """Thirty legs of a tenth of a second in 100 s are one bar; one that failed among them still shows."""
    legs = tuple(
        action("lwd_1", "GoTo", 50 + n / 10, 50 + (n + 1) / 10, "failed" if n == 7 else "succeeded") for n in range(30)
    )

    (bar,) = planned(Timeline(at=at(100), tasks=(task(),), actions=legs), 80).bars

    assert (bar.label, bar.sign, bar.start, bar.end) == ("GoTo ×30", "failed", at(50), at(53))


def test_actions_at_once_take_lanes() -> None:
    """Two questions to one person at once are drawn one below the other."""
    asks = (action("eve", "Confirm", 0, 50), action("eve", "Confirm", 20, 70), action("eve", "Confirm", 60, 90))

    plan = planned(Timeline(at=at(100), tasks=(task(),), actions=asks), 80)

    assert [bar.lane for bar in plan.bars] == [0, 1, 0]
    assert plan.groups[0].rows[0].lanes == 2


def test_two_hundred_agents_come_in_pages(wording: Wording) -> None:
    """A picture has at most so many rows, and says how to see the others; no row is lost or twice."""
    tasks = tuple(task(f"T-{n}") for n in range(100))
    actions = tuple(action(f"d{n}", "GoTo", 1, 90, of=f"T-{n // 2}") for n in range(200))
    history = Timeline(at=at(100), tasks=tasks, actions=actions)

    plans = [planned(history, 100, page=page) for page in range(1, 6)]

    assert [row.name for plan in plans for group in plan.groups for row in group.rows] == [f"d{n}" for n in range(200)]
    wording(plans[0].note)
    with pytest.raises(UnusableFile) as refused:
        planned(history, 100, page=6)
    wording(refused.value)


def test_ten_hours_are_told_in_hours(wording: Wording) -> None:
    """Two thousand actions are one bar, and the chart says how to see them."""
    actions = tuple(action("d", ("GoTo", "Spray")[n % 2], n * 18, n * 18 + 17) for n in range(2000))

    text = plain(drawn(Timeline(at=at(36000), tasks=(task(end=36000),), actions=actions), 80))

    assert "several ×2000" in text
    wording(text)


def test_nothing_and_no_duration(wording: Wording) -> None:
    """An engine without tasks, and a task that ended in the instant of its begin, are drawn too."""
    nothing = Timeline(at=0, tasks=(), actions=())
    instant = Timeline(at=at(0), tasks=(task(end=0),), actions=(action("a", "TakeOff", 0, 0, "failed"),))

    wording(plain(drawn(nothing)), plain(drawn(instant, 60)))
    assert made(nothing, "svg")
    assert made(instant, "svg")


def test_hostile_names_stay_text() -> None:
    """Names with markup, escape sequences and wide characters break neither terminal nor page."""
    evil = "<script>alert(1)</script> $x_1$ \x1b[31m日本"
    history = Timeline(
        at=at(100),
        tasks=(TaskFact(id=evil, name="T", status="ACTIVE", submitted_at=at(0)),),
        actions=(ActionFact(task=evil, agent=evil, action=evil, start=at(1), end=at(99), state="failed", detail=evil),),
        waits=(Waiting(task=evil, kind="held", start=at(0), text=evil),),
    )

    text, page = plain(drawn(history, 60)), made(history, "html").decode()

    assert "\x1b" not in text
    assert "日" not in text
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt; $x_1$ ?[31m??" in page


def test_a_picture_is_the_same_each_time_and_tells_when_pointed_at() -> None:
    """SVG has no date and no random name, letters are paths, and each bar has its details."""
    svg = made(PICKUP, "svg")

    assert made(PICKUP, "svg") == svg
    assert b"<title>hwd_1: LandIn, succeeded, 20 s</title>" in svg
    assert b"<title>hwd_1: Weigh, failed no_scale, 0 s</title>" in svg
    assert b"<text" not in svg


def test_a_page_needs_nothing_else() -> None:
    """No script, style or picture comes from elsewhere."""
    page = made(PICKUP, "html").decode()

    assert page.startswith("<!doctype html>")
    assert "src=" not in page
    assert "<link" not in page
    assert "default-src 'none'" in page
    assert "> PickUp-1</label>" in page


def test_png_is_png() -> None:
    assert made(PICKUP, "png").startswith(b"\x89PNG")


def test_kinds_go_by_what_the_catalogue_says() -> None:
    """Of any catalogue: no name is looked at."""
    here = Mark("own.yaml", 1, 1)
    specs = {
        "Rise": ActionSpec("Rise", here, effect="airborne"), "Sink": ActionSpec("Sink", here, lands=True),
        "Roll": ActionSpec("Roll", here, moves_to="to"), "Kill": ActionSpec("Kill", here, cuts=True, effect="grounded"),
        "GoTo": ActionSpec("GoTo", here),
    }  # fmt: skip

    assert {name: deed_of(name, spec) for name, spec in specs.items()} == {
        "Rise": "rise", "Sink": "rise", "Roll": "move", "Kill": "stop", "GoTo": "",
    }  # fmt: skip
    assert [deed_of(name, None) for name in ("hold", "return", "land", "cut", "Confirm")] == [
        "stop", "move", "rise", "stop", "ask",
    ]  # fmt: skip


def test_letters_are_all_different() -> None:
    """Each of a hundred actions has a letter of its own, or none when they are spent; never the sign of a failure."""
    letters = letters_of([f"Go{n}" for n in range(100)] + ["TakeOff", "Turn"])

    assert len(set(letters.values())) == len(letters) == 60
    assert not set("Xx") & set(letters.values())
