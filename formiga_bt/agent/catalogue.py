"""An agent's class as the entry of a catalogue file: `python rover.py --catalogue > actions/rover.yaml`."""

import json
from collections.abc import Iterator
from typing import Any, Final

from formiga_bt.agent.agent import Agent
from formiga_bt.agent.declared import Declared
from formiga_bt.transport.cards import UNITS, CardField, Fields

_LIST: Final = "list of "


def catalogue_of(agent: type[Agent]) -> str:
    """Return the catalogue file of an agent's class: its type and its actions."""
    return "\n".join(_lines(agent)) + "\n"


def _lines(agent: type[Agent]) -> Iterator[str]:
    doc = (agent.__doc__ or "").split("\n")[0]
    yield f"# Made of the class {agent.__name__}" + (f": {doc}" if doc and not doc.startswith("An agent of") else "")
    yield "types:"
    yield f"  {agent.kind}:"
    yield f"    mobility: {agent.mobility}"
    if agent.mobility in ("fixed", "none"):
        yield "    shared: true                      # several tasks may address it"
    yield f"    label: {agent.kind.replace('_', ' ')}"
    if agent.actions:
        yield f"    actions: [{', '.join(agent.actions)}]"
    if agent.own_fields:
        yield f"    fields: {_flow({name: _type(field) for name, field in agent.own_fields.items()})}"
    if agent.events:
        yield "    events:"
        for name, fields in agent.events.items():
            yield f"      {name}: {_flow({one: _type(field) for one, field in fields.items()})}"
    if agent.actions:
        yield "actions:"
        for name, declared in agent.actions.items():
            yield f"  {name}:"
            yield from (f"    {line}" for line in _action(declared))


def _action(declared: Declared) -> Iterator[str]:
    card = declared.card
    if card.help:
        yield f"help: {json.dumps(card.help)}"
    if declared.params:
        yield "fields:"
        for name, field in declared.params.items():
            yield f"  {name}: {_field(field)}"
    if declared.result:
        yield f"result: {_flow({name: _type(field) for name, field in declared.result.items()})}"
    for name in ("requires", "moves_to"):
        value = getattr(card, name)
        if value:
            yield f"{name}: {json.dumps(value) if isinstance(value, dict) else value}"
    if card.effect:
        yield f"effect: {json.dumps(card.effect)}"
    for name in ("starts_rotors", "lands", "cuts", "repeatable", "exclusive"):
        value = getattr(card, name)
        if value is not None:
            yield f"{name}: {json.dumps(value)}"
    for name in ("typical", "accept_timeout", "cancel_grace"):
        value = getattr(card, f"{name}_s")
        if value is not None:
            yield f"{name}: {value:g} s"


def _field(field: CardField) -> str:
    item = field.type.removeprefix(_LIST)
    if item != field.type:
        return _type(field)
    parts: dict[str, Any] = {"type": field.type}
    if field.values:
        parts["values"] = f"[{', '.join(field.values)}]"
    if field.default is not None:
        parts["default"] = _quantity(field, field.default)
    elif field.optional:
        parts["optional"] = "true"
    for name, limit in (("min", field.min), ("max", field.max)):
        if limit is not None:
            parts[name] = _quantity(field, limit)
    if field.help:
        parts["help"] = json.dumps(field.help)
    return parts["type"] if len(parts) == 1 else _flow(parts)


def _type(field: CardField) -> str:
    if field.type.startswith(_LIST):
        return _flow({"list": field.type.removeprefix(_LIST)})
    return _flow({"type": "enum", "values": f"[{', '.join(field.values)}]"}) if field.values else field.type


def _quantity(field: CardField, value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return json.dumps(value)
    return f"{value:g} {UNITS[field.type]}".strip()


def _flow(parts: dict[str, Any] | Fields) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in parts.items()) + "}"
