"""Resources of the site as facts: who holds them, which machines are in them, who waits."""

from collections.abc import Iterable

from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Resource
from formiga_bt.show.facts import HeldUnits, ResourceFact


def resource_facts(state: EngineState, resources: Iterable[Resource]) -> tuple[ResourceFact, ...]:
    """Return a fact for each resource."""
    return tuple(_fact(state, one) for one in resources)


def _fact(state: EngineState, resource: Resource) -> ResourceFact:
    name = resource.name
    holders = [task for task in state.tasks.values() if name in task.resources.units]
    held = [
        HeldUnits(
            task=task.id,
            units=task.resources.units[name],
            since=min(claim.at for claim in task.resources.claims.values() if name in claim.units),
        )
        for task in holders
    ]
    waiting = [request for request in state.requests.values() if name in request.units]
    waiting.sort(key=lambda request: request.rank(state.now))
    return ResourceFact(
        name=name,
        capacity=resource.capacity,
        held=tuple(held),
        inside=tuple(agent.id for agent in state.agents.values() if name in agent.inside),
        waiting=tuple(dict.fromkeys(request.holder for request in waiting)),
    )
