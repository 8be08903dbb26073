"""`fleet('picker')`: the agents of a type that are there now, to look at and to ask.

They are those that are admitted and not lost, of the type and of those that extend it, in the order of their admission. A
task holds none of them, so what is made of such a list has types marked `foreign`, and no step may command it. Who is there
changes while tasks run: live conditions are woken by it (`read_of`), and nothing that is read at admission may depend on it.
The call is checked in `fleet_calls`.
"""

from typing import Any, Final

from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.shapes import between
from formiga_bt.lang.model import Dependency, Env, EvalError, UnknownState
from formiga_bt.lang.types import AgentRef

FLEET: Final = "fleet"
"""The name of the helper."""


def read_of(agent_type: str) -> Dependency:
    """Return what an expression reads that depends on which agents of a type there are."""
    return Dependency(f"{FLEET}('{agent_type}')")


def type_read(read: Dependency) -> str:
    """Return the agent type of `fleet('picker')`, or "" where something else is read."""
    return read.name[len(FLEET) + 2 : -2] if read.name.startswith(f"{FLEET}('") else ""


def fleet(env: Env, agent_type: str) -> tuple[AgentRef, ...]:
    """Return the agents of a type that are there now, in the order of their admission."""
    return env.members(agent_type)


def nearest_agent(env: Env, point: Place | Position, agents: tuple[AgentRef, ...]) -> AgentRef:
    """Return the agent that is nearest to a point, the first of equals; over ground from a place, straight from a position.

    Agents whose position is not known yet are passed over.

    Raises:
        EvalError: the list is empty.
        UnknownState: the position of none of them is known.
    """
    if not agents:
        raise EvalError("nearest of an empty list")
    found: list[tuple[float, AgentRef]] = []
    unknown: UnknownState | None = None
    for agent in agents:
        try:
            at: Any = env.agent_field(agent, "position")
        except UnknownState as error:
            unknown = unknown or error
            continue
        found.append((between(point, at.ground if isinstance(point, Place) else at), agent))
    if not found:
        assert unknown is not None, "each agent has a position or not"
        raise unknown
    return min(found, key=lambda one: one[0])[1]
