"""What a person's approval of a task covers: its texts, and what of the catalogue and of the site decides what it does.

Pure functions. A digest changes with anything that it covers, wherever that stands in its file; it stays when the catalogue
gets a type or an action that the task does not use, and when the site gets an agent.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import msgspec
from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.heights import HeightGrid
from formiga_bt.lang.model import AgentType, Catalogue, Do, Expr, Site, Subtree, Task, WithAgents
from formiga_bt.lang.types import Type
from formiga_bt.lang.walk import steps_once

_NOT_OF_TYPE: Final = ("actions", "label", "fields", "suspect_after_us", "lost_after_us")
"""Of a type: the actions that are used are covered each by itself; the others say nothing of where a machine goes."""
_NOT_OF_SITE: Final = (
    "agents",
    "pilots",
    "people",
    "transports",
    "policy",
    "preflight",
    "file",
    "digest",
    "covered",
    "rules",
    "rules_digest",
    "news",
)
"""Of a site: who is there, who may do what, how they are reached, and who is told."""


def covered_by_task(task: Task, texts: Iterable[str], catalogue: Catalogue) -> str:
    """Return the SHA-256 (hex) of a task's texts, and of the types and actions that it and its machines' ways home use.

    Args:
        task: the task.
        texts: its file and its imports, in the order of reading.
        catalogue: what it was checked against.
    """
    every = list(steps_once((*task.steps, *task.on_failure, *task.on_abort, *task.finally_)))
    blocks = [step.roles for step in every if isinstance(step, WithAgents)]
    granted = {name for roles in (task.roles, *blocks) for role in roles.values() for name in role.types}
    types = [one for one in catalogue.types.values() if one.name in granted or granted & set(one.extends)]
    every += steps_once(step for kind in types for way in _ways(kind) for step in way.steps)
    used = {step.action for step in every if isinstance(step, Do)}
    parts: list[object] = [[hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest() for text in texts]]
    parts += [_plain(kind, but=_NOT_OF_TYPE) for kind in sorted(types, key=lambda one: one.name)]
    parts += [_plain(catalogue.actions[name]) for name in sorted(used & set(catalogue.actions))]
    return _digest(parts)


def covered_by_site(site: Site) -> str:
    """Return the SHA-256 (hex) of all that a site says but who is there, who may do what, and how agents are reached.

    What agents guard is covered too: it keeps a door from closing on a robot.
    """
    guards = {name: dict(agent.guards) for name, agent in site.agents.items() if agent.guards}
    return _digest([_plain(site, but=_NOT_OF_SITE), guards])


def _ways(kind: AgentType) -> Iterator[Subtree]:
    yield from (way for way in (kind.recover, kind.fetch, kind.land) if way is not None)


def _plain(value: object, but: tuple[str, ...] = ()) -> Any:
    """Return a part of a model as plain data, without the places where it stands in its files."""
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Expr():
            return [value.source, _plain(value.type)]
        case Type():
            return [str(value), value.of, _plain(value.fields)]
        case HeightGrid():
            return value.digest
        case Struct():
            kept = [name for name in value.__struct_fields__ if name not in but]
            parts = {name: getattr(value, name) for name in kept}
            return {name: _plain(part) for name, part in parts.items() if not isinstance(part, Mark)}
        case Mapping():
            return {str(key): _plain(part) for key, part in value.items()}
        case tuple() | list():
            return [_plain(part) for part in value]
        case set() | frozenset():
            return sorted(map(str, value))
        case _:
            raise TypeError(f"{type(value).__name__} has no plain form")


def _digest(parts: object) -> str:
    return hashlib.sha256(msgspec.json.encode(parts, order="deterministic")).hexdigest()
