"""An agent's card on the wire, version 2: what it can do, with the types of every field as the catalogue writes them.

A card is read part by part (`read_card`): an action, an event or a field that cannot be read is left out of the card
and stands in `faults` with the reason, so that one mistake does not cost the agent. A card of another version of the
wire is kept as what it is, without actions: the engine refuses the agent and says why.

Types and units are those of the task language; `tests/unit/transport/test_cards.py` holds them together, because
agents must not need the language to say what they can do.
"""

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, TypeVar

import msgspec
from msgspec import Struct

from formiga_bt.base.machines import Mobility

WIRE: Final = 2
"""The version of the wire that this code speaks."""

UNITS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "number": "", "int": "", "text": "", "bool": "", "enum": "", "place": "", "position": "", "region": "", "agent": "",
        "percent": "%", "distance": "m", "duration": "s", "speed": "m/s", "angle": "deg", "mass": "kg", "time": "us",
    }
)  # fmt: skip
"""Every type of a field and the unit that it has on the wire; `list of TYPE` is a list of such values."""

MOST_ACTIONS: Final = 200
"""The most actions, events or status fields of a card."""

_LIST: Final = "list of "
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")

_S = TypeVar("_S", bound=Struct)


class CardField(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A field of an action, of its result, of an event, or of the agent's own status."""

    type: str
    """A word of `UNITS`, or `list of` one."""
    unit: str = ""
    """The unit on the wire; it may be left out."""
    default: Any = None
    """What the agent takes where the goal does not say."""
    optional: bool = False
    values: tuple[str, ...] = ()
    """Of an enum: what it may be."""
    min: float | None = None
    max: float | None = None
    """SI, percent 0..100."""
    help: str = ""

    @property
    def is_needed(self) -> bool:
        """Return whether a goal must say it."""
        return not self.optional and self.default is None


Fields = dict[str, CardField]


class CardAction(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An action that an agent announces. What is null is as the catalogue has it."""

    name: str
    fields: Fields | None = None
    result: Fields | None = None
    requires: str | dict[str, Any] | None = None
    """The state in which it may start: `airborne`, `grounded`, or values of status fields."""
    effect: dict[str, Any] | None = None
    """The state after success."""
    moves_to: str | None = None
    starts_rotors: bool | None = None
    lands: bool | None = None
    cuts: bool | None = None
    repeatable: bool | None = None
    exclusive: bool | None = None
    """False: other goals may run beside it."""
    accept_timeout_s: float | None = None
    cancel_grace_s: float | None = None
    typical_s: float | None = None
    help: str = ""


class AgentCard(Struct, frozen=True, kw_only=True):
    """What an agent announces about itself, once per start and when it changes."""

    id: str
    type: str
    boot_id: str
    """Changes with every start of the agent's process: a changed one means earlier goals ended unknown."""
    wire: int = WIRE
    """The version of the wire that the agent speaks; on the wire it must be said."""
    actions: tuple[CardAction | str, ...]
    """A name alone means: as the catalogue has it."""
    mobility: Mobility = "air"
    """How it moves; the catalogue's word counts where it knows the type."""
    avoids: bool = False
    """A ground machine that keeps away from obstacles by itself."""
    datum: Literal["local", "ellipsoid", "msl"] = "local"
    limits: dict[str, float] = {}
    """SI numbers by name, for example `speed_m_s`, `climb_m_s`."""
    events: dict[str, Fields] = {}
    """What it reports of itself, apart from any goal: event -> its fields."""
    fields: Fields = {}
    """What its statuses say besides, by name."""
    on_link_loss: Literal["return", "land", "hold"] = "return"
    software: str = ""
    """Its program and version, for people."""
    faults: dict[str, str] | msgspec.UnsetType = msgspec.UNSET
    """Filled in by who reads a card: what was left out of it, and why. An agent leaves it out."""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of its actions."""
        return tuple(one if isinstance(one, str) else one.name for one in self.actions)

    def action(self, name: str) -> CardAction | None:
        """Return what the card says of an action; None: it has no such action."""
        for one in self.actions:
            if isinstance(one, str):
                if one == name:
                    return CardAction(name=name)
            elif one.name == name:
                return one
        return None


class _OtherVersion(Struct, frozen=True, kw_only=True):
    """What is read of a card of any version."""

    id: str
    type: str
    boot_id: str
    wire: int = 1


def read_card(data: Any) -> AgentCard:
    """Return a card of what JSON gave; parts that cannot be read are left out and stand in `faults`.

    Raises:
        msgspec.ValidationError: the card itself cannot be read.
    """
    version = msgspec.convert(data, _OtherVersion)
    if version.wire != WIRE:
        return AgentCard(id=version.id, type=version.type, boot_id=version.boot_id, wire=version.wire, actions=())
    faults: dict[str, str] = {}
    given = dict(data)
    actions = _read_actions(given.pop("actions", ()), faults)
    fields = _read_fields(given.pop("fields", {}), "field", faults)
    events = _read_events(given.pop("events", {}), faults)
    given.pop("faults", None)
    rest = msgspec.convert({**given, "actions": ()}, AgentCard)
    return msgspec.structs.replace(rest, actions=actions, fields=fields, events=events, faults=faults)


def fault_of_type(field: CardField) -> str:
    """Return what is wrong with the type of a field, or ""."""
    word = field.type
    while word.startswith(_LIST):
        word = word[len(_LIST) :]
    unit = UNITS.get(word)
    if unit is None:
        return f"the type {field.type!r} is none of the language; types: {', '.join(UNITS)}, list of ..."
    if field.unit and field.unit != unit:
        return f"the unit {field.unit!r}: on the wire a {word} is in {unit}" if unit else f"a {word} has no unit"
    if word == "enum" and not field.values:
        return "an enum without values"
    if any(limit is not None and not math.isfinite(limit) for limit in (field.min, field.max)):
        return "a limit that is no finite number"
    return ""


def _read_actions(given: Any, faults: dict[str, str]) -> tuple[CardAction | str, ...]:
    if not isinstance(given, list | tuple):
        raise msgspec.ValidationError("Expected `array` - at `$.actions`")
    found: dict[str, CardAction | str] = {}
    for at, one in enumerate(given):
        name = one if isinstance(one, str) else one.get("name") if isinstance(one, dict) else None
        label = name if isinstance(name, str) and name else f"actions[{at}]"
        fault = (
            "" if isinstance(name, str) and _NAME.fullmatch(name) else "it has no name of letters, digits, '_' and '-'"
        )
        if not fault and label in found:
            fault = "it is announced twice"
        if not fault and len(found) >= MOST_ACTIONS:
            fault = f"a card has at most {MOST_ACTIONS} actions"
        if not fault and not isinstance(one, str):
            action, fault = _read_part(one, CardAction)
            if action is not None:
                fault = _fault_of_action(action)
                one = action
        if fault:
            faults[label[:100]] = fault
        else:
            found[label] = one
    return tuple(found.values())


def _fault_of_action(action: CardAction) -> str:
    for what, fields in (("field", action.fields), ("result", action.result)):
        for name, field in (fields or {}).items():
            fault = fault_of_type(field)
            if fault:
                return f"{what} {name}: {fault}"
    if action.moves_to and action.fields is not None and action.moves_to not in action.fields:
        return f"moves_to names {action.moves_to!r}, which is no field of it"
    times = (action.accept_timeout_s, action.cancel_grace_s, action.typical_s)
    if not all(time is None or 0.0 <= time < math.inf for time in times):
        return "a time that is no finite number of seconds, 0 or more"
    return ""


def _read_events(given: Any, faults: dict[str, str]) -> dict[str, Fields]:
    found: dict[str, Fields] = {}
    for name, fields in (given if isinstance(given, dict) else {}).items():
        broken: dict[str, str] = {}
        read = _read_fields(fields, f"event {name}", broken)
        if broken or len(found) >= MOST_ACTIONS:
            faults[f"event {name}"[:100]] = next(iter(broken.values()), f"a card has at most {MOST_ACTIONS} events")
        else:
            found[name] = read
    return found


def _read_fields(given: Any, what: str, faults: dict[str, str]) -> Fields:
    if not isinstance(given, dict):
        faults[what] = f"expected a mapping, got {type(given).__name__}"
        return {}
    found: Fields = {}
    for name, one in given.items():
        field, fault = _read_part(one, CardField)
        if field is not None:
            fault = fault_of_type(field)
        if len(found) >= MOST_ACTIONS:
            fault = f"a card has at most {MOST_ACTIONS} fields"
        if fault:
            faults[f"{what} {name}"[:100]] = fault
        elif field is not None:
            found[name] = field
    return found


def _read_part(given: Any, kind: type[_S]) -> tuple[_S | None, str]:
    try:
        return msgspec.convert(given, kind), ""
    except (msgspec.ValidationError, RecursionError) as error:
        return None, str(error)
