"""Forms: what a person fills in with an answer. The checker, the engine and whoever takes an answer ask here.

A form is plain data, for it travels with the question: over the wire, and in the journal.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.units import format_quantity
from formiga_bt.lang.types import Type

FILLED: Final = (
    "text", "number", "int", "bool", "enum", "place", "percent", "distance", "duration", "speed", "angle", "mass",
)  # fmt: skip
"""Types of what a person can fill in."""
YES_NO: Final = ("yes", "no")
DONE: Final = ("done",)
"""The answers to a question without options; with a form the second."""


class FormField(Struct, frozen=True, omit_defaults=True):
    """One thing to fill in."""

    name: str
    type: str
    """One of `FILLED`."""
    values: tuple[str, ...] = ()
    """Of an enum."""
    least: float | None = None
    most: float | None = None
    """In the type's SI unit."""
    help: str = ""

    @property
    def kind(self) -> Type:
        """Return its type."""
        return Type(self.type, values=self.values)

    @property
    def told(self) -> str:
        """Return it in words: `count (int, at least 1)`."""
        kind = "/".join(self.values) if self.values else self.type
        bounds = [f"{word} {self._said(bound)}" for word, bound in self._bounds() if bound is not None]
        return f"{self.name} ({', '.join([kind, *bounds])})"

    def plain(self) -> dict[str, Any]:
        """Return it as a task file writes it."""
        bounds = {"min": self.least, "max": self.most}
        found: dict[str, Any] = {"type": self.type, **({"values": list(self.values)} if self.values else {})}
        found |= {key: self._said(bound) for key, bound in bounds.items() if bound is not None}
        return found | ({"help": self.help} if self.help else {})

    def fault(self, value: Any) -> str:
        """Return why a runtime value of its type does not fit, or ""."""
        if self.values and value not in self.values:
            return f"'{self.name}' is one of {', '.join(self.values)}"
        if isinstance(value, bool) or not isinstance(value, int | float):
            return ""
        if self.least is not None and value < self.least:
            return f"'{self.name}' must be at least {self._said(self.least)}"
        if self.most is not None and value > self.most:
            return f"'{self.name}' must be at most {self._said(self.most)}"
        return ""

    def _bounds(self) -> tuple[tuple[str, float | None], ...]:
        return ("at least", self.least), ("at most", self.most)

    def _said(self, value: float) -> str:
        return format_quantity(self.type, value)


def lack(form: Sequence[FormField], values: Mapping[str, Any]) -> str:
    """Return what is missing in an answer or does not fit, or ""."""
    for one in form:
        if one.name not in values:
            return f"'{one.name}' is missing ({one.told})"
        if fault := one.fault(values[one.name]):
            return fault
    return ""
