"""Each simulated agent of a fleet as its own OS process, started and ended together; for `sim`, `demo` and tests.

Processes are ended by their own pid, with a bound. They stand in sessions of their own (a Ctrl-C at the terminal is the
demo's to handle), and end by themselves when the process that started them is gone.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from agents_sim.world import AgentSpec, drone_limits, is_person
from formiga_bt.geo import Place

END_S: Final = 5.0
"""So long a process may take to end after SIGTERM, before SIGKILL."""


def command(spec: AgentSpec, *, site: str, connect: str, state_dir: Path) -> list[str]:
    """Return the command line of one agent's process, without the interpreter."""
    at = [spec.at.east_m, spec.at.north_m, *([] if isinstance(spec.at, Place) else [spec.at.up_m])]
    words = ["-m", "agents_sim", "--id", spec.id, "--type", spec.type, "--site", site, "--connect", connect]
    # Values that may begin with a minus go in one word.
    words += [f"--at={_numbers(at)}", f"--battery={spec.battery!r}", "--state-dir", str(state_dir)]
    if spec.kind:
        words += ["--kind", spec.kind]
    if spec.home is not None:
        words += [f"--home={_numbers([spec.home.east_m, spec.home.north_m])}"]
    if spec.limits:
        words += ["--limits", ",".join(f"{name}={float(number)!r}" for name, number in sorted(spec.limits.items()))]
    if spec.script:
        words += ["--script", json.dumps([dict(rule) for rule in spec.script])]
    return [*words, "--exit-with-parent", str(os.getpid())]


class FleetProcesses:
    """A context manager: agents run inside, none is left after.

    Args:
        specs: the agents.
        site: the site's name.
        connect: the engine's endpoint.
        state_dir: folder for the agents' files: bodies, ledgers, and what they print (`<id>.log`).

    Raises:
        ValueError: a spec is wrong, or two have the same id.
    """

    def __init__(self, specs: Iterable[AgentSpec], *, site: str, connect: str, state_dir: Path) -> None:
        self._site = site
        self._connect = connect
        self._state_dir = state_dir
        self._specs: dict[str, AgentSpec] = {}
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        for spec in specs:
            if spec.id in self._specs:
                raise ValueError(f"two agents have the id {spec.id}")
            if not is_person(spec):
                drone_limits(spec)
            self._specs[spec.id] = spec

    def __enter__(self) -> Self:
        try:
            for agent in self._specs:
                self.start(agent)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, spec: AgentSpec) -> None:
        """Add and start one more agent."""
        if spec.id in self._specs:
            raise ValueError(f"two agents have the id {spec.id}")
        self._specs[spec.id] = spec
        self.start(spec.id)

    def start(self, agent: str) -> None:
        """Start an agent's process; one that runs is left alone."""
        if self.is_running(agent):
            return
        self._state_dir.mkdir(parents=True, exist_ok=True)
        words = command(self._specs[agent], site=self._site, connect=self._connect, state_dir=self._state_dir)
        with self.log_of(agent).open("ab") as log:
            self._processes[agent] = subprocess.Popen(
                [sys.executable, *words],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def is_running(self, agent: str) -> bool:
        """Return whether an agent's process runs (a frozen one does)."""
        process = self._processes.get(agent)
        return process is not None and process.poll() is None

    def pid(self, agent: str) -> int:
        """Return the pid of an agent's process, the last one it had."""
        return self._processes[agent].pid

    def log_of(self, agent: str) -> Path:
        """Return the file with what an agent printed."""
        return self._state_dir / f"{agent}.log"

    def ended(self) -> dict[str, int]:
        """Return the agents whose process has ended, with its exit status (minus the signal)."""
        codes = {agent: process.poll() for agent, process in self._processes.items()}
        return {agent: code for agent, code in codes.items() if code is not None}

    def kill(self, agent: str) -> None:
        """Kill an agent's process (SIGKILL) and wait until it is gone."""
        process = self._processes[agent]
        process.kill()
        process.wait()

    def restart(self, agent: str) -> None:
        """Start an agent again, killing its process first if it runs. A drone is found where its file says."""
        if self.is_running(agent):
            self.kill(agent)
        self.start(agent)

    def freeze(self, agent: str) -> None:
        """Stop an agent's process (SIGSTOP)."""
        self._processes[agent].send_signal(signal.SIGSTOP)

    def thaw(self, agent: str) -> None:
        """Let a frozen process go on."""
        self._processes[agent].send_signal(signal.SIGCONT)

    def take_over(self, agent: str) -> None:
        """Let the pilot take a drone over."""
        self._processes[agent].send_signal(signal.SIGUSR1)

    def hand_back(self, agent: str) -> None:
        """Let the pilot hand a drone back."""
        self._processes[agent].send_signal(signal.SIGUSR2)

    def close(self) -> None:
        """End all processes: asked first, killed after `END_S` together. May be called twice."""
        running = [process for process in self._processes.values() if process.poll() is None]
        for process in running:
            process.send_signal(signal.SIGCONT)  # a frozen one could not hear
            process.terminate()
        for process in running:
            try:
                process.wait(END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _numbers(numbers: Iterable[float]) -> str:
    return ",".join(repr(float(number)) for number in numbers)
