"""Ground machines under random faults: clean runs, and six planted bugs that the monitor must see.

Many more runs: `python -m tests.safety.ground --seeds 0-1999`.
"""

import pytest

from tests.safety.ground import play
from tests.safety.ground_bugs import BUGS

PINS = {
    "two_on_one_edge": (0, "two on one edge"),
    "an_edge_is_nobodys": (4, "two on one edge"),
    "no_go_is_not_looked_at": (0, "a no-go region entered"),
    "a_door_closes_on_whom_it_likes": (1, "a door closed on a robot"),
    "a_room_is_let_go_early": (1, "two in the room"),
    "what_is_ahead_is_forgotten": (1, "two touched"),
}


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_runs_with_faults_are_clean(seed: int) -> None:
    run = play(seed)

    assert run.found == {}
    assert run.counts["SUCCEEDED"] > 0


@pytest.mark.parametrize("bug", BUGS)
def test_a_planted_bug_is_caught(bug: str) -> None:
    seed, what = PINS[bug]

    assert what in play(seed, bug).found
