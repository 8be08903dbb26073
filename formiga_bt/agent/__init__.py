"""An agent of one's own in twenty lines: a machine, a device or a service that does what tasks ask of it.

    from formiga_bt.agent import Agent, MetresPerSecond, Place, action, run

    class Rover(Agent, type="rover"):
        @action
        async def Drive(self, to: Place, speed: MetresPerSecond = 1.0) -> None:
            async for left in self.base.drive(to, speed):      # a cancel arrives as asyncio.CancelledError
                self.feedback(progress=1 - left)

    run(Rover, id="rover_1", site="warehouse")

All rules of agents (`docs/wire.md`) are kept for it: no goal twice, one at a time, epochs, expiry, control, lost
links. The engine is not loaded. docs/agent.md walks through it; `formiga new agent rover.py` writes one to start
from.
"""

from formiga_bt.agent.agent import Agent
from formiga_bt.agent.declared import ActionError, action, event
from formiga_bt.agent.process import run, serve
from formiga_bt.agent.tokens import CanceledError, CancelToken
from formiga_bt.agent.types import (
    AgentId,
    Between,
    Degrees,
    Kilograms,
    Metres,
    MetresPerSecond,
    Percent,
    Seconds,
    Time,
)
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.transport.messages import AgentError, GoalRequest, PreflightCheck

__all__ = [
    "ActionError", "Agent", "AgentError", "AgentId", "Between", "CancelToken", "CanceledError", "Degrees", "GoalRequest",
    "Kilograms", "Metres", "MetresPerSecond", "Percent", "Place", "Position", "PreflightCheck", "Region", "Seconds", "Time",
    "action", "event", "run", "serve",
]  # fmt: skip
