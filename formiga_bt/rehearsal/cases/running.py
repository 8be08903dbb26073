"""Plays one case: the production engine on the virtual clock, the site's simulated agents, and the case's mocks before them."""

from collections import Counter
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Final

from agents_sim.referee import Verdict
from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.diagnostics import Mark
from formiga_bt.engine.kernel.changes import GoalPut, Granted, QuestionPut
from formiga_bt.engine.kernel.inputs import EngineStep, NotifyPeople, SendGoal
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.lang.places import steps_around
from formiga_bt.lang.scenario import Scenario, ScenarioTask
from formiga_bt.rehearsal.cases.cases import Case, CaseFile, Rule
from formiga_bt.rehearsal.cases.coverage import Coverage
from formiga_bt.rehearsal.cases.mocks import Mocks
from formiga_bt.rehearsal.rehearsal import patience
from formiga_bt.rehearsal.simulation import VirtualRun, describe
from formiga_bt.rehearsal.spending import RunSpending


@dataclass(frozen=True, slots=True)
class SentGoal:
    """A goal that was sent: by role if the agent had one, and where in the tree it came from."""

    agent: str
    role: str
    action: str
    mark: Mark | None

    @property
    def name(self) -> str:
        """Return `role.Action`, or `agent.Action` of an agent without a role."""
        return f"{self.role or self.agent}.{self.action}"


@dataclass(frozen=True, slots=True)
class Came:
    """What came of a case."""

    task: TaskRecord | None
    """None: it was refused."""
    refused: str
    in_time: bool
    duration_s: float
    sent: tuple[SentGoal, ...]
    asked: tuple[str, ...]
    """The texts of the questions that `ask` steps put, one for each asking."""
    notices: tuple[str, ...]
    agents: Mapping[str, AgentRecord]
    roles: Mapping[str, tuple[str, ...]]
    """Every role with the agents that it had last."""
    verdict: Verdict
    unused: tuple[Rule, ...]
    """Rules of the case that never counted."""
    no_use: tuple[str, ...]
    """Rules that could not do what they say, in words."""
    failed_at: Mark | None = None
    """Where in the tree the failure was."""
    refused_orders: tuple[str, ...] = ()
    too_late: tuple[str, ...] = ()
    """Faults that came when the task had ended, in words."""
    given_up: str = ""
    """Why it was given up before its time, and which loop used most."""
    rules: Mapping[str, int] = field(default_factory=dict)
    """How many tasks each standing rule requested."""


def play(cases: CaseFile, case: Case, coverage: Coverage | None = None, spending: RunSpending | None = None) -> Came:
    """Play a case and return what came of it.

    Args:
        cases: its file.
        case: one of the file's.
        coverage: told what was reached.
        spending: what it may use up; by default the usual bounds.
    """
    spending = spending or RunSpending()
    scenario = Scenario(
        "case", cases.site, cases.catalogue, {task.name: task for task in (cases.task, *cases.requested)}, case.agents,
        (ScenarioTask(0, cases.task.name, case.params, wait=patience(cases.task)),), case.faults, case.orders,
        case.results, now=case.now, file=cases.file,
    )  # fmt: skip
    run = VirtualRun(scenario, spending=spending)
    story = _Story(cases)
    name = cases.task.name
    mocks = Mocks(case, name, run, lambda: _roles_now(run, name))
    mocks.install()
    watched: AbstractContextManager[None] = coverage.watched() if coverage is not None else nullcontext()
    try:
        with watched:
            in_time = run.run(case.limit_s)
        for step in run.steps:
            story.feed(step)
        given_up = "" if in_time else spending.reason(scenario.tasks)
        return replace(_came(run, story, mocks, in_time=in_time), given_up=given_up)
    finally:
        run.close()


def _roles_now(run: VirtualRun, name: str) -> Mapping[str, tuple[str, ...]]:
    tasks = run.rehearsal.engine.state.tasks.values()
    return next((task.agents.roles for task in tasks if task.name == name), {})


def _came(run: VirtualRun, story: "_Story", mocks: Mocks, *, in_time: bool) -> Came:
    state, played = run.rehearsal.engine.state, run.played
    task = state.tasks.get(played.task_ids[0]) if played.task_ids else None
    ended_at = task.times.ended_at if task is not None and task.times.ended_at is not None else run.rehearsal.now
    return Came(
        task,
        played.refused[0][1] if played.refused else "",
        in_time,
        (ended_at - task.times.submitted_at) / 1e6 if task is not None else 0.0,
        tuple(story.sent(goal, role) for goal, role in story.goals.values()),
        tuple(story.asked.values()),
        tuple(story.notices),
        dict(state.agents),
        dict(story.roles),
        run.verdict(),
        tuple(mocks.unused()),
        tuple(mocks.used.no_use),
        story.mark_of(task.outcome.failure.step) if task is not None and task.outcome.failure is not None else None,
        tuple(f"{order.order} {order.target} was refused: {why}" for _, order, why in played.orders if why),
        tuple(
            f"{describe(fault)} came {(at - ended_at) / 1e6:.0f} s after the end"
            for at, fault in played.faults
            if at > ended_at and fault.on and fault.kind not in _NO_MATTER
        ),
        rules=Counter(t.request.cause.rule for t in state.tasks.values() if t.request.cause and not t.family.parent),
    )


_NO_MATTER: Final = ("restart", "thaw", "hand_back", "event")
"""Faults that may come after the end: what only ends another, and what rules of the site may wait for."""


@dataclass(slots=True)
class _Story:
    """What the engine's steps tell of the task under test."""

    cases: CaseFile
    goals: dict[str, tuple[SendGoal, str]] = field(default_factory=dict)
    """Id of a goal -> the goal, and the role that its agent had when it was sent."""
    owners: dict[str, str] = field(default_factory=dict)
    asked: dict[str, str] = field(default_factory=dict)
    """Id of a question -> its text."""
    notices: list[str] = field(default_factory=list)
    roles: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def feed(self, step: EngineStep) -> None:
        """Take one step."""
        for change in step.changes:
            match change:
                case GoalPut(goal):
                    self.owners.setdefault(goal.id, goal.owner)
                case QuestionPut(question) if question.kind == "ask":
                    self.asked[question.id] = question.text
                case Granted(task, roles) if self._mine(task):
                    self.roles |= roles
        for effect in step.effects:
            match effect:
                case SendGoal() if self._mine(effect.task) and effect.action != CONFIRM:
                    self.goals.setdefault(effect.goal_id, (effect, self._role(effect.agent)))
                case NotifyPeople() if self._mine(effect.task):
                    self.notices.append(effect.text)

    def sent(self, goal: SendGoal, role: str) -> SentGoal:
        """Return a goal with its role and its place in the tree."""
        return SentGoal(goal.agent, role, goal.action, self.mark_of(self.owners.get(goal.goal_id, "")))

    def mark_of(self, key: str) -> Mark | None:
        """Return where the step of a node's key stands, None for a way home."""
        around = steps_around(self.cases.task, key)
        return around[-1].mark if around else None

    def _role(self, agent: str) -> str:
        return next((name for name, agents in self.roles.items() if agent in agents), "")

    def _mine(self, task: str) -> bool:
        return task.startswith(f"{self.cases.task.name}-")
