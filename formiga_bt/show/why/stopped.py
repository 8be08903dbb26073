"""Why a task does not go on: who holds it, which orders stand on its machines, what was interrupted, which limit was broken.

Pure functions over a state, part of `why`.
"""

import math
from collections.abc import Iterator
from typing import assert_never

from formiga_bt.engine.kernel.causes import (
    ClearanceHold,
    HoldCause,
    LockdownHold,
    OperatorHold,
    ResumeHold,
    TakeOverHold,
    kind_and_agent,
)
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.orders.continuing import came_down, climbs_to_m, is_done
from formiga_bt.engine.orders.continuing import cannot as cannot_continue
from formiga_bt.lang.model import Catalogue
from formiga_bt.show.facts import Because
from formiga_bt.show.why.going_on import in_the_way, ways_on
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.standing import AGAIN, doing, given
from formiga_bt.show.why.words import HOLDS, REASONS, say, span


def locked(scene: WhyScene) -> Iterator[Because]:
    """Tell of lockdown to a task that waits for agents."""
    found = scene.state.lockdown
    if found is not None:
        text = f"the site is locked down by {found.by or 'somebody'} since {span(scene.now - found.at)}; nothing is granted"
        yield Because("lockdown", text, "formiga lockdown release")


def stopped(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell who holds a task, what its machines do for their orders, and what `continue` would do."""
    state, catalogue, model = scene.state, scene.catalogue, scene.model(task)
    if task.restart.why:
        reason = f" {task.outcome.reason}" if task.outcome.reason else ""
        fails = task.restart.why == "preempted" and model is not None and model.if_preempted == "fail"
        then = "it ends" if fails else "it begins anew from its first step"
        yield Because(task.restart.why, f"{AGAIN[task.restart.why]}{reason}; its machines come home, then {then}")
    told: set[str] = set()
    for cause in task.hold.causes:
        yield _held(scene, task, cause, told)
    for agent_id in _machines_of(task):
        agent = state.agents.get(agent_id)
        if agent is None:
            continue
        order = state.orders.get(agent_id)
        if order is not None and agent_id not in told:
            free = order.scope not in ("engine", "lockdown", "task") and in_the_way(state, agent, catalogue) is None
            hint = f"formiga continue {agent_id}" if free else ""  # of a task's order the task's line says it
            yield Because(
                f"order.{order.stop}",
                f"{given(order, scene.now)}: {doing(state, order, scene.now, scene.wall)}",
                hint,
                agent_id,
            )
        if agent.breach:
            yield breach(agent)
    for goal in state.goals.values():
        if goal.task == task.id and goal.state == "interrupted":
            yield _interrupted(state, task, goal, catalogue)


def away(scene: WhyScene) -> Iterator[Because]:
    """Tell that it is still being found out what happened while the engine was away."""
    resume = scene.state.resume
    if resume is None or resume.phase == "watching":
        return
    waits = f"; it waits for {', '.join(resume.waits)}, at most 10 s" if resume.waits else ""
    text = f"the engine was away for {resume.outage_us / 1e6:.1f} s and asks what became of its goals{waits}"
    yield Because("reconcile", f"{text}; meanwhile no order leaves and no time limit ends")


def _machines_of(task: TaskRecord) -> list[str]:
    return list(dict.fromkeys([*task.agents.granted, *([task.system.agent] if task.system.agent else [])]))


def _held(scene: WhyScene, task: TaskRecord, cause: HoldCause, told: set[str]) -> Because:
    state, catalogue = scene.state, scene.catalogue
    word, agent_id = kind_and_agent(cause)
    text = say(HOLDS, f"{word}:" if agent_id and f"{word}:" in HOLDS else word, agent=agent_id)
    hint = ""
    order = state.orders.get(agent_id)
    agent = state.agents.get(agent_id)
    match cause:
        case OperatorHold():
            hint = " | ".join(ways_on(state, task, catalogue))
            if order is not None:
                told.add(agent_id)
                text = f"{given(order, scene.now)}: {doing(state, order, scene.now, scene.wall)}"
        case ResumeHold():
            text += _found(state, task)
            hint = " | ".join(ways_on(state, task, catalogue))
        case LockdownHold():
            hint = "formiga lockdown release"
            found = state.lockdown
            if found is not None:
                text += f" ({found.how}) by {found.by or 'somebody'} since {span(scene.now - found.at)}"
        case TakeOverHold():
            if agent is None:
                pass
            elif agent.control == "engine":
                text += "; it has been given back, and a person must say what becomes of it"
                hint = f"formiga handback {agent_id} --continue|--return|--end"
            else:
                text += f"; once its {agent.control} gives it back: formiga handback {agent_id}"
                text += " --continue|--return|--end"
        case ClearanceHold():
            pass
        case _:
            assert_never(cause)
    return Because(f"held.{word}", f"HELD: {text}", hint, agent_id)


def _found(state: EngineState, task: TaskRecord) -> str:
    """Return how the machines of a task were found after the engine was away."""
    text = "".join(f"; {one} {found.change} while the engine was away" for one, found in task.hold.found.items())
    down = [one for one in task.hold.found if one in state.agents and came_down(state, state.agents[one])]
    return f"{text}, and its next step may need {' and '.join(down)} in the air" if down else text


def _interrupted(state: EngineState, task: TaskRecord, goal: GoalRecord, catalogue: Catalogue | None) -> Because:
    who = "its pilot, or its own failsafe, took over" if goal.code == "taken_over" else "by an order"
    order = state.orders.get(goal.agent)
    if goal.code == "in_doubt":
        who = "its process was started anew while the engine was away"
    elif goal.code != "taken_over" and order is not None:
        who = f"by {given(order)}"
    text = f"{goal.agent}.{goal.rest_of or goal.action} was interrupted: {who}"
    if goal.section != "steps":
        return Because("interrupted", text, agent=goal.agent)
    agent = state.agents.get(goal.agent)
    if agent is None or catalogue is None or goal.action not in catalogue.actions:
        return Because("interrupted", f"{text}; `continue` sends it again", agent=goal.agent)
    action = catalogue.actions.__getitem__
    if is_done(goal, agent, action):
        return Because("interrupted", f"{text}; it is done already, `continue` goes on after it", agent=goal.agent)
    cannot = cannot_continue(state, goal, agent, action)
    if cannot:
        hint = f"formiga restart {task.id} | formiga abort {task.id}"
        return Because("cannot_continue", f"{text}; it cannot be continued: {cannot}", hint, goal.agent)
    top = climbs_to_m(goal, agent, action)
    if top is not None and agent.position is not None:
        then = f"climbs from {agent.position.up_m:.0f} m to {top:.0f} m"
        return Because("interrupted", f"{text}; `continue` {then}: what is left of it", agent=goal.agent)
    return Because("interrupted", f"{text}; `continue` sends it again", agent=goal.agent)


def breach(agent: AgentRecord) -> Because:
    """Return which limit a machine breaks, with its numbers."""
    name = agent.breach.removeprefix("!")
    text = f"{agent.id} breaks its limit `{name}`: {say(REASONS, f'envelope.{name}')}{_numbers(agent, name)}"
    if agent.breach.startswith("!"):
        text += "; its landing is finished first, then its task ends"
    return Because(f"envelope.{name}", text, "", agent.id)


def _numbers(agent: AgentRecord, name: str) -> str:
    if name == "reserve" and agent.battery is not None:
        return f" (battery {agent.battery:.0f} %)"
    if name == "wind_max" and agent.wind is not None:
        return f" ({math.hypot(*agent.wind):.1f} m/s)"
    if agent.position is not None and name not in ("reserve", "wind_max", "daylight_only"):
        at = agent.position
        return f" (at {at.east_m:.0f} E {at.north_m:.0f} N, {at.up_m:.0f} m up)"
    return ""
