"""Good tasks pass the checker without a word, and they are good: those that are run end as they should, whatever happens.

`FORMIGA_EXAMPLES=1000` checks so many; `FORMIGA_RUNS` runs so many of them. How many good ones are refused of a thousand that
are run in every scenario is measured by `benchmarks/false_alarms.py`.
"""

import os

import pytest

from benchmarks.false_alarms import SCENARIOS, check, judge, report
from tests.property.sound import good_task

CHECKED = int(os.environ.get("FORMIGA_EXAMPLES", "0")) or 100
RUN = int(os.environ.get("FORMIGA_RUNS", "0")) or 4


def test_a_good_task_passes_without_a_word() -> None:
    said = {}
    for seed in range(CHECKED):
        found = check(good_task(seed))
        if found:
            said[seed] = [f"{one.code} line {one.mark.line}: {one.message}" for one in found]

    assert len(said) <= CHECKED // 100, said


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
