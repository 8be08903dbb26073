"""Times of the day: in the site's time zone, on the day of `now`; by the sun, also where it never sets or never rises."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.expressions import Scope, compile_cond, compile_expr, compile_value
from formiga_bt.lang.loader import load_site, load_task_text
from formiga_bt.lang.model import Catalogue, EvalError, Expr, Site
from formiga_bt.lang.request.binding import SiteEnv, bind_params
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import TIME
from tests.golden import Wording

HELSINKI = ZoneInfo("Europe/Helsinki")
SITE = """\
formiga_site: 1
name: yard
base: {lat: 60.17, lng: 24.94, ground_msl: 20 m}
timezone: Europe/Helsinki
"""


def us(text: str) -> int:
    at = datetime.fromisoformat(text)
    return round(at.replace(tzinfo=at.tzinfo or HELSINKI).timestamp()) * 1_000_000


@pytest.fixture
def site(tmp_path: Path) -> Site:
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    found, problems, _ = load_site(tmp_path / "site.yaml")
    assert found is not None, problems
    return found


def scalar(text: str) -> Scalar:
    return Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1))


def expr(text: str) -> Expr:
    found, problems = compile_expr(text, scalar(text), 0, Scope({}), None)
    assert problems == []
    return found


def value(text: str, site: Site, now: str) -> int:
    found = expr(text).run(SiteEnv(site, us(now)))
    assert isinstance(found, int)
    return found


def test_a_time_of_the_day_is_that_of_the_day_of_now_at_the_site(site: Site) -> None:
    assert value("today('06:30')", site, "2026-08-20T23:59") == us("2026-08-20T06:30")
    assert value("today('06:30')", site, "2026-08-20T21:05:00+00:00") == us(
        "2026-08-21T06:30"
    )  # it is past midnight there
    assert value("today('6:30:15') + 1 h", site, "2026-01-20T00:00") == us("2026-01-20T07:30:15")
    assert value("today('06:30')", replace(site, timezone="UTC"), "2026-08-20T12:00") == us("2026-08-20T06:30+00:00")


def test_a_literal_is_read_as_a_time_of_the_day_where_a_time_is_due(site: Site) -> None:
    literal, problems = compile_value(scalar("06:30"), Scope({}), TIME)

    assert problems == []
    assert not literal.is_const
    assert literal.run(SiteEnv(site, us("2026-08-20T23:00"))) == us("2026-08-20T06:30")


def test_the_clock_changes_in_the_night_and_the_time_of_the_day_does_not(site: Site) -> None:
    before, after = (value("today('12:00')", site, f"2026-03-{day}T00:30") for day in (28, 29))

    assert after - before == timedelta(hours=23) / timedelta(microseconds=1)


@pytest.mark.parametrize(
    ("day", "rises", "sets"),
    [("2026-06-21", "03:54", "22:50"), ("2026-12-21", "09:24", "15:13")],
)
def test_the_sun_of_helsinki_is_right_to_three_minutes(site: Site, day: str, rises: str, sets: str) -> None:
    for text, known in (("sunrise(base)", rises), ("sunset(base)", sets)):
        found = value(text, site, f"{day}T01:00")
        assert abs(found - us(f"{day}T{known}")) <= 180_000_000, datetime.fromtimestamp(found / 1e6, UTC)


def test_where_the_sun_stays_up_it_is_day_from_midnight_to_midnight_and_where_it_stays_down_never(site: Site) -> None:
    lapland = replace(site, lat=69.9, lng=27.0)
    assert value("sunrise(base)", lapland, "2026-06-20T13:00") == us("2026-06-20T00:00")
    assert value("sunset(base)", lapland, "2026-06-20T13:00") == us("2026-06-21T00:00")
    dark = [value(f"{which}(base)", lapland, "2026-12-20T13:00") for which in ("sunrise", "sunset")]
    assert dark[0] == dark[1]
    assert abs(dark[0] - us("2026-12-20T12:12")) < 600_000_000


def test_a_watched_condition_knows_its_instant_and_looks_again_at_midnight(site: Site) -> None:
    cond, problems = compile_cond(scalar("now > sunset(base) - 30 min"), Scope({}), frozenset())
    assert problems == []
    at = us("2026-08-20T12:00")
    turn, midnight = (instant(SiteEnv(site, at)) for instant in cond.deadlines)

    assert midnight == us("2026-08-21T00:00")
    assert turn == value("sunset(base)", site, "2026-08-20T12:00") - 1_800_000_000 + 1
    assert [cond.run(SiteEnv(site, turn + by)) for by in (-1, 0)] == [False, True]
    assert [cond.run(SiteEnv(site, midnight + by)) for by in (-1, 0)] == [True, False]


def test_a_caller_may_give_a_time_of_today_where_it_is_known_what_day_it_is(
    catalogue: Catalogue, site: Site, wording: Wording
) -> None:
    text = (
        "formiga: 1\ntask: Wait\nparams: {end: time, dusk: {type: time, default: '${sunset(base)}'}}\n"
        "agents: {watcher: {type: watcher}}\nvars: {noon: \"${today('12:00')}\"}\nsteps:\n"
        "  - wait_until: now > end or now > dusk or now > noon\n    timeout: 1 d\n  - notify: It is late.\n    to: [watcher]\n"
    )
    loaded = load_task_text(text, "wait.yaml", catalogue=catalogue, site=site)
    assert loaded.diagnostics == []
    assert loaded.task is not None

    values, problems, _ = bind_params(loaded.task, {"end": "21:30"}, site, us("2026-08-20T08:00"))
    assert problems == []
    assert values == {"end": us("2026-08-20T21:30")}
    _, (problem,), _ = bind_params(loaded.task, {"end": "21:30"}, site)
    wording(problem.message)


WITH_TIME = (
    "formiga: 1\ntask: Try\nparams: {begin: time}\nagents: {watcher: {type: watcher}}\n"
    "steps: [{wait_until: now >= begin, timeout: 1 h}]\n"
)


@pytest.mark.parametrize(
    ("text", "utc"),
    [
        ("2026-11-24T02:00", "2026-11-24T00:00+00:00"),
        ("2026-07-24 02:00:30", "2026-07-23T23:00:30+00:00"),
        ("2026-10-25T02:59", "2026-10-24T23:59+00:00"),  # a minute before the hour that comes twice
        ("2026-11-24T02:00Z", "2026-11-24T02:00+00:00"),
    ],
)
def test_a_date_and_time_without_a_zone_is_in_that_of_the_site(
    catalogue: Catalogue, site: Site, text: str, utc: str
) -> None:
    loaded = load_task_text(WITH_TIME, "try.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None
    values, problems, _ = bind_params(loaded.task, {"begin": text}, site)
    assert (problems, values) == ([], {"begin": us(utc)})

    anywhere, found = compile_value(scalar(text), Scope({}), TIME)  # as a tree that is checked without a site
    assert (found, anywhere.run(SiteEnv(site))) == ([], us(utc))


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("2026-03-29T03:30", ("does not exist in Europe/Helsinki",)),
        ("2026-10-25T03:30", ("happens twice in Europe/Helsinki", "2026-10-25T03:30+03:00 or 2026-10-25T03:30+02:00")),
        ("2026-10-25", ("is a day, not a time",)),
    ],
)
def test_a_time_that_the_clocks_leave_out_or_repeat_is_refused(
    catalogue: Catalogue, site: Site, text: str, parts: tuple[str, ...]
) -> None:
    loaded = load_task_text(WITH_TIME, "try.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None
    values, (problem,), _ = bind_params(loaded.task, {"begin": text}, site)
    assert values == {}
    assert problem.code == "E013"
    assert all(part in problem.message for part in parts)


def test_such_a_time_in_a_tree_that_was_checked_without_a_site_has_no_value_there(site: Site) -> None:
    anywhere, _ = compile_value(scalar("2026-03-29T03:30"), Scope({}), TIME)
    with pytest.raises(EvalError, match="does not exist"):
        anywhere.run(SiteEnv(site))
