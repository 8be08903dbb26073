"""A catalogue that gets actions while it is in use: those that agents announce and that nobody knew before.

Whoever holds the catalogue sees them at once. One thread adds; others may read meanwhile. Nothing is taken out.
"""

from collections.abc import ItemsView, Iterable, Iterator, KeysView, ValuesView
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.model import ActionSpec, Catalogue

V = TypeVar("V")

FILE = "announced.yaml"
"""What the text of an announced action is called in its errors."""


class Growing(dict[str, V]):
    """A dict of which each iteration sees the entries of the moment when it began."""

    def __iter__(self) -> Iterator[str]:
        return iter(list(super().keys()))

    def keys(self) -> KeysView[str]:  # type: ignore[override]
        """Return the names of now."""
        return dict(list(super().items())).keys()

    def values(self) -> ValuesView[V]:  # type: ignore[override]
        """Return the entries of now."""
        return dict(list(super().items())).values()

    def items(self) -> ItemsView[str, V]:  # type: ignore[override]
        """Return the pairs of now."""
        return dict(list(super().items())).items()


def growing(catalogue: Catalogue) -> Catalogue:
    """Return the same catalogue, which can grow; itself if it can already."""
    if isinstance(catalogue.actions, Growing):
        return catalogue
    return replace(catalogue, types=Growing(catalogue.types), actions=Growing(catalogue.actions))


def grow(catalogue: Catalogue, spec: ActionSpec, types: Iterable[str]) -> None:
    """Add an action to a growing catalogue, and to some of its types with what extends them; both may have it already."""
    assert isinstance(catalogue.types, Growing)
    assert isinstance(catalogue.actions, Growing)
    catalogue.actions.setdefault(spec.name, spec)
    able = set(types)
    for kind in catalogue.types.values():
        if (kind.name in able or able & set(kind.extends)) and spec.name not in kind.actions:
            catalogue.types[kind.name] = replace(kind, actions=(*kind.actions, spec.name))


def read_announced(name: str, text: str) -> tuple[ActionSpec | None, list[Diagnostic]]:
    """Read the text of an announced action, as the catalogue's own files are read; None if it has errors."""
    found, problems, _ = load_catalogue([Path(FILE)], read=lambda _: text)
    errors = [one for one in problems if one.severity == "error"]
    return (None if errors else found.actions.get(name)), errors
