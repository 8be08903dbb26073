"""Stand-ins for bodies and people: answers that a case gives, and goals that it lets fail, refuses, delays or ends by itself.

`Mocks` belongs to one case. It counts what is asked and ordered, applies the case's rules, and remembers which of them counted
and which answers were no option. What no rule is for is done by the simulated bodies as ever.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from agents_sim.machine import Machine
from agents_sim.person import Person
from agents_sim.world import SimAgent
from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Timer, micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.scenario import ScenarioFault, ScenarioOrder
from formiga_bt.rehearsal.cases.cases import AnswerRule, Case, GoalRule, Rule
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.transport.messages import TERMINAL, GoalRequest

CLEARANCE: Final = frozenset({"clear", "wait", "refuse"})
"""The options of the engine's own question whether people stand clear."""

Roles = Callable[[], Mapping[str, tuple[str, ...]]]
"""Returns which agents have which role of the task now."""


@dataclass(slots=True)
class Used:
    """What became of the rules of a case."""

    rules: set[Mark] = field(default_factory=set)
    """Where the rules stand that counted."""
    no_use: list[str] = field(default_factory=list)
    """Why a rule could not do what it says, in words: an answer that was no option."""


class Mocks:
    """The rules of one case at work.

    Args:
        case: whose rules.
        task_name: goals and questions of its runs count.
        run: which plays the case.
        roles: who has which role now.
    """

    def __init__(self, case: Case, task_name: str, run: VirtualRun, roles: Roles) -> None:
        self.used = Used()
        self.scheduler = run.rehearsal.scheduler
        self._answers, self._goals, self._during = case.answers, case.goals, case.during
        self._run = run
        self._task = f"{task_name}-"
        self._roles = roles
        self._counts: dict[tuple[str, str], int] = {}
        self._asked: list[str] = []
        """Numbers of the questions of `ask` steps, in order."""
        self._said: dict[str, AnswerRule | None] = {}
        """Number of a question -> the rule that answers it, whoever is asked."""
        self._turns: dict[str, int] = {}

    def install(self) -> None:
        """Stand before every agent of the fleet."""
        for agent in self._run.rehearsal.sim.agents.values():
            agent.front.stand_in = _StandIn(self, agent)

    def counts(self, request: GoalRequest) -> bool:
        """Return whether a goal is of the task under test."""
        return request.task_id.startswith(self._task)

    def answer(self, request: GoalRequest) -> AnswerRule | None:
        """Return the rule that answers a question, None if nobody said anything of it."""
        number = str(request.fields.get("number", ""))
        if number not in self._said:
            self._said[number] = self._choose(request, number)
        rule = self._said[number]
        options = [str(option) for option in request.fields.get("options", ())]
        if rule is not None and rule.answer and rule.answer not in options:
            self.used.no_use.append(f"'{rule.answer}' is no answer to {number}: {', '.join(options)}")
            return None
        return rule

    def _choose(self, request: GoalRequest, number: str) -> AnswerRule | None:
        if not CLEARANCE.issuperset(str(option) for option in request.fields.get("options", ())):
            self._asked.append(number)
            for rule in self._answers:
                if rule.number == len(self._asked):
                    return self._use(rule)
        text = str(request.fields.get("question", ""))
        fitting = [rule for rule in self._answers if rule.number is None and rule.text in text]
        if not fitting:
            return None
        word = fitting[0].text
        same = [rule for rule in fitting if rule.text == word]
        turn = self._turns[word] = self._turns.get(word, 0) + 1
        return self._use(same[min(turn, len(same)) - 1])

    def _use(self, rule: AnswerRule) -> AnswerRule:
        if not rule.by:  # one with `by` counts when that person is asked
            self.used.rules.add(rule.mark)
        return rule

    def goal(self, agent: str, action: str) -> GoalRule | None:
        """Count a goal of an agent and return the rule that it falls under."""
        names = [agent, *(role for role, agents in self._roles().items() if agent in agents)]
        for name in names:
            self._counts[name, action] = self._counts.get((name, action), 0) + 1
        for one in self._during:
            if one.action == action and one.who in names and one.nth == self._counts[one.who, action]:
                self.used.rules.add(one.mark)
                self._later(one.befalls(agent))
        for rule in self._goals:
            if rule.action == action and rule.who in names and rule.nth in (None, self._counts[rule.who, action]):
                if rule.does != "fail":
                    self.used.rules.add(rule.mark)  # a failure counts when it comes: the goal may end before
                return rule
        return None

    def _later(self, entry: ScenarioFault | ScenarioOrder) -> None:
        self.scheduler.call_at(self.scheduler.now() + entry.at, lambda: self._run.carry_out(entry))

    def unused(self) -> Sequence[Rule]:
        """Return the rules that never counted; a fault that lasts is one rule, its end too."""
        rules: tuple[Rule, ...] = (*self._answers, *self._goals, *self._during)
        return list({rule.mark: rule for rule in rules if rule.mark not in self.used.rules}.values())


class _StandIn:
    """Before one agent's body (an `agents_sim.faults.StandIn`)."""

    def __init__(self, mocks: Mocks, agent: SimAgent) -> None:
        self._mocks = mocks
        self._agent = agent
        self._held: dict[str, Timer | None] = {}
        """Goals that the body knows nothing of, with what happens to them by itself."""

    def start(self, request: GoalRequest) -> str | None:
        """Take a goal, refuse it, or leave it to the body."""
        if not self._mocks.counts(request):
            return None
        if request.action == CONFIRM:
            return self._ask(request)
        rule = self._mocks.goal(self._agent.spec.id, request.action)
        match rule.does if rule is not None else "":
            case "reject" if rule is not None:
                return rule.code
            case "fail" if rule is not None:
                return self._fail(request, rule)
            case "finish" if rule is not None:
                self._later(request, rule.after_s, lambda: self._end(request, rule.result))
                return ""
            case "wait" if rule is not None:
                self._later(request, rule.after_s, lambda: self._begin(request))
                return ""
        return None

    def cancel(self, goal_id: str) -> bool:
        """Forget a goal that the body knows nothing of."""
        if goal_id not in self._held:
            return False
        timer = self._held.pop(goal_id)
        if timer is not None:
            timer.cancel()
        if self._agent.side is not None:
            self._agent.side.finish(goal_id, "canceled")
        return True

    def _ask(self, request: GoalRequest) -> str | None:
        rule = self._mocks.answer(request)
        if rule is None:
            return None
        mine = rule.by in ("", self._agent.spec.id)
        if mine:
            self._mocks.used.rules.add(rule.mark)
        if not rule.answer or not mine:
            self._held[request.goal_id] = None
            return ""

        def say() -> None:
            result = {"answer": rule.answer, "by": self._agent.spec.id, "at": self._mocks.scheduler.now()}
            body = self._agent.body
            if isinstance(body, Person):
                result |= body.filled(request, rule.form)
            self._end(request, result)

        self._later(request, rule.after_s, say)
        return ""

    def _fail(self, request: GoalRequest, rule: GoalRule) -> str:
        body = self._agent.body
        if not isinstance(body, Machine):
            self._later(request, rule.after_s, lambda: self._break_off(request, rule))
            return ""
        refused = body.start(request)
        if not refused:
            at = self._mocks.scheduler.now() + micros(rule.after_s)
            self._mocks.scheduler.call_at(at, lambda: self._break_off(request, rule))
        return refused

    def _break_off(self, request: GoalRequest, rule: GoalRule) -> None:
        """Make a goal a failure; a drone stops and hovers (or stands) where it is."""
        side, body = self._agent.side, self._agent.body
        self._held.pop(request.goal_id, None)
        if side is None or side.state_of(request.goal_id) in TERMINAL:
            return
        self._mocks.used.rules.add(rule.mark)
        if isinstance(body, Machine):
            body.stop()
            body.report()
        side.finish(request.goal_id, "failed", code=rule.code)

    def _begin(self, request: GoalRequest) -> None:
        self._held.pop(request.goal_id, None)
        refused = self._agent.body.start(request)
        if refused and self._agent.side is not None:
            self._agent.side.finish(request.goal_id, "failed", code=refused)

    def _later(self, request: GoalRequest, after_s: float, call: Callable[[], None]) -> None:
        at = self._mocks.scheduler.now() + micros(after_s)
        self._held[request.goal_id] = self._mocks.scheduler.call_at(at, call)

    def _end(self, request: GoalRequest, result: Mapping[str, object]) -> None:
        self._held.pop(request.goal_id, None)
        if self._agent.side is not None:
            self._agent.side.finish(request.goal_id, "succeeded", result=dict(result))
