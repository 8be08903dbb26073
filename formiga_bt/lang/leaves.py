"""Steps that address somebody: do, ask, notify, and the call of a subtree.

Each function reads the keys of one step and returns its own part of the model; `steps` adds the modifiers.
"""

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.diagnostics import Mark
from formiga_bt.geo import Position
from formiga_bt.lang import records
from formiga_bt.lang.body import Body
from formiga_bt.lang.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.envelope import ceiling
from formiga_bt.lang.expressions import plain_name
from formiga_bt.lang.kinds import CLEARS
from formiga_bt.lang.model import ActionSpec, Expr, FieldSpec, Who
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.reading import (
    did_you_mean,
    fix_word,
    quoted_list,
    read_keys,
    read_listing,
    read_mapping,
    read_name,
    read_text,
    read_word,
    read_words,
    shorten,
)
from formiga_bt.lang.synonyms import action_for, is_sure, nearest, surely
from formiga_bt.lang.types import ANY, TIME, Type, record_of
from formiga_bt.lang.world import Callee
from formiga_bt.units import format_quantity, parse_quantity

_NOT_HELD: Final = "it may be looked at and asked; to command one, declare a role under agents:"

_NAMED_ONLY: Final = "declare a role under agents: with id: ${%s}, and command that"

_HEIGHTS: Final = ("altitude", "height")
"""Fields of actions that are heights over the ground."""

_ENVELOPE_SAYS: Final = "this is max_height of the envelope"

_NAMED_HEIGHT: Final = re.compile(r"(?:above|at_height)\(.*,\s*([A-Za-z_]\w*)\s*\)\s*\}?\s*\Z")

_HEIGHT: Final = re.compile(r"(?:above|at_height)\(.*,\s*([\d.]+)\s*(k?m)\s*\)\s*\}?\s*\Z")

Keys = Mapping[str, Entry]
Part = dict[str, Any]
"""Keyword arguments of the step's class."""

_ROLE_ACTION: Final = re.compile(r"([A-Za-z]\w*)\.([A-Za-z]\w*)")


# --- do ----------------------------------------------------------------------------------------------------------


def read_do(body: Body, keys: Keys) -> Part | None:
    """Read `do: role.Action` with its fields."""
    at = read_text(keys["do"].value, body.problems, "do")
    if at is None:
        return None
    found = _ROLE_ACTION.fullmatch(at.text)
    if found is None:
        body.problems.add(
            "E008", at.mark, f"'do' must be role.Action, this is '{shorten(at.text)}'", "such as: drone.TakeOff"
        )
        return None
    role, word = found[1], found[2]
    who = read_held(body, role, at, at.mark_at(0, len(role)))
    spec = _find_action(body, role, word, at.mark_at(len(role) + 1, len(at.text)), known=who is not None)
    if who is None or spec is None:
        return None
    body.need(role, spec.name)
    part: Part = {"who": who, "action": spec.name, "fields": _read_fields(body, keys.get("with"), spec, at)}
    result = records.result(spec)
    if "save_as" in keys:
        if spec.result:
            part["save_as"] = read_save(body, keys["save_as"].value, result)
        else:
            body.problems.add(
                "E053", keys["save_as"].key.mark, f"{spec.name} returns nothing to save", "remove save_as"
            )
            body.drop(Mapping_((keys["save_as"],), at.mark))
    part["expect"] = read_expect(body, keys, result)
    return part


def read_wait_for(body: Body, keys: Keys) -> Part | None:
    """Read `wait_for: role.event`."""
    at = read_text(keys["wait_for"].value, body.problems, "wait_for")
    since = read_word(keys["since"].value, body.problems, "since", ("step", "task")) if "since" in keys else "step"
    found = _ROLE_ACTION.fullmatch(at.text) if at is not None else None
    if at is None or found is None:
        if at is not None:
            what = f"'wait_for' must be role.event, this is '{shorten(at.text)}'"
            body.problems.add("E008", at.mark, what, "such as: picker.sos")
        return None
    role, word = found[1], found[2]
    who = read_who(body, role, at, at.mark_at(0, len(role)))
    fields = _find_event(body, role, word, at.mark_at(len(role) + 1, len(at.text)))
    if who is None or fields is None:
        return None
    part: Part = {"who": who, "event": word, "since_task": since == "task"}
    if "save_as" in keys:
        part["save_as"] = read_save(body, keys["save_as"].value, record_of(**fields, at=TIME))
    return part


def _find_event(body: Body, role: str, word: str, mark: Mark) -> Mapping[str, Type] | None:
    """Return the fields of an event that each agent type of a role has; report E021 otherwise."""
    types = body.world.catalogue.types
    mine = [types[name] for name in body.agents.get(role, ()) if name in types]
    lacking = next((one for one in mine if word not in one.events), None)
    having = [one for one in mine or types.values() if word in one.events]
    if lacking is None and having:
        fields = having[0].events[word]
        return {name: of for name, of in fields.items() if all(one.events[word].get(name) == of for one in having)}
    if role in body.agents:
        have = lacking.events if lacking is not None else {name: () for one in types.values() for name in one.events}
        who = lacking.name if lacking is not None else "no agent"
        meant = nearest(word, have)
        guess = f"; did you mean '{meant}'?" if meant else ""
        told = f"events: {quoted_list(have)}" if have else "it tells no events"
        what = f"{who} has no event '{word}'" if lacking is not None else f"no agent has an event '{word}'"
        body.problems.add("E021", mark, what + guess, told, fix_word(Scalar(word, mark), meant))
    return None


def read_who(body: Body, name: str, at: Scalar, mark: Mark) -> Who | None:
    """Return the role or agent param `name`, which stands at the start of `at`; report E020 or E024 otherwise."""
    if name in body.agents:
        body.used.add(name)
        if name in body.lists:
            number = f"{body.lists[name]} " if body.lists[name] else ""
            what = f"'{name}' is a list of {number}agents; use for:"
            body.problems.add("E024", mark, what, f"for: {{one: ${{{name}}}}}")
            return None
        return Who(name, body.agent(at, name), site_role=False, mark=mark)
    body.unknown_agent(mark, name)
    body.used.add(name)
    return None


def read_held(body: Body, name: str, at: Scalar, mark: Mark, *, people: bool = True) -> Who | None:
    """Return an agent that a step commands; report E023 for one that the task does not hold. `people` are not commanded."""
    named = body.names.get(name)
    types = body.world.catalogue.types
    human = people and all(of in types and types[of].human for of in body.agents.get(name, ()))
    if named is not None and named.type.is_foreign and not (human and body.agents.get(name)):
        body.used.add(name)
        whence, help_ = _whence(body, name)
        body.problems.add("E023", mark, f"'{name}' {whence}: this task does not hold it", help_)
        return None
    return read_who(body, name, at, mark)


def _whence(body: Body, name: str) -> tuple[str, str]:
    """Return in words where an agent comes from that the task does not hold, and how to mend that."""
    of = next(iter(body.items.get(name, ())), name)
    named = body.names.get(of)
    if named is None or named.origin != "param":
        return "comes from fleet()", _NOT_HELD
    if named.type.name == "list":
        return f"is one of the parameter '{of}'" if of != name else "is a parameter", _NOT_HELD
    return "is a parameter", _NAMED_ONLY % of


def _find_action(body: Body, role: str, word: str, mark: Mark, *, known: bool) -> ActionSpec | None:
    catalogue = body.world.catalogue
    types = [catalogue.types[name] for name in body.agents.get(role, ()) if name in catalogue.types]
    for agent_type in types:
        if word not in agent_type.actions:
            have = {name: _meaning(catalogue.actions[name]) for name in agent_type.actions if name in catalogue.actions}
            have = {name: meaning for name, meaning in have.items() if not catalogue.actions[name].cuts}
            _no_action(body, f"{agent_type.name} has no action '{word}'", word, mark, have)
            return None
    spec = catalogue.actions.get(word)
    if spec is None and (known or role in body.agents):
        have = {name: _meaning(action) for name, action in catalogue.actions.items() if not action.cuts}
        _no_action(body, f"no agent has an action '{word}'", word, mark, have)
    if spec is not None and spec.cuts:
        what = f"{word} stops the motors, also in the air: only a person orders it, never a task"
        body.problems.add("E087", mark, what, "land with LandIn; a person has: formiga cut AGENT")
        return None
    return spec


def _meaning(action: ActionSpec) -> str:
    return action.effect or ("moves" if action.moves_to else "")


def _no_action(body: Body, what: str, word: str, mark: Mark, have: Mapping[str, str]) -> None:
    meant = action_for(word, have)
    guess = f"; did you mean '{meant}'?" if meant else ""
    sure = nearest(word, have) != meant or is_sure(word, meant, have)
    fix = fix_word(Scalar(word, mark), meant) if sure else None
    body.problems.add("E021", mark, what + guess, f"actions: {quoted_list(have)}", fix)


def _read_fields(body: Body, given: Entry | None, spec: ActionSpec, at: Scalar) -> dict[str, Expr]:
    mapping = read_mapping(given.value, body.problems, "with") if given is not None else None
    entries = {entry.key.text: entry for entry in mapping.entries} if mapping is not None else {}
    values: dict[str, Expr] = {}
    misspelt = False
    role = at.text.partition(".")[0]
    for name, entry in entries.items():
        field = spec.fields.get(name)
        if field is None:
            misspelt = True
            _unknown_argument(body, "E022", entry.key, spec.fields, spec.name, "field")
            body.count(entry.value)
            continue
        values[name] = body.value(entry.value, field.type, name, optional=field.optional or field.default is not None)
        _check_field_range(body, values[name], field, spec.name, role)
        _note_height(body, values[name], field, role)
        if field.type.name == "position":
            _check_ceiling(body, values[name], entry.value, role)
    ordered: dict[str, Expr] = {}
    for name, field in spec.fields.items():
        if name in values:
            ordered[name] = values[name]
        elif field.default is not None:
            ordered[name] = field.default
        elif not field.optional and not misspelt and (given is None or mapping is not None):
            where = mapping.mark if mapping is not None else at.mark
            body.problems.add("E022", where, f"{spec.name} needs '{name}' ({field.type})", f"add with: {name}: ...")
    return ordered


def _unknown_argument(body: Body, code: str, key: Scalar, known: Mapping[str, Any], owner: str, noun: str) -> None:
    meant = surely(key.text, known)
    help_ = f"{noun}s: {quoted_list(known)}" if known else f"it has no {noun}s"
    what = f"{owner} has no {noun} '{shorten(key.text)}'{did_you_mean(key.text, known)}"
    body.problems.add(code, key.mark, what, help_, fix_word(key, meant))


def _check_field_range(body: Body, expr: Expr, field: FieldSpec, owner: str, role: str) -> None:
    if not expr.is_const or isinstance(expr.const, bool) or not isinstance(expr.const, int | float):
        return
    shown = format_quantity(field.type.name, float(expr.const))
    limit, whose, help_ = field.max, owner, ""
    if field.type.name == "distance" and field.name in _HEIGHTS:
        most, who = _most_height(body, role)
        if limit is None or most <= limit:
            limit, whose, help_ = most, who, _ENVELOPE_SAYS
    if limit is not None and expr.const > limit:
        most_shown = format_quantity(field.type.name, limit)
        what = f"{field.name} {shown} is above the limit of {most_shown} for {whose}"
        body.problems.add("E062", expr.mark, what, help_)
    if field.min is not None and expr.const < field.min:
        least = format_quantity(field.type.name, field.min)
        body.problems.add("E062", expr.mark, f"{field.name} {shown} is below the limit of {least} for {owner}")


def _note_height(body: Body, expr: Expr, field: FieldSpec, role: str) -> None:
    """Note a name that says how high an agent flies, so that calls which give it a constant can be checked."""
    if field.type.name == "position":
        written = _NAMED_HEIGHT.search(expr.source)
        name = written[1] if written is not None else ""
    else:
        name = plain_name(expr) if field.name in _HEIGHTS else ""
    if name:
        body.heights.setdefault(name, role)


def _check_called_heights(body: Body, args: Mapping[str, Expr], callee: Callee) -> None:
    """Report E062 for a constant height that the called subtree would fly at, above the limit of who flies."""
    for name, flier in callee.heights.items():
        height, agent = args.get(name), args.get(flier)
        role = plain_name(agent) if agent is not None else ""
        if height is None or not role:
            continue
        if plain_name(height):
            body.heights.setdefault(plain_name(height), role)
        limit, owner = _most_height(body, role)
        if height.is_const and isinstance(height.const, int | float) and height.const > limit:
            shown, most = (format_quantity("distance", float(metres)) for metres in (height.const, limit))
            body.problems.add(
                "E062", height.mark, f"{name} {shown} is above the limit of {most} for {owner}", _ENVELOPE_SAYS
            )


def _most_height(body: Body, role: str) -> tuple[float, str]:
    """Return the greatest height over the ground that a role may fly at, metres, and who says so; inf = nobody."""
    site = body.world.site.envelope if body.world.site is not None else {}
    types = body.world.catalogue.types
    known = [types[name] for name in body.agents.get(role, ()) if name in types]
    limits = [ceiling("max_height", one, site, body.tightened) for one in known]
    return min(limits, key=lambda limit: limit[0], default=(math.inf, ""))


def _check_ceiling(body: Body, expr: Expr, node: Node, role: str) -> None:
    """Report E062 for a position that is written higher than the envelope of a type allows."""
    written = _HEIGHT.search(expr.source)
    if written is not None:
        quantity = parse_quantity(f"{written[1]} {written[2]}")
        height = float(quantity[1]) if quantity is not None else 0.0
    else:
        height = expr.const.up_m if isinstance(expr.const, Position) else 0.0
    limit, owner = _most_height(body, role)
    if height > limit:
        shown, most = format_quantity("distance", height), format_quantity("distance", limit)
        body.problems.add("E062", node.mark, f"{shown} is above the limit of {most} for {owner}", _ENVELOPE_SAYS)


def read_save(body: Body, node: Node, of: Type) -> str:
    """Read `save_as` and define the name from here on."""
    at = read_name(node, body.problems, "save_as")
    if at is None:
        return ""
    return body.save(at, of) if is_free(at, body.problems) else ""


def read_expect(body: Body, keys: Keys, result: Type) -> Expr | None:
    """Read `expect`, which sees `result`."""
    if "expect" not in keys:
        return None
    with body.with_names({"result": result}):
        return body.cond(keys["expect"].value, "expect")


# --- ask, notify -------------------------------------------------------------------------------------------------


def read_ask(body: Body, keys: Keys) -> Part | None:
    """Read a question to people."""
    part: Part = {"question": body.text(keys["ask"].value, "ask")}
    part["of"] = _read_whom(body, keys["of"].value, "of", action="Confirm") if "of" in keys else ()
    options = _read_options(body, keys)
    part["options"] = options
    policy = read_word(keys["policy"].value, body.problems, "policy", ("any", "all")) if "policy" in keys else "any"
    part["policy"] = policy or "any"
    if "escalate_after" in keys:
        part["escalate_after"] = body.span(keys["escalate_after"].value, "escalate_after")
        if len(part["of"]) == 1 and not part["of"][0].site_role:
            mark = keys["escalate_after"].key.mark
            body.problems.add("E074", mark, "escalate_after has nobody to ask next", "name another one in of:")
    if "clears" in keys:
        part["clears"], part["clears_on"] = _read_clears(body, keys["clears"].value, options)
    if "if_no_answer" in keys:
        part["if_no_answer"] = body.text(keys["if_no_answer"].value, "if_no_answer")
    result = records.answer(options, part["policy"])
    if "save_as" in keys:
        part["save_as"] = read_save(body, keys["save_as"].value, result)
    part["expect"] = read_expect(body, keys, result)
    return part


def _read_options(body: Body, keys: Keys) -> tuple[str, ...]:
    if "options" not in keys:
        return ("yes", "no")
    node = keys["options"].value
    words = read_words(node, body.problems, "options")
    seen: dict[str, Scalar] = {}
    for word in words:
        if word.text in seen:
            body.problems.add("E074", word.mark, f"the option '{shorten(word.text)}' is given twice", "remove one")
        seen.setdefault(word.text, word)
    if len(words) == 1 or (not words and getattr(node, "items", None) == ()):
        body.problems.add("E074", node.mark, "a question needs at least two options", "such as: options: [yes, no]")
    return tuple(seen) or ("yes", "no")


def _read_clears(body: Body, node: Node, options: tuple[str, ...]) -> tuple[Who | None, tuple[str, ...]]:
    mapping = read_mapping(node, body.problems, "clears")
    if mapping is None:
        return None, ()
    keys = read_keys(mapping, CLEARS, body.problems, "'clears'")
    who = None
    at = read_text(keys["role"].value, body.problems, "role") if "role" in keys else None
    if at is not None:
        who = read_held(body, at.text, at, at.mark)
        types = body.world.catalogue.types
        human = [name for name in body.agents.get(at.text, ()) if name in types and types[name].human]
        if human:
            body.problems.add("E074", at.mark, f"'{at.text}' is a person; clears is for a machine", "name the drone")
    on = read_words(keys["on"].value, body.problems, "on") if "on" in keys else []
    for word in on:
        if word.text not in options:
            what = f"'{shorten(word.text)}' is never an answer here{did_you_mean(word.text, options)}"
            meant = surely(word.text, options)
            body.problems.add("E014", word.mark, what, f"options: {quoted_list(options)}", fix_word(word, meant))
    return who, tuple(word.text for word in on)


def _read_whom(body: Body, node: Node, key: str, action: str = "") -> tuple[Who, ...]:
    """Read a list of roles and site roles; `action` is what each of the roles must offer."""
    items = read_listing(node, body.problems, key)
    if items is not None and not items:
        body.problems.add("E044", node.mark, f"'{key}' is an empty list", "name at least one role")
    found: list[Who] = []
    site_roles = site_role_names(body)
    for item in items or ():
        at = read_text(item, body.problems, key)
        if at is None:
            continue
        if at.text not in body.agents and at.text in site_roles:
            found.append(Who(at.text, None, site_role=True, mark=at.mark))
        elif at.text not in body.agents:
            body.unknown_agent(at.mark, at.text, site_roles)
            body.used.add(at.text)
        else:
            who = read_who(body, at.text, at, at.mark)
            if who is not None and action and _find_action(body, at.text, action, at.mark, known=True) is not None:
                body.need(at.text, action)
            if who is not None:
                found.append(who)
    return tuple(found)


def site_role_names(body: Body) -> tuple[str, ...]:
    """Return the roles that the site gives to people; `watchers` is always one."""
    people = body.world.site.people if body.world.site is not None else {}
    return tuple(dict.fromkeys(("watchers", *people)))


def read_notify(body: Body, keys: Keys) -> Part:
    """Read a notice to people."""
    part: Part = {"text": body.text(keys["notify"].value, "notify")}
    if "to" in keys:
        part["to"] = _read_whom(body, keys["to"].value, "to")
    if "severity" in keys:
        loud = ("info", "warning", "alarm")
        part["severity"] = read_word(keys["severity"].value, body.problems, "severity", loud) or "info"
    return part


# --- call --------------------------------------------------------------------------------------------------------


def read_call(body: Body, keys: Keys) -> Part | None:
    """Read the call of a subtree with its arguments."""
    at = read_name(keys["call"].value, body.problems, "call")
    callee = body.resolve(at) if at is not None else None
    if at is None or callee is None:
        return None
    args = _read_args(body, keys.get("with"), callee, at)
    part: Part = {"subtree": callee.subtree, "args": args}
    if "save_as" in keys:
        if callee.returns is not None:
            part["save_as"] = read_save(body, keys["save_as"].value, callee.returns)
        else:
            mark = keys["save_as"].key.mark
            body.problems.add("E053", mark, f"{at.text} returns nothing to save", "remove save_as, or give it returns:")
            body.drop(Mapping_((keys["save_as"],), at.mark))
    return part


def _read_args(body: Body, given: Entry | None, callee: Callee, at: Scalar) -> dict[str, Expr]:
    params = callee.subtree.params
    mapping = read_mapping(given.value, body.problems, "with") if given is not None else None
    args: dict[str, Expr] = {}
    misspelt = given is not None and mapping is None
    for entry in mapping.entries if mapping is not None else ():
        param = params.get(entry.key.text)
        if param is None:
            misspelt = True
            _unknown_argument(body, "E050", entry.key, params, at.text, "param")
            body.count(entry.value)
            continue
        absent = param.optional or param.default is not None
        args[param.name] = body.value(entry.value, param.type, param.name, optional=absent)
        if param.min is None:
            body.not_negative(args[param.name], param.name)
        if param.type.name == "agent" or (param.type.item is not None and param.type.item.name == "agent"):
            _check_abilities(body, entry.value, args[param.name], callee.needs.get(param.name, ()), at.text)
        name = plain_name(args[param.name])
        if param.name in callee.releases and args[param.name].type.is_foreign:
            whence, help_ = _whence(body, name)
            one = f"'{name}', which {whence}" if "param" in whence else "an agent from fleet()"
            body.problems.add("E023", entry.value.mark, f"{at.text} releases {one}: this task does not hold it", help_)
        elif param.name in callee.releases and name:
            body.flow.released.setdefault(name, at.mark)
    _check_called_heights(body, args, callee)
    for param in params.values():
        if param.name not in args and param.default is None and not param.optional and not misspelt:
            where = mapping.mark if mapping is not None else at.mark
            body.problems.add(
                "E050", where, f"{at.text} needs '{param.name}' ({param.type})", f"add with: {param.name}: ..."
            )
    return args


def _check_abilities(body: Body, node: Node, arg: Expr, needs: tuple[str, ...], callee: str) -> None:
    """Report E052 where the agent passed lacks an action; hand the needs on to the role or param that is passed."""
    name = arg.reads[0].name if len(arg.reads) == 1 and not arg.reads[0].field else ""
    types = body.agents.get(name, arg.type.item.of if arg.type.item is not None else arg.type.of)
    known = body.world.catalogue.types
    machines = [one for one in types if one not in known or not known[one].human]
    if arg.type.is_foreign and needs and (machines or not types):
        whence, help_ = _whence(body, name)
        one = f"'{name}', which {whence}" if "param" in whence else "an agent from fleet()"
        body.problems.add("E023", node.mark, f"{callee} orders {needs[0]} of {one}: this task does not hold it", help_)
        return
    for action in needs:
        lacking = [one for one in types if one in known and action not in known[one].actions]
        if lacking and arg.type != ANY:
            what = f"{callee} orders {action} of '{name or 'this agent'}', but {lacking[0]} has no such action"
            body.problems.add(
                "E052", node.mark, what, f"actions of {lacking[0]}: {quoted_list(known[lacking[0]].actions)}"
            )
            return
        if name in body.agents:
            body.need(name, action)
