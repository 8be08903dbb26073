"""Actions that agents announce and that the catalogue does not know: noted, shown, and known once that is safe.

In mode simulation such an action can be used at once; in mode real an approver says so. What an agent of a type that flies
announces counts as starting rotors and as landing, whatever the card says; what cuts motors is never taken from a card. The
first announcement counts: what contradicts it is refused for that agent as what contradicts the catalogue is.
"""

import json
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.agents.announced import contradiction
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm, Learn
from formiga_bt.engine.kernel.records import Discovered
from formiga_bt.lang.growing import FILE, read_announced
from formiga_bt.lang.text.formatting import format_text
from formiga_bt.safety.approval import check_approver
from formiga_bt.transport.cards import UNITS, AgentCard, CardAction, CardField

MOST: Final = 500
"""Announced actions that are kept; further ones are passed over."""
_LIST: Final = "list of "


class Discovery:
    """Reads and writes `state.discovered`, and lets the catalogue grow."""

    def __init__(self, core: Core) -> None:
        self._core = core

    def hear(self, card: AgentCard) -> None:
        """Note what of a card nobody knew. Called before the card is judged."""
        core = self._core
        kind = core.catalogue.types.get(card.type)
        if kind is None or kind.human:
            return
        for action in card.actions:
            if isinstance(action, CardAction) and action.name not in kind.actions:
                self._note(action, card.id, card.type, flies=kind.flies)

    def _note(self, action: CardAction, agent: str, type_name: str, *, flies: bool) -> None:
        core, old = self._core, self._core.state.discovered.get(action.name)
        spec = core.catalogue.actions.get(action.name)
        if spec is not None and (old is None or contradiction(action, spec)):
            return  # the catalogue has it, and says which types do; or the card contradicts it, and is refused that
        if old is None and len(core.state.discovered) >= MOST:
            return
        text = text_of(action, flies=flies)
        if old is None:
            fault = fault_of(action, text)
            known = core.site.mode == "simulation" and not fault
            found = Discovered(text=text, types=(type_name,), agents=(agent,), fault=fault, known=known, at=core.now)
        else:
            found = replace(
                old,
                known=old.known and (core.site.mode == "simulation" or bool(old.by)),
                types=tuple(dict.fromkeys((*old.types, type_name))),
                agents=tuple(dict.fromkeys((*old.agents, agent))),
            )
            if not old.known and text != old.text:
                alone = old.agents == (agent,)
                fault = fault_of(action, text) if alone else f"{old.agents[0]} and {agent} announce it differently"
                found = replace(found, text=text if alone else old.text, fault=fault)
        if found == old:
            return
        core.discover(action.name, found)
        if old is None and not found.known:
            why = found.fault or f"formiga catalogue add {action.name} lets tasks use it"
            core.effect(
                Alarm("action_unknown", f"{agent} announces {action.name}, which no catalogue has: {why}", "", agent)
            )

    def learn(self, given: Learn) -> None:
        """A person lets an announced action be used.

        Raises:
            TaskError: `not_approver`, `unknown_action`, `bad_action`.
        """
        core, found = self._core, self._core.state.discovered.get(given.action)
        if core.site.mode == "real":
            check_approver(core.site, given.by)
        if found is None:
            raise TaskError("unknown_action", f"no agent has announced an action '{given.action}' that nobody knows")
        if found.fault:
            raise TaskError("bad_action", f"{given.action} cannot be used: {found.fault}")
        if not found.known:
            core.discover(given.action, replace(found, known=True, by=given.by, at=core.now))
            for name in found.agents:
                agent = core.state.agents.get(name)
                if agent is not None and agent.type in found.types and given.action not in agent.actions:
                    core.put_agent(name, actions=(*agent.actions, given.action))


def text_of(action: CardAction, *, flies: bool) -> str:
    """Return an announced action as a text of the catalogue.

    Args:
        action: as the card says it.
        flies: whether agents of its type fly.
    """
    keys: dict[str, Any] = {"help": action.help} if action.help else {}
    for key, fields in (("fields", action.fields), ("result", action.result)):
        if fields:
            keys[key] = {name: _field(field) for name, field in fields.items()}
    if isinstance(action.requires, str) and action.requires:
        keys["requires"] = action.requires
    if action.effect:
        keys["effect"] = action.effect
    if action.moves_to:
        keys["moves_to"] = action.moves_to
    keys |= {key: True for key in ("starts_rotors", "lands") if flies or getattr(action, key)}
    if action.cuts:
        keys["cuts"] = True
    keys |= {key: value for key in ("repeatable", "exclusive") if (value := getattr(action, key)) is not None}
    for key in ("typical", "accept_timeout", "cancel_grace"):
        seconds = getattr(action, f"{key}_s")
        if seconds is not None:
            keys[key] = f"{seconds:g} s"
    text = json.dumps({"actions": {action.name: keys}}, ensure_ascii=False, indent=2)  # which is YAML, too
    return format_text(text, FILE).text or text


def fault_of(action: CardAction, text: str) -> str:
    """Return why an announced action cannot be used, or ""."""
    if action.cuts:
        return "it says that it cuts motors, which only an action of the catalogue may"
    spec, errors = read_announced(action.name, text)
    if spec is None:
        return "; ".join(f"{one.code} {one.message}" for one in errors) or "its name or its keys cannot be read"
    return ""


def _field(field: CardField) -> dict[str, Any] | str:
    if field.type.startswith(_LIST):
        return {"list": field.type.removeprefix(_LIST)}
    unit = UNITS.get(field.type, "")
    keys: dict[str, Any] = {"type": field.type}
    if field.values:
        keys["values"] = list(field.values)
    for key in ("default", "min", "max"):
        value = getattr(field, key)
        if isinstance(value, bool | str) or (isinstance(value, int | float) and not unit):
            keys[key] = value
        elif isinstance(value, int | float) and unit != "us":
            keys[key] = f"{value:g} {unit}"
    if field.optional or ("default" not in keys and field.default is not None):
        keys["optional"] = True
    if field.help:
        keys["help"] = field.help
    return keys
