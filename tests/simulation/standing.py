"""What must hold between two steps, whatever happened: looked at from time to time, by the state and the live engine.

And what a step may not do (`of_step`): looked at with each, before its changes are folded.
"""

from collections.abc import Iterator
from typing import Final

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.core import clock_stands
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import GoalTimer
from formiga_bt.engine.tasks.treerun import CompiledTrees
from formiga_bt.nodes.base import RUNNING
from formiga_bt.nodes.memory import ItemsMem

RULES: Final = {
    "late": "a deadline fires at its instant, but for those that passed while there was no engine",
    "clock": "the clock of a HELD task stands still, that of another runs",
    "leak": "nothing is left of a task that has ended",
    "tree": "the nodes that run are those that the state remembers",
    "epoch": "each engine has an epoch above the one before",
    "reconcile": "until it is known what happened meanwhile no timer fires, and nothing but safety goals leaves",
    "again": "no step sends a goal twice",
    "held_back": "nothing of a HELD task's steps is sent to a machine, and no machine is granted in lockdown",
}
Found = Iterator[tuple[str, str]]
"""Rule, and what is wrong."""


def between(state: EngineState, engine: Engine) -> Found:
    """Look at all there is."""
    yield from _clocks(state)
    yield from _leaks(state)
    yield from _trees(engine)


def of_step(state: EngineState, step: inp.EngineStep) -> Found:
    """Look at a step; `state` is still that before it."""
    given = step.input
    if isinstance(given, inp.Resumed):
        epochs = [c.value for c in step.changes if isinstance(c, ch.CounterSet) and c.name == "epoch"]
        if max(epochs, default=state.epoch) <= state.epoch:
            yield "epoch", f"an engine begins with epoch {epochs}, the one before had {state.epoch}"
    yield from _held_back(state, step)
    resume = state.resume
    if isinstance(given, inp.TimerDue) and resume is not None and resume.phase == "asking":
        yield "reconcile", f"{given.timer} fires while machines are asked what they did"
    if resume is None and step.at > state.now and not isinstance(given, inp.Resumed | inp.Outage):
        for timer, deadline in state.deadlines.items():
            if deadline.at < step.at:
                yield "late", f"{timer} was due {(step.at - deadline.at) / 1e6:.3f} s ago"


def of_effects(state: EngineState, step: inp.EngineStep) -> Found:
    """Look at what a step sends and grants; `state` is that after it."""
    for change in step.changes:
        if isinstance(change, ch.Granted) and state.lockdown is not None and not state.tasks[change.task].system.agent:
            yield "held_back", f"{change.task} gets machines in lockdown"
    if isinstance(step.input, inp.Outage) and not any(isinstance(c, ch.ResumePut) for c in step.changes):
        yield "reconcile", "the engine stood still, and asks nobody what happened meanwhile"
    sent = [effect.goal_id for effect in step.effects if isinstance(effect, inp.SendGoal)]
    if len(sent) != len(set(sent)):
        yield "again", f"a goal is sent twice in one step: {', '.join(sent)}"
    for effect in step.effects:
        if not isinstance(effect, inp.SendGoal):
            continue
        if effect.epoch != state.epoch:
            yield "epoch", f"{effect.goal_id} carries epoch {effect.epoch}, the engine's is {state.epoch}"
        goal, agent = state.goals.get(effect.goal_id), state.agents.get(effect.agent)
        if goal is None or agent is None or agent.human or effect.safety:
            continue
        fresh = any(isinstance(c, ch.GoalPut) and c.goal.id == goal.id for c in step.changes)
        if (
            fresh and state.resume is not None and state.resume.phase == "asking"
        ):  # else it never arrived and goes again
            yield "reconcile", f"{effect.goal_id} leaves while machines are asked what they did"


def _held_back(state: EngineState, step: inp.EngineStep) -> Found:
    """Follow a step in order: a goal that is sent while its task is HELD, by a cause of before it."""
    tasks: dict[str, TaskRecord] = {}
    for change in step.changes:
        if isinstance(change, ch.TaskPut):
            tasks[change.task.id] = change.task
        elif isinstance(change, ch.GoalPut) and change.goal.state == "sent" and change.goal.section == "steps":
            goal, old = change.goal, state.goals.get(change.goal.id)
            task = tasks.get(goal.task) or state.tasks.get(goal.task)
            agent = state.agents.get(goal.agent)
            if task is None or not task.hold.words or agent is None or agent.human or goal.safety:
                continue
            if old is None or old.state == "gated":
                yield "held_back", f"{goal.id} leaves, its task is HELD: {', '.join(task.hold.words)}"


def _clocks(state: EngineState) -> Found:
    for task in state.tasks.values():
        if task.ended:
            continue
        stands = clock_stands(task)
        if stands == (task.hold.clock.stands_since is None):
            yield (
                "clock",
                f"{task.id} is held by {task.hold.words}, and its clock stands since {task.hold.clock.stands_since}",
            )
        if task.hold.clock.paused and not stands:
            yield (
                "clock",
                f"{task.id} is not held, and {', '.join(str(one.timer) for one in task.hold.clock.paused)} stands still",
            )
    for timer, deadline in state.deadlines.items():
        owner = state.tasks.get(deadline.task)
        if deadline.pausable and owner is not None and clock_stands(owner):
            yield "clock", f"{timer} runs, and its task is held by {owner.hold.words}"


def _leaks(state: EngineState) -> Found:
    for goal in state.goals.values():
        if goal.task and goal.owner != "!none" and _is_over(state, goal.task):
            yield "leak", f"the goal {goal.id} ({goal.state}) of a task that has ended"
    for question in state.questions.values():
        if _is_over(state, question.task):
            yield "leak", f"the question {question.id} of a task that has ended"
    for request in state.requests.values():
        if _is_over(state, request.holder):
            yield "leak", f"the request {request.task} of a task that has ended"
    for timer, deadline in state.deadlines.items():
        if deadline.task and _is_over(state, deadline.task):
            yield "leak", f"the deadline {timer} of a task that has ended"
    for task_id in (*state.memory, *state.scopes):
        if _is_over(state, task_id):
            yield "leak", f"memory or names of {task_id}, which has ended"
    for agent in state.agents.values():
        if agent.task and _is_over(state, agent.task):
            yield "leak", f"{agent.id} belongs to {agent.task}, which has ended"
    for timer in state.wall:
        if isinstance(timer, GoalTimer) and timer.goal not in state.goals:
            yield "leak", f"the timer {timer} of a goal that is over"


def _is_over(state: EngineState, task_id: str) -> bool:
    task = state.tasks.get(task_id)
    return task is None or task.ended


def _trees(engine: Engine) -> Found:
    for task_id in engine.core.open:
        run = engine.runs.open.get(task_id)
        nodes = run.trees._nodes if run is not None and isinstance(run.trees, CompiledTrees) else {}
        live = {key for key, node in nodes.items() if node.status is RUNNING}
        memory = engine.state.memory.get(task_id, {})
        kept = {key for key, mem in memory.items() if not isinstance(mem, ItemsMem)}
        if live != kept and task_id not in engine.unbuilt:
            odd = ", ".join(sorted(live ^ kept)[:3])
            yield "tree", f"{task_id}: {odd} {'runs, and is not kept' if live - kept else 'is kept, and does not run'}"
