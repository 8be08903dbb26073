"""`switch`: one of several lists of steps, chosen by a value. Its cases are complete, or there is a default.

Handed the readers of steps by `step`, like `blocks`. What branches save is certain after it only if each of them saves it;
they exclude one another, so they may save one name.
"""

from typing import Final

from formiga_bt.base.diagnostics import Fix
from formiga_bt.base.units import LARGEST
from formiga_bt.lang.body import Body
from formiga_bt.lang.expr.typing_rules import in_words
from formiga_bt.lang.flow import Flow, join
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr, Step, SwitchCase
from formiga_bt.lang.steps.blocks import Readers
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.text.document import Entry, Mapping_
from formiga_bt.lang.text.reading import read_mapping, shorten
from formiga_bt.lang.text.synonyms import is_sure, nearest
from formiga_bt.lang.types import Type

_SWITCHED: Final = ("enum", "text", "int")
"""Types of which a value can be named exactly, in one word of the file."""


def read_switch(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read the branches of a value."""
    on = _read_value(body, keys["switch"])
    entry = body.flow.copy()
    ends: list[Flow] = []
    cases: list[SwitchCase] = []
    mapping = read_mapping(keys["cases"].value, body.problems, "cases") if "cases" in keys else None
    for index, one in enumerate(mapping.entries if mapping is not None else ()):
        value = _case(body, one, on, cases)
        body.flow = entry.copy()
        steps = read.steps(body, one.value, f"case{index}", one.key.text)
        ends.append(body.flow)
        if value is not None:
            cases.append(SwitchCase(value, one.key.mark, steps))
    default: tuple[Step, ...] = ()
    if "default" in keys:
        body.flow = entry.copy()
        default = read.steps(body, keys["default"].value, "default", "default")
        ends.append(body.flow)
    if mapping is not None and not mapping.entries:
        body.problems.add("E044", mapping.mark, "'switch' has no cases", "such as: cases: {yes: [..], no: [..]}")
    elif on is not None and mapping is not None:
        _check_complete(body, on, cases, keys, mapping)
    body.flow = join(*ends) if ends else entry
    return {"on": on, "cases": tuple(cases), "default": default} if on is not None else None


def _read_value(body: Body, entry: Entry) -> Expr | None:
    expr = body.bare(entry.value, "switch")
    if expr is None:
        return None
    if expr.type.name not in (*_SWITCHED, "any"):
        help_ = "use if:, or when:" if expr.type.name != "bool" else "use if: with then: and else:"
        what = f"'switch' tells words or whole numbers apart, this is {in_words(expr.type)}"
        body.problems.add("E013", expr.mark, what, help_)
        return None
    if expr.is_const:
        body.problems.add(
            "E044", expr.mark, f"this switch is always over '{expr.const}'", "keep the steps of that case"
        )
    return expr


def _case(body: Body, entry: Entry, on: Expr | None, before: list[SwitchCase]) -> str | int | None:
    """Return the value that a case names; None (reported) if it is impossible or was named before."""
    key = entry.key
    if on is None:
        return None
    value: str | int = key.text
    if on.type.name == "int":
        text = key.text.strip()
        if not (text.isascii() and text.removeprefix("-").isdigit() and abs(int(text[:20])) <= LARGEST):
            what = f"case '{shorten(key.text)}' is never possible: {on.source} is a whole number"
            body.problems.add("E047", key.mark, what, "such as: 3")
            return None
        value = int(text)
    elif on.type.name == "enum" and on.type.values and value not in on.type.values:
        meant = nearest(key.text, on.type.values)
        guess = f"; did you mean '{meant}'?" if meant else ""
        what = f"'{shorten(key.text)}' is never a value of {on.source}{guess}"
        fix = Fix(key.mark, meant) if meant and is_sure(key.text, meant, on.type.values) else None
        body.problems.add("E047", key.mark, what, "one of " + ", ".join(on.type.values), fix)
        return None
    first = next((case for case in before if case.value == value), None)
    if first is not None:
        what = f"case '{shorten(key.text)}' appears twice; first at {first.mark.said}"
        body.problems.add("E047", key.mark, what, "put its steps into the first")
        return None
    return value


def _check_complete(body: Body, on: Expr, cases: list[SwitchCase], keys: Keys, mapping: Mapping_) -> None:
    """Report E047 for an enum's value without a case, for an open type without a default, for a default too many."""
    named = {case.value for case in cases}
    mark, values = keys["switch"].key.mark, _values(on.type)
    refused = len(cases) < len(mapping.entries)
    missing = [value for value in values if value not in named]
    if "default" in keys:
        if values and not missing and not refused:
            what = "default never runs: each value has its case"
            body.problems.add("E047", keys["default"].key.mark, what, "remove it")
    elif not values and on.type.name != "any":
        what = f"{in_words(on.type)} can be anything; add default:"
        body.problems.add("E047", mark, what, "default: with what is done in all other cases")
    elif missing and not refused:
        told = ", ".join(f"'{value}'" for value in missing[:5]) + (", .." if len(missing) > 5 else "")
        it = "it" if len(missing) == 1 else "them"
        body.problems.add("E047", mark, f"switch misses {told}; add {it} or default:")


def _values(type_: Type) -> tuple[str, ...]:
    return type_.values if type_.name == "enum" else ()
