"""Scale: hundreds of missions on 200 agents; nothing lost, nobody left assigned, no crash; equal under two hash seeds."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shares import in_ci

BENCH = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_virtual_fleet.py"
TASKS = [20, *in_ci([150])]
"""In a round of 114 every picker calls and every light drone goes home; then the pickers call again."""


@pytest.mark.slow
@pytest.mark.parametrize("tasks", TASKS)
def test_missions_on_200_agents_all_end_well_and_the_same_under_two_hash_seeds(tasks: int) -> None:
    """The benchmark flies 1,000 by default; its exit status tells of lost, failed, left assigned or crashed."""
    runs = [
        subprocess.Popen(
            [sys.executable, str(BENCH), "--tasks", str(tasks)],
            env={**os.environ, "PYTHONHASHSEED": seed}, stdout=subprocess.PIPE, text=True,
        )
        for seed in ("1", "77")
    ]  # fmt: skip
    outputs = [run.communicate(timeout=240)[0] for run in runs]

    assert [run.returncode for run in runs] == [0, 0], outputs
    assert all(f"outcomes: {{'SUCCEEDED': {tasks}}}" in text for text in outputs)
    logs = [re.search(r"step log: (\w+)", text) for text in outputs]
    assert logs[0] is not None
    assert logs[1] is not None
    assert logs[0][1] == logs[1][1]
