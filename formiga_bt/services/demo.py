"""The demo: an engine in this process, each agent in a process of its own, Zenoh between them on the loopback.

`Demo` is the run without any display, `ScenarioDemo` one that plays a scenario; `cli/integrator/demo.py` shows it. Everything
it starts it ends, also when it is interrupted.
"""

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from agents_sim.launch import FleetProcesses
from agents_sim.referee import Verdict
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, Submit
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.scenario import Scenario, ScenarioFault, ScenarioOrder
from formiga_bt.rehearsal.simulation import SILENT, Played, Timetable, site_of, specs_of, waiting_for_people
from formiga_bt.services.listening import check_listen
from formiga_bt.show.history.runlog import RunLog
from formiga_bt.transport.desk import OpenQuestion
from formiga_bt.transport.zenoh import ZenohTransport

if TYPE_CHECKING:
    from formiga_bt.services.host import EngineHost

READY_S = 30.0
"""Wall time in which all agents must have announced themselves."""
FREE_PORT = "tcp/127.0.0.1:0"
FREE_HTTP = "127.0.0.1:0"


class Demo:
    """One demo run; a context manager.

    Args:
        site, catalogue, tasks: what the engine is made of.
        speed: engine seconds per wall second.
        listen: the engine's endpoint; port 0 takes a free one.
        specs: the agents.
        referee: whether a referee runs as a process beside them.
        serve: run the engine as a service with its runtime folder here, so that the other verbs find it.
        desk: with `serve`, people who answer at this machine instead of being simulated: id -> type.
    """

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        tasks: Sequence[Task],
        *,
        speed: float,
        listen: str = FREE_PORT,
        specs: Sequence[AgentSpec],
        referee: bool = False,
        serve: Path | None = None,
        desk: Mapping[str, str] | None = None,
    ) -> None:
        self.site = site
        self.log = RunLog()
        self._steps: SimpleQueue[EngineStep] = SimpleQueue()
        check_listen(site, listen, where="--listen")
        self._transport = ZenohTransport(site.name, listen=listen)
        self.speed = speed
        models = {task.name: task for task in tasks}
        self.host: EngineHost | None = None
        if serve is not None:
            from formiga_bt.services import host  # loads the web server: only where it is wanted

            self.host = host.EngineHost(
                site, catalogue, models, beside=serve, speed=speed, http=FREE_HTTP, desk=desk, wires=[self._transport],
                listeners=[self._steps.put],
            )  # fmt: skip
        else:
            engine = Engine(site, catalogue, models)
            self.driver = RealtimeDriver(engine, [self._transport], speed=speed, listeners=[self._steps.put])
        self._specs = list(specs)
        self._has_referee = referee
        self.down: set[str] = set()
        """Agents whose processes are meant to be gone."""
        self._folder = tempfile.TemporaryDirectory(prefix="formiga-demo-")
        self.fleet: FleetProcesses | None = None
        self._aborted: set[str] = set()
        self.died: dict[str, str] = {}
        """Agents whose processes ended by themselves, and how; the engine handles the loss."""

    def __enter__(self) -> "Demo":
        try:
            if self.host is not None:
                self.host.__enter__()
                self.driver = self.host.driver
            else:
                self.driver.start()
            self.fleet = FleetProcesses(
                self._specs,
                site=self.site.name,
                connect=self._transport.endpoint,
                state_dir=self.folder,
                referee=self._has_referee,
            )
            self.fleet.__enter__()
            if self.host is not None:
                self.host.with_simulated = True
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def folder(self) -> Path:
        """Return the folder of the agents' files."""
        return Path(self._folder.name)

    @property
    def endpoint(self) -> str:
        """Return where agents connect."""
        return self._transport.endpoint

    @property
    def agents(self) -> list[str]:
        """Return the ids of the fleet."""
        return [spec.id for spec in self._specs]

    def close(self) -> None:
        """End the agents' processes and the engine; may be called twice."""
        if self.fleet is not None:
            self.fleet.close()
        if self.host is not None:
            self.host.close()
        else:
            self.driver.stop()
        self._folder.cleanup()

    def take(self, seconds: float) -> None:
        """Take what the engine did in so much wall time.

        Raises:
            FormigaError: the engine stopped.
        """
        until = time.monotonic() + seconds
        while True:
            try:
                self.log.feed(self._steps.get(timeout=max(0.0, until - time.monotonic())))
            except Empty:
                break
        if self.driver.error is not None:
            raise FormigaError(f"the engine stopped by a bug: {self.driver.error!r}") from self.driver.error

    def pump(self, seconds: float) -> None:
        """Take what the engine did in so much wall time, and note in `died` whose process ended by itself.

        Raises:
            FormigaError: the engine stopped.
        """
        self.take(seconds)
        if self.fleet is None:
            return
        for agent, code in self.fleet.ended().items():
            if agent not in self.down and agent not in self.died:
                said = self.fleet.last_words(agent)
                self.died[agent] = f"the process of {agent} ended with status {code}: {said}"

    def wait_ready(self, show: Callable[[list[str]], None]) -> None:
        """Wait until every agent is there and has told where it is; `show` gets those that are missing.

        Raises:
            FormigaError: some are still missing after 30 s, or the process of one ended.
        """
        until = time.monotonic() + READY_S
        while True:
            missing = self.missing()
            show(missing)
            if not missing:
                return
            if time.monotonic() > until:
                raise FormigaError(f"agents did not come up within {READY_S:g} s: {', '.join(missing)}")
            self.pump(0.1)
            if self.died:
                raise FormigaError("\n".join(self.died.values()))

    def missing(self) -> list[str]:
        """Return the agents that are not ready."""
        known = self.log.state.agents
        return [one for one in self.agents if one not in known or not _is_ready(known[one])]

    def submit(self, requests: Sequence[Submit]) -> list[str]:
        """Submit tasks; return their ids."""
        replies = [self.driver.ask(request) for request in requests]
        return [reply.task for reply in replies if isinstance(reply, Accepted)]

    def abort_all(self) -> None:
        """Abort every task not yet aborted and not ending; call it again for those that come in meanwhile."""
        for task in list(self.log.state.tasks.values()):
            if task.section == "done" or task.system.agent or task.id in self._aborted:
                continue
            self._aborted.add(task.id)
            with suppress(TaskError):  # it is ending already, which is what was wanted
                self.driver.ask(Abort(task.id, by="Ctrl-C"))

    def ended(self, task_ids: Sequence[str]) -> bool:
        """Return whether these tasks have ended."""
        tasks = self.log.state.tasks
        return all(t in tasks and tasks[t].section == "done" for t in task_ids)

    def all_ended(self) -> bool:
        """Return whether every task, also the system's own, has ended."""
        return all(task.section == "done" for task in self.log.state.tasks.values())

    def verdict(self) -> Verdict:
        """Return what the referee finds in the agents' own ledgers; its process, if there is one, ends."""
        assert self.fleet is not None, "the demo was not entered"
        return self.fleet.verdict()


def _is_ready(agent: AgentRecord) -> bool:
    """Return whether an agent is there and, unless it is a program, has told where."""
    return agent.liveness == "ALIVE" and (agent.mobility == "none" or agent.position is not None)


def _watchers(scenario: Scenario) -> dict[str, str]:
    """Return whom the person at the keyboard plays: the watchers of the site, or, if none of them is there, everybody."""
    named = scenario.site.people.get("watchers", ())
    people = [agent for agent in scenario.agents if agent.human]
    return {agent.id: agent.type for agent in [one for one in people if one.id in named] or people}


class ScenarioDemo(Demo):
    """A demo that plays a scenario: its agents, its tasks and orders at their times, its faults.

    When all agents are there: `begin`, then `play_due` again and again until `is_over`. `also`: tasks that may be requested
    besides the scenario's.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        speed: float | None = None,
        listen: str = FREE_PORT,
        serve: Path | None = None,
        ask_me: bool = False,
        also: Sequence[Task] = (),
    ) -> None:
        specs = specs_of(scenario, with_base=True)
        self.me = _watchers(scenario) if ask_me else {}
        """Who the person at the keyboard is: id -> type."""
        super().__init__(
            site_of(scenario),
            scenario.catalogue,
            list({**{task.name: task for task in also}, **{t.name: t for t in scenario.tasks.values()}}.values()),
            speed=scenario.speed if speed is None else speed,
            listen=listen,
            specs=[spec for spec in specs if spec.id not in self.me],
            referee=True,
            serve=serve,
            desk=self.me,
        )
        self.played = Played()
        self._table = Timetable(scenario)
        self._own_speed = scenario.speed
        self._silent: dict[str, None] = {}
        """Agents that a fault has made silent for a time."""

    def open_questions(self) -> tuple[OpenQuestion, ...]:
        """Return what the person at the keyboard is asked."""
        return self.host.desk.open_questions() if self.host is not None else ()

    def keep_pace(self) -> None:
        """Run at real time while the person at the keyboard is asked, else at the demo's speed.

        While a fault makes an agent silent for a time it is at most the scenario's own: silence is counted in wall time, and at
        another speed the scenario would have another course, which its orders do not fit.
        """
        pace = min(self._own_speed, self.speed) if self._silent else self.speed
        pace = min(1.0, pace) if self.open_questions() else pace
        if self.driver.speed != pace:
            self.driver.set_speed(pace)

    def begin(self) -> None:
        """Start the scenario's clock."""
        self._table.begin(self.driver.now())

    def play_due(self) -> list[ScenarioFault | ScenarioOrder]:
        """Submit the tasks, play the faults and give the orders that are due; return the faults and orders."""
        assert self.fleet is not None, "the demo was not entered"
        due = self._table.due(self.driver.now())
        for entry in due:
            if isinstance(entry, ScenarioFault):
                self._note_silence(entry)
            self.played.carry_out(entry, self.driver.now(), self.fleet, self.driver.ask, self.log.state.tasks)
        return [entry for entry in due if isinstance(entry, ScenarioFault | ScenarioOrder)]

    def _note_silence(self, fault: ScenarioFault) -> None:
        if fault.kind in ("kill", "restart"):
            (self.down.add if fault.kind == "kill" else self.down.discard)(fault.agent)
        if fault.kind in SILENT or fault.kind in SILENT.values():
            self._silent.pop(fault.agent, None)
        if self._table.silence_ends(fault):
            self._silent[fault.agent] = None
            self.keep_pace()

    def left_waiting(self) -> list[TaskRecord]:
        """Return the tasks that wait for a word that nobody will say; empty while anything may still happen."""
        if not self._table.is_done or self.me or self.host is not None:
            return []
        return waiting_for_people(self.log.state)

    def wait_s(self, most_s: float) -> float:
        """Return the wall time until the next thing is due, at most `most_s`."""
        at = self._table.next_time()
        if at is None:
            return most_s
        return min(most_s, max(0.0, (at - self.driver.now()) / SECOND / self.driver.speed))

    @property
    def is_over(self) -> bool:
        """Return whether all was played and all tasks have ended."""
        return self._table.is_done and self.ended(self.played.task_ids) and self.all_ended()
