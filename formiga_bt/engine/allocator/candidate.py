"""An agent as the allocator sees it: what filters, costs and policies read."""

from msgspec import Struct

from formiga_bt.base.geo import Position
from formiga_bt.base.machines import Mobility
from formiga_bt.engine.allocator.energy import Charge
from formiga_bt.transport.messages import PreflightCheck


class Candidate(Struct, frozen=True, kw_only=True):
    """An agent as the allocator sees it."""

    id: str
    type: str
    order: int
    shared: bool
    mobility: Mobility
    actions: tuple[str, ...]
    refused: str
    pool: str
    liveness: str
    control: str
    task: str
    goal: str
    word: str
    landed: str
    at_port: bool
    battery: float
    position: Position | None
    detail: str = ""
    taken: bool = False
    """A pilot has, or had, it, and nobody has handed it back."""
    out: str = ""
    """Why a person took it out of service."""
    ordered: str = ""
    """The order that stands on it."""
    preflight: bool = False
    """Whether it is granted only when its checks are all ok."""
    checks: tuple[PreflightCheck, ...] = ()
    charge: Charge | None = None
    """None: its type tells no drain, or its place is not known."""
