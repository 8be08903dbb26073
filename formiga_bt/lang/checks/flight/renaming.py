"""Steps with other names for their machines: what two names of one machine do is followed as what one of them does."""

import re
from collections.abc import Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Dependency, Do, Expr, Step, Subtree, Who


def renamed(steps: tuple[Step, ...], names: Mapping[str, str]) -> tuple[Step, ...]:
    """Return steps in which the names of machines are others; what they call keeps its own names."""
    found: tuple[Step, ...] = _renamed(steps, names)
    return found


def _renamed(part: Any, names: Mapping[str, str]) -> Any:
    match part:
        case Expr():
            return _expression(part, names)
        case Who():
            agent = _renamed(part.agent, names)
            return replace(part, name=names.get(part.name, part.name), agent=agent)
        case Mark() | Subtree():
            return part
        case tuple():
            return tuple(_renamed(one, names) for one in part)
        case Mapping():
            return {key: _renamed(value, names) for key, value in part.items()}
    if isinstance(part, Do):  # what people read
        part = replace(part, name=part.title)
    if isinstance(part, Struct):
        return replace(part, **{name: _renamed(getattr(part, name), names) for name in part.__struct_fields__})
    return part


def _expression(expr: Expr, names: Mapping[str, str]) -> Expr:
    """Return an expression with other names in its source; one that reads none of them is the same as before."""
    if not any(read.name in names for read in expr.reads):
        return expr
    words = "|".join(map(re.escape, names))
    source = re.sub(rf"(?<![.\w])(?:{words})\b", lambda found: names[found[0]], expr.source)
    return replace(
        expr, source=source, reads=tuple(Dependency(names.get(one.name, one.name), one.field) for one in expr.reads)
    )
