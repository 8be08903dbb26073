"""What a checked test file is made of: cases, the rules of their mocks, and what each expects; all frozen."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.scenario import ScenarioAgent, ScenarioFault, ScenarioOrder, ScenarioResult

Standing = Literal["grounded", "airborne", "at_port", "parked_away", "quarantined"]
"""How a machine is at the end of a case; `grounded` counts wherever it stands."""

GAP: Final = ".."
"""Among expected actions: any number of others, none too."""


@dataclass(frozen=True, slots=True)
class AnswerRule:
    """How questions that fit are answered."""

    mark: Mark
    number: int | None
    """The how-manieth question of the task (from 1; clearances do not count), or None if `text` says which."""
    text: str
    """Found in the question. Several rules of one text count one after another, the last one again and again."""
    answer: str
    """Empty: such a question is never answered."""
    after_s: float = 3.0
    form: Mapping[str, Any] = field(default_factory=dict)
    """What is filled in, as wire values; what it lacks the person gives as without a rule."""
    by: str = ""
    """Who says it; the others that are asked say nothing. Empty: whoever is asked."""

    @property
    def told(self) -> str:
        """Return the rule in words, for people."""
        return f"question {self.number}" if self.number is not None else f"'{self.text}'"


@dataclass(frozen=True, slots=True)
class GoalRule:
    """What becomes of an agent's goals of one action."""

    mark: Mark
    who: str
    """A role of the task, or an agent's id."""
    action: str
    nth: int | None
    """Of these goals in the case, from 1; None = each."""
    does: Literal["fail", "reject", "finish", "wait"]
    """Fail on the way, be refused, end well without the body's doing, or begin late."""
    code: str = ""
    result: Mapping[str, Any] = field(default_factory=dict)
    """As wire values (finish)."""
    after_s: float = 1.0

    @property
    def told(self) -> str:
        """Return the rule in words, for people."""
        return f"{self.who}.{self.action}" + (f" number {self.nth}" if self.nth is not None else "")


@dataclass(frozen=True, slots=True)
class DuringRule:
    """A fault or an order in the course of a goal; its time counts from the beginning of that."""

    mark: Mark
    who: str
    """A role of the task, or an agent's id."""
    action: str
    nth: int
    """Of these goals in the case, from 1."""
    entry: ScenarioFault | ScenarioOrder
    whose: bool
    """Whether the fault befalls who does the goal, whoever that is."""

    @property
    def told(self) -> str:
        """Return the rule in words, for people."""
        return f"what befalls during {self.who}.{self.action} number {self.nth}"

    def befalls(self, agent: str) -> ScenarioFault | ScenarioOrder:
        """Return what befalls when this agent does the goal."""
        if self.whose and isinstance(self.entry, ScenarioFault):
            return replace(self.entry, agent=agent)
        return self.entry


Rule = AnswerRule | GoalRule | DuringRule
"""What a case says of questions and goals of its task."""


@dataclass(frozen=True, slots=True)
class Expect:
    """What must have come. None = nothing is said of it."""

    mark: Mark
    status: Literal["succeeded", "failed", "canceled"] = "succeeded"
    code: str | None = None
    actions: tuple[str, ...] | None = None
    """`role.Action` in the order of sending, people's questions left out; `..` stands for any number of others."""
    end_state: Mapping[str, Standing] = field(default_factory=dict)
    """By role or agent id."""
    max_time_s: float | None = None
    answers_asked: int | None = None
    """How many questions the task's `ask` steps put."""
    notices: tuple[str, ...] | None = None
    """A part of each notice's text, in order."""
    crashes: int = 0
    rules: Mapping[str, int] = field(default_factory=dict)
    """How many tasks each of these standing rules requested."""


@dataclass(frozen=True, slots=True)
class Case:
    """One case. Times count from the instant of the request."""

    name: str
    mark: Mark
    params: Mapping[str, Any]
    agents: tuple[ScenarioAgent, ...]
    expect: Expect
    answers: tuple[AnswerRule, ...] = ()
    goals: tuple[GoalRule, ...] = ()
    faults: tuple[ScenarioFault, ...] = ()
    orders: tuple[ScenarioOrder, ...] = ()
    """With `abort_at` as an order among them."""
    during: tuple[DuringRule, ...] = ()
    results: tuple[ScenarioResult, ...] = ()
    now: Micros | None = None
    """Engine time of the request; None: as every rehearsal begins."""
    limit_s: float = 12 * 3600.0
    """In virtual time; a case that takes longer is given up."""


@dataclass(frozen=True, slots=True)
class CaseFile:
    """A checked test file."""

    file: str
    task: Task
    site: Site
    catalogue: Catalogue
    cases: tuple[Case, ...]
    requested: tuple[Task, ...] = ()
    """The tasks that the task requests, and those that they request: they are played too, but not judged."""
