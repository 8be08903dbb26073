"""Facts of a task's tree: its drawing, and how its steps stand."""

from typing import Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros

Style = Literal["plain", "title", "kind", "agent", "dim", "warn"]


class StyledSpan(Struct, frozen=True, omit_defaults=True):
    """A piece of a line in one style."""

    text: str
    style: Style = "plain"


class FileSpot(Struct, frozen=True):
    """A place in a file; lines and columns count from 1."""

    file: str
    line: int
    column: int


class Box(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A step, a section, a branch of a step, or a row about a param, a var or a role."""

    path: str = ""
    """`lang.places.static_path` of a step, for example `steps/steps[1].then[0]`; "" = no step."""
    kind: str
    """A step kind of the language (`do`, `ask`, `sequence`, ...), or `section`, `branch`, `param`, `var`, `role`."""
    label: tuple[StyledSpan, ...]
    modifiers: tuple[str, ...] = ()
    """In words: `when ...`, `timeout 2 min`, `3 attempts`."""
    role: str = ""
    task_role: str = ""
    """The role of the task that `role` (the first of several) stands for in a called subtree or a loop, where it is one."""
    action: str = ""
    guard: str = ""
    """The condition that lets it run: of `when`, `if`, `guard`."""
    spot: FileSpot | None = None
    children: tuple["Box", ...] = ()
    hidden: int = 0
    """So many steps below are not drawn (`--depth`, `--collapse`)."""


class Drawing(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A task as a tree."""

    task: str
    version: str = ""
    description: str = ""
    facts: tuple[str, ...] = ()
    """Priority, timeout and the like, in words."""
    spot: FileSpot
    params: tuple[Box, ...] = ()
    vars: tuple[Box, ...] = ()
    roles: tuple[Box, ...] = ()
    sections: tuple[Box, ...] = ()
    """`steps`, `on_failure`, `on_abort`, `finally`: each a box of kind `section` with path `<section>/`."""
    sources: dict[str, str] = {}
    """File -> its text, where a drawing links to lines."""


StepStatus = Literal["running", "success", "failure", "skipped", "stopped"]


class StepFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How one step of a task stands, over all rounds, items and attempts that it ran in. A step never begun has none."""

    path: str
    """As `Box.path`."""
    status: StepStatus
    """`running` if any instance runs, else how the newest ended."""
    running: int = 0
    succeeded: int = 0
    failed: int = 0
    skipped: int = 0
    stopped: int = 0
    began_at: Micros | None = None
    """Of the newest instance; None: it ended in the instant in which it began."""
    ended_at: Micros | None = None
    code: str = ""
    """Reason code of the newest failure."""
    reason: str = ""
    note: str = ""
    """What it does now, in words: `hwd_1 40 %`, `Q7 asks eve`, `round 3`, `attempt 2 of 3`, `12 s left`."""
