"""Statuses that repeat the one before: most of a fleet stands by and says each second what it said a second ago.

Such a status changes four fields of the agent's record (`HEARD`). It is taken the short way if it says what the last one said,
the record is the one which that left, and that one had changed nothing else of it. What the rest of the state may add is asked
each time: epochs, clearances, and by the fleet lost results, timers and the allocator. Only agents that rest are remembered:
people, and machines that stand on the ground under the engine's command, trusted and admitted.

The memory is no part of the state: after a restart the first status of each agent goes the long way, with the same steps.
"""

from operator import attrgetter
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.engine.agents.process_identity import AHEAD_US
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import AgentStatus

HEARD: Final = ("seq", "stamp", "heard_at", "heard_wall")
"""Fields of an agent's record that a repeated status changes."""

PASSED_OVER: Final = frozenset(
    {
        "id",
        "seq",
        "stamp",
        "beat",
        "age_us",
        "quality",
        "lat",
        "lng",
        "task_id",
        "action_name",
        "last_goal_state",
        "altitude_m",
        "link",
    }
)
"""Fields of a status that differ from one to the next, or that the engine does not read."""

_said = attrgetter(*(name for name in AgentStatus.__struct_fields__ if name not in PASSED_OVER))


class Repeats:
    """The last status of each agent that rests."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._last: dict[str, tuple[AgentRecord, tuple[Any, ...]]] = {}
        """Agent -> the record that its last status left, and what that said."""

    def take(self, agent: AgentRecord, status: AgentStatus, wall: int) -> bool:
        """Take a status if it repeats the one before; return whether it did.

        Args:
            agent: its record.
            status: in the order of arrival.
            wall: wall time of its arrival, or 0.
        """
        last = self._last.get(agent.id)
        if last is None or last[0] is not agent or last[1] != _said(status):
            return False
        core = self._core
        state = core.state
        if (
            status.seq <= agent.seq
            or status.stamp - core.clock > AHEAD_US
            or status.epoch > state.epoch
            or agent.id in state.clearances
        ):
            return False
        new = replace(agent, seq=status.seq, stamp=status.stamp, heard_at=core.now, heard_wall=wall or agent.heard_wall)
        core.put_heard(new)
        self._last[agent.id] = new, last[1]
        return True

    def note(self, before: AgentRecord, status: AgentStatus) -> None:
        """A status was taken the long way: remember it if the next one may go the short way.

        Args:
            before: the agent's record before it.
            status: what it was.
        """
        now = self._core.state.agents[before.id]
        if not (now.human or (now.landed == "grounded" and now.control == "engine")):
            return
        trusted = now.present and now.liveness == "ALIVE" and now.pool != "QUARANTINED" and not now.quarantine
        if not trusted or now.refused or now.refused_at_rest or now.refused_fields:
            return
        if replace(before, **{name: getattr(now, name) for name in HEARD}) == now:
            self._last[now.id] = now, _said(status)
