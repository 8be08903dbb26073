"""How a journal stands, as a counter of the state tells it."""

from typing import Final

JOURNAL: Final = "journal"
"""The counter that tells how the journal stands."""
LEVELS: Final = {"ok": 0, "slow": 1, "full": 2, "gone": 3}
"""From `full` on nothing can be kept."""
