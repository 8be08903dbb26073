"""An agent as the allocator sees it: what filters, costs and policies read."""

from msgspec import Struct

from formiga_bt.geo import Position


class Candidate(Struct, frozen=True, kw_only=True):
    """An agent as the allocator sees it."""

    id: str
    type: str
    order: int
    human: bool
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
