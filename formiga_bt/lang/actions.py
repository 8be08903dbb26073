"""Actions of a catalogue: what a goal and its result hold, what they need and change."""

from collections.abc import Mapping
from typing import Any, Final, Literal

from formiga_bt.base.clock import micros
from formiga_bt.lang.expr.tokens import is_readable
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import PARAM, Option
from formiga_bt.lang.model import ActionSpec, Expr, FieldSpec
from formiga_bt.lang.params import NO_RECORDS, check_bounds, read_type
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    is_empty,
    read_flag,
    read_mapping,
    read_name,
    read_number,
    read_word,
)
from formiga_bt.lang.types import AGENT, ANY, Type

ACTION: Final = (
    Option("fields", "map", "What a goal holds."),
    Option("result", "map", "What its result holds."),
    Option("requires", "word", "State in which it may start.", values=("airborne", "grounded")),
    Option("effect", "map", "State after success: {airborne: true|false}."),
    Option("moves_to", "name", "The field that says where the agent will be."),
    Option("starts_rotors", "flag", "People must stand clear."),
    Option("lands", "flag", "Ends on the ground; away from a port people must stand clear."),
    Option("cuts", "flag", "Stops the motors at once, also in the air; only a person orders it."),
    Option("repeatable", "flag", "May be sent again after a failure."),
    Option("typical", "value", "Usual duration.", type="duration"),
    Option("accept_timeout", "value", "How long the agent may take to accept.", type="duration"),
    Option("cancel_grace", "value", "How long a cancel may take.", type="duration"),
    Option("exclusive", "flag", "One at a time (the default)."),
    Option("concurrency", "value", "How many at a time.", type="int"),
    Option("help", "text", "A line for people."),
)

FIELD: Final = tuple(
    o for o in PARAM if o.name in ("type", "default", "optional", "values", "of", "min", "max", "help")
)


def read_optional_mapping(node: Node, problems: Problems, what: str) -> Mapping_ | None:
    """Return a mapping, which may be empty (a key with nothing after it)."""
    return Mapping_((), node.mark) if is_empty(node) else read_mapping(node, problems, what)


def read_action(entry: Entry, problems: Problems, records: Mapping[str, Type] = NO_RECORDS) -> ActionSpec | None:
    """Return the action that one entry of `actions:` defines; None (reported) if it is no mapping."""
    name = entry.key.text
    mapping = read_optional_mapping(entry.value, problems, name)
    if mapping is None:
        return None
    keys = read_keys(mapping, ACTION, problems, f"action '{name}'")
    fields = read_fields(keys["fields"].value, problems, records=records) if "fields" in keys else {}
    requires = keys.word("requires")
    moves_to = read_word(keys["moves_to"].value, problems, "moves_to", tuple(fields)) if "moves_to" in keys else ""
    flags: dict[str, Any] = {
        key: keys.flag(key) for key in ("starts_rotors", "lands", "cuts", "repeatable") if key in keys
    }
    times: dict[str, Any] = {
        f"{key}_us": micros(keys.number(key)) for key in ("typical", "accept_timeout", "cancel_grace") if key in keys
    }
    number = read_number(keys["concurrency"].value, problems, "concurrency") if "concurrency" in keys else 1
    gives = read_fields(keys["result"].value, problems, "result", records=records) if "result" in keys else {}
    return ActionSpec(
        name,
        entry.key.mark,
        fields=fields,
        result={one: spec.type for one, spec in gives.items()},
        result_min={one: spec.min for one, spec in gives.items() if spec.min is not None},
        requires="airborne" if requires == "airborne" else "grounded" if requires == "grounded" else "",
        effect=_effect(keys["effect"].value, problems) if "effect" in keys else "",
        moves_to=moves_to,
        concurrency=max(1, int(number or 1)),
        help=keys.word("help"),
        **flags,
        **times,
    )


def read_fields(
    node: Node,
    problems: Problems,
    what: str = "fields",
    options: tuple[Option, ...] = FIELD,
    records: Mapping[str, Type] = NO_RECORDS,
) -> dict[str, FieldSpec]:
    """Return the fields of a mapping, by name; `options` are the keys that one may have."""
    mapping = read_optional_mapping(node, problems, what)
    found: dict[str, FieldSpec] = {}
    for entry in mapping.entries if mapping is not None else ():
        if read_name(entry.key, problems, what) is not None:
            found[entry.key.text] = _field(entry, problems, options, records)
            if what != "fields":
                check_readable(entry.key, problems)
    return found


def check_readable(at: Scalar, problems: Problems) -> None:
    """Report E018 for what tasks read after a dot, if no expression can: `result.in`."""
    if not is_readable(at.text, field=True):
        what = f"no expression can read '{at.text}': it is a word of expressions"
        problems.add("E018", at.mark, what, f"call it {at.text}_")


def _field(
    entry: Entry, problems: Problems, options: tuple[Option, ...] = FIELD, records: Mapping[str, Type] = NO_RECORDS
) -> FieldSpec:
    name, node = entry.key.text, entry.value
    if not isinstance(node, Mapping_) or node.get("list") is not None:
        return FieldSpec(name, read_type(node, problems, records))
    keys = read_keys(node, options, problems, f"field '{name}'")
    of = read_type(keys["type"].value, problems, records) if "type" in keys else ANY
    if "values" in keys:
        of = Type("enum", values=tuple(keys.words("values")))
    default, least, most = (_value(keys, key, of, problems) for key in ("default", "min", "max"))
    check_bounds(name, least, most, default, problems)
    return FieldSpec(
        name,
        of,
        optional="optional" in keys and keys.flag("optional"),
        default=default,
        min=_number(least),
        max=_number(most),
        help=keys.word("help"),
    )


def _value(keys: dict[str, Entry], key: str, of: Type, problems: Problems) -> Expr | None:
    """Compile a default or bound; a default may read the fields of `agent`, which gets the goal."""
    if key not in keys:
        return None
    scope = Scope({"agent": AGENT} if key == "default" else {})
    expr, found = compile_value(keys[key].value, scope, of, what=key)
    problems.extend(found)
    return expr


def read_results(
    node: Node, problems: Problems, what: str = "result", records: Mapping[str, Type] = NO_RECORDS
) -> dict[str, Type]:
    """Return the types of the fields of a result, or of an event."""
    mapping = read_optional_mapping(node, problems, what)
    found: dict[str, Type] = {}
    for entry in mapping.entries if mapping is not None else ():
        found[entry.key.text] = _field(entry, problems, FIELD, records).type
        check_readable(entry.key, problems)
    return found


def _number(expr: Expr | None) -> float | None:
    return float(expr.const) if expr is not None and expr.is_const and isinstance(expr.const, int | float) else None


def _effect(node: Node, problems: Problems) -> Literal["", "airborne", "grounded"]:
    if isinstance(node, Mapping_) and not node.entries:
        return ""
    mapping = read_mapping(node, problems, "effect")
    keys = (
        read_keys(mapping, (Option("airborne", "flag", "In the air or not."),), problems, "'effect'") if mapping else {}
    )
    if "airborne" not in keys:
        return ""
    return "airborne" if read_flag(keys["airborne"].value, problems, "airborne") else "grounded"
