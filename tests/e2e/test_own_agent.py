"""The page docs/agent.md, followed: its commands in order, with real processes over Zenoh on the loopback."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.transport.zenoh_session import free_endpoint

pytestmark = pytest.mark.network

PAGE = (Path(__file__).parents[2] / "docs" / "agent.md").read_text(encoding="utf-8")
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]
WITHIN_S = 40.0


class Yard:
    """A folder, and the processes that were started in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.running: list[subprocess.Popen[str]] = []
        self.environment = {**os.environ, "PYTHONUNBUFFERED": "1"}

    def start(self, *words: str) -> "subprocess.Popen[str]":
        program = [sys.executable, *(["-m", "formiga_bt"] if words[0] == "formiga" else []), *words[1:]]
        with (self.folder / f"{len(self.running)}.log").open("w") as log:
            one = subprocess.Popen(
                program,
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                text=True,
            )
        self.running.append(one)
        return one

    def run(self, *words: str) -> str:
        one = self.start(*words)
        said = self.folder / f"{len(self.running) - 1}.log"
        assert one.wait(WITHIN_S) == 0, f"{words}: {one.returncode}\n{said.read_text()}{self.logs()}"
        return said.read_text()

    def wait_for(self, text: str) -> None:
        end = time.monotonic() + WITHIN_S
        while text not in self.logs():
            assert time.monotonic() < end, f"waited in vain for {text!r}\n{self.logs()}"
            time.sleep(0.02)

    def logs(self) -> str:
        return "".join(path.read_text() for path in sorted(self.folder.glob("*.log")))

    def close(self) -> None:
        for one in reversed(self.running):
            if one.poll() is None:
                one.send_signal(signal.SIGTERM)
        for one in self.running:
            try:
                one.wait(10)
            except subprocess.TimeoutExpired:
                one.kill()
                one.wait()


@pytest.fixture
def yard(tmp_path: Path) -> Iterator[Yard]:
    yard = Yard(tmp_path)
    yield yard
    yard.close()


def elsewhere(folder: Path) -> None:
    """Let the engine listen at a free port, and the agent connect there: other tests run beside this one."""
    endpoint = free_endpoint("tcp/127.0.0.1:0")
    site, agent = folder / "site.yaml", folder / "mule.py"
    site.write_text(site.read_text().replace("tcp/127.0.0.1:7447", endpoint))
    agent.write_text(agent.read_text().replace('site="', f'connect="{endpoint}", site="'))


def test_the_page_is_followed_to_the_first_goal(yard: Yard) -> None:
    new, up, start, run, _ = (line.split() for line in COMMANDS)
    yard.run(*new)
    elsewhere(yard.folder)
    agent_file, doc = yard.folder / "mule.py", '"""Go to a place and look around there."""'
    assert doc in agent_file.read_text()
    attaches = f'{doc}\n        self.attach("seen.txt", b"a wall", "text/plain")'
    agent_file.write_text(agent_file.read_text().replace(doc, attaches))
    engine = yard.start(*up, "--http", "127.0.0.1:0", "--speed", "10")
    yard.wait_for("http://")
    agent = yard.start(*start)
    assert "succeeded" in yard.run(*run)
    saved = yard.run("formiga", "files", "TryMule-1", "--save", "files")
    assert "seen.txt" in saved
    assert (yard.folder / "files" / "seen.txt").read_bytes() == b"a wall"
    agent.send_signal(signal.SIGTERM)
    assert agent.wait(10) == 0, yard.logs()
    engine.send_signal(signal.SIGTERM)
    assert engine.wait(20) == 0, yard.logs()
    assert "action_refused" not in yard.logs()


def test_the_page_is_followed_at_a_site_with_keys(yard: Yard) -> None:
    """Three processes that believe nobody without a certificate; the router is started anew while the mule is on its way."""
    new, up, _, run, start = (line.split() for line in COMMANDS)
    yard.run(*new)
    yard.run("formiga", "access", "ca")
    assert "hand it the folder" in yard.run("formiga", "access", "agent", "mule_1")
    site = yard.folder / "site.yaml"
    (name,) = re.findall(r"^name: (\w+)", site.read_text(), re.MULTILINE)
    endpoint, keys = free_endpoint("tls/127.0.0.1:0"), f".formiga/{name}/keys"
    site.write_text(site.read_text().replace("listen: tcp/127.0.0.1:7447", f'listen: "{endpoint}", keys: {keys}'))
    yard.run("formiga", "access", "agent", "mule_1", "--renew")  # says where the router is now
    (yard.folder / keys / "mule_1").rename(yard.folder / "mule_1")
    yard.start("formiga", "router")
    yard.wait_for("it lets in the engine and mule_1")
    engine = yard.start(*up, "--http", "127.0.0.1:0", "--speed", "1")
    yard.wait_for("http://")
    agent = yard.start(*start)
    yard.wait_for("mule_1 is here")
    task = yard.start(*run)
    yard.wait_for("VisitMule running")
    yard.run("formiga", "router", "--restart", "--yes")
    assert task.wait(WITHIN_S) == 0, yard.logs()
    assert "VisitMule succeeded" in yard.logs()
    for one in (agent, engine):
        one.send_signal(signal.SIGTERM)
        assert one.wait(20) == 0, yard.logs()
    assert "refused" not in yard.logs()
