"""`formiga demo` as people and scripts run it: a process of its own, interrupted in flight, interrupted twice."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.e2e.conftest import SHORT
from tests.e2e.rig import agent_pid, children, is_running, wait_until, world
from tests.unit.cli.test_own_types import CRANE, STEPS
from tests.unit.cli.test_own_types import DAY as LIFTING
from tests.unit.cli.test_own_types import SITE as OWN

pytestmark = pytest.mark.network


ONE_DIES = """
scenario: one-dies
site: {site}
speed: 20
agents:
  - {{id: lwd_1, type: lwd, at: p1}}
  - {{id: hwd_1, type: hwd, at: p5}}
  - {{id: picker_1, type: picker, at: north_field}}
  - {{id: watcher_1, type: watcher, at: camp}}
tasks:
  - {{at: 0 s, task: ExploreRegion, params: {{region: lake}}}}
  - {{at: 0 s, task: PickUp, params: {{target: north_field, user: picker_1}}}}
"""
SITE = Path(__file__).resolve().parents[2] / "trees" / "demo-site.yaml"
SOON_LOST = dict.fromkeys(SHORT, "suspect_after: 4 s\n    lost_after: 8 s")
"""Longer than `SHORT`: while nine processes start, a busy computer keeps one waiting for more than 2 s."""
SOON = """
from pathlib import Path
from formiga_bt.cli import main
from formiga_bt.lang.site import catalogues
catalogues.shipped_catalogues = lambda: {{"base": Path({actions!r})}}
main()
"""
"""`formiga`, but of another catalogue: in it a drone that is silent is lost soon, which is counted in wall time."""


class Command:
    """`formiga demo --headless --speed 20` under way."""

    def __init__(self, folder: Path, *words: str, program: tuple[str, str] = ("-m", "formiga_bt")) -> None:
        self.folder = folder
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, *program, "demo", "--headless", "--speed", "20", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, "TMPDIR": str(folder), "PYTHONWARNINGS": "error"},
            text=True,
        )
        self.agents: set[int] = set()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    def wait_for(self, pattern: str, within_s: float = 25.0) -> None:
        wait_until(lambda: re.search(pattern, self.text) or self.process.poll() is not None, within_s, pattern)
        assert re.search(pattern, self.text), self.text
        self.agents |= children(self.process.pid)

    def ended(self, within_s: float) -> int:
        """Return the exit status; nothing it started may be left."""
        try:
            code = self.process.wait(within_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"still running after {within_s:g} s:\n{self.text}") from None
        self._reader.join(5.0)
        assert not self._reader.is_alive()
        assert not [pid for pid in self.agents if is_running(pid)], self.text
        assert list(self.folder.iterdir()) == []
        assert "Traceback" not in self.text, self.text
        return code

    def kill(self) -> None:
        """End it and what it started, by pid."""
        self.agents |= children(self.process.pid)
        self.process.kill()
        self.process.wait()
        for pid in self.agents:
            if is_running(pid):
                os.kill(pid, signal.SIGKILL)
        self._reader.join(5.0)
        assert self.process.stdout is not None
        self.process.stdout.close()


Demo = Callable[..., Command]


@pytest.fixture
def demo() -> Iterator[Demo]:
    commands: list[Command] = []
    folders: list[tempfile.TemporaryDirectory[str]] = []

    def start(*words: str, **options: tuple[str, str]) -> Command:
        folders.append(tempfile.TemporaryDirectory())
        commands.append(Command(Path(folders[-1].name), *words, **options))
        return commands[-1]

    yield start
    for command in commands:
        command.kill()
    for folder in folders:
        folder.cleanup()


def test_it_flies_and_ends_with_a_table(demo: Demo) -> None:
    run = demo()
    run.wait_for(r"MoveTask-1: lwd_1\.TakeOff")
    assert len(run.agents) == 10  # and the referee
    assert run.ended(45.0) == 0
    assert run.lines[0] == "starting 9 agents, each a process of its own, at 20x"
    head = next(i for i, line in enumerate(run.lines) if line.startswith("Missions"))
    cells = [[c.strip() for c in line.split("│")[1:-1]] for line in run.lines[head:] if line.startswith("│")]
    cells = [row for row in cells if row[0]]  # a narrow terminal breaks rows
    assert [(row[0], row[4]) for row in cells] == [
        ("MoveTask-1", "SUCCEEDED"),
        ("ExploreRegion-2", "SUCCEEDED"),
        ("PickUp-3", "SUCCEEDED"),
        ("WatchDogSOS-4", "SUCCEEDED"),
        ("WatchDogRequest-5", "SUCCEEDED"),
    ]
    assert cells[0][1:3] == ["lwd_1", "5"]  # it stands away from its port: people are asked before its rotors turn
    assert all(re.fullmatch(r"\d+ s", row[3]) for row in cells)
    assert re.search(r"crashes: 0, .*closest pass: \d+ m \(", run.text)
    assert run.lines[-1].startswith("All tasks succeeded. Next: ")
    times = [float(line.split()[0]) for line in run.lines if re.match(r" +\d+\.\d s  ", line)]
    assert len(times) > 30


@pytest.mark.slow
def test_all_ten_missions_fly_at_once_without_a_crash(demo: Demo) -> None:
    run = demo("--scenario", "ten", "--speed", "12")

    assert run.ended(240.0) == 0
    assert len(re.findall(r"^.*-\d+ SUCCEEDED$", run.text, re.MULTILINE)) == 10
    assert "crashes: 0, starts near people without clearance: 0, low flights: 0" in run.text


def test_rovers_a_lift_and_a_door_of_a_warehouse_work_without_a_collision(demo: Demo) -> None:
    run = demo("--scenario", "warehouse", "--speed", "15")

    assert run.ended(120.0) == 0
    assert len(re.findall(r"^.*-\d+ SUCCEEDED$", run.text, re.MULTILINE)) == 3
    assert "crashes: 0" in run.text


def test_an_agent_that_dies_by_itself_is_told_and_the_rest_goes_on(demo: Demo, tmp_path: Path) -> None:
    (tmp_path / "dies.yaml").write_text(ONE_DIES.format(site=SITE), encoding="utf-8")
    world(tmp_path, SOON_LOST)
    program = SOON.format(actions=str(tmp_path / "actions.yaml"))
    run = demo("--scenario", str(tmp_path / "dies.yaml"), program=("-c", program))
    run.wait_for(r"ExploreRegion-1: lwd_1\.GoTo")
    os.kill(agent_pid(run.process.pid, "lwd_1"), signal.SIGKILL)
    run.wait_for("the process of lwd_1 ended with status -9: .*; the demo goes on without it")
    assert run.ended(90.0) == 1
    assert re.search(r"ExploreRegion-1 FAILED: agent_lost", run.text)
    assert re.search(r"^PickUp-2 .*SUCCEEDED", run.text.partition("Missions")[2].replace("│ ", ""), re.MULTILINE)


def test_a_type_of_ones_own_is_shown_as_it_checks(demo: Demo, tmp_path: Path) -> None:
    (tmp_path / "actions").mkdir()
    (tmp_path / "trees").mkdir()
    for name, text in {"site": OWN, "actions/crane": CRANE, "lifting": LIFTING}.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "trees" / "lift.yaml").write_text(f"formiga: 1\ntask: Lift\n{STEPS}", encoding="utf-8")
    run = demo("--scenario", str(tmp_path / "lifting.yaml"))

    assert run.ended(90.0) == 0
    assert "Lift-1: crane_1.Winch" in run.text
    assert "crashes: 0" in run.text


def test_ctrl_c_in_flight_aborts_lands_and_says_130(demo: Demo) -> None:
    run = demo()
    run.wait_for(r"PickUp-3: hwd_\d\.GoTo")
    run.process.send_signal(signal.SIGINT)
    run.wait_for("Ctrl-C: aborting the tasks")
    assert run.ended(30.0) == 130
    ends = re.findall(r"(\S+-\d) (CANCELED|FAILED|SUCCEEDED): ?(\S*)", run.text)
    assert ("PickUp-3", "CANCELED", "aborted") in ends
    assert ("WatchDogRequest-5", "CANCELED", "aborted") in ends
    assert re.search(r"PickUp-3: hwd_\d\.LandIn", run.text)  # home, not left in the air
    assert re.search(r"crashes: 0", run.text)
    assert run.lines[-1] == "Interrupted: the tasks were aborted and the drones brought home."


def test_a_second_ctrl_c_ends_at_once_and_leaves_no_process(demo: Demo) -> None:
    run = demo()
    run.wait_for(r"PickUp-3: hwd_\d\.GoTo")
    run.process.send_signal(signal.SIGINT)
    run.wait_for("Ctrl-C: aborting the tasks")
    run.process.send_signal(signal.SIGINT)
    assert run.ended(8.0) == 130
    assert "brought home." not in run.text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_agents_come_up_leaves_no_process(demo: Demo, number: signal.Signals) -> None:
    run = demo()
    run.wait_for("starting 9 agents")
    wait_until(lambda: len(children(run.process.pid)) > 2, what="the first agents are started")
    run.agents = children(run.process.pid)
    run.process.send_signal(number)
    assert run.ended(15.0) == 128 + number


def test_a_port_that_is_taken_is_said_in_words(demo: Demo) -> None:
    import socket

    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        run = demo("--listen", f"tcp/127.0.0.1:{other.getsockname()[1]}")
        assert run.ended(15.0) == 1
    assert re.search(r"formiga: cannot open Zenoh at tcp/127\.0\.0\.1:\d+: ", run.text)
    assert "is another engine running there?" in run.text
