"""A simulated agent whose drone can go up by nobody's order: at SIGUSR2 while no pilot has it. Started by `crew`.

So a machine comes into the air that no task, no order and no goal has sent, still under the engine's command.
"""

import os

from agents_sim import __main__ as process
from agents_sim.drone import Drone
from agents_sim.planning import Leg
from formiga_bt.base.geo import Position

UP_M = 35.0
_hand_back = Drone.hand_back


def lift(self: Drone) -> None:
    """Go up without an order, or hand back what a pilot has."""
    if self.state().control != "engine":
        _hand_back(self)
    elif not self.is_airborne:
        here = self.position()
        self._fly("", "gust", [Leg(Position(here.east_m, here.north_m, UP_M), "climb")])


Drone.hand_back = lift  # type: ignore[method-assign]

if __name__ == "__main__":
    status = process.main()
    os._exit(status if isinstance(status, int) else 0)
