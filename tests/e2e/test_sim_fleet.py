"""What the documents tell to try: the fleet in one terminal, the engine in another; the engine is killed, and started again."""

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.transport.zenoh_session import free_endpoint
from tests.e2e.test_resume import flying, goals_begun, kill, wait
from tests.e2e.test_service import Shell, new_site, wait_for_agents

pytestmark = [pytest.mark.network, pytest.mark.slow]


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    site = made.folder / "site.yaml"
    endpoint = free_endpoint("tcp/127.0.0.1:0")
    site.write_text(site.read_text(encoding="utf-8").replace("tcp/127.0.0.1:0", endpoint), encoding="utf-8")
    yield made
    made.close()


def test_a_fleet_of_its_own_lives_on_and_the_next_engine_goes_on_with_the_mission(shell: Shell) -> None:
    fleet = shell.start("sim", *(word for who in ("hwd_1", "picker_1", "watcher_1") for word in ("--without", who)))
    try:
        shell.up("--speed", "10")
        wait_for_agents(shell, 2)
        shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "TakeOff") or flying(shell, "GoTo"), what="a drone in the air")
        kill(shell)
        shell.up("--speed", "10")
        said = shell.run("sim", code=1)
        assert "the agents of the site 'my_meadow' are simulated already (process " in said
        wait(lambda: "SUCCEEDED" in shell.run("tasks"), what="the end of Hello-1")
        shell.run("down", "--yes")
        assert re.search(r"resumed after \d+\.\d s: Hello-1 goes on", shell.ended())
        said = shell.run("up", "--sim", code=1)
        assert "help: start the engine without --sim, they connect to it" in said
        fleet.send_signal(signal.SIGINT)
        told, _ = fleet.communicate(timeout=30)
    finally:
        fleet.kill()
        fleet.wait()
    assert fleet.returncode == 0, told
    assert told.startswith(
        "simulated, each a process of its own: lwd_1, lwd_2\nthey look for the engine of my_meadow at tcp/"
    )
    # It looks now and then: an engine that lived for seconds only may go unseen on a busy machine.
    assert "an engine is there (start 2), its clock runs at 10x" in told
    assert told.endswith("the agents are gone\n")
    begun = goals_begun(shell, "my_meadow")
    assert begun
    assert set(begun.values()) == {1}
