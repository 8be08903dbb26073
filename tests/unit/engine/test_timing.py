"""Requests in time: served no earlier than they say, in order of other tasks, and what becomes of a late one."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import Alarm, Prioritize
from formiga_bt.engine.kernel.records import TaskWhen
from formiga_bt.rehearsal.testing import effects
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task

HOLD = CART + "steps: [{wait: 10 s}]"
LONG = CART + "steps: [{wait: 40 min}]"


def later(yard: Yard, seconds: float) -> Micros:
    return yard.now + round(seconds * SECOND)


def ask(yard: Yard, name: str = "Try", given: dict[str, Any] | None = None, **when: Any) -> str:
    return yard.submit(name, {}, when=TaskWhen(**when), **(given or {}))


def alarms(yard: Yard) -> list[str]:
    return [alarm.code for alarm in effects(yard, Alarm)]


def test_it_begins_at_the_very_time_and_not_before(make: Make) -> None:
    yard = make(HOLD)
    begins = later(yard, 3600)
    mine = ask(yard, not_before=begins)

    yard.run_for(3599)
    assert yard.task(mine).status == "PENDING"
    assert yard.engine.state.explanations[mine][0].code == "not_before"
    yard.run_for(2)

    assert yard.task(mine).times.assigned_at == begins


def test_what_may_not_begin_yet_keeps_no_machine_from_others(make: Make) -> None:
    yard = make(HOLD)
    mine = ask(yard, given={"priority": "high"}, not_before=later(yard, 3600))

    assert yard.end(yard.start()) == ("SUCCEEDED", "")
    assert yard.task(mine).status == "PENDING"


@pytest.mark.parametrize("given", [{"wait": 60 * SECOND}, {"expires": 60 * SECOND}])
def test_its_wait_counts_from_when_it_may_begin(make: Make, given: dict[str, Any]) -> None:
    yard = make(HOLD, task(LONG, name="Busy"))
    yard.start("Busy")
    mine = ask(yard, given=given, not_before=later(yard, 600))

    yard.run_for(659)
    assert yard.task(mine).status == "PENDING"
    yard.run_for(2)

    assert yard.task(mine).status == "FAILED"


def test_it_begins_after_all_tasks_that_it_names(make: Make) -> None:
    yard = make(HOLD, carts=3)
    first, second = yard.start(), ask(yard, not_before=later(yard, 100))
    mine = ask(yard, after=(first, second))

    yard.run_for(50)
    assert (yard.task(first).status, yard.task(mine).status) == ("SUCCEEDED", "PENDING")
    assert yard.engine.state.requests[mine].after == (second,)
    assert yard.end(mine) == ("SUCCEEDED", "")

    assert yard.task(mine).times.assigned_at >= (yard.task(second).times.ended_at or 0) > 0


def test_a_whole_chain_ends_with_its_first(make: Make) -> None:
    yard = make(HOLD, task(LONG, name="Busy"))
    chain = [yard.start("Busy")]
    for _ in range(300):
        chain.append(ask(yard, after=(chain[-1],)))
    yard.abort(chain[0])
    yard.run_for(60)

    assert {yard.outcome(one) for one in chain[1:]} == {("FAILED", "after_failed")}


def test_both_conditions_hold(make: Make) -> None:
    yard = make(HOLD, carts=2)
    first, begins = yard.start(), later(yard, 100)
    mine = ask(yard, after=(first,), not_before=begins)
    yard.end(mine)

    assert yard.task(mine).times.assigned_at == begins


@pytest.mark.parametrize(
    ("if_late", "waiting", "running"),
    [
        ("run", ("PENDING", ""), ("ACTIVE", "")),
        ("drop", ("FAILED", "late"), ("ACTIVE", "")),
        ("fail", ("FAILED", "late"), ("FAILED", "late")),
    ],
)
def test_what_becomes_of_a_late_one(
    make: Make, if_late: str, waiting: tuple[str, str], running: tuple[str, str]
) -> None:
    yard = make(LONG)
    one = ask(yard, deadline=later(yard, 60), if_late=if_late)
    two = ask(yard, deadline=later(yard, 60), if_late=if_late)
    yard.run_for(59)
    assert (yard.task(one).status, yard.task(two).status, alarms(yard)) == ("ACTIVE", "PENDING", [])
    yard.run_for(2)

    assert alarms(yard) == ["late", "late"]
    assert (yard.outcome(one), yard.outcome(two)) == (running, waiting)


def test_one_in_time_is_no_alarm(make: Make) -> None:
    yard = make(HOLD)
    mine = ask(yard, deadline=later(yard, 60), if_late="fail")
    yard.run_for(120)

    assert (yard.outcome(mine), alarms(yard)) == (("SUCCEEDED", ""), [])


def test_a_deadline_does_not_cut_a_cleanup_short(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 10 s}]\nfinally: [{wait: 60 s}]")
    mine = ask(yard, deadline=later(yard, 30), if_late="fail")

    assert yard.end(mine) == ("SUCCEEDED", "")
    assert alarms(yard) == ["late"]


def test_what_began_anew_after_its_deadline_does_not_begin_again(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 30 min}]", task(LONG, name="Busy"))
    mine = ask(yard, deadline=later(yard, 60), if_late="drop")
    yard.run_for(120)
    assert yard.task(mine).status == "ACTIVE"

    yard.submit("Busy", {}, priority="high")
    yard.run_for(5)

    assert yard.outcome(mine) == ("FAILED", "late")


@pytest.mark.parametrize(
    ("code", "when"),
    [
        ("late", {"deadline": -1}),
        ("bad_time", {"deadline": 367 * 86_400}),
        ("bad_time", {"not_before": 2**45}),
        ("late", {"not_before": 60, "deadline": 60}),
        ("unknown_task", {"after": ("Nobody-7",)}),
        ("after_failed", {"after": ("Try-1",)}),
        ("too_many", {"after": ("Try-1",) * 101}),
    ],
)
def test_what_can_only_be_late_or_never_begin_is_refused(make: Make, code: str, when: dict[str, Any]) -> None:
    yard = make(HOLD)
    yard.abort(yard.start())
    yard.run_for(5)
    given = {key: value if key == "after" else later(yard, value) for key, value in when.items()}

    with pytest.raises(TaskError) as refused:
        ask(yard, **given)

    assert refused.value.code == code
    assert yard.engine.state.requests == {}


class TestTheQueue:
    """Of one priority the earliest deadline is served first, and nobody waits for ever."""

    def served(self, yard: Yard, names: list[str]) -> list[str]:
        yard.run_for(600)
        assert all(yard.task(name).times.assigned_at for name in names)
        return sorted(names, key=lambda name: yard.task(name).times.assigned_at or 0)

    def test_the_earliest_deadline_goes_first(self, make: Make) -> None:
        yard = make(HOLD, task(LONG, name="Busy"), carts=1)
        busy = yard.start("Busy")
        unsaid = ask(yard)
        late, soon = ask(yard, deadline=later(yard, 5000)), ask(yard, deadline=later(yard, 3000))
        yard.end(busy, 3000)

        assert self.served(yard, [unsaid, late, soon]) == [soon, unsaid, late]

    def test_who_named_no_deadline_is_not_passed_for_ever(self, make: Make) -> None:
        yard = make(HOLD, task(LONG, name="Busy"), carts=1)
        busy = yard.start("Busy")
        unsaid = ask(yard)
        yard.run_for(1800)
        hurried = ask(yard, deadline=later(yard, 2100))  # later than an hour after the first was asked for
        yard.end(busy, 3000)

        assert self.served(yard, [unsaid, hurried]) == [unsaid, hurried]

    def test_what_a_person_put_first_comes_before_any_deadline(self, make: Make) -> None:
        yard = make(HOLD, task(LONG, name="Busy"), carts=1)
        busy = yard.start("Busy")
        unsaid = ask(yard)
        soon, sooner = ask(yard, deadline=later(yard, 2600)), ask(yard, deadline=later(yard, 2500))
        yard.ask(Prioritize(unsaid, "medium", first=True))
        yard.end(busy, 3000)

        assert self.served(yard, [unsaid, soon, sooner]) == [unsaid, sooner, soon]
