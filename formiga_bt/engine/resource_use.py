"""Who takes up a resource now, as the records of tasks and machines say."""

from formiga_bt.engine.kernel.core import Core
from formiga_bt.safety.resources import ResourceUse


def use_of(core: Core, name: str) -> ResourceUse:
    """Return who holds a resource, and which machines take it up."""
    resource = core.site.resources[name]
    claimed = {task: units for task in core.open if (units := core.state.tasks[task].resources.units.get(name, 0)) > 0}
    inside = {agent.id: agent.task for agent in core.state.agents.values() if name in agent.inside}
    return ResourceUse(name=name, capacity=resource.capacity, claimed=claimed, inside=inside)
