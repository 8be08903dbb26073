"""The processes of an agent: which one is heard, and whether two say at once that they are the same machine.

A process that starts anew has another `boot_id`: what it says from then on counts, what the one before said comes late and is
passed over. If the one before goes on beside it, they are two: `formiga sim` beside another simulation of the same site, or
beside the real machine. What either says would be taken for the other's, so the machine is quarantined (`double`) until one
of them has been silent for a while. People are told of only.

Called by `Fleet` for each status.
"""

from typing import Final, Protocol

from formiga_bt.clock import SECOND, Micros
from formiga_bt.engine.core import Core
from formiga_bt.engine.inputs import Alarm
from formiga_bt.engine.records import AgentRecord
from formiga_bt.transport.messages import AgentStatus

DOUBLE: Final = "double"
"""Why a machine is quarantined of which two processes are heard."""
AHEAD_US: Final[Micros] = 3600 * SECOND
"""No new process can know of an engine time that is so far ahead of the engine's."""
STAYS_US: Final[Micros] = 2 * SECOND
"""A process that came after another and is heard for so long (wall time) is no straggler."""
QUIET_US: Final[Micros] = 3 * SECOND
"""One that was not heard for so long (wall time) has made way for the one before it."""
APART_US: Final[Micros] = 5 * SECOND
"""Two processes are one again when the second was not heard for so long (wall time)."""
MOST_FORMER: Final = 4
"""So many former processes of an agent are remembered."""

TWICE: Final = (
    "two processes say that they are {agent}, so what it does is in doubt: end one of them{then}. A site is simulated once, by "
    "formiga sim or formiga up --sim; beside an agent of its own: formiga sim --without {agent}"
)
THEN: Final = "; it gets no task until then, and comes back by itself"


class Fleet(Protocol):
    """`engine.fleet.Fleet`, as far as needed here."""

    def quarantine(self, agent_id: str, why: str) -> None:
        """Take a machine out of its task and out of the pool."""
        ...

    def on_bad(self, agent_id: str, text: str) -> None:
        """Count a bad message."""
        ...


class Boots:
    """Judges which process of an agent speaks."""

    def __init__(self, core: Core, fleet: Fleet) -> None:
        self._core, self._fleet = core, fleet

    def begin(self, agent: AgentRecord, boot_id: str, wall: Micros) -> None:
        """Note that another process of an agent is heard from now on; by its card, or by what it says."""
        wall = wall or agent.heard_wall
        former = [boot for boot in agent.former if boot != boot_id]
        returns = boot_id in agent.former and wall - agent.heard_wall <= QUIET_US
        self._core.put_agent(
            agent.id, boot_id=boot_id, seq=-1, former=(*former, agent.boot_id)[-MOST_FORMER:],
            boot_wall=agent.boot_wall if returns else wall,
        )  # fmt: skip
        if returns and agent.heard_wall - agent.boot_wall >= STAYS_US:  # a wire that asks for cards hears them in turn
            self._two(agent, wall)

    def passes_over(self, agent: AgentRecord, status: AgentStatus, wall: Micros) -> bool:
        """Return whether a status is not to be taken; tell what is wrong with it, if it is more than late.

        Args:
            agent: as it was heard before.
            status: of any of its processes.
            wall: when it came; 0: with the end of a goal.
        """
        known = self._core.now + AHEAD_US
        if not (agent.boot_id and status.boot_id and status.boot_id != agent.boot_id):
            if status.seq > agent.seq:
                return False
            if status.stamp > agent.stamp:
                self._fleet.on_bad(agent.id, STUCK.format(seq=status.seq, before=agent.seq))
            return True
        if status.stamp > known:
            self._fleet.on_bad(agent.id, f"a new process with a stamp {AHEAD_US // (60 * SECOND)} min or more ahead")
            return True
        if status.stamp < agent.stamp <= known:
            return True  # of its former process, and late
        if status.boot_id not in agent.former or (wall and wall - agent.heard_wall > QUIET_US):
            return False
        if wall and agent.heard_wall - agent.boot_wall >= STAYS_US:
            self._two(agent, wall)
        return True

    def _two(self, agent: AgentRecord, wall: Micros) -> None:
        if not 0 <= wall - agent.twice_wall < SECOND:  # not each status of them is noted
            self._core.put_agent(agent.id, twice_wall=wall)
        if not self.are_two(agent, wall):
            text = TWICE.format(agent=agent.id, then="" if agent.human else THEN)
            self._core.effect(Alarm("double", text, agent.task, agent.id))
        if not agent.human:
            self._fleet.quarantine(agent.id, DOUBLE)

    @staticmethod
    def are_two(agent: AgentRecord, wall: Micros) -> bool:
        """Return whether a second process of an agent was heard lately."""
        return agent.twice_wall > 0 and wall - agent.twice_wall <= APART_US


STUCK: Final = (
    "seq {seq} after {before} of the same start: seq counts the statuses of a start, and a new start has a new boot_id"
)
