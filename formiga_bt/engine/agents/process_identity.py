"""The processes of an agent: which one is heard, and whether two say at once that they are the same machine.

A process that starts anew has another `boot_id`: what it says from then on counts, what the one before said comes late and is
passed over. If the one before goes on beside it, they are two: `formiga sim` beside another simulation of the same site, or
beside the real machine. What either says would be taken for the other's, so the machine is quarantined (`double`) until one
of them has been silent for a while. People are told of only.

Two processes may even bear one `boot_id` (a copied disk, a recording that is played again with new stamps). Of one process,
what counts up later is stamped later or at the same instant, in whatever order the wire brings it. So a status that does not
count up and is newer by its stamp is a stray: the process counts wrongly, or is another one. If within `STRAY_US` of it the
count goes on where it was, with a stamp that is not before the stray's, two are counting at once: no order in which one
process's statuses could come looks so, whatever is lost, late or comes twice. One exception: a process that stood still or was
cut off for 10 s or more may set its clock back when it hears the engine again, so beside a status that was stamped so long ago
nothing is a stray.

Stamps are judged by the engine's own clock: none may be more than `AHEAD_US` ahead of it. An agent extrapolates engine time
from the newest beat that it heard, so it is right but for what changed since: 30 s without a beat, after which it is lost
anyway, in which the engine went from 20 times to real time, are 570 s. An older start of the engine may have been ahead by
more (its machine slept, or it ran fast until it ended), so who follows one is not judged before it has heard this one. Where
time is reckoned with, a stamp counts as no later than the arrival of what bears it (`AgentRecord.said_at`).

Called by `Fleet` for each status.
"""

from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.news import MustLeave, UnreadableMessage
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import AgentStatus

DOUBLE: Final = "double"
"""Why a machine is quarantined of which two processes are heard."""
AHEAD_US: Final[Micros] = 600 * SECOND
"""No agent that hears this engine can know of an engine time that is so far ahead of the engine's."""
STRAY_US: Final[Micros] = 7 * SECOND
"""After a stray the count must go on within so long (wall time) to show that two are counting. An agent whose clock was wrong
steps back only if that was 10 s of wall time or more (`AgentSide`); 3 s remain for what the wire delays."""
SET_BACK_US: Final[Micros] = 10 * SECOND
"""A status stamped so long ago may be of a clock that was set back."""
STAYS_US: Final[Micros] = 2 * SECOND
"""A process that came after another and is heard for so long (wall time) is no straggler."""
BAD_LIMIT: Final = 5
"""So many bad messages in a row quarantine a machine."""
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


class ProcessIdentity:
    """Judges which process of an agent speaks."""

    def __init__(self, core: Core, goals: Goals) -> None:
        self._core, self._goals = core, goals

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
        ahead = status.stamp - self._core.clock
        if ahead > AHEAD_US and not 0 < status.epoch < self._core.state.epoch:
            self._core.report(UnreadableMessage(agent.id, AHEAD.format(seconds=ahead // SECOND)))
            return True
        if not (agent.boot_id and status.boot_id and status.boot_id != agent.boot_id):
            return self._counts_wrongly(agent, status, wall or agent.heard_wall)
        if status.stamp < agent.said_at:
            return True  # of its former process, and late
        if status.boot_id not in agent.former or (wall and wall - agent.heard_wall > QUIET_US):
            return False
        if wall and agent.heard_wall - agent.boot_wall >= STAYS_US:
            self._two(agent, wall)
        return True

    def _counts_wrongly(self, agent: AgentRecord, status: AgentStatus, wall: Micros) -> bool:
        """Return whether a status of the process that is heard does not count up; notice whether two count at once."""
        if status.seq > agent.seq:
            if 0 < agent.stray_stamp <= status.stamp and wall - agent.stray_wall <= STRAY_US:
                self._two(agent, wall)
            return False
        if status.stamp > agent.stamp > self._core.clock - SET_BACK_US:
            self._core.put_agent(agent.id, stray_stamp=status.stamp, stray_wall=wall)
            self._core.report(UnreadableMessage(agent.id, STUCK.format(seq=status.seq, before=agent.seq)))
            if self._core.state.agents[agent.id].bad >= BAD_LIMIT:
                self._core.put_agent(
                    agent.id, seq=-1
                )  # it counts anew from what comes next, or would never be heard again
        return True

    def _two(self, agent: AgentRecord, wall: Micros) -> None:
        if not 0 <= wall - agent.twice_wall < SECOND:  # not each status of them is noted
            self._core.put_agent(agent.id, twice_wall=wall)
        if not self.are_two(agent, wall):
            text = TWICE.format(agent=agent.id, then="" if agent.human else THEN)
            self._core.effect(Alarm("double", text, agent.task, agent.id))
        if not agent.human:
            self._goals.lose(agent.id, "in_doubt", f"two processes say that they are {agent.id}")
            self._core.report(MustLeave(agent.id, DOUBLE))

    @staticmethod
    def are_two(agent: AgentRecord, wall: Micros) -> bool:
        """Return whether a second process of an agent was heard lately."""
        return agent.twice_wall > 0 and wall - agent.twice_wall <= APART_US


AHEAD: Final = (
    "a stamp {seconds} s ahead of the engine's clock: stamp is engine time, as of the newest engine/clock message"
)
STUCK: Final = (
    "seq {seq} after {before} of the same start: seq counts the statuses of a start, and a new start has a new boot_id"
)
