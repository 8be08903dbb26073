"""Vars and roles of a task: what is read once, at admission, before any agent is held."""

import re
from collections.abc import Mapping
from heapq import heappop, heappush
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.body import Body
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.members import type_read
from formiga_bt.lang.expr.typing_rules import widen
from formiga_bt.lang.expressions import compile_value
from formiga_bt.lang.flow import NamedValue
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import COUNT, ROLE, VAR
from formiga_bt.lang.model import Expr, Role, Room, Some
from formiga_bt.lang.model.needs import IF_LOST
from formiga_bt.lang.naming import a_type
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.params import read_agent_types, read_details, written
from formiga_bt.lang.steps.over_lists import length_of
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import read_mapping, read_name, read_text, read_words, what_is
from formiga_bt.lang.types import ANY, DURATION, PERCENT, PLACE, AgentRef, Type, Value, agent_type, list_of
from formiga_bt.lang.walk import plain_name
from formiga_bt.lang.written import scalars

_READ: Final = re.compile(r"'[^']*'|\"[^\"]*\"|(?<![\w.])([A-Za-z_]\w*)(?!\w)(?!\s*=[^=])")
"""A name in an expression; no text, no field after a dot, no argument by name."""
_MOST_AGENTS: Final = 1000
_COUNTS: Final = "such as: count: 3, count: all, count: {min: 1, max: 4}"


def read_vars(body: Body, node: Node) -> dict[str, Expr]:
    """Return the vars in an order in which each reads only earlier ones; they are defined in `body` on the way."""
    mapping = read_mapping(node, body.problems, "vars")
    entries: dict[str, Entry] = {}
    for entry in mapping.entries if mapping is not None else ():
        if read_name(entry.key, body.problems, "vars") is not None and _may_define(body, entry.key):
            entries[entry.key.text] = entry
    found: dict[str, Expr] = {}
    for name in _in_order(body, entries):
        at, node = entries[name].key.mark, entries[name].value
        if isinstance(node, Mapping_) and node.get("type") is not None:
            found[name] = _without_value(body, name, at, node)
            continue
        expr = body.value(node, ANY, name)
        _check_admission(body, expr, name)
        found[name] = expr
        body.define(name, NamedValue(widen(expr.type), at, "var"))
        length = length_of(body, expr, node)
        if length is not None:
            body.lengths[name] = length
    body.vars = frozenset(found)
    return found


def _without_value(body: Body, name: str, mark: Mark, node: Mapping_) -> Expr:
    """Define a var that has no value yet: `{type: place}`."""
    keys = read_keys(node, VAR, body.problems, f"var '{name}'")
    of = read_details(keys, node, body.world, body.problems)
    if agent_type(of).name == "agent":
        body.problems.add(
            "E008", node.mark, "agents are no values of vars", "hold them as roles, or keep their id as text"
        )
        of = ANY
    body.define(name, NamedValue(of, mark, "var"), optional=True)
    return Expr(written(node), of, node.mark, lambda _env: None, const=None)


def _may_define(body: Body, at: Scalar) -> bool:
    is_free(at, body.problems)
    old = body.names.get(at.text) or body.flow.saved.get(at.text)
    if old is not None:
        what = f"'{at.text}' is a {old.origin} already; first at {old.mark.said}"
        body.problems.add("E018", at.mark, what, "choose another name")
        body.used.add(at.text)
    return old is None


def _in_order(body: Body, entries: Mapping[str, Entry]) -> list[str]:
    """Sort the vars by what they read, in file order where it is free; report E019 for a cycle."""
    reads = {name: _reads(entry.value) & entries.keys() for name, entry in entries.items()}
    readers: dict[str, list[str]] = {name: [] for name in entries}
    for name, read in reads.items():
        for one in read:
            readers[one].append(name)
    place = {name: at for at, name in enumerate(entries)}
    missing = {name: len(read) for name, read in reads.items()}
    ready = [(place[name], name) for name, count in missing.items() if not count]
    order: list[str] = []
    while ready:
        _, done = heappop(ready)
        order.append(done)
        for name in readers[done]:
            missing[name] -= 1
            if not missing[name]:
                heappush(ready, (place[name], name))
    rest = [name for name in entries if missing[name]]
    if rest:
        _report_circle(body, entries, rest)
    return order


def _report_circle(body: Body, entries: Mapping[str, Entry], rest: list[str]) -> None:
    """Report E019 for vars that need one another; they count as used and have any type."""
    names = sorted(rest)
    for name in names:
        body.define(name, NamedValue(ANY, entries[name].key.mark, "var"))
    mark = entries[rest[0]].key.mark
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    body.problems.add("E019", mark, f"these vars need one another: {shown}", "break the circle")
    body.used.update(names)
    body.vars = frozenset(names)


def _reads(node: Node) -> set[str]:
    words: set[str] = set()
    for scalar in scalars(node):
        if "${" in scalar.text:
            spans = holes(scalar.text)
            inside = [scalar.text[start:end] for start, end in spans] if isinstance(spans, list) else [scalar.text]
            words.update(name for text in inside for name in _READ.findall(text) if name)
    return words


def _check_admission(body: Body, expr: Expr, key: str) -> None:
    """Report E027 for an expression that reads what is not known at admission."""
    for read in expr.reads:
        if type_read(read):
            help_ = "who is there changes: it is read once, before any agent is held"
            body.problems.add("E027", expr.mark, f"'{key}' reads {read.name}", help_)
            return
        if read.name == "now" or read.field or read.name in body.agents or read.name in body.flow.saved:
            what = (
                f"the field '{read.field}' of an agent"
                if read.field
                else "'now'"
                if read.name == "now"
                else f"'{read.name}', which a step saved"
                if read.name in body.flow.saved
                else f"the role '{read.name}'"
            )
            if read.name in body.agents and body.names[read.name].origin != "role" and not read.field:
                continue
            help_ = "it is read before any agent is held: it may read params, vars, base, site and task"
            body.problems.add("E027", expr.mark, f"'{key}' reads {what}", help_)
            return


# --- roles -------------------------------------------------------------------------------------------------------


def read_roles(body: Body, node: Node, *, block: bool = False) -> dict[str, Role]:
    """Return the roles of a task, or of a block of it; they are defined in `body` on the way."""
    mapping = read_mapping(node, body.problems, "agents")
    found: dict[str, Role] = {}
    entries = mapping.entries if mapping is not None else ()
    _declare(body, entries)
    for entry in entries:
        if entry.key.text not in body.agents:
            continue
        value = read_mapping(entry.value, body.problems, entry.key.text)
        if value is not None:
            with body.problems.within(entry.key.text):
                role = _read_role(body, entry.key, value, block=block)
                _check_same_id(body, role, found)
            found[role.name] = role
    return found


def _check_same_id(body: Body, role: Role, others: Mapping[str, Role]) -> None:
    """Report E025 for a role that must be the very machine that another one is: all of them are granted together."""
    this = _this_one(body, role)
    for other in others.values():
        if this is not None and this == _this_one(body, other):
            assert role.id is not None
            what = f"'{role.name}' and '{other.name}' cannot both be {role.id.source.strip()}: a machine has one role"
            help_ = f"use '{other.name}' in its place, or take the id out"
            body.problems.add("E025", role.id.mark, what, help_)
            return


def _this_one(body: Body, role: Role) -> Value | None:
    """Return which machine a role names, or the param that says it; None if that is open, or if roles may share it."""
    types = body.world.catalogue.types
    if role.id is None or any(types[name].shared for name in role.types):
        return None
    if role.id.is_const:
        return role.id.const if isinstance(role.id.const, AgentRef) else None
    name = plain_name(role.id)
    return name if name and name not in body.optional else None


def _declare(body: Body, entries: tuple[Entry, ...]) -> None:
    """Define every role first, so that what reads another role is told that, not "unknown"."""
    for entry in entries:
        at = entry.key
        if read_name(at, body.problems, "agents") is None or not _may_define(body, at):
            continue
        types: tuple[str, ...] = ()
        if isinstance(entry.value, Mapping_):
            keys = {e.key.text: e.value for e in entry.value.entries}
            if isinstance(keys.get("type"), Scalar):
                named = read_text(keys["type"], body.problems, "type")
                types = read_agent_types([named] if named else [], body.world.catalogue.types, body.problems)
            elif "any_of" in keys:
                words = read_words(keys["any_of"], body.problems, "any_of")
                types = read_agent_types(words, body.world.catalogue.types, body.problems)
        body.agents[at.text] = types
        body.define(at.text, NamedValue(Type("agent", of=types), at.mark, "role"))


def _read_role(body: Body, at: Scalar, mapping: Mapping_, *, block: bool) -> Role:
    name, problems = at.text, body.problems
    for entry in mapping.entries:
        if entry.key.text == "shared":
            what = (
                "a role cannot be shared; a type of the catalogue can"
                if not body.agents[name]
                else f"{body.agents[name][0]} cannot be shared"
            )
            problems.add("E036", entry.key.mark, what, "remove it: people are shared by default")
    listed = Mapping_(tuple(e for e in mapping.entries if e.key.text != "shared"), mapping.mark)
    keys = read_keys(listed, ROLE, problems, f"role '{name}'")
    if ("type" in keys) == ("any_of" in keys):
        has = "both" if "type" in keys else "neither"
        problems.add(
            "E008",
            mapping.mark if has == "neither" else keys["any_of"].key.mark,
            f"role '{name}' needs type or any_of, it has {has}",
            f"say of which type it is, for example type: {a_type(body.world.catalogue)}"
            if has == "neither"
            else "take one of them out",
        )
    agent = Type("agent", of=body.agents[name])
    count = _read_count(body, keys, name)
    if not block:
        _check_of_block(body, keys)
    return Role(
        name,
        body.agents[name],
        at.mark,
        id=_admitted(body, keys, "id", agent),
        near=_read_near(body, keys, count),
        prefer=_admitted(body, keys, "prefer", agent),
        count=count if isinstance(count, int) else None,
        open=count if isinstance(count, Some) else None,
        battery_min=_admitted(body, keys, "battery_min", PERCENT),
        capabilities=tuple(keys.words("capabilities")),
        wait=_admitted(body, keys, "wait", DURATION),
        if_lost=next((word for word in IF_LOST if word == keys.word("if_lost")), "fail"),
        hand_over_at=_read_hand_over(body, keys),
        away=keys.flag("away"),
        preempt=keys.flag("preempt") if "preempt" in keys else None,
        room=_room_in(mapping),
    )


def _check_of_block(body: Body, keys: Keys) -> None:
    """Report E008 for what only a block can do: a task's own roles are held from its first step to its end."""
    for key in ("if_lost", "hand_over_at"):
        if key in keys and (key != "if_lost" or keys.word(key) == "fail_block"):
            said = "if_lost: fail_block" if key == "if_lost" else key
            what = f"'{said}' is for a role of with_agents: it says how a block goes on"
            body.problems.add(
                "E008", keys[key].key.mark, what, "put the role and the steps that use it into with_agents"
            )


def _read_hand_over(body: Body, keys: Keys) -> Expr | None:
    """Read at which charge a machine is replaced; without a higher `battery_min` the next one would be at once, too."""
    late = _admitted(body, keys, "hand_over_at", PERCENT)
    if late is None:
        return None
    at, example = keys["hand_over_at"].key.mark, f"such as: battery_min: {_above(late)} %"
    if "battery_min" not in keys:
        body.problems.add(
            "E008", at, "'hand_over_at' needs battery_min: the charge with which another one may begin", example
        )
        return late
    least = body.value(keys["battery_min"].value, PERCENT, "battery_min", optional=True)
    if late.is_const and least.is_const and isinstance(least.const, float | int) and least.const <= late.const:
        what = "battery_min is not above hand_over_at: a machine could begin that is replaced at once"
        body.problems.add("E061", keys["battery_min"].value.mark, what, example)
    return late


def _above(late: Expr) -> int:
    """Return a charge well above another one, in whole points."""
    return min(100, round(late.const) + 35) if late.is_const and isinstance(late.const, float | int) else 70


def _room_in(mapping: Mapping_) -> Room | None:
    """Return where a further key may stand: before the second one; else, in braces, behind the only value."""
    if not mapping.entries:
        return None
    first, last = mapping.entries[0], mapping.entries[-1]
    in_braces = (mapping.mark.line, mapping.mark.col) != (first.key.mark.line, first.key.mark.col)
    at = (mapping.entries[1] if len(mapping.entries) > 1 else first).key.mark
    if not in_braces:
        return Room(_empty(at.file, at.line, at.col), after=f"\n{' ' * (at.col - 1)}")
    if last is first and isinstance(first.value, Scalar) and first.value.mark.end_line:
        end = first.value.mark
        return Room(_empty(end.file, end.end_line, end.end_col), before=", ", quoted=True)
    return Room(_empty(at.file, at.line, at.col), after=", ", quoted=True)


def _empty(file: str, line: int, col: int) -> Mark:
    return Mark(file, line, col, line, col)


def _admitted(body: Body, keys: Mapping[str, Entry], key: str, of: Type) -> Expr | None:
    if key not in keys:
        return None
    expr = body.value(keys[key].value, of, key, optional=True)
    _check_admission(body, expr, key)
    return body.not_negative(expr, key)


def _read_near(body: Body, keys: Mapping[str, Entry], count: int | Some | None) -> Expr | None:
    if "near" not in keys:
        return None
    listed = count is not None and _is_list(body, keys["near"].value)
    expr = _admitted(body, keys, "near", list_of(PLACE) if listed else PLACE)
    if expr is None or not listed:
        return expr
    if isinstance(count, Some) and count.max is None:
        what = "near is a list of places, but nobody knows how many agents there will be"
        body.problems.add("E026", expr.mark, what, "give one place, or a count with a max")
        return expr
    most = count.max if isinstance(count, Some) else count
    places = length_of(body, expr, keys["near"].value)
    if places is not None and most != places:
        shown = f"a count of up to {most}" if isinstance(count, Some) else f"count {most}"
        what = f"near has {places} places for {shown}"
        body.problems.add("E026", expr.mark, what, "one place for each agent")
    return expr


def _is_list(body: Body, node: Node) -> bool:
    """Return whether a value is a list, without reporting anything."""
    return compile_value(node, body.scope(), ANY)[0].type.name == "list"


def _read_count(body: Body, keys: Mapping[str, Entry], name: str) -> int | Some | None:
    """Read how many agents a role has, and make it a list."""
    if "count" not in keys:
        return None
    node = keys["count"].value
    count: int | Some | None
    if isinstance(node, Mapping_):
        count = _read_some(body, node)
    elif isinstance(node, Scalar) and node.text.strip() == "all":
        count = Some()
    else:
        count = _read_number(body, node, "count", _COUNTS)
    if count is None:
        body.define(name, NamedValue(ANY, body.names[name].mark, "role"))
        return None
    body.lists[name] = count if isinstance(count, int) else 0
    body.define(name, NamedValue(list_of(Type("agent", of=body.agents[name])), body.names[name].mark, "role"))
    return count


def _read_some(body: Body, node: Mapping_) -> Some | None:
    keys = read_keys(node, COUNT, body.problems, "'count'")
    if not keys:
        body.problems.add("E008", node.mark, "'count' needs min, max or both", _COUNTS)
        return None
    low = _read_number(body, keys["min"].value, "min", _COUNTS) if "min" in keys else 1
    high = _read_number(body, keys["max"].value, "max", _COUNTS) if "max" in keys else None
    if low is None or ("max" in keys and high is None):
        return None
    if high is not None and low > high:
        body.problems.add("E061", keys["min"].value.mark, "min of 'count' is above its max", "exchange them")
        return None
    return Some(low, high)


def _read_number(body: Body, node: Node, key: str, help_: str) -> int | None:
    if not isinstance(node, Scalar) or not node.text.isascii() or not node.text.isdigit() or len(node.text) > 6:
        also = ", all, or {min, max}" if key == "count" else ""
        body.problems.add("E008", node.mark, f"'{key}' must be a number{also}, this is {what_is(node)}", help_)
        return None
    number = int(node.text)
    if not 1 <= number <= _MOST_AGENTS:
        none = " (a role is never an empty list)" if number == 0 else ""
        body.problems.add("E024", node.mark, f"'{key}' must be 1 to {_MOST_AGENTS}{none}", help_)
        return None
    return number
