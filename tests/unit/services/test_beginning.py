"""At which engine time a start begins: mode real lives in the time of the wall clock."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import MOST_AHEAD, SECOND, Micros
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Site
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.services.beginning import ClockAhead, begin_at
from formiga_bt.services.kept.resuming import Comeback, Sign
from tests.golden import Wording

WALL: Micros = 1_800_000_000 * SECOND
HOUR = 3600 * SECOND


@pytest.fixture
def real() -> Site:
    return replace(packaged_world()[0], mode="real")


def back(folder: Path, at: Micros, speed: float = 1.0) -> Comeback:
    return Comeback(EngineState(now=at), Sign(WALL - HOUR, at, speed), folder)


def test_mode_real_begins_at_the_wall_clock_or_a_little_ahead_of_it(real: Site, tmp_path: Path) -> None:
    assert begin_at(real, WALL - HOUR, None, WALL) <= WALL
    assert begin_at(real, WALL - HOUR, back(tmp_path, WALL - HOUR, 5.0), WALL) <= WALL, "no speed of an outage"
    near = WALL + MOST_AHEAD
    assert begin_at(real, near, None, WALL) == begin_at(real, WALL, back(tmp_path, near), WALL) == near


def test_a_history_far_ahead_of_the_wall_clock_does_not_start_in_mode_real(
    real: Site, tmp_path: Path, wording: Wording
) -> None:
    """After `--speed 5` for an hour engine time was four hours ahead, and stayed so for ever."""
    far = WALL + 4 * HOUR
    for reached, comeback in ((far, None), (WALL, back(tmp_path, far))):
        with pytest.raises(ClockAhead) as refused:
            begin_at(real, reached, comeback, WALL)
        assert refused.value.code == "clock_ahead"
        assert str(refused.value).startswith("clock_ahead: ")
        wording(str(refused.value))
        assert "--start-anew" in str(refused.value)
    assert begin_at(replace(real, mode="simulation"), far, None, WALL) == 0, "a simulation goes on from what it knows"
