"""How far the news that leave the engine have come."""

from msgspec import Struct


class NewsMark(Struct, frozen=True):
    """How far a channel has come: of which steps it has told all."""

    all: int
    """`seq` of the last step of which it told what is not urgent."""
    urgent: int
    """The same of what is: that overtakes the rest."""
