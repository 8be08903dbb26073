"""A whole task: its sections, and what it declares beside them."""

from collections.abc import Mapping
from typing import Final, Literal

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model.expr import Expr
from formiga_bt.lang.model.needs import Param, Role
from formiga_bt.lang.model.steps import Step, Subtree
from formiga_bt.lang.types import Type

MOST_VISITS: Final = 10_000
"""Steps that the engine visits for a task at one moment; one that goes on beyond that is a runaway."""
WAKES_A_SECOND: Final = 100
"""So often an engine second a task's own clocks may wake it; beyond that its next deadline is rounded up."""


class Task(Struct, frozen=True):
    """A checked task file. Sections are lists of steps; an empty one is absent."""

    name: str
    mark: Mark
    steps: tuple[Step, ...]
    aliases: tuple[str, ...] = ()
    """Other names under which callers may request it."""
    version: str = ""
    description: str = ""
    priority: Literal["low", "medium", "high"] = "medium"
    params: Mapping[str, Param] = field(default_factory=dict)
    vars: Mapping[str, Expr] = field(default_factory=dict)
    """In an order in which each reads only earlier ones."""
    roles: Mapping[str, Role] = field(default_factory=dict)
    timeout: Expr | None = None
    expires: Expr | None = None
    if_preempted: Literal["restart", "fail"] = "restart"
    preemptible: bool = True
    on_failure: tuple[Step, ...] = ()
    on_abort: tuple[Step, ...] = ()
    finally_: tuple[Step, ...] = ()
    cleanup_timeout: Expr | None = None
    envelope: Mapping[str, float] = field(default_factory=dict)
    """What the task tightens of its machines' envelope, named as in `AgentType.limits`; it can loosen nothing."""
    records: Mapping[str, Type] = field(default_factory=dict)
    """The records that are types in its file, by name."""
    subtrees: Mapping[str, Subtree] = field(default_factory=dict)
    bundle: str = ""
    """SHA-256 (hex) of the task's file, its imports and the catalogue: what a run is pinned to."""
    covered: str = ""
    """SHA-256 (hex) of what a person's approval covers (`lang.covered`)."""
    files: tuple[str, ...] = ()
    requests: Mapping[str, str] = field(default_factory=dict)
    """Tasks that it requests -> their files."""
