"""Types as authors write them, and the params of tasks, subtrees and actions."""

import json
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.lang.checks.outside import warn_outside
from formiga_bt.lang.expr.scope import BUILT_INS, OUTSIDE
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import PARAM
from formiga_bt.lang.model import AgentType, Expr, Param
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.request.aliases import check_params
from formiga_bt.lang.request.binding import impossible
from formiga_bt.lang.shipped import types_help
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_mapping,
    read_name,
    read_text,
    read_words,
)
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import ANY, Type, list_of
from formiga_bt.lang.world import World

SIMPLE: Final = (
    "number", "int", "text", "bool", "percent", "distance", "duration", "speed", "angle", "mass", "time", "place",
    "position", "region", "agent", "any",
)  # fmt: skip
"""Types that are one word."""
NO_RECORDS: Final[Mapping[str, Type]] = MappingProxyType({})


def descendants(name: str, types: Mapping[str, AgentType]) -> tuple[str, ...]:
    """Return an agent type and every type that extends it, in the catalogue's order."""
    return tuple(other for other, spec in types.items() if other == name or name in spec.extends)


def read_agent_types(names: Sequence[Scalar], types: Mapping[str, AgentType], problems: Problems) -> tuple[str, ...]:
    """Return known agent types with what extends them; report E020 for the others."""
    found: dict[str, None] = {}
    for at in names:
        if at.text not in types:
            meant = surely(at.text, types)
            what = f"no agent type is called '{at.text}'{did_you_mean(at.text, types)}"
            problems.add("E020", at.mark, what, types_help(at, types), fix_word(at, meant))
        else:
            found.update(dict.fromkeys(descendants(at.text, types)))
    return tuple(found)


def read_type(node: Node, problems: Problems, records: Mapping[str, Type] = NO_RECORDS) -> Type:
    """Return the type written as `distance`, `{list: place}` or the name of a record; ANY (reported) if it is none."""
    if isinstance(node, Mapping_) and len(node.entries) == 1 and node.entries[0].key.text == "list":
        return list_of(read_type(node.entries[0].value, problems, records))
    at = read_text(node, problems, "type")
    if at is None:
        return ANY
    if at.text in SIMPLE:
        return Type(at.text)
    if at.text == "enum":
        return Type("enum")
    if at.text in records:
        return records[at.text]
    known = (*SIMPLE, "enum", *records)
    meant = surely(at.text, known)
    help_ = "write {list: place} for a list of places" if at.text == "list" else f"types: {quoted_list(known)}"
    problems.add(
        "E008", at.mark, f"'{at.text}' is not a type{did_you_mean(at.text, known)}", help_, fix_word(at, meant)
    )
    return ANY


def read_params(node: Node, world: World, problems: Problems) -> dict[str, Param]:
    """Return the params of a task or subtree, in file order."""
    mapping = read_mapping(node, problems, "params")
    found: dict[str, Param] = {}
    marks: dict[str, Mark] = {}
    for entry in mapping.entries if mapping is not None else ():
        if read_name(entry.key, problems, "params") is None:
            continue
        is_free(entry.key, problems)
        found[entry.key.text] = _read_param(entry, world, problems)
        inner = entry.value.get("aliases") if isinstance(entry.value, Mapping_) else None
        marks[entry.key.text] = inner.key.mark if inner is not None else entry.key.mark
    check_params(found, marks, problems)
    return found


def _read_param(entry: Entry, world: World, problems: Problems) -> Param:
    name, node = entry.key.text, entry.value
    long_form = isinstance(node, Mapping_) and node.get("list") is None
    if not long_form or not isinstance(node, Mapping_):
        return Param(name, _whole(read_type(node, problems, world.records), node.mark, problems), entry.key.mark)
    keys = read_keys(node, PARAM, problems, f"param '{name}'")
    of = read_details(keys, node, world, problems)
    optional = keys.flag("optional")
    param = Param(
        name,
        of,
        entry.key.mark,
        default=_bound(keys, "default", of, world, problems),
        optional=optional,
        min=_bound(keys, "min", of, world, problems),
        max=_bound(keys, "max", of, world, problems),
        label=_text(keys, "label", problems),
        help=_text(keys, "help", problems),
        choices=_words(keys, "choices", problems),
        aliases=_words(keys, "aliases", problems),
    )
    _check_range(param, problems)
    return param


def read_details(keys: dict[str, Entry], node: Mapping_, world: World, problems: Problems) -> Type:
    """Return the type written as `type` with its `of` or `values`; ANY (reported) if it is none."""
    if "type" not in keys:
        return ANY
    of = read_type(keys["type"].value, problems, world.records)
    if "of" in keys:
        names = read_words(keys["of"].value, problems, "of")
        types = read_agent_types(names, world.catalogue.types, problems)
        if of.name == "agent":
            of = Type("agent", of=types)
        elif of.name == "list" and of.item is not None and of.item.name == "agent":
            of = list_of(Type("agent", of=types))
        else:
            problems.add("E008", keys["of"].key.mark, f"'of' is for agents, this is a {of}", "remove 'of'")
    if "values" in keys:
        values = tuple(at.text for at in read_words(keys["values"].value, problems, "values"))
        if of.name == "enum":
            of = Type("enum", values=values)
        elif of != ANY:
            problems.add(
                "E008", keys["values"].key.mark, f"'values' is for an enum, this is a {of}", "write type: enum"
            )
    return _whole(of, node.mark, problems)


def _whole(of: Type, mark: Mark, problems: Problems) -> Type:
    if of.name == "enum" and not of.values:
        problems.add("E008", mark, "an enum needs 'values'", "{type: enum, values: [a, b]}")
        return ANY
    return of


def _bound(keys: dict[str, Entry], key: str, of: Type, world: World, problems: Problems) -> Expr | None:
    """Read default, min or max: a value of the param's type. A type that does not fit is E061."""
    if key not in keys:
        return None
    known = BUILT_INS if key == "default" else OUTSIDE
    scope = Scope({}, agent_types=world.catalogue.types, site=world.site, built_ins=known)
    expr, found = compile_value(keys[key].value, scope, of, what=key)
    problems.extend(_as_default(d) for d in found)
    if key == "default" and not found:
        warn_outside(expr, keys[key].value, world.site, problems)
    node = keys[key].value
    return expr if isinstance(node, Scalar) else replace(expr, source=written(node))  # what forms and drawings show


def written(node: Node) -> str:
    """Return a value on one line, as an author could write it; only a text that must be has quotes."""
    if isinstance(node, Listing):
        return f"[{', '.join(map(written, node.items))}]"
    if isinstance(node, Mapping_):
        return f"{{{', '.join(f'{one.key.text}: {written(one.value)}' for one in node.entries)}}}"
    return (
        node.text
        if re.fullmatch(r"[^\s,:{}\[\]\"'](?:[^,:{}\[\]\"']*\S)?", node.text)
        else json.dumps(node.text, ensure_ascii=False)
    )


def _as_default(diagnostic: Diagnostic) -> Diagnostic:
    if diagnostic.code not in ("E013", "E016"):
        return diagnostic
    help_ = diagnostic.help or "a default, min or max is of the param's type"
    return Diagnostic("E061", diagnostic.mark, diagnostic.message, help_, diagnostic.within, None)


def _check_range(param: Param, problems: Problems) -> None:
    wrong = impossible(param, _number(param.default))
    if wrong and param.default is not None:
        problems.add("E061", param.default.mark, f"'{param.name}' {wrong}")
        return
    check_bounds(param.name, param.min, param.max, param.default, problems)


def check_bounds(name: str, least: Expr | None, most: Expr | None, given: Expr | None, problems: Problems) -> None:
    """Report E061 for bounds that contradict, and for a default that lies outside of them."""
    low, high, default = (_number(expr) for expr in (least, most, given))
    if low is not None and high is not None and low > high and least is not None:
        problems.add("E061", least.mark, f"min of '{name}' is above its max", "exchange them")
    elif given is not None and default is not None:
        if low is not None and default < low:
            problems.add("E061", given.mark, f"the default of '{name}' is below its min")
        if high is not None and default > high:
            problems.add("E061", given.mark, f"the default of '{name}' is above its max")


def _number(expr: Expr | None) -> float | None:
    if expr is None or not expr.is_const or isinstance(expr.const, bool):
        return None
    return float(expr.const) if isinstance(expr.const, int | float) else None


def _text(keys: dict[str, Entry], key: str, problems: Problems) -> str:
    at = read_text(keys[key].value, problems, key) if key in keys else None
    return at.text if at is not None else ""


def _words(keys: dict[str, Entry], key: str, problems: Problems) -> tuple[str, ...]:
    return tuple(at.text for at in read_words(keys[key].value, problems, key)) if key in keys else ()
