"""The reckoning of charge against what simulated drones use: never too low, seldom much too high."""

import importlib.util
import statistics
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCH = Path(__file__).resolve().parents[3] / "benchmarks" / "bench_energy.py"


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bench_energy", BENCH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["bench_energy"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_flight_uses_more_than_was_reckoned(bench: ModuleType, seed: int) -> None:
    errors = bench.fly(flights=60, seed=seed)

    assert min(errors.legs) >= -0.001
    assert min(errors.home) >= -0.001


def test_a_tail_wind_and_the_last_seconds_of_a_landing_are_all_that_is_kept_for_nothing(bench: ModuleType) -> None:
    errors = bench.fly(flights=100, seed=4)

    assert statistics.median(errors.legs) < 0.01
    assert statistics.median(errors.home) < 0.5
    assert max(errors.home) < 3.0
