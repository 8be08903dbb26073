"""A folder whose engine was killed: every verb shows what its journal has, and a new engine shows it through the API."""

import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.client import Client, PastClient
from tests.e2e.test_resume import wait
from tests.e2e.test_service import Shell, new_site, wait_for_agents

pytestmark = pytest.mark.network


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    yield made
    made.close()


def test_what_a_killed_engine_left_can_be_seen(shell: Shell) -> None:
    shell.up("--sim")
    wait_for_agents(shell, 5)
    shell.run("run", "Hello", "--param", "target=lake_shore", "--follow")
    wait(lambda: "SUCCEEDED" in shell.run("tasks"), what="the end of Hello-1")
    live = shell.run("show", "Hello-1", "--ascii")
    os.kill(shell.engines[-1].pid, signal.SIGKILL)
    shell.engines[-1].wait()

    said = shell.run("show", "Hello-1", "--ascii")
    first, _, tree = said.partition("\n")
    assert re.fullmatch(r"no engine runs; the journal of my_meadow as of \d{4}-\d\d-\d\d \d\d:\d\d:\d\d", first)
    assert live == tree
    assert "ACTIVE" in shell.run("show", "Hello-1", "--at", "Hello-1 end -1 s", "--ascii") or "ENDING" in said
    assert "Hello-1 SUCCEEDED" in shell.run("why", "Hello-1")
    assert "TakeOff: succeeded" in shell.run("replay", "--task", "Hello-1")
    shell.run("replay", "--task", "Hello-1", "--as-test", "story.test.yaml")
    assert "1 case passed" in shell.run("test", "story.test.yaml")
    assert "(snapshots)" in shell.run("journal", "stats")

    address = shell.up("--sim")
    assert live == shell.run("show", "Hello-1", "--ascii")
    past = PastClient(Client(address), "Hello-1 start").task("Hello-1")
    assert past.task.status in ("PENDING", "ACTIVE")
    assert "an engine writes" in shell.run("journal", "compact", code=1)
    shell.run("down", "--yes")
