"""Sites of real processes under torture, a little of it: `benchmarks/torture.py` plays hours (docs/reliability.md).

Stories of what was found once, and a short round whose faults are drawn from a fixed seed. What was wrong is judged from
outside, by what the agents and the client noted.
"""

from pathlib import Path

import pytest

from benchmarks.torture_bench.play import play
from benchmarks.torture_bench.privileged import available
from benchmarks.torture_bench.scenarios import SCENARIOS

pytestmark = pytest.mark.network
QUICK = ("forgets", "standstill")
"""Others look into the live journal before a kill; an engine stands still for longer than machines may be silent."""
HELD = ("bad_folder", "deaf_clients", "starve", "stray", "way_home")


@pytest.mark.parametrize("story", QUICK)
def test_what_was_found_once_does_not_come_back(story: str, tmp_path: Path) -> None:
    assert SCENARIOS[story](tmp_path / "site") == []


def test_a_short_round(tmp_path: Path) -> None:
    done = play(tmp_path / "site", 3, 0, 6.0, frozenset(), gentle=True)
    assert done.findings == []
    assert done.tasks >= 1
    assert sum(done.faults.values()) >= 1


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.parametrize("story", HELD)
def test_more_of_what_was_found_once(story: str, tmp_path: Path) -> None:
    assert SCENARIOS[story](tmp_path / "site") == []


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.parametrize("privilege", ["mount", "netns"])
def test_a_round_that_needs_a_privileged_user(privilege: str, tmp_path: Path) -> None:
    """A disk that is full or read-only, a network that is cut."""
    if privilege not in available():
        pytest.skip(f"{privilege} is not to be had here")
    done = play(tmp_path / "site", 5, 0, 20.0, frozenset({privilege}), gentle=True)
    assert done.findings == []
