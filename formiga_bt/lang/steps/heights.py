"""E062: heights over the ground that a step or a call writes down, against the envelope of who flies there."""

import math
import re
from collections.abc import Mapping
from typing import Final

from formiga_bt.base.geo import Position
from formiga_bt.base.units import format_quantity, parse_quantity
from formiga_bt.lang.body import Body
from formiga_bt.lang.model import ActionSpec, Expr, FieldSpec
from formiga_bt.lang.site.envelope import ceiling
from formiga_bt.lang.text.document import Node
from formiga_bt.lang.walk import plain_name
from formiga_bt.lang.world import Callee

ENVELOPE_SAYS: Final = "this is max_height of the envelope"
_NAMED_HEIGHT: Final = re.compile(r"(?:above|at_height)\(.*,\s*([A-Za-z_]\w*)\s*\)\s*\}?\s*\Z")
_HEIGHT: Final = re.compile(r"(?:above|at_height)\(.*,\s*([\d.]+)\s*(k?m)\s*\)\s*\}?\s*\Z")


def note_height(body: Body, expr: Expr, field: FieldSpec, spec: ActionSpec, role: str) -> None:
    """Note a name that says how high an agent flies, so that calls which give it a constant can be checked."""
    if field.type.name == "position":
        written = _NAMED_HEIGHT.search(expr.source)
        name = written[1] if written is not None else ""
    else:
        name = plain_name(expr) if field.name == spec.height else ""
    if name:
        body.heights.setdefault(name, role)


def check_called_heights(body: Body, args: Mapping[str, Expr], callee: Callee) -> None:
    """Report E062 for a constant height that the called subtree would fly at, above the limit of who flies."""
    for name, flier in callee.heights.items():
        height, agent = args.get(name), args.get(flier)
        role = plain_name(agent) if agent is not None else ""
        if height is None or not role:
            continue
        if plain_name(height):
            body.heights.setdefault(plain_name(height), role)
        limit, owner = most_height(body, role)
        if height.is_const and isinstance(height.const, int | float) and height.const > limit:
            shown, most = (format_quantity("distance", float(metres)) for metres in (height.const, limit))
            body.problems.add(
                "E062", height.mark, f"{name} {shown} is above the limit of {most} for {owner}", ENVELOPE_SAYS
            )


def most_height(body: Body, role: str) -> tuple[float, str]:
    """Return the greatest height over the ground that a role may fly at, metres, and who says so; inf = nobody."""
    return most_of(body, role, "max_height")


def most_of(body: Body, role: str, limit: str) -> tuple[float, str]:
    """Return the strictest value of a limit of the envelope for a role, in SI, and who says so; inf = nobody."""
    site = body.world.site.envelope if body.world.site is not None else {}
    types = body.world.catalogue.types
    known = [types[name] for name in body.agents.get(role, ()) if name in types]
    limits = [ceiling(limit, one, site, body.tightened) for one in known]
    return min(limits, key=lambda one: one[0], default=(math.inf, ""))


def check_ceiling(body: Body, expr: Expr, node: Node, role: str) -> None:
    """Report E062 for a position that is written higher than the envelope of a type allows."""
    written = _HEIGHT.search(expr.source)
    if written is not None:
        quantity = parse_quantity(f"{written[1]} {written[2]}")
        height = float(quantity[1]) if quantity is not None else 0.0
    else:
        height = expr.const.up_m if isinstance(expr.const, Position) else 0.0
    limit, owner = most_height(body, role)
    if height > limit:
        shown, most = format_quantity("distance", height), format_quantity("distance", limit)
        body.problems.add("E062", node.mark, f"{shown} is above the limit of {most} for {owner}", ENVELOPE_SAYS)
