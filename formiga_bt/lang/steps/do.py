"""Steps that order an agent's action, or wait for what it tells: `do` and `wait_for`.

Each function reads the keys of one step and returns its own part of the model; `step` adds the modifiers.
"""

from collections.abc import Mapping

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity
from formiga_bt.lang import records
from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import ActionSpec, Expr, FieldSpec
from formiga_bt.lang.naming import an_order
from formiga_bt.lang.steps.heights import check_ceiling, most_of, note_height
from formiga_bt.lang.steps.parts import Part, read_expect, read_save, unknown_argument
from formiga_bt.lang.steps.tracking import read_track
from formiga_bt.lang.steps.who import ROLE_ACTION, find_action, named_first, read_held, read_who
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.lang.text.reading import fix_word, quoted_list, read_mapping, read_text, shorten
from formiga_bt.lang.text.synonyms import nearest
from formiga_bt.lang.types import TIME, Type, record_of


def read_do(body: Body, keys: Keys) -> Part | None:
    """Read `do: role.Action` with its fields."""
    at = read_text(keys["do"].value, body.problems, "do")
    if at is None:
        return None
    found = ROLE_ACTION.fullmatch(at.text)
    if found is None:
        body.problems.add(
            "E008",
            at.mark,
            f"'do' must be role.Action, this is '{shorten(at.text)}'",
            named_first(at.text, an_order(body).removeprefix("do: ")),
        )
        return None
    role, word = found[1], found[2]
    who = read_held(body, role, at, at.mark_at(0, len(role)))
    spec = find_action(body, role, word, at.mark_at(len(role) + 1, len(at.text)), known=who is not None)
    if who is None or spec is None:
        return None
    body.need(role, spec.name)
    given, fields = _read_fields(body, keys.get("with"), spec, at)
    part: Part = {"who": who, "action": spec.name, "fields": fields}
    part["track"] = read_track(body, keys, spec, role, given)
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
    at, since = read_text(keys["wait_for"].value, body.problems, "wait_for"), keys.word("since")
    found = ROLE_ACTION.fullmatch(at.text) if at is not None else None
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
        told = f"events: {quoted_list(have)}" if have else "it reports no events"
        what = f"{who} has no event '{word}'" if lacking is not None else f"no agent has an event '{word}'"
        body.problems.add("E021", mark, what + guess, told, fix_word(Scalar(word, mark), meant))
    return None


def _read_fields(
    body: Body, given: Entry | None, spec: ActionSpec, at: Scalar
) -> tuple[dict[str, Expr], dict[str, Expr]]:
    """Return the fields that the step gives, and those with the defaults of the others, in the catalogue's order."""
    mapping = read_mapping(given.value, body.problems, "with") if given is not None else None
    entries = {entry.key.text: entry for entry in mapping.entries} if mapping is not None else {}
    values: dict[str, Expr] = {}
    misspelt = False
    role = at.text.partition(".")[0]
    for name, entry in entries.items():
        field = spec.fields.get(name)
        if field is None:
            misspelt = True
            unknown_argument(body, "E022", entry.key, spec.fields, spec.name, "field")
            body.count(entry.value)
            continue
        values[name] = body.value(entry.value, field.type, name, optional=field.optional or field.default is not None)
        _check_field_range(body, values[name], field, spec, role)
        note_height(body, values[name], field, spec, role)
        if field.type.name == "position":
            check_ceiling(body, values[name], entry.value, role)
    ordered: dict[str, Expr] = {}
    for name, field in spec.fields.items():
        if name in values:
            ordered[name] = values[name]
        elif field.default is not None:
            ordered[name] = field.default
        elif not field.optional and not misspelt and (given is None or mapping is not None):
            where = mapping.mark if mapping is not None else at.mark
            body.problems.add("E022", where, f"{spec.name} needs '{name}' ({field.type})", f"add with: {name}: ...")
    return values, ordered


def _check_field_range(body: Body, expr: Expr, field: FieldSpec, spec: ActionSpec, role: str) -> None:
    if not expr.is_const or isinstance(expr.const, bool) or not isinstance(expr.const, int | float):
        return
    shown = format_quantity(field.type.name, float(expr.const))
    limit, whose, help_ = field.max, spec.name, ""
    name = {spec.height: "max_height", spec.speed: "max_speed"}.get(field.name, "")
    if name:
        most, who = most_of(body, role, name)
        if limit is None or most <= limit:
            limit, whose, help_ = most, who, f"this is {name} of the envelope"
    if limit is not None and expr.const > limit:
        most_shown = format_quantity(field.type.name, limit)
        what = f"{field.name} {shown} is above the limit of {most_shown} for {whose}"
        body.problems.add("E062", expr.mark, what, help_)
    if field.min is not None and expr.const < field.min:
        least = format_quantity(field.type.name, field.min)
        body.problems.add("E062", expr.mark, f"{field.name} {shown} is below the limit of {least} for {spec.name}")


def as_order(body: Body, text: str) -> str:
    """Return how an action that stands where a step is due is ordered, `do: drone.TakeOff`; empty: the text is no action.

    Where several could do it, or nobody, the word for the one who does is AGENT.
    """
    who, _, action = text.rpartition(".")
    if action not in body.world.catalogue.actions or (who and who not in body.names):
        return ""
    types = body.world.catalogue.types
    held = [name for name in body.agents if name in body.names and not body.names[name].type.is_foreign]
    can = [name for name in held if any(action in types[t].actions for t in body.agents[name] if t in types)]
    return f"do: {who or (can[0] if len(can) == 1 else 'AGENT')}.{action}"
