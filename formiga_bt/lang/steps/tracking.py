"""`track` of a `do`: what `with` reads is followed while the agent is under way.

E054: nothing of it can change, the goal is one that cannot change, or nobody could tell the agent (`no_update`).
"""

from collections.abc import Mapping
from typing import Final

from formiga_bt.base.diagnostics import Fix
from formiga_bt.base.units import format_quantity, parse_quantity
from formiga_bt.base.wires import wire_kind
from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import TRACK
from formiga_bt.lang.model import ActionSpec, Expr, Track
from formiga_bt.lang.text.document import Entry, Scalar
from formiga_bt.lang.text.reading import read_mapping, what_is
from formiga_bt.lang.types import DISTANCE, DURATION

SOONEST_S: Final = 0.1
LATEST_S: Final = 10.0
"""A target that is looked at less often is not followed: a loop goes there again."""
_STILL: Final = ("param", "saved", "role", "loop name")
"""What a name is whose value stays as long as a step runs; a field of an agent does not."""


def read_track(body: Body, keys: Keys, spec: ActionSpec, role: str, fields: Mapping[str, Expr]) -> Track | None:
    """Read `track`; None if there is none, or it says nothing that can be used.

    Args:
        body: the task or subtree.
        keys: of the step.
        spec: the action.
        role: who carries it out.
        fields: those of the action that the step gives.
    """
    if "track" not in keys:
        return None
    entry = keys["track"]
    if isinstance(entry.value, Scalar):
        node = entry.value
        mend = f"{{every: {node.text or '2 s'}}}"
        what = f"'track' must be a mapping, this is {what_is(node)}"
        fix = Fix(node.mark, mend) if parse_quantity(node.text) is not None and entry.key.text == "track" else None
        body.problems.add("E008", node.mark, what, f"write {mend}" if fix else "such as: track: {every: 2 s}", fix)
        return None
    mapping = read_mapping(entry.value, body.problems, "track")
    inside = read_keys(mapping, TRACK, body.problems, "'track'") if mapping is not None else None
    if inside is None or "every" not in inside:
        return None
    every = body.value(inside["every"].value, DURATION, "every")
    if every.is_const and isinstance(every.const, int | float) and not SOONEST_S <= every.const <= LATEST_S:
        least, most = (format_quantity("duration", one) for one in (SOONEST_S, LATEST_S))
        body.problems.add("E062", every.mark, f"'every' of track lies between {least} and {most}")
    within = body.value(inside["within"].value, DISTANCE, "within") if "within" in inside else None
    if within is not None and within.is_const and isinstance(within.const, int | float) and within.const < 0:
        body.problems.add("E062", within.mark, "'within' must not be negative")
    changing = tuple(name for name, expr in fields.items() if _may_change(body, expr))
    _check(body, entry, spec, role, changing, fields)
    return Track(every, entry.key.mark, within, changing)


def _may_change(body: Body, expr: Expr) -> bool:
    """Return whether a value may be another one while its step runs: it reads an agent, a var, or the time."""
    return any(one.field or _origin(body, one.name) not in _STILL for one in expr.reads)


def _origin(body: Body, name: str) -> str:
    named = body.names.get(name) or body.flow.saved.get(name)
    return named.origin if named is not None else ""


def _check(
    body: Body, entry: Entry, spec: ActionSpec, role: str, changing: tuple[str, ...], fields: Mapping[str, Expr]
) -> None:
    """Report E054."""
    mark, add = entry.key.mark, body.problems.add
    if not changing:
        what = "there is nothing to track: no value in `with` can change while the step runs"
        add("E054", mark, what, "such as: to: ${above(ground(person.position), 40 m)}; or take track away")
    for name in changing:
        if spec.fields[name].type.name == "region":
            what = f"'{name}' is a region: what a machine has to itself does not change"
            add("E054", fields[name].mark, what, "compute it before the step")
    site, types = body.world.site, body.world.catalogue.types
    if site is None:
        return
    lacking = [name for name in site.transports if "update" not in wire_kind(name).guarantees]
    if lacking and len(lacking) == len(site.transports):
        what = f"no_update: the wire {lacking[0]} of this site cannot change a goal that runs"
        add("E054", mark, what, "go there again and again instead: repeat, with every:")
    on_routes = [t for t in body.agents.get(role, ()) if t in types and types[t].mobility == "ground"]
    if site.routes.nodes and on_routes and spec.moves_to in changing:
        what = f"no_update: {on_routes[0]} drives along the routes of this site, and cannot turn on the way"
        add("E054", mark, what, "go there again and again instead: repeat, with every:")
