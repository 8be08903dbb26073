"""Good tasks pass the checker without a word, and they are good: those that are run end as they should, whatever happens.

`FORMIGA_EXAMPLES=1000` checks so many; `FORMIGA_RUNS` runs so many of them. How many good ones are refused of a thousand that
are run in every scenario is measured by `benchmarks/false_alarms.py`.
"""

import os

import pytest

from benchmarks.false_alarms import SCENARIOS, check, is_nobodys, judge, report, run, unchecked
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder
from formiga_bt.engine.kernel.state import EngineState
from tests.property.sound import good_task
from tests.property.sound_rich import rich_task

CHECKED = int(os.environ.get("FORMIGA_EXAMPLES", "0")) or 100
RICH = range(int(os.environ.get("FORMIGA_RUNS", "0")) or 3)
RUN = int(os.environ.get("FORMIGA_RUNS", "0")) or 4


def test_a_good_task_passes_without_a_word() -> None:
    said = {}
    for seed in range(CHECKED):
        found = check(good_task(seed))
        if found:
            said[seed] = [f"{one.code} line {one.mark.line}: {one.message}" for one in found]

    assert len(said) <= CHECKED // 100, said


def test_a_good_task_of_more_of_the_language_passes_without_a_word() -> None:
    """`python benchmarks/false_alarms.py --checked --tasks 2000` checks more of them."""
    told = {seed: [one.code for one in found] for seed in range(3 * CHECKED) if (found := check(rich_task(seed)))}

    assert told == {}


@pytest.mark.parametrize("seed", RICH)
def test_a_good_task_of_more_of_the_language_ends_as_it_should_on_a_calm_day(seed: int) -> None:
    task = unchecked(rich_task(seed))[0]
    assert task is not None

    ended = run(task, list(SCENARIOS).index("ok"))

    assert (ended.status, ended.aloft) == ("SUCCEEDED", False), ended


@pytest.mark.parametrize("seed", range(RUN))
def test_a_good_task_ends_as_it_should_in_every_scenario(seed: int) -> None:
    judged = judge(seed)
    assert judged is not None

    assert (judged.why_not, judged.errors) == ("", [])


def test_a_task_that_leaves_its_drone_in_the_air_is_not_good_and_is_refused() -> None:
    """Seed 10031 has no call of ReturnHome at its end."""
    judged = judge(10031, change=True)
    assert judged is not None

    assert judged.changed.startswith("dropped_landing")
    assert (judged.why_not, judged.errors) == (
        "ok: it leaves a machine in the air, which the engine brings home",
        ["E031"],
    )
    assert f"1 drawn, 1 can be read to the end, 0 are good in all {len(SCENARIOS)} scenarios" in report([judged], 1)


def test_a_task_that_failed_is_told_by_its_code_though_the_engine_brought_its_machine_home() -> None:
    """Seed 326 lands on a port that is not its machine's own."""
    judged = judge(326)
    assert judged is not None

    assert judged.why_not == "ok: FAILED foreign_port that port belongs to another agent"


def test_a_wait_for_a_lost_machine_is_named_and_does_not_count_against_the_task() -> None:
    """Seed 84: one machine is lost above the field where the other wants to start."""
    task = unchecked(good_task(84))[0]
    assert task is not None

    ended = run(task, list(SCENARIOS).index("lost"), limit_s=600.0)

    assert (ended.status, ended.blocked, ended.nobodys) == ("no end", True, "")
    assert "gate.leg_busy: lwd_3.TakeOff waits until hwd_1 is out of its way" in ended.reason


@pytest.mark.parametrize(
    ("changed", "nobodys"),
    [({}, True), ({"landed": "unknown"}, True), ({"landed": "grounded"}, False), ({"pool": "QUARANTINED"}, False)],
)
def test_a_machine_in_the_air_needs_somebody_who_answers_for_it(changed: dict[str, str], nobodys: bool) -> None:
    agent = AgentRecord(**{"id": "d", "type": "lwd", "landed": "airborne", "pool": "STANDBY", **changed})
    state = EngineState()

    assert is_nobodys(agent, state) is nobodys

    state.orders["d"] = StandingOrder(agent="d", stop="hold", by="ann", scope="agent", at=0)
    assert not is_nobodys(agent, state)
