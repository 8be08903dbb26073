"""A newcomer's path, by the commands alone: init, up, run, tasks, why, down; agents are processes over Zenoh."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import read_world
from formiga_bt.client import Client
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.rig import agent_pid

pytestmark = pytest.mark.network

ASK = """\
formiga: 1
task: Ask
agents: {watcher: {type: watcher}}
steps:
  - ask: Is it good?
    of: [watcher]
    options: [yes_it_is, no_not_yet]
    timeout: 30 min
"""
UP = ("up", "--http", "127.0.0.1:0", "--speed", "20")


LASTING = frozenset({"up", "sim", "demo", "watch", "mcp", "--follow"})
"""Words of commands that go on until they are told to end."""


class Shell:
    """A terminal in a folder.

    Args:
        folder: where commands run.
        in_process: commands that end by themselves run in the process of the test. A process of its own for each takes half a
            second; that every verb is one, the tests of this file show, and those of `formiga access` and of approvals.
    """

    def __init__(self, folder: Path, *, in_process: bool = True) -> None:
        self.folder = folder
        self.in_process = in_process
        self.engines: list[subprocess.Popen[str]] = []
        self.environment: dict[str, str] = {}
        self.program: tuple[str, ...] = ("-m", "formiga_bt")

    def start(self, *words: str) -> "subprocess.Popen[str]":
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", **self.environment}
        return subprocess.Popen(
            [sys.executable, *self.program, *words], cwd=self.folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip

    def run(self, *words: str, code: int = 0) -> str:
        """Run a command; return what it said."""
        if self.in_process and self.program == ("-m", "formiga_bt") and not self.environment and not LASTING & {*words}:
            ended, said = self._run_here(words)
            assert ended == code, f"{words}: {ended}\n{said}"
            return said
        process = self.start(*words)
        said, _ = process.communicate(timeout=90)
        assert process.returncode == code, f"{words}: {process.returncode}\n{said}"
        return said

    def _run_here(self, words: Sequence[str]) -> tuple[int, str]:
        with (
            tempfile.TemporaryFile("w+", encoding="utf-8") as out, open(os.devnull, encoding="utf-8") as nothing,
            contextlib.chdir(self.folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(out),
            pytest.MonkeyPatch.context() as patch,
        ):  # fmt: skip
            patch.setattr(sys, "stdin", nothing)
            code = run(words)
            out.seek(0)
            return code, out.read()

    def json(self, *words: str) -> Any:
        return json.loads(self.run(*words, "--json"))

    def up(self, *words: str) -> EngineAddress:
        """Start an engine; return where it is. Its site takes a free port: tests run side by side."""
        site = self.folder / "site.yaml"
        assert not site.exists() or ":7447" not in site.read_text(encoding="utf-8")
        self.engines.append(self.start(*UP, *words))
        until = time.monotonic() + 30
        while not (found := find_engines(self.folder)):
            assert self.engines[-1].poll() is None, self.engines[-1].communicate()[0]
            assert time.monotonic() < until
            time.sleep(0.05)
        return found[0]

    def ended(self, code: int = 0) -> str:
        """Wait until the newest engine has ended; return what it said."""
        said, _ = self.engines[-1].communicate(timeout=60)
        assert self.engines[-1].returncode == code, said
        return said

    def close(self) -> None:
        for engine in self.engines:
            if engine.poll() is None:
                engine.kill()
            engine.wait()
            if engine.stdout and not engine.stdout.closed:
                engine.stdout.close()


def new_site(folder: Path, *, in_process: bool = True) -> Shell:
    """Make a site as a newcomer does; its engine takes a free port."""
    made = Shell(folder, in_process=in_process)
    said = made.run("init", "my meadow")
    assert "next: cd" in said
    made.folder = folder / "my meadow"
    site = made.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8").replace(":7447", ":0"), encoding="utf-8")
    return made


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path, in_process=False)
    yield made
    made.close()


def wait_for_agents(shell: Shell, number: int) -> None:
    (engine,) = find_engines(shell.folder)
    until = time.monotonic() + 30
    while True:
        agents = Client(engine).agents().agents
        if sum(a.at is not None or a.at_desk for a in agents) >= number:
            return
        assert time.monotonic() < until, agents
        time.sleep(0.05)


def test_the_main_path(shell: Shell, tmp_path: Path) -> None:
    assert "ok: 1 file, 0 errors, 0 warnings" in shell.run(
        "check", "--strict", "trees/hello.yaml", "--site", "site.yaml"
    )
    assert "SUCCEEDED" in shell.run("dryrun", "trees/hello.yaml", "--site", "site.yaml")
    (shell.folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    address = shell.up("--desk", "watcher_1")
    world = read_world((), shell.folder / "site.yaml")
    assert world.site is not None
    specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id != "watcher_1"]
    with FleetProcesses(specs, site=world.site.name, connect=address.endpoint, state_dir=tmp_path / "sim"):
        wait_for_agents(shell, 5)

        said = shell.run("run", "Hello", "--param", "target=lake_shore", "--follow")

        assert re.search(r"^Hello-1 SUCCEEDED after \d+ s, 4 actions by lwd_\d$", said, re.MULTILINE), said
        assert "next: formiga tasks" in said
        assert re.search(r"^Hello-1 +SUCCEEDED", shell.run("tasks"), re.MULTILINE)
        assert "others that fitted: lwd_" in shell.run("why", "Hello-1")
        assert "STANDBY" in shell.run("agents")
        assert "PickUp" in shell.run("tasks", "--library")

        asking = shell.start("run", "Ask", "--follow")
        until = time.monotonic() + 20
        while not any(q["shown"] for q in shell.json("inbox")["questions"]):
            assert time.monotonic() < until
            time.sleep(0.2)
        assert "next: formiga answer Q1 yes_it_is" in shell.run("inbox")
        assert "choose from yes_it_is, no_not_yet" in shell.run("answer", "Q1", "perhaps", code=1)
        assert "Q1 is answered: yes_it_is by watcher_1" in shell.run("answer", "Q1", "yes_it_is")
        said, _ = asking.communicate(timeout=30)
        assert asking.returncode == 0, said
        assert "answer: formiga answer Q1 yes_it_is|no_not_yet" in said

        assert "the engine ends" in shell.run("down")
        assert "the engine has ended" in shell.ended()


def test_one_command_starts_engine_and_simulated_agents(shell: Shell) -> None:
    shell.up("--sim")
    wait_for_agents(shell, 5)

    end = shell.json("run", "Hello", "--follow", "--priority", "high")

    assert (end["task"]["status"], end["task"]["priority"], len(end["actions"])) == ("SUCCEEDED", "high", 4)
    assert "ended" in shell.run("down", "--drain")
    assert "Hello-1 SUCCEEDED" in shell.ended()


def test_a_simulated_agent_that_dies_is_told_and_started_again(shell: Shell) -> None:
    shell.up("--sim")
    wait_for_agents(shell, 5)
    killed = agent_pid(shell.engines[-1].pid, "lwd_1")
    os.kill(killed, signal.SIGKILL)
    until = time.monotonic() + 20
    while True:
        with contextlib.suppress(AssertionError):
            if agent_pid(shell.engines[-1].pid, "lwd_1") != killed:
                break
        assert time.monotonic() < until
        time.sleep(0.1)
    wait_for_agents(shell, 5)
    shell.run("down")
    said = shell.ended()
    assert said.count("the process of the simulated lwd_1 ended with status -9") == 1
    assert "it was started again (1 of at most 3 times)" in said


def test_a_task_that_waits_tells_why_and_ctrl_c_aborts_it(shell: Shell) -> None:
    shell.up("--speed", "1")
    process = shell.start("run", "Hello", "--follow")
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line)
        if "as long as it takes" in line or "FAILED" in line:
            break
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=30)
    said = "".join(lines) + rest
    assert process.returncode == 130, said
    assert "drone: no lwd that fits is free" in said
    assert "Hello-1 CANCELED" in said
    assert shell.run("tasks", "--status", "open").startswith("no tasks that are open")


def test_ctrl_c_lands_everything_and_sigterm_ends_at_once(shell: Shell) -> None:
    shell.up("--sim", "--speed", "5")
    wait_for_agents(shell, 5)
    shell.run("run", "Hello")
    until = time.monotonic() + 40
    while not any(a["action"] == "GoTo" for a in shell.json("agents")["agents"]):
        assert time.monotonic() < until
        time.sleep(0.1)
    shell.engines[-1].send_signal(signal.SIGINT)
    said = shell.ended()
    assert "1 task is aborted; waiting until their machines have landed" in said
    assert "Ctrl-C again: end now, the simulated agents too" in said
    assert "Hello-1 CANCELED: aborted by Ctrl-C" in said

    shell.up()
    assert shell.run("run", "Hello").startswith("Hello-2")
    shell.engines[-1].send_signal(signal.SIGTERM)
    assert "not ended: Hello-2" in shell.ended()


def test_what_is_wrong_is_told_and_the_engine_goes_on(shell: Shell) -> None:
    shell.in_process = True
    no = shell.run("tasks", code=1)
    assert "no engine runs for" in no
    assert "formiga up" in no
    (shell.folder / "trees" / "broken.yaml").write_text("formiga: 1\ntask: Broken\nsteps: [\n", encoding="utf-8")
    address = shell.up()

    second = shell.run(*UP, code=1)
    assert second.startswith(
        f"formiga: an engine runs on the site 'my_meadow' already (process {address.pid}, {address.url})"
    )
    assert "did you mean Hello?" in shell.run("run", "Helo", code=1)
    wrong = shell.run("run", "Hello", "-p", "height=40", "-p", "hight=40 m", code=1)
    assert "needs a unit" in wrong
    assert "no parameter 'hight'" in wrong
    assert "is not NAME=VALUE" in shell.run("run", "Hello", "-p", "height", code=2)
    assert "cannot read" in shell.run("run", "Hello", "-p", "target=@nope.geojson", code=2)
    assert "there is no task 'Nope-1', and no agent" in shell.run("why", "Nope-1", code=1)
    assert "no task is ever 'foo'" in shell.run("tasks", "--status", "foo", code=1)
    assert "there is no question 'Q9'" in shell.run("answer", "Q9", "yes", code=1)
    assert "there is no agent 'hwd_9'" in shell.run("agents", "clear", "hwd_9", code=1)
    assert "confirm it with --yes" in shell.run("abort", shell.json("run", "Hello")["id"], "--abandon", code=2)
    assert "make a site with `formiga init`" in shell.run("up", "--site", "nope.yaml", code=2)
    assert "is not low, medium or high" in shell.run("run", "Hello", "--priority", "urgent", code=2)

    elsewhere = shell.folder.parent / "other"
    shell.run("init", str(elsewhere))
    other = Shell(elsewhere)
    taken = other.run("up", "--http", address.url.removeprefix("http://"), code=1)
    assert "cannot serve the API at" in taken
    assert "--http" in taken
    assert "no engine runs for" in other.run("tasks", code=1)
    assert "Hello-1" in other.run("tasks", "--site", str(shell.folder / "site.yaml"))

    shell.run("down")
    assert "broken.yaml is not served" in shell.ended()
    assert "no_such_file.yaml" in shell.run("up", "--tasks", "no_such_file.yaml", code=2)


def test_the_demo_site_needs_no_file(tmp_path: Path) -> None:
    shell = Shell(tmp_path)
    (tmp_path / "trees").mkdir()
    (tmp_path / "trees" / "typo.yaml").write_text("formiga: 1\ntsk: Typo\n", encoding="utf-8")
    try:
        address = shell.up("--site", "demo", "--listen", "tcp/127.0.0.1:0")
        assert address.site == "rovaniemi"
        said = shell.run("sim", "demo")
        assert "PickUp-3" in said
        shell.run("down")
        assert "1 file is no task: trees/typo.yaml" in shell.ended()
    finally:
        shell.close()


def test_init_changes_nothing_that_is_there(shell: Shell) -> None:
    before = (shell.folder / "site.yaml").read_text(encoding="utf-8")
    said = shell.run("init", code=2)
    assert "there already; nothing was changed" in said
    assert (shell.folder / "site.yaml").read_text(encoding="utf-8") == before


def test_the_commands_of_the_readme(tmp_path: Path) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    block = readme.partition("## Your own site")[2].split("```")[1]
    lines = [line.partition("#")[0].strip() for line in block.strip().splitlines()]
    assert [line.split()[1] for line in lines] == ["init", "up", "run", "why", "down"]
    first, _, folder = lines[0].partition(" && cd ")
    shell = Shell(tmp_path, in_process=False)
    shell.run(*first.split()[1:])
    shell.folder = tmp_path / folder
    site = shell.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8").replace(":7447", ":0"), encoding="utf-8")
    try:
        shell.up(*lines[1].split()[2:])
        wait_for_agents(shell, 5)
        said = [shell.run(*line.split()[1:]) for line in lines[2:]]
        assert "Hello-1 SUCCEEDED" in said[0]
        assert "the engine has ended" in shell.ended()
    finally:
        shell.close()
