"""Regions that people close for machines, and open again, for callers."""

from collections.abc import Callable

from formiga_bt.engine.kernel.inputs import CloseRegion, Input, OpenRegion
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import OrderDone, ZoneFact, ZoneList


class ZoneDesk:
    """What people say of regions.

    Args:
        ask: hands an input to the engine and returns its reply; raises `Refused`.
        view: the copy of the engine's state.
    """

    def __init__(self, ask: Callable[[Input], Accepted | Done], view: EngineView) -> None:
        self._ask = ask
        self._view = view

    def all(self) -> ZoneList:
        """Return what is closed, in the order of closing."""
        self._view.catch_up()
        with self._view.reading() as state:
            found = state.closures.items()
            return ZoneList(tuple(ZoneFact(name=n, reason=c.reason, by=c.by, at=c.at) for n, c in found))

    def close(self, zone: str, reason: str, by: str = "") -> OrderDone:
        """Close a region, or 30 m around a place.

        Raises:
            Refused: `unknown_place`.
        """
        reply = self._ask(CloseRegion(zone, reason, by))
        return OrderDone(with_keeping(f"{zone} is closed for machines: {reason}", reply))

    def open(self, zone: str, by: str = "") -> OrderDone:
        """Open what was closed.

        Raises:
            Refused: `unknown_place`, `not_closed`.
        """
        reply = self._ask(OpenRegion(zone, by))
        return OrderDone(with_keeping(f"{zone} is open", reply))
