"""The story of a task as a case for `formiga test`: what people answered, what failed, who was there, and how it ended."""

import json
import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final

from msgspec import Struct

from formiga_bt.casework.judging import standing
from formiga_bt.clock import SECOND, Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.inputs import Abort, LockdownOrder, Notify, Operator, SendGoal, Step
from formiga_bt.engine.records import AgentRecord, GoalRecord, Question, TaskRecord
from formiga_bt.engine.state import EngineState
from formiga_bt.errors import UnusableFile
from formiga_bt.geo import Place, Position, Region
from formiga_bt.lang.model import Site, Task
from formiga_bt.lang.types import AgentRef, Type
from formiga_bt.replay.machine import TimeMachine
from formiga_bt.replay.when import in_words
from formiga_bt.transport.agent_side import CONFIRM
from formiga_bt.units import format_quantity

NEAR_M: Final = 1.0
FULL: Final = 99.5
LOOSE: Final = ("after", "actions", "notices", "answers_asked", "end_state")
"""What of a case may be left out or made easier if it does not come again in simulation."""
_NAME: Final = re.compile(r"[A-Za-z_]\w*")


class Story(Struct):
    """What the steps of a task tell that a case is made of."""

    task: TaskRecord
    began: EngineState
    ended: EngineState
    sent: list[tuple[str, str, str]]
    """Goals in the order of sending: role or agent as `formiga test` names it, agent, action."""
    goals: list[tuple[str, str, int, GoalRecord, Micros, Micros]]
    """Of those that failed: role or agent, action, the how-manieth, the goal, when it was sent and when it ended."""
    questions: dict[str, Question]
    notices: list[str]
    orders: list[tuple[Micros, Abort | Operator | LockdownOrder]]
    faults: list[tuple[Micros, str, str]]
    """When, agent, kind."""


def story_of(machine: TimeMachine, task_id: str) -> Story:
    """Return what a case needs of a task.

    Raises:
        UnusableFile: there is no such task, it runs still, or its beginning is no longer kept.
    """
    record = machine.record(task_id)
    if record is None:
        raise UnusableFile(f"the journal knows no task '{task_id}'; formiga replay lists those of a moment")
    if record.ended_at is None:
        raise UnusableFile(f"{task_id} has not ended; its story becomes a case when it has")
    if record.submitted_at < machine.first:
        raise UnusableFile(f"{task_id} began before the journal does; what is missing cannot be played again")
    began, ended = machine.state(record.submitted_at), machine.state(record.ended_at)
    story = Story(record, began, ended, [], [], {}, [], [], [])
    reader = _Reader(story)
    for kept in machine.events(task=task_id):
        reader.take(kept.step)
    return story


class _Reader:
    def __init__(self, story: Story) -> None:
        self._story, self._id = story, story.task.id
        self._roles: dict[str, tuple[str, ...]] = {}
        self._now: Mapping[str, tuple[str, ...]] = {}
        self._counts: dict[tuple[str, str], int] = {}
        self._open: dict[str, tuple[str, int, Micros]] = {}
        self._agents: dict[str, AgentRecord] = dict(story.began.agents)

    def take(self, step: Step) -> None:
        story = self._story
        if isinstance(step.input, Abort | Operator | LockdownOrder) and not step.reply.startswith("error:"):
            story.orders.append((step.at, step.input))
        for change in step.changes:
            match change:
                case ch.Granted(task, roles) if task.partition("|")[0] == self._id:
                    self._roles |= roles
                case ch.TaskPut(task) if task.id == self._id:
                    self._now = task.roles or self._now
                case ch.QuestionPut(question) if question.task == self._id:
                    story.questions[question.id] = question
                case ch.GoalPut(goal) if goal.task == self._id and goal.action != CONFIRM:
                    self._goal(step.at, goal)
                case ch.AgentPut(agent):
                    self._agent(step.at, agent)
        for effect in step.effects:
            if isinstance(effect, SendGoal) and effect.task == self._id and effect.action != CONFIRM:
                self._sent(step.at, effect)
            elif isinstance(effect, Notify) and effect.task == self._id:
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
        self._story.sent.append((_role(self._roles, goal.agent) or goal.agent, goal.agent, goal.action))

    def _goal(self, at: Micros, goal: GoalRecord) -> None:
        sent = self._open.get(goal.id)
        if (
            sent is not None
            and goal.state in ("failed", "rejected")
            and all(one[3].id != goal.id for one in self._story.goals)
        ):
            self._story.goals.append((sent[0], goal.action, sent[1], goal, sent[2], at))

    def _agent(self, at: Micros, agent: AgentRecord) -> None:
        old, self._agents[agent.id] = self._agents.get(agent.id), agent
        if old is None or agent.human or agent.task != self._id:
            return
        if agent.liveness == "LOST" != old.liveness:
            self._story.faults.append((at, agent.id, "kill"))
        elif old.liveness == "LOST" != agent.liveness:
            self._story.faults.append((at, agent.id, "restart"))
        elif agent.control == "pilot" != old.control:
            self._story.faults.append((at, agent.id, "take_over"))
        elif old.control == "pilot" != agent.control:
            self._story.faults.append((at, agent.id, "hand_back"))


def _role(roles: Mapping[str, tuple[str, ...]], agent: str) -> str:
    return next((name for name, agents in roles.items() if agent in agents), "")


# -- writing -----------------------------------------------------------------------------------------------------------
def text_of(
    story: Story, site: Site, model: Task, files: Mapping[str, str], zone: Any, loose: Collection[str] = ()
) -> str:
    """Return a test file with one case.

    Args:
        story: of the task.
        site: where it was.
        model: of the task.
        files: `task` and `site` as the file names them; no `site`: the demo site.
        zone: of the times that people read.
        loose: of `LOOSE`, what is left out or made easier.
    """
    task = story.task
    lines = [
        f"# {task.id} as it was, from the journal of {site.name}: formiga replay --task {task.id} --as-test FILE",
        "formiga_test: 1",
        *(f"{key}: {_quoted(name)}" for key, name in files.items()),
        "cases:",
        f"  - name: {_quoted(f'{task.id} on {in_words(task.submitted_at, zone)}')}",
    ]
    params = {
        name: literal(value, model.params[name].type if name in model.params else None, site)
        for name, value in task.params.items()
        if value is not None
    }
    if params:
        lines.append(f"    params: {_flow(params)}")
    lines += _block("agents", [f"{name}: {_flow(keys)}" for name, keys in _agents(story, site)])
    answers = [*_answers(story), *_failures(story, easy="after" in loose)]
    lines += _block("answers", [f"- {_flow(keys)}" for keys in answers])
    lines += _block(
        "faults", [f"- {_flow(_at(story, at) | {'agent': who, 'kind': kind})}" for at, who, kind in story.faults]
    )
    lines += _block("orders", [f"- {_flow(keys)}" for keys in _orders(story, site)])
    lines.append("    expect:")
    lines += [f"      {line}" for line in _expect(story, loose)]
    return "\n".join(lines) + "\n"


def _block(key: str, items: list[str]) -> list[str]:
    return [f"    {key}:", *(f"      {item}" for item in items)] if items else []


def _flow(keys: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in keys.items()) + "}"


def _quoted(text: str) -> str:
    return text if re.fullmatch(r"[\w./-]+", text) and not text[0].isdigit() else json.dumps(text, ensure_ascii=False)


def literal(value: Any, kind: Type | None, site: Site) -> str:
    """Return a runtime value as it is written in a file."""
    match value:
        case AgentRef():
            return value.id
        case bool():
            return "true" if value else "false"
        case int() | float():
            return format_quantity(kind.name if kind is not None else "", float(value))
        case Position():
            return _flow({**_metres(value), "height": f"{value.up_m:g} m"})
        case Place():
            return next((name for name, at in site.places.items() if at == value), None) or _flow(_metres(value))
        case Region():
            known = next((name for name, one in site.regions.items() if one == value), None)
            return known or "[" + ", ".join(_flow(_metres(corner)) for corner in value.corners) + "]"
        case tuple() | list():
            item = kind.item if kind is not None else None
            return "[" + ", ".join(literal(one, item, site) for one in value) + "]"
        case dict():
            return _flow({name: literal(one, None, site) for name, one in value.items()})
        case _:
            return _quoted(str(value))


def _metres(at: Place | Position) -> dict[str, str]:
    return {"east": f"{round(at.east_m, 2):g} m", "north": f"{round(at.north_m, 2):g} m"}


def _seconds(us: Micros) -> str:
    return f"{max(0.0, us / SECOND):.1f} s"


def _at(story: Story, at: Micros) -> dict[str, str]:
    return {"at": _seconds(at - story.task.submitted_at)}


def _agents(story: Story, site: Site) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield how the fleet differed from the site at rest; who was busy with something else is not there."""
    task = story.task
    mine = {*task.granted, *(agent for _, agent, _ in story.sent)}
    for name, known in site.agents.items():
        agent = story.began.agents.get(name)
        elsewhere = agent is not None and agent.task not in ("", task.id)
        if agent is None or (
            name not in mine and not agent.human and (elsewhere or agent.quarantine or not agent.present)
        ):
            yield name, {"absent": "true"}
            continue
        keys = {} if agent.human else _charge(agent)
        port = site.ports.get(known.home)
        spot = port.at if port is not None else None
        if agent.position is not None and name in mine and not (isinstance(spot, Place) and _near(agent, spot)):
            keys["at"] = _flow(_metres(agent.position.ground))
        if keys:
            yield name, keys
    for name in sorted(mine - set(site.agents)):
        agent = story.began.agents.get(name)
        if agent is not None and agent.position is not None:
            yield name, {"type": agent.type, "at": _flow(_metres(agent.position.ground)), **_charge(agent)}


def _charge(agent: AgentRecord) -> dict[str, str]:
    return {} if agent.battery is None or agent.battery >= FULL else {"battery": f"{agent.battery:.0f} %"}


def _near(agent: AgentRecord, spot: Place) -> bool:
    at = agent.position
    return at is not None and abs(at.east_m - spot.east_m) <= NEAR_M and abs(at.north_m - spot.north_m) <= NEAR_M


def _answers(story: Story) -> Iterator[dict[str, str]]:
    asks = [one for one in story.questions.values() if one.kind == "ask"]
    for n, question in enumerate(asks, 1):
        yield {"ask": str(n), **_reply(question)}
    others = [one for one in story.questions.values() if one.kind != "ask"]
    if any(one.reply is None or one.reply["answer"] != "clear" for one in others):
        for question in others:
            yield {"ask": _quoted(question.text.partition(":")[0]), **_reply(question)}


def _reply(question: Question) -> dict[str, str]:
    if question.reply is None:
        return {"never": "true"}
    return {
        "answer": _quoted(str(question.reply["answer"])),
        "after": _seconds(int(question.reply.get("at", question.asked_at)) - question.asked_at),
    }


def _failures(story: Story, *, easy: bool) -> Iterator[dict[str, str]]:
    for who, action, nth, goal, sent, ended in story.goals:
        keys = {"do": f"{who}.{action}", "nth": str(nth)}
        code = goal.code if _NAME.fullmatch(goal.code) else "failed"
        if goal.state == "rejected":
            yield {**keys, "reject": code}
        else:
            yield {**keys, "fail": code, "after": "0.5 s" if easy else _seconds(ended - sent)}


def _orders(story: Story, site: Site) -> Iterator[dict[str, str]]:
    for at, order in story.orders:
        by = {"by": order.by} if order.by in site.agents else {}
        match order:
            case Abort(task, how) if task == story.task.id:
                yield {**_at(story, at), "abort": story.task.name, **({"how": how} if how else {}), **by}
            case LockdownOrder(how):
                yield {**_at(story, at), "lockdown": how, **by}
            case Operator(ordered, target):
                name = story.task.name if target == story.task.id else target or "all"
                verb, _, rest = ordered.partition("_")
                yield {**_at(story, at), "order": verb, "target": name, **({"how": rest} if rest else {}), **by}


def _expect(story: Story, loose: Collection[str]) -> Iterator[str]:
    task = story.task
    yield f"status: {task.status.lower()}"
    code = task.code.removeprefix("failed:")
    if task.status != "SUCCEEDED" and _NAME.fullmatch(code):
        yield f"code: {code}"
    if "actions" not in loose:
        yield f"actions: [{', '.join(f'{who}.{action}' for who, _, action in story.sent)}]"
    machines = {who: agent for who, agent, _ in story.sent}
    ends = {
        (who if list(machines).count(who) == 1 else agent): standing(story.ended.agents[agent])
        for who, agent in machines.items()
        if agent in story.ended.agents and not story.ended.agents[agent].human
    }
    if ends and "end_state" not in loose:
        yield f"end_state: {_flow(ends)}"
    asks = sum(one.kind == "ask" for one in story.questions.values())
    if "answers_asked" not in loose:
        yield f"answers_asked: {asks}"
    if story.notices and "notices" not in loose:
        parts = [re.split(r"\d", text)[0].strip() for text in story.notices]
        yield f"notices: [{', '.join(json.dumps(part, ensure_ascii=False) for part in parts)}]"
