"""Good tasks pass the checker without a word, and they are good: those that are run succeed.

`FORMIGA_EXAMPLES=1000` checks so many; `FORMIGA_RUNS` runs so many of them.
"""

import os

import pytest

from formiga_bt.geo import Place
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.packaged import folder
from formiga_bt.rehearsal import Rehearsal, fleet_of
from tests.property.sound import good_task

CHECKED = int(os.environ.get("FORMIGA_EXAMPLES", "0")) or 100
RUN = int(os.environ.get("FORMIGA_RUNS", "0")) or 6
CATALOGUE = load_catalogue([folder("actions") / "base.yaml"])[0]
SITE = load_site(folder("trees") / "demo-site.yaml", CATALOGUE)[0]


def test_a_good_task_passes_without_a_word() -> None:
    said = {}
    for seed in range(CHECKED):
        found = load_task_text(good_task(seed), "good.yaml", catalogue=CATALOGUE, site=SITE).diagnostics
        if found:
            said[seed] = [f"{one.code} line {one.mark.line}: {one.message}" for one in found]

    assert len(said) <= CHECKED // 100, said


@pytest.mark.parametrize("seed", range(RUN))
def test_a_good_task_succeeds(seed: int) -> None:
    assert SITE is not None
    task = load_task_text(good_task(seed), "good.yaml", catalogue=CATALOGUE, site=SITE).task
    assert task is not None
    world = Rehearsal(SITE, CATALOGUE, [task], fleet_of(SITE, CATALOGUE), seed=seed, keep_steps=False)
    try:
        world.run_for(1.0)
        id_ = world.submit("Good", {"target": Place(120.0, -60.0)})
        world.run_until_ended(id_)
        record = world.task(id_)

        assert (record.status, record.code, record.reason) == ("SUCCEEDED", "", "")
    finally:
        world.close()
