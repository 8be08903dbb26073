"""Scenarios come alive: simulated agents, tasks and orders at their times, and faults, in virtual time or as processes.

`VirtualRun` is a whole scenario in this process on the virtual clock. `FaultPlayer` plays the faults of one on any fleet;
`sim` and `demo` use it for fleets of processes. `fleet_site` makes a site for a fleet of any size.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from msgspec.structs import replace

from agents_sim.faults import Order
from agents_sim.referee import Verdict
from agents_sim.spec import kind_of as kind_of_spec
from agents_sim.world import AgentSpec, is_person
from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Micros, micros
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.core import clock_stands
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, LockdownOrder, Operator, OperatorOrder, Submit
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Port, Site, SiteAgent
from formiga_bt.lang.scenario import Scenario, ScenarioFault, ScenarioOrder, ScenarioTask
from formiga_bt.lang.scenario.entries import START
from formiga_bt.lang.site.standing import chargers
from formiga_bt.rehearsal.bodies import kind_of, on_wire, outcome_of
from formiga_bt.rehearsal.rehearsal import Rehearsal, simulated
from formiga_bt.rehearsal.spending import RunSpending

SETTLE_S = 1.0
"""Virtual time that agents have to announce themselves before the scenario's clock begins."""
LIMIT_S = 4 * 3600.0


def specs_of(scenario: Scenario, *, with_base: bool = False) -> list[AgentSpec]:
    """Return the scenario's agents as simulated ones; `with_base`: they report latitude and longitude too."""
    base = (scenario.site.lat, scenario.site.lng) if with_base else None
    return [
        AgentSpec(
            id=agent.id,
            type=agent.type,
            at=agent.at,
            battery=agent.battery,
            home=agent.home,
            script=tuple(map(_said, agent.answers)),
            limits={} if agent.charges else {"charge_percent_s": 0.0},
            chargers=chargers(scenario.site, scenario.catalogue.types[agent.type]),
            does=kind_of(scenario.catalogue, agent.type),
            outcomes=tuple(outcome_of(one) for one in scenario.results if one.agent in ("", agent.id)),
            seed=scenario.seed,
            walk=agent.walk,
            base=base,
            wind=(0.0, 0.0) if agent.human else scenario.wind,
            payload_kg=agent.payload_kg,
            cut=agent.cut,
            on_link_loss=agent.on_link_loss,
        )
        for agent in scenario.agents
    ]


def _said(answer: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return one answer of a script with what is filled in as wire values."""
    return {**answer, "form": {name: on_wire(value) for name, value in answer.get("form", {}).items()}}


def site_of(scenario: Scenario) -> Site:
    """Return the scenario's site with the agents listed that only the scenario has, at the ports where they begin."""
    ports = {port.at: name for name, port in scenario.site.ports.items()}
    agents = dict(scenario.site.agents)
    for agent in scenario.agents:
        home = ports.get(agent.home, "") if agent.home is not None else ""
        if agent.id not in agents and (agent.human or home):
            agents[agent.id] = SiteAgent(agent.id, agent.type, home)
    return replace(simulated(scenario.site), agents=agents)


def request_of(task: ScenarioTask) -> Submit:
    """Return the request for a task of a scenario."""
    return Submit(task.task, dict(task.params), task.priority, "scenario", wait=task.wait, expires=task.expires)


OrderInput = Operator | LockdownOrder | Abort
"""What an order of a scenario is to the engine."""

Entry = ScenarioTask | ScenarioFault | ScenarioOrder
"""What a timetable holds."""


def order_of(order: ScenarioOrder, tasks: Mapping[str, TaskRecord]) -> OrderInput:
    """Return the engine input of an order; `tasks` are those that the engine knows now.

    Raises:
        TaskError: `unknown_task`: no task of that name is open.
    """
    target = _newest(order.target, tasks) if order.of == "task" else order.target
    match order.order:
        case "lockdown":
            how = next(word for word in _LOCKDOWNS if word == order.how)
            return LockdownOrder(how, by=order.by)
        case "abort":
            return Abort(target, how=next(word for word in _ABORTS if word == order.how), by=order.by)
        case "handback":
            return Operator(_HANDBACKS[order.how], target, order.by)
        case word:
            return Operator(word, target, order.by)


_LOCKDOWNS: tuple[Literal["hold", "return", "land", "release"], ...] = ("hold", "return", "land", "release")
_ABORTS: tuple[Literal["", "now", "abandon"], ...] = ("", "now", "abandon")
_HANDBACKS: Mapping[str, OperatorOrder] = {
    "continue": "handback_continue", "return": "handback_return", "end": "handback_end",
}  # fmt: skip


def _newest(name: str, tasks: Mapping[str, TaskRecord]) -> str:
    open_ = [task for task in tasks.values() if task.name == name and task.section != "done" and not task.system.agent]
    if not open_:
        raise TaskError("unknown_task", f"no task '{name}' is open")
    return max(open_, key=lambda task: task.order).id


class FaultTarget(Protocol):
    """Agents that faults befall: `SimFleet` or `FleetProcesses`."""

    def kill(self, agent: str) -> None:
        """End an agent's process at once."""
        ...

    def restart(self, agent: str) -> None:
        """Start it again."""
        ...

    def freeze(self, agent: str) -> None:
        """Stop it."""
        ...

    def thaw(self, agent: str) -> None:
        """Let it go on."""
        ...

    def order(self, agent: str, order: Order) -> None:
        """Let it play a fault."""
        ...


def play(fault: ScenarioFault, fleet: FaultTarget) -> None:
    """Let a fault befall its agent now."""
    match fault.kind:
        case "kill":
            fleet.kill(fault.agent)
        case "restart":
            fleet.restart(fault.agent)
        case "freeze":
            fleet.freeze(fault.agent)
        case "thaw":
            fleet.thaw(fault.agent)
        case kind:
            order = Order(
                kind=kind,
                count=fault.count,
                as_id=fault.as_id,
                code=fault.code,
                delay_s=fault.delay_s,
                on=fault.on,
                vanishes=fault.vanishes,
                percent=fault.percent,
                east=fault.east,
                north=fault.north,
                check=fault.check,
                event=fault.event,
                fields={name: on_wire(value) for name, value in fault.fields.items()},
                text=fault.text,
            )
            fleet.order(fault.agent, order)


def describe(entry: ScenarioFault | ScenarioOrder) -> str:
    """Return a fault or an order in words, for people: `hwd_1: kill`, `watcher_1: hold hwd_1`."""
    if isinstance(entry, ScenarioOrder):
        target = "all" if entry.of == "all" else entry.target
        return f"{entry.by}: {' '.join(word for word in (entry.order, target, entry.how) if word)}"
    over = "" if entry.on else " no more"
    more = {
        "slow": f" {entry.delay_s:g} s" if entry.delay_s else " no more",
        "wrong_id": f" {entry.as_id}",
        "refuse": f" {entry.code}",
        "never_confirm": over,
        "link_loss": over or ("" if entry.vanishes else ", its presence stays"),
        "battery": f" {entry.percent:g} %",
        "wind": f" {entry.east:g} m/s east, {entry.north:g} m/s north",
        "event": f" {entry.event}",
        "preflight": f" {entry.check}{over}",
        "unsure": over,
        "drift": over or f" {entry.east:g} m east, {entry.north:g} m north",
    }.get(entry.kind, "")
    times = f" x{entry.count}" if entry.count > 1 else ""
    return f"{entry.agent}: {entry.kind}{more}{times}"


SILENT = {"link_loss": "link_loss", "freeze": "thaw", "kill": "restart"}
"""Kind of a fault by which an agent is silent -> kind of the one that ends it (`link_loss`: with `on` false)."""


def waiting_for_people(state: EngineState) -> list[TaskRecord]:
    """Return the tasks that are left, if each of them is HELD until a person says a word and nothing else is under way."""
    left = [task for task in state.tasks.values() if not task.ended]
    goes_on = any(goal.in_flight for goal in state.goals.values()) or state.questions
    return [] if goes_on or not all(clock_stands(task) for task in left) else left


class Timetable:
    """What a scenario still has to do: requests, faults and orders in order of time, from the instant `begin`.

    `due(now)` hands out, in order, what is due by `now`; of one instant requests go first, then faults, then orders.
    """

    def __init__(self, scenario: Scenario) -> None:
        entries: list[Entry] = [*scenario.requests, *scenario.faults, *scenario.orders]
        self._left = sorted(entries, key=lambda entry: entry.at)
        self._begin: Micros | None = None

    def begin(self, now: Micros) -> None:
        """Start the scenario's clock."""
        self._begin = now

    def next_time(self) -> Micros | None:
        """Return when the next entry is due, None if none is left or the clock does not run."""
        return self._begin + self._left[0].at if self._left and self._begin is not None else None

    def due(self, now: Micros) -> list[Entry]:
        """Return what is due by `now` and has not been handed out."""
        found: list[Entry] = []
        while (at := self.next_time()) is not None and at <= now:
            found.append(self._left.pop(0))
        return found

    @property
    def is_done(self) -> bool:
        """Return whether everything was handed out."""
        return not self._left

    def silence_ends(self, fault: ScenarioFault) -> bool:
        """Return whether a fault makes its agent silent and another one, that is still to come, ends that."""
        end = SILENT.get(fault.kind) if fault.on else None
        return any(
            isinstance(one, ScenarioFault)
            and one.agent == fault.agent
            and one.kind == end
            and (one.kind in SILENT) != one.on
            for one in self._left
        )


@dataclass(slots=True)
class Played:
    """What a run did of its timetable: what happened when (engine time), which tasks came of it, what was refused."""

    task_ids: list[str] = field(default_factory=list)
    refused: list[tuple[str, str]] = field(default_factory=list)
    """Task and reason."""
    faults: list[tuple[Micros, ScenarioFault]] = field(default_factory=list)
    orders: list[tuple[Micros, ScenarioOrder, str]] = field(default_factory=list)
    """With why it was refused, or empty."""

    def carry_out(
        self,
        entry: Entry,
        now: Micros,
        fleet: FaultTarget,
        ask: Callable[[Submit | OrderInput], Accepted | Done],
        tasks: Mapping[str, TaskRecord],
    ) -> None:
        """Submit the task, play the fault or give the order, and note it; a refusal is noted too.

        Args:
            entry: what is due.
            now: engine time.
            fleet: whom faults befall.
            ask: hands the engine an input of a person; raises TaskError when that is refused.
            tasks: that the engine knows.
        """
        match entry:
            case ScenarioFault():
                play(entry, fleet)
                self.faults.append((now, entry))
            case ScenarioOrder():
                why = ""
                try:
                    ask(order_of(entry, tasks))
                except TaskError as error:
                    why = f"{error.code}: {error}"
                self.orders.append((now, entry, why))
            case ScenarioTask():
                try:
                    reply = ask(request_of(entry))
                    assert isinstance(reply, Accepted)
                    self.task_ids.append(reply.task)
                except TaskError as error:
                    self.refused.append((entry.task, str(error)))


class VirtualRun:
    """A scenario on the virtual clock. `run` it, then read `played`, `steps` and `verdict()`.

    Args:
        scenario: what to play.
        seed: instead of the scenario's own.
        pace: told engine time as it passes; it may wait, for those who want to watch.
        spending: what the run may use up, if there is a bound.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        seed: int | None = None,
        pace: Callable[[Micros], None] | None = None,
        spending: RunSpending | None = None,
    ) -> None:
        self.scenario = scenario
        self.rehearsal = Rehearsal(
            site_of(scenario),
            scenario.catalogue,
            scenario.tasks.values(),
            specs_of(scenario),
            seed=scenario.seed if seed is None else seed,
            start=START if scenario.now is None else scenario.now - micros(SETTLE_S),
        )
        self._spending = spending
        if spending is not None:
            self.rehearsal.driver.listeners.append(spending.feed)
        self.played = Played()
        self.began: Micros = 0
        self._table = Timetable(scenario)
        self._pace = pace

    @property
    def steps(self) -> Sequence[EngineStep]:
        """Return all that the engine did."""
        return self.rehearsal.steps

    def run(self, limit_s: float = LIMIT_S) -> bool:
        """Run until everything was done and every task has ended; return whether it was in time."""
        world = self.rehearsal
        world.run_for(SETTLE_S)
        self.began = world.now
        self._table.begin(world.now)
        self._next()
        spending = self._spending
        if spending is None:
            return world.run_until(self._is_over, limit_s)
        world.run_until(lambda: spending.is_over or self._is_over(), limit_s)
        return self._is_over()

    def _is_over(self) -> bool:
        if self._pace is not None:
            self._pace(self.rehearsal.now)
        return self._table.is_done and self.rehearsal.ended()

    def carry_out(self, entry: Entry) -> None:
        """Let a fault befall now, give an order or submit a task, whatever the timetable says."""
        world = self.rehearsal
        self.played.carry_out(entry, world.now, world.sim, world.ask, world.engine.state.tasks)

    def verdict(self) -> Verdict:
        """Return what the referee found until now."""
        return self.rehearsal.referee.verdict(self.rehearsal.now)

    def close(self) -> None:
        """Stop the simulated fleet."""
        self.rehearsal.close()

    def _next(self) -> None:
        world = self.rehearsal
        for entry in self._table.due(world.now):
            self.carry_out(entry)
        at = self._table.next_time()
        if at is not None:
            world.scheduler.call_at(at, self._next)


def fleet_site(specs: Sequence[AgentSpec], name: str = "grid", **changes: Any) -> Site:
    """Return a site for a fleet: a port of its own for each drone where it stands, a place where each person stands.

    Args:
        specs: the fleet, for example `agents_sim.world.grid_fleet(100, 80, 20, 2)`; drones stand at their homes.
        name: of the site.
        changes: other fields of `Site`.
    """
    ports, places, agents = dict[str, Port](), dict[str, Any](), dict[str, SiteAgent]()
    for spec in specs:
        at = spec.at.ground if isinstance(spec.at, Position) else spec.at
        if is_person(spec):
            places[f"at_{spec.id}"] = at
            agents[spec.id] = SiteAgent(spec.id, spec.type)
            continue
        port = f"port_{spec.id}"
        home = spec.home or at
        ports[port] = Port(port, home, Position(home.east_m, home.north_m + 8.0, 45.0))
        agents[spec.id] = SiteAgent(spec.id, spec.type, port)
    watchers = tuple(spec.id for spec in specs if is_person(spec) and kind_of_spec(spec).actions.keys() <= {CONFIRM})
    fields: dict[str, Any] = {"places": {**places, "camp": Place(0.0, -40.0)}, "people": {"watchers": watchers}}
    return Site(name, 66.5, 25.7, ports=ports, agents=agents, **{**fields, **changes})
