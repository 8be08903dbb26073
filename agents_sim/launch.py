"""Each simulated agent of a fleet as its own OS process, started and ended together; for `sim`, `demo` and tests.

Processes are ended by their own pid, with a bound. They stand in sessions of their own (a Ctrl-C at the terminal is the
demo's to handle), and end by themselves when the process that started them is gone.
"""

import contextlib
import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import IO, Final, Self

import msgspec

from agents_sim.bodies import check_spec
from agents_sim.faults import Order
from agents_sim.ledger import judge
from agents_sim.referee import Referee, Verdict
from agents_sim.spec import AgentSpec
from formiga_bt.base.geo import Place

END_S: Final = 5.0
"""Time from SIGTERM to SIGKILL for a process that does not end."""

FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS})
"""What a disk says that takes nothing any more."""

REFEREE: Final = "referee"
"""The name of the referee's log; no agent may be called so."""


def command(spec: AgentSpec, *, site: str, connect: str, state_dir: Path, keys: Path | None = None) -> list[str]:
    """Return the command line of one agent's process, without the interpreter."""
    at = [spec.at.east_m, spec.at.north_m, *([] if isinstance(spec.at, Place) else [spec.at.up_m])]
    words = ["-m", "agents_sim", "--id", spec.id, "--type", spec.type, "--site", site, "--connect", connect]
    # Values that may begin with a minus go in one word.
    words += [f"--at={_numbers(at)}", f"--battery={spec.battery!r}", "--state-dir", str(state_dir)]
    if keys is not None:
        words += ["--keys", str(keys / spec.id)]
    if spec.kind:
        words += ["--kind", spec.kind]
    if spec.home is not None:
        words += [f"--home={_numbers([spec.home.east_m, spec.home.north_m])}"]
    if spec.limits:
        words += ["--limits", ",".join(f"{name}={float(number)!r}" for name, number in sorted(spec.limits.items()))]
    if spec.does is not None:
        words += ["--does", msgspec.json.encode(spec.does).decode()]
    if spec.outcomes:
        words += ["--outcomes", msgspec.json.encode(spec.outcomes).decode()]
    if spec.seed:
        words += ["--seed", str(spec.seed)]
    if spec.chargers:
        words += ["--chargers=" + ";".join(_numbers([place.east_m, place.north_m]) for place in spec.chargers)]
    if spec.script:
        words += ["--script", json.dumps([dict(rule) for rule in spec.script])]
    if spec.walk:
        words += ["--walk=" + ";".join(_numbers([place.east_m, place.north_m]) for place in spec.walk)]
    if spec.base is not None:
        words += [f"--base={_numbers(spec.base)}"]
    if any(spec.wind):
        words += [f"--wind={_numbers(spec.wind)}"]
    if spec.payload_kg:
        words += [f"--payload={float(spec.payload_kg)!r}"]
    if spec.cut:
        words += ["--cut"]
    words += ["--on-link-loss", spec.on_link_loss]
    return [*words, "--orders", "--exit-with-parent", str(os.getpid())]


class FleetProcesses:
    """A context manager: agents run inside, none is left after.

    Args:
        specs: the agents.
        site: the site's name.
        connect: the engine's endpoint.
        state_dir: folder for the agents' files: bodies, ledgers, and what they print (`<id>.log`).
        keys: the site's folder of keys, which has one for each agent; None: the wire has none.
        referee: whether a referee runs beside them, who publishes what it sees each second (`watch`).

    Raises:
        ValueError: a spec is wrong, or two have the same id.
    """

    def __init__(
        self,
        specs: Iterable[AgentSpec],
        *,
        site: str,
        connect: str,
        state_dir: Path,
        keys: Path | None = None,
        referee: bool = False,
    ) -> None:
        self._keys = keys
        self._site = site
        self._connect = connect
        self._state_dir = state_dir
        self._specs: dict[str, AgentSpec] = {}
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._has_referee = referee
        self._referee: subprocess.Popen[bytes] | None = None
        for spec in specs:
            self._take(spec)

    def __enter__(self) -> Self:
        try:
            for agent in self._specs:
                self.start(agent)
            if self._has_referee:
                self._start_referee()
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
        self._take(spec)
        self.start(spec.id)

    def _take(self, spec: AgentSpec) -> None:
        if spec.id in self._specs or spec.id == REFEREE:
            raise ValueError(f"two agents have the id {spec.id}")
        check_spec(spec)
        self._specs[spec.id] = spec

    def start(self, agent: str) -> None:
        """Start an agent's process; one that runs is left alone."""
        if self.is_running(agent):
            return
        words = command(
            self._specs[agent], site=self._site, connect=self._connect, state_dir=self._state_dir, keys=self._keys
        )
        if agent in self._processes:
            self._hang_up(self._processes[agent])
        self._processes[agent] = self._spawn(words, agent)

    def _start_referee(self) -> None:
        words = ["-m", "agents_sim.watch", "--site", self._site, "--connect", self._connect]
        words += ["--state-dir", str(self._state_dir), "--exit-with-parent", str(os.getpid())]
        self._referee = self._spawn(words, REFEREE)

    def _spawn(self, words: list[str], name: str) -> "subprocess.Popen[bytes]":
        with self._open_log(name) as log:
            return subprocess.Popen(
                [sys.executable, *words],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                bufsize=0,
            )

    def _open_log(self, name: str) -> IO[bytes]:
        """Open the log of a process; on a full disk it has none, and what it prints is lost."""
        try:
            self._state_dir.mkdir(parents=True, exist_ok=True)
            return self.log_of(name).open("ab")
        except OSError as error:
            if error.errno not in FULL:
                raise
            return Path(os.devnull).open("ab")

    @staticmethod
    def _hang_up(process: "subprocess.Popen[bytes]") -> None:
        if process.stdin is not None:
            process.stdin.close()

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

    def last_words(self, agent: str) -> str:
        """Return the last lines that an agent printed, in one line."""
        try:
            lines = self.log_of(agent).read_text(encoding="utf-8", errors="replace").strip().splitlines()[-3:]
        except OSError:
            lines = []
        return " / ".join(lines) or "it said nothing"

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

    def order(self, agent: str, order: Order) -> None:
        """Let an agent play a fault; nothing happens if its process has ended."""
        pipe = self._processes[agent].stdin
        if pipe is not None and self.is_running(agent):
            with contextlib.suppress(BrokenPipeError):
                pipe.write(msgspec.json.encode(order) + b"\n")

    def take_over(self, agent: str) -> None:
        """Let the pilot take a drone over."""
        self._processes[agent].send_signal(signal.SIGUSR1)

    def hand_back(self, agent: str) -> None:
        """Let the pilot hand a drone back."""
        self._processes[agent].send_signal(signal.SIGUSR2)

    def verdict(self) -> Verdict:
        """Return the referee's verdict on all motion up to now, from the agents' own ledgers.

        The referee's process ends with it; if there is none (or it fails), the ledgers are judged here.
        """
        process = self._referee
        if process is not None and process.poll() is None:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(END_S)
            with contextlib.suppress(msgspec.DecodeError, OSError):
                said = self.log_of(REFEREE).read_bytes().strip().split(b"\n")[-1]
                return msgspec.json.decode(said, type=Verdict)
        referee = Referee()
        return referee.verdict(judge(self._state_dir, referee))

    def close(self) -> None:
        """End all processes: asked first, killed after `END_S` together. May be called twice."""
        processes = [*self._processes.values(), *([self._referee] if self._referee is not None else [])]
        running = [process for process in processes if process.poll() is None]
        for process in running:
            process.send_signal(signal.SIGCONT)  # a frozen one could not hear
            process.terminate()
        for process in running:
            try:
                process.wait(END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for process in processes:
            self._hang_up(process)


def _numbers(numbers: Iterable[float]) -> str:
    return ",".join(repr(float(number)) for number in numbers)
