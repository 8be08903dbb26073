"""Progress of a run for the terminal: a live display, plain lines, and the closing table. Used by `demo`."""

from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from formiga_bt.base.clock import Micros
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.history.rows import rest_words
from formiga_bt.show.history.runlog import ActionRow, RunLog
from formiga_bt.show.listed import listing

if TYPE_CHECKING:
    from agents_sim.referee import Verdict

STYLES = {
    "SUCCEEDED": "green",
    "FAILED": "red",
    "CANCELED": "yellow",
    "HELD": "yellow",
    "ACTIVE": "cyan",
    "ENDING": "cyan",
}
DONE = ("succeeded", "answered")
"""How an action ends well."""

TAIL = 8
"""Lines of the log in the live display."""


class LivePrinter:
    """Common part: the closing table."""

    def __init__(self) -> None:
        self.console = Console(highlight=False)

    def __enter__(self) -> "LivePrinter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None

    def show(self, log: RunLog, now: Micros) -> None:
        """Show the present state."""
        raise NotImplementedError

    def say(self, text: str) -> None:
        """Print a line of its own, above what is redrawn."""
        self.console.print(text, soft_wrap=True)

    def waiting(self, agents: Sequence[str]) -> None:
        """Take note of who is still missing at the start."""

    def close_with(self, log: RunLog, verdict: "Verdict") -> None:
        """Print the closing table: task, agents, actions, duration, outcome."""
        if log.state.tasks:
            self._missions(log)
        if log.happened.rows:
            self._happened(log)
        near = verdict.closest_pass
        counts = (
            ("crashes", verdict.crashes),
            ("starts near people without clearance", verdict.unsafe_starts),
            ("low flights", verdict.low_flights),
        )
        words = [f"{name}: {len(found)}" for name, found in counts]
        if near is not None:
            words.append(f"closest pass: {near.distance_m:.0f} m ({near.a}, {near.b})")
        self.console.print(", ".join(words), soft_wrap=True)
        if log.all_succeeded() and verdict.is_clean:
            self.say(
                "All tasks succeeded. Next: write a task of your own and try it with `formiga dryrun`; README.md shows how."
            )

    def _happened(self, log: RunLog) -> None:
        table = Table("at", "who", "what", "the engine", "how it ended", title="What happened", title_justify="left")
        for row in log.happened.rows:
            table.add_row(f"{log.since_start(row.at):.0f} s", row.who, row.what, row.did, row.ended or "it lasts")
        self.console.print(table)

    def _missions(self, log: RunLog) -> None:
        table = Table("task", "agents", "actions", "duration", "outcome", title="Missions", title_justify="left")
        for task in sorted(log.state.tasks.values(), key=lambda t: t.order):
            rows = [r for r in log.rows_of([task.id]) if r.state in DONE]
            seconds = ((task.times.ended_at or log.state.now) - task.times.submitted_at) / 1e6
            why = (
                f"{task.status}: {task.outcome.code} {task.outcome.reason}".rstrip()
                if task.outcome.code
                else task.status
            )
            agents = ", ".join(task.agents.granted)
            table.add_row(task.id, agents, str(len(rows)), f"{seconds:.0f} s", Text(why, STYLES.get(task.status, "")))
        self.console.print(table)


class PlainView(LivePrinter):
    """One line per thing that happens: for logs, pipes and `--headless`."""

    def __init__(self) -> None:
        super().__init__()
        self._lines = 0
        self._actions = 0
        self._open: list[ActionRow] = []
        self._known: set[str] = set()

    def show(self, log: RunLog, now: Micros) -> None:  # noqa: ARG002
        """Print what is new, in order of time: at one instant first what is said of the task, then its actions."""
        for agent in log.state.agents.values():
            if agent.id not in self._known and agent.position is not None:
                self._known.add(agent.id)
                self.say(f"agent {agent.id} ({agent.type}) is there")
        news = [(line.at, line.text) for line in log.lines[self._lines :]]
        fresh = log.actions[self._actions :]
        news += [(row.start, f"{row.task}: {row.agent}.{row.action} {row.detail}".rstrip()) for row in fresh]
        self._lines, self._actions = len(log.lines), len(log.actions)
        self._open += fresh
        news += [
            (row.end, f"{row.task}: {row.agent}.{row.action} {row.outcome}")
            for row in self._open
            if row.end is not None and row.state not in (*DONE, "withdrawn")
        ]
        self._open = [row for row in self._open if row.end is None]
        for at, text in sorted(news, key=lambda new: new[0]):
            self.say(f"{log.since_start(at):7.1f} s  {text}")

    def close_with(self, log: RunLog, verdict: "Verdict") -> None:
        """Print what was left, then the table."""
        self.show(log, log.state.now)
        super().close_with(log, verdict)


class LiveView(LivePrinter):
    """Tasks, agents and the last lines of the log, redrawn in place."""

    def __init__(self) -> None:
        super().__init__()
        self._live = Live(console=self.console, refresh_per_second=5, transient=True)
        self._missing: Sequence[str] = ()

    def __enter__(self) -> "LivePrinter":
        self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.__exit__(kind, error, trace)

    def waiting(self, agents: Sequence[str]) -> None:
        """Show who is still missing at the next redraw."""
        self._missing = agents

    def show(self, log: RunLog, now: Micros) -> None:
        """Redraw."""
        waits = f"   waiting for {', '.join(self._missing)}" if self._missing else ""
        head = f"formiga demo   engine time {log.since_start(now):.0f} s   Ctrl-C: abort, land, leave{waits}"
        self._live.update(
            Group(
                Text(head, "bold"),
                *_lockdown(log.state),
                _tasks(log, now),
                _agents(log.state),
                *(Text(f"{log.since_start(line.at):7.1f} s  {line.text}", "dim") for line in log.lines[-TAIL:]),
            )
        )


def _lockdown(state: EngineState) -> list[Text]:
    found = state.lockdown
    if found is None:
        return []
    return [Text(f"LOCKDOWN ({found.how}) by {found.by or 'somebody'}: formiga lockdown release", "bold red")]


def _tasks(log: RunLog, now: Micros) -> Table:
    table = Table("task", "status", "now", "time", expand=True)
    for task in sorted(log.state.tasks.values(), key=lambda t: t.order):
        seconds = ((task.times.ended_at or now) - task.times.submitted_at) / 1e6
        word = "HELD" if task.hold.causes and task.section != "done" else task.status
        table.add_row(task.id, Text(word, STYLES.get(word, "")), _doing(log, task), f"{seconds:.0f} s")
    return table


def _doing(log: RunLog, task: TaskRecord) -> str:
    if task.section == "done":
        return task.outcome.code
    goals = [g for g in log.state.goals.values() if g.task == task.id and not g.ended]
    words = [", ".join(task.hold.words)] if task.hold.causes else []
    words += [f"{g.agent}.{g.action}{_waits(g) or _rest(g)}" for g in goals]
    return "; ".join(words) or task.section


def _waits(goal: GoalRecord) -> str:
    if goal.state == "interrupted":
        return " interrupted"
    return f" waits: {goal.code} {goal.text}".rstrip() if goal.state == "gated" else ""


def _rest(goal: GoalRecord) -> str:
    return f" {rest_words(goal)}" if goal.rest_of else ""


def _agents(state: EngineState) -> Table:
    table = Table("agent", "pool", "action", "order", "battery", "height", expand=True)
    for agent in sorted(state.agents.values(), key=listing):
        battery = "" if agent.battery is None or agent.mobility not in MOVING else f"{agent.battery:.0f} %"
        up = f"{agent.position.up_m:.0f} m" if agent.position is not None and agent.flies else ""
        pool = agent.pool if not agent.human else agent.word
        order = Text(_order(state, agent), "bold yellow")
        table.add_row(agent.id, pool, agent.action, order, battery, up)
    return table


def _order(state: EngineState, agent: AgentRecord) -> str:
    order = state.orders.get(agent.id)
    words = [f"{order.stop} {'' if order.state == 'open' else order.state}".strip()] if order is not None else []
    if agent.taken:
        words.append("handback" if agent.control == "engine" else agent.control)
    return ", ".join([*words, agent.breach.removeprefix("!")]).strip(", ")
