"""Deadlines of live conditions: at the instant given, and not a microsecond earlier, the comparison has its new value."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place
from formiga_bt.lang.expr.scope import MaybeUnset
from formiga_bt.lang.expressions import Scope, compile_cond
from formiga_bt.lang.model import Expr, UnknownState, Unset
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import AGENT, DURATION, TIME, AgentRef

SCOPE = Scope({"t": TIME, "d": DURATION, "drone": AGENT}, roles=frozenset({"drone"}))
T = 1_790_000_000_123_457
MIN = 60_000_000


class At:
    """An environment at an instant."""

    def __init__(self, now: int, **names: Any) -> None:
        self.names = {"now": now, "t": T, "d": 90.0, "drone": AgentRef("lwd_1"), **names}

    def name(self, name: str) -> Any:
        if name not in self.names:
            raise Unset(name)
        return self.names[name]

    def is_set(self, name: str) -> bool:
        return name in self.names

    def agent_field(self, agent: AgentRef, name: str) -> Any:
        raise UnknownState(name)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        return 60.0, 22.0

    def place(self, lat: float, lng: float) -> Place:
        return Place(lng, lat)

    def ground_up_m(self, place: Any) -> float:
        return 0.0


def live(text: str, volatile: frozenset[str] = frozenset()) -> tuple[Expr, list[str]]:
    expr, found = compile_cond(Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1)), SCOPE, volatile)
    return expr, [d.code for d in found]


FORMS = {
    "now > t": T + 1,
    "now >= t": T,
    "now < t": T,
    "now <= t": T + 1,
    "t > now": T,
    "t >= now": T + 1,
    "t < now": T + 1,
    "t <= now": T,
    "now >= t + 30 min": T + 30 * MIN,
    "now > t - 30 min": T - 30 * MIN + 1,
    "30 min + t <= now": T + 30 * MIN,
    "now - t > 5 min": T + 5 * MIN + 1,
    "now - t >= 5 min": T + 5 * MIN,
    "now - t < 5 min": T + 5 * MIN,
    "now - t <= 5 min": T + 5 * MIN + 1,
    "t - now < 5 min": T - 5 * MIN + 1,
    "-(now - t) <= d": T - 90_000_000,
    "now - t > d": T + 90_000_001,
    "now - t + 1 min > d": T + 30_000_001,
    "now - (t + 1 s) > 0.1 s": T + 1_100_001,
    "now - t > (5 min if drone.id == 'lwd_1' else 1 min)": T + 5 * MIN + 1,
    "not now > t": T + 1,
}


@pytest.mark.parametrize("text", FORMS)
@pytest.mark.parametrize("early", [-1, 3 * MIN, 10**12, 7])
def test_the_instant_is_exact(text: str, early: int) -> None:
    expr, problems = live(text)
    assert problems == []
    (instant,) = expr.deadlines

    at = instant(At(T - early))

    assert at == FORMS[text]
    assert expr.run(At(at - 1)) is not expr.run(At(at))
    assert expr.run(At(at)) is expr.run(At(at + 10**12))


@given(st.integers(0, 2**51), st.integers(0, 10**9), st.sampled_from([">", ">=", "<", "<="]))
def test_it_is_exact_however_the_numbers_are_rounded(t: int, tenths: int, op: str) -> None:
    expr, _ = live(f"now - t {op} d")
    (instant,) = expr.deadlines

    at = instant(At(t, t=t, d=tenths / 7e5))

    assert expr.run(At(at - 1, t=t, d=tenths / 7e5)) is not expr.run(At(at, t=t, d=tenths / 7e5))


def test_each_comparison_has_its_own() -> None:
    expr, problems = live("t < now < t + 5 min or (drone.airborne and now - t > 1 h)")

    assert problems == []
    assert [instant(At(T)) for instant in expr.deadlines] == [T + 1, T + 5 * MIN, T + 60 * MIN + 1]


def test_without_now_there_is_none() -> None:
    assert live("drone.battery < 30 %")[0].deadlines == ()


def test_a_value_that_is_not_set_has_no_instant() -> None:
    scope = SCOPE.with_names({"reply": TIME}, maybe_unset={"reply": MaybeUnset()})
    text = "is_set(reply) and now > reply + 5 min"
    expr, found = compile_cond(Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1)), scope, frozenset())

    assert found == []
    assert [instant(At(T)) for instant in expr.deadlines] == [0]


@pytest.mark.parametrize(
    "text",
    [
        "2 * (now - t) > 10 min",
        "(now - t) / 2 > 10 min",
        "abs(now - t) > 5 min",
        "now - t > now - t",
        "now == t",
        "now != t",
        "now in [t]",
        "is_set(now)",
        "drone.age > 5 s",
        "now - t > drone.age",
        "(now if drone.airborne else t) > t",
        "max(now - t, 5 s) > 5 min",
    ],
)
def test_other_forms_are_refused(text: str) -> None:
    assert set(live(text)[1]) == {"E068"}


def test_what_may_be_written_meanwhile_is_not_constant() -> None:
    assert live("now > t", frozenset({"t"}))[1] == ["E068"]
    assert live("now > t and drone.airborne", frozenset({"d"}))[1] == []


def test_a_condition_read_once_may_use_now_freely() -> None:
    text = "abs(now - t) > 5 min and drone.age < 5 s"
    expr, found = compile_cond(Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1)), SCOPE)

    assert found == []
    assert expr.deadlines == ()
