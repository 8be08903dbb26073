"""Why a block does not get its resources: who holds them, who waits before it, and what those do meanwhile."""

from collections.abc import Iterator

from formiga_bt.engine.kernel.records import AgentRequest, TaskRecord
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.show.facts import Because
from formiga_bt.show.why.follow import behind_machine, behind_task
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.words import CLAIMS, say, span


def wanted(request: AgentRequest) -> str:
    """Return what a block asks for: `lift_1, dock_bay: 2`."""
    return ", ".join(name if units == 1 else f"{name}: {units}" for name, units in request.units.items())


def claims_asked(scene: WhyScene, request: AgentRequest) -> Iterator[Because]:
    """Tell how a block's request for resources stands."""
    verdicts = scene.state.explanations.get(request.task)
    if verdicts is None:
        yield Because("not_looked", "the allocator has not looked at it yet")
        return
    for verdict in verdicts:
        yield Because(verdict.code, say(CLAIMS, verdict.code, detail=verdict.detail))
    seen: set[str] = set()
    for name in request.units:
        for task in [one for one in scene.state.tasks.values() if name in one.resources.units and one.id not in seen]:
            if task.id == request.holder:
                continue
            seen.add(task.id)
            since = min(claim.at for claim in task.resources.claims.values() if name in claim.units)
            text = f"{task.id} holds {task.resources.units[name]} of {name} since {span(scene.now - since)}"
            yield Because("holds", text, f"formiga why {task.id}")
            yield from deeper(behind_task(scene, task, (request.holder,)))
        for agent in [one for one in scene.state.agents.values() if name in one.inside and one.id not in seen]:
            owner = scene.state.tasks.get(agent.task)
            if owner is not None and (owner.id == request.holder or name in owner.resources.units):
                continue
            seen.add(agent.id)
            yield Because("inside", f"{agent.id} is in {name}, or on its way in", agent=agent.id)
            yield from deeper(behind_machine(scene, agent.id))
    due = scene.state.deadlines.get(NodeDue(request.holder, request.node))
    if due is not None:
        yield Because("resource_timeout", f"it gives up in {span(due.at - scene.now)} (the block's `wait`)")


def held(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell which resources a task holds, and who waits for them."""
    for name, units in task.resources.units.items():
        waits = [one for one in scene.state.requests.values() if name in one.units and one.holder != task.id]
        waits.sort(key=lambda one: one.rank(scene.now))
        names = ", ".join(one.holder for one in waits)
        claims = [claim for claim in task.resources.claims.values() if name in claim.units]
        since = span(scene.now - min(claim.at for claim in claims))
        more = f"; {names} wait{'s' if len(waits) == 1 else ''} for it" if waits else ""
        kept = ", until its machines are home" if all(claim.left for claim in claims) else ""
        yield Because("holds", f"it holds {units} of {name} since {since}{kept}{more}")
