"""`formiga demo --ask-me` and `--stay`: the demo's engine is a service that the other verbs find in the same folder."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.e2e.rig import children, is_running

pytestmark = pytest.mark.network

SCENARIO = """
scenario: one-drone
site: {site}
speed: 20
agents:
  - {{id: hwd_1, type: hwd, at: p5}}
  - {{id: watcher_1, type: watcher, at: camp}}
tasks:
  - {{at: 0 s, task: WatchDogSOS, params: {{alarmtype: sos, target: camp}}}}
"""
SITE = Path(__file__).resolve().parents[2] / "trees" / "demo-site.yaml"


def formiga(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "formiga_bt", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=30, stdin=subprocess.DEVNULL)


def test_the_watcher_answers_by_command_and_the_fleet_stays_until_ctrl_c(tmp_path: Path) -> None:
    """Without a terminal the command is named; the answered mission succeeds; a further task flies; Ctrl-C ends all."""
    (tmp_path / "one.yaml").write_text(SCENARIO.format(site=SITE))
    log = tmp_path / "log.txt"
    with log.open("w") as out:
        demo = subprocess.Popen(
            [sys.executable, "-m", "formiga_bt", "demo", "--headless", "--ask-me", "--stay", "--scenario", "one.yaml"],
            cwd=tmp_path, stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
    agents: set[int] = set()

    def wait_for(pattern: str, within_s: float = 40.0) -> re.Match[str]:
        end = time.monotonic() + within_s
        while time.monotonic() < end:
            agents.update(children(demo.pid))
            found = re.search(pattern, log.read_text())
            if found:
                return found
            assert demo.poll() is None, log.read_text()
            time.sleep(0.05)
        raise AssertionError(f"no {pattern!r} in\n{log.read_text()}")

    try:
        number = wait_for(r"answer with: formiga answer (Q\d+) yes")[1]
        answered = formiga(tmp_path, "answer", number, "yes")
        assert answered.returncode == 0, answered.stderr
        wait_for(r"WatchDogSOS-1 SUCCEEDED")
        wait_for(r"engine and fleet stay")
        more = formiga(tmp_path, "run", "MoveTask", "--param", "robot=hwd_1")
        assert more.returncode == 0, more.stderr + more.stdout
        wait_for(r"MoveTask-2 SUCCEEDED")
        demo.send_signal(signal.SIGINT)
        assert demo.wait(20.0) == 0, log.read_text()
        assert not [pid for pid in agents if is_running(pid)]
        assert "no engine" in formiga(tmp_path, "tasks").stderr.lower()
    finally:
        demo.kill()
        demo.wait()
        for pid in agents:
            if is_running(pid):
                os.kill(pid, signal.SIGKILL)
