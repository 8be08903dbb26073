"""Walks over trees in the short form."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

INNER: Final = ("steps", "then", "else", "parallel", "sequence")
"""Where a tree or a step holds other steps."""


def all_steps(tree: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield the steps below a node in the order in which they are written."""
    for key in INNER:
        listed = tree.get(key)
        for one in listed if isinstance(listed, list) else ():
            if isinstance(one, dict):
                yield one
                yield from all_steps(one)
