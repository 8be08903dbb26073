"""The lines of an explanation, as `why` and `why_stopped` make them."""

from msgspec import Struct

from formiga_bt.clock import Micros


class Because(Struct, frozen=True, omit_defaults=True):
    """One line of the chain."""

    code: str
    text: str
    hint: str = ""
    agent: str = ""
    role: str = ""


class Silence(Struct, frozen=True):
    """An agent that is not heard of."""

    since: Micros
    """For so long, wall time."""
    lost_after: Micros | None
    """Silence after which it counts as lost; None for people, who are only unreachable."""
