"""Breaches of the envelope in flight: looked for at each status of a machine in the air."""

from formiga_bt.engine.core import Core
from formiga_bt.engine.orders import Orders
from formiga_bt.engine.tasks import Tasks


class Breaches:
    """What the engine does when a machine leaves its envelope."""

    def __init__(self, core: Core, tasks: Tasks, orders: Orders) -> None:
        self._core = core
        self._tasks = tasks
        self._orders = orders

    def look(self, agent_id: str) -> None:
        """A status of a machine came in."""
