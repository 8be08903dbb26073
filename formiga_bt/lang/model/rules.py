"""Standing rules of a site: what must happen, and which task is requested then."""

from collections.abc import Mapping
from typing import Any, Final, Literal

from msgspec import Struct, field

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model.expr import Expr

RULE_PREFIX: Final = "rule:"
"""Before the name of a rule where a principal is named: in `by` of a task, and for `formiga why`."""
Passage = Literal["leaves", "enters", "crosses"]


class OnEvent(Struct, frozen=True):
    """An agent reports an event of its own: `picker.sos`."""

    event: str


class OnPassage(Struct, frozen=True):
    """An agent passes the border of a region: `leaves(picker, regions.field)`, `crosses(picker, fence)`."""

    what: Passage
    region: str
    """As people call it: `field`, or `fence`."""
    outline: Any
    """`base.geo.Region`."""


class OnSilence(Struct, frozen=True):
    """Nothing is heard of an agent for a while: `silent(picker)`."""


Happening = OnEvent | OnPassage | OnSilence


class Rule(Struct, frozen=True, kw_only=True):
    """A checked standing rule."""

    name: str
    mark: Mark
    on: Happening
    source: str
    """What it is on, as written."""
    types: tuple[str, ...]
    """The agent type that it names, and those that extend it."""
    of: tuple[str, ...] = ()
    """The agents that it is for; empty: any of these types."""
    after_us: Micros = 0
    """For so long it must be so."""
    task: str
    file: str = ""
    """Of the task; "" = it is given as a text."""
    args: Mapping[str, Expr] = field(default_factory=dict)
    """By param of the task; they may read `event`."""
    priority: Literal["", "low", "medium", "high"] = ""
    most: int = 1
    """Tasks of it that run at once."""
    per_agent: bool = True
    """Whether `most` counts for each agent by itself."""
    watched: str = ""
    """Of what it watches, in words that do not depend on the layout: when this changes, it watches anew."""

    @property
    def happening(self) -> str:
        """Return what happens to an agent, for people: `sos`, `leaves field`."""
        match self.on:
            case OnEvent(event):
                return event
            case OnPassage(what, region):
                return f"{what} {region}"
            case OnSilence():
                return "silent"

    @property
    def limit(self) -> str:
        """Return `at_most` as it is written."""
        return f"{self.most} running{' per agent' if self.per_agent else ''}"
