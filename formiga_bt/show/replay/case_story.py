"""What the steps of a journal tell of a task that a test case is made of: goals, questions, orders, faults, and how it ended.

A case plays one task alone. So a run that ended for another task's sake (it was preempted) cannot come again: the story begins
with the run after it. It begins when the task got its agents: what it waited for before was not its own doing either.
"""

from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import UnusableFile
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, LockdownOrder, NotifyPeople, Operator, Resumed, SendGoal
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, TaskRecord, holder_of
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.writer import tasks_of
from formiga_bt.show.replay.machine import TimeMachine

TOKEN_US: Final[Micros] = 3 * SECOND
"""A presence token that vanished no later after the last status went with the process; later, the link was silent before."""


class StoryGoal(Struct, frozen=True):
    """A goal that was sent."""

    who: str
    """Its role, or its agent, as `formiga test` names it."""
    agent: str
    action: str


class Failed(Struct, frozen=True):
    """A goal that failed or was refused."""

    who: str
    action: str
    nth: int
    """Of this role and action, from 1."""
    goal: GoalRecord
    sent_at: Micros
    ended_at: Micros


class Fault(Struct, frozen=True):
    """Something that went wrong with a machine of the task."""

    at: Micros
    agent: str
    kind: str
    until: Micros | None = None
    """When it was over; None: it was not, or lasts no time."""
    presence: str = ""
    """Of a lost link."""
    lost_at: Micros | None = None
    """When the engine gave the machine up."""


class CaseRun(Struct, frozen=True):
    """One run of a task: each time that it began anew is another."""

    number: int
    at: Micros
    """When its story begins: when it got its agents, else when it was requested."""
    waited_us: Micros
    """For its agents."""
    ended_by: str = ""
    """Why it was ended to begin anew: restart, preempted, agent_lost. Empty: it was the last."""


class CaseStory(Struct):
    """What the steps of a task tell that a case is made of."""

    task: TaskRecord
    runs: tuple[CaseRun, ...]
    """All of them."""
    first: CaseRun
    """With which the story begins."""
    began: EngineState
    ended: EngineState
    sent: list[StoryGoal] = []
    failed: list[Failed] = []
    questions: dict[str, Question] = {}
    notices: list[str] = []
    orders: list[tuple[Micros, Abort | Operator | LockdownOrder]] = []
    faults: list[Fault] = []
    resumed: list[Micros] = []
    """When an engine went on with it after another had ended."""

    @property
    def at(self) -> Micros:
        """Return the moment that the times of the case count from."""
        return self.first.at


def story_of(machine: TimeMachine, task_id: str, *, last_run: bool = False) -> CaseStory:
    """Return what a case needs of a task.

    Args:
        machine: looks at its journal.
        task_id: of a task that has ended.
        last_run: only of its last run.

    Raises:
        UnusableFile: there is no such task, it runs still, or its beginning is no longer kept.
    """
    record = machine.record(task_id)
    if record is None:
        raise UnusableFile(f"the journal knows no task '{task_id}'; formiga replay lists those of a moment")
    if record.times.ended_at is None:
        raise UnusableFile(f"{task_id} has not ended; its story becomes a case when it has")
    if record.times.submitted_at < machine.first:
        raise UnusableFile(f"{task_id} began before the journal does; what is missing cannot be played again")
    runs = _runs(machine, record)
    begin = (
        len(runs) - 1
        if last_run
        else max((n + 1 for n, run in enumerate(runs) if run.ended_by == "preempted"), default=0)
    )
    first = runs[begin]
    story = CaseStory(record, runs, first, machine.state(first.at), machine.state(record.times.ended_at))
    reader = _Reader(story)
    # All steps: that a machine is silent, or back, is no step of its task.
    for kept in machine.events(machine.journal.seq_at(first.at - 1), machine.journal.seq_at(record.times.ended_at)):
        reader.take(kept.step)
    story.faults += reader.open_faults()
    story.faults.sort(key=lambda fault: fault.at)
    return story


def _runs(machine: TimeMachine, record: TaskRecord) -> tuple[CaseRun, ...]:
    found: list[CaseRun] = []
    begun, again = record.times.submitted_at, ""
    got: dict[int, Micros] = {}
    begins = {1: begun}
    ends: dict[int, str] = {}
    for kept in machine.events(task=record.id):
        for change in kept.step.changes:
            if type(change) is not ch.TaskPut or change.task.id != record.id:
                continue
            task = change.task
            if task.run not in begins:
                begins[task.run], ends[task.run - 1] = kept.at, again
            if task.times.assigned_at is not None:
                got.setdefault(task.run, task.times.assigned_at)
            again = task.restart.why or again
    for number, begun in sorted(begins.items()):
        at = got.get(number, begun)
        found.append(CaseRun(number, at, at - begun, ends.get(number, "")))
    return tuple(found)


class _Silent(Struct):
    """A machine that is not heard of."""

    since: Micros
    token: bool
    """Its presence token stands."""
    boot_id: str
    lost_at: Micros | None = None


class _Reader:
    def __init__(self, story: CaseStory) -> None:
        self._story, self._id = story, story.task.id
        self._roles: dict[str, tuple[str, ...]] = {}
        self._now: Mapping[str, tuple[str, ...]] = {}
        self._counts: dict[tuple[str, str], int] = {}
        self._open: dict[str, tuple[str, int, Micros]] = {}
        self._agents: dict[str, AgentRecord] = dict(story.began.agents)
        self._silent: dict[str, _Silent] = {}

    def take(self, step: EngineStep) -> None:
        story = self._story
        for change in step.changes:
            if isinstance(change, ch.AgentPut):
                self._agent(step.at, change.agent)
        if isinstance(step.input, Resumed):
            story.resumed.append(step.at)
        if self._id not in tasks_of(step):
            return
        if isinstance(step.input, Abort | Operator | LockdownOrder) and not isinstance(step.reply, Refusal):
            story.orders.append((step.at, step.input))
        for change in step.changes:
            match change:
                case ch.Granted(task, roles) if holder_of(task) == self._id:
                    self._roles |= roles
                case ch.TaskPut(task) if task.id == self._id:
                    self._now = task.agents.roles or self._now
                case ch.QuestionPut(question) if question.task == self._id and question.asked_at >= story.at:
                    story.questions[question.id] = question
                case ch.GoalPut(goal) if goal.task == self._id and goal.action != CONFIRM:
                    self._goal(step.at, goal)
        for effect in step.effects:
            if isinstance(effect, SendGoal) and effect.task == self._id and effect.action != CONFIRM:
                self._sent(step.at, effect)
            elif isinstance(effect, NotifyPeople) and effect.task == self._id:
                story.notices.append(effect.text)

    def _sent(self, at: Micros, goal: SendGoal) -> None:
        if goal.goal_id in self._open:
            return
        role = _role(self._now, goal.agent)
        for name in dict.fromkeys((goal.agent, role)):
            if name:
                self._counts[name, goal.action] = self._counts.get((name, goal.action), 0) + 1
        who = role or goal.agent
        self._open[goal.goal_id] = (who, self._counts[who, goal.action], at)
        self._story.sent.append(StoryGoal(_role(self._roles, goal.agent) or goal.agent, goal.agent, goal.action))

    def _goal(self, at: Micros, goal: GoalRecord) -> None:
        sent = self._open.get(goal.id)
        if (
            sent is not None
            and goal.state in ("failed", "rejected")
            and all(one.goal.id != goal.id for one in self._story.failed)
        ):
            self._story.failed.append(Failed(sent[0], goal.action, sent[1], goal, sent[2], at))

    # -- faults --------------------------------------------------------------------------------------------------------
    def _agent(self, at: Micros, agent: AgentRecord) -> None:
        old, self._agents[agent.id] = self._agents.get(agent.id), agent
        if old is None or agent.human:
            return
        self._heard(at, old, agent)
        if agent.task != self._id:
            return
        if agent.control == "pilot" != old.control:
            self._story.faults.append(Fault(at, agent.id, "take_over"))
        elif old.control == "pilot" != agent.control:
            self._story.faults.append(Fault(at, agent.id, "hand_back"))

    def _heard(self, at: Micros, old: AgentRecord, agent: AgentRecord) -> None:
        silent = self._silent.get(agent.id)
        if silent is None and self._id in (old.task, agent.task):
            if old.boot_id and old.boot_id != agent.boot_id:  # before its silence was noticed
                self._story.faults.append(Fault(old.heard_at, agent.id, "kill", until=at))
            elif agent.liveness != "ALIVE" and old.liveness == "ALIVE":
                self._silent[agent.id] = _Silent(_since(at, agent), agent.present, agent.boot_id)
            return
        if silent is None:
            return
        silent.token &= agent.present
        if agent.liveness == "LOST" and silent.lost_at is None:
            silent.since, silent.lost_at = (agent.heard_at if silent.token else max(silent.since, agent.heard_at)), at
        if agent.boot_id != silent.boot_id or agent.liveness == "ALIVE":
            del self._silent[agent.id]
            self._story.faults += _over(agent, silent, at)

    def open_faults(self) -> list[Fault]:
        """Return the faults that were not over at the end."""
        return [
            Fault(one.since, agent, "kill", lost_at=one.lost_at)
            for agent, one in self._silent.items()
            if one.lost_at is not None
        ]


def _since(at: Micros, agent: AgentRecord) -> Micros:
    """Return when a machine fell silent: when its token vanished, if that was soon after its last status."""
    return at if not agent.present and at - agent.heard_at <= TOKEN_US else agent.heard_at


def _over(agent: AgentRecord, silent: _Silent, at: Micros) -> list[Fault]:
    if agent.boot_id != silent.boot_id:
        return [Fault(silent.since, agent.id, "kill", until=at, lost_at=silent.lost_at)]
    if silent.lost_at is None:
        return []  # a status came late: nothing depended on it
    presence = "stays" if silent.token else ""
    return [Fault(silent.since, agent.id, "link_loss", until=at, presence=presence, lost_at=silent.lost_at)]


def _role(roles: Mapping[str, tuple[str, ...]], agent: str) -> str:
    return next((name for name, agents in roles.items() if agent in agents), "")
