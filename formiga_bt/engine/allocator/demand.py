"""What steps may still ask for while they hold what they have: resources by name, machines by pool.

Steps that run one after another, or beside each other, need what the greediest of them needs, for each gives back what it
took; blocks inside a block need both. That is all the safe order (`safe_order`) must know of a task before it runs.
"""

from collections.abc import Iterable, Mapping

from formiga_bt.lang.model import AgentType, Call, Request, Role, Step, WithAgents, WithResource
from formiga_bt.lang.walk import children

Demand = dict[str, int]
"""Resource, or pool (`pool_of`) -> units or machines of it."""


def pool_of(role: Role, types: Mapping[str, AgentType]) -> str:
    """Return the pool of a role: the types of machines that fit it, in the catalogue's order; "" = people, who are shared."""
    fit = [t for t in types.values() if any(name in role.types for name in (t.name, *t.extends))]
    return "@" + "|".join(t.name for t in fit if not (t.human or t.shared)) if any(not t.human for t in fit) else ""


def demand_of(steps: Iterable[Step], types: Mapping[str, AgentType]) -> Demand:
    """Return what steps may ask for at once, beyond what is held around them."""
    most: Demand = {}
    for step in steps:
        for key, units in _of_step(step, types).items():
            most[key] = max(most.get(key, 0), units)
    return most


def _of_step(step: Step, types: Mapping[str, AgentType]) -> Demand:
    match step:
        case WithResource():
            return _both(step.units, demand_of(step.steps, types))
        case WithAgents():
            return _both(_of_roles(step.roles.values(), types), demand_of(step.steps, types))
        case Request():
            return _of_roles(step.needs, types) if step.wait else {}
        case Call():
            return demand_of(step.subtree.steps, types)
        case _:
            return demand_of(children(step), types)


def _of_roles(roles: Iterable[Role], types: Mapping[str, AgentType]) -> Demand:
    found: Demand = {}
    for role in roles:
        pool = pool_of(role, types)
        if pool:
            least = role.open.min if role.open is not None else role.count or 1
            found[pool] = found.get(pool, 0) + least
    return found


def _both(one: Mapping[str, int], other: Mapping[str, int]) -> Demand:
    return {key: one.get(key, 0) + other.get(key, 0) for key in (*one, *other)}
