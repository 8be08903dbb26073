"""A scenario's agents as processes beside an engine that runs elsewhere, with tasks, faults and orders on its clock.

`Stage` follows the engine's beats on the wire, so that a scenario's seconds are the engine's. Used by `formiga sim`.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import msgspec

from agents_sim.launch import FleetProcesses
from agents_sim.referee import Verdict
from formiga_bt.agent.pacing import PacedScheduler
from formiga_bt.base.clock import SECOND, monotonic_us, wall_clock_us
from formiga_bt.base.errors import FormigaError, TransportError
from formiga_bt.lang.scenario import Scenario, ScenarioFault, ScenarioOrder, ScenarioTask
from formiga_bt.rehearsal.simulation import Timetable, play, specs_of
from formiga_bt.transport.messages import AgentStatus, ClockBeat
from formiga_bt.transport.zenoh_agent import ZenohObserver
from formiga_bt.transport.zenoh_keys import CLOCK, STATUS

ENGINE_S: Final = 5.0
"""Wall time in which an engine must be heard."""
READY_S: Final = 30.0


class Stage:
    """A context manager: the agents run inside, none is left after.

    Args:
        scenario: what to play.
        connect: the engine's endpoint.
        ask: takes a task or an order when it is due.
    """

    def __init__(self, scenario: Scenario, connect: str, ask: Callable[[ScenarioTask | ScenarioOrder], None]) -> None:
        self.agents = [agent.id for agent in scenario.agents]
        self.ready: set[str] = set()
        self._site = scenario.site.name
        self._connect = connect
        self._ask = ask
        self._table = Timetable(scenario)
        self._clock = PacedScheduler(monotonic_us, wall_clock_us(), scenario.speed)
        self._observer = ZenohObserver(self._site, connect=connect)
        self._folder = tempfile.TemporaryDirectory(prefix="formiga-sim-")
        self._down: set[str] = set()
        self.fleet = FleetProcesses(
            specs_of(scenario, with_base=True),
            site=self._site,
            connect=connect,
            state_dir=Path(self._folder.name),
            referee=True,
        )

    def __enter__(self) -> Self:
        """Find the engine, then start the agents.

        Raises:
            FormigaError: no engine of this site is heard at the endpoint.
        """
        try:
            self._find_engine()
            self.fleet.__enter__()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End all processes; may be called twice."""
        self.fleet.close()
        self._observer.close()
        self._folder.cleanup()

    @property
    def speed(self) -> float:
        """Return the speed of the engine's clock."""
        return self._clock.speed

    @property
    def all_played(self) -> bool:
        """Return whether every task and order was asked for and every fault played."""
        return self._table.is_done

    def verdict(self) -> Verdict:
        """Return the referee's verdict; its process ends."""
        return self.fleet.verdict()

    def wait_ready(self, tell: Callable[[str], None] = lambda _: None) -> None:
        """Wait until every agent is there, then start the scenario's clock.

        Raises:
            FormigaError: some are still missing after 30 s.
        """
        until = time.monotonic() + READY_S
        while missing := [agent for agent in self.agents if agent not in self.ready]:
            if time.monotonic() > until:
                raise FormigaError(f"agents did not come up within {READY_S:g} s: {', '.join(missing)}")
            before = set(self.ready)
            self._listen()
            self._check()
            for agent in sorted(self.ready - before):
                tell(agent)
            time.sleep(0.02)
        self._table.begin(self._clock.now())

    def step(self, most_s: float = 0.2) -> list[ScenarioFault]:
        """Wait a little, then ask for and play what is due; return the faults played.

        Raises:
            FormigaError: an agent's process ended by itself.
        """
        at = self._table.next_time()
        wait_s = most_s if at is None else min(most_s, (at - self._clock.now()) / SECOND / self._clock.speed)
        time.sleep(max(0.0, wait_s))
        self._listen()
        self._check()
        faults = []
        for entry in self._table.due(self._clock.now()):
            if not isinstance(entry, ScenarioFault):
                self._ask(entry)
                continue
            if entry.kind in ("kill", "restart"):
                (self._down.add if entry.kind == "kill" else self._down.discard)(entry.agent)
            play(entry, self.fleet)
            faults.append(entry)
        return faults

    def _find_engine(self) -> None:
        until, is_open = time.monotonic() + ENGINE_S, False
        while not self._clock.has_beat:
            if time.monotonic() > until:
                what = "an engine, but not of this site" if is_open else "no engine"
                raise FormigaError(f"{what} answers at {self._connect} (site '{self._site}')")
            try:
                if not is_open:
                    self._observer.open(CLOCK.of_all, STATUS.of_all)
                    is_open = True
            except TransportError:
                time.sleep(0.2)
            self._listen()
            time.sleep(0.02)

    def _listen(self) -> None:
        for key, raw in self._observer.poll():
            try:
                if key == CLOCK.of_all:
                    self._clock.on_beat(msgspec.json.decode(raw, type=ClockBeat))
                else:
                    status = msgspec.json.decode(raw, type=AgentStatus)
                    if status.beat > 0:  # it has heard the engine
                        self.ready.add(status.id)
            except msgspec.DecodeError:
                continue  # somebody speaks nonsense, on purpose perhaps

    def _check(self) -> None:
        for agent, code in self.fleet.ended().items():
            if agent not in self._down:
                said = self.fleet.log_of(agent).read_text(errors="replace").strip().splitlines()[-3:]
                why = " / ".join(said) or "it said nothing"
                raise FormigaError(f"the process of {agent} ended with status {code}: {why}")
