"""The engine's process is killed (SIGKILL) at chosen and at random instants; the agents' own books tell that nothing was lost.

A few of many: `benchmarks/kills.py` makes hundreds (docs/reliability.md).
"""

from pathlib import Path

import pytest

from tests.e2e.killing import WORK, Kill, Killing
from tests.e2e.killing_judge import judge

pytestmark = pytest.mark.network
TWO = [work for work in WORK if work[0] in ("Asked", "Tidy")]
"""One asks a person on the ground and in the air, one is aborted in the air and tidies up."""
FEW = ("lwd_1", "lwd_2", "watcher_1")


def test_killed_between_send_and_answer_at_random_and_while_it_asks(tmp_path: Path) -> None:
    with Killing(tmp_path / "site", speed=20.0, most_open=2, work=TWO, only=FEW) as run:
        run.life(Kill("after_send", 3))
        run.life(Kill("in_reconcile", 1))
        run.end()
    assert [death.point for death in run.deaths] == ["after_send", "random", "in_reconcile"]
    found = judge(tmp_path / "site", run.accepted, run.deaths, run.held)
    assert found.is_good, found.text()
    assert (
        found.right == found.accepted >= len(run.accepted) >= 2
    )  # an engine may die before it has said that it accepted
