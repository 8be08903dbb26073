"""What each running step does now, in a few words: `hwd_1 40 %`, `Q7 asks eve, 41 s`, `round 3 of 10`, `attempt 2 of 3`."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.records import GoalRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.lang.places import static_path
from formiga_bt.nodes import memory as m
from formiga_bt.show.amounts import percent
from formiga_bt.show.history.progress import instance_of
from formiga_bt.show.history.rows import rest_words
from formiga_bt.show.why.words import GATE, HOLDS, say, span

MOST: Final = 2
"""So many instances of a step are told of."""


class _Scene(NamedTuple):
    state: EngineState
    task: TaskRecord
    memory: Mapping[str, m.Mem]
    now: Micros


def notes(state: EngineState, task: TaskRecord, now: Micros) -> dict[str, str]:
    """Return static path -> note of the steps of a task that run, at engine time `now`."""
    scene = _Scene(state, task, state.memory.get(task.id, {}), now)
    instances: dict[str, dict[str, list[str]]] = {}
    for key, mem in scene.memory.items():
        instance = instance_of(key)
        text = _note(scene, key, mem) if instance else ""
        if text:
            instances.setdefault(static_path(instance), {}).setdefault(instance, []).append(text)
    return {path: _join([", ".join(texts) for texts in found.values()]) for path, found in instances.items()}


def _join(texts: list[str]) -> str:
    return "; ".join(texts[:MOST]) + (f"; and {len(texts) - MOST} more" if len(texts) > MOST else "")


def _note(scene: _Scene, key: str, mem: m.Mem) -> str:
    state, task, memory, now = scene
    match mem:
        case m.DoMem(goal_id) if goal_id in state.goals:
            return goal_words(state.goals[goal_id])
        case m.DoMem(agent) if agent in state.agents:
            return f"{agent} is on its way back"
        case m.AskMem(ask):
            return asked(state, ask, now)
        case m.WaitMem():
            left = left_of(state, task, key, now)
            return "" if left is None else f"{span(left)} left" + (", stands still" if _stands(task, key) else "")
        case m.WaitForMem(agent, _):
            return f"waits for {agent}"
        case m.RequestMem(child):
            record = state.tasks.get(child)
            return f"{child} {record.status}" if record is not None else child
        case m.WithMem("waits"):
            return "waits for its agents"
        case m.WithMem("releases", anew=True):
            return "hands over to other agents"
        case m.WithMem("releases"):
            return "gives its agents back"
        case m.LoopMem():
            return _round(scene, key, mem, memory.get(f"{key}:items"))
        case m.GatherMem(states, halting=halting):
            over = sum(letter not in ".R" for letter in states)
            return "stops the rest" if halting else f"{over} of {len(states)} done"
        case m.RetryMem():
            return _attempt(scene, key, mem)
        case m.TimeoutMem(True):
            return "its time is over; waits for the end"
        case m.LiveMem(halting=True):
            return "stops"
        case m.CleanupMem(True):
            return "tidies up"
    return ""


def _round(scene: _Scene, key: str, mem: m.LoopMem, items: m.Mem | None) -> str:
    bounds = [bound for bound in (mem.times, mem.most) if bound is not None]
    if isinstance(items, m.ItemsMem):
        bounds.append(len(items.items))
    text = f"round {mem.round} of {min(bounds)}" if bounds else f"round {mem.round}"
    left = left_of(scene.state, scene.task, key, scene.now) if mem.waiting else None
    return text if left is None else f"{text} in {span(left)}"


def _attempt(scene: _Scene, key: str, mem: m.RetryMem) -> str:
    if mem.waiting:
        left = left_of(scene.state, scene.task, key, scene.now)
        return f"attempt {mem.attempt + 1} of {mem.attempts}" + ("" if left is None else f" in {span(left)}")
    return f"attempt {mem.attempt} of {mem.attempts}" if mem.attempt > 1 else ""


def _stands(task: TaskRecord, key: str) -> bool:
    return task.hold.clock.left_of(NodeDue(task.id, key)) is not None


def left_of(state: EngineState, task: TaskRecord, key: str, now: Micros) -> Micros | None:
    """Return the time until the deadline of a node, also of one that stands still; None: it has none."""
    due = NodeDue(task.id, key)
    left = task.hold.clock.left_of(due)
    if left is not None:
        return left
    found = state.deadlines.get(due)
    return None if found is None else max(0, found.at - now)


def asked(state: EngineState, question_id: str, now: Micros) -> str:
    """Return whom a question asks, and for how long already."""
    question = state.questions.get(question_id)
    if question is None:
        return ""
    who = ", ".join(question.asked) or "nobody"
    return f"{question.number} asks {who}, {span(now - question.asked_at)}"


def goal_words(goal: GoalRecord) -> str:
    """Return who does a goal and how far it has come, or what it waits for."""
    if goal.state == "gated":
        return f"{goal.agent} {gate_words(goal)}"
    if goal.state in ("interrupted", "canceling"):
        return f"{goal.agent} {'stops' if goal.state == 'canceling' else 'was interrupted'}"
    share = percent(goal.progress)
    more = [rest_words(goal) or goal.phase] if goal.rest_of or goal.phase else []
    more += [f"{share * 100:.0f} %"] if share is not None else []
    return " ".join([goal.agent, *more])


def gate_words(goal: GoalRecord) -> str:
    """Return what a goal waits for at the gate."""
    code = "control:handback" if (goal.code, goal.text) == ("control", "handback") else goal.code
    return say(GATE, code, text=goal.text or "another machine", agent=goal.agent)


def hold_words(cause: str) -> str:
    """Return why a task is held: the words of one cause."""
    word, _, agent = cause.partition(":")
    return say(HOLDS, f"{word}:" if agent and f"{word}:" in HOLDS else word, agent=agent)
