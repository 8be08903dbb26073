"""Texts from outside without halves of letters: JSON may hold a lone surrogate (D800 to DFFF), which no file can.

Called wherever a value comes in that somebody else wrote: answers of models, arguments of assistants.
"""

from typing import Any, Final

LARGEST: Final = 2**63
"""A whole number from here on is kept as a text: no file of ours has one."""


def whole(value: Any) -> Any:
    """Return a JSON value with U+FFFD for each half of a letter, in texts and in keys."""
    if isinstance(value, str):
        return value if value.isascii() else value.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
    if isinstance(value, dict):
        return {whole(key): whole(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [whole(one) for one in value]
    return str(value) if isinstance(value, int) and abs(value) >= LARGEST else value
