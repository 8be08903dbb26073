"""A run that ends (`dryrun`, `demo`, `sim`): a ledger that forgets nothing, and what is told of it at the end."""

from collections.abc import Iterable

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.facts import LineFact
from formiga_bt.show.history.incidents import Happenings
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.history.rows import ActionRow as ActionRow
from formiga_bt.show.history.rows import where as where


class LogLine(Struct, frozen=True):
    """A line of the log for people."""

    at: Micros
    text: str
    severity: str = "info"


class RunLog:
    """Folds steps; `feed` them in order. `ledger` is what pictures are drawn from."""

    def __init__(self) -> None:
        self.ledger = _Whole(self)
        self.state = self.ledger.state
        self.actions: list[ActionRow] = []
        self.lines: list[LogLine] = []
        self.least_battery: dict[str, float] = {}
        self.errors: list[str] = []
        self.happened = Happenings()
        self.ledger.before += [self.happened.before, self._battery]

    @property
    def started_at(self) -> Micros | None:
        """Return the instant of the first step."""
        return self.ledger.started_at

    def feed(self, step: EngineStep) -> None:
        """Take one step."""
        self.happened.begin(step.input)
        self.ledger.feed(step)

    def _battery(self, at: Micros, change: ch.Change, state: EngineState) -> None:  # noqa: ARG002
        if type(change) is ch.AgentPut and change.agent.battery is not None and not change.agent.human:
            agent, left = change.agent.id, change.agent.battery
            self.least_battery[agent] = min(left, self.least_battery.get(agent, 100.0))

    def since_start(self, at: Micros) -> float:
        """Return seconds of engine time since the first step."""
        return (at - (self.started_at or at)) / 1e6

    def rows_of(self, task_ids: Iterable[str]) -> list[ActionRow]:
        """Return the actions of these tasks in order of start."""
        wanted = set(task_ids)
        return [row for row in self.actions if row.task in wanted]

    def all_succeeded(self) -> bool:
        """Return whether every task ended SUCCEEDED."""
        return bool(self.state.tasks) and all(task.status == "SUCCEEDED" for task in self.state.tasks.values())


class _Whole(Ledger):
    """A ledger that hands each row and line to the log."""

    def __init__(self, log: RunLog) -> None:
        super().__init__(ALL)
        self._log = log

    def tell(self, line: LineFact) -> None:
        super().tell(line)
        self._log.lines.append(LogLine(line.at, line.text, line.severity))

    def row_began(self, row: ActionRow) -> None:
        super().row_began(row)
        self._log.actions.append(row)
