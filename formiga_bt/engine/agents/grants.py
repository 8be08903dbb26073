"""A grant: agents become a task's, each machine with a cruise layer of its own while there are enough."""

from collections.abc import Mapping

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core


def assign(core: Core, task_id: str, roles: Mapping[str, tuple[str, ...]]) -> None:
    """Mark the agents as the task's and give each machine a layer."""
    layers: dict[str, float] = {}
    for role, agents in roles.items():
        for agent_id in agents:
            agent = core.state.agents[agent_id]
            if agent.shared:
                continue
            if not agent.flies:
                core.put_agent(agent_id, task=task_id, role=role, pool="ASSIGNED")
                continue
            kept = agent.layer_m
            if kept is None or kept > core.rules(agent, task_id).max_height_m:
                kept = free_layer(core, agent_id, task_id)
            layers[agent_id] = kept
            core.put_agent(agent_id, task=task_id, role=role, pool="ASSIGNED", layer_m=layers[agent_id])
    core.emit(ch.Granted(task_id, dict(roles), layers))


def free_layer(core: Core, agent_id: str, task_id: str) -> float:
    """Return a cruise layer that it may fly in, metres over the base's ground.

    The one that fewest machines of its own task have, for the gate does not keep those apart, then fewest of all.
    """
    others = [a for a in core.state.agents.values() if a.layer_m is not None and a.id != agent_id]
    used = [a.layer_m for a in others]
    own = [a.layer_m for a in others if a.task == task_id]
    most = core.rules(core.state.agents[agent_id], task_id).max_height_m
    layers = [layer for layer in core.site.layers_m if layer <= most] or [min(core.site.layers_m)]
    return min(layers, key=lambda layer: (own.count(layer), used.count(layer), layers.index(layer)))
