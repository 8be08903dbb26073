"""The top line: exact words, and a second line where the first is too short."""

from msgspec.structs import replace

from formiga_bt.show.facts import Now, Top
from formiga_bt.show.watch.text import plain
from formiga_bt.show.watch.top import Link, about, parts, top_lines
from tests.golden import Wording
from tests.unit.show.watch.fake import AT, S

FULL = Top(airborne=7, needs_you=2, longest_wait_us=41 * S, alarms=1, held=1, taken=(("PILOT", "lwd_3"),))


def site(top: Top, **more: str) -> Now:
    return Now(
        site="meadow", at=AT, top=top, counts={}, tasks=(), total=0, agents=(), questions=(), lines=(), **more
    )  # fmt: skip


def lines(now: Now | None, width: int = 100, link: Link | None = None, about: str = "") -> list[str]:
    return [plain(one) for one in top_lines(now, link or Link(), width, about)]


def test_it_says_what_a_person_must_see_first(wording: Wording) -> None:
    wording(lines(site(FULL)))


def test_a_calm_site_has_the_same_words_at_the_same_places(wording: Wording) -> None:
    wording(lines(site(Top())))
    assert {part.tone for part in parts(site(Top()), Link())} == {"calm_bar"}


def test_what_is_wrong_with_the_whole_stands_first(wording: Wording) -> None:
    now = site(Top(airborne=1, lockdown="return by eve"), engine="draining")
    wording(lines(now, 120, Link(12.0)))
    assert [part.tone for part in parts(now, Link(12.0))][:3] == ["alarm_bar", "alarm_bar", "warn_bar"]


def test_several_machines_of_one_holder_are_named_together(wording: Wording) -> None:
    top = Top(taken=(("PILOT", "lwd_3"), ("FAILSAFE", "hwd_1"), ("PILOT", "lwd_4")))
    wording(lines(site(top))[0])


def test_a_narrow_screen_gets_a_second_line_broken_between_parts(wording: Wording) -> None:
    wording(lines(site(FULL), 60))


def test_the_site_stands_at_the_right_where_there_is_room(wording: Wording) -> None:
    wording(lines(site(Top()), 60, about="meadow"), lines(site(Top()), 47, about="meadow"))


def test_before_the_first_answer(wording: Wording) -> None:
    wording(lines(None), lines(None, link=Link(5.0)))


def test_words_from_outside_command_no_terminal(wording: Wording) -> None:
    top = Top(lockdown="return by \x1b[2Jeve\n")
    wording(lines(site(top))[0])


def test_the_site_says_how_far_its_clock_is_from_the_wall_clock(wording: Wording) -> None:
    now = site(Top())
    assert about(now) == "meadow"
    wording(about(replace(now, speed=5.0, ahead_us=7_380 * S)))
