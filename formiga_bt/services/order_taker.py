"""What the services need of the driver that runs the engine: it takes orders."""

from typing import Protocol

from formiga_bt.engine.kernel.inputs import Input
from formiga_bt.engine.kernel.replies import Accepted, Done


class OrderTaker(Protocol):
    """What is needed of the realtime driver."""

    def ask(self, given: Input, timeout_s: float = 10.0) -> Accepted | Done:
        """Hand in an order and wait for the reply."""
        ...
