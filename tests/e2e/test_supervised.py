"""What a supervisor hears of `formiga up`, and sees of it: by the commands that `deploy/` has, in real processes."""

import ast
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from configparser import ConfigParser
from pathlib import Path

import pytest

from formiga_bt.services.supervised import Supervisor
from tests.e2e.test_service import Shell, new_site

pytestmark = pytest.mark.network
DEPLOY = Path(__file__).parents[2] / "deploy"


class Unit(ConfigParser):
    """A unit file; keys are as written."""

    def optionxform(self, optionstr: str) -> str:
        return optionstr


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    yield made
    made.close()


@pytest.fixture
def heard(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(40)
        yield listener


def start(shell: Shell, notify: Path, *words: str) -> "subprocess.Popen[str]":
    """Start what a file of `deploy/` starts, on free ports, with the interpreter of this test."""
    shell.environment = {"NOTIFY_SOCKET": str(notify)}
    shell.engines.append(shell.start(*words))
    return shell.engines[-1]


def test_systemd_hears_that_it_is_ready_works_hangs_and_ends(
    shell: Shell, tmp_path: Path, heard: socket.socket
) -> None:
    unit = Unit(strict=False)
    unit.read(DEPLOY / "formiga@.service")
    service = unit["Service"]
    program, *words = shlex.split(service["ExecStart"])
    assert (service["Type"], program) == ("notify", "/usr/local/lib/formiga/bin/formiga")
    engine = start(shell, tmp_path / "notify", *words, "--http", "127.0.0.1:0")
    assert heard.recv(100) == b"READY=1"
    assert [heard.recv(100) for _ in range(3)] == [b"WATCHDOG=1"] * 3

    engine.send_signal(signal.SIGSTOP)
    heard.settimeout(3)
    with pytest.raises(TimeoutError):
        list(iter(lambda: heard.recv(100), b""))
    assert float(service["WatchdogSec"]) > 15, "an engine that counts as standing still is told before it is killed"
    engine.send_signal(signal.SIGCONT)
    heard.settimeout(40)
    assert heard.recv(100) == b"WATCHDOG=1"

    engine.send_signal(getattr(signal, service["KillSignal"]))
    begun = time.monotonic()
    while heard.recv(100) != b"STOPPING=1":
        pass
    assert engine.wait(float(service["TimeoutStopSec"])) == 0, (
        "it ended because it was asked to: it is not started again"
    )
    assert time.monotonic() - begun < float(service["TimeoutStopSec"])


def test_a_container_is_healthy_while_its_engine_works(shell: Shell, tmp_path: Path, heard: socket.socket) -> None:
    text = (DEPLOY / "Containerfile").read_text(encoding="utf-8")
    (command,) = (ast.literal_eval(found) for found in re.findall(r"^CMD (\[.*\])$", text, re.MULTILINE))
    (check,) = (ast.literal_eval(found) for found in re.findall(r"^\s+CMD (\[\"python.*\])$", text, re.MULTILINE))
    assert re.findall(r"^USER (\d+):(\d+)$", text, re.MULTILINE) == [("10001", "10001")]
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])

    def is_healthy() -> bool:
        words = [sys.executable, *(one.replace("8420", port) for one in check[1:])]
        return subprocess.run(words, check=False, capture_output=True).returncode == 0

    assert not is_healthy()
    engine = start(shell, tmp_path / "notify", *(one.replace("8420", port) for one in command))
    assert heard.recv(100) == b"READY=1"
    assert is_healthy()
    engine.send_signal(signal.SIGSTOP)
    assert not is_healthy()
    engine.send_signal(signal.SIGCONT)
    engine.send_signal(signal.SIGTERM)
    assert engine.wait(30) == 0


def test_nobody_who_listens_holds_nobody_up(tmp_path: Path) -> None:
    for path in ("", str(tmp_path / "nothing"), "@formiga-nothing"):
        Supervisor({"NOTIFY_SOCKET": path}).ready()
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as full:
        full.bind(str(tmp_path / "full"))
        begun = time.monotonic()
        for _ in range(5000):
            Supervisor({"NOTIFY_SOCKET": str(tmp_path / "full")}).ready()
        assert time.monotonic() - begun < 20
    assert os.path.exists(tmp_path / "full")
