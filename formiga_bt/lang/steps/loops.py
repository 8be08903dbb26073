"""Loops with a condition, a number or a duration: while, repeat; and what any loop does to the names of its body.

What a round saves has no value when the next one begins; what is to last longer is a var.
"""

from typing import Final

from formiga_bt.base.diagnostics import Fix
from formiga_bt.base.units import parse_quantity
from formiga_bt.lang.body import Body
from formiga_bt.lang.expr.at_run import sure_of_type
from formiga_bt.lang.expr.misread import period_of
from formiga_bt.lang.expr.typing_rules import in_words
from formiga_bt.lang.expressions import narrows, narrows_when_false
from formiga_bt.lang.flow import Around, Flow, join
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr
from formiga_bt.lang.steps.blocks import Readers
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.text.document import Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import what_is
from formiga_bt.lang.text.synonyms import key_for
from formiga_bt.lang.types import ANY, DURATION, INT

_SUCH_AS: Final = "repeat: 3, repeat: 30 min, repeat: forever"

# --- while, repeat -----------------------------------------------------------------------------------------------


def read_while(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read a loop with its condition before each round."""
    cond = body.cond(keys["while"].value, "while")
    entry = body.flow.copy()
    if cond is not None:
        body.flow.sure |= narrows(cond)
    part, outs = _read_rounds(read, body, keys, "while")
    if cond is None:
        return None
    for out in (entry, body.flow):
        out.sure |= narrows_when_false(cond)
    leave(body, [*outs, entry, body.flow])
    return {"cond": cond, **part}


def read_repeat(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read a loop that runs a number of rounds, for a duration, or forever."""
    how = _read_how_long(body, keys["repeat"].value)
    entry = body.flow.copy()
    part, outs = _read_rounds(read, body, keys, "repeat")
    if how is None:
        return None
    if not how.get("forever"):
        times = how.get("times")
        sure_of_one = times is None or times.is_const
        leave(body, [*outs, body.flow, *([] if sure_of_one else [entry])])
    elif "max" in part:
        leave(body, [*outs, body.flow])
    elif outs:
        leave(body, outs)
    elif body.bounded:
        body.flow.dead = True
    else:
        mark = keys["repeat"].key.mark
        body.problems.add(
            "E041", mark, "this loop never ends", "add break_if or until:, or say how long: `repeat: 2 h`"
        )
    return {**how, **part}


def _read_how_long(body: Body, node: Node) -> Part | None:
    """Return what `repeat` says as a part of the model; None (reported) if it says nothing that is understood."""
    if not isinstance(node, Scalar):
        what = f"'repeat' is a number of rounds, a duration or forever, this is {what_is(node)}"
        body.problems.add("E008", node.mark, what, _period(node) or f"such as: {_SUCH_AS}")
        return None
    text = node.text.strip()
    if text == "forever":
        return {"forever": True}
    if "${" in text:
        expr = body.value(node, ANY, "repeat")
        if expr.type.name in ("int", "any"):
            return {"times": _at_least(body, sure_of_type(expr, INT), 0, "repeat", "at least 1")}
        if expr.type == DURATION:
            return {"duration": _at_least(body, expr, 0, "repeat", "longer than 0 s")}
        what = f"'repeat' is a number of rounds or a duration, this is {in_words(expr.type)}"
        body.problems.add("E013", expr.mark, what, "such as: repeat: 3, or repeat: 30 min")
        return None
    if parse_quantity(text) is not None:
        expr = body.value(node, DURATION, "repeat")
        return {"duration": _at_least(body, expr, 0, "repeat", "longer than 0 s")} if expr.type != ANY else None
    if text.isascii() and text.lstrip("-").isdigit():
        return {"times": _at_least(body, body.value(node, INT, "repeat"), 0, "repeat", "at least 1")}
    meant = "forever" if text.lower() in ("forever", "infinite", "always", "true", "inf") else ""
    rounds = text.split()[0] if text.split() and text.split()[0].isdigit() else ""
    fix = Fix(node.mark, meant or rounds) if meant or rounds else None
    what = f"'repeat' is a number of rounds, a duration or forever, this is {what_is(node)}"
    help_ = f"write repeat: {meant or rounds}" if fix else f"such as: {_SUCH_AS}"
    body.problems.add("E008", node.mark, what, help_, fix)
    return None


def _period(node: Node) -> str:
    """Return how rounds at a rate are written, where `repeat: {rate: 1 Hz}` or the like stands; else ""."""
    entries = node.entries if isinstance(node, Mapping_) else ()
    if len(entries) != 1 or key_for(entries[0].key.text, ("every",)) != "every":
        return ""
    value = entries[0].value
    text = value.text if isinstance(value, Scalar) else ""
    return f"write repeat: forever, and below it every: {period_of(text) or text or '1 s'}"


def _at_least(body: Body, expr: Expr, above: int, key: str, due: str) -> Expr:
    if expr.is_const and isinstance(expr.const, int | float) and expr.const <= above:
        body.problems.add("E008", expr.mark, f"'{key}' must be {due}")
    return expr


def _read_rounds(read: Readers, body: Body, keys: Keys, kind: str) -> tuple[Part, list[Flow]]:
    """Read the body of a loop and its options; `body.flow` is then the end of a round, the flows are where it is left."""
    part: Part = {}
    if "every" in keys:
        part["every"] = _at_least(
            body, body.value(keys["every"].value, DURATION, "every"), 0, "every", "longer than 0 s"
        )
    if "max" in keys:
        part["max"] = _at_least(body, body.value(keys["max"].value, INT, "max"), 0, "max", "at least 1")
    steps, outs = read_body(read, body, keys, Around(keys[kind].key.mark, []))
    part |= steps
    if "until" in keys:
        until = body.cond(keys["until"].value, "until")
        part["until"] = until
        left = body.flow.copy()
        if until is not None:
            left.sure |= narrows(until)
            body.flow.sure |= narrows_when_false(until)
        outs.append(left)
    return part, outs


def leave(body: Body, outs: list[Flow]) -> None:
    """Go on after a loop that is left in these ways; what other rounds saved may be set."""
    end = body.flow
    body.flow = join(*outs)
    for name, named in end.saved.items():
        body.flow.saved.setdefault(name, named)
    body.flow.taken |= end.taken
    body.flow.released = {**end.released, **body.flow.released}


# --- the body of any loop ----------------------------------------------------------------------------------------


def read_body(read: Readers, body: Body, keys: Keys, around: Around) -> tuple[Part, list[Flow]]:
    """Read the steps of a loop; return them as a part of the model, and the flows at its `break_if`s."""
    if "steps" not in keys:
        return {"steps": ()}, []
    entry, outer, loop = body.flow.copy(), body.around, body.loop
    body.around, body.loop = around, around.mark
    steps = read.steps(body, keys["steps"].value, "steps", "steps")
    body.around, body.loop = outer, loop
    _check_released(body, entry, around)
    return {"steps": steps, "fresh": body.flow.first_saved(entry)}, around.exits


def _check_released(body: Body, entry: Flow, around: Around) -> None:
    """Report E023 for a role that a round gives back and the next one no longer has."""
    for name, mark in body.flow.released.items():
        if name not in entry.released and name not in body.items:
            what = f"'{name}' is released in the loop at {around.mark.said}: its next round no longer holds it"
            body.problems.add("E023", mark, what, "release it after the loop")
