"""Worlds for the end-to-end tests, and the proof that they leave no process behind."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.e2e.rig import Rig, children, is_running, people_placed, world

SHORT = {
    "suspect_after: 3 s\n    lost_after: 30 s": "suspect_after: 1500 ms\n    lost_after: 2 s",
}
"""Liveness of machines in which a test need not wait long."""


@pytest.fixture(autouse=True)
def no_process_is_left() -> Iterator[None]:
    """Fail a test that leaves a child process."""
    before = children(os.getpid())
    yield
    assert children(os.getpid()) <= before


@pytest.fixture
def fly(tmp_path: Path) -> Iterator[Callable[..., Rig]]:
    """Start a rig at 20x; it is ended with the test, and its processes and files must be gone then."""
    rigs: list[Rig] = []

    def start(*, short: bool = False, speed: float = 20.0, **options: str) -> Rig:
        site, catalogue, tasks = world(tmp_path, SHORT if short else {})
        rig = Rig(site, catalogue, tasks, specs=people_placed(site, catalogue), speed=speed, **options)
        rigs.append(rig)
        return rig.__enter__()

    yield start
    for rig in rigs:
        rig.close()
    for rig in rigs:
        assert rig.driver.error is None, rig.story()
        assert not [pid for pid in rig.pids if is_running(pid)]
        assert not rig.folder.exists()
