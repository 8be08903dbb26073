"""What a live condition reads, as blackboard keys: fields of agents, who is in the fleet, and names of the task's scopes."""

from typing import Final

from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.state import members_key, name_key
from formiga_bt.engine.tasks.env import TaskEnv, with_extensions
from formiga_bt.lang.expr.members import type_read
from formiga_bt.lang.model import Expr, Unset
from formiga_bt.lang.types import AgentRef

KEY_OF_FIELD: Final = {"status": "pool", "airborne": "landed", "payload": "payload_kg", "transit_height": "layer_m"}
"""Fields whose blackboard key has another name."""


def watch_keys(core: Core, env: TaskEnv, cond: Expr, task_id: str, scope: str) -> tuple[list[str], bool]:
    """Return the keys whose change may change the condition, and whether they stay the same while the task's names do.

    Each name is also watched in the scopes around.
    """
    keys: list[str] = []
    fixed = True
    for read in cond.reads:
        of = type_read(read)
        if of:
            fixed = False
            keys += [members_key(one) for one in with_extensions(core, of)]
        else:
            keys += [name_key(task_id, where, read.name) for where in scopes_up(core, task_id, scope)]
        if not read.field:
            continue
        try:
            value = env.members(of) if of else env.name(read.name)
        except Unset:
            continue
        for ref in value if isinstance(value, tuple) else (value,):
            agent = core.state.agents.get(ref.id) if isinstance(ref, AgentRef) else None
            if agent is not None:
                keys.append(f"/fleet/{agent.type}/{agent.id}/{KEY_OF_FIELD.get(read.field, read.field)}")
            else:
                fixed = False  # it may yet come
    return keys, fixed


def scopes_up(core: Core, task_id: str, scope: str) -> list[str]:
    """Return a scope and those around it, innermost first."""
    scopes = core.state.scopes.get(task_id, {})
    found = [scope]
    while ".." in scopes.get(found[-1], {}):
        found.append(scopes[found[-1]][".."])
    return found
