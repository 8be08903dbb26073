"""What does not change while a file is read: the catalogue, the site, the other tasks; and subtrees as callers see them."""

from collections.abc import Callable, Mapping

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.model import Catalogue, Param, Site, Subtree
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import Type


class Callee(Struct, frozen=True):
    """A subtree as callers see it: what it needs of each agent param, and whether it could be read at all."""

    subtree: Subtree
    needs: Mapping[str, tuple[str, ...]]
    returns: Type | None
    releases: tuple[str, ...] = ()
    """Agent params that it gives back."""
    heights: Mapping[str, str] = field(default_factory=dict)
    """Params that are heights at which it flies -> the agent param that flies there."""


Resolver = Callable[[Scalar], Callee | None]
"""Finds the subtree that a call names, or reports why not."""


class World(Struct, frozen=True):
    """What does not change while a file is read."""

    catalogue: Catalogue
    site: Site | None
    watch: Callable[[Mark, Scope], None] | None = None
    """Told what is visible at the start of each step, and behind the last one of a list (an editor listens)."""
    others: Neighbours | None = None
    """The tasks that may be requested."""
    records: Mapping[str, Type] = field(default_factory=dict)
    """The records that are types in the file that is read."""


def agent_types_of(params: Mapping[str, Param]) -> dict[str, tuple[str, ...]]:
    """Return the agent types of each param that is an agent."""
    return {name: param.type.of for name, param in params.items() if param.type.name == "agent"}
