"""What an agent announces, held against the catalogue: what contradicts it is refused, with both versions shown.

The agent itself stays: whatever else it can do it does. The catalogue's word counts: what a card leaves out is as the
catalogue has it.
"""

from formiga_bt.lang.model import ActionSpec, AgentType, Catalogue
from formiga_bt.lang.types import Type
from formiga_bt.transport.messages import AgentCard, CardAction, CardField


def refusals(card: AgentCard, catalogue: Catalogue) -> dict[str, str]:
    """Return the actions (and other parts) of a card that cannot be used, each with the reason."""
    found = dict(card.faults or {})
    kind = catalogue.types.get(card.type)
    if kind is None:
        return found
    for name in card.names:
        spec, announced = catalogue.actions.get(name), card.action(name)
        if spec is None or announced is None or name not in kind.actions:
            continue
        fault = contradiction(announced, spec)
        if fault:
            found[name] = fault
    for name, field in card.fields.items():
        fault = _of_field(kind, name, field)
        if fault:
            found[f"field {name}"] = fault
    return found


def contradiction(card: CardAction, spec: ActionSpec) -> str:
    """Return in what an announced action contradicts the catalogue, or ""."""
    faults = [*_of_fields(card, spec), *_of_result(card, spec)]
    for key in ("requires", "moves_to", "starts_rotors", "lands", "cuts"):
        said, known = getattr(card, key), getattr(spec, key)
        if isinstance(said, bool | str) and isinstance(known, bool | str) and said != known:
            faults.append(f"{key}: {_both(repr(said), repr(known))}")
    airborne = (card.effect or {}).get("airborne")
    if isinstance(airborne, bool) and spec.effect != ("airborne" if airborne else "grounded"):
        faults.append(f"effect: {_both('airborne' if airborne else 'grounded', spec.effect or 'none')}")
    if card.repeatable is False and spec.repeatable:
        faults.append(f"repeatable: {_both('false', 'true')}")
    return "; ".join(faults)


def _of_fields(card: CardAction, spec: ActionSpec) -> list[str]:
    if card.fields is None:
        return []
    faults = []
    for name, known in spec.fields.items():
        said = card.fields.get(name)
        if said is None:
            if not known.optional and known.default is None:
                faults.append(f"field {name}: {_both('has none', str(known.type))}")
        elif not _fits(said, known.type):
            faults.append(f"field {name}: {_both(_words(said), str(known.type))}")
    for name, said in card.fields.items():
        if said.is_needed and name not in spec.fields:
            faults.append(f"field {name}: {_both(f'needs it ({_words(said)})', 'has none')}")
    return faults


def _of_result(card: CardAction, spec: ActionSpec) -> list[str]:
    if card.result is None:
        return []
    faults = []
    for name, known in spec.result.items():
        said = card.result.get(name)
        if said is None:
            faults.append(f"result {name}: {_both('has none', str(known))}")
        elif not _fits(said, known, of_result=True):
            faults.append(f"result {name}: {_both(_words(said), str(known))}")
    return faults


def _of_field(kind: AgentType, name: str, said: CardField) -> str:
    known: Type | None = kind.fields.get(name)
    return "" if known is None or _fits(said, known, of_result=True) else _both(_words(said), str(known))


def _both(card: str, catalogue: str) -> str:
    return f"the card says {card}, the catalogue says {catalogue}"


def _words(field: CardField) -> str:
    return f"one of {', '.join(field.values)}" if field.values else field.type


def _fits(said: CardField, known: Type, *, of_result: bool = False) -> bool:
    """Return whether a field is the catalogue's: who gets an enum must know every value that may be sent."""
    word, values = _name(known)
    if word == "any":
        return True
    if said.type != word:
        return False
    more, less = (values, said.values) if of_result else (said.values, values)
    return not values or set(less) <= set(more)


def _name(type_: Type) -> tuple[str, tuple[str, ...]]:
    if type_.name == "list" and type_.item is not None:
        word, values = _name(type_.item)
        return (word if word == "any" else f"list of {word}"), values
    return ("any" if type_.name == "record" else type_.name), type_.values
