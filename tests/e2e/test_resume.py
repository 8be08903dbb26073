"""The engine's process is killed in mid-flight, over real Zenoh, and started again: the flight ends as if nothing had been."""

import json
import os
import re
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from urllib.request import urlopen

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.inputs import read_world
from formiga_bt.engine.kernel.inputs import GoalEventInput
from formiga_bt.journal.store import Journal
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.test_service import Shell, new_site, wait_for_agents

pytestmark = pytest.mark.network
ROOT = Path(__file__).parents[2]
SLOW = ("--speed", "10")
"""An outage lasts some seconds of wall time here; a leg should last longer."""


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    yield made
    made.close()


def wait(is_met: Callable[[], object], within_s: float = 40.0, what: str = "") -> None:
    until = time.monotonic() + within_s
    while not is_met():
        assert time.monotonic() < until, f"waited in vain: {what}"
        time.sleep(0.1)


def kill(shell: Shell) -> None:
    engine = shell.engines[-1]
    os.kill(engine.pid, signal.SIGKILL)
    engine.wait()


def flying(shell: Shell, action: str) -> bool:
    (engine,) = find_engines(shell.folder)  # quicker than a command, for at this speed a leg is short
    with urlopen(f"{engine.url}/v1/agents", timeout=20) as answer:
        return any(agent["action"] == action for agent in json.loads(answer.read())["agents"])


def fleet(shell: Shell, address: EngineAddress, folder: Path, actions: Sequence[Path] = ()) -> FleetProcesses:
    world = read_world(actions, shell.folder / "site.yaml")
    assert world.site is not None
    specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id != "watcher_1"]
    return FleetProcesses(specs, site=world.site.name, connect=address.endpoint, state_dir=folder)


def is_logged(shell: Shell, task_id: str) -> bool:
    """Return whether the flight log knows that a task's flight is under way; of one found in the air it has no task."""
    return any(task_id in file.read_text(encoding="utf-8") for file in shell.folder.glob(".formiga/*/flying.json"))


def flights(shell: Shell) -> list[tuple[str, str, str]]:
    (file,) = shell.folder.glob(".formiga/*/flights.jsonl")
    found = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return [(one["agent"], one["task"], one["landed_by"]) for one in found]


def goals_begun(shell: Shell, site: str) -> Counter[str]:
    """Return how often an agent said that it begins a goal, by the journal of all starts."""
    begun: Counter[str] = Counter()
    with Journal(shell.folder / f".formiga/{site}/journal.db", site, read_only=True) as journal:
        for kept in journal.read():
            given = kept.step.input
            if isinstance(given, GoalEventInput) and given.event.state == "accepted" and given.event.n == 1:
                begun[given.event.goal_id] += 1
    return begun


def test_killed_in_flight_and_gone_on(shell: Shell, tmp_path: Path) -> None:
    address = shell.up("--desk", "watcher_1", *SLOW)
    again = ("--desk", "watcher_1", "--listen", address.endpoint, *SLOW)
    with fleet(shell, address, tmp_path / "sim"):
        wait_for_agents(shell, 5)
        shell.run("run", "Hello", "--param", "target=lake_shore")
        for some in (("TakeOff", "GoTo"), ("GoTo",)):
            wait(
                lambda some=some: any(flying(shell, one) for one in some) and is_logged(shell, "Hello-1"),
                what=f"{some}\n{shell.run('why', 'Hello-1')}",
            )
            kill(shell)
            shell.up(*again)
        wait(lambda: "SUCCEEDED" in shell.run("tasks"), what="the end of Hello-1")
        shell.run("down", "--yes")
        said = shell.ended()
        assert re.search(
            r"  resume  resumed after \d+\.\d s: Hello-1; what became of their goals is asked now", said
        ), said
        assert re.search(r"resumed after \d+\.\d s: Hello-1 goes on", said), said
        ((_, task, landed_by),) = flights(shell)
        assert (task, landed_by) == ("Hello-1", "task")
        assert all(n == 1 for n in goals_begun(shell, "my_meadow").values())

        shell.up(*again)  # and after a clean end: nothing is left, and no id comes twice
        wait_for_agents(shell, 5)
        assert "Hello-2" in shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "GoTo"), what="a leg of Hello-2")
        file = shell.folder / "trees/hello.yaml"
        before = file.read_text(encoding="utf-8")
        shell.run("down", "--yes")  # its agents fly on
        assert "not ended: Hello-2; their agents go on with the goals they have" in shell.ended()
        file.write_text(before + "# another version\n", encoding="utf-8")
        shell.up(*again)
        wait(lambda: re.search(r"Hello-2 .*SUCCEEDED", shell.run("tasks")), what="the end of Hello-2")
        wait_for_agents(shell, 5)
        shell.run("down", "--yes")


def test_after_a_long_outage_a_person_says_that_it_goes_on(shell: Shell, tmp_path: Path) -> None:
    site = shell.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8") + "resume_hold_after: 0 s\n", encoding="utf-8")
    address = shell.up("--desk", "watcher_1", *SLOW)
    with fleet(shell, address, tmp_path / "sim"):
        wait_for_agents(shell, 5)
        shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "TakeOff"), what="the take-off")
        kill(shell)
        shell.up("--desk", "watcher_1", "--listen", address.endpoint, *SLOW)
        wait(lambda: "HELD" in shell.run("tasks"), what="it is held")
        said = shell.run("why", "Hello-1")
        assert "HELD: it was interrupted by an outage; a person must say that it may go on" in said
        wait(lambda: "formiga continue Hello-1" in shell.run("why", "Hello-1"), what="its machine is heard of")
        shell.run("continue", "Hello-1")
        wait(lambda: "SUCCEEDED" in shell.run("tasks"), what="the end of Hello-1")
        shell.run("down", "--yes")
        assert "they wait for a person, for the outage was long; see formiga why Hello-1" in shell.ended()


def test_an_engine_that_was_stopped_goes_on_and_no_machine_is_lost(shell: Shell, tmp_path: Path) -> None:
    """SIGSTOP for longer than `lost_after`: nobody was silent, the engine was deaf."""
    actions = tmp_path / "actions.yaml"
    shipped = (ROOT / "actions/base.yaml").read_text(encoding="utf-8")
    quick = shipped.replace("suspect_after: 3 s\n    lost_after: 30 s", "suspect_after: 1 s\n    lost_after: 3 s")
    assert quick != shipped
    actions.write_text(quick, encoding="utf-8")
    site = shell.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8") + "actions: []\n", encoding="utf-8")
    address = shell.up("--desk", "watcher_1", "--actions", str(actions), "--speed", "5")
    with fleet(shell, address, tmp_path / "sim", [actions]):
        wait_for_agents(shell, 5)
        shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "GoTo"), what="a leg of Hello-1")
        engine = shell.engines[-1]
        os.kill(engine.pid, signal.SIGSTOP)
        time.sleep(6.0)  # the process must really stand still for longer than `lost_after`
        os.kill(engine.pid, signal.SIGCONT)
        wait(lambda: "SUCCEEDED" in shell.run("tasks"), what="the end of Hello-1")
        shell.run("down", "--yes")
        said = shell.ended()
        assert re.search(r"on after a standstill of \d+\.\d s: Hello-1 goes on", said), said
        assert all(n == 1 for n in goals_begun(shell, "my_meadow").values())
