"""Planted bugs of machines on the ground: each breaks the engine in one place; the monitor of `ground` must see each."""

from collections.abc import Callable
from typing import Any

import pytest

from formiga_bt.engine.goals import passages
from formiga_bt.engine.goals.passages import Passages
from formiga_bt.engine.goals.routing import Routing
from formiga_bt.safety.airspace import Airspace

Patch = pytest.MonkeyPatch


def two_on_one_edge(patch: Patch) -> None:
    """Nobody looks whether another machine has the node or the edge ahead."""
    patch.setattr(Routing, "_others", lambda *_: ())


def an_edge_is_nobodys(patch: Patch) -> None:
    """A machine that is stopped between two nodes takes up nothing that others ask for: they look at the nodes only."""
    patch.setattr(Routing, "_parts", lambda self, agent, node: (node,))


def no_go_is_not_looked_at(patch: Patch) -> None:
    """The gate does not look at no-go regions."""
    init = Airspace.__init__

    def begins(self: Airspace, site: Any) -> None:
        init(self, site)
        self.ground_zones = ()

    patch.setattr(Airspace, "__init__", begins)


def a_door_closes_on_whom_it_likes(patch: Patch) -> None:
    """An action that guards a room begins although somebody is in it."""
    patch.setattr(passages, "may_shut", lambda *_: None)


def a_room_is_let_go_early(patch: Patch) -> None:
    """A machine takes up nothing of a room, and nobody needs to hold it."""
    patch.setattr(Passages, "seen", lambda *_: ())
    patch.setattr(passages, "may_pass", lambda *_, **__: None)


def what_is_ahead_is_forgotten(patch: Patch) -> None:
    """A machine on its way keeps only what it is on, not the node that it was sent to."""
    patch.setattr(Routing, "_is_ahead", staticmethod(lambda *_: False))


BUGS: dict[str, Callable[[Patch], None]] = {
    one.__name__: one
    for one in (
        two_on_one_edge, an_edge_is_nobodys, no_go_is_not_looked_at,
        a_door_closes_on_whom_it_likes, a_room_is_let_go_early,
        what_is_ahead_is_forgotten,
    )
}  # fmt: skip
