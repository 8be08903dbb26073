"""A task as JSON without free maps, for models that write with a schema at hand: the words of that form.

A step of an action is `{"action": "GoTo", "agent": "drone", "to": <value>}`; other steps have the keys of the YAML language.
Where YAML has a mapping with names of the author's own, this form has a list of objects with `name`. A value is one of
`{"expr": "above(target, 60 m)"}`, `{"lit": "15 s"}` (also a place), `{"text": "Row ${n}"}`, `{"list": [..]}`, `{"record":
[{"name": .., "value": ..}, ..]}`. null stands for "not given".

`llm_in` reads it, `llm_out` writes it, `editor.llm_schema` describes it.
"""

from collections.abc import Mapping
from typing import Final

from formiga_bt.lang.kinds import FORM, KINDS, MODIFIERS, PARAM, ROLE, SUBTREE, Option

NAMED: Final[Mapping[str, tuple[Option, ...]]] = {
    "params": PARAM,
    "agents": ROLE,
    "with_agents": ROLE,
    "subtrees": SUBTREE,
    "form": FORM,
}
"""Mappings of the author's names to objects: lists of objects with `name`."""

VALUED: Final = ("with", "set", "for", "vars")
"""Mappings of the author's names to values: lists of `{name, value}`."""

RECORDS: Final = "records"
"""The mapping of the author's records: a list of `{name, fields}`, each field with its name and type."""

POINTS: Final = (("east", "north"), ("east", "north", "height"), ("lat", "lng"), ("lat", "lng", "height"))
"""Keys of a literal place or position."""

OF_ACTIONS: Final = frozenset(
    {"do", "action", "agent", "with", *(option.name for option in (*MODIFIERS, *KINDS["do"].options))}
)
"""Keys of a step of an action that are none of its fields."""


def field_key(name: str) -> str:
    """Return the key of an action's field: its name, or with `field_` before it where a step has that key already."""
    return f"field_{name}" if name in OF_ACTIONS else name


def is_hole(text: str) -> bool:
    """Return whether a text is `${...}` as a whole."""
    return text.startswith("${") and text.endswith("}")
