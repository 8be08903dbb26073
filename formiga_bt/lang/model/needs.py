"""What a task or a subtree declares before its steps: its params, and the roles of agents that it needs."""

from typing import Any, Final, Literal

from msgspec import Struct

from formiga_bt.base.diagnostics import Fix, Mark
from formiga_bt.lang.model.expr import Expr
from formiga_bt.lang.types import Type

IfLost = Literal["fail", "rebind", "fail_block"]
"""What a lost agent of a role means."""
IF_LOST: Final[tuple[IfLost, ...]] = ("fail", "rebind", "fail_block")


class Param(Struct, frozen=True):
    """A parameter of a task or subtree."""

    name: str
    type: Type
    mark: Mark
    default: Expr | None = None
    optional: bool = False
    min: Expr | None = None
    max: Expr | None = None
    label: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()


class Some(Struct, frozen=True):
    """How many agents a role without a fixed count takes: at least `min`, and `max` if as many are free (None = all)."""

    min: int = 1
    max: int | None = None


class Room(Struct, frozen=True):
    """Where one more key can be written into a mapping, without touching what stands there."""

    mark: Mark
    """An empty span."""
    before: str = ""
    """What stands between it and the new key, and between the new key and what follows."""
    after: str = ""
    quoted: bool = False
    """In `{ }`, where a value with braces needs quotes."""

    def fix(self, key: str, value: str) -> Fix:
        """Return the fix that writes a key with its value."""
        text = f'"{value}"' if self.quoted else value
        return Fix(self.mark, f"{self.before}{key}: {text}{self.after}")


class Role(Struct, frozen=True, eq=False):
    """A role of a task: which agent (or agents) it needs. Expressions are read once, at admission.

    Equality and hash ignore `room`.
    """

    name: str
    types: tuple[str, ...]
    mark: Mark
    id: Expr | None = None
    near: Expr | None = None
    prefer: Expr | None = None
    count: int | None = None
    """None = exactly one agent, unless `open`: then the role is a list, as it is with a count."""
    open: Some | None = None
    """As many agents as are free, between two bounds."""
    battery_min: Expr | None = None
    capabilities: tuple[str, ...] = ()
    wait: Expr | None = None
    """How long to queue, seconds; None = as long as it takes, of a block 15 min."""
    if_lost: IfLost = "fail"
    """`fail_block`, of a `with_agents` only: the block stops and fails, whatever its steps do."""
    hand_over_at: Expr | None = None
    """Of a `with_agents` only: at this charge, percent, the block gives its agents back and begins anew."""
    away: bool = False
    preempt: bool | None = None
    """In a task of priority high: true = also for what it takes beyond its least number; false = for nothing."""
    actions: tuple[str, ...] = ()
    """Actions that the task orders of this role (subtrees included)."""
    room: Room | None = None
    """Where a fix may write a key that the role lacks."""

    def __eq__(self, other: object) -> bool:
        """Return whether two roles ask for the same."""
        return isinstance(other, Role) and _asked(self) == _asked(other)

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __hash__(self) -> int:
        """Return a hash of what it asks for."""
        return hash(_asked(self))

    @property
    def is_list(self) -> bool:
        """Return whether the role is a list of agents."""
        return self.count is not None or self.open is not None


def _asked(role: Role) -> tuple[Any, ...]:
    return tuple(getattr(role, name) for name in role.__struct_fields__ if name != "room")
