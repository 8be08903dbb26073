"""How people are asked: the one action that the language itself knows, written as `ask`."""

from typing import Final

CONFIRM: Final = "Confirm"
"""A person may hold several such goals at once."""
