"""What holds at one point of a body: the part of its names that depends on the path (definite assignment)."""

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.types import Type


class NamedValue(Struct, frozen=True):
    """A name of a body: its type, where it was defined, and as what."""

    type: Type
    mark: Mark
    origin: str
    """param, var, role, loop name or saved."""


class Flow(Struct):
    """What holds at one point of a body: saved names, those surely set, those that may not be saved again."""

    saved: dict[str, NamedValue] = field(default_factory=dict)
    sure: frozenset[str] = frozenset()
    taken: frozenset[str] = frozenset()
    dead: bool = False
    """No path leads here."""
    released: dict[str, Mark] = field(default_factory=dict)
    """Roles given back on some path, and where."""

    def first_saved(self, before: "Flow") -> tuple[str, ...]:
        """Return the names that nothing had saved at an earlier point."""
        return tuple(name for name in self.saved if name not in before.saved)

    def copy(self) -> "Flow":
        """Return a flow that may be changed on its own."""
        return Flow(dict(self.saved), self.sure, self.taken, self.dead, dict(self.released))


def join(*flows: Flow) -> Flow:
    """Return what holds where the paths meet: a name is surely set only if it is on every live path."""
    saved: dict[str, NamedValue] = {}
    taken: frozenset[str] = frozenset()
    released: dict[str, Mark] = {}
    for flow in flows:
        saved.update({name: named for name, named in flow.saved.items() if name not in saved})
        taken |= flow.taken
        released.update({name: mark for name, mark in flow.released.items() if name not in released})
    live = [flow for flow in flows if not flow.dead]
    sure = frozenset.intersection(*(flow.sure for flow in live)) if live else frozenset()
    return Flow(saved, sure, taken, not live, released)


class Around(Struct, frozen=True):
    """The loop that a `break_if` would leave: its place, what holds where it is left, and what stands between."""

    mark: Mark
    exits: list[Flow]
    barrier: str = ""
    """For example `this parallel (line 14)`; empty = nothing, `break_if` may leave the loop."""
